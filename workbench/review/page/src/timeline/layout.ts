/** Where everything stands in the timeline, from top to bottom, in CSS pixels. */
import type { Draft, Segment } from "../api/messages";

/** Texts to the left of the rows. */
export const GUTTER = 128;
export const OVERVIEW_HEIGHT = 26;
export const RULER_HEIGHT = 24;

const ACTIVE_HEIGHT = 62;
const OWN_HEIGHT = 24;
const OTHER_HEIGHT = 20;
const CURVE_HEIGHT = 44;
const LEAST_CURVE_HEIGHT = 26;
const MOST_CURVE_HEIGHT = 84;
const GAP = 3;

export interface TierRow {
  /** Unlike any other row's. */
  key: string;
  tier: string;
  /** Null for the person's own tiers. */
  author: string | null;
  madeBy: "person" | "model" | "import" | null;
  isActive: boolean;
  segments: Segment[];
  top: number;
  height: number;
}

export interface CurveRow {
  curve: string;
  top: number;
  height: number;
}

export interface Layout {
  curves: CurveRow[];
  tiers: TierRow[];
  /** Where the rows begin (below the ruler), and what they would need in all. */
  rowsTop: number;
  contentHeight: number;
  /** How far the rows are scrolled, clamped. */
  scroll: number;
}

/**
 * Lay the rows out: curves first, then the person's tiers (the active one tall), then those of others.
 *
 * Curves take what is left over and give way where there is little; when that is not enough, the rows scroll.
 */
export function layOut(
  draft: Draft | null, activeTier: string | null, curves: readonly string[], height: number, scroll: number,
): Layout {
  const rows = listTiers(draft, activeTier);
  const forTiers = rows.reduce((sum, row) => sum + row.height + GAP, 0);
  const rowsTop = OVERVIEW_HEIGHT + RULER_HEIGHT;
  const room = Math.max(0, height - rowsTop);
  const forCurve =
    curves.length === 0
      ? CURVE_HEIGHT
      : Math.min(MOST_CURVE_HEIGHT, Math.max(LEAST_CURVE_HEIGHT, (room - forTiers - GAP) / curves.length - GAP));
  const contentHeight = GAP + curves.length * (forCurve + GAP) + forTiers;
  const clamped = Math.min(Math.max(0, scroll), Math.max(0, contentHeight - room));

  let top = rowsTop + GAP - clamped;
  const placedCurves = curves.map((curve) => {
    const placed = { curve, top, height: forCurve };
    top += forCurve + GAP;
    return placed;
  });
  const placedTiers = rows.map((row) => {
    const placed = { ...row, top };
    top += row.height + GAP;
    return placed;
  });
  return { curves: placedCurves, tiers: placedTiers, rowsTop, contentHeight, scroll: clamped };
}

function listTiers(draft: Draft | null, activeTier: string | null): Omit<TierRow, "top">[] {
  const own = (draft?.tiers ?? []).map((one) => ({
    key: `own ${one.tier}`, tier: one.tier, author: null, madeBy: null, isActive: one.tier === activeTier,
    segments: one.segments, height: one.tier === activeTier ? ACTIVE_HEIGHT : OWN_HEIGHT,
  }));
  const others = (draft?.others ?? []).map((one, index) => ({
    key: `other ${index} ${one.tier}`, tier: one.tier, author: one.author, madeBy: one.made_by, isActive: false,
    segments: one.segments, height: OTHER_HEIGHT,
  }));
  return [...own, ...others];
}

/** How far to scroll so that the active tier is seen whole. */
export function scrollToActive(layout: Layout, height: number): number {
  const row = layout.tiers.find((one) => one.isActive);
  if (row === undefined) return layout.scroll;
  if (row.top < layout.rowsTop) return layout.scroll - (layout.rowsTop - row.top) - GAP;
  const below = row.top + row.height - height;
  return below > 0 ? layout.scroll + below + GAP : layout.scroll;
}
