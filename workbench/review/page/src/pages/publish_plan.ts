/** What a publish plan comes to: grouped by take and tier, counted, and said in the language of the page. */
import type { PublishChange, PublishPlan, Purpose, Segment } from "../api/messages";
import { say } from "../words";
import { formatLength, formatNumber, sayCount } from "../words/numbers";

export interface TierChanges {
  take: string;
  tier: string;
  purpose: Purpose;
  changes: PublishChange[];
}

export interface TakeChanges {
  take: string;
  count: number;
  tiers: TierChanges[];
}

/** The changes of each take, takes and tiers in the order in which the plan names them, changes by onset. */
export function groupChanges(changes: PublishChange[]): TakeChanges[] {
  const takes = new Map<string, Map<string, TierChanges>>();
  for (const change of changes) {
    const tiers = takes.get(change.take) ?? new Map<string, TierChanges>();
    takes.set(change.take, tiers);
    const key = `${change.purpose} ${change.tier}`;
    const own = tiers.get(key) ?? { take: change.take, tier: change.tier, purpose: change.purpose, changes: [] };
    tiers.set(key, own);
    own.changes.push(change);
  }
  return [...takes].map(([take, tiers]) => ({
    take,
    count: [...tiers.values()].reduce((sum, one) => sum + one.changes.length, 0),
    tiers: [...tiers.values()].map((one) => ({ ...one, changes: [...one.changes].sort((a, b) => a.onset - b.onset) })),
  }));
}

/** How many changes there are of each kind; accepting alone is a kind of its own. */
export function countKinds(changes: PublishChange[]): { kind: PublishChange["kind"] | "accepted"; count: number }[] {
  const counts = new Map<PublishChange["kind"] | "accepted", number>();
  for (const change of changes) {
    const kind = isAcceptance(change) ? "accepted" : change.kind;
    counts.set(kind, (counts.get(kind) ?? 0) + 1);
  }
  const order = ["accepted", "edited", "added", "removed", "split", "merged"] as const;
  return order.flatMap((kind) => (counts.has(kind) ? [{ kind, count: counts.get(kind)! }] : []));
}

/** Whether a proposal was taken as it was. */
function isAcceptance(change: PublishChange): boolean {
  const [before, after] = [change.before[0], change.after[0]];
  if (change.kind !== "edited" || before === undefined || after === undefined) return false;
  const same = before.label === after.label && before.onset === after.onset && before.offset === after.offset;
  return same && before.status !== after.status;
}

/** One change in words. What only the server can tell is said in its own. */
export function describeChange(change: PublishChange, rate: number): string {
  const [before, after] = [change.before[0], change.after[0]];
  const labels = (segments: Segment[]): string => segments.map((one) => one.label).join(" + ");
  const length = (one: Segment): string => formatLength(one.offset - one.onset, rate);
  if (change.kind === "added" && after) {
    return say("publish.added", { label: labels(change.after), length: length(after) });
  }
  if (change.kind === "removed" && before) {
    return say("publish.removed", { label: labels(change.before), length: length(before) });
  }
  if (change.kind === "split" && before) {
    return say("publish.split", { label: before.label, parts: labels(change.after), count: change.after.length });
  }
  if (change.kind === "merged" && after) {
    return say("publish.merged", { parts: labels(change.before), label: after.label });
  }
  if (change.kind === "edited" && before && after) {
    const parts: string[] = [];
    if (before.label !== after.label) parts.push(`${before.label} → ${after.label}`);
    if (before.onset !== after.onset) parts.push(say("publish.onset", { by: shift(after.onset - before.onset, rate) }));
    if (before.offset !== after.offset) {
      parts.push(say("publish.offset", { by: shift(after.offset - before.offset, rate) }));
    }
    const said = parts.join(", ");
    if (parts.length > 0) return before.label === after.label ? `${after.label}: ${said}` : said;
    if (isAcceptance(change)) {
      return say(after.status === "adjudicated" ? "publish.adjudicated" : "publish.accepted", { label: after.label });
    }
  }
  return change.words;
}

function shift(frames: number, rate: number): string {
  const sign = frames < 0 ? "−" : "+";
  return `${sign}${formatLength(Math.abs(frames), rate)} (${sign}${formatNumber(Math.abs(frames))})`;
}

/** Whether every conflict has one of its choices. */
export function isDecided(plan: PublishPlan, choices: Record<string, string>): boolean {
  return plan.conflicts.every((conflict) => conflict.choices.some((choice) => choice === choices[conflict.key]));
}

/** The choices that a newer plan still asks for. */
export function keepChoices(plan: PublishPlan, choices: Record<string, string>): Record<string, string> {
  const kept = plan.conflicts.filter((conflict) => conflict.choices.some((choice) => choice === choices[conflict.key]));
  return Object.fromEntries(kept.map((conflict) => [conflict.key, choices[conflict.key]!]));
}

/** What the commit is called unless the person says otherwise. */
export function proposeMessage(plan: PublishPlan): string {
  const named = (purpose: Purpose): string[] => [
    ...new Set([...plan.changes, ...plan.conflicts].filter((one) => one.purpose === purpose).map((one) => one.take)),
  ];
  const [own, settled] = [named("own"), named("adjudication")];
  const parts: string[] = [];
  if (own.length > 2) parts.push(sayCount("publish.message.takes", own.length));
  else if (own.length > 0) parts.push(say("publish.message.own", { takes: own.join(", ") }));
  if (settled.length > 2) parts.push(sayCount("publish.message.settlements", settled.length));
  else if (settled.length > 0) parts.push(say("publish.message.settled", { takes: settled.join(", ") }));
  return parts.join("; ");
}
