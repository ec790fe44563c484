/** The colours of the canvas: the page's CSS variables, and what is mixed from a label's colour. */

export interface Theme {
  /** Behind everything, and of a row. */
  background: string;
  surface: string;
  text: string;
  muted: string;
  line: string;
  grid: string;
  accent: string;
  warning: string;
  playhead: string;
  /** Of the curves, one after the other. */
  curves: string[];
  isDark: boolean;
  font: string;
}

/** CSS variables of style/variables.css, with what stands for them where they are not set. */
const NAMES = {
  background: ["--panel", "#f3f4f5"],
  surface: ["--raised", "#ffffff"],
  text: ["--ink", "#1c2126"],
  muted: ["--ink-soft", "#545d66"],
  line: ["--line", "#d2d6da"],
  grid: ["--grid", "#dde0e3"],
  accent: ["--accent", "#1f5f99"],
  warning: ["--residual", "#b3541e"],
  playhead: ["--playhead", "#c2255c"],
} as const;
const CURVES = ["#2b6ca3", "#b3541e", "#52781b", "#8a4b94"];

/** Read the theme that an element is shown in. */
export function readTheme(element: Element): Theme {
  const style = getComputedStyle(element);
  const read = (name: string, usual: string) => {
    const value = style.getPropertyValue(name).trim();
    return isHex(value) ? value : usual;
  };
  const named = Object.fromEntries(
    Object.entries(NAMES).map(([key, [name, usual]]) => [key, read(name, usual)]),
  ) as Record<keyof typeof NAMES, string>;
  return {
    ...named,
    curves: CURVES.map((usual, index) => read(`--curve-${index + 1}`, usual)),
    isDark: luminance(named.background) < 0.2,
    font: style.fontFamily || "sans-serif",
  };
}

export function isHex(colour: string): boolean {
  return /^#([0-9a-f]{3}|[0-9a-f]{6})$/i.test(colour);
}

/** Red, green and blue, 0 to 255; grey where the text is no colour. */
export function parseHex(colour: string): [number, number, number] {
  if (!isHex(colour)) return [128, 128, 128];
  const digits = colour.length === 4 ? [...colour.slice(1)].map((one) => one + one).join("") : colour.slice(1);
  return [0, 2, 4].map((at) => parseInt(digits.slice(at, at + 2), 16)) as [number, number, number];
}

/** `part` of the first colour and the rest of the second. */
export function mix(first: string, second: string, part: number): string {
  const [one, other] = [parseHex(first), parseHex(second)];
  const hex = one.map(
    (value, index) => Math.round(value * part + other[index]! * (1 - part)).toString(16).padStart(2, "0")
  );
  return `#${hex.join("")}`;
}

/** Relative luminance, 0 to 1 (WCAG 2.2). */
export function luminance(colour: string): number {
  const [red, green, blue] = parseHex(colour).map((value) => {
    const part = value / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  }) as [number, number, number];
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

/** Contrast of two colours, 1 to 21 (WCAG 2.2). */
export function contrast(first: string, second: string): number {
  const [one, other] = [luminance(first), luminance(second)];
  return (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
}

/** What is drawn for a label. */
export interface LabelColours {
  solid: string;
  onSolid: string;
  /** Proposed: a light fill, its stripes, its text. */
  tint: string;
  stripe: string;
  onTint: string;
  edge: string;
}

/** Mix the colours of a label for a theme; texts have a contrast of at least 4.5. */
export function mixLabel(colour: string, theme: Theme): LabelColours {
  const base = isHex(colour) ? colour : theme.muted;
  const tint = mix(base, theme.surface, theme.isDark ? 0.2 : 0.14);
  const stripe = mix(base, theme.surface, theme.isDark ? 0.36 : 0.34);
  const onTint = [0.35, 0.6, 0.8, 1]
    .map((part) => mix(theme.text, base, part))
    .find((one) => contrast(one, tint) >= 4.5 && contrast(one, stripe) >= 3);
  return {
    solid: base,
    onSolid: contrast("#ffffff", base) >= contrast("#14181d", base) ? "#ffffff" : "#14181d",
    tint,
    stripe,
    onTint: onTint ?? theme.text,
    edge: contrast(base, theme.surface) >= 2 ? base : mix(base, theme.text, 0.55),
  };
}
