/** Which colour a label has in which tier: from the scheme, a usual one for what the scheme does not name. */
import type { Scheme } from "../api/messages";
import { mixLabel, type LabelColours, type Theme } from "./theme";

/** Okabe and Ito's colours that differ for all kinds of colour vision, without black and yellow. */
const USUAL = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00"];

/** Answers for one scheme and one theme, each worked out once. */
export class LabelPalette {
  readonly #known = new Map<string, LabelColours>();

  constructor(
    readonly scheme: Scheme | null,
    readonly theme: Theme,
  ) {}

  find(tier: string, label: string): LabelColours {
    const key = `${tier.length} ${tier}${label}`;
    let colours = this.#known.get(key);
    if (colours === undefined) {
      colours = mixLabel(findColour(this.scheme, tier, label), this.theme);
      this.#known.set(key, colours);
    }
    return colours;
  }
}

/** The scheme's colour of a label, also under another spelling; one that always is the same where it has none. */
export function findColour(scheme: Scheme | null, tier: string, label: string): string {
  const labels = scheme?.vocabularies.find((one) => one.tiers.includes(tier))?.labels ?? [];
  const known = labels.find((one) => one.label === label) ?? labels.find((one) => one.aliases.includes(label));
  if (known !== undefined && known.colour !== "") return known.colour;
  let sum = 0;
  for (const letter of label) sum = (sum * 31 + letter.codePointAt(0)!) % 65_521;
  return USUAL[sum % USUAL.length]!;
}
