/** The ruler: times, stretches with an outstanding residual, the loop, in and out. */
import { formatTime } from "../words/numbers";
import { chooseTicks } from "./ruler";
import type { Theme } from "./theme";
import { toPixels, type Range } from "./view";

/** Draw times and, downwards, a line for each of them. */
export function drawTimes(
  context: CanvasRenderingContext2D, top: number, height: number, below: number, range: Range, width: number,
  rate: number, theme: Theme,
): void {
  const ticks = chooseTicks(range, width, rate);
  const small = ticks.major / ticks.parts;
  context.font = `11px ${theme.font}`;
  context.textBaseline = "middle";
  context.lineWidth = 1;
  for (let index = Math.floor(range.first / small); index * small <= range.last; index += 1) {
    const x = Math.round(toPixels(index * small, range, width)) + 0.5;
    const isMajor = index % ticks.parts === 0;
    context.strokeStyle = isMajor ? theme.line : theme.grid;
    context.beginPath();
    context.moveTo(x, top + height - (isMajor ? 9 : 4));
    context.lineTo(x, isMajor ? below : top + height);
    context.stroke();
    if (!isMajor) continue;
    context.fillStyle = theme.muted;
    context.fillText(formatTime(index * small, rate, ticks.digits), x + 4, top + height / 2 - 2);
  }
}

/**
 * Mark stretches [onset, offset) by a bar: the fainter, the less of it they fill, where many share a pixel. Each is at
 * least two pixels wide, so that none is overlooked.
 */
export function drawStretches(
  context: CanvasRenderingContext2D, stretches: readonly (readonly [number, number])[], top: number, height: number,
  range: Range, width: number, colour: string,
): void {
  context.fillStyle = colour;
  // A bar of neighbours that touch on the screen, and how many pixels of it are theirs.
  let bar: Bar | null = null;
  const draw = (bar: Bar | null) => {
    if (bar === null) return;
    context.globalAlpha = Math.max(0.3, Math.min(1, bar.filled / (bar.right - bar.left)));
    context.fillRect(bar.left, top, bar.right - bar.left, height);
  };
  for (const [onset, offset] of stretches) {
    if (offset <= range.first || onset >= range.last) continue;
    const left = toPixels(onset, range, width);
    const right = toPixels(offset, range, width);
    if (bar !== null && left < bar.right && right - bar.left <= LONGEST_BAR) {
      bar.right = Math.max(bar.right, right);
      bar.filled += right - left;
      continue;
    }
    draw(bar);
    const from: number = Math.max(left, bar?.right ?? left);
    bar = { left: from, right: Math.max(from + 2, right), filled: Math.max(1.2, right - left) };
  }
  draw(bar);
  context.globalAlpha = 1;
}

interface Bar {
  left: number;
  right: number;
  filled: number;
}

/** Pixels over which stretches are drawn as one bar of their mean density. */
const LONGEST_BAR = 8;

/** Draw the stretch that is played over and over. */
export function drawLoop(
  context: CanvasRenderingContext2D, loop: { onset: number; offset: number }, top: number, bottom: number, range: Range,
  width: number, theme: Theme,
): void {
  const left = toPixels(loop.onset, range, width);
  const right = toPixels(loop.offset, range, width);
  context.fillStyle = theme.playhead;
  context.globalAlpha = 0.07;
  context.fillRect(left, top, right - left, bottom - top);
  context.globalAlpha = 0.75;
  context.fillRect(left, top, right - left, 3);
  context.fillRect(left - 1, top, 2, 10);
  context.fillRect(right - 1, top, 2, 10);
  context.globalAlpha = 1;
}

/** Draw in and out, and what lies between them. */
export function drawMarks(
  context: CanvasRenderingContext2D, marks: { onset: number | null; offset: number | null }, top: number,
  bottom: number, range: Range, width: number, theme: Theme, flags: { onset: string; offset: string },
): void {
  const at = (frame: number) => toPixels(frame, range, width);
  if (marks.onset !== null && marks.offset !== null) {
    context.fillStyle = theme.accent;
    context.globalAlpha = 0.14;
    context.fillRect(at(marks.onset), top, at(marks.offset) - at(marks.onset), bottom - top);
    context.globalAlpha = 1;
  }
  context.font = `700 10px ${theme.font}`;
  context.textBaseline = "middle";
  for (const [frame, flag, side] of [[marks.onset, flags.onset, 1], [marks.offset, flags.offset, -1]] as const) {
    if (frame === null) continue;
    const x = at(frame);
    context.fillStyle = theme.accent;
    context.fillRect(x - 0.75, top, 1.5, bottom - top);
    const length = context.measureText(flag).width + 8;
    context.fillRect(side > 0 ? x : x - length, top, length, 14);
    context.fillStyle = theme.surface;
    context.fillText(flag, (side > 0 ? x : x - length) + 4, top + 7.5);
  }
}
