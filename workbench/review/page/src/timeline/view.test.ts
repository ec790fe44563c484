import { describe, expect, it } from "vitest";
import { clampRange, FEWEST_FRAMES, fit, follow, panBy, scrollSpeed, toFrames, toPixels, zoomAt } from "./view";

describe("range", () => {
  it("stays in the take", () => {
    expect(clampRange({ first: -50, last: 50 }, 1000)).toEqual({ first: 0, last: 100 });
    expect(clampRange({ first: 950, last: 1050 }, 1000)).toEqual({ first: 900, last: 1000 });
    expect(clampRange({ first: 0, last: 5000 }, 1000)).toEqual({ first: 0, last: 1000 });
    expect(clampRange({ first: NaN, last: NaN }, 1000)).toEqual({ first: 0, last: 1000 });
    expect(clampRange({ first: 0, last: 1 }, 3)).toEqual({ first: 0, last: 3 });
  });

  it("keeps the frame under the cursor where it is, in and out, up to the ends", () => {
    const range = { first: 100, last: 300 };
    for (const factor of [0.5, 0.9, 1.3]) {
      const next = zoomAt(range, 150, factor, 10_000);
      expect(toPixels(150, next, 800)).toBeCloseTo(toPixels(150, range, 800), 9);
      expect(next.last - next.first).toBeCloseTo(200 * factor, 9);
    }
    expect(zoomAt(range, 150, 1e9, 10_000)).toEqual({ first: 0, last: 10_000 });
    const closest = zoomAt(range, 150, 1e-9, 10_000);
    expect(closest.last - closest.first).toBeCloseTo(FEWEST_FRAMES, 9);
  });

  it("pans to the ends and no further", () => {
    expect(panBy({ first: 10, last: 20 }, -100, 1000)).toEqual({ first: 0, last: 10 });
    expect(panBy({ first: 10, last: 20 }, 5000, 1000)).toEqual({ first: 990, last: 1000 });
  });

  it("shows an interval with its surroundings", () => {
    const range = fit(400, 500, 1000);
    expect(range.first).toBeLessThan(400);
    expect(range.last).toBeGreaterThan(500);
  });

  it("turns frames to pixels and back", () => {
    const range = { first: 12.5, last: 700.25 };
    for (const frame of [0, 12.5, 333.3, 900]) expect(
      toFrames(toPixels(frame, range, 640), range, 640)
    ).toBeCloseTo(frame, 9);
  });
});

describe("follow", () => {
  const range = { first: 100, last: 200 };
  it("leaves the view while the playhead is in it", () => expect(follow(range, 150, 151, true, 1000)).toBe(range));
  it("turns the page when the playhead leaves", () => {
    const next = follow(range, 199, 201, true, 1000);
    expect(next.first).toBeLessThan(201);
    expect(next.first).toBeGreaterThan(190);
  });
  it("leaves who looks elsewhere while it plays", () => expect(follow(range, 500, 501, true, 1000)).toBe(range));
  it("comes along with a step back", () => {
    const next = follow(range, 100, 99, false, 1000);
    expect(next.first).toBeLessThan(99);
    expect(next.last).toBeGreaterThan(99);
    expect(next.last).toBeLessThan(120);
  });
  it("comes along with a jump, playing or not", () => {
    for (const playing of [true, false]) {
      const next = follow(range, 150, 800, playing, 1000);
      expect(next.first).toBeLessThan(800);
      expect(next.last).toBeGreaterThan(800);
    }
  });
});

describe("scrollSpeed", () => {
  it("is none in the middle, and grows towards the end that was dragged to", () => {
    expect(scrollSpeed(500, 100, 1000)).toBe(0);
    expect(scrollSpeed(20, 5, 1000)).toBe(0);
    expect(scrollSpeed(0, 500, 1000)).toBeLessThan(scrollSpeed(20, 500, 1000));
    expect(scrollSpeed(20, 500, 1000)).toBeLessThan(0);
    expect(scrollSpeed(1000, 500, 1000)).toBe(-scrollSpeed(0, 500, 1000));
  });
});
