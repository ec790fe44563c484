/** The two readings and what is settled, under each other around one disagreement, with the playhead over them. */
import { useComputed } from "@preact/signals";
import type { Adjudication, Segment } from "../api/messages";
import { clock } from "../state/state";
import { say } from "../words";
import { formatTime } from "../words/numbers";
import { type Disagreement, type Stretch, chooseWindow } from "./disagreements";
import { Strip } from "./pieces";

interface LanesProps {
  of: Adjudication;
  settled: Segment[];
  current: Disagreement;
  /** Of the current one: what is being settled. */
  part: Stretch;
  frames: number;
  rate: number;
  /** Of the strip of the whole take: the frame that was clicked. */
  onChoose: (frame: number) => void;
}

export function Lanes({ of, settled, current, part, frames, rate, onChoose }: LanesProps) {
  const { first, last } = chooseWindow(current, frames, rate);
  const percent = (frame: number): string => `${(100 * (frame - first)) / (last - first)}%`;
  const playhead = useComputed(() => clock.frame.value);
  const frameAt = (event: PointerEvent | MouseEvent, from: number, to: number): number => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    return Math.round(from + ((event.clientX - box.left) / Math.max(1, box.width)) * (to - from));
  };
  const seek = (event: PointerEvent): void => {
    clock.pause();
    clock.seek(frameAt(event, first, last));
  };
  const lane = (name: string, segments: Segment[], isSettled = false) => (
    <div class={`pages-lane${isSettled ? " pages-lane-settled" : ""}`}>
      <span class="pages-lane-name elide" title={name}>{name}</span>
      <Strip segments={segments} first={first} last={last} tier={of.tier} name={name} />
    </div>
  );
  return (
    <section class="pages-lanes" aria-label={say("settle.lanes")}>
      <div class="pages-lane">
        <span class="pages-lane-name soft small">{say("settle.take")}</span>
        <div class="pages-map" aria-hidden="true" onClick={(event) => onChoose(frameAt(event, 0, frames))}>
          {of.disagreements.map((one) => (
            <span
              key={one.onset}
              class={[
                "pages-map-one", one.settled && "pages-map-settled", one.onset === current.onset && "pages-map-current",
              ].filter(Boolean).join(" ")}
              style={{ left: `${(100 * one.onset) / frames}%`, width: `${(100 * (one.offset - one.onset)) / frames}%` }}
            />
          ))}
        </div>
      </div>
      {lane(of.first.author, of.first.segments)}
      {lane(of.second.author, of.second.segments)}
      {lane(say("settle.result"), settled, true)}
      <div class="pages-lane">
        <span class="pages-lane-name" />
        <div class="row spread number small soft">
          <span>{formatTime(Math.round(first), rate)}</span><span>{formatTime(Math.round(last), rate)}</span>
        </div>
      </div>
      <div
        class="pages-lanes-over"
        onPointerDown={(event) => { event.currentTarget.setPointerCapture(event.pointerId); seek(event); }}
        onPointerMove={(event) => { if (event.buttons === 1) seek(event); }}
      >
        <div
          class="pages-lanes-here"
          style={{ left: percent(part.onset), width: `${(100 * (part.offset - part.onset)) / (last - first)}%` }}
        />
        <Playhead frame={playhead.value} first={first} last={last} />
      </div>
    </section>
  );
}

function Playhead({ frame, first, last }: { frame: number; first: number; last: number }) {
  if (frame < first || frame > last) return null;
  return <div class="pages-lanes-playhead" style={{ left: `${(100 * (frame - first)) / (last - first)}%` }} />;
}
