import { beforeEach, describe, expect, it } from "vitest";
import { language } from ".";
import {
  formatAgo, formatDuration, formatFixed, formatLength, formatMinutes, formatNumber, formatPercent, formatTime,
  sayCount,
} from "./numbers";

beforeEach(() => {
  language.value = "en";
});

describe("numbers", () => {
  it("writes times and lengths", () => {
    expect(formatTime(0, 200)).toBe("0:00.000");
    expect(formatTime(12_469, 200)).toBe("1:02.345");
    expect(formatTime(720_000, 200)).toBe("1:00:00.000");
    expect(formatTime(1, 0)).toBe("–");
    // Rounding carries over: never "0:60.000" or "0:59.1000".
    expect(formatTime(59.9996, 1)).toBe("1:00.000");
    expect(formatTime(12_500, 200, 0)).toBe("1:02");
    expect(formatTime(720_500, 200, 1)).toBe("1:00:02.5");
    expect([formatMinutes(59.6), formatMinutes(3725)]).toEqual(["1:00", "1:02:05"]);
    expect(formatLength(90, 200)).toBe("450 ms");
    expect(formatLength(250, 200)).toBe("1.25 s");
    expect([45, 720, 11_100, null].map(formatDuration)).toEqual(["45 s", "12 min", "3 h 05 min", "–"]);
  });

  it("cuts a short time instead of rounding it to a later one", () => {
    expect(formatTime(199, 200, 0)).toBe("0:00");
    for (let frame = 0; frame < 100; frame += 1) {
      expect(formatTime(frame, 10, 1)).toBe(`0:0${Math.floor(frame / 10)}.${frame % 10}`);
    }
  });

  it("never calls nearly all of it all", () => {
    expect([1, 0.999, 0.001, 0, null].map(formatPercent)).toEqual(["100 %", "99 %", "1 %", "0 %", "–"]);
    expect(formatFixed(0.5, 2)).toBe("0.50");
    expect(formatFixed(NaN, 2)).toBe("–");
  });

  it("follows the language", () => {
    expect(formatNumber(1234.5, 1)).toBe("1,234.5");
    expect(sayCount("publish.changes", 1)).toBe("1 change");
    expect(sayCount("publish.changes", 0)).toBe("0 changes");
    language.value = "fr";
    expect(formatFixed(0.5, 2)).toBe("0,50");
    expect(formatNumber(1.25, 2)).toBe("1,25");
    expect(formatTime(12_469, 200)).toBe("1:02,345");
    expect(sayCount("publish.changes", 0)).toBe("0 modification");
  });

  it("says how long ago, and nothing of the future", () => {
    const now = Date.parse("2026-01-02T12:00:00Z");
    expect(formatAgo("2026-01-02T11:15:00Z", now)).toBe("45 minutes ago");
    expect(formatAgo("2026-01-01T11:00:00Z", now)).toBe("yesterday");
    expect(formatAgo("2026-01-02T13:00:00Z", now)).toBe("just now");
    expect(formatAgo("nonsense", now)).toBe("–");
  });
});
