/** Which rows of a long list are in sight. */

/** Height of a row in px, as shell.css has it. */
export const ROW = 44;

/** Rows beyond the edges that exist as well, so that scrolling shows no gap. */
const MORE = 4;

/** Return the rows [first, end) that a window of `height` px at `top` px shows, and a few more on either side. */
export function rowsInSight(count: number, top: number, height: number, row = ROW): { first: number; end: number } {
  const first = Math.min(Math.max(0, Math.floor(top / row) - MORE), Math.max(0, count - 1));
  return { first, end: Math.min(count, Math.ceil((top + height) / row) + MORE) };
}
