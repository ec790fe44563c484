import { describe, expect, it } from "vitest";
import type { Queue, QueueItem, Segment } from "../api/messages";
import { countFilters, filterQueue, findItem, nextIndex, updateQueue, type Filters } from "./queue";

const ALL: Filters = { order: "usefulness", label: null, signer: null, status: "all", confidence: 1, take: "all" };

function item(id: string, change: Partial<QueueItem> = {}): QueueItem {
  return {
    take: "t1", tier: "affect", id, onset: 0, offset: 100, seconds: 0.5, label: "joy", confidence: 0.5, second: "",
      gain: 0.1,
    status: "proposed", signer: "S1", protocol: "IE", ...change,
  };
}
function segment(id: string, onset: number, offset: number, change: Partial<Segment> = {}): Segment {
  return {
    id, onset, offset, label: "joy", confidence: null, status: "reviewed", origin: "human", revision: 1,
      kind: "interval", ...change,
  };
}
const ids = (items: QueueItem[]) => items.map((one) => one.id).join(" ");

describe("filters", () => {
  const items = [
    item("a", { take: "t10", onset: 5, label: "joy", confidence: 0.9 }),
    item("b", { take: "t2", onset: 9, label: "fear", confidence: null, signer: "S2" }),
    item("c", { take: "t2", onset: 1, label: "joy", confidence: 0.2, status: "reviewed" }),
    item("d", { take: "t2", onset: 4, label: "joy", confidence: 0.4, status: "adjudicated", signer: null }),
  ];
  it("keep the order of usefulness", () => expect(ids(filterQueue(items, ALL, null))).toBe("a b c d"));
  it("order by take as people count, then by time", () => {
    expect(ids(filterQueue(items, { ...ALL, order: "time" }, null))).toBe("c d b a");
    expect(ids(items)).toBe("a b c d");
  });
  it("by label, signer and take", () => {
    expect(ids(filterQueue(items, { ...ALL, label: "joy" }, null))).toBe("a c d");
    expect(ids(filterQueue(items, { ...ALL, signer: "S2" }, null))).toBe("b");
    expect(ids(filterQueue(items, { ...ALL, take: "this" }, "t10"))).toBe("a");
    expect(ids(filterQueue(items, { ...ALL, take: "this" }, null))).toBe("");
  });
  it("count adjudicated as reviewed", () => {
    expect(ids(filterQueue(items, { ...ALL, status: "proposed" }, null))).toBe("a b");
    expect(ids(filterQueue(items, { ...ALL, status: "reviewed" }, null))).toBe("c d");
  });
  it("never hide a segment whose confidence nobody knows", () => {
    expect(ids(filterQueue(items, { ...ALL, confidence: 0.4 }, null))).toBe("b c d");
  });
  it("are counted against what shows all that is left", () => {
    expect(countFilters({ ...ALL, status: "proposed" })).toBe(0);
    expect(countFilters({ ...ALL, order: "time", status: "proposed" })).toBe(0);
    expect(countFilters({ ...ALL, label: "joy", confidence: 0.5, take: "this" })).toBe(4);
  });
});

describe("walking", () => {
  it("goes to the neighbours and stops at the ends", () => {
    expect(nextIndex(3, 0, 0, 1)).toBe(1);
    expect(nextIndex(3, 2, 2, 1)).toBe(-1);
    expect(nextIndex(3, 1, 1, -1)).toBe(0);
    expect(nextIndex(3, 0, 0, -1)).toBe(-1);
    expect(nextIndex(0, -1, 0, 1)).toBe(-1);
  });
  it("takes what moved up where the chosen one has left the list, missing none", () => {
    expect(nextIndex(2, -1, 1, 1)).toBe(1);
    expect(nextIndex(2, -1, 1, -1)).toBe(0);
    expect(nextIndex(2, -1, 2, 1)).toBe(-1);
  });
  it("finds an item by take and id", () => {
    const items = [item("a", { take: "t2" }), item("a")];
    expect(findItem(items, "t1", "a")).toBe(1);
    expect(findItem(items, "t1", undefined)).toBe(-1);
  });
  it("accepting all, one after the other, visits each once", () => {
    let items = "abcdef".split("").map((id) => item(id));
    const seen: string[] = [];
    let chosen: string | undefined = items[0]!.id;
    let last = 0;
    while (chosen !== undefined) {
      seen.push(chosen);
      last = findItem(items, "t1", chosen);
      const accepted: string = chosen;
      items = items.filter((one) => one.id !== accepted);
      chosen = items[nextIndex(items.length, findItem(items, "t1", accepted), last, 1)]?.id;
    }
    expect(seen.join("")).toBe("abcdef");
  });
});

describe("after an edit", () => {
  const queue: Queue = { ready: true, items: [item("a"), item("b", { onset: 100, offset: 300, seconds: 1 }), item("b",
    { take: "t2" }), item("c")] };
  it("an accepted segment is reviewed in place, in its take only", () => {
    const now = updateQueue(queue, "t1", [{ tier: "affect", removed: [], added: [segment("b", 100, 300)] }]);
    expect(now.items.map((one) => one.status)).toEqual(["proposed", "reviewed", "proposed", "proposed"]);
    expect(queue.items[1]!.status).toBe("proposed");
  });
  it("the parts of a split stand where it stood, with their own lengths", () => {
    const now = updateQueue(queue, "t1", [{ tier: "affect", removed: [], added: [segment("b", 100, 160),
      segment("new", 160, 300)] }]);
    expect(ids(now.items)).toBe("a b new b c");
    expect(now.items[1]!.seconds).toBeCloseTo(0.3, 12);
    expect(now.items[2]!.seconds).toBeCloseTo(0.7, 12);
  });
  it("what was removed is gone", () => {
    expect(ids(updateQueue(queue, "t1", [{ tier: "affect", removed: ["a", "c"], added: [] }]).items)).toBe("b b");
  });
  it("a merge leaves one", () => {
    const now = updateQueue(queue, "t1", [{ tier: "affect", removed: ["b"], added: [segment("a", 0, 300)] }]);
    expect(ids(now.items)).toBe("a b c");
    expect([now.items[0]!.onset, now.items[0]!.offset]).toEqual([0, 300]);
  });
  it("leaves out a transition that was named anew with its neighbour", () => {
    const named = { ...segment("t", 100, 130), label: "JA" };
    const change = { tier: "affect", removed: ["a", "t"], added: [segment("a", 0, 100), named] };
    const now = updateQueue(queue, "t1", [change], (_, label) => label === "JA");
    expect(now.items.some((one) => one.id === "t")).toBe(false);
    expect(now.items.length).toBe(queue.items.length);
  });

  it("another tier or take changes nothing", () => {
    expect(updateQueue(queue, "t1", [{ tier: "other", removed: ["a"], added: [segment("z", 1, 2)] }])).toBe(queue);
    expect(updateQueue(queue, "t9", [{ tier: "affect", removed: ["a"], added: [] }])).toBe(queue);
  });
  it("a relabelled segment has no second guess any more", () => {
    const before: Queue = { ready: true, items: [item("a", { second: "fear" })] };
    const now = updateQueue(before, "t1", [{ tier: "affect", removed: [], added: [segment("a", 0, 100,
      { label: "fear" })] }]);
    expect([now.items[0]!.label, now.items[0]!.second]).toEqual(["fear", ""]);
  });
});
