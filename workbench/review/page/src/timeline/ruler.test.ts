import { describe, expect, it } from "vitest";
import { chooseTicks } from "./ruler";

describe("chooseTicks", () => {
  it("keeps texts apart at every zoom", () => {
    for (let span = 8; span < 2_000_000; span *= 1.7) {
      const ticks = chooseTicks({ first: 0, last: span }, 1000, 200);
      const pixels = (ticks.major / span) * 1000;
      expect(pixels).toBeGreaterThanOrEqual(84 - 1e-9);
    }
  });
  it("says whole seconds where it can", () => {
    expect(chooseTicks({ first: 0, last: 2000 }, 1000, 200)).toEqual({ major: 200, parts: 5, digits: 0 });
    expect(chooseTicks({ first: 0, last: 720_000 }, 1000, 200).major).toBe(600 * 200);
  });
});
