/** The colour of a label: the scheme's, whichever tier it is asked for. */
import { computed } from "@preact/signals";
import { activeTier, scheme } from "../state/state";

const byTier = computed(() => {
  const found = new Map<string, Map<string, string>>();
  for (const vocabulary of scheme.value?.vocabularies ?? []) {
    const colours = new Map(vocabulary.labels.map((one) => [one.label, one.colour]));
    for (const tier of vocabulary.tiers) if (!found.has(tier)) found.set(tier, colours);
  }
  return found;
});

/** Return the colour of a label on a tier; grey for one that the scheme does not know. */
export function colourOf(label: string, tier: string | null = activeTier.value): string {
  return (tier === null ? undefined : byTier.value.get(tier)?.get(label)) ?? "#9aa0a6";
}
