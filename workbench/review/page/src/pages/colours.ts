/**
 * Colours of labels that people confuse who see colours otherwise.
 *
 * Colour vision deficiencies as linear maps of linear RGB: G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, "A
 * Physiologically-based Model for Simulation of Color Vision Deficiency", IEEE TVCG 15(6), 2009, severity 1.0.
 * Differences as CIE 1976 ΔE in L*a*b* under D65.
 */

import { type Triple, isHex, toLinear } from "../labels/colours";

export type Vision = "usual" | "protan" | "deutan" | "tritan";

const MAPS: Record<Exclude<Vision, "usual">, [Triple, Triple, Triple]> = {
  protan: [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
  deutan: [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
  tritan: [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
};

/** Differences below this are hard to tell apart on small areas. */
const HARD_TO_TELL = 10;

/** How far two colours look apart for a kind of vision. */
export function differenceOf(first: string, second: string, vision: Vision = "usual"): number {
  const [one, other] = [toLab(see(toLinear(first), vision)), toLab(see(toLinear(second), vision))];
  return Math.hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]);
}

/** Two labels, and for whom they look alike. */
export interface Confusion {
  first: string;
  second: string;
  vision: Vision;
}

/** The pairs of labels that some kind of vision can hardly tell apart, the closest first. */
export function findConfusions(labels: { label: string; colour: string }[]): Confusion[] {
  const found: (Confusion & { difference: number })[] = [];
  const known = labels.filter((one) => isHex(one.colour));
  known.forEach((one, index) => {
    for (const other of known.slice(index + 1)) {
      const seen = (["usual", "protan", "deutan", "tritan"] as const).map((vision) => ({
        vision,
        difference: differenceOf(one.colour, other.colour, vision),
      }));
      const worst = seen.find((each) => each.difference < HARD_TO_TELL);
      if (worst !== undefined) found.push({ first: one.label, second: other.label, ...worst });
    }
  });
  found.sort((a, b) => a.difference - b.difference);
  return found.map(({ first, second, vision }) => ({ first, second, vision }));
}

function see(colour: Triple, vision: Vision): Triple {
  if (vision === "usual") return colour;
  const clip = (value: number): number => Math.min(1, Math.max(0, value));
  const [a, b, c] = MAPS[vision];
  const dot = (row: Triple): number => clip(row[0] * colour[0] + row[1] * colour[1] + row[2] * colour[2]);
  return [dot(a), dot(b), dot(c)];
}

function toLab([red, green, blue]: Triple): Triple {
  const curve = (t: number): number => (t > (6 / 29) ** 3 ? Math.cbrt(t) : t / (3 * (6 / 29) ** 2) + 4 / 29);
  const x = curve((0.4124564 * red + 0.3575761 * green + 0.1804375 * blue) / 0.95047);
  const y = curve(0.2126729 * red + 0.7151522 * green + 0.072175 * blue);
  const z = curve((0.0193339 * red + 0.119192 * green + 0.9503041 * blue) / 1.08883);
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}
