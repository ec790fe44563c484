/**
 * The one clock: which frame is shown, and how time passes.
 *
 * Everything that moves (faces, video, playhead) follows `frame`; nothing else counts time. The clock is driven by the
 * browser's monotonic time (`performance.now`), so a wall clock that is set meanwhile changes nothing. It keeps time
 * and drops frames: a slow computer shows fewer pictures, never slower ones. `frame` changes at most once per picture.
 */
import { batch, signal } from "@preact/signals";

/** Speeds that can be chosen. */
export const SPEEDS = [0.25, 0.5, 1, 2, 4] as const;

/**
 * ms that may pass between two pictures. What is longer was no playing that anybody saw (the tab was hidden, the
 * computer slept): only this much of it counts, so that nobody misses a stretch, and no key that is held labels one.
 */
export const LONGEST_GAP = 1000;

/** A stretch that is played over and over, in frames, half-open. */
export interface Loop {
  onset: number;
  offset: number;
}

/** Where the time comes from; tests put their own here. */
export interface Ticker {
  now: () => number;
  /** Call back at the next picture, with the time then. */
  request: (callback: (now: number) => void) => unknown;
}

const BROWSER: Ticker = {
  now: () => performance.now(),
  request: (callback) => (typeof requestAnimationFrame === "undefined" ? null : requestAnimationFrame(callback)),
};

export class Clock {
  /** Frames per second of the take. */
  rate = 200;
  frames = 1;
  /** The frame that is shown, a whole number. */
  readonly frame = signal(0);
  readonly playing = signal(false);
  readonly speed = signal<number>(1);
  /** Played over and over where set, half-open. */
  readonly loop = signal<Loop | null>(null);
  /** Rises with every jump (seek, step, loop, another take), so that a video knows a jump from playing. */
  readonly jumps = signal(0);

  readonly #ticker: Ticker;
  /** Position in frames, not whole, at the time `#since`. */
  #anchor = 0;
  #since = 0;
  #last = 0;
  #requested = false;

  constructor(ticker: Ticker = BROWSER) {
    this.#ticker = ticker;
  }

  /** Seconds of the frame that is shown, from the take's first frame. */
  get seconds(): number {
    return this.frame.value / this.rate;
  }

  /** Begin with another take; it does not play. */
  open(rate: number, frames: number, frame = 0): void {
    if (!(rate > 0) || !Number.isFinite(rate)) throw new RangeError(`rate: expected Hz above 0, but got ${rate}`);
    batch(() => {
      this.playing.value = false;
      this.loop.value = null;
      this.rate = rate;
      this.frames = Math.max(1, Math.floor(frames) || 1);
      this.seek(frame);
    });
  }

  /** Play from the shown frame; from the start of the loop or of the take where there is nothing left to play. */
  play(): void {
    if (this.playing.value) return;
    const loop = this.loop.value;
    batch(() => {
      if (loop !== null && (this.frame.value < loop.onset || this.frame.value >= loop.offset)) this.seek(loop.onset);
      else if (loop === null && this.frame.value >= this.frames - 1) this.seek(0);
      this.#hold(this.#ticker.now());
      this.playing.value = true;
    });
    this.#request();
  }

  pause(): void {
    this.playing.value = false;
    this.#anchor = this.frame.value;
  }

  toggle(): void {
    if (this.playing.value) this.pause();
    else this.play();
  }

  /** Show a frame; the nearest one of the take. Goes on playing where it did. */
  seek(frame: number): void {
    const target = this.#clamp(frame);
    this.#anchor = target;
    this.#since = this.#last = this.#ticker.now();
    batch(() => {
      this.frame.value = target;
      this.jumps.value += 1;
    });
  }

  /** Stop, and go some frames on or back. */
  step(frames: number): void {
    batch(() => {
      this.pause();
      this.seek(this.frame.value + frames);
    });
  }

  /** Set the speed, 1 being as recorded; the nearest that can be chosen. */
  setSpeed(speed: number): void {
    const nearest = SPEEDS.reduce((best, one) => (Math.abs(one - speed) < Math.abs(best - speed) ? one : best));
    // What was played so far was played at the old speed.
    if (this.playing.value) this.#hold(this.#ticker.now());
    this.speed.value = nearest;
  }

  slower(): void {
    this.setSpeed([...SPEEDS].reverse().find((one) => one < this.speed.value) ?? SPEEDS[0]);
  }

  faster(): void {
    this.setSpeed(SPEEDS.find((one) => one > this.speed.value) ?? SPEEDS[SPEEDS.length - 1]!);
  }

  /** Play a stretch over and over; null to play on. At least one frame of the take has to lie in it. */
  setLoop(loop: Loop | null): void {
    if (loop === null) {
      this.loop.value = null;
      return;
    }
    const onset = this.#clamp(loop.onset);
    const offset = Math.min(this.frames, Math.max(onset + 1, Math.round(loop.offset)));
    this.loop.value = { onset, offset };
  }

  /** Let time pass until `now` (ms, monotonic). The browser calls this once per picture while playing. */
  tick(now: number): void {
    if (!this.playing.value) return;
    const gap = now - this.#last;
    // A picture's time stamp may lie a little before the moment at which playing began.
    if (gap <= 0) return;
    if (gap > LONGEST_GAP) this.#since += gap - LONGEST_GAP;
    this.#last = now;
    let position = this.#anchor + ((now - this.#since) / 1000) * this.rate * this.speed.value;
    const loop = this.loop.value;
    if (loop !== null && position >= loop.offset) {
      const length = loop.offset - loop.onset;
      position = this.#anchor >= loop.offset ? loop.onset : loop.onset + ((position - loop.onset) % length);
      this.#anchor = position;
      this.#since = now;
      batch(() => {
        this.frame.value = this.#clamp(position);
        this.jumps.value += 1;
      });
      return;
    }
    if (position >= this.frames) {
      batch(() => {
        this.frame.value = this.frames - 1;
        this.pause();
      });
      return;
    }
    this.frame.value = this.#clamp(position);
  }

  /** Where playing has come to by `now`, in frames, not whole. For what moves more finely than frames. */
  position(now: number = this.#ticker.now()): number {
    if (!this.playing.value) return this.frame.value;
    const passed = Math.max(0, Math.min(now - this.#since, this.#last - this.#since + LONGEST_GAP));
    return Math.min(this.#anchor + (passed / 1000) * this.rate * this.speed.value, this.frames);
  }

  /** Take the position at `now` as the new start to count from. */
  #hold(now: number): void {
    if (this.playing.value) {
      this.#anchor = this.position(now);
      this.#since = now;
    } else {
      this.#anchor = this.frame.value;
      this.#since = this.#last = now;
    }
  }

  #request(): void {
    if (this.#requested) return;
    this.#requested = true;
    this.#ticker.request((now) => {
      this.#requested = false;
      if (!this.playing.value) return;
      this.tick(now);
      if (this.playing.value) this.#request();
    });
  }

  #clamp(position: number): number {
    // 3 frames at 200 Hz are 0.015 s, and 0.015 * 200 is a little less than 3.
    const whole = Math.floor(Number.isNaN(position) ? 0 : position + 1e-6);
    return Math.min(Math.max(whole, 0), this.frames - 1);
  }
}
