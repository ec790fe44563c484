import { describe, expect, it } from "vitest";
import { sameMoment } from "./takes";

describe("sameMoment", () => {
  it("goes by time where the rates differ, and stays in the take", () => {
    expect(sameMoment(400, 200, { rate: 60, frames: 1000 })).toBe(120);
    expect(sameMoment(3, 60, { rate: 200, frames: 1000 })).toBe(10);
    expect(sameMoment(123, 200, { rate: 200, frames: 1000 })).toBe(123);
    expect(sameMoment(123, 200, { rate: 200, frames: 50 })).toBe(49);
    expect(sameMoment(123, 200, { rate: 200, frames: 0 })).toBe(0);
  });
});
