/** What stands left of the rows: names and values of the curves, the tiers to choose from. */
import { effect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Segment } from "../api/messages";
import { findVocabulary, splitTransition } from "../labels/labels";
import { activeTier, clock, scene, scheme, selection } from "../state/state";
import { say, type WordKey } from "../words";
import { formatFixed } from "../words/numbers";
import { curveKey, loadedCurves, retryCurves } from "./curves";
import { scrollRows } from "./gestures";
import { GUTTER, type CurveRow, type TierRow } from "./layout";
import { findCurve, layout } from "./painter";
import { hover } from "./preview";

export function Gutter() {
  const element = useRef<HTMLDivElement>(null);
  const placed = layout.value;
  useEffect(() => {
    const box = element.current;
    box?.addEventListener("wheel", scrollRows, { passive: false });
    return () => box?.removeEventListener("wheel", scrollRows);
  }, []);
  const shift = (top: number) => top - placed.rowsTop;
  return (
    <div ref={element} class="timeline-gutter" style={{ top: `${placed.rowsTop}px`, width: `${GUTTER}px` }}>
      {placed.curves.map((row, index) => (
        <CurveName key={row.curve} row={row} top={shift(row.top)} index={index} />
      ))}
      <div role="radiogroup" aria-label={say("timeline.tiers")}>
        {placed.tiers.filter((row) => row.author === null).map((row) => (
          <TierName key={row.key} row={row} top={shift(row.top)} />
        ))}
      </div>
      {placed.tiers.filter((row) => row.author !== null).map((row) => (
        <OtherName key={row.key} row={row} top={shift(row.top)} />
      ))}
    </div>
  );
}

/** What a curve is called; weights by their shape. */
export function nameCurve(curve: string): string {
  if (curve.startsWith("shape:")) return curve.slice("shape:".length);
  const key = `timeline.curve.${curve}`;
  return isCurveKey(key) ? say(key) : curve;
}

const CURVE_KEYS = [
  "timeline.curve.velocity", "timeline.curve.acceleration", "timeline.curve.level", "timeline.curve.residual",
] as const satisfies readonly WordKey[];

function isCurveKey(key: string): key is (typeof CURVE_KEYS)[number] {
  return (CURVE_KEYS as readonly string[]).includes(key);
}

function CurveName(props: { row: CurveRow; top: number; index: number }) {
  const { curve, height } = props.row;
  const value = useRef<HTMLSpanElement>(null);
  const colour = `var(--curve-${(props.index % 4) + 1})`;
  const current = scene.value;
  const unit = current?.curves.find((one) => one.name === curve)?.unit ?? "";
  const state = current === null ? undefined : loadedCurves.value.get(curveKey(current.take, current.solve, curve));
  // The value follows the playhead (or the mouse) without drawing the component again.
  useEffect(
    () =>
      effect(() => {
        if (state === "loading") return;
        const known = findCurve(curve)?.pyramid.values[hover.value ?? clock.frame.value];
        const isKnown = known !== undefined && !Number.isNaN(known);
        const text = isKnown ? formatFixed(known, Math.abs(known) < 10 ? 2 : 1) : "–";
        if (value.current !== null) value.current.textContent = unit === "" ? text : `${text} ${unit}`;
      }),
    [curve, unit, state],
  );
  return (
    <div class="timeline-curve" style={{ top: `${props.top}px`, height: `${height}px` }}>
      <span class="timeline-curve-name" title={nameCurve(curve)}>
        <span class="timeline-curve-line" style={{ backgroundColor: colour }} aria-hidden="true" />
        <span class="timeline-elide">{nameCurve(curve)}</span>
      </span>
      {state === "failed" ? (
        <button type="button" class="timeline-again" onClick={retryCurves}>{say("timeline.curve-failed")}</button>
      ) : (
        <span class="timeline-curve-value" ref={value} key={state === "loading" ? "loading" : "known"}>
          {state === "loading" ? say("timeline.curve-loading") : ""}
        </span>
      )}
    </div>
  );
}

/** How many segments there are to review, and how many are; as in the queue, transitions follow their neighbours. */
function countReviewed(tier: string, segments: readonly Segment[]): { reviewed: number; count: number } {
  const vocabulary = findVocabulary(scheme.value, tier);
  const held = segments.filter((one) => splitTransition(vocabulary, one.label) === null);
  return { reviewed: held.filter((one) => one.status !== "proposed").length, count: held.length };
}

function TierName(props: { row: TierRow; top: number }) {
  const { tier, isActive, segments, height } = props.row;
  const counted = countReviewed(tier, segments);
  const count = say("timeline.tier-count", counted);
  return (
    <button
      type="button"
      role="radio"
      aria-checked={isActive}
      aria-label={`${say("timeline.tier", { tier })}. ${count}`}
      title={`${say("timeline.tier", { tier })}\n${count}`}
      class={isActive ? "timeline-tier timeline-tier-active" : "timeline-tier"}
      style={{ top: `${props.top}px`, height: `${height}px` }}
      onClick={() => {
        if (activeTier.value !== tier) selection.value = [];
        activeTier.value = tier;
      }}
    >
      <span class="timeline-elide">{tier}</span>
      {isActive && (
        <span class="timeline-tier-count" aria-hidden="true">
          <progress class="timeline-progress" value={counted.reviewed} max={Math.max(1, counted.count)} />
          {counted.reviewed}/{counted.count}
        </span>
      )}
    </button>
  );
}

const MADE_BY = { person: "timeline.by-person", model: "timeline.by-model", import: "timeline.by-import" } as const;

function OtherName(props: { row: TierRow; top: number }) {
  const { tier, author, madeBy, height } = props.row;
  const title = `${say("timeline.tier-of", { tier, author: author ?? "" })} (${say(MADE_BY[madeBy ?? "person"])})`;
  return (
    <div class="timeline-other" title={title} style={{ top: `${props.top}px`, height: `${height}px` }}>
      <span class="timeline-elide">{tier} · {author}</span>
    </div>
  );
}
