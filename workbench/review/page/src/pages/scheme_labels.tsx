/** The labels of a vocabulary: a row each, one of them open to be changed; a row to add one. */
import { useState } from "preact/hooks";
import type { SchemeLabel, Vocabulary } from "../api/messages";
import { Key, Swatch } from "../shell/pieces";
import { session } from "../state/state";
import { say } from "../words";
import { formatNumber, sayCount } from "../words/numbers";
import { findConfusions } from "./colours";
import { LabelForm } from "./label_form";
import { LabelName, Message } from "./pieces";
import type { SchemeViewProps } from "./scheme_dialog";
import { findFreeColour, findFreeKey, findKeyClashes, moveLabel } from "./scheme_rules";

type Open = { label: string; doing: "edit" | "merge" | "retire" } | { label: null; doing: "add" };

export function SchemeLabels({ vocabulary, change, mayChange }: SchemeViewProps) {
  const [open, setOpen] = useState<Open | null>(null);
  const isLead = session.value?.is_lead === true;
  const used = vocabulary.labels.filter((one) => !one.retired);
  const retired = vocabulary.labels.filter((one) => one.retired);
  const clashes = findKeyClashes(vocabulary.labels);
  const confusions = findConfusions(used);
  const done = (kept: boolean): void => {
    if (kept) setOpen(null);
  };

  const row = (one: SchemeLabel, index: number, all: SchemeLabel[]) => {
    const is = open !== null && open.label === one.label;
    const which = { vocabulary: vocabulary.name, label: one.label };
    const move = (by: 1 | -1) => {
      void change({ kind: "order", vocabulary: vocabulary.name, labels: moveLabel(vocabulary.labels, one.label, by) });
    };
    return [
      <tr key={one.label} aria-selected={is} class={one.retired ? "pages-retired" : ""}>
        {isLead && (
          <td class="pages-order">
            {!one.retired && (
              <>
                <button
                  type="button"
                  class="button button-quiet button-small button-icon"
                  disabled={!mayChange || index === 0}
                  aria-label={say("scheme.up", { label: one.label })}
                  title={say("scheme.up", { label: one.label })}
                  onClick={() => move(-1)}
                >
                  ↑
                </button>
                <button
                  type="button"
                  class="button button-quiet button-small button-icon"
                  disabled={!mayChange || index === all.length - 1}
                  aria-label={say("scheme.down", { label: one.label })}
                  title={say("scheme.down", { label: one.label })}
                  onClick={() => move(1)}
                >
                  ↓
                </button>
              </>
            )}
          </td>
        )}
        <td>
          <span class="row">
            <Swatch colours={[one.colour]} /> <strong class="elide">{one.label}</strong>
            {one.retired && <span class="badge">{say("scheme.retired")}</span>}
          </span>
        </td>
        <td>
          {clashes.has(one.key)
            ? <span class="pages-clash"><Key keys={one.key} /> ⚠</span>
            : <Key keys={one.retired ? "" : one.key} />}
        </td>
        <td class="pages-note">
          {one.note === "" ? <span class="soft">{say("manual.no_note")}</span> : one.note}
          {one.aliases.length > 0 && (
            <span class="soft small"> {say("scheme.also", { names: one.aliases.join(", ") })}</span>
          )}
        </td>
        <td class="number">{formatNumber(one.segments)}</td>
        {isLead && (
          <td class="pages-actions">
            {one.retired ? (
              <button
                type="button"
                class="button button-small"
                disabled={!mayChange}
                onClick={() => void change({ kind: "restore", vocabulary: vocabulary.name, label: one.label })}
              >
                {say("scheme.restore")}
              </button>
            ) : (
              <>
                {(["edit", "merge", "retire"] as const).map((doing) => (
                  <button
                    key={doing}
                    type="button"
                    class="button button-small"
                    disabled={!mayChange || (doing === "merge" && used.length < 2)}
                    aria-expanded={is && open.doing === doing}
                    aria-label={`${say(`scheme.${doing}`)}: ${one.label}`}
                    onClick={() => setOpen(is && open.doing === doing ? null : { label: one.label, doing })}
                  >
                    {say(`scheme.${doing}`)}
                  </button>
                ))}
              </>
            )}
          </td>
        )}
      </tr>,
      is && (
        <tr key={`${one.label} open`} class="pages-open">
          <td colSpan={6}>
            {open.doing === "edit" && (
              <LabelForm vocabulary={vocabulary} label={one} busy={!mayChange} onCancel={() => setOpen(null)}
                onSave={(to) => {
                  const { name, colour, key, note } = to;
                  const described = colour !== one.colour || key !== one.key || note !== one.note;
                  void change(
                    ...(described ? [{ kind: "describe" as const, ...which, colour, key, note }] : []),
                    ...(name !== one.label ? [{ kind: "rename" as const, ...which, to: name }] : []),
                  ).then(done);
                }} />
            )}
            {open.doing === "merge" && (
              <Merge
                of={one}
                vocabulary={vocabulary}
                mayChange={mayChange}
                onCancel={() => setOpen(null)}
                onMerge={(into) => {
                  void change({ kind: "merge", vocabulary: vocabulary.name, labels: [one.label], into }).then(done);
                }}
              />
            )}
            {open.doing === "retire" && (
              <Ask
                text={one.segments > 0
                  ? sayCount("scheme.retire.used", one.segments, { label: one.label })
                  : say("scheme.retire.unused", { label: one.label })}
                action={say("scheme.retire")}
                mayChange={mayChange}
                onCancel={() => setOpen(null)}
                onDo={() => void change({ kind: "retire", vocabulary: vocabulary.name, label: one.label }).then(done)}
              />
            )}
          </td>
        </tr>
      ),
    ];
  };

  return (
    <div class="stack">
      {[...clashes].map(([key, labels]) => (
        <Message key={key} tone="warning">{say("scheme.clash", { key, labels: labels.join(", ") })}</Message>
      ))}
      {confusions.slice(0, 3).map((one) => (
        <Message key={`${one.first} ${one.second}`} tone="warning">
          <span class="row row-wrap">
            <LabelName
              label={one.first}
              tier={vocabulary.tiers[0] ?? ""}
            /> <LabelName label={one.second} tier={vocabulary.tiers[0] ?? ""} />
            {say(`scheme.confused.${one.vision}`)}
          </span>
        </Message>
      ))}
      <div class="table-scroll">
        <table class="table">
          <thead>
            <tr>
              {isLead && <th scope="col"><span class="visually-hidden">{say("scheme.order")}</span></th>}
              <th scope="col">{say("scheme.label")}</th>
              <th scope="col">{say("scheme.key")}</th>
              <th scope="col">{say("scheme.note")}</th>
              <th scope="col" class="number">{say("scheme.segments")}</th>
              {isLead && <th scope="col"><span class="visually-hidden">{say("scheme.actions")}</span></th>}
            </tr>
          </thead>
          <tbody>
            {used.map(row)}
            {retired.map(row)}
          </tbody>
        </table>
        {vocabulary.labels.length === 0 && <p class="empty">{say("scheme.no_labels")}</p>}
      </div>
      {isLead && open?.doing === "add" ? (
        <div class="pages-card">
          <LabelForm
            vocabulary={vocabulary}
            busy={!mayChange}
            onCancel={() => setOpen(null)}
            label={{
              label: "", colour: findFreeColour(vocabulary.labels), key: findFreeKey(vocabulary.labels), note: "",
              aliases: [], retired: false, segments: 0,
            }}
            onSave={({ name: label, ...more }) => {
              void change({ kind: "add", vocabulary: vocabulary.name, label, ...more }).then(done);
            }}
          />
        </div>
      ) : (
        isLead && (
          <div>
            <button
              type="button"
              class="button"
              disabled={!mayChange}
              onClick={() => setOpen({ label: null, doing: "add" })}
            >
              + {say("scheme.add")}
            </button>
          </div>
        )
      )}
      {vocabulary.transitions && <p class="soft small">{say("manual.transitions")}</p>}
    </div>
  );
}

/** What is asked before a change that touches segments. */
function Ask(props: { text: string; action: string; mayChange: boolean; onDo: () => void; onCancel: () => void }) {
  return (
    <div class="row spread row-wrap">
      <span class="grow">{props.text}</span>
      <button type="button" class="button button-small" onClick={props.onCancel}>{say("pages.cancel")}</button>
      <button
        type="button"
        class="button button-small button-danger"
        disabled={!props.mayChange}
        onClick={props.onDo}
      >
        {props.action}
      </button>
    </div>
  );
}

interface MergeProps {
  of: SchemeLabel;
  vocabulary: Vocabulary;
  mayChange: boolean;
  onMerge: (into: string) => void;
  onCancel: () => void;
}

function Merge(props: MergeProps) {
  const others = props.vocabulary.labels.filter((one) => !one.retired && one.label !== props.of.label);
  const [into, setInto] = useState(others[0]?.label ?? "");
  return (
    <div class="row row-wrap">
      <label class="row">
        <span>{say("scheme.merge.into", { label: props.of.label })}</span>
        <select class="select" value={into} onChange={(event) => setInto(event.currentTarget.value)}>
          {others.map((one) => <option key={one.label} value={one.label}>{one.label}</option>)}
        </select>
      </label>
      <span class="soft grow">{sayCount("scheme.merge.count", props.of.segments, { into })}</span>
      <button type="button" class="button button-small" onClick={props.onCancel}>{say("pages.cancel")}</button>
      <button
        type="button"
        class="button button-small button-danger"
        disabled={!props.mayChange || into === ""}
        onClick={() => props.onMerge(into)}
      >
        {say("scheme.merge.do")}
      </button>
    </div>
  );
}
