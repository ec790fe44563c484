/** Commands and their keys in words, for buttons, menus and the help page. */
import { computed } from "@preact/signals";
import { session } from "../state/state";
import { language, say } from "../words";
import { commands, findCommand, type Command } from "./commands";
import { writeKeys } from "./keys";
import { makeKeymap, type Choices, type Keymap } from "./keymap";

/** What the person chose, whatever else the settings hold. */
export const choices = computed<Choices>(() => {
  const keys: unknown = session.value?.settings.keys;
  return typeof keys === "object" && keys !== null && !Array.isArray(keys) ? (keys as Choices) : {};
});

export const keymap = computed<Keymap>(() => makeKeymap(commands.value, choices.value));

/** The keys of a command, as keys.ts writes them. */
export function keysOf(id: string): readonly string[] {
  return keymap.value.keysOf.get(id) ?? [];
}

/** The first key of a command as a person reads it, "" where it has none. */
export function describeKeys(id: string): string {
  const first = keysOf(id)[0];
  return first === undefined ? "" : writeKeys(first, language.value);
}

/** What a command is called; its id where there is no such command. */
export function nameCommand(command: Command | string): string {
  const found = typeof command === "string" ? findCommand(command) : command;
  if (found === undefined) return String(command);
  return typeof found.name === "string" ? say(found.name) : found.name.text;
}
