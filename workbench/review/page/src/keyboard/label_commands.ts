/** Commands of the active tier's labels: one to give it, one to hold while it lasts. */
import { effect } from "@preact/signals";
import { findEnds, findLabel, meansSame, spellLike } from "../labels/labels";
import { edit, refuseWhileArriving, tell } from "../state/actions";
import { activeSegments, activeTier, activeVocabulary, clock, purpose, scene, selection } from "../state/state";
import { held as preview } from "../timeline/preview";
import { say } from "../words";
import { forget, register, type Command } from "./commands";
import { addSegment, canEdit, findMarked, findTargets, lastLabels, useFirstLabel } from "./edit_commands";
import { addShift, normalizeKeys } from "./keys";
import { inTurn } from "./serial";

/** s; what is held shorter was a slip, not a segment. */
const SHORTEST = 0.04;

/** Keep one pair of commands for each label of the active tier; the returned function ends it. */
export function followLabels(): () => void {
  let ids: string[] = [];
  useFirstLabel(() => activeVocabulary.value?.labels.find((one) => !one.retired)?.label ?? null);
  const stop = effect(() => {
    const labels = (activeVocabulary.value?.labels ?? []).filter((one) => !one.retired);
    const commands = labels.flatMap((one) => makeCommands(one.label, normalizeKeys(one.key)));
    if (activeVocabulary.value?.transitions === true) {
      commands.push({
        id: "edit.transition", group: "label", name: "command.transition", keys: ["T"], enabled: canEdit,
        run: () => inTurn(giveTransition),
      });
    }
    const next = commands.map((one) => one.id);
    forget(...ids.filter((id) => !next.includes(id)));
    register(...commands);
    ids = next;
  });
  return () => {
    stop();
    forget(...ids);
  };
}

function makeCommands(label: string, keys: string): Command[] {
  const shifted = addShift(keys);
  return [
    {
      id: `label:${label}`, group: "label", name: { text: label }, keys: keys === "" ? [] : [keys], enabled: canEdit,
      run: () => inTurn(() => giveLabel(label)),
    },
    {
      id: `hold:${label}`, group: "label", name: { text: say("command.hold", { label }) },
      keys: shifted === "" ? [] : [shifted],
      enabled: () => canEdit() && scene.value !== null, run: () => hold(label), release: letGo,
    },
  ];
}

/**
 * Label what lies between in and out, else what is chosen, else the segment under the playhead.
 *
 * The label that a proposal has already, under whichever spelling, accepts it.
 */
async function giveLabel(asked: string): Promise<boolean> {
  const tier = activeTier.value;
  if (tier === null || refuseWhileArriving()) return false;
  const label = spell(asked);
  const stretch = findMarked();
  if (stretch !== null) return addSegment(tier, stretch, label);
  const targets = findTargets();
  if (targets.length === 0) {
    tell(say("keys.label-where"));
    return false;
  }
  if (selection.value.length === 0) selection.value = targets.map((one) => one.id);
  if (asked !== label || findLabel(activeVocabulary.value, label) !== null) lastLabels.set(tier, label);
  if (purpose.value === "adjudication") {
    for (const { onset, offset } of targets) if (
      !(await edit({ kind: "settle", tier, onset, offset, label }))
    ) return false;
    return true;
  }
  const others = targets.filter((one) => !meansSame(activeVocabulary.value, one.label, label));
  if (others.length > 0) return edit({ kind: "relabel", tier, segments: targets.map((one) => one.id), label });
  const proposed = targets.filter((one) => one.status === "proposed").map((one) => one.id);
  return proposed.length === 0 || edit({ kind: "accept", tier, segments: proposed });
}

/** A label as the active tier spells it. An adjudication has the scheme's own. */
function spell(label: string): string {
  if (purpose.value === "adjudication") return label;
  return spellLike(activeVocabulary.value, label, activeSegments.value.map((one) => one.label));
}

/** Label as the transition between its neighbours what is between in and out, or chosen. */
async function giveTransition(): Promise<boolean> {
  const vocabulary = activeVocabulary.value;
  const targets = findTargets();
  const stretch = findMarked() ?? (targets[0] && { onset: targets[0].onset, offset: targets.at(-1)!.offset });
  if (stretch === undefined || vocabulary === null) {
    tell(say("keys.label-where"));
    return false;
  }
  const before = activeSegments.value.findLast((one) => one.offset <= stretch.onset);
  const after = activeSegments.value.find((one) => one.onset >= stretch.offset);
  const from = before && findEnds(vocabulary, before.label)?.[1];
  const to = after && findEnds(vocabulary, after.label)?.[0];
  if (from === undefined || to === undefined || from === to) {
    tell(say("keys.transition-where"));
    return false;
  }
  return giveLabel(from.label + to.label);
}

let stopFollowing: (() => void) | null = null;
let startedPlaying = false;

/** Begin a segment at the playhead, which plays on until the key is let go. */
function hold(asked: string): void {
  if (preview.peek() !== null || refuseWhileArriving()) return;
  const onset = clock.frame.peek();
  const label = spell(asked);
  preview.value = { label, onset, offset: onset };
  startedPlaying = !clock.playing.peek();
  clock.play();
  // Playing from the last frame starts over.
  const from = clock.frame.peek();
  if (from < onset) preview.value = { label, onset: from, offset: from };
  stopFollowing = effect(() => {
    const frame = clock.frame.value;
    const now = preview.peek();
    if (now === null) return;
    // A loop that begins again was played to its end.
    const reached = frame < now.onset || frame < now.offset ? (clock.loop.peek()?.offset ?? now.offset) : frame;
    const end = frame >= clock.frames - 1 ? clock.frames : reached;
    if (end > now.offset) preview.value = { ...now, offset: end };
  });
}

async function letGo(): Promise<void> {
  const segment = preview.peek();
  stopFollowing?.();
  stopFollowing = null;
  if (segment === null) return;
  if (startedPlaying) clock.pause();
  const tier = activeTier.value;
  try {
    if (tier === null) return;
    if ((segment.offset - segment.onset) / clock.rate < SHORTEST) tell(say("keys.hold-longer"));
    else await inTurn(() => addSegment(tier, segment, segment.label));
  } finally {
    if (preview.peek() === segment) preview.value = null;
  }
}

/** Give up the label that is held; whether there was one. */
export function dropHeld(): boolean {
  if (preview.peek() === null || stopFollowing === null) return false;
  stopFollowing();
  stopFollowing = null;
  preview.value = null;
  return true;
}
