/** The second face: which there are to choose from, and what is shown of the chosen one. */
import { effect, signal } from "@preact/signals";
import { get } from "../api/client";
import type { Scene, TakeRow } from "../api/messages";
import { beside } from "../state/state";

/** What the second face shows; null while there is none, or why it cannot be shown. */
export const besideScene = signal<{ scene: Scene } | { reason: string } | null>(null);

export interface Choice {
  /** As a select's option writes it; see readChoice. */
  value: string;
  name: string;
}

/** Other solves of a take, and other takes that have weights and may be shown. */
export function listChoices(scene: Scene, takes: readonly TakeRow[]): { solves: Choice[]; takes: Choice[] } {
  return {
    solves: scene.solves
      .filter((solve) => solve !== scene.solve)
      .map((solve) => ({ value: writeChoice(scene.take, solve), name: solve })),
    takes: takes
      .filter((row) => row.take !== scene.take && row.solve !== null && row.refusal === null && row.mode !== "none")
      .map((row) => ({ value: writeChoice(row.take, null), name: row.take })),
  };
}

/** Names may hold any character, so they are written as JSON. */
export function writeChoice(take: string, solve: string | null): string {
  return JSON.stringify([take, solve]);
}

export function readChoice(value: string): { take: string; solve: string | null } | null {
  if (value === "") return null;
  const [take, solve] = JSON.parse(value) as [string, string | null];
  return { take, solve };
}

/** Fetch what the second face shows whenever another one is chosen; returns what ends it. */
export function followBeside(): () => void {
  let stopLast = () => undefined as void;
  const stop = effect(() => {
    const chosen = beside.value;
    stopLast();
    if (chosen === null) {
      besideScene.value = null;
      return;
    }
    const controller = new AbortController();
    stopLast = () => controller.abort();
    get<Scene>("/api/scene", { take: chosen.take, solve: chosen.solve }, { signal: controller.signal }).then(
      (scene) => {
        if (!controller.signal.aborted) besideScene.value = { scene };
      },
      (error: unknown) => {
        if (controller.signal.aborted) return;
        besideScene.value = { reason: error instanceof Error ? error.message : String(error) };
      },
    );
  });
  return () => {
    stop();
    stopLast();
  };
}
