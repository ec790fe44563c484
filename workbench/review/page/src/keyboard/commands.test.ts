/** The usual commands on a page without a server: what they send, and that all have names and keys of their own. */
import { beforeEach, describe, expect, it, vi } from "vitest";
import type { Draft, Operation, Scene, Scheme, Segment } from "../api/messages";
import * as state from "../state/state";
import { preview } from "../timeline/preview";
import { en, fr } from "../words/keyboard";

const sent: (Operation | string)[] = [];
let answer: (operation: Operation) => Promise<boolean>;

vi.mock("../api/client", () => ({ fetchCurve: () => new Promise(() => undefined) }));
vi.mock("../state/actions", () => ({
  edit: (operation: Operation) => answer(operation),
  undo: async () => sent.push("undo"),
  redo: async () => sent.push("redo"),
  goTo: async (step: number) => sent.push(`go ${step}`),
  tell: (text: string) => sent.push(`tell ${text}`),
  refuseWhileArriving: () => false,
  choose: (id: string) => {
    state.selection.value = [id];
  },
}));

const { findCommand, listCommands, register } = await import("./commands");
const { editCommands, lastLabels } = await import("./edit_commands");
const { held } = await import("./held");
const { followLabels } = await import("./label_commands");
const { makeKeymap } = await import("./keymap");
const { moveCommands } = await import("./move_commands");
const { pageCommands } = await import("./page_commands");

function make(
  id: string, onset: number, offset: number, label: string, status: Segment["status"] = "proposed",
): Segment {
  return { id, onset, offset, label, confidence: 0.5, status, origin: "model", revision: 0, kind: "interval" };
}

const LABELS = ["anger", "joy"].map((label, index) => ({
  label, colour: "#000000", key: String(index + 1), note: "", aliases: [], retired: false, segments: 0,
}));

/** Run a command as a short press does, and wait for what it sends. */
async function tap(id: string): Promise<void> {
  const command = findCommand(id)!;
  expect(command, id).toBeDefined();
  if (!(command.enabled?.() ?? true)) return;
  if (command.release !== undefined) held.add(id);
  await command.run();
  held.delete(id);
  await command.release?.();
}

beforeEach(() => {
  sent.length = 0;
  answer = async (operation) => {
    sent.push(operation);
    return true;
  };
  state.scene.value = {
    take: "t", rate: 200, frames: 1000, solves: ["a"], solve: "a", markers: [], videos: [],
  } as unknown as Scene;
  state.scheme.value = {
    snapshot: "s",
    vocabularies: [{ name: "affect", tiers: ["affect"], labels: LABELS, transitions: false, manual: "" }],
  } as unknown as Scheme;
  state.draft.value = {
    take: "t", purpose: "own", mode: "review", gone: null, undo: "accept", redo: null, others: [],
    tiers: [
      {
        tier: "affect", source: null,
        segments: [make("a", 100, 200, "anger"), make("b", 200, 300, "joy", "reviewed"), make("c", 400, 500, "joy")],
      },
      { tier: "gaze", source: null, segments: [] },
    ],
  } as unknown as Draft;
  state.purpose.value = "own";
  state.activeTier.value = "affect";
  state.selection.value = [];
  state.marked.value = { onset: null, offset: null };
  state.clock.open(200, 1000, 0);
  preview.value = null;
  lastLabels.clear();
  register(...moveCommands(), ...editCommands(), ...pageCommands());
});
const stop = followLabels();
void stop;

describe("the usual commands", () => {
  it("have a name in both languages, and every key once", () => {
    const commands = listCommands();
    for (const command of commands) {
      if (typeof command.name !== "string") continue;
      expect(en[command.name as keyof typeof en], command.id).toBeTruthy();
      expect(fr[command.name as keyof typeof fr], command.id).toBeTruthy();
    }
    expect(makeKeymap(commands, {}).clashes).toEqual([]);
    expect(commands.length).toBeGreaterThan(45);
  });
});

describe("accept", () => {
  it("accepts what is chosen and proposed, then goes on", async () => {
    state.selection.value = ["a"];
    await tap("edit.accept");
    expect(sent).toEqual([{ kind: "accept", tier: "affect", segments: ["a"] }, "go 1"]);
  });
  it("only goes on where there is nothing to accept, and stays with Shift", async () => {
    state.selection.value = ["b"];
    await tap("edit.accept");
    expect(sent).toEqual(["go 1"]);
    state.selection.value = ["a", "c"];
    await tap("edit.accept-stay");
    expect(sent.slice(1)).toEqual([{ kind: "accept", tier: "affect", segments: ["a", "c"] }]);
  });
  it("stays where it was refused, and counts a double press once", async () => {
    state.selection.value = ["a"];
    answer = async () => false;
    await Promise.all([tap("edit.accept"), tap("edit.accept")]);
    expect(sent).toEqual([]);
  });
});

describe("labels", () => {
  it("go to what is chosen, else to what lies under the playhead", async () => {
    state.selection.value = ["c"];
    await tap("label:anger");
    state.selection.value = [];
    state.clock.seek(120);
    await tap("label:joy");
    expect(sent).toEqual([
      { kind: "relabel", tier: "affect", segments: ["c"], label: "anger" },
      { kind: "relabel", tier: "affect", segments: ["a"], label: "joy" },
    ]);
    expect(state.selection.value).toEqual(["a"]);
  });
  it("accept a proposal that has the label already", async () => {
    state.selection.value = ["a"];
    await tap("label:anger");
    expect(sent).toEqual([{ kind: "accept", tier: "affect", segments: ["a"] }]);
  });
  it("fill in..out first, also from in to the playhead", async () => {
    state.selection.value = ["a"];
    state.marked.value = { onset: 310, offset: 350 };
    await tap("label:joy");
    state.clock.seek(600);
    await tap("edit.set-in");
    state.clock.seek(640);
    await tap("edit.add");
    expect(sent).toEqual([
      { kind: "add", tier: "affect", onset: 310, offset: 350, label: "joy" },
      { kind: "add", tier: "affect", onset: 600, offset: 640, label: "joy" },
    ]);
    expect(state.marked.value).toEqual({ onset: null, offset: null });
  });
  it("settle in an adjudication", async () => {
    state.purpose.value = "adjudication";
    state.selection.value = ["a"];
    await tap("label:joy");
    await tap("edit.delete");
    await tap("edit.accept");
    expect(sent).toEqual([
      { kind: "settle", tier: "affect", onset: 100, offset: 200, label: "joy" },
      { kind: "settle", tier: "affect", onset: 100, offset: 200, label: null },
    ]);
  });
  it("last as long as their key is held", async () => {
    state.clock.seek(520);
    const command = findCommand("hold:anger")!;
    void command.run();
    expect(state.clock.playing.value).toBe(true);
    state.clock.seek(600);
    await command.release!();
    expect(state.clock.playing.value).toBe(false);
    expect(sent).toEqual([{ kind: "add", tier: "affect", onset: 520, offset: 600, label: "anger" }]);
    void command.run();
    await command.release!();
    expect(sent.length).toBe(2);
    expect(sent[1]).toMatch(/^tell /);
  });
  it("are those of the active tier", () => {
    expect(findCommand("label:joy")?.keys).toEqual(["2"]);
    expect(findCommand("hold:joy")?.keys).toEqual(["Shift+2"]);
    state.activeTier.value = "gaze";
    expect(findCommand("label:joy")).toBeUndefined();
  });
});

describe("edits", () => {
  it("split where the playhead is inside, and say so where it is not", async () => {
    state.clock.seek(150);
    await tap("edit.split");
    state.clock.seek(200);
    await tap("edit.split");
    expect(sent[0]).toEqual({ kind: "split", tier: "affect", segment: "a", frame: 150 });
    expect(sent[1]).toMatch(/^tell /);
  });
  it("merge with either neighbour and keep the chosen label", async () => {
    state.selection.value = ["b"];
    await tap("edit.merge-next");
    await tap("edit.merge-previous");
    state.selection.value = ["c", "a"];
    await tap("edit.merge-next");
    expect(sent).toEqual([
      { kind: "merge", tier: "affect", segments: ["b", "c"], label: "joy" },
      { kind: "merge", tier: "affect", segments: ["a", "b"], label: "joy" },
      { kind: "merge", tier: "affect", segments: ["a", "b", "c"], label: "joy" },
    ]);
    state.selection.value = ["c"];
    await tap("edit.merge-next");
    expect(sent[3]).toMatch(/^tell /);
  });
  it("nudge boundaries: a held key is one edit, of all its steps", async () => {
    state.selection.value = ["b"];
    const command = findCommand("edit.onset-earlier")!;
    held.add(command.id);
    for (let count = 0; count < 5; count += 1) void command.run();
    expect(sent).toEqual([]);
    expect(preview.value?.segments.map((one) => [one.onset, one.offset])).toEqual([[100, 195], [195, 300], [400, 500]]);
    expect(state.clock.frame.value).toBe(195);
    held.delete(command.id);
    await command.release!();
    expect(sent).toEqual([{ kind: "move", tier: "affect", segment: "b", onset: 195, together: true }]);
  });
  it("nudge on while the edit before is on its way", async () => {
    state.selection.value = ["c"];
    let done: (() => void) | undefined;
    answer = (operation) => new Promise((resolve) => {
      sent.push(operation);
      done = () => resolve(true);
    });
    await tap("edit.offset-later-10");
    await tap("edit.offset-later-10");
    done?.();
    expect(sent).toMatchObject([{ offset: 510 }, { offset: 520 }]);
  });
  it("set in and out without crossing them, up to the take's end", async () => {
    state.clock.seek(300);
    await tap("edit.set-in");
    state.clock.seek(200);
    await tap("edit.set-out");
    expect(state.marked.value).toEqual({ onset: null, offset: 200 });
    await tap("edit.set-in");
    expect(state.marked.value).toEqual({ onset: 200, offset: null });
    state.clock.seek(999);
    await tap("edit.set-out");
    expect(state.marked.value).toEqual({ onset: 200, offset: 1000 });
  });
  it("wait for the one before: a label after a split is for the part behind the cut", async () => {
    state.clock.seek(150);
    answer = async (operation) => {
      sent.push(operation);
      await Promise.resolve();
      if (operation.kind !== "split") return true;
      const now = state.draft.value!;
      const tier = now.tiers[0]!;
      const segments = [make("a", 100, 150, "anger"), make("a2", 150, 200, "anger"), ...tier.segments.slice(1)];
      state.draft.value = { ...now, tiers: [{ ...tier, segments }, ...now.tiers.slice(1)] };
      return true;
    };
    await Promise.all([tap("edit.split"), tap("label:joy")]);
    expect(sent[1]).toEqual({ kind: "relabel", tier: "affect", segments: ["a2"], label: "joy" });
  });
  it("do nothing where the take may not be edited", async () => {
    state.draft.value = { ...state.draft.value!, mode: "none" };
    state.selection.value = ["a"];
    for (const id of ["edit.accept", "edit.delete", "edit.add", "label:joy", "edit.onset-later"]) await tap(id);
    expect(sent).toEqual([]);
  });
});

describe("moving", () => {
  it("goes through the tier and the tiers", async () => {
    await tap("move.next-segment");
    await tap("move.next-segment");
    expect(state.selection.value).toEqual(["b"]);
    await tap("move.tier-below");
    await tap("move.tier-below");
    expect(state.activeTier.value).toBe("gaze");
    expect(state.selection.value).toEqual([]);
  });
  it("loops what is chosen, and stops looping", async () => {
    state.selection.value = ["c"];
    await tap("play.loop");
    expect(state.clock.loop.value).toEqual({ onset: 400, offset: 500 });
    expect(state.clock.frame.value).toBe(400);
    await tap("play.loop");
    expect(state.clock.loop.value).toBeNull();
  });
  it("zooms about the playhead and shows the whole take again", async () => {
    state.range.value = { first: 0, last: 1000 };
    state.clock.seek(500);
    await tap("view.zoom-in");
    expect(state.range.value.last - state.range.value.first).toBeCloseTo(625, 6);
    await tap("view.whole");
    expect(state.range.value).toEqual({ first: 0, last: 1000 });
  });
});
