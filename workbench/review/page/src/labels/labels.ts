/**
 * What a label means: which of the scheme's labels it is, under whichever spelling, and which two a transition joins.
 *
 * One place for all that shows labels, so that queue, buttons, timeline and dialogs agree on colours and names.
 */
import type { Scheme, SchemeLabel, Vocabulary } from "../api/messages";
import type { Language } from "../words";

/** Okabe and Ito's colours that differ for all kinds of colour vision, without black and yellow. */
const USUAL = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00"];

/** The affects in both languages; a label that is one of them under some spelling is called by its name. */
const AFFECTS: Record<Language, string>[] = [
  { en: "neutral", fr: "neutre" },
  { en: "anger", fr: "colère" },
  { en: "disgust", fr: "dégoût" },
  { en: "fear", fr: "peur" },
  { en: "joy", fr: "joie" },
  { en: "sadness", fr: "tristesse" },
  { en: "surprise", fr: "surprise" },
];

/** The vocabulary that a tier is coded with. */
export function findVocabulary(scheme: Scheme | null, tier: string | null): Vocabulary | null {
  return scheme?.vocabularies.find((one) => tier !== null && one.tiers.includes(tier)) ?? null;
}

/** The scheme's label that a text stands for, itself or by another spelling; null where there is none. */
export function findLabel(vocabulary: Vocabulary | null, text: string): SchemeLabel | null {
  const labels = vocabulary?.labels ?? [];
  return labels.find((one) => one.label === text) ?? labels.find((one) => one.aliases.includes(text)) ?? null;
}

/**
 * A label as a tier spells it: as the same label stands there already, else in the way that most of its labels have
 * (names in one language), else by its code. A tier in which "anger" stands beside A could not be compared.
 */
export function spellLike(vocabulary: Vocabulary | null, label: string, texts: readonly string[]): string {
  const meant = findLabel(vocabulary, label);
  if (meant === null) return label;
  const spelled = new Map<string, number>();
  const ways = new Map<number, number>();
  for (const text of texts) {
    const known = findLabel(vocabulary, text);
    if (known === null) continue;
    if (known === meant) spelled.set(text, (spelled.get(text) ?? 0) + 1);
    // -1 is the code; labels whose spellings are the same in both languages tell nothing.
    const way = text === known.label ? -1 : known.aliases.indexOf(text);
    if (known.aliases.length > 1 || way < 0) ways.set(way, (ways.get(way) ?? 0) + 1);
  }
  const most = <T>(counts: Map<T, number>) => [...counts].sort((one, other) => other[1] - one[1])[0]?.[0];
  const way = most(ways) ?? -1;
  return most(spelled) ?? (way < 0 ? meant.label : (meant.aliases[way] ?? meant.aliases[0] ?? meant.label));
}

/** What a text leads from and to: two labels of a transition, a label twice; null for anything else. */
export function findEnds(vocabulary: Vocabulary | null, text: string): [SchemeLabel, SchemeLabel] | null {
  const label = findLabel(vocabulary, text);
  return label === null ? splitTransition(vocabulary, text) : [label, label];
}

/** Whether a transition names what stands before and behind it; what is no transition always fits. */
export function fitsBetween(vocabulary: Vocabulary | null, text: string, before: string, after: string): boolean {
  const parts = splitTransition(vocabulary, text);
  if (parts === null) return true;
  const [left, right] = [findEnds(vocabulary, before)?.[1], findEnds(vocabulary, after)?.[0]];
  return (left === undefined || left === parts[0]) && (right === undefined || right === parts[1]);
}

/** Whether two texts mean the same label. */
export function meansSame(vocabulary: Vocabulary | null, one: string, other: string): boolean {
  return one === other || (findLabel(vocabulary, one)?.label ?? one) === (findLabel(vocabulary, other)?.label ?? other);
}

/** From and to, where a text names a transition: two labels in a row, or in their other spellings. */
export function splitTransition(vocabulary: Vocabulary | null, text: string): [SchemeLabel, SchemeLabel] | null {
  if (vocabulary === null || !vocabulary.transitions || findLabel(vocabulary, text) !== null) return null;
  const found: [SchemeLabel, SchemeLabel][] = [];
  for (const from of vocabulary.labels) {
    for (const spelling of [from.label, ...from.aliases]) {
      if (spelling === "" || !text.startsWith(spelling)) continue;
      const to = findLabel(vocabulary, text.slice(spelling.length));
      if (to !== null && to !== from) found.push([from, to]);
    }
  }
  // What can be read in two ways is not guessed at.
  const [first, ...others] = found;
  return first !== undefined && others.every((one) => one[0] === first[0] && one[1] === first[1]) ? first : null;
}

/**
 * The colours of a label on a tier: two for a transition (from, to), else one.
 *
 * A tier without a vocabulary of its own borrows from the others, so that "anger" is anger on every tier; what none of
 * them knows always gets the same colour for the same text.
 */
export function findColours(scheme: Scheme | null, tier: string | null, text: string): string[] {
  const own = findVocabulary(scheme, tier);
  for (const vocabulary of own === null ? (scheme?.vocabularies ?? []) : [own]) {
    const label = findLabel(vocabulary, text);
    const known = label === null ? (splitTransition(vocabulary, text) ?? []) : [label];
    if (known.length > 0 && known.every((one) => one.colour !== "")) return known.map((one) => one.colour);
  }
  let sum = 0;
  for (const letter of text) sum = (sum * 31 + letter.codePointAt(0)!) % 65_521;
  return [USUAL[sum % USUAL.length]!];
}

/**
 * What to call a label besides its code: an affect's name in the language of the page, else how its note begins.
 *
 * Other spellings alone are no names: a label keeps those it was renamed from and those that were merged into it.
 */
export function nameLabel(label: SchemeLabel, language: Language): string {
  const spellings = [label.label, ...label.aliases].map((one) => one.toLowerCase());
  for (const spelling of spellings) {
    const affect = AFFECTS.find((one) => one.en === spelling || one.fr === spelling);
    if (affect !== undefined) return affect[language] === label.label.toLowerCase() ? "" : affect[language];
  }
  return /^[^\n.;:(]*/.exec(label.note.trim())![0].trim();
}
