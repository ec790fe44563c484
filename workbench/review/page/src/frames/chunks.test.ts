import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { ChunkedFrames } from "./chunks";

interface Asked {
  first: number;
  count: number;
  stop: AbortSignal;
  answer: () => void;
  fail: (why: string) => void;
}

/** A server that answers when the test says; the numbers of frame f are f, f + 0.5. */
function makeServer(frames: number, options: { chunk?: number; keptBytes?: number } = {}) {
  const asked: Asked[] = [];
  const source = new ChunkedFrames({
    frames,
    width: 2,
    chunk: options.chunk ?? 10,
    ...(options.keptBytes === undefined ? {} : { keptBytes: options.keptBytes }),
    load: (first, count, stop) =>
      new Promise((resolve, reject) => {
        const values = Float32Array.from({ length: count * 2 }, (_, i) => first + Math.floor(i / 2) + (i % 2) / 2);
        asked.push({ first, count, stop, answer: () => resolve(values), fail: (why) => reject(new Error(why)) });
      }),
  });
  /** Answer all that was asked and not stopped, until nothing more is asked. */
  const settle = async () => {
    for (;;) {
      const open = asked.splice(0);
      if (open.length === 0) return;
      for (const one of open) if (!one.stop.aborted) one.answer();
      await flush();
    }
  };
  return { source, asked, settle };
}

const flush = async () => {
  for (let i = 0; i < 8; i++) await Promise.resolve();
};

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

describe("what is shown", () => {
  it("gives each frame its own numbers, over every border", async () => {
    const { source, settle } = makeServer(37);
    for (let frame = 0; frame < 37; frame++) {
      source.want(frame);
      await settle();
      expect(source.at(frame)).toEqual({ frame, values: Float32Array.of(frame, frame + 0.5) });
    }
  });

  it("shows the nearest frame that is known until the right one comes", async () => {
    const { source, asked, settle } = makeServer(1000);
    expect(source.at(5)).toBeNull();
    source.want(45);
    asked[0]!.answer();
    await flush();
    expect(source.at(45)?.frame).toBe(45);
    expect(source.at(12)?.frame).toBe(40);
    expect(source.at(900)?.frame).toBe(49);
    const before = source.version.value;
    source.want(900);
    await settle();
    expect(source.version.value).toBeGreaterThan(before);
    expect(source.at(900)?.frame).toBe(900);
  });

  it("takes frames beyond the take for its first and last", async () => {
    const { source, settle } = makeServer(25);
    source.want(99);
    await settle();
    expect(source.at(99)?.values[0]).toBe(24);
    expect(source.at(-3)?.values[0]).toBe(10);
    source.want(-3);
    await settle();
    expect(source.at(-3)?.values[0]).toBe(0);
  });

  it("asks for no more frames than there are", () => {
    const { source, asked } = makeServer(25);
    source.want(24);
    expect(asked[0]).toMatchObject({ first: 20, count: 5 });
  });
});

describe("what is fetched", () => {
  it("asks for what is looked at first, then for what comes next", async () => {
    const { source, asked } = makeServer(1000);
    source.want(42, 10);
    expect(asked.map((one) => one.first)).toEqual([40, 50]);
    asked[0]!.answer();
    await flush();
    expect(asked.map((one) => one.first)).toEqual([40, 50, 60]);
    asked[1]!.answer();
    asked[2]!.answer();
    await flush();
    expect(asked.map((one) => one.first)).toEqual([40, 50, 60, 70]);
    asked[3]!.answer();
    await flush();
    expect(asked).toHaveLength(4);
  });

  it("asks at rest for both neighbours, the nearer first", async () => {
    for (const [frame, order] of [[42, [40, 30, 50]], [48, [40, 50, 30]]] as const) {
      const { source, asked } = makeServer(1000);
      source.want(frame);
      asked[0]!.answer();
      await flush();
      expect(asked.map((one) => one.first)).toEqual(order);
    }
  });

  it("stops what nobody looks at any more", () => {
    const { source, asked } = makeServer(10_000);
    source.want(0, 10);
    for (let frame = 1000; frame < 9000; frame += 1000) source.want(frame, 10);
    expect(asked.filter((one) => !one.stop.aborted).map((one) => one.first)).toEqual([8000, 8010]);
    expect(source.counts.coming).toBe(2);
  });

  it("asks for nothing twice", async () => {
    const { source, asked, settle } = makeServer(100);
    for (let i = 0; i < 5; i++) source.want(5);
    expect(asked).toHaveLength(2);
    await settle();
    source.want(5);
    expect(asked).toHaveLength(0);
  });

  it("keeps a bounded amount, and what was looked at last", async () => {
    // 10 frames of 2 numbers are 80 bytes.
    const { source, settle } = makeServer(100_000, { keptBytes: 8 * 80 });
    for (let frame = 0; frame < 2000; frame += 10) {
      source.want(frame);
      await settle();
      expect(source.counts.kept).toBeLessThanOrEqual(8);
      expect(source.at(frame)?.frame).toBe(frame);
    }
    expect(source.at(1955)?.frame).toBe(1955);
    expect(source.at(0)?.frame).not.toBe(0);
  });
});

describe("a server that does not answer", () => {
  it("is asked again, ever less often, and the reason is said", async () => {
    const { source, asked, settle } = makeServer(10);
    source.want(3);
    asked.splice(0).forEach((one) => one.fail("no answer"));
    await flush();
    expect(source.failure.value).toBe("no answer");
    expect(asked).toHaveLength(0);
    await vi.advanceTimersByTimeAsync(500);
    expect(asked).toHaveLength(1);
    asked.splice(0).forEach((one) => one.fail("no answer"));
    await flush();
    await vi.advanceTimersByTimeAsync(500);
    expect(asked).toHaveLength(0);
    await vi.advanceTimersByTimeAsync(500);
    expect(asked).toHaveLength(1);
    await settle();
    expect(source.failure.value).toBeNull();
    expect(source.at(3)?.frame).toBe(3);
  });

  it("is not believed when it sends too little", async () => {
    const source = new ChunkedFrames({ frames: 100, width: 3, load: async () => new Float32Array(7) });
    source.want(0);
    await flush();
    expect(source.failure.value).toBe("expected 300 numbers, but got 7");
    expect(source.at(0)).toBeNull();
    source.close();
  });

  it("is left alone once the take is closed", async () => {
    const { source, asked } = makeServer(100);
    source.want(3);
    source.close();
    expect(asked.every((one) => one.stop.aborted)).toBe(true);
    asked.splice(0).forEach((one) => one.answer());
    await flush();
    expect(source.at(3)).toBeNull();
    source.want(50);
    expect(asked).toHaveLength(0);
  });
});
