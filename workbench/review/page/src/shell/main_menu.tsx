/** The menu at the right of the top bar: what is not needed at every segment. */
import { describeKeys } from "../keyboard/bindings";
import { leave, openTake, saveSettings } from "../state/actions";
import { dialog, page, purpose, scene, session, type Dialog } from "../state/state";
import { language, say, type Language } from "../words";
import { MenuIcon } from "./icons";
import { Key } from "./pieces";
import { Popover } from "./popover";
import { themeChoice, type ThemeChoice } from "./theme";

const LANGUAGES: Record<Language, string> = { en: "English", fr: "Français" };

export function MainMenu() {
  const person = session.value;
  if (person === null) return null;
  return (
    <Popover
      label={say("top.menu")}
      side="right"
      button={<><span class="elide person">{person.person}</span><MenuIcon /></>}
    >
      {(close) => (
        <>
          <Item close={close} opens="manual" keys="page.manual">{say("menu.manual")}</Item>
          <Item close={close} opens="scheme">{say("menu.scheme")}</Item>
          <Item close={close} opens="elan">{say("menu.elan")}</Item>
          <div class="menu-line" />
          <Item close={close} opens="help" keys="page.help">{say("menu.help")}</Item>
          <Item close={close} opens="settings">{say("menu.settings")}</Item>
          {person.is_lead && (
            <>
              <div class="menu-line" />
              <div class="menu-heading">{say("menu.lead")}</div>
              <button type="button" role="menuitem" class="menu-item"
                onClick={() => { close(); showPage("overview"); }}>
                {say("menu.overview")}
              </button>
              <Item close={close} opens="coding">{say("menu.coding")}</Item>
              {person.named && <Item close={close} opens="accounts">{say("menu.accounts")}</Item>}
            </>
          )}
          <div class="menu-line" />
          <div class="menu-choice">
            <span class="soft small">{say("menu.language")}</span>
            <div class="button-group" role="group" aria-label={say("menu.language")}>
              {(Object.keys(LANGUAGES) as Language[]).map((one) => (
                <button type="button" class="button button-small" lang={one} key={one}
                  aria-pressed={language.value === one}
                  onClick={() => void saveSettings({ language: one })}>
                  {LANGUAGES[one]}
                </button>
              ))}
            </div>
          </div>
          <div class="menu-choice">
            <span class="soft small">{say("menu.theme")}</span>
            <div class="button-group" role="group" aria-label={say("menu.theme")}>
              {(["system", "light", "dark"] as ThemeChoice[]).map((one) => (
                <button type="button" class="button button-small" key={one} aria-pressed={themeChoice.value === one}
                  onClick={() => void saveSettings({ theme: one })}>
                  {say(`menu.theme-${one}`)}
                </button>
              ))}
            </div>
          </div>
          {person.named && (
            <>
              <div class="menu-line" />
              <button type="button" role="menuitem" class="menu-item" onClick={() => { close(); void leave(); }}>
                {say("menu.leave")}
              </button>
            </>
          )}
        </>
      )}
    </Popover>
  );
}

function Item(props: { close: () => void; opens: Exclude<Dialog, null>; keys?: string; children: string }) {
  return (
    <button type="button" role="menuitem" class="menu-item"
      onClick={() => { props.close(); dialog.value = props.opens; }}>
      {props.children}
      {props.keys !== undefined && <Key keys={describeKeys(props.keys)} />}
    </button>
  );
}

/** Show another page; coming back from adjudication opens one's own draft again. */
export function showPage(to: "review" | "overview" | "adjudication"): void {
  page.value = to;
  if (to !== "adjudication" && purpose.value !== "own") {
    purpose.value = "own";
    const take = scene.value?.take;
    if (take !== undefined) void openTake(take);
  }
}
