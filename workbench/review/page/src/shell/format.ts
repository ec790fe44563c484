/** Times and numbers as people read them. */
import { language } from "../words";

/** A frame as m:ss.mmm (h:mm:ss.mmm from an hour on), the decimals as far as the rate gives sense to. */
export function formatTime(frame: number, rate: number): string {
  const milliseconds = Math.round((frame / rate) * 1000);
  const rest = milliseconds % 60_000;
  const minutes = Math.floor(milliseconds / 60_000);
  const seconds = `${String(Math.floor(rest / 1000)).padStart(2, "0")}.${String(rest % 1000).padStart(3, "0")}`;
  if (minutes < 60) return `${minutes}:${seconds}`;
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")}:${seconds}`;
}

/** Seconds as m:ss, for lengths of takes. */
export function formatLength(seconds: number): string {
  const whole = Math.round(seconds);
  const minutes = Math.floor(whole / 60);
  const rest = String(whole % 60).padStart(2, "0");
  if (minutes < 60) return `${minutes}:${rest}`;
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")}:${rest}`;
}

/** A number in the person's language. */
export function formatNumber(value: number, digits = 0): string {
  return new Intl.NumberFormat(language.value, { minimumFractionDigits: digits,
    maximumFractionDigits: digits }).format(value);
}
