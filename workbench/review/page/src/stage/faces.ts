/** The faces that are on the page, to be read by tests: what is truly drawn, not what was asked for. */

export interface ShownFace {
  readonly take: string;
  readonly solve: string | null;
  readonly rig: string | null;
  /** Whose weights are on the face; -1 while none are. */
  readonly frame: number;
  /** By shape. */
  readonly weights: Record<string, number>;
  /** How many markers are shown. */
  readonly markers: number;
  /** How often it was drawn, and how long the page worked on the last picture, ms. */
  readonly drawn: number;
  readonly milliseconds: number;
}

const shown: ShownFace[] = [];

/** The take's own face first, the one beside it second. */
export const faces: readonly ShownFace[] = shown;

/** Make a face known; returns what forgets it. */
export function addFace(face: ShownFace): () => void {
  shown.push(face);
  return () => {
    const place = shown.indexOf(face);
    if (place >= 0) shown.splice(place, 1);
  };
}
