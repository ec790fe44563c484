/**
 * Numbers per frame (weights, markers) that are fetched a stretch at a time, around where the person looks.
 *
 * A take of an hour has 720 000 frames; nobody waits for all of them. What is there is shown at once; where a frame is
 * not there yet, the nearest one that is known stands in for it, and `version` rises when something arrived.
 */
import { signal } from "@preact/signals";

/** Frames that are fetched at once: 5 s at 200 Hz, some 200 kB of weights. */
const CHUNK = 1024;
/** How much is kept; what was looked at longest ago goes first. */
const KEPT_BYTES = 48 * 2 ** 20;
/** Seconds of playing that are fetched ahead. */
const AHEAD = 3;
/** Fetched at the same time: what is looked at, and one ahead. */
const AT_ONCE = 2;
/** ms before a failed stretch is asked for again, longer each time. */
const PATIENCE = [500, 1000, 2000, 5000, 10_000];

export type Load = (first: number, count: number, stop: AbortSignal) => Promise<Float32Array>;

export interface Row {
  /** Whose numbers these are: the frame that was asked for, or the nearest that is known. */
  frame: number;
  values: Float32Array;
}

export interface ChunkOptions {
  frames: number;
  /** Numbers per frame. */
  width: number;
  load: Load;
  chunk?: number;
  keptBytes?: number;
}

export class ChunkedFrames {
  readonly frames: number;
  readonly width: number;
  /** Rises when something arrived; whoever shows the nearest frame looks again. */
  readonly version = signal(0);
  /** Why the last stretch did not come, for a person; null while all is well. It is asked for again by itself. */
  readonly failure = signal<string | null>(null);

  readonly #load: Load;
  readonly #chunk: number;
  readonly #most: number;
  /** By number, what was used longest ago first. */
  readonly #kept = new Map<number, Float32Array>();
  readonly #coming = new Map<number, AbortController>();
  /** Numbers of the stretches that are wanted now, the most urgent first. */
  #wanted: number[] = [];
  #failures = 0;
  #waiting: ReturnType<typeof setTimeout> | null = null;
  #closed = false;

  constructor(options: ChunkOptions) {
    this.frames = Math.max(0, options.frames);
    this.width = options.width;
    this.#load = options.load;
    this.#chunk = options.chunk ?? CHUNK;
    const bytes = this.#chunk * Math.max(1, this.width) * 4;
    this.#most = Math.max(4, Math.floor((options.keptBytes ?? KEPT_BYTES) / bytes));
  }

  /** How many stretches are kept, and how many are on their way. */
  get counts(): { kept: number; coming: number } {
    return { kept: this.#kept.size, coming: this.#coming.size };
  }

  /** The numbers of a frame, or of the nearest one that is known; null while nothing is. */
  at(frame: number): Row | null {
    const wanted = Math.min(Math.max(Math.floor(frame), 0), this.frames - 1);
    const exact = this.#kept.get(Math.floor(wanted / this.#chunk));
    if (exact !== undefined) return this.#row(wanted, exact);
    let best: Row | null = null;
    for (const [number, values] of this.#kept) {
      const first = number * this.#chunk;
      const last = first + values.length / this.width - 1;
      const near = Math.min(Math.max(wanted, first), last);
      if (best === null || Math.abs(near - wanted) < Math.abs(best.frame - wanted)) best = this.#row(near, values);
    }
    return best;
  }

  /**
   * Say what is looked at, so that it is fetched: this frame first, then what comes next.
   *
   * `pace` is in frames per second, 0 at rest. What is on its way and no longer wanted is stopped.
   */
  want(frame: number, pace = 0): void {
    if (this.#closed || this.frames === 0 || this.width === 0) return;
    const here = Math.min(Math.max(Math.floor(frame), 0), this.frames - 1);
    const number = Math.floor(here / this.#chunk);
    const wanted = [number];
    if (pace > 0) {
      const end = Math.floor(Math.min(here + pace * AHEAD, this.frames - 1) / this.#chunk);
      for (let next = number + 1; next <= Math.min(end, number + this.#most - 2); next++) wanted.push(next);
    } else {
      // At rest the next step may go either way: the nearer neighbour first.
      const isLate = here % this.#chunk >= this.#chunk / 2;
      for (const next of isLate ? [number + 1, number - 1] : [number - 1, number + 1]) {
        if (next >= 0 && next * this.#chunk < this.frames) wanted.push(next);
      }
    }
    const held = this.#kept.get(number);
    if (held !== undefined) {
      this.#kept.delete(number);
      this.#kept.set(number, held);
    }
    this.#wanted = wanted;
    for (const [coming, controller] of this.#coming) {
      if (!wanted.includes(coming)) {
        controller.abort();
        this.#coming.delete(coming);
      }
    }
    this.#fetchNext();
  }

  /** Stop fetching and forget everything. */
  close(): void {
    this.#closed = true;
    for (const controller of this.#coming.values()) controller.abort();
    this.#coming.clear();
    this.#kept.clear();
    if (this.#waiting !== null) clearTimeout(this.#waiting);
    this.#waiting = null;
  }

  #fetchNext(): void {
    if (this.#waiting !== null) return;
    for (const number of this.#wanted) {
      if (this.#coming.size >= AT_ONCE) return;
      if (!this.#kept.has(number) && !this.#coming.has(number)) void this.#fetch(number);
    }
  }

  async #fetch(number: number): Promise<void> {
    const controller = new AbortController();
    this.#coming.set(number, controller);
    const first = number * this.#chunk;
    const count = Math.min(this.#chunk, this.frames - first);
    try {
      const values = await this.#load(first, count, controller.signal);
      if (controller.signal.aborted) return;
      if (values.length !== count * this.width) {
        throw new Error(`expected ${count * this.width} numbers, but got ${values.length}`);
      }
      this.#kept.set(number, values);
      this.#forgetOldest();
      this.#failures = 0;
      this.#coming.delete(number);
      this.failure.value = null;
      this.version.value += 1;
    } catch (error) {
      if (controller.signal.aborted) return;
      this.#coming.delete(number);
      this.failure.value = error instanceof Error ? error.message : String(error);
      this.#wait();
      return;
    }
    this.#fetchNext();
  }

  #wait(): void {
    if (this.#waiting !== null || this.#closed) return;
    const patience = PATIENCE[Math.min(this.#failures, PATIENCE.length - 1)];
    this.#failures += 1;
    this.#waiting = setTimeout(() => {
      this.#waiting = null;
      this.#fetchNext();
    }, patience);
  }

  #forgetOldest(): void {
    for (const number of this.#kept.keys()) {
      if (this.#kept.size <= this.#most) return;
      if (!this.#wanted.includes(number)) this.#kept.delete(number);
    }
  }

  #row(frame: number, values: Float32Array): Row {
    const start = (frame % this.#chunk) * this.width;
    return { frame, values: values.subarray(start, start + this.width) };
  }
}
