import { describe, expect, it } from "vitest";
import type { Scene, TakeRow } from "../api/messages";
import { listChoices, readChoice, writeChoice } from "./beside";

const scene = { take: "a", solve: "one", solves: ["one", "two"] } as unknown as Scene;
const row = (take: string, more: Partial<TakeRow> = {}) =>
  ({ take, solve: "one", refusal: null, mode: "review", ...more }) as TakeRow;

describe("the second face", () => {
  it("is another solve of the take, or another take that can be shown", () => {
    const rows = [
      row("a"), row("b"), row("no weights", { solve: null }), row("refused", { refusal: "no consent" }),
      row("d", { mode: "blind" }),
      row("not mine", { mode: "none" }),
    ];
    const choices = listChoices(scene, rows);
    expect(choices.solves.map((one) => one.name)).toEqual(["two"]);
    expect(choices.takes.map((one) => one.name)).toEqual(["b", "d"]);
    expect(readChoice(choices.solves[0]!.value)).toEqual({ take: "a", solve: "two" });
  });

  it("may be called anything", () => {
    for (const take of ["", "a/b", "..", '"', "\\", "[1]", "é\n😀"]) {
      expect(readChoice(writeChoice(take, take))).toEqual({ take, solve: take });
    }
    expect(readChoice("")).toBeNull();
  });
});
