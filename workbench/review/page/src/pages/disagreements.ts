/** Where two readings of a take differ: which comes next, and what is shown around it. */
import type { Adjudication } from "../api/messages";

export type Disagreement = Adjudication["disagreements"][number];

/** Frames, half-open. */
export interface Stretch {
  onset: number;
  offset: number;
}

/** In and out, where they are set. */
export interface Marks {
  onset: number | null;
  offset: number | null;
}

/** What is shown around a disagreement: as much before and after it as it lasts itself, at least this long. */
const LEAST_CONTEXT = 0.75;

/** The next one in a direction; with `unsettled` one that is still open, going around the end. Null where none is. */
export function findNext(all: Disagreement[], from: number, step: 1 | -1, unsettled: boolean): number | null {
  if (!unsettled) {
    const next = from + step;
    return next >= 0 && next < all.length ? next : null;
  }
  for (let passed = 1; passed <= all.length; passed += 1) {
    const at = (((from + step * passed) % all.length) + all.length) % all.length;
    if (!all[at]!.settled) return at;
  }
  return null;
}

/** The first open one at or after a frame, else the first open one, else the first. */
export function findFirst(all: Disagreement[]): number {
  const open = all.findIndex((one) => !one.settled);
  return open >= 0 ? open : 0;
}

/** The one that is nearest to a frame; null where there is none. */
export function findNearest(all: Disagreement[], frame: number): number | null {
  const distance = (one: Disagreement): number => Math.max(one.onset - frame, frame - (one.offset - 1), 0);
  if (all.length === 0) return null;
  return all.reduce((best, one, index) => (distance(one) < distance(all[best]!) ? index : best), 0);
}

/** What in and out leave of a disagreement; all of it where they name no part of it. */
export function findPart(one: Disagreement, marks: Marks): Stretch {
  const onset = Math.max(one.onset, marks.onset ?? one.onset);
  const offset = Math.min(one.offset, marks.offset ?? one.offset);
  return onset < offset ? { onset, offset } : { onset: one.onset, offset: one.offset };
}

/** What is left of a disagreement after a part of it was settled: the longer side of the part; all of it else. */
export function findRest(one: Disagreement, part: Stretch | null): Stretch {
  const [before, behind] = part === null ? [0, 0] : [part.onset - one.onset, one.offset - part.offset];
  if (part === null || Math.max(before, behind) <= 0) return { onset: one.onset, offset: one.offset };
  return behind >= before ? { onset: part.offset, offset: one.offset } : { onset: one.onset, offset: part.onset };
}

/** The frames that are shown around a disagreement. */
export function chooseWindow(one: Disagreement, frames: number, rate: number): { first: number; last: number } {
  const around = Math.max(one.offset - one.onset, LEAST_CONTEXT * rate);
  return { first: Math.max(0, one.onset - around), last: Math.min(frames, one.offset + around) };
}

/** Every label that one could settle on, the two readings' first. */
export function findCandidates(one: Disagreement, labels: string[]): string[] {
  const said = [one.first, one.second].filter((label) => label !== null);
  return [...new Set([...said, ...labels])];
}
