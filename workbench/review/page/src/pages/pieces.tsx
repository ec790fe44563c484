/** Pieces of dialogs and pages: labels with their colour, strips of segments, lines that say what is wrong. */
import type { ComponentChildren } from "preact";
import type { Segment } from "../api/messages";
import { inkOn } from "../labels/colours";
import { coloursOf } from "../labels/shown";
import { Spinner, Swatch, paint } from "../shell/pieces";
import { say } from "../words";
import type { Loaded } from "./loading";

/** A label with its colour; "nothing" for a gap. */
export function LabelName(props: { label: string | null; tier?: string }) {
  if (props.label === null) return <span class="soft">{say("pages.gap")}</span>;
  return (
    <span class="pages-label">
      <Swatch colours={coloursOf(props.label, props.tier)} />
      <span class="elide">{props.label === "" ? say("pages.unnamed") : props.label}</span>
    </span>
  );
}

/** A line in a box: what is wrong is announced. */
export function Message(props: { tone: "info" | "warning" | "error"; children: ComponentChildren }) {
  return (
    <div class={`message message-${props.tone}`} role={props.tone === "error" ? "alert" : undefined}>
      <span aria-hidden="true">{props.tone === "info" ? "ℹ" : "⚠"}</span>
      <div class="grow">{props.children}</div>
    </div>
  );
}

/** What stands where something is fetched or could not be; else the children with the value. */
export function WhenLoaded<T>(props: { of: Loaded<T>; children: (value: T) => ComponentChildren }) {
  const { value, error, loading, reload } = props.of;
  return (
    <>
      {error !== null && (
        <Message tone="error">
          <div class="row spread">
            <span>{error}</span>
            <button type="button" class="button button-small" disabled={loading} onClick={() => void reload()}>
              {say("pages.again")}
            </button>
          </div>
        </Message>
      )}
      {value === null && error === null && <p class="empty"><Spinner /></p>}
      {value !== null && props.children(value)}
    </>
  );
}

interface StripProps {
  segments: Segment[];
  first: number;
  last: number;
  tier?: string | undefined;
  /** Said instead of the drawing. */
  name: string;
  /** Drawn lower and without labels. */
  small?: boolean;
}

/** Segments side by side between two frames; proposed ones are hatched. */
export function Strip(props: StripProps) {
  const span = Math.max(1, props.last - props.first);
  const percent = (frame: number): number => (100 * (frame - props.first)) / span;
  const said = props.segments.length === 0 ? say("pages.gap") : props.segments.map((one) => one.label).join(", ");
  return (
    <div
      class={`pages-strip${props.small ? " pages-strip-small" : ""}`}
      role="img"
      aria-label={`${props.name}: ${said}`}
    >
      {props.segments.length === 0 && !props.small && <span class="pages-strip-nothing">{say("pages.gap")}</span>}
      {props.segments
        .filter((one) => one.offset > props.first && one.onset < props.last)
        .map((one) => {
          const left = Math.max(0, percent(one.onset));
          const width = Math.min(100, percent(one.offset)) - left;
          const colours = coloursOf(one.label, props.tier ?? undefined);
          return (
            <div
              key={one.id}
              class={`pages-strip-segment${one.status === "proposed" ? " pages-strip-proposed" : ""}`}
              style={{
                left: `${left}%`, width: `${width}%`, "--label": paint(colours, "90deg"), color: inkOn(colours),
              }}
              title={one.label}
            >
              {!props.small && one.label}
            </div>
          );
        })}
    </div>
  );
}

interface TabsProps<T extends string> {
  name: string;
  of: readonly T[];
  chosen: T;
  title: (one: T) => string;
  onChoose: (one: T) => void;
}

/** Tabs: one of them chosen, arrows go to the next. */
export function Tabs<T extends string>(props: TabsProps<T>) {
  const step = (event: KeyboardEvent): void => {
    if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
    event.preventDefault();
    const next = props.of[props.of.indexOf(props.chosen) + (event.key === "ArrowRight" ? 1 : -1)];
    if (next === undefined) return;
    props.onChoose(next);
    const tabs = (event.currentTarget as HTMLElement).querySelectorAll<HTMLElement>("[role=tab]");
    tabs[props.of.indexOf(next)]?.focus();
  };
  return (
    <div class="tabs" role="tablist" aria-label={props.name} onKeyDown={step}>
      {props.of.map((one) => (
        <button
          key={one}
          type="button"
          role="tab"
          aria-selected={one === props.chosen}
          tabIndex={one === props.chosen ? 0 : -1}
          onClick={() => props.onChoose(one)}
        >
          {props.title(one)}
        </button>
      ))}
    </div>
  );
}
