import { expect, it } from "vitest";
import type { SchemeLabel, Vocabulary } from "../api/messages";
import { checkName, findFreeColour, findFreeKey, findKeyClashes, moveLabel, namesOf } from "./scheme_rules";

const label = (name: string, more: Partial<SchemeLabel> = {}): SchemeLabel => ({
  label: name, colour: "#0072b2", key: "", note: "", aliases: [], retired: false, segments: 0, ...more,
});

it("checks names against all that mean a label", () => {
  const vocabulary: Vocabulary = {
    name: "affect", tiers: ["affect"], transitions: true, manual: "",
    labels: [label("joy", { aliases: ["J"] }), label("old", { retired: true })],
  };
  const taken = namesOf(vocabulary);
  const check = (name: string) => checkName(name, taken);
  expect(["", " ", " joy", "joy", "J", "old", "fear", "a\u0000b", "x".repeat(81), "😀 ok"].map(check)).toEqual([
    "empty", "empty", "blank", "taken", "taken", "taken", null, "unprintable", "long", null,
  ]);
});

it("finds keys that clash and keys that are free", () => {
  const labels = [
    label("a", { key: "1" }), label("b", { key: "1" }), label("c", { key: "2", retired: true }), label("d"), label("e"),
  ];
  expect([...findKeyClashes(labels)]).toEqual([["1", ["a", "b"]]]);
  expect(findFreeKey(labels)).toBe("2");
});

it("proposes a colour that none confuses with one in use", () => {
  expect(findFreeColour([])).toBe("#0072b2");
  expect(findFreeColour([label("a", { colour: "#0072b2" })])).toBe("#e69f00");
});

it("moves a label past retired ones", () => {
  const labels = [label("a"), label("b", { retired: true }), label("c")];
  expect(moveLabel(labels, "a", 1)).toEqual(["b", "c", "a"]);
  expect(moveLabel(labels, "c", -1)).toEqual(["c", "a", "b"]);
  expect(moveLabel(labels, "a", -1)).toEqual(["a", "b", "c"]);
  expect(moveLabel(labels, "nobody", 1)).toEqual(["a", "b", "c"]);
});
