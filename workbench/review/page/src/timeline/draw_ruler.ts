/** The ruler: times, stretches with an outstanding residual, the loop, in and out. */
import { formatTime, chooseTicks } from "./ruler";
import type { Theme } from "./theme";
import { toPixels, type Range } from "./view";

/** Draw times and, downwards, a line for each of them. */
export function drawTimes(
  context: CanvasRenderingContext2D, top: number, height: number, below: number, range: Range, width: number,
  rate: number,
  theme: Theme, comma: boolean,
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
    context.fillText(formatTime(index * small, rate, ticks.digits, comma), x + 4, top + height / 2 - 2);
  }
}

/** Mark stretches [onset, offset) by a bar; each is at least two pixels wide, so that none is overlooked. */
export function drawStretches(
  context: CanvasRenderingContext2D, stretches: readonly (readonly [number, number])[], top: number, height: number,
  range: Range,
  width: number, colour: string,
): void {
  context.fillStyle = colour;
  let drawn = -Infinity;
  for (const [onset, offset] of stretches) {
    if (offset <= range.first || onset >= range.last) continue;
    const left = Math.max(drawn, toPixels(onset, range, width));
    const right = Math.max(left + 2, toPixels(offset, range, width));
    context.fillRect(left, top, right - left, height);
    drawn = right;
  }
}

/** Draw the stretch that is played over and over. */
export function drawLoop(
  context: CanvasRenderingContext2D, loop: { onset: number; offset: number }, top: number, bottom: number, range: Range,
  width: number,
  theme: Theme,
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
  bottom: number, range: Range,
  width: number, theme: Theme, flags: { onset: string; offset: string },
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
