import { effect } from "@preact/signals";
import { describe, expect, it } from "vitest";
import { Clock, LONGEST_GAP, SPEEDS } from "./clock";

/** A browser whose pictures come when the test says. */
function makeClock(rate = 200, frames = 2000) {
  const browser = { now: 5000, waiting: [] as ((now: number) => void)[] };
  const clock = new Clock({
    now: () => browser.now,
    request: (callback) => browser.waiting.push(callback),
  });
  clock.open(rate, frames);
  const pass = (ms: number) => {
    browser.now += ms;
    for (const callback of browser.waiting.splice(0)) callback(browser.now);
  };
  return { clock, browser, pass };
}

describe("playing", () => {
  it("keeps time however few pictures there are", () => {
    for (const between of [4, 16.667, 33, 333]) {
      const { clock, pass } = makeClock();
      clock.play();
      for (let time = between; time <= 5000; time += between) {
        pass(between);
        expect(Math.abs(clock.frame.value - Math.floor((time / 1000) * 200))).toBeLessThanOrEqual(1);
      }
    }
  });

  it.each([...SPEEDS])("plays at %s times the speed", (speed) => {
    const { clock, pass } = makeClock(120, 100_000);
    clock.setSpeed(speed);
    clock.play();
    for (let i = 0; i < 100; i++) pass(20);
    expect(clock.frame.value).toBe(Math.floor(2 * 120 * speed));
  });

  it("counts what was played before a change of speed at the old speed", () => {
    const { clock, pass } = makeClock();
    clock.play();
    pass(500);
    clock.setSpeed(4);
    pass(500);
    clock.setSpeed(0.25);
    pass(400);
    expect(clock.frame.value).toBe(100 + 400 + 20);
  });

  it("does not drift over an hour of odd pictures", () => {
    const { clock, pass } = makeClock(200, 1_000_000);
    clock.play();
    let time = 0;
    for (let i = 0; time < 3_600_000; i++) {
      const gap = 7 + ((i * 7919) % 40) + 1 / 3;
      time += gap;
      pass(gap);
    }
    expect(Math.abs(clock.frame.value - Math.floor(time * 0.2))).toBeLessThanOrEqual(1);
  });

  it("stops at the last frame and starts again from the first", () => {
    const { clock, pass } = makeClock(200, 100);
    clock.seek(90);
    clock.play();
    pass(40);
    expect(clock.playing.value).toBe(true);
    pass(40);
    expect(clock.frame.value).toBe(99);
    expect(clock.playing.value).toBe(false);
    clock.play();
    expect(clock.frame.value).toBe(0);
  });

  it("asks for one picture at a time, and for none when it rests", () => {
    const { clock, browser, pass } = makeClock();
    clock.play();
    clock.pause();
    clock.play();
    expect(browser.waiting).toHaveLength(1);
    pass(16);
    expect(browser.waiting).toHaveLength(1);
    clock.pause();
    pass(16);
    expect(browser.waiting).toHaveLength(0);
  });

  it("changes the frame at most once per picture", () => {
    const { clock, pass } = makeClock();
    let changes = -1;
    const stop = effect(() => {
      void clock.frame.value;
      changes += 1;
    });
    clock.play();
    for (let i = 0; i < 50; i++) pass(16);
    stop();
    expect(changes).toBe(50);
  });
});

describe("odd times", () => {
  it("does not skip what was played to nobody", () => {
    const { clock, pass } = makeClock(200, 1_000_000);
    clock.play();
    pass(100);
    pass(3_600_000);
    expect(clock.frame.value).toBe(20 + LONGEST_GAP / 5);
    pass(100);
    expect(clock.frame.value).toBe(40 + LONGEST_GAP / 5);
  });

  it("never goes back where a picture's time stamp does", () => {
    const { clock, browser } = makeClock();
    clock.play();
    clock.tick(browser.now + 100);
    clock.tick(browser.now + 50);
    clock.tick(browser.now - 1000);
    expect(clock.frame.value).toBe(20);
    clock.tick(browser.now + 150);
    expect(clock.frame.value).toBe(30);
  });

  it("takes odd frames for the nearest there is", () => {
    const { clock } = makeClock(200, 10);
    for (const [asked, shown] of [[-5, 0], [99, 9], [3.7, 3], [NaN, 0], [Infinity, 9], [-Infinity, 0]] as const) {
      clock.seek(asked);
      expect(clock.frame.value).toBe(shown);
    }
    expect(() => clock.open(0, 10)).toThrow("rate");
    clock.open(60, 0);
    expect(clock.frames).toBe(1);
  });

  it("shows whole frames where seconds cannot be written exactly", () => {
    const { clock, browser } = makeClock(200, 1000);
    clock.play();
    for (let frame = 1; frame < 1000; frame++) {
      clock.tick(browser.now + frame * 5);
      expect(clock.frame.value).toBe(frame);
    }
  });
});

describe("loop", () => {
  it("shows every frame of the stretch and none beside it", () => {
    const { clock, pass } = makeClock();
    clock.setLoop({ onset: 50, offset: 60 });
    clock.play();
    const seen = new Set<number>([clock.frame.value]);
    for (let i = 0; i < 100; i++) {
      pass(4);
      seen.add(clock.frame.value);
    }
    expect([...seen].sort((a, b) => a - b)).toEqual([50, 51, 52, 53, 54, 55, 56, 57, 58, 59]);
  });

  it("keeps time over rounds", () => {
    const { clock, pass } = makeClock();
    clock.setLoop({ onset: 100, offset: 137 });
    clock.play();
    for (let i = 1; i <= 500; i++) {
      pass(16.5);
      expect(Math.abs(clock.frame.value - (100 + (Math.floor(i * 3.3 + 1e-6) % 37)))).toBeLessThanOrEqual(1);
    }
  });

  it("plays up to it from before, and goes to its start from behind", () => {
    const { clock, pass } = makeClock();
    clock.setLoop({ onset: 50, offset: 60 });
    clock.play();
    clock.seek(10);
    pass(100);
    expect(clock.frame.value).toBe(30);
    clock.seek(500);
    pass(10);
    expect(clock.frame.value).toBe(50);
  });

  it("lies within the take and holds at least a frame", () => {
    const { clock, pass } = makeClock(200, 100);
    clock.setLoop({ onset: 98, offset: 500 });
    expect(clock.loop.value).toEqual({ onset: 98, offset: 100 });
    clock.setLoop({ onset: 30, offset: 30 });
    expect(clock.loop.value).toEqual({ onset: 30, offset: 31 });
    clock.play();
    pass(300);
    expect(clock.frame.value).toBe(30);
    clock.setLoop(null);
    pass(50);
    expect(clock.frame.value).toBeGreaterThan(35);
  });
});

describe("moving by hand", () => {
  it("steps stop, seeks go on", () => {
    const { clock, pass } = makeClock();
    clock.play();
    pass(100);
    clock.seek(1000);
    pass(100);
    expect(clock.frame.value).toBe(1020);
    clock.step(-1);
    pass(100);
    expect(clock.frame.value).toBe(1019);
    expect(clock.playing.value).toBe(false);
  });

  it("says when it jumps, so that a video follows", () => {
    const { clock, pass } = makeClock();
    const before = clock.jumps.value;
    clock.play();
    pass(50);
    expect(clock.jumps.value).toBe(before);
    clock.seek(3);
    expect(clock.jumps.value).toBe(before + 1);
  });

  it("goes through the speeds", () => {
    const { clock } = makeClock();
    clock.setSpeed(0.1);
    const up = [clock.speed.value];
    for (let i = 0; i < 5; i++) {
      clock.faster();
      up.push(clock.speed.value);
    }
    expect(up).toEqual([0.25, 0.5, 1, 2, 4, 4]);
    for (let i = 0; i < 6; i++) clock.slower();
    expect(clock.speed.value).toBe(0.25);
  });
});
