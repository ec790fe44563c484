/** What people type and choose from: search words, lists of values, frames, names of places. */
import type { TakeRow } from "../api/messages";

/** Whether a take matches what was typed: every word occurs in its name, signer or protocol. */
export function matchesTake(row: Pick<TakeRow, "take" | "signer" | "protocol">, typed: string): boolean {
  const text = `${row.take} ${row.signer ?? ""} ${row.protocol ?? ""}`.toLocaleLowerCase();
  return typed.toLocaleLowerCase().split(/\s+/).every((word) => text.includes(word));
}

/** The values that occur, each once, sorted as people count (S2 before S10). */
export function listValues(values: Iterable<string | null>): string[] {
  const found = new Set<string>();
  for (const one of values) if (one !== null) found.add(one);
  return [...found].sort(new Intl.Collator("en", { numeric: true }).compare);
}

/** Return the frame that was typed, null where it is none of the take's boundaries. */
export function readFrame(typed: string | null, frames: number): number | null {
  if (typed === null || !/^\s*\d+\s*$/.test(typed)) return null;
  const frame = Number(typed);
  return frame <= frames ? frame : null;
}

/** The last part of a corpus's location. */
export function nameOf(location: string): string {
  return location.replace(/[/\\]+$/, "").split(/[/\\]/).pop() || location;
}
