/** How the page is divided, as the person left it. */
import { session } from "../state/state";

/** Whether a column is folded away. */
export function isFolded(side: "left" | "right"): boolean {
  return session.value?.settings[`${side}Folded`] === true;
}

/** The least and the most that the timeline takes of the centre's height. */
export const SHARES = { least: 0.2, usual: 0.44, most: 0.75 } as const;

/** The part of the centre's height that the timeline takes. */
export function timelineShare(): number {
  const said = session.value?.settings["timelineShare"];
  return typeof said === "number" && Number.isFinite(said) ? clampShare(said) : SHARES.usual;
}

export function clampShare(share: number): number {
  return Math.min(Math.max(share, SHARES.least), SHARES.most);
}
