/** Colours, names and meanings of labels by the scheme that is in force, for components. */
import type { SchemeLabel } from "../api/messages";
import { activeTier, scheme } from "../state/state";
import { findColours, findLabel, findVocabulary } from "./labels";

/** The colours of a label: two for a transition, else one. */
export function coloursOf(label: string, tier: string | null = activeTier.value): string[] {
  return findColours(scheme.value, tier, label);
}

/** The scheme's label that a text stands for on a tier. */
export function labelOf(text: string, tier: string | null = activeTier.value): SchemeLabel | null {
  return findLabel(findVocabulary(scheme.value, tier), text);
}
