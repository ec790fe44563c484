/**
 * Keys as texts: "Ctrl+Shift+Z", "Alt+ArrowLeft", "Space", "?", "1".
 *
 * Letters count by what is printed on them, digits by where they are (a French keyboard needs Shift for digits), other
 * signs by what they write, whatever has to be held for it. Ctrl stands for the command key of a Mac as well.
 */

/** What of a KeyboardEvent counts. */
export interface Press {
  key: string;
  code: string;
  shiftKey: boolean;
  ctrlKey: boolean;
  altKey: boolean;
  metaKey: boolean;
  getModifierState?: (name: string) => boolean;
}

const SILENT = new Set([
  "Shift", "Control", "Alt", "Meta", "AltGraph", "CapsLock", "NumLock", "ScrollLock", "Fn", "FnLock", "Hyper", "Super",
  "Symbol",
  "SymbolLock", "Dead", "Unidentified", "Process", "Compose",
]);

/** The texts that a key press can be bound by, the more exact first; none for a modifier alone. */
export function readPress(press: Press): string[] {
  if (SILENT.has(press.key) || press.key === "") return [];
  // AltGr is how signs are written on many keyboards; Windows reports it as Ctrl and Alt.
  const isAltGraph = press.getModifierState?.("AltGraph") ?? false;
  const held = {
    ctrl: (press.ctrlKey || press.metaKey) && !isAltGraph,
    alt: press.altKey && !isAltGraph,
    shift: press.shiftKey,
  };
  const texts: string[] = [];
  const digit = /^Digit(\d)$/.exec(press.code)?.[1];
  if (digit !== undefined && !isAltGraph) texts.push(join(held, digit));
  if (press.key === " ") texts.push(join(held, "Space"));
  else if ([...press.key].length > 1) texts.push(join(held, press.key));
  else if (isLetter(press.key)) {
    texts.push(join(held, press.key.toUpperCase()));
    // Greek or Cyrillic keyboards: the letter's place.
    const place = /^Key([A-Z])$/.exec(press.code)?.[1];
    if (place !== undefined && !/^[a-z]$/i.test(press.key)) texts.push(join(held, place));
  } else texts.push(join({ ...held, shift: false }, press.key));
  return [...new Set(texts)];
}

/** The usual spelling of a key that a person or a coding scheme wrote; "" where it is none. */
export function normalizeKeys(text: string): string {
  const trimmed = text.trim();
  if (trimmed === "") return text.length > 0 ? "Space" : "";
  const parts = trimmed === "+" ? ["+"] : trimmed.endsWith("++") ? [
    ...trimmed.slice(0, -2).split("+"), "+",
  ] : trimmed.split("+");
  const last = parts[parts.length - 1]!.trim();
  const modifiers = parts.slice(0, -1).map((part) => part.trim().toLowerCase());
  if (last === "" || modifiers.some((part) => !["ctrl", "alt", "shift"].includes(part))) return "";
  const isSign = [...last].length === 1;
  if (!isSign && !/^[A-Z][A-Za-z0-9]+$/.test(last)) return "";
  const held = { ctrl: modifiers.includes("ctrl"), alt: modifiers.includes("alt"), shift: modifiers.includes("shift") };
  if (!isSign) return join(held, last);
  if (isLetter(last)) return join(held, last.toUpperCase());
  return join(/^\d$/.test(last) ? held : { ...held, shift: false }, last);
}

/** A key with Shift besides, for keys that can have it; "" for signs, whose Shift is part of the sign. */
export function addShift(keys: string): string {
  const base = keys.split("+").pop() ?? "";
  if (keys === "" || keys.includes("Shift+") || ([...base].length <= 1 && !/^[\p{L}\d]$/u.test(base))) return "";
  return keys.slice(0, keys.length - base.length) + `Shift+${base}`;
}

const SIGNS: Record<string, string> = { ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓" };
const FRENCH: Record<string, string> = {
  Shift: "Maj", Space: "Espace", Enter: "Entrée", Escape: "Échap", Delete: "Suppr", Backspace: "Retour",
  Home: "Début",
  End: "Fin",
  PageUp: "Page haut", PageDown: "Page bas", Insert: "Inser",
};
const ENGLISH: Record<string, string> = { Escape: "Esc", Delete: "Del", PageUp: "PgUp", PageDown: "PgDn" };

/** Keys as a person reads them: "Maj+Espace", "Alt+←". */
export function writeKeys(keys: string, language: "en" | "fr"): string {
  const names = language === "fr" ? FRENCH : ENGLISH;
  const parts = keys === "+" ? ["+"] : keys.endsWith("++") ? [...keys.slice(0, -2).split("+"), "+"] : keys.split("+");
  return parts.map((part) => SIGNS[part] ?? names[part] ?? part).join("+");
}

function join(held: { ctrl: boolean; alt: boolean; shift: boolean }, base: string): string {
  return (held.ctrl ? "Ctrl+" : "") + (held.alt ? "Alt+" : "") + (held.shift ? "Shift+" : "") + base;
}

function isLetter(text: string): boolean {
  return /^\p{L}$/u.test(text);
}
