/** Curves: a line where single frames can be told apart, else the band between smallest and largest. */
import type { Curve } from "./curves";
import type { CurveRow } from "./layout";
import type { Theme } from "./theme";
import type { Range } from "./view";

/** Frames a pixel above which extremes are drawn instead of every frame. */
const DENSE = 1.2;
const MARGIN = 3;

export function drawCurve(
  context: CanvasRenderingContext2D, row: CurveRow, curve: Curve, range: Range, width: number, colour: string,
  theme: Theme,
  threshold: number | null,
): void {
  const bottom = row.top + row.height - MARGIN;
  const scale = (row.height - 2 * MARGIN) / Math.max(1e-12, curve.high - curve.low);
  const toY = (value: number) => Math.max(row.top + 1, Math.min(bottom, bottom - (value - curve.low) * scale));
  const base = toY(Math.max(0, curve.low));

  context.save();
  context.beginPath();
  context.rect(0, row.top, width, row.height);
  context.clip();
  if (curve.low < 0) drawLevel(context, base, width, theme.grid, []);
  if (threshold !== null && threshold < curve.high) drawLevel(context, toY(threshold), width, theme.warning, [4, 4]);

  const points = samplePoints(curve, range, width);
  context.fillStyle = colour;
  context.strokeStyle = colour;
  context.lineJoin = "bevel";
  for (const run of splitRuns(points)) {
    context.beginPath();
    run.forEach(([x, , high], index) => (index === 0 ? context.moveTo(x, toY(high)) : context.lineTo(x, toY(high))));
    context.lineWidth = 1.25;
    context.stroke();
    context.lineTo(run[run.length - 1]![0], base);
    context.lineTo(run[0]![0], base);
    context.globalAlpha = theme.isDark ? 0.2 : 0.13;
    context.fill();
    context.globalAlpha = 0.55;
    context.beginPath();
    run.forEach(([x, , high], index) => (index === 0 ? context.moveTo(x, toY(high)) : context.lineTo(x, toY(high))));
    for (let index = run.length - 1; index >= 0; index -= 1) context.lineTo(run[index]![0], toY(run[index]![1]));
    context.fill();
    context.globalAlpha = 1;
  }
  // What goes beyond the row is said by a line along its upper edge.
  for (const [x, , high] of points) if (high > curve.high) context.fillRect(x - 1, row.top, 2, 2.5);
  context.restore();
}

/**
 * Points from left to right: x, smallest, largest; NaN in gaps.
 *
 * Stretches of more than a frame begin at multiples of their length, so that a curve does not flicker while it moves.
 */
export function samplePoints(curve: Curve, range: Range, width: number): [number, number, number][] {
  const span = range.last - range.first;
  const perPixel = span / Math.max(1, width);
  const points: [number, number, number][] = [];
  if (perPixel <= DENSE) {
    const last = Math.min(curve.pyramid.length - 1, Math.ceil(range.last));
    for (let frame = Math.max(0, Math.floor(range.first) - 1); frame <= last; frame += 1) {
      const value = curve.pyramid.values[frame]!;
      points.push([(frame + 0.5 - range.first) / perPixel, value, value]);
    }
    return points;
  }
  for (let bucket = Math.floor(range.first / perPixel) - 1; bucket * perPixel < range.last; bucket += 1) {
    const first = Math.round(bucket * perPixel);
    const [low, high] = curve.pyramid.extremes(first, Math.max(first + 1, Math.round((bucket + 1) * perPixel)));
    points.push([((bucket + 0.5) * perPixel - range.first) / perPixel, low, high]);
  }
  return points;
}

function splitRuns(points: readonly [number, number, number][]): [number, number, number][][] {
  const runs: [number, number, number][][] = [];
  let run: [number, number, number][] = [];
  for (const point of points) {
    if (Number.isNaN(point[2])) {
      if (run.length > 0) runs.push(run);
      run = [];
    } else run.push(point);
  }
  if (run.length > 0) runs.push(run);
  return runs;
}

function drawLevel(context: CanvasRenderingContext2D, y: number, width: number, colour: string, dash: number[]): void {
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.setLineDash(dash);
  context.beginPath();
  context.moveTo(0, Math.round(y) + 0.5);
  context.lineTo(width, Math.round(y) + 0.5);
  context.stroke();
  context.setLineDash([]);
}
