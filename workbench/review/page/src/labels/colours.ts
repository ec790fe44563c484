/** What can be reckoned of colours: mixtures, contrast (WCAG 2.2), and which letters are legible on them. */

export type Triple = [number, number, number];

export function isHex(colour: string): boolean {
  return /^#([0-9a-f]{3}|[0-9a-f]{6})$/i.test(colour);
}

/** Red, green and blue, 0 to 255; grey where the text is no colour. */
export function parseHex(colour: string): Triple {
  if (!isHex(colour)) return [128, 128, 128];
  const digits = colour.length === 4 ? [...colour.slice(1)].map((one) => one + one).join("") : colour.slice(1);
  return [0, 2, 4].map((at) => parseInt(digits.slice(at, at + 2), 16)) as Triple;
}

/** Linear light of red, green and blue, 0 to 1 (sRGB). */
export function toLinear(colour: string): Triple {
  return parseHex(colour).map((value) => {
    const part = value / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  }) as Triple;
}

/** `part` of the first colour and the rest of the second. */
export function mix(first: string, second: string, part: number): string {
  const [one, other] = [parseHex(first), parseHex(second)];
  const hex = one.map(
    (value, index) => Math.round(value * part + other[index]! * (1 - part)).toString(16).padStart(2, "0"),
  );
  return `#${hex.join("")}`;
}

/** Relative luminance, 0 to 1. */
export function luminance(colour: string): number {
  const [red, green, blue] = toLinear(colour);
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

/** Contrast of two colours, 1 to 21. */
export function contrast(first: string, second: string): number {
  const [one, other] = [luminance(first), luminance(second)];
  return (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
}

/** A dark or a light ink: what is the more legible on the worst of some colours. */
export function inkOn(colours: readonly string[]): string {
  const worst = (ink: string) => Math.min(...colours.map((one) => contrast(ink, one)));
  return worst(LIGHT_INK) >= worst(DARK_INK) ? LIGHT_INK : DARK_INK;
}

const LIGHT_INK = "#ffffff";
const DARK_INK = "#14181d";
