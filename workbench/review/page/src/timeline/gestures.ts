/**
 * The mouse: what a click, a drag and the wheel do.
 *
 * Ruler: put and pull the playhead. Strip with the whole take: move the view. Boundary: move it (alone with Alt).
 * Segment: choose it (Shift: all up to it, Ctrl: one more), of somebody else: set in and out to it; twice: play it over
 * and over. Elsewhere: a click puts the playhead, a drag sets in and out. A drag that is held at an end of the view
 * moves the view. Wheel: zoom; with Shift or sideways: move. Middle button: move.
 */
import { batch } from "@preact/signals";
import { choose, edit } from "../state/actions";
import { activeSegments, activeTier, clock, marked, range, scene, selection } from "../state/state";
import { moveBoundary, type Edge, type Move } from "./boundaries";
import { findHit, REACH, type Hit } from "./hits";
import { OVERVIEW_HEIGHT } from "./layout";
import { layout, scroll, shownRange, size } from "./painter";
import { hover, preview } from "./preview";
import { findBetween } from "./segments";
import { clampRange, panBy, scrollSpeed, toFrames, toPixels, zoomAt } from "./view";

/** Pixels that the mouse may tremble in a click. */
const STILL = 4;

interface Drag {
  /** Called with every move; `isFar` once it is no click any more. */
  move: (x: number, event: PointerEvent, isFar: boolean) => void;
  /** Let go; a click where it never went far. */
  end: (x: number, event: PointerEvent, isFar: boolean) => void;
  cancel?: () => void;
  /** Whether the view goes on where the drag is held at its end. */
  scrolls?: boolean;
}

/** Whether a boundary or an area is being dragged, and how to stop it without a change. */
let cancelCurrent: (() => void) | null = null;

/** Give up the drag in progress; whether there was one. */
export function cancelDrag(): boolean {
  if (cancelCurrent === null) return false;
  cancelCurrent();
  return true;
}

/** Listen to the mouse over a canvas; the returned function ends it. */
export function listen(canvas: HTMLElement): () => void {
  let drag: Drag | null = null;
  let start = 0;
  let isFar = false;
  let latest: PointerEvent | null = null;
  let picture = 0;
  let turned = 0;

  // A drag that leaves the canvas goes to its end and no further.
  const place = (event: MouseEvent): [number, number] => {
    const box = canvas.getBoundingClientRect();
    return [Math.min(Math.max(0, event.clientX - box.left), size.peek().width), event.clientY - box.top];
  };
  const hitAt = (x: number, y: number): Hit =>
    findHit(x, y, layout.peek(), shownRange.peek(), size.peek().width, clock.frame.peek(), new Set(selection.peek()));
  // While the mouse is held at an end, it does not move: the view does, picture by picture.
  const scrollOn = (now: number) => {
    picture = 0;
    if (drag?.scrolls !== true || latest === null) return;
    const [x] = place(latest);
    const { width } = size.peek();
    const speed = isFar ? scrollSpeed(x, start, width) : 0;
    if (speed !== 0) {
      const view = shownRange.peek();
      const seconds = Math.min(0.1, (now - turned) / 1000);
      range.value = panBy(view, speed * seconds * (view.last - view.first), clock.frames);
      drag.move(x, latest, true);
    }
    turned = now;
    picture = requestAnimationFrame(scrollOn);
  };
  const finish = () => {
    cancelAnimationFrame(picture);
    latest = null;
    drag = null;
    cancelCurrent = null;
  };

  const down = (event: PointerEvent) => {
    const current = scene.peek();
    if (current === null || drag !== null || (event.button !== 0 && event.button !== 1)) return;
    const [x, y] = place(event);
    start = x;
    isFar = false;
    drag = event.button === 1 ? dragView(x) : beginDrag(hitAt(x, y), x, event);
    const begun = drag;
    cancelCurrent = () => {
      begun.cancel?.();
      finish();
    };
    canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
    canvas.closest<HTMLElement>(".timeline")?.focus({ preventScroll: true });
    latest = event;
    turned = performance.now();
    if (drag.scrolls) picture = requestAnimationFrame(scrollOn);
    drag.move(x, event, false);
  };
  const move = (event: PointerEvent) => {
    const [x, y] = place(event);
    if (drag !== null) {
      isFar ||= Math.abs(x - start) >= STILL;
      latest = event;
      drag.move(x, event, isFar);
      return;
    }
    const hit = hitAt(x, y);
    canvas.style.cursor = CURSORS[hit.part] ?? "default";
    const frame = Math.floor(toFrames(x, shownRange.peek(), size.peek().width));
    hover.value = y < OVERVIEW_HEIGHT || scene.peek() === null ? null : Math.min(Math.max(0, frame), clock.frames - 1);
  };
  const up = (event: PointerEvent) => {
    const ended = drag;
    finish();
    ended?.end(place(event)[0], event, isFar);
  };
  const lost = () => cancelCurrent?.();
  const leave = () => (hover.value = null);
  const twice = (event: MouseEvent) => {
    const hit = hitAt(...place(event));
    if (hit.part !== "segment" && hit.part !== "boundary") return;
    clock.setLoop({ onset: hit.segment.onset, offset: hit.segment.offset });
    clock.seek(hit.segment.onset);
    clock.play();
  };
  const wheel = (event: WheelEvent) => {
    event.preventDefault();
    const current = scene.peek();
    if (current === null || drag !== null) return;
    const view = shownRange.peek();
    const { width } = size.peek();
    // Lines and pages, as some mice count, in pixels.
    const unit = event.deltaMode === 1 ? 18 : event.deltaMode === 2 ? width : 1;
    const isSideways = event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY);
    if (isSideways) {
      const delta = (Math.abs(event.deltaX) > Math.abs(event.deltaY) ? event.deltaX : event.deltaY) * unit;
      range.value = panBy(view, (delta / Math.max(1, width)) * (view.last - view.first), current.frames);
      return;
    }
    const turn = Math.max(-240, Math.min(240, event.deltaY * unit));
    // Two fingers on a touchpad come as a wheel with Ctrl, in small turns.
    const factor = Math.exp(turn * (event.ctrlKey ? 0.008 : 0.0022));
    range.value = zoomAt(view, toFrames(place(event)[0], view, width), factor, current.frames);
  };

  canvas.addEventListener("pointerdown", down);
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", lost);
  canvas.addEventListener("pointerleave", leave);
  canvas.addEventListener("dblclick", twice);
  canvas.addEventListener("wheel", wheel, { passive: false });
  return () => {
    cancelCurrent?.();
    canvas.removeEventListener("pointerdown", down);
    canvas.removeEventListener("pointermove", move);
    canvas.removeEventListener("pointerup", up);
    canvas.removeEventListener("pointercancel", lost);
    canvas.removeEventListener("pointerleave", leave);
    canvas.removeEventListener("dblclick", twice);
    canvas.removeEventListener("wheel", wheel);
  };
}

const CURSORS: Partial<Record<Hit["part"], string>> = {
  overview: "grab", ruler: "ew-resize", playhead: "ew-resize", boundary: "col-resize", segment: "pointer",
  curve: "crosshair",
  tier: "crosshair",
};

/** Scroll the rows by the wheel over their names. */
export function scrollRows(event: WheelEvent): void {
  event.preventDefault();
  const placed = layout.peek();
  const most = Math.max(0, placed.contentHeight - (size.peek().height - placed.rowsTop));
  scroll.value = Math.min(Math.max(0, placed.scroll + event.deltaY), most);
}

function beginDrag(hit: Hit, x: number, event: PointerEvent): Drag {
  if (hit.part === "overview") return dragOverview(x);
  if (hit.part === "ruler" || hit.part === "playhead") return dragPlayhead(hit.part === "ruler");
  if (hit.part === "boundary") return dragBoundary(hit.segment.id, hit.edge, x);
  return dragMarks(x, (at) => click(hit, at, event));
}

function frameAt(x: number): number {
  return toFrames(x, shownRange.peek(), size.peek().width);
}

function click(hit: Hit, x: number, event: PointerEvent): void {
  const frame = Math.floor(frameAt(x));
  if (hit.part !== "segment" || hit.row.author !== null) {
    if (hit.part === "tier" && hit.row.author === null) activeTier.value = hit.row.tier;
    if (hit.part === "tier") selection.value = [];
    if (hit.part === "segment") {
      // What somebody else or a machine marked is a stretch to label: the next label's key goes to it.
      const { onset, offset } = hit.segment;
      batch(() => {
        selection.value = [];
        marked.value = { onset, offset };
      });
      clock.seek(Math.max(onset, Math.ceil(shownRange.peek().first)));
      return;
    }
    clock.seek(frame);
    return;
  }
  const { id } = hit.segment;
  const before = hit.row.isActive ? selection.peek() : [];
  if (!hit.row.isActive) activeTier.value = hit.row.tier;
  if (event.shiftKey && before[0] !== undefined) {
    const between = findBetween(activeSegments.peek(), before[0], id).map((one) => one.id);
    selection.value = between[0] === before[0] ? between : between.reverse();
  } else if (event.ctrlKey || event.metaKey) {
    selection.value = before.includes(id) ? before.filter((one) => one !== id) : [...before, id];
  } else {
    const isAgain = before.length === 1 && before[0] === id;
    if (!isAgain) pick(id);
    clock.seek(isAgain ? frame : Math.max(hit.segment.onset, Math.ceil(shownRange.peek().first)));
  }
}

/** Choose a segment without moving the view, which would pull it away from under the mouse. */
function pick(id: string): void {
  const view = shownRange.peek();
  batch(() => {
    choose(id, { seek: false });
    range.value = view;
  });
}

function dragPlayhead(isAtOnce: boolean): Drag {
  const wasPlaying = clock.playing.peek();
  const before = clock.frame.peek();
  const go = (x: number) => {
    clock.pause();
    clock.seek(Math.floor(frameAt(x)));
  };
  return {
    move: (x, _, isFar) => {
      if (isAtOnce || isFar) go(x);
    },
    end: () => {
      if (wasPlaying) clock.play();
    },
    cancel: () => clock.seek(before),
    scrolls: true,
  };
}

/** Move what is shown by the strip with the whole take; its ends zoom. */
function dragOverview(start: number): Drag {
  const { width } = size.peek();
  const { frames } = clock;
  const view = shownRange.peek();
  const perPixel = frames / Math.max(1, width);
  const [left, right] = [view.first / perPixel, view.last / perPixel];
  const isWide = right - left > 6 * REACH;
  const isNear = (edge: number) => isWide && Math.abs(start - edge) <= REACH;
  const pulls = isNear(left) ? "first" : isNear(right) ? "last" : null;
  const isInside = start >= left && start <= right;
  const span = view.last - view.first;
  // Beside the window the view jumps there, and goes on from its middle.
  const middle = start * perPixel;
  const from = isInside ? view : clampRange({ first: middle - span / 2, last: middle + span / 2 }, frames);
  return {
    move: (x, _, isFar) => {
      if (!isFar && isInside) return;
      const by = (x - start) * perPixel;
      if (pulls === null) range.value = panBy(from, by, frames);
      else range.value = clampRange({ ...view, [pulls]: view[pulls] + by }, frames);
    },
    end: () => undefined,
    cancel: () => (range.value = view),
  };
}

function dragView(start: number): Drag {
  const view = shownRange.peek();
  const perPixel = (view.last - view.first) / Math.max(1, size.peek().width);
  return {
    move: (x) => (range.value = panBy(view, (start - x) * perPixel, clock.frames)),
    end: () => undefined,
    cancel: () => (range.value = view),
  };
}

/** Set in and out; a click where the mouse stays. */
function dragMarks(start: number, click: (x: number) => void): Drag {
  const before = marked.peek();
  const from = Math.max(0, Math.min(clock.frames, Math.round(snap(start, [clock.frame.peek()]))));
  return {
    move: (x, _, isFar) => {
      if (!isFar) return;
      const to = Math.max(0, Math.min(clock.frames, Math.round(snap(x, [clock.frame.peek()]))));
      marked.value = { onset: Math.min(from, to), offset: Math.max(from, to) };
    },
    end: (x, _, isFar) => {
      if (!isFar) click(x);
      else if (marked.peek().onset === marked.peek().offset) marked.value = before;
    },
    cancel: () => (marked.value = before),
    scrolls: true,
  };
}

/** Move a boundary; the face shows the frame at it meanwhile. Nothing is changed before it is let go. */
function dragBoundary(id: string, edge: Edge, start: number): Drag {
  const playhead = clock.frame.peek();
  const segments = activeSegments.peek();
  const tier = activeTier.peek() ?? "";
  const view = shownRange.peek();
  const { width } = size.peek();
  const boundary = segments.find((one) => one.id === id)?.[edge] ?? 0;
  const grip = start - toPixels(boundary, view, width);
  const { onset, offset } = marked.peek();
  const catching = [playhead, onset, offset].filter((one) => one !== null);
  let last: Move | null = null;
  if (!selection.peek().includes(id)) pick(id);
  return {
    move: (x, event, isFar) => {
      if (!isFar) return;
      last = moveBoundary(tier, segments, id, edge, snap(x - grip, catching), clock.frames, !event.altKey);
      if (last === null) return;
      preview.value = { tier, segments: last.segments, frame: last.frame };
      clock.pause();
      clock.seek(edge === "onset" ? last.frame : last.frame - 1);
    },
    end: (_x, _event, isFar) => {
      if (!isFar || last === null || last.isSame) {
        preview.value = null;
        return;
      }
      // Shown until the server's answer takes its place, or until it was refused.
      const shown = preview.peek();
      void edit(last.operation).finally(() => {
        if (preview.peek() === shown) preview.value = null;
      });
    },
    cancel: () => {
      preview.value = null;
      clock.seek(playhead);
    },
    scrolls: true,
  };
}

/** The frame at x, or one nearby that is worth meeting exactly. */
function snap(x: number, frames: readonly number[]): number {
  const view = shownRange.peek();
  const { width } = size.peek();
  const near = frames.find((frame) => Math.abs(toPixels(frame, view, width) - x) <= REACH);
  return near ?? toFrames(x, view, width);
}
