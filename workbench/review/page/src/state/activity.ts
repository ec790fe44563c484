/** How long somebody looks and works: time in which the page is seen and something was done, or plays. */
import { post } from "../api/client";
import type { Activity } from "../api/messages";
import { clock, scene } from "./state";

/** Seconds after the last key, click or played frame that still count: looking and thinking. */
export const THINKING = 30;
/** Seconds between two messages to the server. */
const EVERY = 30;

/** Counts seconds of work. Time is handed in (seconds, monotonic), so a wall clock that jumps changes nothing. */
export class ActivityMeter {
  #seconds = 0;
  #counted: number | null = null;
  #until = -Infinity;

  /** Something was done at `now`. */
  touch(now: number): void {
    this.count(now);
    this.#until = now + THINKING;
    this.#counted ??= now;
  }

  /** Count what passed until `now`. */
  count(now: number): void {
    if (this.#counted === null) return;
    const end = Math.min(now, this.#until);
    if (end > this.#counted) this.#seconds += end - this.#counted;
    this.#counted = now < this.#until ? now : null;
  }

  /** The page is hidden: nothing counts until something is done again. */
  stop(now: number): void {
    this.count(now);
    this.#counted = null;
    this.#until = -Infinity;
  }

  /** Return what was counted and begin anew, at most 120 s. */
  take(now: number): number {
    this.count(now);
    const seconds = Math.min(this.#seconds, 120);
    this.#seconds = 0;
    return seconds;
  }
}

/** Follow the person's work and tell the server; call once. */
export function followActivity(): void {
  const meter = new ActivityMeter();
  const now = () => performance.now() / 1000;
  const touch = () => {
    if (!document.hidden) meter.touch(now());
  };
  for (const event of ["keydown", "pointerdown", "wheel"]) window.addEventListener(event, touch, { passive: true,
    capture: true });
  let take = scene.value?.take ?? null;
  const report = () => {
    if (clock.playing.value) touch();
    const seconds = meter.take(now());
    const of = take;
    take = scene.value?.take ?? null;
    if (of === null || seconds < 0.5) return;
    // Not worth a word where it fails: it is a statistic.
    post<unknown>("/api/activity", { take: of, seconds } satisfies Activity).catch(() => undefined);
  };
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) {
      meter.stop(now());
      report();
    }
  });
  scene.subscribe((shown) => {
    if ((shown?.take ?? null) !== take) report();
  });
  setInterval(report, EVERY * 1000);
}
