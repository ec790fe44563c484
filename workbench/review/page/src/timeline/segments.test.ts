import { describe, expect, it } from "vitest";
import type { Segment } from "../api/messages";
import { findAt, findBetween, findFrom, findGap, findStep } from "./segments";

function make(onset: number, offset: number): Segment {
  return {
    id: `s${onset}`, onset, offset, label: "x", confidence: null, status: "proposed", origin: "model", revision: 0,
    kind: "interval",
  };
}

const SEGMENTS = [make(2, 5), make(5, 6), make(9, 12)];

describe("segments", () => {
  it("finds what a slow look finds", () => {
    for (let frame = 0; frame < 15; frame += 1) {
      expect(findAt(SEGMENTS, frame)).toBe(SEGMENTS.find((one) => one.onset <= frame && frame < one.offset) ?? null);
      const slow = SEGMENTS.findIndex((one) => one.offset > frame);
      expect(findFrom(SEGMENTS, frame)).toBe(slow < 0 ? 3 : slow);
    }
  });

  it("finds gaps, also before, behind and without segments", () => {
    expect(findGap(SEGMENTS, 0, 20)).toEqual({ onset: 0, offset: 2 });
    expect(findGap(SEGMENTS, 7, 20)).toEqual({ onset: 6, offset: 9 });
    expect(findGap(SEGMENTS, 15, 20)).toEqual({ onset: 12, offset: 20 });
    expect(findGap(SEGMENTS, 5, 20)).toBeNull();
    expect(findGap([], 5, 20)).toEqual({ onset: 0, offset: 20 });
  });

  it("goes on from the chosen one, else from the frame", () => {
    expect(findStep(SEGMENTS, "s2", 11, 1)?.id).toBe("s5");
    expect(findStep(SEGMENTS, "s2", 11, -1)).toBeNull();
    expect(findStep(SEGMENTS, null, 7, 1)?.id).toBe("s9");
    expect(findStep(SEGMENTS, null, 7, -1)?.id).toBe("s5");
    expect(findStep(SEGMENTS, "gone", 0, 1)?.id).toBe("s2");
    expect(findStep(SEGMENTS, null, 9, 1)).toBeNull();
  });

  it("finds all between two, whichever comes first", () => {
    expect(findBetween(SEGMENTS, "s9", "s2").map((one) => one.id)).toEqual(["s2", "s5", "s9"]);
    expect(findBetween(SEGMENTS, "s5", "s5").map((one) => one.id)).toEqual(["s5"]);
    expect(findBetween(SEGMENTS, "s5", "gone")).toEqual([]);
  });
});
