import { describe, expect, it } from "vitest";
import { ApiError, type ErrorKind } from "../api/client";
import type { EditAnswer, Operation } from "../api/messages";
import { makeRequestId, Outbox, type Entry, type OutboxOptions } from "./outbox";

/** A server that counts each request id once, and may be gone, slow, or forget to answer. */
class FakeServer {
  version = 0;
  applied: string[] = [];
  answers = new Map<string, EditAnswer>();
  received: Entry[] = [];
  /** What happens to the next calls, in order; afterwards all is well. */
  fate: ("gone" | "lost answer" | ErrorKind)[] = [];

  async send(entry: Entry): Promise<EditAnswer> {
    this.received.push({ ...entry });
    await Promise.resolve();
    const fate = this.fate.shift();
    if (fate === "gone") throw new ApiError("no-answer", "gone", 0);
    if (fate !== undefined && fate !== "lost answer") throw new ApiError(fate, fate, fate === "not-saved" ? 503 : 422);
    const known = this.answers.get(entry.request);
    if (known !== undefined) return known;
    if (entry.version !== this.version) throw new ApiError("stale", "stale", 409);
    this.version += 1;
    this.applied.push(name(entry));
    const answer: EditAnswer = { version: this.version, undo: null, redo: null, unpublished: this.version,
      changes: [] };
    this.answers.set(entry.request, answer);
    if (fate === "lost answer") throw new ApiError("no-answer", "lost", 0);
    return answer;
  }
}

class FakeStorage {
  kept = new Map<string, string>();
  get length() { return this.kept.size; }
  key(index: number) { return [...this.kept.keys()][index] ?? null; }
  getItem(key: string) { return this.kept.get(key) ?? null; }
  setItem(key: string, value: string) { this.kept.set(key, value); }
  removeItem(key: string) { this.kept.delete(key); }
}

const name = (entry: Entry) => (typeof entry.operation === "string" ? entry.operation : entry.operation.kind);
const accept: Operation = { kind: "accept", tier: "affect", segments: ["1"] };
const split: Operation = { kind: "split", tier: "affect", segment: "1", frame: 5 };

function setUp(change: Partial<OutboxOptions> = {}) {
  const server = new FakeServer();
  const storage = new FakeStorage();
  const states: string[] = [];
  const shown: string[] = [];
  const refused: string[] = [];
  const options: OutboxOptions = {
    send: (entry) => server.send(entry),
    renew: async () => server.version,
    onAnswer: (entry) => shown.push(name(entry)),
    onRefused: (_, error) => refused.push(error.kind),
    onState: (state) => states.push(state),
    storage,
    wait: async () => { await new Promise((resolve) => setTimeout(resolve, 0)); },
    ...change,
  };
  const outbox = new Outbox(options);
  outbox.open("corpus", "ada");
  const push = (operation: Entry["operation"], version = 0, take = "t1") =>
    outbox.push({ request: makeRequestId(), take, purpose: "own", version, operation, seen: [] });
  return { server, storage, states, shown, refused, options, outbox, push };
}

describe("an edit", () => {
  it("is shown as saved only after the answer", async () => {
    const { states, shown, push, storage } = setUp();
    states.length = 0;
    const saved = push(accept);
    expect(states).toEqual(["saving"]);
    expect(storage.length).toBe(1);
    expect(await saved).toBe(true);
    expect(shown).toEqual(["accept"]);
    await Promise.resolve();
    expect(states).toEqual(["saving", "saved"]);
    expect(storage.length).toBe(0);
  });
  it("waits for the one before it and is made on its version", async () => {
    const { server, push } = setUp();
    expect(await Promise.all([push(accept), push(split), push("undo")])).toEqual([true, true, true]);
    expect(server.applied).toEqual(["accept", "split", "undo"]);
    expect(server.received.map((one) => one.version)).toEqual([0, 1, 2]);
  });
  it("of another take keeps its own version", async () => {
    const { server, push, outbox } = setUp();
    const both = [push(accept, 0, "t1"), push(accept, 7, "t2")];
    expect(outbox.size).toBe(2);
    server.answers.clear();
    await both[0];
    server.version = 7;
    await both[1];
    expect(server.received.map((one) => one.version)).toEqual([0, 7]);
  });
});

describe("a server that does not answer", () => {
  it("gets the very same request again, and counts it once", async () => {
    const { server, push, states } = setUp();
    server.fate = ["gone", "lost answer", "not-saved"];
    expect(await push(accept)).toBe(true);
    expect(server.applied).toEqual(["accept"]);
    expect(server.received).toHaveLength(4);
    expect(new Set(server.received.map((one) => one.request)).size).toBe(1);
    expect(states).toContain("unsaved");
  });
  it("leaves the edit in the storage, where the next page finds it", async () => {
    const never = new Promise<void>(() => undefined);
    const first = setUp({ wait: () => never });
    first.server.fate = ["lost answer"];
    void first.push(accept);
    void first.push(split);
    await new Promise((resolve) => setTimeout(resolve, 0));
    expect(first.outbox.isStuck).toBe(true);
    expect(first.storage.length).toBe(2);

    const next = new Outbox({ ...first.options, wait: async () => undefined });
    next.open("corpus", "ada");
    await new Promise((resolve) => setTimeout(resolve, 0));
    expect(first.server.applied).toEqual(["accept", "split"]);
    expect(first.storage.length).toBe(0);
    expect(next.size).toBe(0);
  });
  it("does not get another person's edits", async () => {
    const { server, options, storage } = setUp({ wait: () => new Promise<void>(() => undefined) });
    server.fate = ["gone"];
    const ada = new Outbox(options);
    ada.open("corpus", "ada");
    void ada.push({ request: "r", take: "t", purpose: "own", version: 0, operation: accept, seen: [] });
    await new Promise((resolve) => setTimeout(resolve, 0));
    const eve = new Outbox(options);
    eve.open("corpus", "eve");
    expect(eve.size).toBe(0);
    expect(storage.length).toBe(1);
  });
  it("is asked again at once when told so", async () => {
    let waits = 0;
    const { server, push, outbox } = setUp({ wait: (_, wake) => { waits += 1; return wake; } });
    server.fate = ["gone"];
    const saved = push(accept);
    await new Promise((resolve) => setTimeout(resolve, 0));
    expect(waits).toBe(1);
    outbox.poke();
    expect(await saved).toBe(true);
  });
  it("may be given up", async () => {
    const { server, push, outbox, storage } = setUp({ wait: (_, wake) => wake });
    server.fate = ["gone"];
    const saved = push(accept);
    await new Promise((resolve) => setTimeout(resolve, 0));
    expect(outbox.discard()).toBe(1);
    expect(await saved).toBe(false);
    expect(storage.length).toBe(0);
    expect(await push(accept)).toBe(true);
    expect(server.received).toHaveLength(2);
  });
});

describe("a refusal", () => {
  it("drops the edit, says why, and lets the next one through", async () => {
    const { server, push, refused } = setUp();
    server.fate = ["input"];
    expect(await Promise.all([push(accept), push(split)])).toEqual([false, true]);
    expect(refused).toEqual(["input"]);
    expect(server.applied).toEqual(["split"]);
  });
  it("as stale is tried again on the newer draft where it still means the same", async () => {
    const { server, push, refused } = setUp();
    server.version = 5;
    expect(await push(accept, 2)).toBe(true);
    expect(server.received.map((one) => one.version)).toEqual([2, 5]);
    expect(refused).toEqual([]);
  });
  it("as stale is told where it does not", async () => {
    const { server, push, refused, storage } = setUp({ renew: async () => null });
    server.version = 5;
    expect(await push(accept, 2)).toBe(false);
    expect(refused).toEqual(["stale"]);
    expect(storage.length).toBe(0);
  });
  it("as stale for ever ends", async () => {
    const { server, push, refused } = setUp({ renew: async () => -1 });
    server.version = 5;
    expect(await push(accept, 2)).toBe(false);
    expect(refused).toEqual(["stale"]);
    expect(server.received.length).toBeLessThan(10);
  });
  it("while looking for the newer draft does not lose the edit", async () => {
    let looks = 0;
    const { server, push } = setUp({
      renew: async () => {
        looks += 1;
        if (looks === 1) throw new ApiError("no-answer", "gone", 0);
        return server.version;
      },
    });
    server.version = 5;
    expect(await push(accept, 2)).toBe(true);
    expect(server.applied).toEqual(["accept"]);
  });
});

describe("the storage", () => {
  it("may be full or forbidden", async () => {
    const broken = () => { throw new Error("QuotaExceededError"); };
    const { push } = setUp({ storage: { length: 1, key: broken, getItem: broken, setItem: broken,
      removeItem: broken } });
    expect(await push(accept)).toBe(true);
  });
  it("may hold rubbish", () => {
    const { storage, options } = setUp();
    const owner = 'mimique.unsaved.["corpus","ada"].';
    storage.setItem(`${owner}x`, "{not json");
    storage.setItem(`${owner}y`, JSON.stringify({ request: "z" }));
    storage.setItem(`${owner}n`, "null");
    storage.setItem("else", "kept");
    const outbox = new Outbox(options);
    outbox.open("corpus", "ada");
    expect(outbox.size).toBe(0);
    expect([...storage.kept.keys()]).toEqual(["else"]);
  });
});

it("request ids are UUIDs of version 4, each another", () => {
  const ids = Array.from({ length: 200 }, makeRequestId);
  expect(new Set(ids).size).toBe(200);
  for (const id of ids) expect(id).toMatch(/^[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$/);
});
