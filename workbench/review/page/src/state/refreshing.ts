/** Fetching again what may have changed at the server, at once or when edits have calmed down. */
import { batch } from "@preact/signals";
import { get } from "../api/client";
import type { CorpusMessage, Draft, Pace, Queue, Scheme } from "../api/messages";
import { activeTier, corpus, draft, pace, purpose, queue, scene, scheme, selection } from "./state";
import { tellError } from "./notices";

export type What = "corpus" | "draft" | "queue" | "scheme" | "pace";

/** Fetch again; what fails is said, and the page goes on with what it has. */
export async function refresh(what: What): Promise<void> {
  try {
    await fetchAgain(what);
  } catch (error) {
    tellError(error);
  }
}

/** Fetch again; raises. */
export async function fetchAgain(what: What): Promise<void> {
  switch (what) {
    case "corpus":
      corpus.value = await get<CorpusMessage>("/api/corpus");
      return;
    case "scheme":
      scheme.value = await get<Scheme>("/api/scheme");
      return;
    case "pace":
      pace.value = await get<Pace>("/api/pace");
      return;
    case "queue":
      queue.value = await get<Queue>("/api/queue");
      // The models' probabilities are computed meanwhile; they come with a later answer.
      if (!queue.value.ready) refreshLater("queue", 3000);
      return;
    case "draft": {
      const take = scene.value?.take;
      if (take === undefined) return;
      showDraft(await get<Draft>("/api/draft", { take, purpose: purpose.value }), take);
    }
  }
}

/** Take over a draft that was fetched, unless the person has moved on or it is older than the shown one. */
export function showDraft(fetched: Draft, take: string): void {
  if (scene.value?.take !== take || fetched.purpose !== purpose.value) return;
  const shown = draft.value;
  if (shown?.take === take && shown.purpose === fetched.purpose && fetched.version < shown.version) return;
  batch(() => {
    draft.value = fetched;
    countUnpublished(fetched);
    if (!fetched.tiers.some((one) => one.tier === activeTier.value)) activeTier.value = usualTier(fetched);
    const there = new Set(fetched.tiers.find((one) => one.tier === activeTier.value)?.segments.map((one) => one.id));
    if (!selection.value.every((id) => there.has(id))) selection.value = selection.value.filter((id) => there.has(id));
  });
}

/** Carry what a draft says of its unpublished edits over to the list of takes. */
export function countUnpublished(of: Pick<Draft, "take" | "purpose" | "unpublished">): void {
  const known = corpus.peek();
  if (known === null || of.purpose !== "own") return;
  if (known.takes.every((row) => row.take !== of.take || row.unpublished === of.unpublished)) return;
  const takes = known.takes.map((row) => (row.take === of.take ? { ...row, unpublished: of.unpublished } : row));
  corpus.value = { ...known, takes };
}

/** The tier to begin with: affect, else the first that holds something, else the first. */
export function usualTier(of: Draft): string | null {
  const tier =
    of.tiers.find((one) => one.tier === "affect") ?? of.tiers.find((one) => one.segments.length > 0) ?? of.tiers[0];
  return tier?.tier ?? null;
}

const timers = new Map<What, ReturnType<typeof setTimeout>>();

/** Fetch again after a while without another such wish, so that quick edits are not followed by a call each. */
export function refreshLater(what: What, milliseconds: number): void {
  clearTimeout(timers.get(what));
  timers.set(
    what,
    setTimeout(() => {
      timers.delete(what);
      // What fails here was not asked for by the person; the next edit or look finds out.
      fetchAgain(what).catch(() => undefined);
    }, milliseconds),
  );
}
