/** The colours of the canvas: the page's CSS variables, and what is mixed from a label's colours. */
import { contrast, inkOn, isHex, luminance, mix } from "../labels/colours";

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

/** What is drawn for a label; of a transition it is where that leads from, and `to` where it leads. */
export interface LabelColours {
  solid: string;
  onSolid: string;
  /** Proposed: a light fill, its stripes, its text. */
  tint: string;
  stripe: string;
  onTint: string;
  edge: string;
  to: { solid: string; stripe: string; edge: string } | null;
}

/** Mix the colours of a label (two of a transition) for a theme; texts have a contrast of at least 4.5 on its tint. */
export function mixLabel(colours: readonly string[], theme: Theme): LabelColours {
  const [from, to] = colours.map((one) => mixOne(isHex(one) ? one : theme.muted, theme));
  if (from === undefined) return mixLabel([theme.muted], theme);
  const parts = to === undefined ? [from] : [from, to];
  const fills = [from.tint, parts.at(-1)!.stripe];
  const isLegible = (ink: string) => contrast(ink, fills[0]!) >= 4.5 && contrast(ink, fills[1]!) >= 4;
  const onTint = [0.5, 0.65, 0.8].map((part) => mix(theme.text, parts.at(-1)!.solid, part)).find(isLegible);
  return {
    ...from, stripe: fills[1]!, onSolid: inkOn(parts.map((one) => one.solid)), onTint: onTint ?? theme.text,
    to: to === undefined ? null : { solid: to.solid, stripe: to.stripe, edge: to.edge },
  };
}

function mixOne(solid: string, theme: Theme) {
  return {
    solid,
    tint: mix(solid, theme.surface, theme.isDark ? 0.2 : 0.13),
    stripe: mix(solid, theme.surface, theme.isDark ? 0.32 : 0.25),
    edge: contrast(solid, theme.surface) >= 2 ? solid : mix(solid, theme.text, 0.55),
  };
}
