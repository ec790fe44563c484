/** Which part of the take is shown, and where frames lie on the screen. Frames at whole numbers are boundaries. */

/** In frames, not whole. */
export interface Range {
  first: number;
  last: number;
}

/** Frames that the closest view shows. */
export const FEWEST_FRAMES = 8;

/** The nearest range that lies in the take and shows at least `FEWEST_FRAMES` (or the whole take). */
export function clampRange(range: Range, frames: number): Range {
  const whole = Math.max(1, frames);
  const wanted = Number.isFinite(range.last - range.first) ? range.last - range.first : whole;
  const span = Math.min(whole, Math.max(Math.min(FEWEST_FRAMES, whole), wanted));
  const first = Math.min(Math.max(0, Number.isFinite(range.first) ? range.first : 0), whole - span);
  return { first, last: first + span };
}

/** Show `factor` times as many frames; `frame` stays where it is on the screen. */
export function zoomAt(range: Range, frame: number, factor: number, frames: number): Range {
  const span = Math.max(1e-9, range.last - range.first);
  const next = Math.min(Math.max(1, frames), Math.max(Math.min(FEWEST_FRAMES, frames), span * factor));
  const part = (frame - range.first) / span;
  return clampRange({ first: frame - part * next, last: frame - part * next + next }, frames);
}

/** Show what lies `by` frames later. */
export function panBy(range: Range, by: number, frames: number): Range {
  return clampRange({ first: range.first + by, last: range.last + by }, frames);
}

/** Pixels at each end of the view in which a drag moves it. */
const EDGE = 28;
/** Views a second at the very end. */
const FASTEST = 0.9;

/** How fast a drag from `start` that is held at x moves the view, in views a second; only where it was dragged to. */
export function scrollSpeed(x: number, start: number, width: number): number {
  if (x < start && x < EDGE) return -FASTEST * Math.min(1, (EDGE - x) / EDGE) ** 2;
  if (x > start && x > width - EDGE) return FASTEST * Math.min(1, (x - width + EDGE) / EDGE) ** 2;
  return 0;
}

/** Show an interval with some of what lies around it. */
export function fit(onset: number, offset: number, frames: number): Range {
  const margin = Math.max(FEWEST_FRAMES / 2, (offset - onset) * 0.6);
  return clampRange({ first: onset - margin, last: offset + margin }, frames);
}

/**
 * The range once the playhead went from one frame to another.
 *
 * The view turns a page when the playhead leaves it, and comes along with a jump. Who looks elsewhere while it plays
 * is left there.
 */
export function follow(range: Range, before: number, now: number, playing: boolean, frames: number): Range {
  const span = range.last - range.first;
  const isSeen = (frame: number) => frame >= range.first && frame < range.last;
  if (isSeen(now)) return range;
  const isStep = Math.abs(now - before) < span * 0.1;
  if (playing && isStep && !isSeen(before)) return range;
  const part = isStep ? (now >= before ? 0.06 : 0.94) : 0.3;
  return clampRange({ first: now - span * part, last: now + span * (1 - part) }, frames);
}

export function toPixels(frame: number, range: Range, width: number): number {
  return ((frame - range.first) / (range.last - range.first)) * width;
}

export function toFrames(pixels: number, range: Range, width: number): number {
  return range.first + (pixels / Math.max(1, width)) * (range.last - range.first);
}
