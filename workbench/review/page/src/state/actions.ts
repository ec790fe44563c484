/** What changes the state: every call to the server starts here. */
export { showBeside } from "./beside";
export { choose } from "./choosing";
export { discardUnsaved, describeStep, edit, redo, refuseWhileArriving, sendAgain, undo } from "./editing";
export { tell, tellError } from "./notices";
export { refresh } from "./refreshing";
export { enter, leave, start } from "./sessions";
export { saveSettings } from "./settings";
export { tellTabs } from "./tabs";
export { openTake, type OpenOptions } from "./takes";
export { goTo, openItem } from "./walking";
