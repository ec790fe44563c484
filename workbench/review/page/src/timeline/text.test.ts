import { expect, it } from "vitest";
import { elide } from "./text";

const width = (text: string) => [...text].length * 10;

it("cuts a text where it does not fit", () => {
  expect(elide("surprise", 80, width)).toBe("surprise");
  expect(elide("surprise", 79, width)).toBe("surpri…");
  expect(elide("surprise", 30, width)).toBe("su…");
  expect(elide("surprise", 29, width)).toBe("su");
  expect(elide("surprise", 19, width)).toBe("");
  expect(elide("", 0, width)).toBe("");
  expect(elide("in between", 45, width)).toBe("in…");
  expect(elide("😀😀😀", 20, width)).toBe("😀😀");
});
