/** Texts that fit: measured once, cut with an ellipsis. */

const MOST_KEPT = 4000;
const widths = new Map<string, number>();

/** The width of a text in the context's font. */
export function measure(context: CanvasRenderingContext2D, text: string): number {
  const key = `${context.font}\n${text}`;
  let width = widths.get(key);
  if (width === undefined) {
    width = context.measureText(text).width;
    if (widths.size >= MOST_KEPT) widths.clear();
    widths.set(key, width);
  }
  return width;
}

/**
 * The text, or as much of its beginning as fits with an ellipsis.
 *
 * Where that leaves a single letter, as many letters as fit stand alone: "sad" says more than "s…". "" where not even
 * two do.
 */
export function elide(text: string, room: number, width: (text: string) => number): string {
  if (width(text) <= room) return text;
  const letters = [...text];
  const cut = (end: string) => {
    let low = 0;
    let high = letters.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (width(letters.slice(0, middle).join("") + end) <= room) low = middle;
      else high = middle - 1;
    }
    return low;
  };
  const count = cut("…");
  if (count >= 2) return `${letters.slice(0, count).join("").trimEnd()}…`;
  const bare = cut("");
  return bare >= 2 ? letters.slice(0, bare).join("").trimEnd() : "";
}
