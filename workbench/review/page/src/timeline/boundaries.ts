/** Moving a boundary: what it does to the segment and to its neighbour, before the server is asked. */
import type { Operation, Segment } from "../api/messages";

export type Edge = "onset" | "offset";

/** A boundary on its way; `segments` is the tier as it would be. */
export interface Move {
  operation: Operation;
  segments: Segment[];
  frame: number;
  /** Whether it is where it was. */
  isSame: boolean;
}

/**
 * Move one edge of a segment towards a frame, as far as it may go.
 *
 * An edge that touches a neighbour moves with it (both keep at least a frame) unless `together` is false; then, and
 * where there is a gap, it stops at the neighbour. Points stay one frame long and move whole.
 */
export function moveBoundary(
  tier: string, segments: readonly Segment[], id: string, edge: Edge, frame: number, frames: number, together = true,
): Move | null {
  const index = segments.findIndex((one) => one.id === id);
  const segment = segments[index];
  if (segment === undefined) return null;
  const before = segments[index - 1];
  const after = segments[index + 1];
  if (segment.kind === "point") {
    const onset = clamp(Math.round(frame), before?.offset ?? 0, (after?.onset ?? frames) - 1);
    const moved = { ...segment, onset, offset: onset + 1 };
    return {
      operation: { kind: "move", tier, segment: id, onset, offset: onset + 1 },
      segments: segments.with(index, moved), frame: onset, isSame: onset === segment.onset,
    };
  }
  const neighbour = edge === "onset" ? before : after;
  const isShared = sharesBoundary(segment, neighbour, edge) && together;
  const [least, most] =
    edge === "onset"
      ? [isShared ? neighbour!.onset + 1 : (neighbour?.offset ?? 0), segment.offset - 1]
      : [segment.onset + 1, isShared ? neighbour!.offset - 1 : (neighbour?.onset ?? frames)];
  const target = clamp(Math.round(frame), least, most);
  let changed = segments.with(index, { ...segment, [edge]: target });
  if (isShared) {
    const other = edge === "onset" ? { ...neighbour!, offset: target } : { ...neighbour!, onset: target };
    changed = changed.with(edge === "onset" ? index - 1 : index + 1, other);
  }
  const operation: Operation =
    edge === "onset"
      ? { kind: "move", tier, segment: id, onset: target, together }
      : { kind: "move", tier, segment: id, offset: target, together };
  return { operation, segments: changed, frame: target, isSame: target === segment[edge] };
}

/** Whether a neighbour ends where the segment begins (or the other way round). A point shares no boundary. */
function sharesBoundary(segment: Segment, neighbour: Segment | undefined, edge: Edge): boolean {
  if (neighbour === undefined || neighbour.kind === "point") return false;
  return edge === "onset" ? neighbour.offset === segment.onset : neighbour.onset === segment.offset;
}

function clamp(value: number, least: number, most: number): number {
  return Math.max(least, Math.min(most, value));
}
