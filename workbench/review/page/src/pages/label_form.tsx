/** A label as it is being changed or added: name, colour, key, meaning, and what speaks against them. */
import { useState } from "preact/hooks";
import type { SchemeLabel, Vocabulary } from "../api/messages";
import { listCommands } from "../keyboard/commands";
import { say } from "../words";
import { sayCount } from "../words/numbers";
import { inkOn, isHex } from "../labels/colours";
import { findConfusions } from "./colours";
import { LONGEST_NAME, checkName, findKeyClashes, namesOf } from "./scheme_rules";

export interface LabelValues {
  name: string;
  colour: string;
  key: string;
  note: string;
}

interface LabelFormProps {
  vocabulary: Vocabulary;
  /** As it is, or as a new one is proposed: then its name is empty. */
  label: SchemeLabel;
  busy: boolean;
  onSave: (values: LabelValues) => void;
  onCancel: () => void;
}

export function LabelForm({ vocabulary, label, busy, onSave, onCancel }: LabelFormProps) {
  const isNew = label.label === "";
  const [name, setName] = useState(label.label);
  const [colour, setColour] = useState(isHex(label.colour) ? label.colour : "#777777");
  const [key, setKey] = useState(label.key);
  const [note, setNote] = useState(label.note);

  const others = vocabulary.labels.filter((one) => one.label !== label.label);
  const own = [label.label, ...label.aliases];
  const taken = namesOf(vocabulary).filter((one) => !own.includes(one));
  const problem = checkName(name, taken);
  const changed = { ...label, key, label: name, retired: false };
  const clash = key === "" ? undefined : findKeyClashes([...others, changed]).get(key);
  const isKey = (each: string): boolean => key !== "" && each.toLowerCase() === key.toLowerCase();
  const command = listCommands().find((one) => one.group !== "label" && one.keys.some(isKey));
  const confused = findConfusions([...others.filter((one) => !one.retired), { label: name || "?", colour }]).filter(
    (one) => one.first === (name || "?") || one.second === (name || "?"),
  )[0];
  const same = name === label.label && colour === label.colour && key === label.key && note === label.note;
  const ready = problem === null && !busy && !same;
  const save = (): void => {
    if (ready) onSave({ name, colour: colour.toLowerCase(), key, note: note.trim() });
  };

  return (
    <form class="pages-label-form" onSubmit={(event) => { event.preventDefault(); save(); }}>
      <div class="row pages-label-line">
        <label class="field pages-label-name">
          <span>{say("scheme.name")}</span>
          <input
            class="input"
            value={name}
            maxLength={LONGEST_NAME}
            autofocus
            aria-invalid={problem !== null && name !== ""}
            onInput={(event) => setName(event.currentTarget.value)}
          />
        </label>
        <label class="field">
          <span>{say("scheme.colour")}</span>
          <input type="color" class="input" value={colour} onInput={(event) => setColour(event.currentTarget.value)} />
        </label>
        <label class="field">
          <span>{say("scheme.key")}</span>
          <input
            class="input pages-key-input"
            value={key}
            maxLength={1}
            onInput={(event) => setKey(event.currentTarget.value.trim())}
          />
        </label>
        <label class="field grow">
          <span>{say("scheme.note")}</span>
          <textarea
            class="input"
            rows={2}
            maxLength={2000}
            value={note}
            onInput={(event) => setNote(event.currentTarget.value)}
          />
        </label>
      </div>
      <div class="row spread row-wrap">
        <span class="grow small" aria-live="polite">
          <span class="pages-preview" style={{ backgroundColor: colour, color: inkOn([colour]) }}>
            {name || "…"}
          </span>{" "}
          {problem !== null && name !== "" && <span class="pages-problem">{say(`scheme.problem.${problem}`)} </span>}
          {clash !== undefined && (
            <span class="pages-problem">{say("scheme.clash", { key, labels: clash.join(", ") })} </span>
          )}
          {command !== undefined && <span class="pages-problem">{say("scheme.clash.command", { key })} </span>}
          {confused !== undefined && (
            <span class="pages-problem">
              {say("scheme.close_to", {
                label: confused.first === (name || "?") ? confused.second : confused.first,
              })}{" "}
              {say(`scheme.confused.${confused.vision}`)}
            </span>
          )}
          {!isNew && name !== label.label && problem === null && label.segments > 0 && (
            <span>{sayCount("scheme.rename.count", label.segments, { name })}</span>
          )}
        </span>
        <button type="button" class="button button-small" onClick={onCancel}>{say("pages.cancel")}</button>
        <button type="submit" class="button button-small button-primary" disabled={!ready}>
          {isNew ? say("scheme.add") : say("pages.save")}
        </button>
      </div>
    </form>
  );
}
