/**
 * Edits on their way to the disk of the server: one after the other, none lost, none twice.
 *
 * An edit that the server does not answer stays here and in the browser's storage, and goes out again with the same
 * request id until it is answered; the server counts an id once. A page that is loaded anew finds what its
 * predecessor left. Nothing here knows the page: sending, storing and waiting are handed in.
 */
import { ApiError } from "../api/client";
import type { EditAnswer, Operation, Purpose, Segment } from "../api/messages";

export type Step = Operation | "undo" | "redo";

export interface Entry {
  /** The request id, a UUID. */
  request: string;
  take: string;
  purpose: Purpose;
  /** Of the draft that the person saw. */
  version: number;
  operation: Step;
  /** The segments it is about, as the person saw them. */
  seen: Segment[];
  /** Entries go out in this order. */
  order: number;
}

export interface OutboxOptions {
  send: (entry: Entry) => Promise<EditAnswer>;
  /** Another tab was faster: the version to send the entry with, null where it means nothing any more. */
  renew: (entry: Entry) => Promise<number | null>;
  onAnswer: (entry: Entry, answer: EditAnswer) => void;
  onRefused: (entry: Entry, error: ApiError) => void;
  onState: (state: "saved" | "saving" | "unsaved", entry: Entry | null, error: ApiError | null) => void;
  storage?: Pick<Storage, "getItem" | "setItem" | "removeItem" | "key" | "length"> | null;
  /** Milliseconds between two attempts. */
  pause?: number;
  wait?: (milliseconds: number, wake: Promise<void>) => Promise<void>;
}

const PREFIX = "mimique.unsaved.";
const RENEWALS = 5;

export class Outbox {
  readonly #options: OutboxOptions;
  readonly #waiting: Entry[] = [];
  readonly #settle = new Map<string, (saved: boolean) => void>();
  #owner = "";
  #running = false;
  #stuck = false;
  #order = 0;
  #wake: () => void = () => undefined;

  constructor(options: OutboxOptions) {
    this.#options = options;
  }

  /** How many edits are not known to be on disk. */
  get size(): number {
    return this.#waiting.length;
  }

  /** Whether the server did not answer the last attempt. */
  get isStuck(): boolean {
    return this.#stuck;
  }

  /** Say whose edits these are; those that were left in the storage by an earlier page go out first. */
  open(corpus: string, person: string): void {
    this.#owner = `${PREFIX}${JSON.stringify([corpus, person])}.`;
    const known = new Set(this.#waiting.map((one) => one.request));
    const left = this.#readStored().filter((one) => !known.has(one.request));
    for (const entry of left) this.#waiting.push(entry);
    this.#waiting.sort((a, b) => a.order - b.order);
    this.#order = Math.max(this.#order, ...this.#waiting.map((one) => one.order));
    void this.#run();
  }

  /** Send an edit after those that wait; resolves to true once it is on disk, false where it was refused. */
  push(entry: Omit<Entry, "order">): Promise<boolean> {
    const whole: Entry = { ...entry, order: (this.#order += 1) };
    this.#waiting.push(whole);
    this.#store(whole);
    const saved = new Promise<boolean>((resolve) => this.#settle.set(whole.request, resolve));
    void this.#run();
    return saved;
  }

  /** Try again now. */
  poke(): void {
    this.#wake();
  }

  /** Give up what waits: the person said so. Returns how many edits that were. */
  discard(): number {
    const given = this.#waiting.splice(0);
    for (const entry of given) this.#finish(entry, false);
    this.#stuck = false;
    this.#options.onState("saved", null, null);
    this.#wake();
    return given.length;
  }

  async #run(): Promise<void> {
    if (this.#running) return;
    this.#running = true;
    try {
      let renewals = 0;
      for (let entry = this.#waiting[0]; entry !== undefined; entry = this.#waiting[0]) {
        if (!this.#stuck) this.#options.onState("saving", entry, null);
        try {
          const answer = await this.#options.send(entry);
          this.#stuck = false;
          renewals = 0;
          if (this.#waiting[0] !== entry) continue;
          this.#waiting.shift();
          this.#follow(entry, answer.version);
          this.#options.onAnswer(entry, answer);
          this.#finish(entry, true);
        } catch (thrown) {
          let error = toApiError(thrown);
          if (this.#waiting[0] !== entry) continue;
          if (error.kind === "stale" && renewals < RENEWALS) {
            renewals += 1;
            try {
              const version = await this.#options.renew(entry);
              if (this.#waiting[0] !== entry) continue;
              if (version !== null) {
                entry.version = version;
                this.#store(entry);
                continue;
              }
            } catch (other) {
              error = toApiError(other);
            }
          }
          if (error.isPassing) {
            this.#stuck = true;
            this.#options.onState("unsaved", entry, error);
            await this.#pause();
            continue;
          }
          this.#stuck = false;
          renewals = 0;
          this.#waiting.shift();
          this.#options.onRefused(entry, error);
          this.#finish(entry, false);
        }
      }
    } finally {
      this.#running = false;
    }
    this.#options.onState("saved", null, null);
  }

  /** Edits that the person made while this one was under way were made on what it leads to. */
  #follow(done: Entry, version: number): void {
    for (const entry of this.#waiting) {
      if (entry.take !== done.take || entry.purpose !== done.purpose || entry.version >= version) continue;
      entry.version = version;
      this.#store(entry);
    }
  }

  #finish(entry: Entry, saved: boolean): void {
    try {
      this.#options.storage?.removeItem(this.#owner + entry.request);
    } catch {
      // A storage that is not there holds nothing to remove.
    }
    this.#settle.get(entry.request)?.(saved);
    this.#settle.delete(entry.request);
  }

  async #pause(): Promise<void> {
    const woken = new Promise<void>((resolve) => (this.#wake = resolve));
    await (this.#options.wait ?? waitFor)(this.#options.pause ?? 2000, woken);
    this.#wake = () => undefined;
  }

  #store(entry: Entry): void {
    try {
      this.#options.storage?.setItem(this.#owner + entry.request, JSON.stringify(entry));
    } catch {
      // Storage is full or forbidden: the entry waits in this page alone, and leaving the page warns.
    }
  }

  #readStored(): Entry[] {
    const storage = this.#options.storage;
    if (!storage) return [];
    const found: Entry[] = [];
    try {
      const keys = Array.from({ length: storage.length }, (_, index) => storage.key(index));
      for (const key of keys) {
        if (key === null || !key.startsWith(this.#owner)) continue;
        const entry = readEntry(storage.getItem(key));
        if (entry !== null && key === this.#owner + entry.request) found.push(entry);
        else storage.removeItem(key);
      }
    } catch {
      return found;
    }
    return found;
  }
}

function readEntry(text: string | null): Entry | null {
  try {
    const entry = JSON.parse(text ?? "null") as Partial<Entry> | null;
    if (entry === null || typeof entry !== "object") return null;
    const { request, take, version, operation, order, purpose, seen } = entry;
    const whole =
      typeof request === "string" && typeof take === "string" && Array.isArray(seen) &&
      typeof version === "number" && typeof order === "number" && operation !== undefined && operation !== null &&
      (purpose === "own" || purpose === "adjudication");
    return whole ? (entry as Entry) : null;
  } catch {
    return null;
  }
}

function toApiError(thrown: unknown): ApiError {
  if (thrown instanceof ApiError) return thrown;
  return new ApiError("no-answer", thrown instanceof Error ? thrown.message : String(thrown), 0);
}

function waitFor(milliseconds: number, wake: Promise<void>): Promise<void> {
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, milliseconds);
    void wake.then(() => {
      clearTimeout(timer);
      resolve();
    });
  });
}

/** A random UUID; crypto.randomUUID is not there on a plain http address of another machine. */
export function makeRequestId(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6]! & 0x0f) | 0x40;
  bytes[8] = (bytes[8]! & 0x3f) | 0x80;
  const digits = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  return [digits.slice(0, 8), digits.slice(8, 12), digits.slice(12, 16), digits.slice(16, 20),
    digits.slice(20)].join("-");
}
