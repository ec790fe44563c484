/** Light or dark: the person's choice, or what their system says. */
import { computed, effect, signal } from "@preact/signals";
import { session } from "../state/state";

export type ThemeChoice = "system" | "light" | "dark";

const systemIsDark = signal(false);

/** What settings say; "system" unless the person chose. */
export const themeChoice = computed<ThemeChoice>(() => {
  const said = session.value?.settings["theme"];
  return said === "light" || said === "dark" ? said : "system";
});

/** The theme that is in force; a canvas that reads CSS variables draws again when it changes. */
export const theme = computed<"light" | "dark">(() => {
  if (themeChoice.value !== "system") return themeChoice.value;
  return systemIsDark.value ? "dark" : "light";
});

/** Keep `data-theme` of the document in step; call once. */
export function followTheme(): void {
  const query = window.matchMedia("(prefers-color-scheme: dark)");
  systemIsDark.value = query.matches;
  query.addEventListener("change", (event) => (systemIsDark.value = event.matches));
  effect(() => {
    document.documentElement.dataset["theme"] = theme.value;
  });
}
