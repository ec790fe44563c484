import { describe, expect, it } from "vitest";
import { formatTime, parsePlace } from "./times";

describe("formatTime", () => {
  it.each([
    [0, "0:00.000"], [2.345, "0:02.345"], [59.9996, "1:00.000"], [62.5, "1:02.500"], [3599.9994, "59:59.999"],
    [3602.3, "1:00:02.300"], [-1.5, "-0:01.500"], [-0.0001, "0:00.000"], [NaN, "–"],
  ])("writes %s s as %s", (seconds, text) => expect(formatTime(seconds)).toBe(text));

  it("has a comma in French", () => expect(formatTime(62.5, "fr")).toBe("1:02,500"));
});

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
        expect(parsePlace(formatTime(frame / rate), rate)).toBe(frame);
        expect(parsePlace(formatTime(frame / rate, "fr"), rate)).toBe(frame);
      }
    }
  });
});
