/** Small pieces that several views show: keys, colours of labels, confidence, status, commands to copy. */
import type { Status } from "../api/messages";
import { say } from "../words";

/** A key cap, or nothing where there is no key. */
export function Key(props: { keys: string }) {
  return props.keys === "" ? null : <kbd class="key">{props.keys}</kbd>;
}

/** A label's colour (two of a transition); the label itself stands beside it, so a reader of the screen is not told. */
export function Swatch(props: { colours: readonly string[] }) {
  return <span class="swatch" style={{ background: paint(props.colours, "135deg") }} aria-hidden="true" />;
}

/** One colour, or two of a transition beside each other. */
export function paint(colours: readonly string[], direction: string): string {
  const [from = "transparent", to = from] = colours;
  return `linear-gradient(${direction}, ${from} 50%, ${to} 50%)`;
}

/** How sure somebody was, as a bar and in percent; "–" where nobody said. */
export function Confidence(props: { value: number | null }) {
  if (props.value === null) {
    const unknown = say("confidence.unknown");
    return <span class="soft number" role="img" aria-label={unknown} title={unknown}>–</span>;
  }
  const percent = Math.round(props.value * 100);
  return (
    <span class="row confidence" title={say("confidence.is", { percent })}>
      <span class="meter" aria-hidden="true"><span style={{ width: `${percent}%` }} /></span>
      <span class="number small">{percent} %</span>
    </span>
  );
}

/** Proposed, reviewed or adjudicated: by a word, a sign and a frame, not by colour alone. */
export function StatusBadge(props: { status: Status }) {
  const sign = props.status === "proposed" ? "" : props.status === "reviewed" ? "✓ " : "✓✓ ";
  return <span class={`badge badge-${props.status}`}>{sign}{say(`status.${props.status}`)}</span>;
}

/** A command of the command line, to select and copy. */
export function Command(props: { text: string | null | undefined }) {
  return props.text ? <code class="command">{props.text}</code> : null;
}

/** Something is being fetched. */
export function Spinner() {
  return <span class="spinner" role="status" aria-label={say("loading")} />;
}
