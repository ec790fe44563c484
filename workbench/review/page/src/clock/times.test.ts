import { describe, expect, it } from "vitest";
import { language } from "../words";
import { formatTime } from "../words/numbers";
import { parsePlace } from "./times";

describe("parsePlace", () => {
  it.each([
    ["120", 120], [" 7 ", 7], ["0:01.5", 300], ["1.5", 300], ["1,5", 300], ["1:00:00", 720_000],
    [".5s", 100], ["2s", 400],
    ["", null], ["abc", null], ["1:2:3:4", null], ["-3", null], ["1.2.3", null],
  ])("reads %j as frame %s", (text, frame) => expect(parsePlace(text, 200)).toBe(frame));

  it("reads back every frame that was written as a time", () => {
    // Thousandths tell frames of up to 1000 Hz apart, where a frame is a whole number of them.
    for (const rate of [100, 200, 250, 500]) {
      for (let frame = 0; frame < 5000; frame += 7) {
        for (const spoken of ["en", "fr"] as const) {
          language.value = spoken;
          expect(parsePlace(formatTime(frame, rate), rate)).toBe(frame);
        }
      }
    }
  });
});
