/** Every command of the page, by name: what the keyboard, the menus and the help page know. */
import { computed, signal } from "@preact/signals";
import type { WordKey } from "../words";

export type Group = "play" | "move" | "edit" | "label" | "queue" | "view" | "page";

export interface Command {
  id: string;
  group: Group;
  /** What it is called. A label's command is called by its label. */
  name: WordKey | { text: string };
  /** Usual keys, as keys.ts writes them: "Space", "Shift+ArrowLeft", "Ctrl+Z", "1". */
  keys: string[];
  /** Whether it runs again while the key is held. */
  repeats?: boolean;
  /** Whether it can run now; the menus and the help page show others as not available. */
  enabled?: () => boolean;
  run: () => void | Promise<unknown>;
  /** Where given, the command lasts as long as the key is held (hold-to-label). */
  release?: () => void | Promise<unknown>;
}

const known = new Map<string, Command>();
const changes = signal(0);

/** All commands, for what has to follow when some are made known later. */
export const commands = computed<Command[]>(() => {
  void changes.value;
  return [...known.values()];
});

/** Make commands known; one of the same id gives way. */
export function register(...added: Command[]): void {
  for (const command of added) known.set(command.id, command);
  changes.value = changes.peek() + 1;
}

/** Make commands unknown again. */
export function forget(...ids: string[]): void {
  for (const id of ids) known.delete(id);
  changes.value = changes.peek() + 1;
}

export function listCommands(): Command[] {
  return [...known.values()];
}

export function findCommand(id: string): Command | undefined {
  return known.get(id);
}
