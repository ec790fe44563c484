import { describe, expect, it } from "vitest";
import type { Command, Group } from "./commands";
import { changeKeys, makeKeymap, wantedKeys } from "./keymap";

function make(id: string, keys: string[], group: Group = "edit"): Command {
  return { id, group, name: { text: id }, keys, run: () => undefined };
}

const COMMANDS = [
  make("edit.add", ["A"]), make("edit.split", ["S"]), make("view.whole", ["0"], "view"),
  make("page.escape", ["Escape"], "page"),
];

describe("makeKeymap", () => {
  it("gives every key to its command", () => {
    const keymap = makeKeymap(COMMANDS, {});
    expect(keymap.find.get("A")).toBe("edit.add");
    expect(keymap.keysOf.get("edit.split")).toEqual(["S"]);
    expect(keymap.clashes).toEqual([]);
  });

  it("prefers a person's choice to the scheme's keys, and those to the usual ones, and says so", () => {
    const label = make("label:anger", ["a"], "label");
    const scheme = makeKeymap([...COMMANDS, label], {});
    expect(scheme.find.get("A")).toBe("label:anger");
    expect(scheme.keysOf.get("edit.add")).toEqual([]);
    expect(scheme.clashes).toEqual([{ keys: "A", commands: ["label:anger", "edit.add"] }]);
    const chosen = makeKeymap([...COMMANDS, label], { "edit.split": ["A", "X"] });
    expect(chosen.find.get("A")).toBe("edit.split");
    expect(chosen.find.get("X")).toBe("edit.split");
    expect(chosen.find.get("S")).toBeUndefined();
  });

  it("lets nobody have Escape", () => {
    const keymap = makeKeymap(COMMANDS, { "edit.add": ["Escape"], "page.escape": [] });
    expect(keymap.find.get("Escape")).toBe("page.escape");
  });

  it("bears whatever the settings hold", () => {
    const odd = {
      "edit.add": [7, "nonsense key", "B"], "edit.split": "S", gone: ["A"],
    } as unknown as Record<string, string[]>;
    const keymap = makeKeymap(COMMANDS, odd);
    expect(keymap.find.get("B")).toBe("edit.add");
    expect(keymap.find.get("S")).toBe("edit.split");
    expect(keymap.find.get("A")).toBeUndefined();
  });

  it("lets a person take all keys off a command", () => {
    expect(wantedKeys(COMMANDS[0]!, { "edit.add": [] })).toEqual([]);
    expect(makeKeymap(COMMANDS, { "edit.add": [] }).find.get("A")).toBeUndefined();
  });
});

describe("changeKeys", () => {
  it("keeps what differs from the usual keys only", () => {
    const [add] = COMMANDS as [Command];
    const changed = changeKeys({ "edit.split": ["X"] }, add, ["a", "b", "A"]);
    expect(changed).toEqual({ "edit.split": ["X"], "edit.add": ["A", "B"] });
    expect(changeKeys(changed, add, ["A"])).toEqual({ "edit.split": ["X"] });
    expect(changeKeys({}, add, [])).toEqual({ "edit.add": [] });
  });
});
