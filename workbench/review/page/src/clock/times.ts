/** Times as people read and type them. */

/** Minutes, seconds, thousandths, with hours where there are any: "1:02.345", "1:00:02.345"; in French "1:02,345". */
export function formatTime(seconds: number, language: "en" | "fr" = "en"): string {
  if (!Number.isFinite(seconds)) return "–";
  const all = Math.round(Math.abs(seconds) * 1000);
  const hours = Math.floor(all / 3_600_000), minutes = Math.floor(all / 60_000) % 60;
  const rest = `${pad(Math.floor(all / 1000) % 60, 2)}${language === "fr" ? "," : "."}${pad(all % 1000, 3)}`;
  const sign = seconds < 0 && all > 0 ? "-" : "";
  return sign + (hours > 0 ? `${hours}:${pad(minutes, 2)}:${rest}` : `${minutes}:${rest}`);
}

/** The frame that somebody typed: a whole number is a frame, anything with a colon, point or comma is a time. */
export function parsePlace(text: string, rate: number): number | null {
  const typed = text.trim().replace(",", ".");
  if (/^\d+$/.test(typed)) return Number(typed);
  const parts = /^(?:(?:(\d+):)?(\d+):)?(\d+(?:\.\d*)?|\.\d+)\s*s?$/.exec(typed);
  if (parts === null) return null;
  const seconds = Number(parts[1] ?? 0) * 3600 + Number(parts[2] ?? 0) * 60 + Number(parts[3]);
  return Math.floor(seconds * rate + 1e-6);
}

function pad(value: number, width: number): string {
  return String(value).padStart(width, "0");
}
