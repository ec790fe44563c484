/** A boundary of the chosen segment: its time, its frame to type, and buttons that nudge it. */
import { useEffect, useState } from "preact/hooks";
import type { Segment } from "../api/messages";
import { describeKeys, perform } from "../keyboard/bindings";
import { edit } from "../state/actions";
import { activeTier, clock, scene } from "../state/state";
import { say } from "../words";
import { formatTime } from "../words/numbers";
import { readFrame } from "./matching";

/** Frames that a nudge moves. */
const STEPS = [-10, -1, 1, 10] as const;

export function BoundaryField(props: { segment: Segment; which: "onset" | "offset" }) {
  const { segment, which } = props;
  const name = say(`segment.${which}`);
  const frame = segment[which];
  const rate = scene.value?.rate ?? 1;
  const [typed, setTyped] = useState<string | null>(null);
  useEffect(() => setTyped(null), [segment.id, frame]);

  const commit = () => {
    const wanted = readFrame(typed, clock.frames);
    const tier = activeTier.value;
    setTyped(null);
    if (wanted === null || wanted === frame || tier === null) return;
    void edit({ kind: "move", tier, segment: segment.id, [which]: wanted });
  };

  return (
    <div class="boundary" role="group" aria-label={name}>
      <span class="soft small">{name}</span>
      <button type="button" class="boundary-time number" title={name}
        onClick={() => clock.seek(which === "onset" ? frame : frame - 1)}>
        {formatTime(frame, rate)}
      </button>
      <input
        class="input number boundary-frame" inputMode="numeric" aria-label={say("segment.frame-of", { boundary: name })}
        value={typed ?? String(frame)} onInput={(event) => setTyped(event.currentTarget.value)} onBlur={commit}
        onKeyDown={(event) => {
          if (event.key === "Enter") commit();
          else if (event.key === "Escape") setTyped(null);
          else return;
          event.stopPropagation();
          event.currentTarget.blur();
        }}
      />
      <div class="button-group boundary-steps">
        {STEPS.map((step) => {
          const id = `edit.${which}-${step < 0 ? "earlier" : "later"}${Math.abs(step) === 10 ? "-10" : ""}`;
          const words = say(step < 0 ? "segment.earlier" : "segment.later", { boundary: name, frames: Math.abs(step) });
          const keys = describeKeys(id);
          return (
            <button type="button" class="button button-small" key={step} aria-label={words} data-command={id}
              title={keys === "" ? words : `${words} (${keys})`} onClick={() => void perform(id)}>
              {step < 0 ? `−${-step}` : `+${step}`}
            </button>
          );
        })}
      </div>
    </div>
  );
}
