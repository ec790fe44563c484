/**
 * The active tier for those who do not see it: a list of its segments that can be walked, and what is chosen, said.
 *
 * A tier may hold thousands; those around the chosen one (or the playhead) are in the list, each with its place.
 */
import { computed } from "@preact/signals";
import type { Segment } from "../api/messages";
import { choose } from "../state/actions";
import { activeSegments, activeTier, chosen, clock, scene, selection } from "../state/state";
import { say } from "../words";
import { formatTime } from "../words/numbers";
import { shownRange } from "./painter";
import { findFrom } from "./segments";

const AROUND = 25;

/** A frame as a time in the language of the page. */
function writeTime(frame: number, digits = 3): string {
  return formatTime(frame, scene.value?.rate ?? clock.rate, digits);
}

/** A segment in words. */
function describeSegment(segment: Segment): string {
  return say("timeline.segment", {
    label: segment.label, from: writeTime(segment.onset), to: writeTime(segment.offset),
    status: say(`timeline.${segment.status}`),
    confidence:
      segment.confidence === null
        ? say("timeline.sure-unknown")
        : say("timeline.sure", { percent: Math.round(segment.confidence * 100) }),
  });
}

/** What the canvas shows, in one sentence. The playhead is told while nothing plays; it would never be silent else. */
export const summary = computed(() => {
  const current = scene.value;
  if (current === null) return say("timeline.summary-empty");
  const range = shownRange.value;
  const segments = activeSegments.value;
  const at = clock.playing.value ? clock.frame.peek() : clock.frame.value;
  return say("timeline.summary", {
    take: current.take, from: writeTime(range.first, 1), to: writeTime(range.last, 1),
    length: writeTime(current.frames, 1),
    at: writeTime(at), tier: activeTier.value ?? "–", count: segments.length,
    reviewed: segments.filter((one) => one.status !== "proposed").length,
  });
});

/** Where the list begins: around the chosen segment, else around the playhead as it stands still. */
const start = computed(() => {
  const segments = activeSegments.value;
  const index = segments.findIndex((one) => one.id === selection.value[0]);
  const frame = clock.playing.value ? clock.frame.peek() : clock.frame.value;
  return Math.max(0, (index >= 0 ? index : findFrom(segments, frame)) - AROUND);
});

export function SegmentList() {
  const segments = activeSegments.value;
  const first = start.value;
  return (
    <>
      <ul class="timeline-hidden" aria-label={say("timeline.segments", { tier: activeTier.value ?? "" })}>
        {segments.slice(first, first + 2 * AROUND + 1).map((segment, index) => (
          <li key={segment.id} aria-setsize={segments.length} aria-posinset={first + index + 1}>
            <button
              type="button"
              tabIndex={-1}
              aria-current={selection.value.includes(segment.id) ? "true" : undefined}
              onClick={() => choose(segment.id)}
            >
              {describeSegment(segment)}
            </button>
          </li>
        ))}
      </ul>
      <p class="timeline-hidden" aria-live="polite">{chosen.value === null ? "" : describeSegment(chosen.value)}</p>
    </>
  );
}
