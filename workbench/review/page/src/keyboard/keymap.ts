/** Which key runs which command: usual keys, the coding scheme's, and those that a person chose. */
import type { Command } from "./commands";
import { normalizeKeys } from "./keys";

/** A person's choice: command to keys. */
export type Choices = Readonly<Record<string, readonly string[]>>;

/** A key that several commands want; the first one has it. */
export interface Clash {
  keys: string;
  commands: string[];
}

export interface Keymap {
  find: ReadonlyMap<string, string>;
  /** Keys that a command really has, its own order. */
  keysOf: ReadonlyMap<string, readonly string[]>;
  clashes: Clash[];
}

/** The keys that a command asks for: the person's choice, else its usual ones. */
export function wantedKeys(command: Command, choices: Choices): string[] {
  const chosen = choices[command.id];
  const keys = Array.isArray(chosen) ? chosen.filter((one) => typeof one === "string") : command.keys;
  return [...new Set(keys.map(normalizeKeys).filter((one) => one !== ""))];
}

/**
 * Give every key to one command.
 *
 * What a person chose goes before what the coding scheme says, and that before the usual keys; among equals the command
 * that was known first has it. Escape always closes and clears.
 */
export function makeKeymap(commands: readonly Command[], choices: Choices): Keymap {
  const rank = (command: Command) => (Array.isArray(choices[command.id]) ? 0 : command.group === "label" ? 1 : 2);
  const ordered = [...commands].sort((a, b) => rank(a) - rank(b));
  const wanting = new Map<string, string[]>();
  for (const command of ordered)
    for (const keys of wantedKeys(command, choices)) wanting.set(keys, [...(wanting.get(keys) ?? []), command.id]);
  const escape = commands.find((one) => one.id === "page.escape");
  if (escape !== undefined) wanting.set(
    "Escape", [escape.id, ...(wanting.get("Escape") ?? []).filter((id) => id !== escape.id)],
  );

  const find = new Map<string, string>();
  const clashes: Clash[] = [];
  for (const [keys, ids] of wanting) {
    find.set(keys, ids[0]!);
    if (ids.length > 1) clashes.push({ keys, commands: ids });
  }
  const keysOf = new Map(
    commands.map(
      (command) => [command.id, wantedKeys(command, choices).filter((keys) => find.get(keys) === command.id)]
    ),
  );
  return { find, keysOf, clashes };
}

/** The choices with other keys for one command; without an entry where they are the usual ones again. */
export function changeKeys(choices: Choices, command: Command, keys: readonly string[]): Record<string, string[]> {
  const others = Object.fromEntries(
    Object.entries(choices).filter(([id]) => id !== command.id).map(([id, chosen]) => [id, [...chosen]]),
  );
  const wanted = [...new Set(keys.map(normalizeKeys).filter((one) => one !== ""))];
  const usual = command.keys.map(normalizeKeys).filter((one) => one !== "");
  const isUsual = wanted.length === usual.length && wanted.every((one, index) => one === usual[index]);
  return isUsual ? others : { ...others, [command.id]: wanted };
}
