import { describe, expect, it } from "vitest";
import { chooseTicks, formatTime } from "./ruler";

describe("chooseTicks", () => {
  it("keeps texts apart at every zoom", () => {
    for (let span = 8; span < 2_000_000; span *= 1.7) {
      const ticks = chooseTicks({ first: 0, last: span }, 1000, 200);
      const pixels = (ticks.major / span) * 1000;
      expect(pixels).toBeGreaterThanOrEqual(84 - 1e-9);
    }
  });
  it("says whole seconds where it can", () => {
    expect(chooseTicks({ first: 0, last: 2000 }, 1000, 200)).toEqual({ major: 200, parts: 5, digits: 0 });
    expect(chooseTicks({ first: 0, last: 720_000 }, 1000, 200).major).toBe(600 * 200);
  });
});

describe("formatTime", () => {
  it("writes minutes, hours and parts of a second", () => {
    expect(formatTime(0, 200, 0)).toBe("0:00");
    expect(formatTime(12_500, 200, 3)).toBe("1:02.500");
    expect(formatTime(720_500, 200, 1)).toBe("1:00:02.5");
    expect(formatTime(720_500, 200, 1, true)).toBe("1:00:02,5");
  });
  it("neither rounds up to a later time nor loses one to rounding", () => {
    expect(formatTime(199, 200, 0)).toBe("0:00");
    for (let frame = 0; frame < 100; frame += 1) expect(formatTime(frame, 10, 1)).toBe(
      `0:0${Math.floor(frame / 10)}.${frame % 10}`
    );
  });
});
