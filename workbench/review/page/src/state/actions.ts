/** What changes the state: every call to the server starts here. */
export { choose } from "./choosing";
export { discardUnsaved, describeStep, edit, redo, sendAgain, undo } from "./editing";
export { tell, tellError } from "./notices";
export { refresh } from "./refreshing";
export { enter, leave, saveSettings, start } from "./sessions";
export { tellTabs } from "./tabs";
export { openTake, type OpenOptions } from "./takes";
export { goTo, openItem } from "./walking";
