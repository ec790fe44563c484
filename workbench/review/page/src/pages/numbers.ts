/** Numbers, durations and times as a person reads them, in the language of the page. */
import { type WordKey, language, say } from "../words";

const NOTHING = "–";

/** Say a text for one or for many: the keys `<key>.one` and `<key>.many`, with {count}. French counts 0 as one. */
export function sayCount<K extends string>(
  key: `${K}.one` extends WordKey ? (`${K}.many` extends WordKey ? K : never) : never,
  count: number,
  values: Record<string, string | number> = {},
): string {
  const isOne = language.value === "fr" ? Math.abs(count) < 2 : count === 1;
  return say(`${key as string}.${isOne ? "one" : "many"}` as WordKey, { count: formatNumber(count), ...values });
}

/** A number with at most `digits` behind the point; a dash where nothing is known. */
export function formatNumber(value: number | null, digits = 0): string {
  if (value === null || !Number.isFinite(value)) return NOTHING;
  return value.toLocaleString(language.value, { maximumFractionDigits: digits });
}

/** A score with exactly two digits. */
export function formatScore(value: number | null): string {
  if (value === null || !Number.isFinite(value)) return NOTHING;
  return value.toLocaleString(language.value, { minimumFractionDigits: 2, maximumFractionDigits: 2 });
}

/** A part of one, as whole percent; what is not all of it never rounds up to 100. */
export function formatPercent(part: number | null): string {
  if (part === null || !Number.isFinite(part)) return NOTHING;
  const percent = Math.round(part * 100);
  const shown = part < 1 && percent === 100 ? 99 : part > 0 && percent === 0 ? 1 : percent;
  return `${shown} %`;
}

/** A place in a take: 1:02.345. */
export function formatTime(frame: number, rate: number): string {
  const milliseconds = Math.round((frame / rate) * 1000);
  if (!Number.isFinite(milliseconds)) return NOTHING;
  const whole = Math.floor(milliseconds / 1000);
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor(whole / 60) % 60;
  const two = (value: number): string => String(value).padStart(2, "0");
  const rest = `${two(whole % 60)}.${String(milliseconds % 1000).padStart(3, "0")}`;
  return hours > 0 ? `${hours}:${two(minutes)}:${rest}` : `${minutes}:${rest}`;
}

/** A length of frames: 450 ms, 1.25 s. */
export function formatLength(frames: number, rate: number): string {
  const seconds = frames / rate;
  if (!Number.isFinite(seconds)) return NOTHING;
  return seconds < 1 ? `${Math.round(seconds * 1000)} ms` : `${formatNumber(seconds, 2)} s`;
}

/** A longer time: 45 s, 12 min, 3 h 05 min. */
export function formatDuration(seconds: number | null): string {
  if (seconds === null || !Number.isFinite(seconds)) return NOTHING;
  if (seconds < 60) return `${Math.round(seconds)} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, "0")} min`;
}

/** How long ago something was; a time in the future (a clock that was set) counts as now. */
export function formatAgo(when: string | null, now: number): string {
  const then = when === null ? NaN : Date.parse(when);
  if (Number.isNaN(then)) return NOTHING;
  const minutes = Math.max(0, (now - then) / 60_000);
  const relative = new Intl.RelativeTimeFormat(language.value, { numeric: "auto" });
  if (minutes < 1) return say("overview.now");
  if (minutes < 60) return relative.format(-Math.floor(minutes), "minute");
  if (minutes < 24 * 60) return relative.format(-Math.floor(minutes / 60), "hour");
  return relative.format(-Math.floor(minutes / 60 / 24), "day");
}
