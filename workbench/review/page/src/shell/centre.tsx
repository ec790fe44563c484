/** The middle: face and video above, the transport bar, the timeline below, with a line between that can be dragged. */
import type { ComponentChildren } from "preact";
import { useRef, useState } from "preact/hooks";
import { saveSettings } from "../state/actions";
import { corpus, opening, scene, starting, takeProblem } from "../state/state";
import { Stage } from "../stage/stage";
import { Transport } from "../stage/transport";
import { Timeline } from "../timeline/timeline";
import { say } from "../words";
import { clampShare, SHARES, timelineShare } from "./layout";
import { Spinner } from "./pieces";

/** Height of the line in px, as shell.css has it. */
const SPLITTER = 5;

export function Centre() {
  const whole = useRef<HTMLElement>(null);
  const [dragged, setDragged] = useState<number | null>(null);
  // Moves may come faster than pictures: what the pointer says is kept beside what is drawn.
  const held = useRef<number | null>(null);
  const share = dragged ?? timelineShare();
  const problem = takeProblem.value;

  if (problem !== null && opening.value === null) {
    return (
      <Waiting>
        <h2>{say("centre.refused")}</h2>
        <p class="elide">{problem.take}</p>
        <p class="soft">{problem.message}</p>
      </Waiting>
    );
  }
  if (scene.value === null) {
    const isBusy = starting.value || opening.value !== null;
    const none = corpus.value !== null && corpus.value.takes.every((one) => one.mode === "none");
    const words = say(none ? "centre.no-takes" : "centre.choose");
    return <Waiting>{isBusy ? <Spinner /> : <p class="soft">{words}</p>}</Waiting>;
  }

  const shareAt = (y: number) => {
    const box = whole.current?.getBoundingClientRect();
    const parts = [...(whole.current?.querySelectorAll<HTMLElement>(":scope > section") ?? [])];
    const height = parts.reduce((sum, one) => sum + one.offsetHeight, 0);
    if (box === undefined || height === 0) return share;
    // Between the line and the timeline lies the transport bar, which keeps its height.
    return clampShare((box.bottom - y - (box.height - height) + SPLITTER / 2) / height);
  };
  const keep = (value: number) => void saveSettings({ timelineShare: Math.round(clampShare(value) * 1000) / 1000 });

  return (
    <main class="centre" ref={whole}>
      <section class="centre-stage" data-region="" tabIndex={-1} aria-label={say("centre.stage")}
        style={{ flexGrow: 1 - share }}>
        <Stage />
      </section>
      <div
        class="splitter"
        role="separator"
        aria-orientation="horizontal"
        aria-label={say("centre.split")}
        aria-valuemin={SHARES.least * 100}
        aria-valuemax={SHARES.most * 100}
        aria-valuenow={Math.round(share * 100)}
        tabIndex={0}
        onPointerDown={(event) => {
          event.currentTarget.setPointerCapture(event.pointerId);
          held.current = share;
        }}
        onPointerMove={(event) => {
          if (held.current === null) return;
          held.current = shareAt(event.clientY);
          setDragged(held.current);
        }}
        onPointerUp={() => {
          if (held.current !== null && held.current !== timelineShare()) keep(held.current);
          held.current = null;
          setDragged(null);
        }}
        onPointerCancel={() => {
          held.current = null;
          setDragged(null);
        }}
        onDblClick={() => keep(SHARES.usual)}
        onKeyDown={(event) => {
          const step = event.key === "ArrowUp" ? 0.03 : event.key === "ArrowDown" ? -0.03 : 0;
          if (step === 0) return;
          event.preventDefault();
          event.stopPropagation();
          keep(share + step);
        }}
      />
      <Transport />
      <section class="centre-timeline" data-region="" tabIndex={-1} id="timeline" aria-label={say("centre.timeline")}
        style={{ flexGrow: share }}>
        <Timeline />
      </section>
    </main>
  );
}

function Waiting(props: { children: ComponentChildren }) {
  return <main class="centre centre-waiting"><div class="waiting">{props.children}</div></main>;
}
