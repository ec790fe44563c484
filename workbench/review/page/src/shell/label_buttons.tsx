/** The labels of the active tier as buttons: colour, name and key; a click labels as the key does. */
import { describeKeys, perform } from "../keyboard/bindings";
import { findCommand } from "../keyboard/commands";
import { edit } from "../state/actions";
import { activeTier, activeVocabulary, chosen, selection } from "../state/state";
import { language, say } from "../words";
import { nameLabel } from "../labels/labels";
import { labelOf } from "../labels/shown";
import { Key, Swatch } from "./pieces";

export function LabelButtons() {
  const vocabulary = activeVocabulary.value;
  const labels = vocabulary?.labels.filter((one) => !one.retired) ?? [];
  if (labels.length === 0) return <p class="soft small">{say("segment.no-labels")}</p>;
  const names = labels.map((one) => nameLabel(one, language.value));
  const current = chosen.value === null ? null : labelOf(chosen.value.label)?.label;
  return (
    <div class={names.some((one) => one !== "") ? "labels labels-named" : "labels"} role="group"
      aria-label={say("segment.labels")}>
      {labels.map((one, index) => {
        const keys = describeKeys(`label:${one.label}`) || one.key;
        return (
          <button
            type="button" key={one.label} class="button label"
            title={[[one.label, names[index]].filter(Boolean).join(" · "), one.note].filter(Boolean).join("\n")}
            aria-pressed={current === one.label} data-label={one.label} onClick={() => setLabel(one.label)}
          >
            <Swatch colours={[one.colour]} />
            <span class="label-code">{one.label}</span>
            <span class="elide grow soft">{names[index]}</span>
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
