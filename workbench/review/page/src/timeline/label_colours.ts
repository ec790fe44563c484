/** What the canvas draws labels with, kept for a scheme and a theme. */
import type { Scheme } from "../api/messages";
import { findColours, findVocabulary, fitsBetween } from "../labels/labels";
import { mixLabel, type LabelColours, type Theme } from "./theme";

/** Answers for one scheme and one theme, each worked out once. */
export class LabelPalette {
  readonly #known = new Map<string, LabelColours>();

  constructor(
    readonly scheme: Scheme | null,
    readonly theme: Theme,
  ) {}

  /** Whether a transition fits between its neighbours; see fitsBetween. */
  fits(tier: string, text: string, before: string, after: string): boolean {
    return fitsBetween(findVocabulary(this.scheme, tier), text, before, after);
  }

  find(tier: string, label: string): LabelColours {
    const key = `${tier.length} ${tier}${label}`;
    let colours = this.#known.get(key);
    if (colours === undefined) {
      colours = mixLabel(findColours(this.scheme, tier, label), this.theme);
      this.#known.set(key, colours);
    }
    return colours;
  }
}
