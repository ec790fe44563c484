import { describe, expect, it } from "vitest";
import type { Draft, Segment } from "../api/messages";
import { findHit } from "./hits";
import { layOut } from "./layout";

function make(id: string, onset: number, offset: number): Segment {
  return {
    id, onset, offset, label: id, confidence: null, status: "proposed", origin: "model", revision: 0, kind: "interval",
  };
}

const SEGMENTS = [make("a", 100, 300), make("b", 300, 500), make("c", 700, 704)];
const DRAFT = {
  tiers: [{ tier: "affect", source: null, segments: SEGMENTS }, { tier: "gaze", source: null, segments: SEGMENTS }],
  others: [],
} as unknown as Draft;
const LAYOUT = layOut(DRAFT, "affect", ["level"], 400, 0);
/** One pixel is one frame. */
const RANGE = { first: 0, last: 1000 };

function hit(x: number, y: number, selected: string[] = [], playhead = 900): ReturnType<typeof findHit> {
  return findHit(x, y, LAYOUT, RANGE, 1000, playhead, new Set(selected));
}
const ACTIVE = LAYOUT.tiers[0]!.top + 10;
const OTHER = LAYOUT.tiers[1]!.top + 10;

describe("findHit", () => {
  it("tells the strips apart", () => {
    expect(hit(50, 3).part).toBe("overview");
    expect(hit(50, LAYOUT.rowsTop - 2).part).toBe("ruler");
    expect(hit(50, LAYOUT.curves[0]!.top + 3)).toEqual({ part: "curve", curve: "level" });
    expect(hit(901, LAYOUT.curves[0]!.top + 3).part).toBe("playhead");
    expect(hit(50, 399).part).toBe("empty");
  });

  it("finds segments and the space between them", () => {
    expect(hit(200, ACTIVE)).toMatchObject({ part: "segment", segment: { id: "a" } });
    expect(hit(600, ACTIVE)).toMatchObject({ part: "tier", row: { tier: "affect" } });
    expect(hit(50, ACTIVE)).toMatchObject({ part: "tier" });
    expect(hit(990, ACTIVE)).toMatchObject({ part: "tier" });
  });

  it("catches boundaries of the active tier only", () => {
    expect(hit(103, ACTIVE)).toMatchObject({ part: "boundary", segment: { id: "a" }, edge: "onset" });
    expect(hit(97, ACTIVE)).toMatchObject({ part: "boundary", segment: { id: "a" }, edge: "onset" });
    expect(hit(504, ACTIVE)).toMatchObject({ part: "boundary", segment: { id: "b" }, edge: "offset" });
    expect(hit(110, ACTIVE).part).toBe("segment");
    expect(hit(103, OTHER).part).toBe("segment");
  });

  it("at a shared boundary takes the side under the mouse, or the chosen segment", () => {
    expect(hit(298, ACTIVE)).toMatchObject({ part: "boundary", segment: { id: "a" }, edge: "offset" });
    expect(hit(302, ACTIVE)).toMatchObject({ part: "boundary", segment: { id: "b" }, edge: "onset" });
    expect(hit(302, ACTIVE, ["a"])).toMatchObject({ part: "boundary", segment: { id: "a" }, edge: "offset" });
  });

  it("leaves the middle of a narrow segment free for choosing it", () => {
    expect(hit(702, ACTIVE)).toMatchObject({ part: "segment", segment: { id: "c" } });
    expect(hit(698, ACTIVE)).toMatchObject({ part: "boundary", segment: { id: "c" }, edge: "onset" });
  });
});
