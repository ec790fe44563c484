import { BufferAttribute, BufferGeometry } from "three";
import { describe, expect, it } from "vitest";
import { computeMorphNormals } from "./morph_normals";

/** Numbers from 0 to 1 that are the same each time. */
function makeRandom(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state * 1664525 + 1013904223) % 2 ** 32;
    return state / 2 ** 32;
  };
}

/** A wavy sheet of n by n vertices, some 0.2 m wide. */
function makeSheet(n: number, random: () => number) {
  const positions: number[] = [];
  const corners: number[] = [];
  for (let y = 0; y < n; y++) {
    for (let x = 0; x < n; x++) positions.push((0.2 * x) / n, (0.2 * y) / n, 0.02 * Math.sin(x) + 0.002 * random());
  }
  for (let y = 0; y + 1 < n; y++) {
    for (let x = 0; x + 1 < n; x++) {
      const at = y * n + x;
      corners.push(at, at + 1, at + n, at + 1, at + n + 1, at + n);
    }
  }
  return { positions, corners };
}

/** The slow way: three's own normals of the whole displaced mesh. */
function computeNormals(positions: number[], corners: number[]): ArrayLike<number> {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setIndex(corners);
  geometry.computeVertexNormals();
  return geometry.getAttribute("normal").array;
}

describe("computeMorphNormals", () => {
  it("is what the normals of the whole displaced mesh say", () => {
    const random = makeRandom(4);
    const { positions, corners } = makeSheet(12, random);
    const shapes = [0.02, 0.3, 1].map((part) =>
      Array.from({ length: 144 }, () => random() < part).flatMap((moves) =>
        [0, 1, 2].map(() => (moves ? 0.02 * (random() - 0.5) : 0)),
      ),
    );
    const found = computeMorphNormals(positions, corners, shapes);
    const before = computeNormals(positions, corners);
    shapes.forEach((shape, number) => {
      const after = computeNormals(positions.map((one, i) => one + shape[i]!), corners);
      const change = found[number]!;
      expect(change.some((one) => Math.abs(one) > 0.01)).toBe(true);
      const errors = Array.from(change, (one, i) => Math.abs(one - (after[i]! - before[i]!)));
      expect(Math.max(...errors)).toBeLessThan(1e-4);
    });
  });

  it("turns nothing for a shape that moves nothing", () => {
    const { positions, corners } = makeSheet(4, makeRandom(1));
    const [still] = computeMorphNormals(positions, corners, [new Float32Array(48)]);
    expect(still!.every((one) => one === 0)).toBe(true);
  });

  it("leaves out triangles and vertices that have no normal", () => {
    // One triangle, one without an area, and a vertex of no triangle.
    const positions = [0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 5, 5, 9, 9, 9];
    const shape = [0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 1, 1];
    const [change] = computeMorphNormals(positions, [0, 1, 2, 3, 3, 3], [shape]);
    expect(Array.from(change!).every(Number.isFinite)).toBe(true);
    const root = Math.SQRT1_2;
    expect(Array.from(change!.slice(0, 3))).toEqual([-root, 0, root - 1].map((one) => Math.fround(one)));
    expect(Array.from(change!.slice(9))).toEqual([0, 0, 0, 0, 0, 0]);
  });

  it("tells shapes apart that follow each other", () => {
    const { positions, corners } = makeSheet(5, makeRandom(2));
    const shape = positions.map((_, i) => (i === 38 ? 0.01 : 0));
    const [first, , third] = computeMorphNormals(positions, corners, [shape, positions.map((one) => one * 0.3), shape]);
    for (let i = 0; i < first!.length; i++) expect(third![i]).toBeCloseTo(first![i]!, 9);
  });
});
