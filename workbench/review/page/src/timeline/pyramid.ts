/**
 * Smallest and largest values of any stretch of a curve, quickly.
 *
 * Each level keeps the smallest and the largest of `FACTOR` entries of the level below, so the exact extremes of any
 * stretch take a few dozen comparisons however long it is, and an hour at 200 Hz is drawn by asking once per pixel.
 * Values that are not numbers (gaps) are passed over; a stretch of gaps alone answers NaN.
 */

const FACTOR = 8;

interface Level {
  size: number;
  low: Float32Array;
  high: Float32Array;
}

export class Pyramid {
  readonly length: number;
  readonly #levels: Level[] = [];

  constructor(readonly values: Float32Array) {
    this.length = values.length;
    let low = values;
    let high = values;
    let size = 1;
    while (low.length > 1) {
      const count = Math.ceil(low.length / FACTOR);
      const nextLow = new Float32Array(count);
      const nextHigh = new Float32Array(count);
      for (let block = 0; block < count; block += 1) {
        const end = Math.min(low.length, (block + 1) * FACTOR);
        let smallest = Infinity;
        let largest = -Infinity;
        // A comparison with NaN is false: gaps change neither.
        for (let index = block * FACTOR; index < end; index += 1) {
          if (low[index]! < smallest) smallest = low[index]!;
          if (high[index]! > largest) largest = high[index]!;
        }
        nextLow[block] = smallest === Infinity ? NaN : smallest;
        nextHigh[block] = largest === -Infinity ? NaN : largest;
      }
      size *= FACTOR;
      this.#levels.push({ size, low: nextLow, high: nextHigh });
      low = nextLow;
      high = nextHigh;
    }
  }

  /** Smallest and largest of [first, last), cut to the curve; NaN for both where there is no value. */
  extremes(first: number, last: number): [number, number] {
    let smallest = Infinity;
    let largest = -Infinity;
    const end = Math.min(last, this.length);
    let at = Math.max(0, first);
    while (at < end) {
      // The largest block that begins here and ends in time.
      let height = -1;
      while (height + 1 < this.#levels.length) {
        const size = this.#levels[height + 1]!.size;
        if (at % size !== 0 || at + size > end) break;
        height += 1;
      }
      if (height < 0) {
        const value = this.values[at]!;
        if (value < smallest) smallest = value;
        if (value > largest) largest = value;
        at += 1;
      } else {
        const level = this.#levels[height]!;
        const index = at / level.size;
        if (level.low[index]! < smallest) smallest = level.low[index]!;
        if (level.high[index]! > largest) largest = level.high[index]!;
        at += level.size;
      }
    }
    return smallest === Infinity || largest === -Infinity ? [NaN, NaN] : [smallest, largest];
  }
}

/**
 * The value that a part of all values lies below, from at most 20 000 of them; NaN where there is none.
 *
 * A curve's height on the screen follows it, so that one spike does not flatten the rest.
 */
export function findQuantile(values: Float32Array, part: number): number {
  const step = Math.max(1, Math.floor(values.length / 20_000));
  const kept: number[] = [];
  for (let index = 0; index < values.length; index += step) {
    const value = values[index]!;
    if (Number.isFinite(value)) kept.push(value);
  }
  if (kept.length === 0) return NaN;
  kept.sort((a, b) => a - b);
  return kept[Math.min(kept.length - 1, Math.floor(part * kept.length))]!;
}
