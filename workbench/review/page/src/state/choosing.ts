/** Choosing a segment: the selection, the clock, and the part of the take that the timeline shows. */
import { batch } from "@preact/signals";
import type { Segment } from "../api/messages";
import { activeSegments, clock, range, selection } from "./state";

/** Choose a segment of the active tier, show it in the timeline, move the clock to its onset. */
export function choose(segment: string, options: { seek?: boolean } = {}): void {
  const found = activeSegments.value.find((one) => one.id === segment);
  if (found === undefined) return;
  batch(() => {
    selection.value = [segment];
    range.value = viewOf(found, range.value, clock.frames);
    // Who loops segments loops the next one too.
    if (clock.loop.value !== null) clock.setLoop({ onset: found.onset, offset: found.offset });
    if (options.seek ?? true) clock.seek(found.onset);
  });
}

/**
 * Return the frames to show so that a segment can be seen with what is around it: the view as it is where the segment
 * lies well within it, else moved, and only zoomed where the segment would not fit or could hardly be seen.
 */
export function viewOf(
  segment: Pick<Segment, "onset" | "offset">,
  view: { first: number; last: number },
  frames: number,
): { first: number; last: number } {
  const length = Math.max(1, segment.offset - segment.onset);
  let span = view.last - view.first;
  if (length > 0.8 * span) span = 2 * length;
  else if (length < span / 25) span = 12 * length;
  span = Math.min(Math.max(span, 1), frames);
  const margin = 0.05 * span;
  const kept = span === view.last - view.first;
  if (kept && segment.onset >= view.first + margin && segment.offset <= view.last - margin) return view;
  const middle = segment.onset + length / 2;
  const first = Math.min(Math.max(middle - span / 2, 0), Math.max(frames - span, 0));
  return { first, last: first + span };
}
