/** What is being done and not decided yet: drawn by the timeline, never taken for saved. */
import { signal } from "@preact/signals";
import type { Segment } from "../api/messages";

/** A tier as it would be once a boundary that is being moved is let go. */
export const preview = signal<{ tier: string; segments: Segment[]; frame: number } | null>(null);

/** The label whose key is held, from its first frame to the last one that was shown since. */
export const held = signal<{ label: string; onset: number; offset: number } | null>(null);

/** The frame under the mouse; null where it is elsewhere. */
export const hover = signal<number | null>(null);
