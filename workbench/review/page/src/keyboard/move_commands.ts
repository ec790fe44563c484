/** Commands that play, move through the take and the queue, and change the view of it. */
import { choose, goTo, saveSettings, showBeside, tell } from "../state/actions";
import {
  activeSegments, activeTier, beside, chosen, clock, draft, marked, range, scene, selection, showMarkers, showVideo,
} from "../state/state";
import { shownRange } from "../timeline/painter";
import { findAt, findStep } from "../timeline/segments";
import { clampRange, fit, zoomAt } from "../timeline/view";
import { say } from "../words";
import type { Command } from "./commands";

const ZOOM = 1.6;

export function moveCommands(): Command[] {
  const hasTake = () => scene.value !== null;
  const hasTier = () => scene.value !== null && activeTier.value !== null;
  return [
    {
      id: "play.toggle", group: "play", name: "command.play", keys: ["Space"], enabled: hasTake,
      run: () => clock.toggle(),
    },
    {
      id: "play.slower", group: "play", name: "command.slower", keys: [","],
      enabled: hasTake, run: () => clock.slower(),
    },
    {
      id: "play.faster", group: "play", name: "command.faster", keys: ["."],
      enabled: hasTake, run: () => clock.faster(),
    },
    { id: "play.loop", group: "play", name: "command.loop", keys: ["L"], enabled: hasTake, run: toggleLoop },

    step("move.back", "command.back", "ArrowLeft", -1),
    step("move.forward", "command.forward", "ArrowRight", 1),
    step("move.back10", "command.back10", "Shift+ArrowLeft", -10),
    step("move.forward10", "command.forward10", "Shift+ArrowRight", 10),
    {
      id: "move.start", group: "move", name: "command.start", keys: ["Home"],
      enabled: hasTake, run: () => clock.seek(0),
    },
    {
      id: "move.end", group: "move", name: "command.end", keys: ["End"], enabled: hasTake,
      run: () => clock.seek(clock.frames - 1),
    },
    {
      id: "move.next-segment", group: "move", name: "command.next-segment", keys: ["Tab"], repeats: true,
      enabled: hasTier,
      run: () => goToSegment(1),
    },
    {
      id: "move.previous-segment", group: "move", name: "command.previous-segment", keys: ["Shift+Tab"], repeats: true,
      enabled: hasTier,
      run: () => goToSegment(-1),
    },
    {
      id: "move.tier-above", group: "move", name: "command.tier-above", keys: ["ArrowUp"], enabled: hasTier,
      run: () => goToTier(-1),
    },
    {
      id: "move.tier-below", group: "move", name: "command.tier-below", keys: ["ArrowDown"], enabled: hasTier,
      run: () => goToTier(1),
    },

    { id: "queue.next", group: "queue", name: "command.queue-next", keys: ["N"], run: () => goTo(1) },
    { id: "queue.previous", group: "queue", name: "command.queue-previous", keys: ["P"], run: () => goTo(-1) },

    {
      id: "view.zoom-in", group: "view", name: "command.zoom-in", keys: ["+", "=", "Shift+ArrowUp"], repeats: true,
      enabled: hasTake,
      run: () => zoom(1 / ZOOM),
    },
    {
      id: "view.zoom-out", group: "view", name: "command.zoom-out", keys: ["-", "Shift+ArrowDown"], repeats: true,
      enabled: hasTake,
      run: () => zoom(ZOOM),
    },
    {
      id: "view.zoom-segment", group: "view", name: "command.zoom-segment", keys: ["Z"], enabled: hasTake,
      run: zoomToSegment,
    },
    { id: "view.whole", group: "view", name: "command.whole", keys: ["0"], enabled: hasTake, run: showWhole },
    {
      id: "view.markers", group: "view", name: "command.markers", keys: ["G"],
      enabled: () => (scene.value?.markers.length ?? 0) > 0,
      run: () => saveSettings({ markers: !showMarkers.value }),
    },
    { id: "view.beside", group: "view", name: "command.beside", keys: ["B"], enabled: hasTake, run: toggleBeside },
    {
      id: "view.video", group: "view", name: "command.video", keys: ["V"],
      enabled: () => (scene.value?.videos.length ?? 0) > 0,
      run: () => saveSettings({ video: !showVideo.value }),
    },
  ];

  function step(
    id: string, name: "command.back" | "command.forward" | "command.back10" | "command.forward10", keys: string,
    by: number,
  ): Command {
    return { id, group: "move", name, keys: [keys], repeats: true, enabled: hasTake, run: () => clock.step(by) };
  }
}

/** The stretch that is worked on: the chosen segment, in..out, the segment under the playhead. */
function findStretch(): { onset: number; offset: number } | null {
  if (chosen.value !== null) return chosen.value;
  const { onset, offset } = marked.value;
  if (onset !== null && offset !== null) return { onset, offset };
  return findAt(activeSegments.value, clock.frame.value);
}

function toggleLoop(): void {
  const stretch = findStretch();
  const loop = clock.loop.value;
  if (stretch === null || (loop !== null && loop.onset === stretch.onset && loop.offset === stretch.offset)) {
    clock.setLoop(null);
    return;
  }
  clock.setLoop(stretch);
  if (
    clock.frame.value < stretch.onset || clock.frame.value >= stretch.offset || !clock.playing.value
  ) clock.seek(stretch.onset);
  clock.play();
}

function goToSegment(step: 1 | -1): void {
  const next = findStep(activeSegments.value, selection.value[0] ?? null, clock.frame.value, step);
  if (next !== null) choose(next.id);
}

function goToTier(step: 1 | -1): void {
  const tiers = draft.value?.tiers.map((one) => one.tier) ?? [];
  const next = tiers[tiers.indexOf(activeTier.value ?? "") + step];
  if (next === undefined) return;
  activeTier.value = next;
  selection.value = [];
}

/** Zoom where the playhead is; at the middle where it is out of sight. */
function zoom(factor: number): void {
  const view = shownRange.value;
  const frame = clock.frame.value;
  const isSeen = frame >= view.first && frame <= view.last;
  range.value = zoomAt(view, isSeen ? frame : (view.first + view.last) / 2, factor, clock.frames);
}

function zoomToSegment(): void {
  const stretch = findStretch();
  if (stretch !== null) range.value = fit(stretch.onset, stretch.offset, clock.frames);
}

function showWhole(): void {
  range.value = clampRange({ first: 0, last: clock.frames }, clock.frames);
}

/** Another solve of this take beside it, or none again. */
function toggleBeside(): void {
  const current = scene.value;
  if (current === null) return;
  const other = current.solves.find((one) => one !== current.solve);
  if (beside.value !== null) showBeside(null);
  else if (other === undefined) tell(say("keys.no-second-solve"));
  else showBeside({ take: current.take, solve: other });
}
