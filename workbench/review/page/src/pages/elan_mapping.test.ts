import { expect, it } from "vitest";
import type { ElanPreview } from "../api/messages";
import { chosenTiers, countSegments, findClashes, startMapping } from "./elan_mapping";

const preview: ElanPreview = {
  warnings: [],
  tiers: [
    { name: "affect-1", tier: "affect", segments: 3, problems: [] },
    { name: "affect", tier: "affect", segments: 9, problems: [] },
    { name: "gloss", tier: null, segments: 4, problems: [] },
    { name: "mouth", tier: "mouth", segments: 20, problems: ["two segments overlap at 1.2 s"] },
  ],
};

it("starts with the fuller tier, and leaves out what has problems", () => {
  const mapping = startMapping(preview);
  expect(mapping).toEqual({ affect: "affect", "affect-1": null, gloss: null, mouth: null });
  expect(chosenTiers(mapping)).toEqual({ affect: "affect" });
  expect(countSegments(preview, mapping)).toBe(9);
});

it("finds two that would go into one", () => {
  expect(findClashes({ a: "x", b: "x", c: "y", d: null, e: null })).toEqual(["x"]);
  expect(findClashes({ a: null, b: null })).toEqual([]);
});
