import { describe, expect, it, vi } from "vitest";

vi.mock("../api/client", () => ({ fetchCurve: () => new Promise(() => undefined) }));
const { prepareCurve } = await import("./curves");
const { samplePoints } = await import("./draw_curves");

describe("prepareCurve", () => {
  it("is not flattened by a spike, and keeps weights at 0 to 1", () => {
    const values = Float32Array.from({ length: 10_000 }, (_, index) => (index % 100) / 100);
    values[5000] = 1000;
    expect(prepareCurve("level", values).high).toBeLessThan(2);
    expect(prepareCurve("shape:jawOpen", values.map((value) => value / 10))).toMatchObject({ low: 0, high: 1 });
    expect(prepareCurve("shape:jawOpen", Float32Array.from([-0.2, 0.5])).low).toBeCloseTo(-0.2, 6);
  });
  it("has a height where there is nothing to draw", () => {
    for (const values of [[], [NaN, NaN], [0, 0]]) {
      const { low, high } = prepareCurve("level", Float32Array.from(values));
      expect(high).toBeGreaterThan(low);
    }
  });
});

describe("samplePoints", () => {
  const values = Float32Array.from({ length: 5000 }, (_, index) => Math.sin(index / 7) + (index === 3210 ? 9 : 0));
  const curve = prepareCurve("level", values);

  it("loses no extreme, however far out one is", () => {
    for (const width of [50, 300, 900]) {
      const points = samplePoints(curve, { first: 0, last: 5000 }, width);
      expect(Math.max(...points.map((one) => one[2]).filter((one) => !Number.isNaN(one)))).toBe(values[3210]);
      expect(points.length).toBeLessThan(width + 4);
    }
  });

  it("shows every frame at its middle when one is close", () => {
    const points = samplePoints(curve, { first: 100, last: 110 }, 1000);
    const point = points.find((one) => Math.abs(one[0] - 50) < 1e-6)!;
    expect(point[1]).toBe(values[100]);
    expect(point[2]).toBe(values[100]);
  });

  it("keeps its stretches when the view moves, so that nothing flickers", () => {
    const before = new Set(samplePoints(curve, { first: 1000, last: 4000 }, 300).map((one) => `${one[1]} ${one[2]}`));
    const after = samplePoints(curve, { first: 1033.3, last: 4033.3 }, 300).map((one) => `${one[1]} ${one[2]}`);
    expect(after.filter((one) => !before.has(one)).length).toBeLessThan(8);
  });
});
