import { describe, expect, it } from "vitest";
import { type ClockState, followClock, type VideoState } from "./video_sync";

const clock: ClockState = { seconds: 2, playing: true, speed: 1, jumped: false };
const video: VideoState = { current: 2, duration: 60, rate: 50, seeking: false, sinceSeek: 5000, seekTook: 0.04 };

describe("a video that follows the clock", () => {
  it("is left alone while it is in step", () => {
    for (const off of [-0.019, 0, 0.019]) {
      expect(followClock(clock, { ...video, current: 2 + off })).toEqual({ play: true, seek: null, hasPicture: true });
    }
  });

  it("is put right when it is off by more than a picture, a little ahead of the clock", () => {
    expect(followClock(clock, { ...video, current: 1.9 }).seek).toBeCloseTo(2.04);
    expect(followClock({ ...clock, speed: 4 }, { ...video, current: 1.9 }).seek).toBeCloseTo(2.16);
    expect(followClock(clock, { ...video, current: 1.97, rate: null }).seek).toBeNull();
    expect(followClock(clock, { ...video, current: 1.95, rate: null }).seek).toBeCloseTo(2.04);
  });

  it("is not put right all the time, but at once after a jump", () => {
    const late = { ...video, current: 1.5, sinceSeek: 100 };
    expect(followClock(clock, late).seek).toBeNull();
    expect(followClock({ ...clock, jumped: true }, late).seek).toBeCloseTo(2.04);
    expect(followClock({ ...clock, jumped: true }, { ...late, seeking: true }).seek).toBeNull();
  });

  it("shows at rest the middle of the picture of each frame, and stays there", () => {
    for (let frame = 0; frame < 400; frame++) {
      const seconds = frame / 200;
      const seek = followClock({ ...clock, seconds, playing: false }, { ...video, current: 30 }).seek!;
      expect(Math.floor(seek * 50)).toBe(Math.floor(frame / 4));
      expect(followClock({ ...clock, seconds, playing: false }, { ...video, current: seek }).seek).toBeNull();
    }
  });

  it("has no picture before its beginning and after its end", () => {
    for (const seconds of [-0.5, 60, 70]) {
      expect(followClock({ ...clock, seconds }, video)).toEqual({ play: false, seek: null, hasPicture: false });
    }
    expect(followClock({ ...clock, seconds: 70, playing: false }, { ...video, duration: NaN }).hasPicture).toBe(true);
  });
});

describe("played for a minute", () => {
  // A video that starts late, runs 1 % slow and takes 80 ms to seek: simulated ms by ms.
  it("stays within two pictures whenever it does not seek, with few seeks", () => {
    let current = 0, seekingUntil = -1, asked = -1e9, seeks = 0, off = 0;
    for (let time = 0; time < 60_000; time += 16) {
      const seconds = time / 1000;
      if (seekingUntil >= 0 && time >= seekingUntil) seekingUntil = -1;
      const seeking = seekingUntil >= 0;
      if (!seeking && time > 500) current += 0.016 * 0.99;
      const step = followClock(
        { seconds, playing: true, speed: 1, jumped: false },
        { current, duration: 120, rate: 25, seeking, sinceSeek: time - asked, seekTook: 0.08 },
      );
      if (step.seek !== null) {
        current = step.seek;
        seekingUntil = time + 80;
        asked = time;
        seeks += 1;
      }
      if (time > 2000 && seekingUntil < 0 && Math.abs(current - seconds) > 0.08) off += 1;
    }
    expect(seeks).toBeLessThan(30);
    expect(off).toBe(0);
  });
});
