/** What the page shows, as signals; whoever draws reads them, `actions.ts` changes them. */
import { computed, signal } from "@preact/signals";
import type {
  CorpusMessage, Draft, Operation, Pace, Purpose, Queue, QueueItem, Scene, Scheme, Segment, Session, Vocabulary,
} from "../api/messages";
import { Clock } from "../clock/clock";
import { findVocabulary } from "../labels/labels";
import { filterQueue, type Filters } from "./queue";

export { filterQueue, type Filters } from "./queue";

export const session = signal<Session | null>(null);
/** Why somebody has to log in: nobody is yet, or the session came to its end over work. Null: somebody is. */
export const login = signal<"needed" | "lost" | null>(null);
/** Whether the first answers are still awaited. */
export const starting = signal(true);

export const corpus = signal<CorpusMessage | null>(null);
export const scheme = signal<Scheme | null>(null);
export const queue = signal<Queue | null>(null);
export const pace = signal<Pace | null>(null);

/** The take that is open: what is shown of it, and the person's draft. */
export const scene = signal<Scene | null>(null);
export const draft = signal<Draft | null>(null);
export const purpose = signal<Purpose>("own");
/** The take that is being fetched. */
export const opening = signal<string | null>(null);
/** The take that is on its way while another one is still shown: nothing is edited then, it would be the wrong one. */
export const arriving = computed<string | null>(() => {
  const shown = scene.value?.take;
  return shown === undefined || opening.value === shown ? null : opening.value;
});
/** Why a take could not be opened. */
export const takeProblem = signal<{ take: string; message: string } | null>(null);

/** The one clock of the open take; see clock/clock.ts. */
export const clock = new Clock();

/** The tier that labels and keys go to. */
export const activeTier = signal<string | null>(null);
/** The chosen segments of the active tier, the first chosen first. */
export const selection = signal<string[]>([]);
/** In and out that were set for the next label, in frames. */
export const marked = signal<{ onset: number | null; offset: number | null }>({ onset: null, offset: null });

/** The part of the take that the timeline shows, in frames (not whole). */
export const range = signal<{ first: number; last: number }>({ first: 0, last: 1 });

/** A second face beside the first: another solve of this take, or another take. */
export const beside = signal<{ take: string; solve: string | null } | null>(null);
export const showMarkers = signal(false);
export const showVideo = signal(true);
/** Whether the reference video is heard. */
export const hasSound = signal(false);
/** Which curves the timeline draws, of scene.curves or `shape:<name>`. */
export const shownCurves = signal<string[]>(["level", "residual"]);

export type Saving =
  | { state: "saved" }
  | { state: "saving"; operation: Operation | "undo" | "redo" }
  /** The server did not answer, or said that it could not save: kept here and sent again. */
  | { state: "unsaved"; operation: Operation | "undo" | "redo"; reason: string };
export const saving = signal<Saving>({ state: "saved" });

/** One line for the person, shown until it is dismissed or replaced. */
export interface Notice {
  tone: "info" | "warning" | "error";
  text: string;
  command?: string | null;
}
export const notice = signal<Notice | null>(null);

/** The dialog that is open over the page, by name; null where none is. */
export type Dialog =
  | "help" | "publish" | "manual" | "scheme" | "elan" | "settings" | "coding" | "accounts" | null;
export const dialog = signal<Dialog>(null);
/** Which of the two pages is shown. */
export const page = signal<"review" | "overview" | "adjudication">("review");
/** What the adjudication page compares. */
export const settling = signal<{ take: string; tier: string; first: string; second: string } | null>(null);

export const activeSegments = computed<Segment[]>(
  () => draft.value?.tiers.find((one) => one.tier === activeTier.value)?.segments ?? [],
);
export const activeVocabulary = computed<Vocabulary | null>(() => findVocabulary(scheme.value, activeTier.value));
/** The first chosen segment. */
export const chosen = computed<Segment | null>(
  () => activeSegments.value.find((one) => one.id === selection.value[0]) ?? null,
);
/** Edits of all takes that are not in the corpus yet. */
export const unpublished = computed<number>(
  () => corpus.value?.takes.reduce((sum, one) => sum + one.unpublished, 0) ?? 0,
);

/** The queue's filters; the queue panel sets them, `next` and `previous` follow them. */
export const filters = signal<Filters>({
  order: "usefulness", label: null, signer: null, status: "proposed", confidence: 1, take: "all",
});
/** The queue as it is filtered and ordered. */
export const shownQueue = computed<QueueItem[]>(() => filterQueue(queue.value?.items ?? [], filters.value,
  scene.value?.take ?? null));
