/** What a coding scheme may hold: names that are free, keys that are free, an order. */
import type { SchemeLabel, Vocabulary } from "../api/messages";
import { findConfusions } from "./colours";

/** Longest name of a label or tier that is offered. */
export const LONGEST_NAME = 80;

export type NameProblem = "empty" | "long" | "taken" | "blank" | "unprintable";

/** Why a name cannot be one of the taken names' neighbours; null where it can. */
export function checkName(name: string, taken: string[]): NameProblem | null {
  if (name.trim() === "") return "empty";
  if (name !== name.trim()) return "blank";
  if (name.length > LONGEST_NAME) return "long";
  if (/[\p{Cc}\p{Cs}]/u.test(name)) return "unprintable";
  return taken.includes(name) ? "taken" : null;
}

/** All names that mean a label: its own and its aliases; of retired ones too. */
export function namesOf(vocabulary: Vocabulary): string[] {
  return vocabulary.labels.flatMap((one) => [one.label, ...one.aliases]);
}

/** Labels by key, where a key has more than one; retired labels have none. */
export function findKeyClashes(labels: SchemeLabel[]): Map<string, string[]> {
  const byKey = new Map<string, string[]>();
  for (const one of labels) {
    if (one.key === "" || one.retired) continue;
    byKey.set(one.key, [...(byKey.get(one.key) ?? []), one.label]);
  }
  return new Map([...byKey].filter(([, all]) => all.length > 1));
}

/** The first digit that no label has; "" where all are taken. */
export function findFreeKey(labels: SchemeLabel[]): string {
  const used = new Set(labels.filter((one) => !one.retired).map((one) => one.key));
  return ["1", "2", "3", "4", "5", "6", "7", "8", "9", "0"].find((key) => !used.has(key)) ?? "";
}

/** A colour that no vision confuses with those in use, out of two colour-blind-safe sets; grey where none is left. */
export function findFreeColour(labels: SchemeLabel[]): string {
  // Okabe and Ito 2008, then Paul Tol's "muted" (2021).
  const safe = [
    "#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7", "#f0e442", "#332288", "#882255", "#117733",
    "#999933", "#44aa99", "#88ccee", "#ddcc77", "#aa4499",
  ];
  const used = labels.filter((one) => !one.retired);
  const free = (colour: string): boolean =>
    used.every((one) => findConfusions([one, { label: "", colour }]).length === 0);
  return safe.find(free) ?? "#777777";
}

/** The names in a new order: one moved by a step among those that are not retired; the same where it cannot. */
export function moveLabel(labels: SchemeLabel[], label: string, step: 1 | -1): string[] {
  const names = labels.map((one) => one.label);
  const from = names.indexOf(label);
  let to = from + step;
  while (labels[to]?.retired) to += step;
  if (from < 0 || to < 0 || to >= names.length) return names;
  names.splice(from, 1);
  names.splice(to, 0, label);
  return names;
}
