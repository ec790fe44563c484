import { describe, expect, it } from "vitest";
import { clampShare, SHARES } from "./layout";
import { listValues, matchesTake, nameOf, readFrame } from "./matching";
import { rowsInSight } from "./rows";

describe("finding a take", () => {
  const row = { take: "S01_IE_Joy/2", signer: "Ève", protocol: "IE" };
  it("needs every word, in any order, in name, signer or protocol", () => {
    for (const typed of ["", "joy", "ÈVE ie", "2 s01"]) expect(matchesTake(row, typed)).toBe(true);
    for (const typed of ["fear", "joy fear"]) expect(matchesTake(row, typed)).toBe(false);
    expect(matchesTake({ take: "a", signer: null, protocol: null }, "null")).toBe(false);
  });
  it("lists values as people count", () => expect(listValues(["S10", "S2", null, "S2"])).toEqual(["S2", "S10"]));
});

describe("a frame that is typed", () => {
  it("has to be one of the take's boundaries", () => {
    expect(readFrame(" 12 ", 100)).toBe(12);
    expect(readFrame("100", 100)).toBe(100);
    for (const typed of [null, "", "101", "-1", "1.5", "1e1", "x"]) expect(readFrame(typed, 100)).toBeNull();
  });
});

describe("texts", () => {
  it("of places are their last part", () => {
    expect([nameOf("/data/lsf/"), nameOf("C:\\data\\lsf"), nameOf("lsf"), nameOf("/"),
      nameOf("s3://bucket/faces")]).toEqual(
      ["lsf", "lsf", "lsf", "/", "faces"],
    );
  });
});

describe("a long list", () => {
  it("shows every row that is in sight, whatever the scroll", () => {
    for (const count of [0, 1, 7, 10_000]) {
      for (const top of [0, 43, 44, 1000, 439_000, 1e9]) {
        const { first, end } = rowsInSight(count, top, 600);
        expect(first).toBeGreaterThanOrEqual(0);
        expect(end).toBeLessThanOrEqual(count);
        expect(end - first).toBeLessThan(30);
        const seen = Array.from({ length: 14 }, (_, index) => Math.floor(top / 44) + index).filter(
          (one) => one < count && one * 44 < top + 600,
        );
        for (const row of seen) expect(row >= first && row < end).toBe(true);
      }
    }
  });
});

it("the timeline keeps to sensible heights", () => {
  expect([clampShare(-1), clampShare(0.5), clampShare(2)]).toEqual([SHARES.least, 0.5, SHARES.most]);
});
