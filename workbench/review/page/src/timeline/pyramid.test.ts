import { describe, expect, it } from "vitest";
import { findQuantile, Pyramid } from "./pyramid";

/** Reproducible numbers: a linear congruence. */
function makeValues(count: number, gaps: boolean): Float32Array {
  let state = 12345;
  return Float32Array.from({ length: count }, () => {
    state = (state * 1103515245 + 12345) % 2147483648;
    return gaps && state % 3 === 0 ? NaN : state / 2147483648 - 0.5;
  });
}

function slowly(values: Float32Array, first: number, last: number): [number, number] {
  const kept = [...values.slice(Math.max(0, first), Math.max(0, last))].filter((value) => !Number.isNaN(value));
  return kept.length === 0 ? [NaN, NaN] : [Math.min(...kept), Math.max(...kept)];
}

describe("Pyramid", () => {
  it.each([0, 1, 7, 8, 9, 64, 65, 513, 4100])("agrees with looking at every one of %i values", (count) => {
    for (const gaps of [false, true]) {
      const values = makeValues(count, gaps);
      const pyramid = new Pyramid(values);
      for (let trial = 0; trial < 120; trial += 1) {
        const first = Math.floor(((trial * 7919) % 1000) / 1000 * (count + 3)) - 1;
        const last = first + Math.floor(((trial * 104729) % 1000) / 1000 * (count + 3));
        expect(pyramid.extremes(first, last)).toEqual(slowly(values, first, last));
      }
      expect(pyramid.extremes(-5, count + 5)).toEqual(slowly(values, 0, count));
    }
  });

  it("passes gaps over and says NaN where there is nothing else", () => {
    const pyramid = new Pyramid(Float32Array.from([NaN, 2, NaN, NaN, -1, NaN]));
    expect(pyramid.extremes(0, 6)).toEqual([-1, 2]);
    expect(pyramid.extremes(2, 4)).toEqual([NaN, NaN]);
    expect(pyramid.extremes(4, 4)).toEqual([NaN, NaN]);
  });

  it("finds one spike in an hour", () => {
    const values = new Float32Array(720_000);
    values[411_111] = 9;
    const pyramid = new Pyramid(values);
    expect(pyramid.extremes(0, 720_000)).toEqual([0, 9]);
    expect(pyramid.extremes(411_111, 411_112)).toEqual([9, 9]);
    expect(pyramid.extremes(0, 411_111)).toEqual([0, 0]);
    expect(pyramid.extremes(411_112, 720_000)).toEqual([0, 0]);
  });
});

describe("findQuantile", () => {
  it("sorts as numbers and leaves gaps out", () => {
    expect(findQuantile(Float32Array.from([10, 9, NaN, 2, 1]), 0)).toBe(1);
    expect(findQuantile(Float32Array.from([10, 9, NaN, 2, 1]), 1)).toBe(10);
    expect(findQuantile(Float32Array.from([NaN]), 0.5)).toBeNaN();
    expect(findQuantile(Float32Array.from({ length: 1001 }, (_, index) => index), 0.5)).toBe(500);
  });
});
