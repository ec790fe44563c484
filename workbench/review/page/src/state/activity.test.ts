import { describe, expect, it } from "vitest";
import { ActivityMeter, THINKING } from "./activity";

describe("time of work", () => {
  it("is what lies between things done, as long as nobody went away", () => {
    const meter = new ActivityMeter();
    meter.touch(100);
    meter.touch(110);
    meter.touch(125);
    expect(meter.take(125)).toBe(25);
    expect(meter.take(125)).toBe(0);
  });
  it("ends some time after the last thing done", () => {
    const meter = new ActivityMeter();
    meter.touch(0);
    meter.touch(1000);
    expect(meter.take(5000)).toBe(2 * THINKING);
  });
  it("does not count while the page is hidden", () => {
    const meter = new ActivityMeter();
    meter.touch(0);
    meter.stop(5);
    meter.touch(50);
    expect(meter.take(52)).toBe(7);
  });
  it("never exceeds what a message may say", () => {
    const meter = new ActivityMeter();
    for (let second = 0; second <= 400; second += 10) meter.touch(second);
    expect(meter.take(400)).toBe(120);
  });
});
