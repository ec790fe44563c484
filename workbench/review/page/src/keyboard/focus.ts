/**
 * Whose key it is: the page's commands, or the control's that has the focus.
 *
 * In a text field keys write. A control that was reached by the keyboard keeps the keys that work it; one that was
 * clicked does not, so that Space goes on playing after a click on a button.
 */

let wasByPointer = false;
let isPointerDown = false;

/** Keep in mind whether the focus came by the mouse; the returned function ends it. */
export function followFocus(): () => void {
  const down = () => (isPointerDown = true);
  const up = () => (isPointerDown = false);
  const focus = () => (wasByPointer = isPointerDown);
  window.addEventListener("pointerdown", down, true);
  window.addEventListener("pointerup", up, true);
  window.addEventListener("pointercancel", up, true);
  document.addEventListener("focusin", focus, true);
  return () => {
    window.removeEventListener("pointerdown", down, true);
    window.removeEventListener("pointerup", up, true);
    window.removeEventListener("pointercancel", up, true);
    document.removeEventListener("focusin", focus, true);
  };
}

const NO_TEXT = new Set([
  "button", "submit", "reset", "checkbox", "radio", "range", "color", "file", "image", "hidden",
]);

/** Whether keys write into an element. */
export function isTextField(element: Element | null): boolean {
  if (element === null) return false;
  const tag = element.tagName.toUpperCase();
  if (tag === "TEXTAREA" || tag === "SELECT") return true;
  if (tag === "INPUT") return !NO_TEXT.has((element.getAttribute("type") ?? "text").toLowerCase());
  return (element as HTMLElement).isContentEditable === true;
}

const PRESSED = ["Enter", "Space"];
const PRESSED_TAGS = new Set(["BUTTON", "A", "SUMMARY", "LABEL", "VIDEO"]);
const WALKED = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];

/** The keys that work a control, by what it is; without modifiers. */
export function keysOfControl(element: Element | null): string[] {
  if (element === null) return [];
  const tag = element.tagName.toUpperCase();
  const role = element.getAttribute("role") ?? "";
  if (tag === "INPUT" && element.getAttribute("type") === "range") return WALKED;
  if (["slider", "separator"].includes(role)) return [...WALKED, ...PRESSED];
  // The tiers are walked by commands of their own.
  if (role === "radio" && tag === "BUTTON") return PRESSED;
  if (["menuitem", "menuitemradio", "menuitemcheckbox", "option", "tab", "treeitem", "gridcell"].includes(role)) {
    return [...WALKED, ...PRESSED];
  }
  if (tag === "INPUT") return element.getAttribute("type") === "radio" ? [...WALKED, ...PRESSED] : PRESSED;
  const isPressed = PRESSED_TAGS.has(tag) || ["button", "link", "checkbox", "switch"].includes(role);
  return isPressed ? PRESSED : [];
}

/** Whether a key belongs to the element that has the focus rather than to a command. */
export function belongsToControl(element: Element | null, keys: string): boolean {
  if (element === null || element === document.body) return false;
  // A slider that was clicked is worked by its arrows all the same.
  const control = keysOfControl(element);
  const base = keys.replace(/^Shift\+/, "");
  if (wasByPointer) return control.includes("ArrowLeft") && WALKED.includes(base);
  if (base === "Tab") return control.length > 0;
  return control.includes(base);
}
