/** What follows the playhead and the mouse: drawn on a canvas of its own, which is all that playing draws. */
import { formatTime } from "../words/numbers";
import type { LabelPalette } from "./label_colours";
import { OVERVIEW_HEIGHT, RULER_HEIGHT, type Layout } from "./layout";
import { elide, measure } from "./text";
import type { Theme } from "./theme";
import { toPixels, type Range } from "./view";

export interface OverContent {
  width: number;
  height: number;
  range: Range;
  layout: Layout;
  theme: Theme;
  palette: LabelPalette;
  frame: number;
  frames: number;
  rate: number;
  hover: number | null;
  held: { label: string; onset: number; offset: number } | null;
  /** Where a boundary that is moved would come to lie. */
  moving: number | null;
}

export function drawOver(context: CanvasRenderingContext2D, content: OverContent): void {
  const { width, height, range, theme, frame } = content;
  const x = toPixels(frame, range, width);
  if (content.hover !== null && content.moving === null) drawHover(context, content, content.hover);
  if (content.held !== null) drawHeld(context, content, content.held);

  const overview = ((frame + 0.5) / Math.max(1, content.frames)) * width;
  context.fillStyle = theme.playhead;
  context.fillRect(overview - 0.75, 0, 1.5, OVERVIEW_HEIGHT);

  const perFrame = width / (range.last - range.first);
  if (x > -perFrame - 8 && x < width + 8) {
    if (perFrame >= 4) {
      // The frame itself is a stretch when one is this close.
      context.globalAlpha = 0.13;
      context.fillRect(x, content.layout.rowsTop, perFrame, height - content.layout.rowsTop);
      context.globalAlpha = 1;
    }
    context.fillRect(x - 0.75, OVERVIEW_HEIGHT, 1.5, height - OVERVIEW_HEIGHT);
    if (content.moving === null) {
      drawChip(context, content, x, formatTime(frame, content.rate), theme.playhead, theme.surface);
    }
  }
  if (content.moving !== null) {
    const at = toPixels(content.moving, range, width);
    context.fillStyle = theme.text;
    context.fillRect(at - 0.5, OVERVIEW_HEIGHT, 1, height - OVERVIEW_HEIGHT);
    const text = `${formatTime(content.moving, content.rate)}  #${content.moving}`;
    drawChip(context, content, at, text, theme.text, theme.surface);
  }
}

function drawHover(context: CanvasRenderingContext2D, content: OverContent, frame: number): void {
  const { theme } = content;
  const x = Math.round(toPixels(frame, content.range, content.width)) + 0.5;
  context.strokeStyle = theme.muted;
  context.globalAlpha = 0.55;
  context.lineWidth = 1;
  context.setLineDash([2, 3]);
  context.beginPath();
  context.moveTo(x, OVERVIEW_HEIGHT + RULER_HEIGHT);
  context.lineTo(x, content.height);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
  drawChip(
    context, content, x, formatTime(frame, content.rate), theme.surface, theme.muted, theme.line,
  );
}

/** A time on the ruler, kept in sight at both ends. */
function drawChip(
  context: CanvasRenderingContext2D, content: OverContent, x: number, text: string, colour: string, ink: string,
  edge?: string,
): void {
  context.font = `600 11px ${content.theme.font}`;
  const width = measure(context, text.replace(/\d/g, "0")) + 10;
  const left = Math.min(Math.max(0, x - width / 2), content.width - width);
  context.fillStyle = colour;
  context.beginPath();
  context.roundRect(left, OVERVIEW_HEIGHT + 3, width, 16, 4);
  context.fill();
  if (edge !== undefined) {
    context.strokeStyle = edge;
    context.lineWidth = 1;
    context.stroke();
  } else {
    context.beginPath();
    context.moveTo(x - 4, OVERVIEW_HEIGHT + 18.5);
    context.lineTo(x + 4, OVERVIEW_HEIGHT + 18.5);
    context.lineTo(x, OVERVIEW_HEIGHT + 23.5);
    context.fill();
  }
  context.fillStyle = ink;
  context.textBaseline = "middle";
  context.textAlign = "center";
  context.fillText(text, left + width / 2, OVERVIEW_HEIGHT + 11.5);
  context.textAlign = "start";
}

/** The segment that a held key will become. */
function drawHeld(
  context: CanvasRenderingContext2D, content: OverContent, label: { label: string; onset: number; offset: number },
): void {
  const row = content.layout.tiers.find((one) => one.isActive);
  if (row === undefined) return;
  const colours = content.palette.find(row.tier, label.label);
  const left = toPixels(label.onset, content.range, content.width);
  const right = Math.max(left + 2, toPixels(label.offset, content.range, content.width));
  context.fillStyle = colours.solid;
  context.strokeStyle = content.theme.text;
  context.lineWidth = 1.5;
  context.beginPath();
  context.roundRect(left, row.top + 1, right - left, row.height - 2, 4);
  context.globalAlpha = 0.88;
  context.fill();
  context.globalAlpha = 1;
  context.stroke();
  context.fillStyle = colours.onSolid;
  context.font = `600 13px ${content.theme.font}`;
  context.textBaseline = "middle";
  const from = Math.max(left, 0) + 8;
  context.fillText(
    elide(label.label, right - from - 4, (text) => measure(context, text)), from, row.top + row.height / 2,
  );
}
