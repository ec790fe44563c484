/** Walking through the queue as it is filtered. */
import { computed, effect } from "@preact/signals";
import { say } from "../words";
import { choose } from "./choosing";
import { tell } from "./notices";
import { findItem, nextIndex } from "./queue";
import { activeSegments, activeTier, clock, draft, purpose, scene, selection, session, shownQueue } from "./state";
import { openTake } from "./takes";
import type { QueueItem } from "../api/messages";

/** Where the chosen segment stands in the shown queue, -1 where it does not. */
export const place = computed<number>(() => findItem(shownQueue.value, scene.value?.take ?? null, selection.value[0]));

/** The item whose take is on its way: one walks on from there. */
let goal: QueueItem | null = null;

/** Where the queue was before the chosen segment left it. */
let last = 0;

/** Keep in mind where the queue is; call once. */
export function followPlace(): void {
  effect(() => {
    if (place.value >= 0) last = place.value;
  });
}

/** The next or previous item of the queue as it is filtered: opens its take where needed. */
export async function goTo(step: 1 | -1): Promise<void> {
  if (draft.value?.mode === "blind" || purpose.value === "adjudication") {
    stepInTier(step);
    return;
  }
  const items = shownQueue.value;
  const index = nextIndex(items.length, goal === null ? place.value : items.indexOf(goal), last, step);
  const item = items[index];
  if (item === undefined) {
    tell(say(items.length === 0 ? "queue.nothing" : step === 1 ? "queue.end" : "queue.start"));
    return;
  }
  await openItem(item);
}

/** Show an item of the queue; plays it in a loop where the person wants that. */
export async function openItem(item: QueueItem): Promise<void> {
  if (purpose.value !== "own") return;
  if (scene.value?.take === item.take && draft.value !== null) {
    if (activeTier.value !== item.tier) activeTier.value = item.tier;
    choose(item.id);
  } else {
    goal = item;
    try {
      await openTake(item.take, { segment: item.id, tier: item.tier });
    } finally {
      if (goal === item) goal = null;
    }
  }
  const chosen = activeSegments.value.find((one) => one.id === item.id);
  if (chosen === undefined || scene.value?.take !== item.take) return;
  if (session.value?.settings["playOnArrival"] === true) {
    clock.setLoop({ onset: chosen.onset, offset: chosen.offset });
    clock.play();
  }
}

function stepInTier(step: 1 | -1): void {
  const segments = activeSegments.value;
  const at = segments.findIndex((one) => one.id === selection.value[0]);
  const frame = clock.frame.value;
  const next =
    at >= 0 ? segments[at + step]
    : step === 1 ? segments.find((one) => one.onset >= frame)
    : segments.findLast((one) => one.onset < frame);
  if (next !== undefined) choose(next.id);
}
