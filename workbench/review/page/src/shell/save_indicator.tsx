/** Whether everything is on disk: a word that is always in sight, and a strip that says what is not. */
import { discardUnsaved, describeStep, sendAgain } from "../state/actions";
import { saving } from "../state/state";
import { say } from "../words";
import { CheckIcon, WarningIcon } from "./icons";

export function SaveIndicator() {
  const now = saving.value;
  const hint = now.state === "saved" ? say("saving.saved-hint") : now.state === "unsaved" ? now.reason : undefined;
  return (
    <span class={`save save-${now.state}`} role="status" aria-live="polite" title={hint} data-saving={now.state}>
      {now.state === "saved" && <CheckIcon />}
      {now.state === "saving" && <span class="spinner" aria-hidden="true" />}
      {now.state === "unsaved" && <WarningIcon />}
      <span>{say(`saving.${now.state}`)}</span>
    </span>
  );
}

export function UnsavedStrip() {
  const now = saving.value;
  if (now.state !== "unsaved") return null;
  return (
    <div class="strip strip-warning" role="alert">
      <WarningIcon />
      <span class="grow">
        <strong>{say("unsaved.text", { step: describeStep(now.operation) })}</strong> {now.reason} {say("unsaved.kept")}
      </span>
      <button type="button" class="button button-small" onClick={sendAgain}>{say("unsaved.now")}</button>
      <button type="button" class="button button-small button-quiet" onClick={() => void discardUnsaved()}>
        {say("unsaved.discard")}
      </button>
    </div>
  );
}
