/** Times as people type them. */

/** The frame that somebody typed: a whole number is a frame, anything with a colon, point or comma is a time. */
export function parsePlace(text: string, rate: number): number | null {
  const typed = text.trim().replace(",", ".");
  if (/^\d+$/.test(typed)) return Number(typed);
  const parts = /^(?:(?:(\d+):)?(\d+):)?(\d+(?:\.\d*)?|\.\d+)\s*s?$/.exec(typed);
  if (parts === null) return null;
  const seconds = Number(parts[1] ?? 0) * 3600 + Number(parts[2] ?? 0) * 60 + Number(parts[3]);
  return Math.floor(seconds * rate + 1e-6);
}
