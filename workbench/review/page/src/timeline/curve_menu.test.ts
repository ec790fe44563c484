import { expect, it, vi } from "vitest";

vi.mock("../api/client", () => ({ fetchCurve: () => new Promise(() => undefined) }));
vi.mock("../state/actions", () => ({}));
const { findShapes, toggleCurve } = await import("./curve_menu");

it("offers the shapes that move most first, and finds others by any part of their names", () => {
  const shapes = ["jawOpen", "mouthSmileLeft", "mouthSmileRight", "browInnerUp"];
  expect(findShapes(shapes, ["browInnerUp"], "")).toEqual(
    ["browInnerUp", "jawOpen", "mouthSmileLeft", "mouthSmileRight"]
  );
  expect(findShapes(shapes, [], " SMILE ")).toEqual(["mouthSmileLeft", "mouthSmileRight"]);
  expect(findShapes(shapes, [], "nose")).toEqual([]);
});

it("adds and takes away curves", () => {
  expect(toggleCurve(["level"], "residual")).toEqual(["level", "residual"]);
  expect(toggleCurve(["level", "residual"], "level")).toEqual(["residual"]);
});
