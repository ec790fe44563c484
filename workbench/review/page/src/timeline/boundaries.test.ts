import { describe, expect, it } from "vitest";
import type { Segment } from "../api/messages";
import { moveBoundary } from "./boundaries";

function make(id: string, onset: number, offset: number, kind: "interval" | "point" = "interval"): Segment {
  return { id, onset, offset, label: id, confidence: null, status: "proposed", origin: "model", revision: 0, kind };
}

/** a and b touch; a gap; c. */
const SEGMENTS = [make("a", 10, 20), make("b", 20, 30), make("c", 40, 50)];

function spans(segments: readonly Segment[] | undefined): string {
  return (segments ?? []).map((one) => `${one.id}${one.onset}-${one.offset}`).join(" ");
}

describe("moveBoundary", () => {
  it("moves a shared boundary for both", () => {
    const move = moveBoundary("t", SEGMENTS, "a", "offset", 24, 100);
    expect(spans(move?.segments)).toBe("a10-24 b24-30 c40-50");
    expect(move?.operation).toEqual({ kind: "move", tier: "t", segment: "a", offset: 24, together: true });
    expect(spans(moveBoundary("t", SEGMENTS, "b", "onset", 12, 100)?.segments)).toBe("a10-12 b12-30 c40-50");
  });

  it("leaves both at least a frame", () => {
    expect(moveBoundary("t", SEGMENTS, "a", "offset", 99, 100)?.frame).toBe(29);
    expect(moveBoundary("t", SEGMENTS, "a", "offset", 0, 100)?.frame).toBe(11);
    expect(moveBoundary("t", SEGMENTS, "b", "onset", 0, 100)?.frame).toBe(11);
  });

  it("moves one alone where it is asked to, up to the neighbour", () => {
    expect(spans(moveBoundary("t", SEGMENTS, "a", "offset", 15, 100, false)?.segments)).toBe("a10-15 b20-30 c40-50");
    expect(moveBoundary("t", SEGMENTS, "a", "offset", 25, 100, false)?.frame).toBe(20);
  });

  it("stops at a neighbour behind a gap and at the ends of the take", () => {
    expect(moveBoundary("t", SEGMENTS, "b", "offset", 99, 100)?.frame).toBe(40);
    expect(moveBoundary("t", SEGMENTS, "c", "onset", 5, 100)?.frame).toBe(30);
    expect(moveBoundary("t", SEGMENTS, "c", "offset", 500, 100)?.frame).toBe(100);
    expect(moveBoundary("t", SEGMENTS, "a", "onset", -3, 100)?.frame).toBe(0);
  });

  it("takes whole frames and knows when nothing moved", () => {
    expect(moveBoundary("t", SEGMENTS, "a", "onset", 9.6, 100)).toMatchObject({ frame: 10, isSame: true });
    expect(moveBoundary("t", SEGMENTS, "x", "onset", 5, 100)).toBeNull();
  });

  it("moves points whole", () => {
    const move = moveBoundary("t", [make("a", 0, 5), make("p", 8, 9, "point")], "p", "offset", 3, 100);
    expect(spans(move?.segments)).toBe("a0-5 p5-6");
  });

  it("never makes an overlap or an empty segment, wherever one drags", () => {
    for (const id of ["a", "b", "c"])
      for (const edge of ["onset", "offset"] as const)
        for (const together of [true, false])
          for (let frame = -5; frame < 110; frame += 1) {
            const moved = moveBoundary("t", SEGMENTS, id, edge, frame, 100, together)!.segments;
            moved.forEach((one, index) => {
              expect(one.offset).toBeGreaterThan(one.onset);
              expect(one.onset).toBeGreaterThanOrEqual(moved[index - 1]?.offset ?? 0);
              expect(one.offset).toBeLessThanOrEqual(100);
            });
          }
  });
});
