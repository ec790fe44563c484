/** Passwords that a lead hands to somebody: long enough to be safe, easy to read out. */

/** Shortest password that is offered to be sent; the server has the last word. */
export const SHORTEST_PASSWORD = 8;

/** Syllables of two letters that read the same in English and French, without i, l, o and y. */
const CONSONANTS = "bdfgkmnprstvz";
const VOWELS = "aeu";

/** Four groups of three syllables: 12 × log2(39) = 63 bits. */
export function proposePassword(random: (count: number) => Uint32Array = drawNumbers): string {
  const numbers = random(12);
  const syllables = Array.from(numbers, (number) => {
    const at = number % (CONSONANTS.length * VOWELS.length);
    return CONSONANTS[Math.floor(at / VOWELS.length)]! + VOWELS[at % VOWELS.length]!;
  });
  return [0, 3, 6, 9].map((from) => syllables.slice(from, from + 3).join("")).join("-");
}

function drawNumbers(count: number): Uint32Array {
  return crypto.getRandomValues(new Uint32Array(count));
}
