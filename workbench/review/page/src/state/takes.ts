/** Opening a take: what is shown of it and the person's draft, fetched together. */
import { batch } from "@preact/signals";
import { ApiError, get } from "../api/client";
import type { Draft, Scene } from "../api/messages";
import { recallBeside } from "./beside";
import { choose } from "./choosing";
import { describeError, tellError } from "./notices";
import { showDraft, usualTier } from "./refreshing";
import {
  activeSegments, activeTier, beside, clock, draft, marked, opening, purpose, range, scene, selection, session,
  takeProblem,
} from "./state";

export interface OpenOptions {
  /** Another than the current one. */
  solve?: string;
  frame?: number;
  segment?: string;
  tier?: string;
}

interface Place {
  take: string;
  frame: number;
  range: { first: number; last: number };
  tier: string | null;
  segment: string | null;
}

/** Where the person was in each take that this page has shown. */
const places = new Map<string, Place>();
let latest = 0;

/** Open a take (its current solve unless one is named), keep clock and timeline where it was open already. */
export async function openTake(take: string, options: OpenOptions = {}): Promise<void> {
  const turn = (latest += 1);
  const of = purpose.value;
  rememberPlace();
  opening.value = take;
  try {
    const [shown, fetched] = await Promise.all([
      get<Scene>("/api/scene", { take, solve: options.solve ?? null }),
      get<Draft>("/api/draft", { take, purpose: of }),
    ]);
    // The person asked for another take meanwhile.
    if (turn !== latest || of !== purpose.value) return;
    batch(() => {
      const open = scene.value;
      scene.value = shown;
      takeProblem.value = null;
      if (open?.take === shown.take && open.frames === shown.frames && draft.value?.purpose === of) {
        showDraft(fetched, take);
      } else {
        draft.value = fetched;
        comeBack(shown, fetched, places.get(take));
        if (open?.take !== shown.take) beside.value = recallBeside(shown);
      }
      if (options.tier !== undefined && fetched.tiers.some((one) => one.tier === options.tier)) {
        activeTier.value = options.tier;
      }
      if (options.frame !== undefined) clock.seek(options.frame);
      if (options.segment !== undefined) choose(options.segment, { seek: options.frame === undefined });
    });
    keepPlace();
  } catch (error) {
    if (turn !== latest) return;
    if (scene.value?.take === take || (error instanceof ApiError && error.kind === "no-session")) tellError(error);
    else takeProblem.value = { take, message: describeError(error) };
  } finally {
    if (turn === latest) opening.value = null;
  }
}

function comeBack(shown: Scene, fetched: Draft, place: Place | undefined): void {
  const known = place !== undefined && place.range.last <= shown.frames ? place : undefined;
  clock.open(shown.rate, shown.frames, known?.frame ?? 0);
  range.value = known?.range ?? { first: 0, last: shown.frames };
  const tier = known?.tier ?? activeTier.value;
  activeTier.value = fetched.tiers.some((one) => one.tier === tier) ? tier : usualTier(fetched);
  const there = known?.segment;
  selection.value = there != null && activeSegments.value.some((one) => one.id === there) ? [there] : [];
  marked.value = { onset: null, offset: null };
}

function rememberPlace(): void {
  const shown = scene.value;
  if (shown === null) return;
  places.set(shown.take, {
    take: shown.take, frame: clock.frame.value, range: range.value, tier: activeTier.value,
    segment: selection.value[0] ?? null,
  });
}

/** Write down where the person is, so that a page that is loaded anew begins there. */
export function keepPlace(): void {
  rememberPlace();
  const place = scene.value === null ? undefined : places.get(scene.value.take);
  const key = placeKey();
  if (place === undefined || key === null || purpose.value !== "own") return;
  try {
    localStorage.setItem(key, JSON.stringify(place));
  } catch {
    // Without storage the page begins at the queue's first take.
  }
}

/** The take where the person was when the page was last open; its place is known from then on. */
export function findPlace(): string | null {
  const key = placeKey();
  if (key === null) return null;
  try {
    const place = JSON.parse(localStorage.getItem(key) ?? "null") as Partial<Place> | null;
    if (typeof place?.take !== "string") return null;
    const { take, frame, range: view, tier, segment } = place;
    if (typeof frame === "number" && typeof view?.first === "number" && typeof view.last === "number") {
      places.set(take, { take, frame, range: { first: view.first, last: view.last }, tier: tier ?? null,
        segment: segment ?? null });
    }
    return take;
  } catch {
    return null;
  }
}

function placeKey(): string | null {
  const now = session.value;
  return now === null ? null : `mimique.place.${JSON.stringify([now.corpus, now.person])}`;
}
