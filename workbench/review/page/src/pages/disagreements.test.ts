import { describe, expect, it } from "vitest";
import {
  type Disagreement, chooseWindow, findCandidates, findFirst, findNearest, findNext, findPart, findRest,
} from "./disagreements";

const at = (onset: number, settled = false): Disagreement => ({
  onset, offset: onset + 10, first: "joy", second: null, settled,
});

describe("going through disagreements", () => {
  const all = [at(0, true), at(20), at(40, true), at(60)];

  it("steps, and stops at the ends", () => {
    expect(findNext(all, 0, 1, false)).toBe(1);
    expect(findNext(all, 3, 1, false)).toBeNull();
    expect(findNext(all, 0, -1, false)).toBeNull();
  });

  it("finds the next open one around the end", () => {
    expect(findNext(all, 1, 1, true)).toBe(3);
    expect(findNext(all, 3, 1, true)).toBe(1);
    expect(findNext(all, 1, -1, true)).toBe(3);
    expect(findNext([at(0, true)], 0, 1, true)).toBeNull();
    expect(findNext([], 0, 1, true)).toBeNull();
    expect(findFirst(all)).toBe(1);
    expect(findFirst([at(0, true)])).toBe(0);
  });

  it("knows which one is nearest to a frame", () => {
    expect([0, 29, 33, 36, 1000].map((frame) => findNearest(all, frame))).toEqual([0, 1, 1, 2, 3]);
    expect(findNearest([], 3)).toBeNull();
  });
});

it("shows a part around one, within the take", () => {
  expect(chooseWindow(at(20), 10_000, 200)).toEqual({ first: 0, last: 180 });
  expect(chooseWindow({ ...at(1000), offset: 1400 }, 1500, 200)).toEqual({ first: 600, last: 1500 });
});

it("offers the readings' labels first, once", () => {
  expect(findCandidates({ ...at(0), second: "fear" }, ["anger", "fear"])).toEqual(["joy", "fear", "anger"]);
});

it("settles what in and out leave of it, and then the rest", () => {
  const one = at(20);
  const whole = { onset: 20, offset: 30 };
  expect(findPart(one, { onset: null, offset: null })).toEqual(whole);
  expect(findPart(one, { onset: 24, offset: null })).toEqual({ onset: 24, offset: 30 });
  expect(findPart(one, { onset: 0, offset: 25 })).toEqual({ onset: 20, offset: 25 });
  // In and out somewhere else are no part of it.
  expect(findPart(one, { onset: 40, offset: 50 })).toEqual(whole);
  expect(findRest(one, { onset: 20, offset: 24 })).toEqual({ onset: 24, offset: 30 });
  expect(findRest(one, { onset: 24, offset: 30 })).toEqual({ onset: 20, offset: 24 });
  expect(findRest(one, whole)).toEqual(whole);
  expect(findRest(one, null)).toEqual(whole);
});
