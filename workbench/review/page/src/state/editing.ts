/** Edits, undo and redo: sent through the outbox, shown once the server has them on disk. */
import { batch } from "@preact/signals";
import { ApiError, fetchSession, get, post } from "../api/client";
import type { Draft, EditAnswer, Operation } from "../api/messages";
import { findVocabulary, splitTransition } from "../labels/labels";
import { say, type WordKey } from "../words";
import { applyAnswer, areSame, concernedSegments, followSelection, knowsTiers } from "./drafts";
import { describeError, tell } from "./notices";
import { makeRequestId, Outbox, type Entry, type Step } from "./outbox";
import { updateQueue } from "./queue";
import { countUnpublished, fetchAgain, refreshLater, showDraft } from "./refreshing";
import {
  activeSegments, activeTier, arriving, clock, draft, marked, notice, purpose, queue, saving, scene, scheme, selection,
  session,
} from "./state";
import { tellTabs } from "./tabs";

/** Milliseconds after which an edit counts as not answered; it stays and goes out again. */
const PATIENCE = 8000;

/** A storage that the browser forbids raises when it is looked at. */
function findStorage(): Storage | null {
  try {
    return typeof localStorage === "undefined" ? null : localStorage;
  } catch {
    return null;
  }
}

const outbox = new Outbox({ send, renew, onAnswer, onRefused, onState, storage: findStorage() });

/** Send an edit; resolves to true once it is on disk and shown, false where it was refused (the notice says why). */
export async function edit(operation: Operation): Promise<boolean> {
  return push(operation);
}

export async function undo(): Promise<boolean> {
  if (outbox.size === 0 && draft.value?.undo === null) return false;
  return push("undo");
}

export async function redo(): Promise<boolean> {
  if (outbox.size === 0 && draft.value?.redo === null) return false;
  return push("redo");
}

/** How many edits are not known to be on disk. */
export function countUnsaved(): number {
  return outbox.size;
}

/** Send again now what the server did not answer. */
export function sendAgain(): void {
  outbox.poke();
}

/** Give up the edits that the server did not answer. Whether it has them after all, the draft says. */
export async function discardUnsaved(): Promise<void> {
  outbox.discard();
  try {
    await fetchAgain("draft");
  } catch (error) {
    tell(describeError(error), "error");
  }
}

/** Find the edits that an earlier page of this person left, and send them. */
export function openOutbox(of: string, person: string): void {
  outbox.open(of, person);
}

/** What a step is called. */
export function describeStep(step: Step | string): string {
  const kind = typeof step === "string" ? step : step.kind;
  const key = `operation.${kind}`;
  return isStepKey(key) ? say(key) : kind;
}

const STEP_KEYS = [
  "operation.accept", "operation.relabel", "operation.move", "operation.split", "operation.merge", "operation.add",
  "operation.delete", "operation.settle", "operation.take-over", "operation.import", "operation.merge-in",
  "operation.rename", "operation.undo", "operation.redo",
] as const satisfies readonly WordKey[];

function isStepKey(key: string): key is (typeof STEP_KEYS)[number] {
  return (STEP_KEYS as readonly string[]).includes(key);
}

/** Whether another take is on its way, which is said: what is asked for now may be meant for that one. */
export function refuseWhileArriving(): boolean {
  const take = arriving.value;
  if (take !== null) tell(say("edit.arriving", { take }), "warning");
  return take !== null;
}

async function push(operation: Step): Promise<boolean> {
  const shown = draft.value;
  if (shown === null || refuseWhileArriving()) return false;
  if (shown.gone !== null) {
    tell(say("draft.gone"), "warning");
    return false;
  }
  if (outbox.isStuck) {
    tell(say("unsaved.wait"), "warning");
    return false;
  }
  const seen = typeof operation === "string" ? [] : concernedSegments(shown, operation);
  return outbox.push({
    request: makeRequestId(), take: shown.take, purpose: shown.purpose, version: shown.version, operation, seen,
  });
}

async function send(entry: Entry): Promise<EditAnswer> {
  const { take, purpose: of, request, version, operation } = entry;
  const path = typeof operation === "string" ? `/api/draft/${operation}` : "/api/draft/edit";
  const body = { take, purpose: of, request, version, ...(typeof operation === "string" ? {} : { operation }) };
  try {
    return await post<EditAnswer>(path, body, { timeout: PATIENCE });
  } catch (error) {
    if (!(error instanceof ApiError) || error.kind !== "csrf") throw error;
    // Another tab logged in anew: this one's token is old, the session is not. Another person's is refused there.
    session.value = await fetchSession();
    return post<EditAnswer>(path, body, { timeout: PATIENCE });
  }
}

/** Another tab or an earlier page was faster: look whether the edit still means what it meant. */
async function renew(entry: Entry): Promise<number | null> {
  const now = await get<Draft>("/api/draft", { take: entry.take, purpose: entry.purpose });
  showDraft(now, entry.take);
  if (typeof entry.operation === "string") return null;
  return areSame(entry.seen, concernedSegments(now, entry.operation)) ? now.version : null;
}

function onAnswer(entry: Entry, answer: EditAnswer): void {
  const shown = draft.value;
  // What was said of an earlier attempt is over.
  if (notice.value !== null && notice.value.tone !== "error") notice.value = null;
  batch(() => {
    if (shown !== null && shown.take === entry.take && shown.purpose === entry.purpose) show(shown, entry, answer);
    if (entry.purpose === "own") {
      if (queue.value !== null) queue.value = updateQueue(queue.value, entry.take, answer.changes, isTransition);
      countUnpublished({ take: entry.take, purpose: entry.purpose, unpublished: answer.unpublished });
    }
  });
  tellTabs({ kind: "draft", take: entry.take, purpose: entry.purpose, version: answer.version });
  refreshLater("queue", 4000);
  refreshLater("pace", 1500);
  refreshLater("corpus", 6000);
}

function isTransition(tier: string, label: string): boolean {
  return splitTransition(findVocabulary(scheme.value, tier), label) !== null;
}

function show(shown: Draft, entry: Entry, answer: EditAnswer): void {
  const step = typeof entry.operation === "string" ? entry.operation : entry.operation.kind;
  if (answer.version > shown.version && !knowsTiers(shown, answer)) {
    refreshLater("draft", 0);
    return;
  }
  if ((step === "undo" || step === "redo") && answer.version > shown.version) {
    // Undo may concern another tier than the active one; go where it happened.
    const where = answer.changes[0]?.tier;
    if (where !== undefined && !answer.changes.some((one) => one.tier === activeTier.value)) {
      activeTier.value = where;
      selection.value = [];
    }
  }
  const before = activeSegments.value;
  draft.value = applyAnswer(shown, answer);
  if (draft.value === shown) return;
  selection.value = followSelection(selection.value, before, activeSegments.value, step);
  if (step === "add") marked.value = { onset: null, offset: null };
  followLoop();
}

/** Keep a loop within what it loops: a boundary that moved moves it along. */
function followLoop(): void {
  const loop = clock.loop.value;
  if (loop === null) return;
  const here = activeSegments.value.find((one) => one.id === selection.value[0]);
  if (here === undefined || (here.onset === loop.onset && here.offset === loop.offset)) return;
  if (here.onset === loop.onset || here.offset === loop.offset) clock.setLoop({ onset: here.onset,
    offset: here.offset });
}

function onRefused(entry: Entry, error: ApiError): void {
  if (error.kind === "stale") {
    tell(say("stale.dropped", { step: describeStep(entry.operation) }), "warning");
    return;
  }
  tell(say("edit.refused", { step: describeStep(entry.operation), reason: describeError(error) }), "error");
  if (error.kind === "take-gone" || error.kind === "not-found" || error.kind === "conflict") refreshLater("draft", 0);
}

function onState(state: "saved" | "saving" | "unsaved", entry: Entry | null, error: ApiError | null): void {
  if (state === "saved" || entry === null) saving.value = { state: "saved" };
  else if (state === "saving") saving.value = { state: "saving", operation: entry.operation };
  else saving.value = { state: "unsaved", operation: entry.operation, reason: describeError(error) };
}

/** What another tab says: fetch the draft where it is the one that is shown here. */
export function onOtherTab(message: { take: string; purpose: string; version: number }): void {
  const shown = draft.value;
  if (scene.value?.take !== message.take || purpose.value !== message.purpose) {
    refreshLater("queue", 1000);
    return;
  }
  if (shown !== null && shown.version < message.version && outbox.size === 0) refreshLater("draft", 50);
  refreshLater("queue", 1000);
}
