import { describe, expect, it } from "vitest";
import { contrast, luminance, mix, parseHex } from "../labels/colours";
import { mixLabel, type Theme } from "./theme";

const LIGHT: Theme = {
  background: "#f3f4f5", surface: "#ffffff", text: "#1c2126", muted: "#545d66", line: "#d2d6da", grid: "#dde0e3",
  accent: "#1f5f99",
  warning: "#b3541e", playhead: "#c2255c", curves: [], isDark: false, font: "sans-serif",
};
const DARK: Theme = { ...LIGHT, background: "#1f2327", surface: "#2a2f34", text: "#e6e9ed", isDark: true };

describe("colours", () => {
  it("are read and mixed", () => {
    expect(parseHex("#0f8")).toEqual([0, 255, 136]);
    expect(parseHex("no colour")).toEqual([128, 128, 128]);
    expect(mix("#000000", "#ffffff", 0.25)).toBe("#bfbfbf");
    expect(luminance("#ffffff")).toBeCloseTo(1, 9);
    expect(contrast("#000000", "#ffffff")).toBeCloseTo(21, 9);
  });

  it("let every label be read in both themes", () => {
    // Okabe and Ito's colours, the extremes, and what nobody should choose.
    const colours = [
      "#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7", "#ffffff", "#ffff00",
      "#777777", "",
    ];
    for (const theme of [LIGHT, DARK])
      for (const colour of colours) {
        const mixed = mixLabel([colour], theme);
        expect(contrast(mixed.onTint, mixed.tint)).toBeGreaterThanOrEqual(4.5);
        expect(contrast(mixed.onTint, mixed.stripe)).toBeGreaterThanOrEqual(4);
        expect(contrast(mixed.onSolid, mixed.solid)).toBeGreaterThanOrEqual(4);
        expect(mixed.to).toBeNull();
        for (const other of colours) {
          const joined = mixLabel([colour, other], theme);
          expect(joined.tint).toBe(mixed.tint);
          expect(joined.to!.solid).toBe(mixLabel([other], theme).solid);
          for (const fill of [joined.tint, joined.stripe])
            expect(contrast(joined.onTint, fill)).toBeGreaterThanOrEqual(4);
        }
      }
  });
});
