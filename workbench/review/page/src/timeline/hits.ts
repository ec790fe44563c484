/** What lies under the mouse. */
import type { Segment } from "../api/messages";
import type { Edge } from "./boundaries";
import type { Layout, TierRow } from "./layout";
import { OVERVIEW_HEIGHT } from "./layout";
import { findFrom } from "./segments";
import { toFrames, toPixels, type Range } from "./view";

/** Pixels to either side in which a boundary is caught. */
export const REACH = 5;

export type Hit =
  | { part: "overview" }
  | { part: "ruler" }
  | { part: "playhead" }
  | { part: "curve"; curve: string }
  | { part: "boundary"; row: TierRow; segment: Segment; edge: Edge }
  | { part: "segment"; row: TierRow; segment: Segment }
  | { part: "tier"; row: TierRow }
  | { part: "empty" };

/** Find what lies at a point of the canvas; boundaries can be caught in the active tier only. */
export function findHit(
  x: number, y: number, layout: Layout, range: Range, width: number, playhead: number, selected: ReadonlySet<string>,
): Hit {
  if (y < OVERVIEW_HEIGHT) return { part: "overview" };
  if (y < layout.rowsTop) return { part: "ruler" };
  const row = layout.tiers.find((one) => y >= one.top && y < one.top + one.height);
  if (row !== undefined) {
    const boundary = row.isActive ? findBoundary(x, row, range, width, selected) : null;
    if (boundary !== null) return { part: "boundary", row, ...boundary };
    const frame = toFrames(x, range, width);
    const segment = row.segments[findFrom(row.segments, frame)];
    if (segment !== undefined && segment.onset <= frame) return { part: "segment", row, segment };
    return { part: "tier", row };
  }
  if (Math.abs(x - toPixels(playhead, range, width)) <= REACH - 1) return { part: "playhead" };
  const curve = layout.curves.find((one) => y >= one.top && y < one.top + one.height);
  return curve === undefined ? { part: "empty" } : { part: "curve", curve: curve.curve };
}

/**
 * The boundary nearest to x, if any is in reach.
 *
 * Of two segments that touch, the chosen one is caught, else the one under the mouse. In a segment that is only a few
 * pixels wide a third of it stays free for choosing it.
 */
function findBoundary(
  x: number, row: TierRow, range: Range, width: number, selected: ReadonlySet<string>,
): { segment: Segment; edge: Edge } | null {
  const start = findFrom(row.segments, toFrames(x - REACH, range, width) - 1);
  let best: { segment: Segment; edge: Edge } | null = null;
  let nearest = Infinity;
  for (let index = Math.max(0, start - 1); index < row.segments.length; index += 1) {
    const segment = row.segments[index]!;
    const left = toPixels(segment.onset, range, width);
    const right = toPixels(segment.offset, range, width);
    if (left > x + REACH) break;
    if (right < x - REACH) continue;
    const inside = Math.min(REACH, (right - left) / 3);
    for (const [edge, at] of [["onset", left], ["offset", right]] as const) {
      const isInside = edge === "onset" ? x >= at : x <= at;
      const apart = Math.abs(x - at);
      if (apart > (isInside ? inside : REACH)) continue;
      const rank = apart - (selected.has(segment.id) ? REACH : 0) + (isInside ? 0 : 0.5);
      if (rank < nearest) {
        nearest = rank;
        best = { segment, edge };
      }
    }
  }
  return best;
}
