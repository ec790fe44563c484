/** The overview in five numbers. */
import type { Overview } from "../api/messages";

export interface Sums {
  /** Takes on which somebody has reviewed or coded something. */
  begun: number;
  /** Of the person who is furthest on each take, so that two coders of one take do not count twice. */
  reviewed: number;
  segments: number;
  unpublished: number;
  active: number;
  /** Disagreements that are not settled. */
  open: number;
}

export function sumUp(of: Overview): Sums {
  const sums: Sums = { begun: 0, reviewed: 0, segments: 0, unpublished: 0, active: 0, open: 0 };
  for (const take of of.takes) {
    const furthest = take.by.reduce<(typeof take.by)[number] | null>(
      (best, one) => {
        if (best === null || one.reviewed > best.reviewed) return one;
        return one.reviewed === best.reviewed && one.segments > best.segments ? one : best;
      },
      null,
    );
    if (furthest === null) continue;
    sums.segments += furthest.segments;
    sums.reviewed += furthest.reviewed;
    if (furthest.reviewed > 0) sums.begun += 1;
  }
  for (const person of of.people) {
    sums.unpublished += person.unpublished;
    sums.active += person.active_seconds;
  }
  for (const one of of.to_settle) sums.open += Math.max(0, one.disagreements - one.settled);
  return sums;
}
