/** What the page tells the person in one line. */
import { ApiError, type ErrorKind } from "../api/client";
import { say, type WordKey } from "../words";
import { notice, type Notice } from "./state";

/** Kinds that the page can say in the person's language; for the others the server's line says more. */
const OWN_WORDS: Partial<Record<ErrorKind, WordKey>> = {
  "no-answer": "error.no-answer",
  "no-session": "error.no-session",
  "csrf": "error.csrf",
  "too-many": "error.too-many",
  "stale": "error.stale",
};

/** Show a line. */
export function tell(text: string, tone: Notice["tone"] = "info", command: string | null = null): void {
  notice.value = { tone, text, command };
}

/** Return what an error says, in one line. */
export function describeError(error: unknown): string {
  if (!(error instanceof ApiError)) return error instanceof Error ? error.message : String(error);
  const own = OWN_WORDS[error.kind];
  return own === undefined ? error.message : say(own);
}

/** Show an error; a call that the page itself stopped is none. */
export function tellError(error: unknown): void {
  if (error instanceof ApiError && error.kind === "stopped") return;
  tell(describeError(error), "error");
}
