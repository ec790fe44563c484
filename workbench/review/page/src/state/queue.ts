/** The queue: filtering, walking, and what an edit changes in it before the server counts anew. Pure functions. */
import type { EditAnswer, Queue, QueueItem, Segment } from "../api/messages";

export interface Filters {
  order: "usefulness" | "time";
  label: string | null;
  signer: string | null;
  status: "proposed" | "reviewed" | "all";
  /** Only segments whose confidence is at most this; 1 for all. */
  confidence: number;
  take: "this" | "all";
}

const names = new Intl.Collator("en", { numeric: true });

/** Return the items that pass the filters: in the server's order (expected usefulness), or by take and time. */
export function filterQueue(items: QueueItem[], chosen: Filters, take: string | null): QueueItem[] {
  const kept = items.filter(
    (item) =>
      (chosen.label === null || item.label === chosen.label) &&
      (chosen.signer === null || item.signer === chosen.signer) &&
      (chosen.status === "all" || (item.status === "proposed") === (chosen.status === "proposed")) &&
      (chosen.confidence >= 1 || item.confidence === null || item.confidence <= chosen.confidence) &&
      (chosen.take === "all" || item.take === take),
  );
  if (chosen.order === "usefulness") return kept;
  return kept.sort(
    (a, b) => names.compare(a.take, b.take) || compare(a.take, b.take) || a.onset - b.onset || compare(a.tier, b.tier),
  );
}

/** How many filters differ from those that show everything that is left. */
export function countFilters(chosen: Filters): number {
  const set = [chosen.label !== null, chosen.signer !== null, chosen.status !== "proposed", chosen.confidence < 1,
    chosen.take !== "all"];
  return set.filter(Boolean).length;
}

/** Where an item is in a list, -1 where it is not. */
export function findItem(items: QueueItem[], take: string | null, id: string | undefined): number {
  return id === undefined ? -1 : items.findIndex((one) => one.id === id && one.take === take);
}

/**
 * Return the index to go to, or -1 at the end.
 *
 * `current` is where the chosen segment stands in the list, -1 where it does not: it was accepted and left the list,
 * or none is chosen. Then `last`, the index where the list was before, already holds the next one.
 */
export function nextIndex(length: number, current: number, last: number, step: 1 | -1): number {
  const to = current >= 0 ? current + step : step === 1 ? Math.max(last, 0) : last - 1;
  return to >= 0 && to < length ? to : -1;
}

/**
 * Return the queue after an edit of a take: what was removed is gone, what was added stands in its place.
 *
 * `isTransition` tells of a tier's label whether the queue leaves it out.
 */
export function updateQueue(
  queue: Queue, take: string, changes: EditAnswer["changes"],
  isTransition: (tier: string, label: string) => boolean = () => false,
): Queue {
  let items = queue.items;
  for (const change of changes) {
    const removed = new Set(change.removed);
    const held = change.added.filter((one) => !isTransition(change.tier, one.label));
    const added = new Map(held.map((one) => [one.id, one]));
    const concerns = (item: QueueItem) =>
      item.take === take && item.tier === change.tier && (removed.has(item.id) || added.has(item.id));
    const first = items.findIndex(concerns);
    // A tier that the queue leaves out (transitions, blind takes) stays out.
    if (first < 0) continue;
    const model = items[first]!;
    const seconds = model.offset > model.onset ? model.seconds / (model.offset - model.onset) : 0;
    const kept: QueueItem[] = [];
    for (const item of items) {
      if (!concerns(item)) {
        kept.push(item);
        continue;
      }
      const now = added.get(item.id);
      if (now !== undefined) {
        kept.push(renewItem(item, now, seconds));
        added.delete(item.id);
      }
      if (item === model) for (const one of takeNew(added, items)) kept.push(renewItem(item, one, seconds));
    }
    items = kept;
  }
  return items === queue.items ? queue : { ...queue, items };
}

/** Those of `added` that no item of the queue stands for; they are taken out of `added`. */
function takeNew(added: Map<string, Segment>, items: QueueItem[]): Segment[] {
  const known = new Set(items.map((one) => one.id));
  const fresh = [...added.values()].filter((one) => !known.has(one.id));
  for (const one of fresh) added.delete(one.id);
  return fresh;
}

function renewItem(item: QueueItem, now: Segment, secondsPerFrame: number): QueueItem {
  return {
    ...item,
    id: now.id,
    onset: now.onset,
    offset: now.offset,
    seconds: (now.offset - now.onset) * secondsPerFrame,
    label: now.label,
    confidence: now.confidence,
    second: now.label === item.label ? item.second : "",
    status: now.status,
  };
}

function compare(a: string, b: string): number {
  return a < b ? -1 : a > b ? 1 : 0;
}
