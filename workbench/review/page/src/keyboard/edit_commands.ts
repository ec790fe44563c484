/** Commands that edit the active tier. */
import { choose, edit, goTo, redo, refuseWhileArriving, tell, undo } from "../state/actions";
import { activeSegments, activeTier, chosen, clock, draft, marked, purpose, selection } from "../state/state";
import type { Segment } from "../api/messages";
import { moveBoundary, type Edge, type Move } from "../timeline/boundaries";
import { preview } from "../timeline/preview";
import { findAt, findGap } from "../timeline/segments";
import { say, type WordKey } from "../words";
import type { Command } from "./commands";
import { held } from "./held";
import { inTurn } from "./serial";

/** Whether the active tier can be edited. */
export function canEdit(): boolean {
  const current = draft.value;
  return current !== null && current.gone === null && current.mode !== "none" && activeTier.value !== null;
}

/** The label that was given last, by tier. */
export const lastLabels = new Map<string, string>();

export function editCommands(): Command[] {
  const canReview = () => canEdit() && purpose.value === "own";
  const command = (id: string, name: WordKey, keys: string[], run: () => unknown, enabled = canEdit): Command => ({
    id, group: "edit", name, keys, enabled, run: () => inTurn(run),
  });
  return [
    {
      id: "edit.accept", group: "edit", name: "command.accept", keys: ["Enter"], enabled: canReview,
      run: () => accept(true),
    },
    {
      id: "edit.accept-stay", group: "edit", name: "command.accept-stay", keys: ["Shift+Enter"], enabled: canReview,
      run: () => accept(false),
    },
    command("edit.split", "command.split", ["S"], split),
    command("edit.merge-next", "command.merge-next", ["M"], () => merge(1)),
    command("edit.merge-previous", "command.merge-previous", ["Shift+M"], () => merge(-1)),
    { id: "edit.set-in", group: "edit", name: "command.set-in", keys: ["I"], enabled: canEdit, run: setIn },
    { id: "edit.set-out", group: "edit", name: "command.set-out", keys: ["O"], enabled: canEdit, run: setOut },
    command("edit.add", "command.add", ["A"], add),
    command("edit.delete", "command.delete", ["Delete", "Backspace"], remove),
    nudge("edit.onset-earlier", "command.onset-earlier", "Alt+ArrowLeft", "onset", -1),
    nudge("edit.onset-later", "command.onset-later", "Alt+ArrowRight", "onset", 1),
    nudge("edit.onset-earlier-10", "command.onset-earlier-10", "Alt+Shift+ArrowLeft", "onset", -10),
    nudge("edit.onset-later-10", "command.onset-later-10", "Alt+Shift+ArrowRight", "onset", 10),
    nudge("edit.offset-earlier", "command.offset-earlier", "Ctrl+ArrowLeft", "offset", -1),
    nudge("edit.offset-later", "command.offset-later", "Ctrl+ArrowRight", "offset", 1),
    nudge("edit.offset-earlier-10", "command.offset-earlier-10", "Ctrl+Shift+ArrowLeft", "offset", -10),
    nudge("edit.offset-later-10", "command.offset-later-10", "Ctrl+Shift+ArrowRight", "offset", 10),
    {
      id: "edit.undo", group: "edit", name: "command.undo", keys: ["Ctrl+Z"], repeats: true,
      enabled: () => draft.value?.undo != null,
      run: () => inTurn(undo),
    },
    {
      id: "edit.redo", group: "edit", name: "command.redo", keys: ["Ctrl+Shift+Z", "Ctrl+Y"], repeats: true,
      enabled: () => draft.value?.redo != null, run: () => inTurn(redo),
    },
  ];
}

/** The chosen segments in the tier's order; the one under the playhead where none is chosen. */
export function findTargets(): Segment[] {
  const wanted = new Set(selection.value);
  const found = activeSegments.value.filter((one) => wanted.has(one.id));
  if (found.length > 0) return found;
  const under = findAt(activeSegments.value, clock.frame.value);
  return under === null ? [] : [under];
}

let isAccepting = false;

/** Accept what is proposed, then go on. A second press before the first is on disk would accept what nobody saw. */
async function accept(andGoOn: boolean): Promise<void> {
  if (isAccepting || refuseWhileArriving()) return;
  isAccepting = true;
  try {
    await inTurn(async () => {
      const targets = findTargets();
      const tier = activeTier.value;
      if (targets.length === 0 || tier === null) {
        if (!andGoOn) tell(say("keys.choose-first"));
        else await goTo(1);
        return;
      }
      const proposed = targets.filter((one) => one.status === "proposed").map((one) => one.id);
      const isDone = proposed.length === 0 || (await edit({ kind: "accept", tier, segments: proposed }));
      if (isDone && andGoOn) await goTo(1);
    });
  } finally {
    isAccepting = false;
  }
}

async function split(): Promise<void> {
  const frame = clock.frame.value;
  const segment = findAt(activeSegments.value, frame);
  const tier = activeTier.value;
  if (tier === null) return;
  if (segment === null || segment.onset >= frame) tell(say("keys.split-where"));
  else if (await edit({ kind: "split", tier, segment: segment.id, frame })) {
    // The part behind the cut is what one goes on with; the playhead stands at its first frame.
    const second = findAt(activeSegments.value, frame);
    if (second !== null && activeTier.value === tier) choose(second.id, { seek: false });
  }
}

/** Merge the chosen one with its neighbour; several chosen ones with each other. */
async function merge(step: 1 | -1): Promise<void> {
  const segments = activeSegments.value;
  const targets = findTargets();
  const [first, last] = [targets[0], targets[targets.length - 1]];
  const tier = activeTier.value;
  if (tier === null || first === undefined || last === undefined) {
    tell(say("keys.choose-first"));
    return;
  }
  const label = (targets.find((one) => one.id === selection.value[0]) ?? first).label;
  let from = segments.indexOf(first);
  let to = segments.indexOf(last);
  if (targets.length === 1) {
    if (step === 1) to += 1;
    else from -= 1;
  }
  const joined = segments.slice(Math.max(0, from), to + 1);
  if (joined.length < 2) tell(say("keys.no-neighbour"));
  else await edit({ kind: "merge", tier, segments: joined.map((one) => one.id), label });
}

async function remove(): Promise<void> {
  const tier = activeTier.value;
  const chosenOnes = new Set(selection.value);
  const targets = activeSegments.value.filter((one) => chosenOnes.has(one.id));
  if (tier === null || targets.length === 0) {
    tell(say("keys.choose-first"));
    return;
  }
  if (purpose.value === "own") await edit({ kind: "delete", tier, segments: targets.map((one) => one.id) });
  else for (const { onset, offset } of targets) await edit({ kind: "settle", tier, onset, offset, label: null });
}

function setIn(): void {
  const frame = clock.frame.value;
  const { offset } = marked.value;
  marked.value = { onset: frame, offset: offset !== null && offset > frame ? offset : null };
}

/** Out is the boundary before the shown frame, as in splitting; at the last frame it is the take's end. */
function setOut(): void {
  const frame = clock.frame.value >= clock.frames - 1 ? clock.frames : clock.frame.value;
  const { onset } = marked.value;
  if (frame > 0) marked.value = { onset: onset !== null && onset < frame ? onset : null, offset: frame };
}

/** In and out; where only one is set, the playhead is the other. */
export function findMarked(): { onset: number; offset: number } | null {
  const { onset, offset } = marked.value;
  const frame = clock.frame.value;
  const from = onset ?? (offset === null ? null : frame);
  const to = offset ?? (onset === null ? null : frame >= clock.frames - 1 ? clock.frames : frame);
  return from !== null && to !== null && from < to ? { onset: from, offset: to } : null;
}

/** Add what lies between in and out, else the gap under the playhead, with the label that was given last. */
async function add(): Promise<void> {
  const tier = activeTier.value;
  if (tier === null) return;
  const stretch = findMarked() ?? findGap(activeSegments.value, clock.frame.value, clock.frames);
  const label = lastLabels.get(tier) ?? firstLabel();
  if (stretch === null) tell(say("keys.add-where"));
  else if (label === null) tell(say("keys.no-label"));
  else await addSegment(tier, stretch, label);
}

let firstLabel: () => string | null = () => null;

/** Say which label is the scheme's first, for who has given none yet. */
export function useFirstLabel(find: () => string | null): void {
  firstLabel = find;
}

/** Add a segment; an adjudication settles it. */
export async function addSegment(
  tier: string, stretch: { onset: number; offset: number }, label: string,
): Promise<boolean> {
  const { onset, offset } = stretch;
  const done = await edit({ kind: purpose.value === "own" ? "add" : "settle", tier, onset, offset, label });
  if (done) {
    lastLabels.set(tier, label);
    marked.value = { onset: null, offset: null };
  }
  return done;
}

/** The boundary that is being nudged: sent once the key is let go, so that a held key is one edit. */
let nudging: { move: Move; edge: Edge; segment: string; tier: string } | null = null;

function nudge(id: string, name: WordKey, keys: string, edge: Edge, by: number): Command {
  return {
    id, group: "edit", name, keys: [keys], repeats: true, enabled: () => canEdit() && chosen.value !== null,
    run: () => {
      const segment = chosen.value;
      const tier = activeTier.value;
      if (segment === null || tier === null) return;
      const isOther = nudging?.segment !== segment.id || nudging.edge !== edge || nudging.tier !== tier;
      if (isOther) sendNudge();
      // What is on its way already counts: the next step starts from there.
      const shown = preview.value?.tier === tier ? preview.value.segments : activeSegments.value;
      const from = shown.find((one) => one.id === segment.id)?.[edge];
      if (from === undefined) return;
      const move = moveBoundary(tier, shown, segment.id, edge, from + by, clock.frames);
      if (move === null) return;
      nudging = { move, edge, segment: segment.id, tier };
      preview.value = { tier, segments: move.segments, frame: move.frame };
      clock.pause();
      clock.seek(edge === "onset" ? move.frame : move.frame - 1);
      if (!held.has(id)) sendNudge();
    },
    release: sendNudge,
  };
}

function sendNudge(): void {
  if (nudging === null) return;
  const { move, segment, edge } = nudging;
  nudging = null;
  const shown = preview.value;
  const clear = () => {
    if (preview.peek() === shown) preview.value = null;
  };
  if (activeSegments.value.find((one) => one.id === segment)?.[edge] === move.frame) clear();
  else void edit(move.operation).finally(clear);
}
