/** Numbers, times and lengths as people read them, in the language of the page: French has a comma, in times too. */
import { type WordKey, language, say } from ".";

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

const formats = new Map<string, Intl.NumberFormat>();

/** A number with at most `digits` behind the point, and at least `least`; a dash where nothing is known. */
export function formatNumber(value: number | null, digits = 0, least = 0): string {
  if (value === null || !Number.isFinite(value)) return NOTHING;
  const key = `${language.value} ${digits} ${least}`;
  let format = formats.get(key);
  if (format === undefined) {
    format = new Intl.NumberFormat(language.value, { minimumFractionDigits: least, maximumFractionDigits: digits });
    formats.set(key, format);
  }
  return format.format(value);
}

/** A number with exactly `digits` behind the point. */
export function formatFixed(value: number | null, digits: number): string {
  return formatNumber(value, digits, digits);
}

/** A part of one, as whole percent; what is not all of it never rounds up to 100. */
export function formatPercent(part: number | null): string {
  if (part === null || !Number.isFinite(part)) return NOTHING;
  const percent = Math.round(part * 100);
  const shown = part < 1 && percent === 100 ? 99 : part > 0 && percent === 0 ? 1 : percent;
  return `${shown} %`;
}

/** A place in a take: 1:02.345, in an hour 1:00:02.345; with fewer digits it is cut, not rounded to a later time. */
export function formatTime(frame: number, rate: number, digits = 3): string {
  const seconds = frame / rate;
  if (!Number.isFinite(seconds)) return NOTHING;
  const scale = 10 ** digits;
  const counted = Math.max(0, seconds) * scale;
  // A little more, so that 0.3 s at 10 Hz is not written as 0.2 s for a rounding error.
  const whole = digits >= 3 ? Math.round(counted) : Math.floor(counted + 1e-6);
  const fraction = digits > 0 ? (language.value === "fr" ? "," : ".") + pad(whole % scale, digits) : "";
  return writeClock(Math.floor(whole / scale)) + fraction;
}

/** Seconds as m:ss, for lengths of takes. */
export function formatMinutes(seconds: number): string {
  return writeClock(Math.round(seconds));
}

/** A length of frames: 450 ms, 1.25 s. */
export function formatLength(frames: number, rate: number): string {
  const seconds = frames / rate;
  if (!Number.isFinite(seconds)) return NOTHING;
  return seconds < 1 ? `${Math.round(seconds * 1000)} ms` : `${formatFixed(seconds, 2)} s`;
}

/** A longer time: 45 s, 12 min, 3 h 05 min. */
export function formatDuration(seconds: number | null): string {
  if (seconds === null || !Number.isFinite(seconds)) return NOTHING;
  if (seconds < 60) return `${Math.round(seconds)} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${pad(minutes % 60, 2)} min`;
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

/** Whole seconds as m:ss, h:mm:ss from an hour on. */
function writeClock(seconds: number): string {
  const minutes = Math.floor(seconds / 60);
  const rest = pad(seconds % 60, 2);
  return minutes < 60 ? `${minutes}:${rest}` : `${Math.floor(minutes / 60)}:${pad(minutes % 60, 2)}:${rest}`;
}

function pad(value: number, width: number): string {
  return String(value).padStart(width, "0");
}
