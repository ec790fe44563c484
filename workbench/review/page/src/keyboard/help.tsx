/** The help page: every command with its keys, which can be changed here, and what the mouse does. */
import { useSignal, type Signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { DialogFrame } from "../shell/dialog_frame";
import { saveSettings } from "../state/actions";
import { dialog } from "../state/state";
import { language, say, type WordKey } from "../words";
import { record } from "./bindings";
import { commands, type Command, type Group } from "./commands";
import { choices, keymap, nameCommand } from "./describing";
import "./help.css";
import { changeKeys, wantedKeys } from "./keymap";
import { readPress, writeKeys } from "./keys";

const GROUPS: Group[] = ["play", "move", "queue", "edit", "label", "view", "page"];

const MOUSE: [WordKey, WordKey][] = [
  ["mouse.wheel", "mouse.wheel-does"], ["mouse.shift-wheel", "mouse.shift-wheel-does"],
  ["mouse.strip", "mouse.strip-does"],
  ["mouse.ruler", "mouse.ruler-does"], ["mouse.segment", "mouse.segment-does"], ["mouse.twice", "mouse.twice-does"],
  ["mouse.boundary", "mouse.boundary-does"], ["mouse.drag", "mouse.drag-does"],
];

/** The help page where it is open. */
export function HelpDialog() {
  return dialog.value === "help" ? <Help /> : null;
}

function Help() {
  const typed = useSignal("");
  const waiting = useSignal<string | null>(null);
  useEffect(() => () => record(null), []);

  const close = () => {
    dialog.value = null;
  };
  const shown = commands.value.filter((command) => matches(command, typed.value));
  const foot = (
    <>
      <span class="dialog-foot-left soft">{say("keys.changed")}</span>
      <button
        type="button" class="button" disabled={Object.keys(choices.value).length === 0}
        onClick={() => void saveSettings({ keys: {} })}
      >
        {say("keys.reset-all")}
      </button>
    </>
  );
  return (
    <DialogFrame title={say("keys.title")} onClose={close} size="full" foot={foot} class="help">
      <input
        class="input help-search" type="search" aria-label={say("keys.search")} placeholder={say("keys.search")}
        value={typed.value}
        onInput={(event) => (typed.value = event.currentTarget.value)} autofocus
      />
      {keymap.value.clashes.map((clash) => (
        <p key={clash.keys} class="message message-warning">
          {say("keys.clash", {
            key: writeKeys(clash.keys, language.value), winner: nameCommand(clash.commands[0]!),
            loser: clash.commands.slice(1).map(nameCommand).join("”, “"),
          })}
        </p>
      ))}
      {shown.length === 0 && <p class="empty">{say("keys.none")}</p>}
      <div class="help-groups">
        {GROUPS.map((group) => {
          const members = shown.filter((command) => command.group === group);
          return members.length === 0 ? null : (
            <section key={group} class="help-group">
              <h3>{say(`keys.group.${group}`)}</h3>
              <ul>
                {members.map((command) => (
                  <Row key={command.id} command={command} waiting={waiting} />
                ))}
              </ul>
            </section>
          );
        })}
        {typed.value === "" && (
          <section class="help-group">
            <h3>{say("keys.mouse")}</h3>
            <dl>
              {MOUSE.map(([what, does]) => (
                <div key={what}><dt>{say(what)}</dt><dd>{say(does)}</dd></div>
              ))}
            </dl>
          </section>
        )}
      </div>
    </DialogFrame>
  );
}

/** Whether a command's name, or one of its keys, holds what was typed. */
export function matches(command: Command, typed: string): boolean {
  const wanted = typed.trim().toLowerCase();
  if (wanted === "") return true;
  if (nameCommand(command).toLowerCase().includes(wanted)) return true;
  return wantedKeys(command, choices.value).some((keys) => {
    const written = writeKeys(keys, language.value).toLowerCase();
    return written === wanted || (wanted.length > 1 && written.includes(wanted)) || keys.toLowerCase() === wanted;
  });
}

function Row(props: { command: Command; waiting: Signal<string | null> }) {
  const { command, waiting } = props;
  const name = nameCommand(command);
  const keys = wantedKeys(command, choices.value);
  const isWaiting = waiting.value === command.id;
  const save = (wanted: string[]) => void saveSettings({ keys: changeKeys(choices.value, command, wanted) });
  const stop = () => {
    record(null);
    waiting.value = null;
  };
  const wait = () => {
    waiting.value = command.id;
    record((event) => {
      const pressed = readPress(event)[0];
      if (pressed === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      stop();
      if (pressed !== "Escape") save([...keys, pressed]);
    });
  };
  return (
    <li class="help-row">
      <span class="help-name">{name}</span>
      <span class="help-keys">
        {keys.map((one) => {
          const written = writeKeys(one, language.value);
          const isLost = keymap.value.find.get(one) !== command.id;
          return command.id === "page.escape" ? <kbd key={one} class="key">{written}</kbd> : (
            <button
              key={one} type="button" class={isLost ? "key help-key help-key-lost" : "key help-key"}
              aria-label={say("keys.remove", { key: written, command: name })}
              title={say("keys.remove", { key: written, command: name })}
              onClick={() => save(keys.filter((other) => other !== one))}
            >
              {written}
            </button>
          );
        })}
        {command.id !== "page.escape" && (
          <button
            type="button" class={isWaiting ? "help-add help-add-waiting" : "help-add"} aria-pressed={isWaiting}
            aria-label={isWaiting ? say("keys.press") : say("keys.add", { command: name })}
            title={say("keys.add", { command: name })}
            onClick={() => (isWaiting ? stop() : wait())} onBlur={() => isWaiting && stop()}
          >
            {isWaiting ? say("keys.press") : "+"}
          </button>
        )}
        {Array.isArray(choices.value[command.id]) && (
          <button
            type="button" class="help-add" aria-label={say("keys.reset", { command: name })}
            title={say("keys.reset", { command: name })}
            onClick={() => save(command.keys)}
          >
            {say("keys.reset-short")}
          </button>
        )}
      </span>
    </li>
  );
}
