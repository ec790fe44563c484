/** Finding segments of one tier. Segments are in order and do not overlap. */
import type { Segment } from "../api/messages";

/** The index of the first segment that ends after a frame; the tier's length where none does. */
export function findFrom(segments: readonly Segment[], frame: number): number {
  let low = 0;
  let high = segments.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (segments[middle]!.offset > frame) high = middle;
    else low = middle + 1;
  }
  return low;
}

/** The segment that holds a frame; null where there is a gap. */
export function findAt(segments: readonly Segment[], frame: number): Segment | null {
  const segment = segments[findFrom(segments, frame)];
  return segment !== undefined && segment.onset <= frame ? segment : null;
}

/** The gap [onset, offset) around a frame; null where a segment holds it. */
export function findGap(
  segments: readonly Segment[], frame: number, frames: number,
): { onset: number; offset: number } | null {
  const index = findFrom(segments, frame);
  const next = segments[index];
  if (next !== undefined && next.onset <= frame) return null;
  return { onset: segments[index - 1]?.offset ?? 0, offset: next?.onset ?? frames };
}

/**
 * The segment some steps on from the chosen one, else from a frame; null past the ends.
 *
 * From a frame, the next one is the first that begins after it, the previous one the last that begins before it.
 */
export function findStep(
  segments: readonly Segment[], chosen: string | null, frame: number, step: 1 | -1,
): Segment | null {
  const index = chosen === null ? -1 : segments.findIndex((one) => one.id === chosen);
  if (index >= 0) return segments[index + step] ?? null;
  if (step === 1) return segments.find((one) => one.onset > frame) ?? null;
  return segments.findLast((one) => one.onset < frame) ?? null;
}

/** The segments from one to another, both included, in order. */
export function findBetween(segments: readonly Segment[], first: string, last: string): Segment[] {
  const from = segments.findIndex((one) => one.id === first);
  const to = segments.findIndex((one) => one.id === last);
  return from < 0 || to < 0 ? [] : segments.slice(Math.min(from, to), Math.max(from, to) + 1);
}
