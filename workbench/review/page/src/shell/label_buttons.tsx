/** The labels of the active tier as buttons: colour, name and key; a click labels as the key does. */
import { describeKeys, perform } from "../keyboard/bindings";
import { findCommand } from "../keyboard/commands";
import { edit } from "../state/actions";
import { activeTier, activeVocabulary, chosen, selection } from "../state/state";
import { say } from "../words";
import { Key, Swatch } from "./pieces";

export function LabelButtons() {
  const vocabulary = activeVocabulary.value;
  const labels = vocabulary?.labels.filter((one) => !one.retired) ?? [];
  if (labels.length === 0) return <p class="soft small">{say("segment.no-labels")}</p>;
  return (
    <div class="labels" role="group" aria-label={say("segment.labels")}>
      {labels.map((one) => {
        const keys = describeKeys(`label:${one.label}`) || one.key;
        return (
          <button
            type="button" key={one.label} class="button label"
            title={one.note === "" ? one.label : `${one.label}\n${one.note}`}
            aria-pressed={chosen.value?.label === one.label} data-label={one.label} onClick={() => setLabel(one.label)}
          >
            <Swatch colour={one.colour} />
            <span class="elide grow">{one.label}</span>
            <Key keys={keys} />
          </button>
        );
      })}
    </div>
  );
}

/** Do what the label's key does; where the keyboard knows no such command, relabel what is chosen. */
function setLabel(label: string): void {
  if (findCommand(`label:${label}`) !== undefined) {
    void perform(`label:${label}`);
    return;
  }
  const tier = activeTier.value;
  if (tier === null || selection.value.length === 0) return;
  void edit({ kind: "relabel", tier, segments: selection.value, label });
}
