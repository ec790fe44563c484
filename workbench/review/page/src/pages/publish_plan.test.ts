import { beforeEach, describe, expect, it } from "vitest";
import type { PublishChange, PublishPlan, Segment } from "../api/messages";
import { language } from "../words";
import { countKinds, describeChange, groupChanges, isDecided, keepChoices, proposeMessage } from "./publish_plan";

const segment = (onset: number, offset: number, label: string, more: Partial<Segment> = {}): Segment => ({
  id: `${onset}`, onset, offset, label, confidence: null, status: "reviewed", origin: "human", revision: 1,
  kind: "interval", ...more,
});
const change = (
  kind: PublishChange["kind"], before: Segment[], after: Segment[], more: Partial<PublishChange> = {},
): PublishChange => ({
  take: "t1", purpose: "own", tier: "affect", kind, words: "as the server says",
  onset: (before[0] ?? after[0])!.onset, before, after, ...more,
});

beforeEach(() => {
  language.value = "en";
});

describe("describeChange", () => {
  it("says what was done to a segment", () => {
    const joy = segment(200, 400, "joy", { status: "proposed" });
    const said = (after: Segment): string => describeChange(change("edited", [joy], [after]), 200);
    expect(said(segment(200, 400, "joy"))).toBe("joy: accepted");
    expect(said(segment(200, 400, "anger"))).toBe("joy → anger");
    expect(said(segment(190, 400, "joy"))).toBe("joy: start −50 ms (−10)");
    expect(said(segment(200, 403, "anger"))).toBe("joy → anger, end +15 ms (+3)");
    expect(said(segment(200, 400, "joy", { status: "proposed", confidence: 0.5 }))).toBe("as the server says");
  });

  it("says what came, went, fell apart and was joined", () => {
    const [a, b] = [segment(0, 100, "joy"), segment(100, 300, "fear")];
    expect(describeChange(change("added", [], [b]), 200)).toBe("fear added (1.00 s)");
    expect(describeChange(change("removed", [a], []), 200)).toBe("joy deleted (500 ms)");
    expect(describeChange(change("split", [a], [a, b]), 200)).toBe("joy split into joy + fear");
    expect(describeChange(change("merged", [a, b], [a]), 200)).toBe("joy + fear merged into joy");
  });
});

describe("plans", () => {
  const joy = segment(10, 20, "joy", { status: "proposed" });
  const changes = [
    change("added", [], [segment(50, 60, "fear")]),
    change("edited", [joy], [segment(10, 20, "joy")]),
    change("edited", [joy], [segment(10, 20, "anger")], { take: "t2" }),
    change("added", [], [segment(0, 5, "fear")], { purpose: "adjudication" }),
  ];
  const plan: PublishPlan = {
    plan: "p", snapshot: "s", changes, held_back: [],
    conflicts: [
      {
        key: "k", take: "t1", purpose: "own", tier: "affect", onset: 0, offset: 9, author: "x", message: "m",
        base: [], ours: [], theirs: [], choices: ["ours", "theirs"],
      },
    ],
  };

  it("groups by take, tier and purpose, and sorts by onset", () => {
    const groups = groupChanges(changes);
    expect(groups.map((one) => [one.take, one.count, one.tiers.length])).toEqual([["t1", 3, 2], ["t2", 1, 1]]);
    expect(groups[0]!.tiers[0]!.changes.map((one) => one.onset)).toEqual([10, 50]);
    expect(countKinds(changes)).toEqual([
      { kind: "accepted", count: 1 }, { kind: "edited", count: 1 }, { kind: "added", count: 2 },
    ]);
  });

  it("is decided only by a choice that is offered, and keeps it only while asked", () => {
    expect(isDecided(plan, {})).toBe(false);
    expect(isDecided(plan, { k: "both" })).toBe(false);
    expect(isDecided(plan, { k: "theirs" })).toBe(true);
    expect(keepChoices(plan, { k: "ours", gone: "ours" })).toEqual({ k: "ours" });
    expect(keepChoices({ ...plan, conflicts: [] }, { k: "ours" })).toEqual({});
  });

  it("proposes a message", () => {
    expect(proposeMessage(plan)).toBe("Review t1, t2; settle t1");
    expect(proposeMessage({ ...plan, changes: [], conflicts: [] })).toBe("");
  });
});
