/** What a person chooses for themselves; kept at the server at once, so that it holds on every machine. */
import type { ComponentChildren } from "preact";
import type { Settings } from "../api/messages";
import { DialogFrame } from "../shell/dialog_frame";
import { type ThemeChoice, themeChoice } from "../shell/theme";
import { saveSettings } from "../state/actions";
import { dialog, session, showMarkers, showVideo } from "../state/state";
import { type Language, language, say } from "../words";
import { OwnPassword } from "./own_password";

const close = (): void => void (dialog.value = null);
const keep = (change: Settings): void => void saveSettings(change);

export function SettingsDialog() {
  const person = session.value;
  const plays = person?.settings["playOnArrival"] === true;
  return (
    <DialogFrame
      title={say("settings.title")}
      onClose={close}
      foot={<button type="button" class="button button-primary" onClick={close}>{say("pages.close")}</button>}
    >
      <div class="pages-settings">
        <Choice<Language> name={say("settings.language")} chosen={language.value}
          onChoose={(chosen) => keep({ language: chosen })}
          of={[["en", "English"], ["fr", "Français"]]} />
        <Choice<ThemeChoice>
          name={say("settings.theme")}
          chosen={themeChoice.value}
          onChoose={(theme) => keep({ theme })}
          of={(["system", "light", "dark"] as const).map((one) => [one, say(`settings.theme.${one}`)])}
        />
        <fieldset>
          <legend>{say("settings.queue")}</legend>
          <Switch checked={plays} onChange={(playOnArrival) => keep({ playOnArrival })}>{say("settings.play")}</Switch>
        </fieldset>
        <fieldset>
          <legend>{say("settings.shown")}</legend>
          <Switch
            checked={showVideo.value}
            onChange={(video) => keep({ video })}
          >
            {say("settings.video")}
          </Switch>
          <Switch
            checked={showMarkers.value}
            onChange={(markers) => keep({ markers })}
          >
            {say("settings.markers")}
          </Switch>
        </fieldset>
        <fieldset>
          <legend>{say("settings.keys")}</legend>
          <div>
            <button type="button" class="button" onClick={() => (dialog.value = "help")}>
              {say("settings.keys.change")}
            </button>
          </div>
        </fieldset>
        {person?.named && <OwnPassword />}
        {person !== null && (
          <p class="soft small">
            {say(person.named ? "settings.person" : "settings.person.token", { person: person.person })}{" "}
            {say("settings.version", { version: person.version })}
          </p>
        )}
      </div>
    </DialogFrame>
  );
}

interface ChoiceProps<T extends string> {
  name: string;
  of: [T, string][];
  chosen: T;
  onChoose: (one: T) => void;
}

function Choice<T extends string>({ name, of, chosen, onChoose }: ChoiceProps<T>) {
  return (
    <fieldset>
      <legend>{name}</legend>
      <div class="row row-wrap">
        {of.map(([value, text]) => (
          <label key={value} class="check">
            <input type="radio" name={name} checked={value === chosen} onChange={() => onChoose(value)} /> {text}
          </label>
        ))}
      </div>
    </fieldset>
  );
}

function Switch(props: { checked: boolean; onChange: (checked: boolean) => void; children: ComponentChildren }) {
  return (
    <label class="check">
      <input
        type="checkbox"
        checked={props.checked}
        onChange={(event) => props.onChange(event.currentTarget.checked)}
      /> {props.children}
    </label>
  );
}
