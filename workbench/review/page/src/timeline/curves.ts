/** The curves of the open take: fetched once, kept with what drawing them needs. */
import { computed, effect, signal } from "@preact/signals";
import { fetchCurve } from "../api/client";
import { scene, shownCurves } from "../state/state";
import { findQuantile, Pyramid } from "./pyramid";

export interface Curve {
  pyramid: Pyramid;
  /** What the row shows from bottom to top. */
  low: number;
  high: number;
}

export type Loading = Curve | "loading" | "failed";

/** By `curveKey`; of the takes that were open last. */
export const loadedCurves = signal<ReadonlyMap<string, Loading>>(new Map());

/** An hour of one curve is 3 MB; these many are kept. */
const MOST_KEPT = 40;

export function curveKey(take: string, solve: string | null, curve: string): string {
  return JSON.stringify([take, solve, curve]);
}

/** What is to be shown, as far as the open take has it. */
export const offeredCurves = computed<string[]>(() => {
  const current = scene.value;
  if (current === null || current.solve === null) return [];
  const offered = new Set([...current.curves.map((one) => one.name), ...current.shapes.map((one) => `shape:${one}`)]);
  return shownCurves.value.filter((one) => offered.has(one));
});

/** Prepare a curve: weights show 0 to 1, others 0 (or their least) to a little above nearly all values. */
export function prepareCurve(name: string, values: Float32Array): Curve {
  const pyramid = new Pyramid(values);
  const [least, most] = pyramid.extremes(0, values.length);
  if (name.startsWith("shape:")) {
    return { pyramid, low: Math.min(0, least || 0), high: Math.max(1, findQuantile(values, 0.999) || 0) };
  }
  const usual = findQuantile(values, 0.995) * 1.2;
  const high = Number.isFinite(usual) && usual > 0 ? Math.min(usual, most) : most > 0 ? most : 1;
  return { pyramid, low: Math.min(0, findQuantile(values, 0.005) || 0), high };
}

/** Fetch what is shown and not there yet, for as long as the returned function is not called. */
export function keepCurves(): () => void {
  return effect(() => {
    const current = scene.value;
    if (current === null) return;
    for (const curve of offeredCurves.value) void load(current.take, current.solve, curve);
  });
}

/** Forget a failure, so that the curve is asked for again. */
export function retryCurves(): void {
  loadedCurves.value = new Map([...loadedCurves.value].filter(([, one]) => one !== "failed"));
  const current = scene.value;
  if (current !== null) for (const curve of offeredCurves.value) void load(current.take, current.solve, curve);
}

async function load(take: string, solve: string | null, curve: string): Promise<void> {
  const key = curveKey(take, solve, curve);
  if (loadedCurves.peek().has(key)) return;
  put(key, "loading");
  try {
    put(key, prepareCurve(curve, await fetchCurve(take, solve, curve)));
  } catch {
    put(key, "failed");
  }
}

function put(key: string, value: Loading): void {
  const next = new Map(loadedCurves.peek());
  next.delete(key);
  next.set(key, value);
  while (next.size > MOST_KEPT) next.delete(next.keys().next().value!);
  loadedCurves.value = next;
}
