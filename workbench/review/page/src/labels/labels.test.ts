import { describe, expect, it } from "vitest";
import type { Scheme, SchemeLabel } from "../api/messages";
import { findColours, findLabel, fitsBetween, meansSame, nameLabel, spellLike, splitTransition } from "./labels";

const make = (label: string, colour: string, aliases: string[] = [], note = ""): SchemeLabel => ({
  label, colour, key: "", note, aliases, retired: false, segments: 0,
});
const affect = {
  name: "affect", tiers: ["affect"], transitions: true, manual: "",
  labels: [
    make("N", "#bfc4c9", ["neutral", "neutre"]), make("A", "#d55e00", ["anger", "colère"]),
    make("Sa", "#0072b2", ["sadness", "tristesse"]), make("S", "#111111"), make("aN", "#222222"),
  ],
};
const gaze = { ...affect, name: "gaze", tiers: ["gaze"], labels: [] };
const scheme: Scheme = { snapshot: "", vocabularies: [affect, gaze] };

describe("labels", () => {
  it("are found under each of their spellings", () => {
    expect(findLabel(affect, "colère")?.label).toBe("A");
    expect(findLabel(affect, "A")?.label).toBe("A");
    expect(findLabel(affect, "fury")).toBeNull();
    expect(meansSame(affect, "anger", "colère")).toBe(true);
    expect(meansSame(affect, "anger", "N")).toBe(false);
    expect(meansSame(null, "x", "x")).toBe(true);
  });

  it("join to transitions that can be read in one way only", () => {
    const read = (text: string) => splitTransition(affect, text)?.map((one) => one.label) ?? null;
    expect(read("NA")).toEqual(["N", "A"]);
    expect(read("neutralcolère")).toEqual(["N", "A"]);
    expect(read("ASa")).toEqual(["A", "Sa"]);
    expect(read("SaN")).toBeNull(); // Sa and N, or S and aN
    expect(read("NN")).toBeNull();
    expect(read("Nx")).toBeNull();
    expect(splitTransition({ ...affect, transitions: false }, "NA")).toBeNull();
  });

  it("are spelled as their tier spells them", () => {
    expect(spellLike(affect, "A", [])).toBe("A");
    expect(spellLike(affect, "A", ["N", "Sa", "NA"])).toBe("A");
    expect(spellLike(affect, "A", ["neutral", "sadness", "NA"])).toBe("anger");
    expect(spellLike(affect, "A", ["neutre", "sadness", "neutre"])).toBe("colère");
    expect(spellLike(affect, "A", ["neutral", "neutral", "colère"])).toBe("colère");
    expect(spellLike(affect, "S", ["neutral"])).toBe("S");
    expect(spellLike(null, "A", ["anger"])).toBe("A");
  });

  it("fit as transitions between what they name", () => {
    expect(fitsBetween(affect, "NA", "neutral", "A")).toBe(true);
    expect(fitsBetween(affect, "NA", "neutral", "S")).toBe(false);
    expect(fitsBetween(affect, "NA", "", "S")).toBe(false);
    expect(fitsBetween(affect, "NA", "", "")).toBe(true);
    expect(fitsBetween(affect, "NA", "SN", "AS")).toBe(true);
    expect(fitsBetween(affect, "A", "S", "S")).toBe(true);
  });

  it("have one colour, transitions two, and the unknown always the same", () => {
    expect(findColours(scheme, "affect", "anger")).toEqual(["#d55e00"]);
    expect(findColours(scheme, "affect", "NA")).toEqual(["#bfc4c9", "#d55e00"]);
    expect(findColours(scheme, "instruction", "anger")).toEqual(["#d55e00"]);
    expect(findColours(scheme, "gaze", "anger")).toEqual(findColours(null, null, "anger"));
    expect(findColours(scheme, "gaze", "anger")).not.toEqual(["#d55e00"]);
  });

  it("are called by the affect's name, else as their note begins", () => {
    expect(nameLabel(affect.labels[1]!, "en")).toBe("anger");
    expect(nameLabel(affect.labels[1]!, "fr")).toBe("colère");
    expect(nameLabel(make("Anger", "#d55e00"), "en")).toBe("");
    expect(nameLabel(make("Q", "#000000", ["old name"], "Raised brow. Both sides count."), "fr")).toBe("Raised brow");
    expect(nameLabel(make("Q", "#000000", ["old name"]), "en")).toBe("");
  });
});
