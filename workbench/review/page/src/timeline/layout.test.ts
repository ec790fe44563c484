import { describe, expect, it } from "vitest";
import type { Draft } from "../api/messages";
import { layOut, OVERVIEW_HEIGHT, RULER_HEIGHT, scrollToActive } from "./layout";

const DRAFT: Draft = {
  take: "t", purpose: "own", author: "me", version: 0, base: "b", mode: "review", unpublished: 0, done: false,
  undo: null, redo: null,
  gone: null,
  tiers: ["affect", "gaze", "brow"].map((tier) => ({ tier, source: null, segments: [] })),
  others: [{ tier: "affect", author: "model", made_by: "model", segments: [] }],
};

describe("layOut", () => {
  it("puts rows one below the other, the active one tallest", () => {
    const layout = layOut(DRAFT, "gaze", ["level", "residual"], 420, 0);
    const rows = [...layout.curves, ...layout.tiers];
    let top = OVERVIEW_HEIGHT + RULER_HEIGHT;
    for (const row of rows) {
      expect(row.top).toBeGreaterThanOrEqual(top);
      top = row.top + row.height;
    }
    expect(layout.tiers.map((row) => row.tier)).toEqual(["affect", "gaze", "brow", "affect"]);
    const active = layout.tiers.find((row) => row.isActive)!;
    expect(Math.max(...layout.tiers.map((row) => row.height))).toBe(active.height);
    expect(top).toBeLessThanOrEqual(420);
  });

  it("takes room from the curves first, then scrolls, never past the end", () => {
    const [high, low] = [layOut(DRAFT, "brow", ["level"], 500, 0), layOut(DRAFT, "brow", ["level"], 160, 1e9)];
    expect(low.curves[0]!.height).toBeLessThan(high.curves[0]!.height);
    expect(high.scroll).toBe(0);
    expect(low.scroll).toBeCloseTo(low.contentHeight - (160 - low.rowsTop), 9);
  });

  it("scrolls until the active tier is seen", () => {
    const layout = layOut(DRAFT, "brow", ["level", "residual"], 170, 0);
    const again = layOut(DRAFT, "brow", ["level", "residual"], 170, scrollToActive(layout, 170));
    const row = again.tiers.find((one) => one.isActive)!;
    expect(row.top).toBeGreaterThanOrEqual(again.rowsTop);
    expect(row.top + row.height).toBeLessThanOrEqual(170);
    expect(scrollToActive(again, 170)).toBe(again.scroll);
  });

  it(
    "has no rows without a take", () => expect(layOut(null, null, [], 300, 50)).toMatchObject({ tiers: [], scroll: 0 }),
  );
});
