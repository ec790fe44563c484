/** Times on the ruler: where ticks stand. */
import type { Range } from "./view";

/** Steps in seconds that people read easily; below them come single frames. */
const STEPS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600];

export interface Ticks {
  /** Frames between two ticks with a text; not whole. */
  major: number;
  /** Ticks without a text between two with one. */
  parts: number;
  /** Digits of a second that the texts need. */
  digits: number;
}

/** Choose ticks of which those with a text lie at least `apart` pixels from each other. */
export function chooseTicks(range: Range, width: number, rate: number, apart = 84): Ticks {
  const seconds = (((range.last - range.first) / rate) * apart) / Math.max(1, width);
  const step = STEPS.find((one) => one >= seconds) ?? Math.ceil(seconds / 3600) * 3600;
  const parts = [15, 30, 900, 1800].includes(step) ? 3 : step === 60 || step === 120 || step === 3600 ? 4 : 5;
  return { major: step * rate, parts, digits: step >= 1 ? 0 : step >= 0.1 ? 1 : 2 };
}
