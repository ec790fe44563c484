import { describe, expect, it } from "vitest";
import { viewOf } from "./choosing";

describe("the view of a segment", () => {
  const frames = 12_000;
  it("stays where the segment lies well within it", () => {
    const view = { first: 1000, last: 2000 };
    expect(viewOf({ onset: 1200, offset: 1400 }, view, frames)).toBe(view);
  });
  it("moves without zooming where it does not", () => {
    const view = viewOf({ onset: 5000, offset: 5200 }, { first: 1000, last: 2000 }, frames);
    expect(view).toEqual({ first: 4600, last: 5600 });
  });
  it("zooms out for a long segment, in for one that could hardly be seen", () => {
    expect(viewOf({ onset: 1000, offset: 3000 }, { first: 1000, last: 2000 }, frames)).toEqual({ first: 0,
      last: 4000 });
    const near = viewOf({ onset: 6000, offset: 6040 }, { first: 0, last: frames }, frames);
    expect(near.last - near.first).toBe(480);
  });
  it("never leaves the take", () => {
    for (const [onset, offset] of [[0, 20], [11_980, 12_000], [0, 12_000], [11_999, 12_000], [0, 1]] as const) {
      for (const view of [{ first: 0, last: 12_000 }, { first: 3000, last: 3010 }, { first: 11_000, last: 12_000 }]) {
        const now = viewOf({ onset, offset }, view, frames);
        expect(now.first).toBeGreaterThanOrEqual(0);
        expect(now.last).toBeLessThanOrEqual(frames);
        expect(now.first).toBeLessThanOrEqual(onset);
        expect(now.last).toBeGreaterThanOrEqual(offset);
      }
    }
  });
});
