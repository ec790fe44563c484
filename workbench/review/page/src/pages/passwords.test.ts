import { expect, it } from "vitest";
import { proposePassword } from "./passwords";

it("proposes four groups, another each time, with every syllable in use", () => {
  const all = Array.from({ length: 200 }, () => proposePassword());
  expect(new Set(all).size).toBe(200);
  for (const one of all) expect(one).toMatch(/^([bdfgkmnprstvz][aeu]){3}(-([bdfgkmnprstvz][aeu]){3}){3}$/);
  const syllables = new Set(all.flatMap((one) => one.replaceAll("-", "").match(/../g) ?? []));
  expect(syllables.size).toBe(39);
});
