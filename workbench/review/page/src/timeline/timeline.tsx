/** The timeline: curves, tiers and the playhead of the open take. */
import { effect } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { perform } from "../keyboard/bindings";
import { describeKeys } from "../keyboard/describing";
import { activeSegments, activeTier, clock, draft, range, scene, selection } from "../state/state";
import { say, type WordKey } from "../words";
import { CurveMenu } from "./curve_menu";
import { keepCurves } from "./curves";
import { listen } from "./gestures";
import { Gutter } from "./gutter";
import { GUTTER, OVERVIEW_HEIGHT, scrollToActive } from "./layout";
import { layout, Painter, scroll, shownRange, size } from "./painter";
import { held } from "./preview";
import { SegmentList, summary } from "./segment_list";
import "./timeline.css";
import { follow } from "./view";

/** The painter of the timeline that is mounted, for measuring; null where none is. */
export let painter: Painter | null = null;

export function Timeline() {
  const box = useRef<HTMLDivElement>(null);
  const base = useRef<HTMLCanvasElement>(null);
  const over = useRef<HTMLCanvasElement>(null);

  useLayoutEffect(() => {
    const [area, below, above] = [box.current, base.current, over.current];
    if (area === null || below === null || above === null) return;
    const watcher = new ResizeObserver(() => {
      size.value = { width: area.clientWidth, height: area.clientHeight };
    });
    watcher.observe(area);
    size.value = { width: area.clientWidth, height: area.clientHeight };
    const own = new Painter(below, above);
    painter = own;
    let before = clock.frame.peek();
    const stops = [
      () => watcher.disconnect(),
      () => own.stop(),
      listen(above),
      keepCurves(),
      effect(() => {
        const now = clock.frame.value;
        const view = shownRange.peek();
        const next = follow(view, before, now, clock.playing.peek(), scene.peek()?.frames ?? clock.frames);
        before = now;
        if (next !== view) range.value = next;
      }),
      effect(() => {
        void [activeTier.value, size.value, draft.value?.take];
        scroll.value = scrollToActive(layout.peek(), size.peek().height);
      }),
      effect(() => followScreen(own)),
      // Set here rather than in JSX: it changes with every step, the rest of the component does not.
      effect(() => below.setAttribute("aria-label", summary.value)),
    ];
    return () => {
      for (const stop of stops) stop();
      if (painter === own) painter = null;
    };
  }, []);

  return (
    <div class="timeline" role="group" data-region="timeline" tabIndex={-1} aria-label={say("timeline.name")}>
      <div class="timeline-corner" style={{ width: `${GUTTER}px`, height: `${layout.value.rowsTop}px` }}>
        <div style={{ height: `${OVERVIEW_HEIGHT}px` }}><CurveMenu /></div>
        <div class="timeline-zoom" role="group" aria-label={say("timeline.zoom")}>
          <ZoomButton id="view.zoom-out" name="timeline.zoom-out" path="M4 10h12" />
          <ZoomButton id="view.zoom-in" name="timeline.zoom-in" path="M4 10h12M10 4v12" />
          <ZoomButton
            id="view.zoom-segment" name="timeline.zoom-segment" path="M3 4v12M17 4v12M6.5 10h7"
            isOff={selection.value.length === 0}
          />
          <ZoomButton
            id="view.whole" name="timeline.whole" path="M3 10h14M6 6.5 2.5 10 6 13.5M14 6.5 17.5 10 14 13.5"
          />
        </div>
      </div>
      <Gutter />
      <div ref={box} class="timeline-area" style={{ left: `${GUTTER}px` }}>
        <canvas ref={base} class="timeline-canvas" role="img" />
        <canvas ref={over} class="timeline-canvas" aria-hidden="true" />
        <Hint />
      </div>
      <SegmentList />
    </div>
  );
}

/** What to do where a tier is empty. */
function Hint() {
  const current = draft.value;
  if (current === null || scene.value === null || activeSegments.value.length > 0 || held.value !== null) return null;
  const row = layout.value.tiers.find((one) => one.isActive);
  const text = current.tiers.length === 0 ? say("timeline.no-tiers") : say("timeline.no-segments");
  const top = row === undefined ? layout.value.rowsTop + 12 : row.top;
  return <p class="timeline-hint" style={{ top: `${top}px`, height: `${row?.height ?? 40}px` }}>{text}</p>;
}

function ZoomButton(props: { id: string; name: WordKey; path: string; isOff?: boolean }) {
  const keys = describeKeys(props.id);
  return (
    <button
      type="button"
      class="button button-small button-icon button-quiet"
      aria-label={say(props.name)}
      title={keys === "" ? say(props.name) : `${say(props.name)} (${keys})`}
      disabled={scene.value === null || props.isOff === true}
      onClick={() => void perform(props.id)}
    >
      <svg viewBox="0 0 20 20" aria-hidden="true"><path d={props.path} /></svg>
    </button>
  );
}

/** Draw again when the window moves to a screen with other pixels. */
function followScreen(own: Painter): () => void {
  let query = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
  const changed = () => {
    query.removeEventListener("change", changed);
    query = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
    query.addEventListener("change", changed);
    own.refresh();
  };
  query.addEventListener("change", changed);
  return () => query.removeEventListener("change", changed);
}
