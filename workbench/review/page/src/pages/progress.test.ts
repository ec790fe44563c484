import { expect, it } from "vitest";
import type { Overview } from "../api/messages";
import { sumUp } from "./progress";

type Work = Overview["takes"][number]["by"][number];
const by = (person: string, segments: number, reviewed: number): Work => ({
  person, mode: "review", segments, reviewed, done: false, unpublished: 0,
});
const person = (name: string, unpublished: number, active_seconds: number): Overview["people"][number] => ({
  person: name, is_lead: false, takes: 1, reviewed: 0, edits: 0, unpublished, active_seconds,
  seconds_per_minute: null, last_active: null,
});

it("counts each take once, by who is furthest", () => {
  const take = { signer: null, protocol: null, seconds: 10 };
  const overview: Overview = {
    people: [person("a", 2, 60), person("b", 1, 30)],
    takes: [
      { take: "1", ...take, by: [by("a", 10, 4), by("b", 12, 6)] },
      { take: "2", ...take, by: [by("a", 5, 0), by("b", 7, 0)] },
      { take: "3", ...take, by: [] },
    ],
    agreement: [],
    to_settle: [
      { take: "1", tier: "t", first: "a", second: "b", disagreements: 5, seconds: 1, settled: 2 },
      { take: "2", tier: "t", first: "a", second: "b", disagreements: 1, seconds: 1, settled: 1 },
    ],
  };
  expect(sumUp(overview)).toEqual({ begun: 1, reviewed: 6, segments: 19, unpublished: 3, active: 90, open: 3 });
});
