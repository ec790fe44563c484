import { describe, expect, it } from "vitest";
import { SparseBlend } from "./sparse_blend";

describe("SparseBlend", () => {
  const neutral = Float32Array.from({ length: 30 }, (_, i) => Math.sin(i));
  const shapes = [0, 1, 2, 3].map((shape) =>
    Float32Array.from({ length: 30 }, (_, i) => ((Math.floor(i / 3) + shape) % 3 === 0 ? Math.cos(i * shape) : 0)),
  );

  it("is the neutral plus the weighted shapes, one after the other", () => {
    const blend = new SparseBlend(neutral, shapes);
    const into = new Float32Array(30);
    for (const weights of [[0, 0, 0, 0], [1, 0, 0, 0], [0.2, -0.1, 1.3, 0.5]]) {
      blend.write(weights, into);
      for (let i = 0; i < 30; i++) {
        const expected = neutral[i]! + weights.reduce((sum, weight, shape) => sum + weight * shapes[shape]![i]!, 0);
        expect(into[i]!).toBeCloseTo(expected, 5);
      }
    }
  });

  it("leaves out changes that are too short to be seen, and no others", () => {
    const into = new Float32Array(6);
    new SparseBlend(new Float32Array(6), [[0.03, 0.04, 0, 0.03, 0.04, 0.001]], 0.05).write([2], into);
    expect(Array.from(into)).toEqual([0, 0, 0, 0.06, 0.08, 0.002].map(Math.fround));
  });

  it("leaves the neutral as it is", () => {
    const before = neutral.slice();
    new SparseBlend(neutral, shapes).write([1, 1, 1, 1], new Float32Array(30));
    expect(neutral).toEqual(before);
  });
});
