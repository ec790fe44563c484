/** One line for the person, over the stage; and what stands in the way of the whole corpus, under the top bar. */
import { useEffect } from "preact/hooks";
import { corpus, draft, notice } from "../state/state";
import { say } from "../words";
import { CloseIcon, WarningIcon } from "./icons";
import { Command } from "./pieces";

/** Milliseconds that a mere piece of information stays; warnings stay until they are dismissed or replaced. */
const INFO_STAYS = 6000;

export function NoticeBar() {
  const now = notice.value;
  useEffect(() => {
    if (now === null || now.tone !== "info") return;
    const timer = setTimeout(() => {
      if (notice.peek() === now) notice.value = null;
    }, INFO_STAYS);
    return () => clearTimeout(timer);
  }, [now]);
  return (
    <div class="notice-place" aria-live="polite" role="status">
      {now !== null && (
        <div class={`notice message message-${now.tone}`}>
          {now.tone !== "info" && <WarningIcon />}
          <span class="grow">
            {now.text} <Command text={now.command} />
          </span>
          <button
            type="button"
            class="button button-quiet button-icon button-small"
            aria-label={say("dismiss")}
            onClick={() => (notice.value = null)}
          >
            <CloseIcon />
          </button>
        </div>
      )}
    </div>
  );
}

export function ProblemStrips() {
  const gone = draft.value?.gone ?? null;
  return (
    <>
      {corpus.value?.problems.map((one) => (
        <div class="strip strip-warning" key={one.message}>
          <WarningIcon />
          <span class="grow">{one.message} <Command text={one.command} /></span>
        </div>
      ))}
      {gone !== null && (
        <div class="strip strip-warning">
          <WarningIcon />
          <span class="grow">{say("draft.gone")} <span class="soft">{gone}</span></span>
        </div>
      )}
    </>
  );
}
