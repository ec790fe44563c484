/** The keyboard: which command a key press runs now, and for how long. */
import { dialog, page, session } from "../state/state";
import { register, findCommand, type Command } from "./commands";
import { keymap } from "./describing";
import { editCommands } from "./edit_commands";
import { belongsToControl, followFocus, isTextField } from "./focus";
import { followLabels } from "./label_commands";
import { held } from "./held";
import { readPress } from "./keys";
import { moveCommands } from "./move_commands";
import { pageCommands } from "./page_commands";

export { describeKeys, keysOf, nameCommand } from "./describing";

/** Set while the help page waits for a key to bind: it gets every press. */
let recorder: ((event: KeyboardEvent) => void) | null = null;

export function record(listener: ((event: KeyboardEvent) => void) | null): void {
  recorder = listener;
}

/** Run a command from a button or a menu; whether it could run. */
export async function perform(id: string): Promise<boolean> {
  const command = findCommand(id);
  if (command === undefined || !(command.enabled?.() ?? true)) return false;
  await command.run();
  await command.release?.();
  return true;
}

/** Make the usual commands known and listen to the keyboard; the returned function ends it. */
export function installKeyboard(): () => void {
  register(...moveCommands(), ...editCommands(), ...pageCommands());
  const stops = [followLabels(), followFocus()];
  /** Keys that are down, by their place, with the command that lasts as long. */
  const lasting = new Map<string, Command>();

  const release = (code: string) => {
    const command = lasting.get(code);
    lasting.delete(code);
    if (command === undefined) return false;
    held.delete(command.id);
    void command.release?.();
    return true;
  };
  const releaseAll = () => [...lasting.keys()].forEach(release);
  const down = (event: KeyboardEvent) => {
    if (recorder !== null) {
      recorder(event);
      return;
    }
    if (event.isComposing || event.defaultPrevented) return;
    const found = findBinding(event);
    if (found === null) return;
    const { command, keys } = found;
    if (!(command.enabled?.() ?? true)) {
      // The browser goes back by Alt+left and saves the page by Ctrl+S: never here.
      if (/Ctrl\+|Alt\+/.test(keys)) event.preventDefault();
      return;
    }
    event.preventDefault();
    if (event.repeat && command.repeats !== true) return;
    if (command.release !== undefined && !event.repeat) {
      release(event.code);
      lasting.set(event.code, command);
      held.add(command.id);
    }
    void command.run();
  };
  const up = (event: KeyboardEvent) => {
    // Some browsers press a clicked button when Space is let go.
    if (release(event.code) || (event.code === "Space" && findBinding(event) !== null)) event.preventDefault();
  };
  const hide = () => {
    if (document.visibilityState === "hidden") releaseAll();
  };
  window.addEventListener("keydown", down, true);
  window.addEventListener("keyup", up, true);
  window.addEventListener("blur", releaseAll);
  document.addEventListener("visibilitychange", hide);
  return () => {
    releaseAll();
    window.removeEventListener("keydown", down, true);
    window.removeEventListener("keyup", up, true);
    window.removeEventListener("blur", releaseAll);
    document.removeEventListener("visibilitychange", hide);
    for (const stop of stops) stop();
  };
}

/** The command that a key press means here and now; null where the key is somebody else's. */
function findBinding(event: KeyboardEvent): { command: Command; keys: string } | null {
  if (session.peek() === null) return null;
  const target = event.target instanceof Element ? event.target : null;
  for (const keys of readPress(event)) {
    const id = keymap.peek().find.get(keys);
    const command = id === undefined ? undefined : findCommand(id);
    if (command === undefined) continue;
    return isOurs(command, keys, target) ? { command, keys } : null;
  }
  return null;
}

function isOurs(command: Command, keys: string, target: Element | null): boolean {
  const isEscape = command.id === "page.escape";
  // What opened over the page closes itself by Escape, and gets all other keys.
  if (document.querySelector("dialog:modal") !== null || (dialog.peek() !== null && dialog.peek() !== "manual")) {
    return command.id === "page.help" && dialog.peek() === "help" && !isTextField(target);
  }
  if (target?.closest("[role=menu], [role=dialog]:not(dialog), [aria-expanded=true]") != null) {
    const isFree = !isTextField(target) && !belongsToControl(target, keys);
    return !isEscape && isFree && target.closest("[role=menu]") === null;
  }
  if (isTextField(target)) return isEscape;
  if (page.peek() === "overview" && command.group !== "page") return false;
  return !belongsToControl(target, keys);
}
