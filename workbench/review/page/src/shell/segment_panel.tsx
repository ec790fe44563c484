/** The right column: the chosen segment, what can be done with it, the labels, and what the manual says. */
import { useEffect, useState } from "preact/hooks";
import type { Segment } from "../api/messages";
import { post } from "../api/client";
import { edit, refresh, tellError } from "../state/actions";
import {
  activeSegments, activeTier, activeVocabulary, chosen, clock, dialog, draft, marked, queue, scene, selection,
} from "../state/state";
import { language, say } from "../words";
import { formatFixed, formatNumber, formatTime } from "../words/numbers";
import { fitsBetween, nameLabel } from "../labels/labels";
import { coloursOf, labelOf } from "../labels/shown";
import { BoundaryField } from "./boundary_field";
import { CommandButton } from "./command_button";
import { CheckIcon } from "./icons";
import { LabelButtons } from "./label_buttons";
import { Confidence, StatusBadge, Swatch } from "./pieces";

export function SegmentPanel() {
  const segment = chosen.value;
  if (draft.value === null) return <aside class="column column-right" aria-label={say("app.segment")} />;
  return (
    <aside class="column column-right" data-region="" tabIndex={-1} aria-label={say("app.segment")}>
      <div class="column-head">
        <TierChoice />
        {segment !== null && <StatusBadge status={segment.status} />}
      </div>
      <div class="column-body stack">
        <BlindCard />
        {segment === null ? <NoSegment /> : <ChosenSegment segment={segment} />}
        <Marks />
        <div class="row spread">
          <h3 class="heading">{say("segment.labels")}</h3>
          {activeVocabulary.value?.transitions === true && (
            <CommandButton id="edit.transition" class="button-small">{say("action.transition")}</CommandButton>
          )}
        </div>
        <LabelButtons />
        {segment !== null && <Note label={segment.label} />}
        <Others />
      </div>
    </aside>
  );
}

function TierChoice() {
  const tiers = draft.value?.tiers ?? [];
  return (
    <label class="row grow">
      <span class="soft small">{say("segment.tier")}</span>
      <select class="select grow" aria-label={say("segment.tier")} value={activeTier.value ?? ""}
        disabled={tiers.length === 0}
        onChange={(event) => {
          activeTier.value = event.currentTarget.value;
          selection.value = [];
        }}>
        {tiers.map((one) => <option key={one.tier} value={one.tier}>{one.tier}</option>)}
      </select>
    </label>
  );
}

function NoSegment() {
  const { onset, offset } = marked.value;
  const rate = scene.value?.rate ?? 1;
  const words = (frame: number | null) => (frame === null ? "–" : formatTime(frame, rate));
  return (
    <div class="segment-none">
      <p>{say("segment.none")}</p>
      <p class="soft small">{say("segment.none-hint")}</p>
      {(onset !== null || offset !== null) && (
        <p class="number small">{say("segment.marked", { onset: words(onset), offset: words(offset) })}</p>
      )}
    </div>
  );
}

/** In, out, and a new segment between them. */
function Marks() {
  return (
    <div class="marks" role="group" aria-label={say("segment.marks")}>
      <CommandButton id="edit.set-in">{say("action.in")}</CommandButton>
      <CommandButton id="edit.set-out">{say("action.out")}</CommandButton>
      <CommandButton id="edit.add">{say("action.add")}</CommandButton>
    </div>
  );
}

function ChosenSegment({ segment }: { segment: Segment }) {
  const rate = scene.value?.rate ?? 1;
  const many = selection.value.length;
  const length = segment.offset - segment.onset;
  const loop = clock.loop.value;
  const meant = labelOf(segment.label);
  const name = meant?.label === segment.label ? nameLabel(meant, language.value) : "";
  return (
    <>
      <div class="segment-label">
        <Swatch colours={coloursOf(segment.label)} />
        <strong class="elide" title={segment.label} data-chosen={segment.id}>{segment.label}</strong>
        {name !== "" && <span class="soft elide segment-name">{name}</span>}
        <span class="grow" />
        <Confidence value={segment.confidence} />
      </div>
      {isUnfit(segment) && <p class="message message-warning small">{say("segment.unfit")}</p>}
      {many > 1 && <p class="message message-info">{say("segment.many", { count: many })}</p>}
      <p class="soft small number row spread">
        <span>
          {say("segment.duration", { seconds: formatFixed(length / rate, 3), frames: formatNumber(length) })}
        </span>
        <span>{say(`origin.${segment.origin}`)}</span>
      </p>
      <Second segment={segment} />
      <BoundaryField segment={segment} which="onset" />
      {segment.kind === "interval" && <BoundaryField segment={segment} which="offset" />}
      <div class="actions" role="group" aria-label={say("segment.actions")}>
        <div class="row actions-wide">
          <CommandButton id="edit.accept"
            class={`grow accept ${segment.status === "proposed" ? "button-primary" : ""}`}>
            {say("action.accept")}
          </CommandButton>
          <CommandButton id="edit.accept-stay" class="button-icon" showKey={false}><CheckIcon /></CommandButton>
        </div>
        <CommandButton id="edit.split">{say("action.split")}</CommandButton>
        <CommandButton id="edit.delete" class="button-danger">{say("action.delete")}</CommandButton>
        <CommandButton id="edit.merge-previous">{say("action.merge-previous")}</CommandButton>
        <CommandButton id="edit.merge-next">{say("action.merge-next")}</CommandButton>
        <CommandButton id="play.loop" pressed={loop !== null}>{say("action.loop")}</CommandButton>
        <CommandButton id="view.zoom-segment">{say("action.zoom")}</CommandButton>
        <CommandButton id="queue.previous">{say("action.previous")}</CommandButton>
        <CommandButton id="queue.next">{say("action.next")}</CommandButton>
      </div>
    </>
  );
}

/** Whether a segment is a transition that its neighbours contradict: one of them was relabelled. */
function isUnfit(segment: Segment): boolean {
  const segments = activeSegments.value;
  const at = segments.indexOf(segment);
  const [before, after] = [segments[at - 1], segments[at + 1]];
  const left = before?.offset === segment.onset ? before.label : "";
  const right = after?.onset === segment.offset ? after.label : "";
  return !fitsBetween(activeVocabulary.value, segment.label, left, right);
}

/** The model's likeliest other label, one click away. */
function Second({ segment }: { segment: Segment }) {
  const item = queue.value?.items.find((one) => one.id === segment.id && one.take === scene.value?.take);
  const tier = activeTier.value;
  if (item === undefined || item.second === "" || segment.status !== "proposed" || tier === null) return null;
  return (
    <button type="button" class="button button-small second" title={say("segment.second-hint")}
      onClick={() => void edit({ kind: "relabel", tier, segments: [segment.id], label: item.second })}>
      <Swatch colours={coloursOf(item.second)} />
      <span class="elide">{say("segment.second", { label: item.second })}</span>
    </button>
  );
}

function Note({ label }: { label: string }) {
  const note = labelOf(label)?.note ?? "";
  if (note === "") return null;
  return (
    <div class="note">
      <h3 class="heading">{say("segment.note", { label })}</h3>
      <p class="note-text">{note}</p>
      <button type="button" class="button button-small button-quiet" onClick={() => (dialog.value = "manual")}>
        {say("segment.manual")}
      </button>
    </div>
  );
}

function BlindCard() {
  const now = draft.value;
  const [isBusy, setBusy] = useState(false);
  useEffect(() => setBusy(false), [now?.take]);
  if (now === null || now.mode !== "blind" || now.purpose !== "own") return null;
  const setDone = async (done: boolean) => {
    setBusy(true);
    try {
      await post<unknown>("/api/coding/done", { take: now.take, done });
      await Promise.all([refresh("draft"), refresh("corpus")]);
    } catch (error) {
      tellError(error);
    } finally {
      setBusy(false);
    }
  };
  return (
    <div class="card">
      <h3>{say("blind.title")}</h3>
      <p class="small">{say(now.done ? "blind.is-done" : "blind.text")}</p>
      <button type="button" class={`button button-wide ${now.done ? "" : "button-primary"}`} disabled={isBusy}
        onClick={() => void setDone(!now.done)}>
        {say(now.done ? "blind.again" : "blind.done")}
      </button>
    </div>
  );
}

/** Tiers of others that stand for the active one, to take over as one's own. */
function Others() {
  const tier = activeTier.value;
  const others = draft.value?.others.filter((one) => one.tier === tier) ?? [];
  if (tier === null || others.length === 0 || draft.value?.purpose !== "own") return null;
  return (
    <details class="others">
      <summary class="heading">{say("segment.others")} ({others.length})</summary>
      {others.map((one) => (
        <div class="row others-row" key={one.author}>
          <span class="grow stack">
            <span class="elide" title={one.author}>{one.author}</span>
            <span class="soft small">
              {say(one.made_by === "person" ? "origin.human" : `origin.${one.made_by}`)} · {one.segments.length}
            </span>
          </span>
          <button type="button" class="button button-small"
            title={say("segment.take-over-hint", { tier, author: one.author })}
            onClick={() => void edit({ kind: "take-over", tier, author: one.author })}>
            {say("segment.take-over")}
          </button>
        </div>
      ))}
    </details>
  );
}
