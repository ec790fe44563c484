/** Which curves are shown: measures of the whole face, and weights of shapes. */
import { useSignal } from "@preact/signals";
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { saveSettings } from "../state/actions";
import { scene, shownCurves } from "../state/state";
import { say } from "../words";
import { nameCurve } from "./gutter";

/** Shapes that are offered at once; the others are found by their names. */
const MOST_OFFERED = 60;

/** Shapes whose names hold what was typed, those that move most first. */
export function findShapes(shapes: readonly string[], strongest: readonly string[], typed: string): string[] {
  const ordered = [...strongest, ...shapes.filter((shape) => !strongest.includes(shape))];
  const wanted = typed.trim().toLowerCase();
  return ordered.filter((shape) => shape.toLowerCase().includes(wanted)).slice(0, MOST_OFFERED);
}

/** The curves with one more or one less. */
export function toggleCurve(shown: readonly string[], curve: string): string[] {
  return shown.includes(curve) ? shown.filter((one) => one !== curve) : [...shown, curve];
}

export function CurveMenu() {
  const isOpen = useSignal(false);
  const typed = useSignal("");
  const element = useRef<HTMLDivElement>(null);
  const button = useRef<HTMLButtonElement>(null);
  const popover = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const close = (event: PointerEvent) => {
      if (!(event.target instanceof Node) || !element.current?.contains(event.target)) isOpen.value = false;
    };
    document.addEventListener("pointerdown", close);
    return () => document.removeEventListener("pointerdown", close);
  }, []);
  // Below the button or above it, wherever there is more room in the window.
  useLayoutEffect(() => {
    const [at, box] = [button.current?.getBoundingClientRect(), popover.current];
    if (!isOpen.value || at === undefined || box === null) return;
    const below = window.innerHeight - at.bottom;
    const isBelow = below >= at.top;
    box.style.left = `${at.left}px`;
    box.style.top = isBelow ? `${at.bottom + 2}px` : "auto";
    box.style.bottom = isBelow ? "auto" : `${window.innerHeight - at.top + 2}px`;
    box.style.maxHeight = `${Math.min(460, Math.max(below, at.top) - 12)}px`;
  }, [isOpen.value]);
  const current = scene.value;
  const shapes = findShapes(current?.shapes ?? [], current?.strongest ?? [], typed.value);

  return (
    <div
      ref={element}
      class="timeline-menu"
      onKeyDown={(event) => {
        if (event.key !== "Escape" || !isOpen.value) return;
        event.stopPropagation();
        isOpen.value = false;
        button.current?.focus();
      }}
    >
      <button
        ref={button}
        type="button"
        class="button button-small button-quiet"
        aria-expanded={isOpen.value}
        aria-haspopup="dialog"
        disabled={current === null}
        onClick={() => (isOpen.value = !isOpen.value)}
      >
        {say("timeline.curves")} <span aria-hidden="true">▾</span>
      </button>
      {isOpen.value && current !== null && (
        <div ref={popover} class="timeline-popover" role="dialog" aria-label={say("timeline.curves-shown")}>
          <fieldset>
            <legend>{say("timeline.curves-measures")}</legend>
            {current.curves.filter((one) => !one.name.startsWith("shape:")).map((one) => (
              <Choice key={one.name} curve={one.name} unit={one.unit} />
            ))}
          </fieldset>
          <fieldset>
            <legend>{say("timeline.curves-shapes")}</legend>
            <input
              class="input"
              type="search"
              aria-label={say("timeline.curves-find")}
              placeholder={say("timeline.curves-find")}
              value={typed.value}
              onInput={(event) => (typed.value = event.currentTarget.value)}
            />
            <div class="timeline-shapes">
              {shapes.map((shape) => <Choice key={shape} curve={`shape:${shape}`} unit="" />)}
              {shapes.length === 0 && <p class="empty">{say("timeline.curves-none")}</p>}
            </div>
          </fieldset>
        </div>
      )}
    </div>
  );
}

function Choice(props: { curve: string; unit: string }) {
  return (
    <label class="check">
      <input
        type="checkbox"
        checked={shownCurves.value.includes(props.curve)}
        onChange={() => void saveSettings({ curves: toggleCurve(shownCurves.value, props.curve) })}
      />
      <span>{nameCurve(props.curve)}</span>
      {props.unit !== "" && <span class="soft">{props.unit}</span>}
    </label>
  );
}
