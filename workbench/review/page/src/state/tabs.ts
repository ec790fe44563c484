/** Tabs of one person tell each other what they changed, so that none shows an old state. */
import type { Purpose } from "../api/messages";

export type TabMessage =
  | { kind: "draft"; take: string; purpose: Purpose; version: number }
  /** The corpus has a new commit: edits were published, or the scheme was changed. */
  | { kind: "corpus" }
  | { kind: "logout" };

let channel: BroadcastChannel | null = null;

/** Join the tabs of a person on a corpus. */
export function joinTabs(corpus: string, person: string, onMessage: (message: TabMessage) => void): void {
  channel?.close();
  if (typeof BroadcastChannel === "undefined") return;
  channel = new BroadcastChannel(`mimique.${JSON.stringify([corpus, person])}`);
  channel.onmessage = (event: MessageEvent<TabMessage>) => onMessage(event.data);
}

/** Tell the other tabs. */
export function tellTabs(message: TabMessage): void {
  channel?.postMessage(message);
}
