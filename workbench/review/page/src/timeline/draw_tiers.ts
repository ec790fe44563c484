/**
 * Tiers: who said what when.
 *
 * Proposed is light, striped and dashed; reviewed is solid with a tick; adjudicated is solid with a second edge and two
 * ticks. Below the active tier's segments stands how sure the model was: the higher the bar, the surer; low bars are
 * drawn in the colour of warnings.
 */
import type { Segment } from "../api/messages";
import { mix } from "../labels/colours";
import { formatFixed } from "../words/numbers";
import type { LabelPalette } from "./label_colours";
import type { TierRow } from "./layout";
import { findFrom } from "./segments";
import { elide, measure } from "./text";
import type { LabelColours, Theme } from "./theme";
import type { Range } from "./view";

/** Height of the bars below the active tier's segments. */
const FOOT = 13;
/** Pixels below which a proposal has no room for stripes and dashes. */
const NARROW = 14;
/** Pixels of the solid upper edge of a proposal in the active tier. */
const EDGE = 3;
/** Below it, a model is not sure. */
const UNSURE = 0.5;

export interface TierLook {
  range: Range;
  width: number;
  theme: Theme;
  palette: LabelPalette;
  selected: ReadonlySet<string>;
  /** Seconds of frames, for the line below a label. */
  rate: number;
}

interface Placed {
  segment: Segment;
  left: number;
  width: number;
}

export function drawTier(
  context: CanvasRenderingContext2D, row: TierRow, segments: readonly Segment[], look: TierLook,
): void {
  const scale = look.width / (look.range.last - look.range.first);
  const foot = row.isActive ? FOOT + 2 : 0;
  const top = row.top + 1;
  const height = row.height - 2 - foot;
  const ink: Ink = {
    stripes: new Map(), shift: -((look.range.first * scale) % STRIPE), thin: new Map(), feet: new Map(),
  };
  const { theme } = look;
  const feet = {
    track: mix(theme.grid, theme.surface, 0.6), sure: mix(theme.muted, theme.surface, 0.6), unsure: theme.warning,
  };
  const footTop = row.top + row.height - FOOT - 1;
  let pixel = -1;
  const chosen: Placed[] = [];

  context.textBaseline = "middle";
  for (let index = findFrom(segments, look.range.first); index < segments.length; index += 1) {
    const segment = segments[index]!;
    if (segment.onset >= look.range.last) break;
    const left = (segment.onset - look.range.first) * scale;
    const width = (segment.offset - segment.onset) * scale;
    const isSelected = row.isActive && look.selected.has(segment.id);
    // Of what is thinner than a pixel one is drawn a pixel; what is chosen is drawn always.
    if (width < 1 && Math.floor(left) === pixel && !isSelected) continue;
    pixel = Math.floor(left);
    const placed = { segment, left, width };
    if (isSelected) chosen.push(placed);
    drawSegment(context, placed, top, height, row, look, ink);
    if (row.isActive && width >= 10) {
      const [before, after] = [segments[index - 1], segments[index + 1]];
      const beside = (one: Segment | undefined, meets: boolean) => (one !== undefined && meets ? one.label : "");
      const fits = look.palette.fits(
        row.tier, segment.label, beside(before, before?.offset === segment.onset),
        beside(after, after?.onset === segment.offset),
      );
      if (!fits) drawUnfit(context, placed, top, theme);
    }
    if (row.isActive) planConfidence(placed, footTop, feet, ink.feet);
  }
  fillAll(context, ink.thin);
  fillAll(context, ink.feet);
  for (const placed of chosen) drawChosen(context, placed, top, height, look);
}

/** Rectangles to fill, x y width height one after the other, by colour: changing colours is what costs time. */
type Rectangles = Map<string, number[]>;

interface Ink {
  stripes: Map<string, CanvasPattern | string>;
  shift: number;
  /** Segments too narrow for an outline. */
  thin: Rectangles;
  feet: Rectangles;
}

function plan(rectangles: Rectangles, colour: string, x: number, y: number, width: number, height: number): void {
  const list = rectangles.get(colour);
  if (list === undefined) rectangles.set(colour, [x, y, width, height]);
  else list.push(x, y, width, height);
}

function fillAll(context: CanvasRenderingContext2D, rectangles: Rectangles): void {
  for (const [colour, list] of rectangles) {
    context.fillStyle = colour;
    for (let at = 0; at < list.length; at += 4) {
      context.fillRect(list[at]!, list[at + 1]!, list[at + 2]!, list[at + 3]!);
    }
  }
}

function drawSegment(
  context: CanvasRenderingContext2D, placed: Placed, top: number, height: number, row: TierRow, look: TierLook,
  ink: Ink,
): void {
  const { segment } = placed;
  const colours = look.palette.find(row.tier, segment.label);
  const isProposed = segment.status === "proposed";
  if (segment.kind === "point" && placed.width < 9) {
    drawPoint(context, placed, top, height, colours, isProposed);
    return;
  }
  const isWide = placed.width >= (isProposed ? NARROW : 5);
  const left = isWide ? Math.max(-8, placed.left + 0.75) : placed.left;
  const end = placed.left + placed.width;
  const right = isWide ? Math.min(look.width + 8, end - 0.75) : Math.max(placed.left + 1, end);
  const width = Math.max(1, right - left);
  if (!isWide) {
    const gap = width >= 4 ? 0.75 : 0;
    const [x, wide] = [left + gap, width - 2 * gap];
    plan(ink.thin, isProposed ? colours.stripe : colours.solid, x, top, wide, height);
    if (isProposed && width >= 3) plan(ink.thin, colours.edge, x, top, wide, EDGE);
    if (colours.to === null || width < 2) return;
    plan(ink.thin, isProposed ? colours.to.stripe : colours.to.solid, x + wide / 2, top, wide / 2, height);
    if (isProposed && width >= 3) plan(ink.thin, colours.to.edge, x + wide / 2, top, wide / 2, EDGE);
    return;
  }
  const radius = row.isActive && width >= 12 ? 4 : width >= 6 ? 3 : 0;
  context.beginPath();
  context.roundRect(left, top, width, height, radius);
  context.fillStyle = isProposed ? findStripes(context, colours, ink)
    : blend(context, left, right, colours.solid, colours.to?.solid);
  context.fill();
  const edge = blend(context, left, right, colours.edge, colours.to?.edge);
  if (isProposed) {
    if (row.isActive) {
      context.fillStyle = edge;
      context.beginPath();
      context.roundRect(left, top, width, EDGE, [EDGE, EDGE, 0, 0]);
      context.fill();
    }
    context.strokeStyle = edge;
    context.lineWidth = 1;
    context.setLineDash([4, 3]);
    context.beginPath();
    context.roundRect(left + 0.5, top + 0.5, Math.max(0, width - 1), height - 1, radius);
    context.stroke();
    context.setLineDash([]);
  } else if (colours.edge !== colours.solid || segment.status === "adjudicated") {
    const inset = segment.status === "adjudicated" ? 2.5 : 0.5;
    context.strokeStyle = segment.status === "adjudicated" ? colours.onSolid : edge;
    context.lineWidth = 1;
    context.beginPath();
    context.roundRect(left + inset, top + inset, Math.max(0, width - 2 * inset), height - 2 * inset, 3);
    context.stroke();
  }
  drawTexts(context, segment, left, right, top, height, row, look, colours);
}

/** A colour, or what leads from one to another: the middle belongs to both. */
function blend(
  context: CanvasRenderingContext2D, left: number, right: number, from: string, to: string | undefined,
): CanvasGradient | string {
  if (to === undefined) return from;
  const gradient = context.createLinearGradient(left, 0, right, 0);
  gradient.addColorStop(0.25, from);
  gradient.addColorStop(0.75, to);
  return gradient;
}

function drawTexts(
  context: CanvasRenderingContext2D, segment: Segment, left: number, right: number, top: number, height: number,
  row: TierRow, look: TierLook, colours: LabelColours,
): void {
  // A text stays in sight while any of its segment does.
  const seen = Math.min(right, look.width) - Math.max(left, 0);
  const margin = row.isActive ? Math.max(3, Math.min(9, seen / 7)) : 5;
  const from = Math.max(left, 0) + margin;
  const room = seen - margin - Math.min(5, margin);
  if (room < 8) return;
  const isProposed = segment.status === "proposed";
  const colour = isProposed ? colours.onTint : colours.onSolid;
  const isTall = height >= 36;
  const middle = isTall ? top + height / 2 - 8 : top + height / 2 + 0.5;
  const count = segment.status === "adjudicated" ? 2 : 1;
  const hasTicks = !isProposed && room >= 34;
  const x = hasTicks ? from + drawTicks(context, from, middle, colour, count) + 5 : from;
  context.fillStyle = colour;
  context.font = `600 ${row.isActive ? 13 : 11}px ${look.theme.font}`;
  context.fillText(elide(segment.label, from + room - x, (text) => measure(context, text)), x, middle);
  if (!isTall) return;
  context.font = `11px ${look.theme.font}`;
  const seconds = `${formatFixed((segment.offset - segment.onset) / look.rate, 2)} s`;
  const sure = segment.confidence === null ? "" : `${Math.round(segment.confidence * 100)} %`;
  const both = sure === "" ? seconds : `${seconds} · ${sure}`;
  const text = [both, sure, seconds].find((one) => one !== "" && measure(context, one) <= room);
  // Where a tick has no room beside the label, it stands below.
  if (!isProposed && !hasTicks) {
    if (room >= 3.5 + 4.5 * count) drawTicks(context, from, middle + 17, colour, count);
  } else if (text !== undefined) context.fillText(text, from, middle + 17);
}

/** Draw ticks; answers how wide they are. */
function drawTicks(context: CanvasRenderingContext2D, x: number, y: number, colour: string, count: number): number {
  context.strokeStyle = colour;
  context.lineWidth = 1.75;
  context.lineCap = "round";
  context.beginPath();
  for (let index = 0; index < count; index += 1) {
    const at = x + index * 4.5;
    context.moveTo(at, y + 0.5);
    context.lineTo(at + 2.75, y + 3.25);
    context.lineTo(at + 8, y - 3.5);
  }
  context.stroke();
  context.lineCap = "butt";
  return 8 + (count - 1) * 4.5;
}

function drawPoint(
  context: CanvasRenderingContext2D, placed: Placed, top: number, height: number, colours: LabelColours,
  isProposed: boolean,
): void {
  const x = placed.left + placed.width / 2;
  const size = Math.min(6, height / 3);
  context.fillStyle = isProposed ? colours.tint : colours.solid;
  context.strokeStyle = colours.edge;
  context.lineWidth = 1.25;
  context.beginPath();
  context.moveTo(x, top + height);
  context.lineTo(x, top + 2 * size);
  context.stroke();
  context.beginPath();
  context.moveTo(x, top);
  context.lineTo(x + size, top + size);
  context.lineTo(x, top + 2 * size);
  context.lineTo(x - size, top + size);
  context.closePath();
  context.fill();
  context.stroke();
}

function planConfidence(
  placed: Placed, top: number, colours: { track: string; sure: string; unsure: string }, feet: Rectangles,
): void {
  const { confidence } = placed.segment;
  if (confidence === null) return;
  const gap = placed.width >= 4 ? 0.75 : 0;
  const [x, width] = [placed.left + gap, Math.max(1, placed.width - 2 * gap)];
  const height = Math.max(1.5, Math.min(1, confidence) * FOOT);
  // Behind it stands how high the bar would be if the model were certain.
  if (placed.width >= 3) plan(feet, colours.track, x, top, width, FOOT);
  plan(feet, confidence < UNSURE ? colours.unsure : colours.sure, x, top + FOOT - height, width, height);
}

function drawChosen(
  context: CanvasRenderingContext2D, placed: Placed, top: number, height: number, look: TierLook,
): void {
  const left = Math.max(-10, placed.left - 0.5);
  const right = Math.min(look.width + 10, placed.left + Math.max(placed.width, 2) + 0.5);
  context.lineWidth = 4;
  context.strokeStyle = look.theme.surface;
  context.beginPath();
  context.roundRect(left, top, right - left, height, 5);
  context.stroke();
  context.lineWidth = 2.25;
  context.strokeStyle = look.theme.text;
  context.stroke();
  if (placed.width < 26) return;
  for (const x of [placed.left, placed.left + placed.width]) {
    context.fillStyle = look.theme.text;
    context.beginPath();
    context.roundRect(x - 3, top + height / 2 - 9, 6, 18, 3);
    context.fill();
    context.fillStyle = look.theme.surface;
    context.fillRect(x - 0.5, top + height / 2 - 5, 1, 10);
  }
}

/** A transition that its neighbours contradict: a corner in the colour of warnings. */
function drawUnfit(context: CanvasRenderingContext2D, placed: Placed, top: number, theme: Theme): void {
  const right = placed.left + placed.width - 1;
  context.fillStyle = theme.warning;
  context.beginPath();
  context.moveTo(right - 10, top);
  context.lineTo(right, top);
  context.lineTo(right, top + 10);
  context.closePath();
  context.fill();
}

const STRIPE = 8;

/** Diagonal stripes of a label, made once a drawing; plain where there is no canvas to make them on. */
function findStripes(context: CanvasRenderingContext2D, colours: LabelColours, ink: Ink): CanvasPattern | string {
  const key = `${colours.tint} ${colours.stripe}`;
  let pattern = ink.stripes.get(key);
  if (pattern === undefined) {
    pattern = makeStripes(context, key, colours, ink.shift) ?? colours.tint;
    ink.stripes.set(key, pattern);
  }
  return pattern;
}

const tiles = new Map<string, HTMLCanvasElement>();

function makeStripes(
  context: CanvasRenderingContext2D, key: string, colours: LabelColours, shift: number,
): CanvasPattern | null {
  let tile = tiles.get(key);
  // Twice as fine as CSS pixels, so that stripes are smooth on fine screens.
  if (tile === undefined) {
    tile = document.createElement("canvas");
    tile.width = tile.height = STRIPE * 2;
    const drawing = tile.getContext("2d");
    if (drawing === null) return null;
    drawing.fillStyle = colours.tint;
    drawing.fillRect(0, 0, 16, 16);
    drawing.strokeStyle = colours.stripe;
    drawing.lineWidth = 2.5;
    drawing.beginPath();
    for (const at of [-16, 0, 16]) {
      drawing.moveTo(at - 2, 18);
      drawing.lineTo(at + 18, -2);
    }
    drawing.stroke();
    tiles.set(key, tile);
  }
  const pattern = context.createPattern(tile, "repeat");
  pattern?.setTransform(new DOMMatrix().translate(shift, 0).scale(0.5));
  return pattern;
}
