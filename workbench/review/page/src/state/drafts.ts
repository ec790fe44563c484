/** What an answer changes in a draft, and whether an edit still means what it meant. Pure functions. */
import type { Draft, EditAnswer, Operation, Segment } from "../api/messages";

/** Segments in time order; points that share a frame in the order of their ids. */
function sortSegments(segments: Segment[]): Segment[] {
  return segments.sort((a, b) => a.onset - b.onset || a.offset - b.offset || (a.id < b.id ? -1 : 1));
}

/** Return the draft as the server has it after an edit. An answer that the draft holds already changes nothing. */
export function applyAnswer(draft: Draft, answer: EditAnswer): Draft {
  if (answer.version <= draft.version) return draft;
  const tiers = draft.tiers.map((tier) => {
    const changes = answer.changes.filter((one) => one.tier === tier.tier);
    if (changes.length === 0) return tier;
    const segments = new Map(tier.segments.map((one) => [one.id, one]));
    for (const change of changes) {
      for (const id of change.removed) segments.delete(id);
      for (const one of change.added) segments.set(one.id, one);
    }
    return { ...tier, segments: sortSegments([...segments.values()]) };
  });
  return {
    ...draft, tiers, version: answer.version, undo: answer.undo, redo: answer.redo, unpublished: answer.unpublished,
  };
}

/** Whether the answer speaks of a tier that the draft does not have here (it has to be fetched). */
export function knowsTiers(draft: Draft, answer: EditAnswer): boolean {
  return answer.changes.every((change) => draft.tiers.some((tier) => tier.tier === change.tier));
}

/**
 * The segments that an operation was made about: those it names and those that would give way.
 *
 * Where they are the same in a newer draft (another tab edited meanwhile), the operation still means the same.
 */
export function concernedSegments(draft: Draft, operation: Operation): Segment[] {
  const segments = draft.tiers.find((one) => one.tier === operation.tier)?.segments ?? [];
  switch (operation.kind) {
    case "accept":
    case "relabel":
    case "merge":
    case "delete": {
      const named = new Set(operation.segments);
      return segments.filter((one) => named.has(one.id));
    }
    case "split":
      return segments.filter((one) => one.id === operation.segment);
    case "move": {
      const moved = segments.find((one) => one.id === operation.segment);
      if (moved === undefined) return [];
      // A frame more on both sides: the neighbours that touch move along.
      const first = Math.min(moved.onset, operation.onset ?? moved.onset) - 1;
      const last = Math.max(moved.offset, operation.offset ?? moved.offset) + 1;
      return overlapping(segments, first, last);
    }
    case "add":
    case "settle":
      return overlapping(segments, operation.onset, operation.offset);
    case "take-over":
      return segments;
  }
}

/** Whether two lists hold the same segments in the same state. */
export function areSame(before: Segment[], now: Segment[]): boolean {
  return before.length === now.length && before.every((one, index) => isSame(one, now[index]!));
}

/** Return the selection after an edit: what is still there; else what stands in its place; new segments first. */
export function followSelection(selection: string[], before: Segment[], after: Segment[], operation: string): string[] {
  const kept = selection.filter((id) => after.some((one) => one.id === id));
  const known = new Set(before.map((one) => one.id));
  const fresh = after.filter((one) => !known.has(one.id)).map((one) => one.id);
  if (operation === "add" && fresh.length > 0) return fresh.slice(0, 1);
  if (operation === "undo" || operation === "redo") {
    // What came back, or what changed, so that the person sees what was undone.
    const states = new Map(before.map((one) => [one.id, one]));
    const changed = after.filter((one) => {
      const was = states.get(one.id);
      return was === undefined || !isSame(was, one);
    });
    const still = kept.filter((id) => changed.some((one) => one.id === id));
    if (still.length > 0) return still;
    if (changed.length > 0) return [changed[0]!.id];
  }
  if (kept.length > 0) return operation === "split" || operation === "merge" ? kept.slice(0, 1) : kept;
  const gone = before.find((one) => one.id === selection[0]);
  if (gone === undefined) return kept;
  const instead = overlapping(after, gone.onset, gone.offset)[0];
  return instead === undefined ? [] : [instead.id];
}

/** The segments that have a frame in [onset, offset). */
function overlapping(segments: Segment[], onset: number, offset: number): Segment[] {
  return segments.filter((one) => one.onset < offset && one.offset > onset);
}

function isSame(a: Segment, b: Segment): boolean {
  return a.id === b.id && a.onset === b.onset && a.offset === b.offset && a.label === b.label && a.status === b.status;
}
