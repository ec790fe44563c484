import { describe, expect, it } from "vitest";
import { inkOn } from "../labels/colours";
import { differenceOf, findConfusions } from "./colours";

describe("differenceOf", () => {
  it("is CIE 1976: white to black is 100, a colour to itself 0", () => {
    expect(differenceOf("#ffffff", "#000000")).toBeCloseTo(100, 1);
    expect(differenceOf("#3366cc", "#3366CC", "deutan")).toBe(0);
    // Pure red and green in L*a*b* (D65): (53.24, 80.09, 67.20) and (87.73, -86.18, 83.18).
    expect(differenceOf("#ff0000", "#00ff00")).toBeCloseTo(Math.hypot(34.49, 166.27, 15.98), 0);
  });

  it("keeps greys grey for every vision", () => {
    for (const vision of ["protan", "deutan", "tritan"] as const) {
      expect(differenceOf("#404040", "#c0c0c0", vision)).toBeCloseTo(differenceOf("#404040", "#c0c0c0"), 1);
    }
  });
});

describe("findConfusions", () => {
  it("finds a red and a green of the same lightness, and nothing among Okabe and Ito's colours", () => {
    const bad = findConfusions([{ label: "joy", colour: "#b06a30" }, { label: "fear", colour: "#7f8030" }]);
    expect(bad).toMatchObject([{ first: "joy", second: "fear" }]);
    expect(bad[0]!.vision).not.toBe("usual");
    const safe = ["#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"];
    expect(findConfusions(safe.map((colour) => ({ label: colour, colour })))).toEqual([]);
  });

  it("leaves colours out that are none", () => {
    expect(findConfusions([{ label: "a", colour: "" }, { label: "b", colour: "" }])).toEqual([]);
  });
});

it("writes legibly", () => {
  expect(inkOn(["#f0e442"])).toBe("#14181d");
  expect(inkOn(["#0b2545"])).toBe("#ffffff");
});
