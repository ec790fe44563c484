/**
 * Draws the timeline: one canvas for what changes when something is done, one above it for what follows the playhead.
 *
 * Signals decide what is drawn again; however many of them change, each canvas is drawn once before the next picture.
 */
import { computed, effect, signal } from "@preact/signals";
import { theme as themeName } from "../shell/theme";
import { activeTier, clock, draft, marked, range, scene, scheme, selection } from "../state/state";
import { language, say } from "../words";
import { curveKey, loadedCurves, offeredCurves, type Curve } from "./curves";
import { drawCurve } from "./draw_curves";
import { Overview } from "./draw_overview";
import { drawOver } from "./draw_over";
import { drawLoop, drawMarks, drawStretches, drawTimes } from "./draw_ruler";
import { drawTier, type TierLook } from "./draw_tiers";
import { LabelPalette } from "./label_colours";
import { layOut, OVERVIEW_HEIGHT, RULER_HEIGHT, type Layout } from "./layout";
import { held, hover, preview } from "./preview";
import { readTheme, type Theme } from "./theme";
import { clampRange } from "./view";

/** Of both canvases, in CSS pixels. */
export const size = signal({ width: 0, height: 0 });
/** How far the rows are scrolled. */
export const scroll = signal(0);

export const layout = computed<Layout>(() =>
  layOut(draft.value, activeTier.value, offeredCurves.value, size.value.height, scroll.value),
);

/** The range, always within the take. */
export const shownRange = computed(() => clampRange(range.value, scene.value?.frames ?? 1));

/** A curve of the open take; null while it is on its way. */
export function findCurve(name: string): Curve | null {
  const current = scene.value;
  const found = current === null ? undefined : loadedCurves.value.get(curveKey(current.take, current.solve, name));
  return typeof found === "object" ? found : null;
}

export class Painter {
  /** ms that drawing took, the newest last; for measuring. */
  readonly times: number[] = [];
  readonly #overview = new Overview();
  readonly #stop: (() => void)[] = [];
  #theme: Theme;
  #palette: LabelPalette;
  #request = 0;
  #isBaseOld = true;

  constructor(
    private readonly base: HTMLCanvasElement,
    private readonly over: HTMLCanvasElement,
  ) {
    this.#theme = readTheme(base);
    this.#palette = new LabelPalette(scheme.peek(), this.#theme);
    this.#stop.push(
      effect(() => {
        void themeName.value;
        // The attribute that the variables hang on is set by an effect of its own, maybe after this one.
        queueMicrotask(() => {
          this.#theme = readTheme(this.base);
          this.#palette = new LabelPalette(scheme.peek(), this.#theme);
          this.#ask(true);
        });
      }),
      effect(() => {
        if (scheme.value !== this.#palette.scheme) this.#palette = new LabelPalette(scheme.value, this.#theme);
        this.#ask(true);
      }),
      effect(() => {
        void [
          shownRange.value, layout.value, selection.value, marked.value, preview.value, scene.value, language.value,
        ];
        void [loadedCurves.value, clock.loop.value, size.value];
        this.#ask(true);
      }),
      effect(() => {
        void [clock.frame.value, hover.value, held.value];
        this.#ask(false);
      }),
    );
  }

  stop(): void {
    for (const stop of this.#stop) stop();
    cancelAnimationFrame(this.#request);
  }

  /** Draw everything anew. */
  refresh(): void {
    this.#ask(true);
  }

  /** Draw at once what is old. */
  draw(): void {
    cancelAnimationFrame(this.#request);
    this.#request = 0;
    const start = performance.now();
    if (this.#isBaseOld) this.#drawBase();
    this.#isBaseOld = false;
    this.#drawOver();
    this.times.push(performance.now() - start);
    if (this.times.length > 600) this.times.splice(0, 300);
  }

  #ask(base: boolean): void {
    if (base) this.#isBaseOld = true;
    if (this.#request === 0) this.#request = requestAnimationFrame(() => this.draw());
  }

  #drawBase(): void {
    const { width, height } = size.peek();
    const context = begin(this.base, width, height);
    const current = scene.peek();
    if (context === null || current === null) return;
    const theme = this.#theme;
    const view = shownRange.peek();
    const placed = layout.peek();
    const { rate, frames } = current;

    for (const row of [...placed.curves, ...placed.tiers]) {
      context.fillStyle = theme.surface;
      context.fillRect(0, row.top, width, row.height);
    }
    drawTimes(context, OVERVIEW_HEIGHT, RULER_HEIGHT, height, view, width, rate, theme);

    context.save();
    context.beginPath();
    context.rect(0, placed.rowsTop, width, height - placed.rowsTop);
    context.clip();
    placed.curves.forEach((row, index) => {
      const curve = findCurve(row.curve);
      if (curve === null) return;
      const colour = theme.curves[index % theme.curves.length]!;
      const threshold = row.curve === "residual" ? current.residual.threshold : null;
      drawCurve(context, row, curve, view, width, colour, theme, threshold);
    });
    const look: TierLook = {
      range: view, width, theme, palette: this.#palette, selected: new Set(selection.peek()), rate,
    };
    const moving = preview.peek();
    for (const row of placed.tiers) {
      if (row.top > height || row.top + row.height < placed.rowsTop) continue;
      drawTier(context, row, row.author === null && moving?.tier === row.tier ? moving.segments : row.segments, look);
    }
    context.restore();

    drawStretches(context, current.residual.stretches, placed.rowsTop - 4, 4, view, width, theme.warning);
    const loop = clock.loop.peek();
    if (loop !== null) drawLoop(context, loop, OVERVIEW_HEIGHT, height, view, width, theme);
    const flags = { onset: say("timeline.in"), offset: say("timeline.out") };
    drawMarks(context, marked.peek(), OVERVIEW_HEIGHT, height, view, width, theme, flags);

    const active = placed.tiers.find((row) => row.isActive);
    const content = {
      segments: active?.segments ?? [], tier: active?.tier ?? "", frames, curve: findCurve("level"),
      stretches: current.residual.stretches,
    };
    this.#overview.draw(context, content, view, width, this.#palette, theme, scaleOf(this.base, width));
  }

  #drawOver(): void {
    const { width, height } = size.peek();
    const context = begin(this.over, width, height);
    const current = scene.peek();
    if (context === null || current === null) return;
    drawOver(context, {
      width, height, range: shownRange.peek(), layout: layout.peek(), theme: this.#theme, palette: this.#palette,
      frame: clock.frame.peek(), frames: current.frames, rate: current.rate, hover: hover.peek(), held: held.peek(),
      moving: preview.peek()?.frame ?? null,
    });
  }
}

/** Clear a canvas, as large as it is shown, in the screen's own pixels. */
function begin(canvas: HTMLCanvasElement, width: number, height: number): CanvasRenderingContext2D | null {
  const scale = globalThis.devicePixelRatio || 1;
  const [across, down] = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== across || canvas.height !== down) {
    canvas.width = across;
    canvas.height = down;
  }
  const context = canvas.getContext("2d");
  context?.setTransform(scale, 0, 0, scale, 0, 0);
  context?.clearRect(0, 0, width, height);
  return context;
}

function scaleOf(canvas: HTMLCanvasElement, width: number): number {
  return width > 0 ? canvas.width / width : 1;
}
