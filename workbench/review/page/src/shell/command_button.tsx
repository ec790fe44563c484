/** A button that runs a command of the keyboard, with its name and its key, so that the mouse can do all of it too. */
import type { ComponentChildren } from "preact";
import { describeKeys, keysOf, perform } from "../keyboard/bindings";
import { findCommand } from "../keyboard/commands";
import { say } from "../words";
import { Key } from "./pieces";

export interface CommandButtonProps {
  id: string;
  class?: string;
  /** Shorter than the command's name, which stays the hint and what a screen reader says. */
  children?: ComponentChildren;
  /** Whether the key stands on the button; the hint names it in any case. */
  showKey?: boolean;
  label?: string;
  pressed?: boolean;
}

/** A narrow button has no room for the word Shift; its hint spells the key out. */
function shortenKeys(keys: string): string {
  return keys.replace(/^(Shift|Maj)\+/, "⇧");
}

export function CommandButton(props: CommandButtonProps) {
  const command = findCommand(props.id);
  if (command === undefined) return null;
  const name = props.label ?? (typeof command.name === "string" ? say(command.name) : command.name.text);
  const keys = describeKeys(props.id);
  const hint = keys === "" ? name : `${name} (${keys})`;
  return (
    <button
      type="button"
      class={`button ${props.class ?? ""}`}
      title={hint}
      aria-label={name}
      aria-keyshortcuts={keysOf(props.id)[0]}
      aria-pressed={props.pressed}
      disabled={!(command.enabled?.() ?? true)}
      data-command={props.id}
      onClick={() => void perform(props.id)}
    >
      <span class="elide">{props.children ?? name}</span>
      {(props.showKey ?? true) && <Key keys={shortenKeys(keys)} />}
    </button>
  );
}
