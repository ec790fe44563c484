/** Commands of the page as a whole: dialogs, closing, walking between its parts. */
import { dialog, marked, notice, selection, type Dialog } from "../state/state";
import { cancelDrag } from "../timeline/gestures";
import type { Command } from "./commands";
import { isTextField } from "./focus";
import { dropHeld } from "./label_commands";

export function pageCommands(): Command[] {
  return [
    { id: "page.publish", group: "page", name: "command.publish", keys: ["Ctrl+S"], run: () => toggle("publish") },
    { id: "page.help", group: "page", name: "command.help", keys: ["?", "F1"], run: () => toggle("help") },
    { id: "page.manual", group: "page", name: "command.manual", keys: ["K"], run: () => toggle("manual") },
    { id: "page.escape", group: "page", name: "command.escape", keys: ["Escape"], run: escape },
    { id: "page.next-region", group: "page", name: "command.next-region", keys: ["F6"], run: () => walkRegions(1) },
    {
      id: "page.previous-region", group: "page", name: "command.previous-region", keys: ["Shift+F6"],
      run: () => walkRegions(-1),
    },
  ];
}

function toggle(name: Dialog): void {
  dialog.value = dialog.value === name ? null : name;
}

/** Close or clear what was done last: a drag, a held label, a field, the manual, in and out, the choice, the notice. */
function escape(): void {
  const focused = document.activeElement;
  if (cancelDrag() || dropHeld()) return;
  if (isTextField(focused)) {
    (focused as HTMLElement).blur();
    return;
  }
  if (dialog.value !== null) dialog.value = null;
  else if (marked.value.onset !== null || marked.value.offset !== null) marked.value = { onset: null, offset: null };
  else if (selection.value.length > 0) selection.value = [];
  else if (notice.value !== null) notice.value = null;
  else document.querySelector<HTMLElement>("[data-region=timeline]")?.focus({ preventScroll: true });
}

/** Put the focus into the next part of the page: its first control. From there Tab walks as everywhere. */
function walkRegions(step: 1 | -1): void {
  // A part within a part is none of its own.
  const regions = [...document.querySelectorAll<HTMLElement>("[data-region]")].filter(
    (one) => one.getClientRects().length > 0 && !one.parentElement?.closest("[data-region]"),
  );
  if (regions.length === 0) return;
  const here = regions.findIndex((one) => one.contains(document.activeElement));
  const next = regions[
    here < 0 ? (step === 1 ? 0 : regions.length - 1) : (here + step + regions.length) % regions.length
  ]!;
  const control = next.querySelector<HTMLElement>(
    "button:not(:disabled):not([tabindex='-1']), a[href], input:not(:disabled), select:not(:disabled), [tabindex='0']",
  );
  (control ?? next).focus();
}
