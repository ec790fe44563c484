/** Every text that a person reads, in English and French. A text that is missing in one of them does not compile. */
import { computed, signal } from "@preact/signals";
import * as keyboard from "./keyboard";
import * as pages from "./pages";
import * as shell from "./shell";
import * as stage from "./stage";
import * as timeline from "./timeline";

export type Language = "en" | "fr";

const EN = { ...keyboard.en, ...pages.en, ...shell.en, ...stage.en, ...timeline.en };
const FR: Words = { ...keyboard.fr, ...pages.fr, ...shell.fr, ...stage.fr, ...timeline.fr };

export type WordKey = keyof typeof EN;
export type Words = Record<WordKey, string>;

/** The language of the page: the browser's, until the person chooses. */
export const language = signal<Language>(
  typeof navigator !== "undefined" && navigator.language.toLowerCase().startsWith("fr") ? "fr" : "en",
);

const words = computed<Words>(() => (language.value === "fr" ? FR : EN));

/** Return a text; `{name}` in it is replaced by the value of that name. */
export function say(key: WordKey, values: Record<string, string | number> = {}): string {
  return words.value[key].replace(/\{(\w+)\}/g, (whole, name: string) => String(values[name] ?? whole));
}
