/**
 * What the server and the page say to each other, as the server's OpenAPI description has it.
 *
 * Frames are whole numbers, intervals half-open [onset, offset). Ids of segments are 64-bit numbers and travel as
 * decimal texts. Names of takes, tiers and people travel in the query or the body, never in a path: they may hold
 * any character.
 */

export interface ErrorMessage {
  error: {
    /** What a page does about it. */
    kind:
      | "input" | "not-found" | "conflict" | "stale" | "corpus" | "no-session" | "forbidden" | "csrf" | "too-large"
      | "too-many" | "not-saved" | "take-gone" | "no-weights" | "server";
    /** One line for a person, in English: what is wrong, where, what to do. */
    message: string;
  };
}

export interface Session {
  person: string;
  is_lead: boolean;
  /** Whether people log in by name; otherwise the token in the opened address did. */
  named: boolean;
  /** Sent back in the header X-Mimique-CSRF with whatever changes something. */
  csrf: string;
  corpus: string;
  /** The newest snapshot of the corpus: another one than before means that somebody committed. */
  snapshot: string;
  /** Tells this corpus from another of the same name: a hash of where it lies. */
  place: string;
  version: string;
  /** What the person chose: language, keys, layout. */
  settings: Settings;
}

export interface Settings {
  language?: "en" | "fr";
  /** Command to keys; a command that is not named keeps its usual ones. */
  keys?: Record<string, string[]>;
  [name: string]: unknown;
}

export type Mode = "review" | "blind" | "none";

export interface TakeRow {
  take: string;
  signer: string | null;
  protocol: string | null;
  rate: number;
  frames: number;
  seconds: number;
  simulated: boolean;
  /** The current one; null where the take has no weights yet. */
  solve: string | null;
  /** review: with proposals; blind: to be coded without seeing anybody's; none: not this person's. */
  mode: Mode;
  /** Why this take may not be shown (consent), null where it may. */
  refusal: string | null;
  /** Of this person's draft or, where none is begun, of what it would start from. */
  proposed: number;
  reviewed: number;
  /** Edits that are not in the corpus yet. */
  unpublished: number;
  /** Whether the person said that a blind take is finished. */
  done: boolean;
}

export interface CorpusMessage {
  name: string;
  snapshot: string;
  takes: TakeRow[];
  rigs: string[];
  /** What stands in the way, and the command that helps: no takes, no weights, locked … */
  problems: { message: string; command: string | null }[];
}

export interface Scene {
  take: string;
  signer: string | null;
  protocol: string | null;
  simulated: boolean;
  rate: number;
  frames: number;
  seconds: number;
  /** Null where the take has no weights; then `problem` says which command to run. */
  solve: string | null;
  solves: string[];
  rig: string | null;
  /** Of the rig, in the order of the columns of /api/weights and of the morph targets of /api/rig. */
  shapes: string[];
  /** Shapes that move most in this take, the first ones. */
  strongest: string[];
  /** Markers in the rig's space; empty where there are none on this rig. */
  markers: string[];
  /** Curves of /api/curve: velocity (1/s), acceleration (1/s²), level (1/s), residual (mm); shapes besides. */
  curves: { name: string; unit: string }[];
  /** Frames whose residual stands out: mm, and stretches [onset, offset). */
  residual: { threshold: number | null; stretches: [number, number][] };
  videos: { index: number; name: string; rate: number | null; offset: number; problem: string | null }[];
  problem: { message: string; command: string | null } | null;
}

export type Status = "proposed" | "reviewed" | "adjudicated";

export interface Segment {
  id: string;
  onset: number;
  offset: number;
  label: string;
  /** 0 to 1; null where nobody said. */
  confidence: number | null;
  status: Status;
  origin: "human" | "model" | "import";
  revision: number;
  kind: "interval" | "point";
}

/** own: the person's tiers; adjudication: the tiers that settle a disagreement (author "adjudicated"). */
export type Purpose = "own" | "adjudication";

export interface DraftTier {
  tier: string;
  /** Whose proposals it started from; null where from nothing. */
  source: string | null;
  segments: Segment[];
}

export interface OtherTier {
  tier: string;
  author: string;
  made_by: "person" | "model" | "import";
  segments: Segment[];
}

export interface Draft {
  take: string;
  purpose: Purpose;
  author: string;
  /** Rises with every edit, undo and redo. */
  version: number;
  /** The snapshot that it started from, or that it was last published as. */
  base: string;
  mode: Mode;
  tiers: DraftTier[];
  /** Of other people and machines, to look at; empty where the take is blind. */
  others: OtherTier[];
  unpublished: number;
  done: boolean;
  /** What would be undone or redone, as an operation's kind; null where nothing. */
  undo: string | null;
  redo: string | null;
  /** The take was deleted from the corpus meanwhile; the edits are still here. */
  gone: string | null;
}

export type Operation =
  | { kind: "accept"; tier: string; segments: string[] }
  | { kind: "relabel"; tier: string; segments: string[]; label: string }
  /** A boundary that two segments share moves for both, unless `together` is false. */
  | { kind: "move"; tier: string; segment: string; onset?: number; offset?: number; together?: boolean }
  | { kind: "split"; tier: string; segment: string; frame: number }
  /** Neighbours in order; the label is the first one's unless given; a gap between them is filled. */
  | { kind: "merge"; tier: string; segments: string[]; label?: string }
  /** A new segment; what lies below it gives way (is cut, split or removed). */
  | { kind: "add"; tier: string; onset: number; offset: number; label: string }
  | { kind: "delete"; tier: string; segments: string[] }
  /** Adjudication: what holds in [onset, offset); null for nothing. The segment gets the status adjudicated. */
  | { kind: "settle"; tier: string; onset: number; offset: number; label: string | null }
  /** The whole tier anew: from an author of `others`. */
  | { kind: "take-over"; tier: string; author: string };

export interface EditRequest {
  take: string;
  purpose: Purpose;
  /** A UUID: an edit that is sent twice counts once. */
  request: string;
  /** Of the draft that the person saw. */
  version: number;
  operation: Operation;
}

export interface StepRequest {
  take: string;
  purpose: Purpose;
  request: string;
  version: number;
}

/** Sent once the edit is on disk. */
export interface EditAnswer {
  version: number;
  undo: string | null;
  redo: string | null;
  unpublished: number;
  changes: { tier: string; removed: string[]; added: Segment[] }[];
}

export interface PublishChange {
  take: string;
  purpose: Purpose;
  tier: string;
  kind: "added" | "removed" | "edited" | "split" | "merged";
  words: string;
  onset: number;
  before: Segment[];
  after: Segment[];
}

export interface PublishConflict {
  key: string;
  take: string;
  purpose: Purpose;
  tier: string;
  onset: number;
  offset: number;
  /** Who published the other state, and how the commit was called. */
  author: string;
  message: string;
  base: Segment[];
  ours: Segment[];
  theirs: Segment[];
  choices: ("ours" | "theirs" | "base" | "both")[];
}

export interface PublishPlan {
  /** Of exactly this plan; publishing another is refused. */
  plan: string;
  snapshot: string;
  changes: PublishChange[];
  conflicts: PublishConflict[];
  /** Edits that cannot be published now: the take was deleted, its recording is another. */
  held_back: { take: string; message: string }[];
}

export interface PublishRequest {
  plan: string;
  message: string;
  choices: Record<string, string>;
}

export interface PublishAnswer {
  snapshot: string;
  changes: number;
  takes: number;
}

export interface QueueItem {
  take: string;
  tier: string;
  id: string;
  onset: number;
  offset: number;
  seconds: number;
  label: string;
  confidence: number | null;
  /** The likeliest other label, "" where unknown. */
  second: string;
  /** Expected gain in macro F1 of putting it right; null where nothing is known (then it comes first). */
  gain: number | null;
  status: Status;
  signer: string | null;
  protocol: string | null;
}

export interface Queue {
  /** In order of expected usefulness. */
  items: QueueItem[];
  /** Whether the models' probabilities are in; before, confidences stand for them. */
  ready: boolean;
}

export interface Pace {
  reviewed: number;
  remaining: number;
  /** Segments a minute over the last active minutes; null before there is anything to say. */
  per_minute: number | null;
  minutes_left: number | null;
  active_seconds: number;
}

export interface Activity {
  take: string;
  /** Of looking and working, at most 120 since the last message. */
  seconds: number;
}

export interface CodingPlan {
  tier: string;
  /** 0 to 1 of the takes are coded by `coders_per_take` people, blind. */
  share: number;
  coders: string[];
  coders_per_take: number;
  seed: number;
  takes: { take: string; coders: string[]; done: string[] }[];
}

export interface Overview {
  people: {
    person: string;
    is_lead: boolean;
    takes: number;
    reviewed: number;
    edits: number;
    unpublished: number;
    active_seconds: number;
    /** Seconds of work per minute of recording that was reviewed; null before there is any. */
    seconds_per_minute: number | null;
    /** ISO 8601, UTC. */
    last_active: string | null;
  }[];
  takes: {
    take: string;
    signer: string | null;
    protocol: string | null;
    seconds: number;
    by: { person: string; mode: Mode; segments: number; reviewed: number; done: boolean; unpublished: number }[];
  }[];
  agreement: {
    tier: string;
    first: string;
    second: string;
    takes: number;
    seconds: number;
    kappa: number | null;
    alpha: number | null;
    /** Part of the time on which both say the same. */
    agreement: number | null;
    f1_50: number | null;
  }[];
  to_settle: {
    take: string;
    tier: string;
    first: string;
    second: string;
    disagreements: number;
    seconds: number;
    settled: number;
  }[];
}

export interface Adjudication {
  take: string;
  tier: string;
  first: { author: string; segments: Segment[] };
  second: { author: string; segments: Segment[] };
  disagreements: {
    onset: number;
    offset: number;
    first: string | null;
    second: string | null;
    settled: boolean;
  }[];
}

export interface SchemeLabel {
  label: string;
  /** #rrggbb */
  colour: string;
  /** What to press, "" where none. */
  key: string;
  /** What it means: the label's entry in the coding manual. */
  note: string;
  /** Other spellings that mean it. */
  aliases: string[];
  retired: boolean;
  segments: number;
}

export interface Vocabulary {
  name: string;
  /** Tiers that it is for, its own first. */
  tiers: string[];
  labels: SchemeLabel[];
  /** Whether two labels in a row name the transition between them. */
  transitions: boolean;
  /** How the tier is coded: its part of the coding manual, in Markdown. */
  manual: string;
}

export interface Scheme {
  snapshot: string;
  vocabularies: Vocabulary[];
}

export type SchemeChange =
  | { kind: "add"; vocabulary: string; label: string; colour?: string; key?: string; note?: string }
  | { kind: "rename"; vocabulary: string; label: string; to: string }
  | { kind: "merge"; vocabulary: string; labels: string[]; into: string }
  | { kind: "retire"; vocabulary: string; label: string }
  | { kind: "describe"; vocabulary: string; label: string; colour?: string; key?: string; note?: string }
  | { kind: "order"; vocabulary: string; labels: string[] }
  | { kind: "add-tier"; tier: string; vocabulary: string | null }
  | { kind: "remove-tier"; tier: string; vocabulary: string }
  | { kind: "restore"; vocabulary: string; label: string }
  | { kind: "manual"; vocabulary: string; text: string };

/** POST /api/scheme, answered with the new Scheme: one commit. A stale snapshot is refused (kind "stale"). */
export interface SchemeRequest {
  snapshot: string;
  change: SchemeChange;
}

export interface ElanTier {
  /** In the file. */
  name: string;
  /** Of the draft, proposed; null: left out. */
  tier: string | null;
  segments: number;
  problems: string[];
}

export interface ElanPreview {
  tiers: ElanTier[];
  warnings: string[];
}

export interface AccountRow {
  person: string;
  is_lead: boolean;
  is_active: boolean;
}

/** PUT /api/password, for oneself -> Session: other windows are logged out, this one goes on with the new csrf. */
export interface PasswordRequest {
  old: string;
  new: string;
}

/** POST, lead: a new account, or another password (null keeps it) and rights for one that is there. */
export interface AccountRequest {
  person: string;
  password: string | null;
  is_lead: boolean;
}

/** POST /api/session: by the token in the opened address, or by name where people have accounts. */
export type LoginRequest = { token: string } | { person: string; password: string };
