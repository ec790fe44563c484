/** Which tier of an .eaf goes into which tier of the draft. */
import type { ElanPreview } from "../api/messages";

/** Tier of the file to tier of the draft; null where it is left out. */
export type Mapping = Record<string, string | null>;

/** What the server proposes; where it names a tier of the draft twice, the fuller one of the file goes in. */
export function startMapping(preview: ElanPreview): Mapping {
  const mapping: Mapping = {};
  const fuller = [...preview.tiers].sort((a, b) => b.segments - a.segments);
  const taken = new Set<string>();
  for (const one of fuller) {
    const free = one.tier !== null && one.problems.length === 0 && !taken.has(one.tier);
    mapping[one.name] = free ? one.tier : null;
    if (free) taken.add(one.tier!);
  }
  return mapping;
}

/** Tiers of the draft that two tiers of the file would go into. */
export function findClashes(mapping: Mapping): string[] {
  const chosen = Object.values(mapping).filter((one) => one !== null);
  return [...new Set(chosen.filter((one, index) => chosen.indexOf(one) !== index))];
}

/** What is sent: only the tiers that go in. */
export function chosenTiers(mapping: Mapping): Record<string, string> {
  return Object.fromEntries(Object.entries(mapping).flatMap(([name, tier]) => (tier === null ? [] : [[name, tier]])));
}

/** How many segments go in. */
export function countSegments(preview: ElanPreview, mapping: Mapping): number {
  return preview.tiers.reduce((sum, one) => sum + (mapping[one.name] == null ? 0 : one.segments), 0);
}
