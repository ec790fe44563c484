/** The strip with the whole take: what is reviewed already, where it moves, which part is shown. */
import type { Segment } from "../api/messages";
import { samplePoints } from "./draw_curves";
import type { Curve } from "./curves";
import type { LabelPalette } from "./label_colours";
import { OVERVIEW_HEIGHT } from "./layout";
import type { Theme } from "./theme";
import type { Range } from "./view";

const BAND = 9;
const PAD = 2;

export interface OverviewContent {
  segments: readonly Segment[];
  tier: string;
  frames: number;
  curve: Curve | null;
  stretches: readonly (readonly [number, number])[];
}

/** Keeps the picture of the whole take, which changes seldom, so that moving the view does not draw it again. */
export class Overview {
  readonly #canvas = document.createElement("canvas");
  #made: unknown[] = [];

  draw(
    context: CanvasRenderingContext2D, content: OverviewContent, range: Range, width: number, palette: LabelPalette,
    theme: Theme,
    scale: number,
  ): void {
    const from = [
      content.segments, content.tier, content.frames, content.curve, content.stretches, width, palette, scale,
    ];
    if (from.some((one, index) => one !== this.#made[index])) {
      this.#make(content, width, palette, theme, scale);
      this.#made = from;
    }
    if (this.#canvas.width > 0) context.drawImage(this.#canvas, 0, 0, width, OVERVIEW_HEIGHT);
    drawWindow(context, range, content.frames, width, theme);
  }

  #make(content: OverviewContent, width: number, palette: LabelPalette, theme: Theme, scale: number): void {
    this.#canvas.width = Math.round(width * scale);
    this.#canvas.height = Math.round(OVERVIEW_HEIGHT * scale);
    const context = this.#canvas.getContext("2d");
    if (context === null) return;
    context.scale(scale, scale);
    context.fillStyle = theme.surface;
    context.fillRect(0, 0, width, OVERVIEW_HEIGHT);
    const toX = width / Math.max(1, content.frames);
    if (content.curve !== null) {
      const { low, high } = content.curve;
      const room = OVERVIEW_HEIGHT - BAND - 2 * PAD - 2;
      context.fillStyle = theme.muted;
      context.globalAlpha = 0.45;
      for (const [x, , value] of samplePoints(content.curve, { first: 0, last: content.frames }, width)) {
        if (Number.isNaN(value)) continue;
        const part = (value - Math.max(0, low)) / Math.max(1e-12, high - Math.max(0, low));
        const tall = Math.max(0.5, Math.min(1, part) * room);
        context.fillRect(x - 0.5, PAD + 1 + room - tall, 1, tall);
      }
      context.globalAlpha = 1;
    }
    let pixel = -1;
    const top = OVERVIEW_HEIGHT - BAND - 1;
    for (const segment of content.segments) {
      const left = segment.onset * toX;
      const long = Math.max(1, (segment.offset - segment.onset) * toX);
      if (long <= 1 && Math.floor(left) === pixel) continue;
      pixel = Math.floor(left);
      const colours = palette.find(content.tier, segment.label);
      if (segment.status === "proposed") {
        // Still to be looked at: the lower half only.
        context.fillStyle = colours.stripe;
        context.fillRect(left, top + BAND / 2, long, BAND / 2);
      } else {
        context.fillStyle = colours.solid;
        context.fillRect(left, top, long, BAND);
        if (colours.to !== null) {
          context.fillStyle = colours.to.solid;
          context.fillRect(left + long / 2, top, long / 2, BAND);
        }
      }
    }
    context.fillStyle = theme.warning;
    for (const [onset, offset] of content.stretches) {
      context.fillRect(onset * toX, 0, Math.max(1, (offset - onset) * toX), 2);
    }
  }
}

function drawWindow(
  context: CanvasRenderingContext2D, range: Range, frames: number, width: number, theme: Theme,
): void {
  const left = (range.first / Math.max(1, frames)) * width;
  const right = Math.max(left + 3, (range.last / Math.max(1, frames)) * width);
  context.fillStyle = theme.background;
  context.globalAlpha = 0.62;
  context.fillRect(0, 0, left, OVERVIEW_HEIGHT);
  context.fillRect(right, 0, width - right, OVERVIEW_HEIGHT);
  context.globalAlpha = 1;
  context.strokeStyle = theme.accent;
  context.lineWidth = 1.5;
  context.beginPath();
  context.roundRect(left + 0.75, 0.75, right - left - 1.5, OVERVIEW_HEIGHT - 1.5, 3);
  context.stroke();
  context.strokeStyle = theme.line;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(0, OVERVIEW_HEIGHT - 0.5);
  context.lineTo(width, OVERVIEW_HEIGHT - 0.5);
  context.stroke();
}
