import { describe, expect, it } from "vitest";
import type { Draft, EditAnswer, Segment } from "../api/messages";
import { applyAnswer, areSame, concernedSegments, followSelection, knowsTiers } from "./drafts";

function segment(id: string, onset: number, offset: number, label = "joy",
  status: Segment["status"] = "proposed"): Segment {
  return { id, onset, offset, label, confidence: 0.5, status, origin: "model", revision: 0, kind: "interval" };
}
function draftOf(segments: Segment[], version = 3): Draft {
  return {
    take: "t1", purpose: "own", author: "ada", version, base: "S", mode: "review", others: [], unpublished: 0,
      done: false, undo: null,
    redo: null, gone: null, tiers: [{ tier: "affect", source: null, segments }, { tier: "gaze", source: null,
      segments: [] }],
  };
}
const answer = (version: number, changes: EditAnswer["changes"]): EditAnswer =>
  ({ version, undo: "accept", redo: null, unpublished: 1, changes });
const THREE = () => [segment("a", 0, 10), segment("b", 10, 20), segment("c", 30, 40)];

describe("an answer", () => {
  it("is applied once, in time order, and leaves the old draft as it was", () => {
    const before = draftOf(THREE());
    const changes = [{ tier: "affect", removed: ["b"], added: [segment("d", 20, 25), segment("a", 0, 12)] }];
    const after = applyAnswer(before, answer(4, changes));
    expect(after.tiers[0]!.segments.map((one) => `${one.id}${one.onset}-${one.offset}`)).toEqual(["a0-12", "d20-25",
      "c30-40"]);
    expect([after.version, after.undo, after.unpublished]).toEqual([4, "accept", 1]);
    expect(before.tiers[0]!.segments).toHaveLength(3);
    expect(applyAnswer(after, answer(4, changes))).toBe(after);
    expect(applyAnswer(after, answer(3, [{ tier: "affect", removed: ["c"], added: [] }]))).toBe(after);
  });
  it("about a tier that is not here is noticed", () => {
    expect(knowsTiers(draftOf([]), answer(4, [{ tier: "mouth", removed: [], added: [] }]))).toBe(false);
    expect(knowsTiers(draftOf([]), answer(4, [{ tier: "gaze", removed: [], added: [] }]))).toBe(true);
  });
});

describe("what an operation is about", () => {
  const draft = draftOf(THREE());
  const about = (operation: Parameters<typeof concernedSegments>[1]) =>
    concernedSegments(draft, operation).map((one) => one.id).join("");
  it("are the segments that it names", () => {
    expect(about({ kind: "accept", tier: "affect", segments: ["c", "a"] })).toBe("ac");
    expect(about({ kind: "split", tier: "affect", segment: "b", frame: 15 })).toBe("b");
    expect(about({ kind: "accept", tier: "gaze", segments: ["a"] })).toBe("");
  });
  it("and those that would give way", () => {
    expect(about({ kind: "add", tier: "affect", onset: 15, offset: 31, label: "x" })).toBe("bc");
    expect(about({ kind: "add", tier: "affect", onset: 20, offset: 30, label: "x" })).toBe("");
    expect(about({ kind: "settle", tier: "affect", onset: 9, offset: 10, label: null })).toBe("a");
    expect(about({ kind: "move", tier: "affect", segment: "b", onset: 12 })).toBe("ab");
    expect(about({ kind: "move", tier: "affect", segment: "b", offset: 35 })).toBe("abc");
  });
  it("is the same only in the same state", () => {
    expect(areSame(THREE(), THREE())).toBe(true);
    for (const other of [segment("a", 0, 11), segment("a", 0, 10, "fear"), segment("a", 0, 10, "joy", "reviewed"),
      segment("z", 0, 10)]) {
      expect(areSame([segment("a", 0, 10)], [other])).toBe(false);
    }
    expect(areSame(THREE(), THREE().slice(1))).toBe(false);
  });
});

describe("the selection", () => {
  it("stays with its segment", () => {
    expect(followSelection(["b"], THREE(), THREE(), "accept")).toEqual(["b"]);
  });
  it("goes to what stands in its place", () => {
    const after = [segment("a", 0, 10), segment("n", 8, 22)];
    expect(followSelection(["b"], THREE(), after, "merge-in")).toEqual(["n"]);
    expect(followSelection(["c"], THREE(), after, "delete")).toEqual([]);
  });
  it("goes to a new segment", () => {
    expect(followSelection(["b"], THREE(), [...THREE(), segment("n", 22, 28)], "add")).toEqual(["n"]);
  });
  it("goes to what undo brought back", () => {
    const before = [segment("a", 0, 20), segment("c", 30, 40)];
    expect(followSelection(["c"], before, THREE(), "undo")).toEqual(["a"]);
    expect(followSelection(["c"], THREE(), THREE(), "undo")).toEqual(["c"]);
    // A boundary that two share: both changed, the chosen one stays chosen.
    const moved = [segment("a", 0, 12), segment("b", 12, 20), segment("c", 30, 40)];
    expect(followSelection(["b"], moved, THREE(), "undo")).toEqual(["b"]);
  });
});
