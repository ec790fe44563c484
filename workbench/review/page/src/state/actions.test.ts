import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Draft, EditAnswer, Segment, Session } from "../api/messages";

/**
 * A server in memory behind `fetch`: sessions, one take with three segments, and edits that only accept. The modules of
 * the page are loaded anew for every test: each is a page that was just opened.
 */
class Server {
  calls: string[] = [];
  person: string | null = null;
  csrf = "one";
  /** null: nobody answers. */
  isUp = true;
  version = 1;
  edits: string[] = [];
  answers = new Map<string, EditAnswer>();
  segments: Segment[] = ["a", "b", "c"].map((id, index) => ({
    id, onset: index * 10, offset: index * 10 + 10, label: "joy", confidence: 0.5, status: "proposed",
      origin: "model", revision: 0,
    kind: "interval",
  }));
  settings: Record<string, unknown> = {};

  async fetch(address: string, init: RequestInit): Promise<Response> {
    const url = new URL(address, "http://here");
    const body = typeof init.body === "string" ? (JSON.parse(init.body) as Record<string, unknown>) : {};
    this.calls.push(`${init.method} ${url.pathname}`);
    await Promise.resolve();
    if (!this.isUp) throw new TypeError("Failed to fetch");
    if (url.pathname === "/api/session" && init.method === "POST") {
      if (body["token"] !== "right" && body["password"] !== "right") return refuse(401, "no-session");
      this.person = typeof body["person"] === "string" ? body["person"] : "owner";
      return Response.json(this.session());
    }
    if (this.person === null) return refuse(401, "no-session");
    if (init.method !== "GET" && (init.headers as Record<string,
      string>)["X-Mimique-CSRF"] !== this.csrf) return refuse(403, "csrf");
    switch (url.pathname) {
      case "/api/session": return Response.json(this.session());
      case "/api/settings": this.settings = body; return Response.json(body);
      case "/api/corpus": return Response.json({ name: "c", snapshot: "S", rigs: [], problems: [],
        takes: [takeRow("t1"), takeRow("t2")] });
      case "/api/scheme": return Response.json({ snapshot: "S", vocabularies: [] });
      case "/api/queue": return Response.json({ ready: true, items: this.segments.map((one) => ({ ...one, take: "t1",
        tier: "affect", seconds: 0.05, second: "", gain: 0, signer: null, protocol: null })) });
      case "/api/pace": return Response.json({ reviewed: 0, remaining: 3, per_minute: null, minutes_left: null,
        active_seconds: 0 });
      case "/api/scene": return Response.json({ take: url.searchParams.get("take"), rate: 200, frames: 1000,
        seconds: 5 });
      case "/api/draft": return Response.json(this.draft(url.searchParams.get("take") ?? ""));
      case "/api/draft/edit": return this.edit(body as unknown as Body);
      default: return refuse(404, "not-found");
    }
  }

  session(): Session {
    return { person: this.person ?? "", is_lead: false, named: true, csrf: this.csrf, corpus: "c", place: "c",
      version: "1", snapshot: "S",
      settings: this.settings };
  }

  draft(take: string): Draft {
    return {
      take, purpose: "own", author: "ada", version: this.version, base: "S", mode: "review", others: [],
        unpublished: 0, done: false,
      undo: null, redo: null, gone: null, tiers: [{ tier: "affect", source: null,
        segments: structuredClone(this.segments) }],
    };
  }

  edit(body: Body): Response {
    const known = this.answers.get(body.request);
    if (known !== undefined) return Response.json(known);
    if (body.version !== this.version) return refuse(409, "stale");
    const target = this.segments.find((one) => one.id === body.operation.segments[0]);
    if (target === undefined) return refuse(422, "input");
    this.version += 1;
    this.edits.push(target.id);
    target.status = "reviewed";
    const answer: EditAnswer = {
      version: this.version, undo: "accept", redo: null, unpublished: this.edits.length,
      changes: [{ tier: "affect", removed: [], added: [{ ...target }] }],
    };
    this.answers.set(body.request, answer);
    return Response.json(answer);
  }
}

interface Body {
  request: string;
  version: number;
  operation: { segments: string[] };
}

const refuse = (status: number, kind: string) => Response.json({ error: { kind, message: `refused: ${kind}` } },
  { status });
const takeRow = (take: string) => ({
  take, signer: null, protocol: null, rate: 200, frames: 1000, seconds: 5, simulated: true, solve: "s",
    mode: "review", refusal: null,
  proposed: 3, reviewed: 0, unpublished: 0, done: false,
});

let server: Server;
let stored: Map<string, string>;
let hash = "";

/** Open the page anew. */
async function openPage() {
  vi.resetModules();
  const actions = await import("./actions");
  const state = await import("./state");
  return { actions, state };
}
type Page = Awaited<ReturnType<typeof openPage>>;
const settle = (milliseconds = 20) => new Promise((resolve) => setTimeout(resolve, milliseconds));
const accept = (id: string) => ({ kind: "accept" as const, tier: "affect", segments: [id] });
const statuses = (page: Page) => page.state.activeSegments.value.map((one) => one.status).join(" ");

beforeEach(() => {
  server = new Server();
  stored = new Map();
  hash = "";
  const listeners = { addEventListener: () => undefined };
  vi.stubGlobal("fetch", (address: string, init: RequestInit) => server.fetch(address, init));
  vi.stubGlobal("window", listeners);
  vi.stubGlobal("document", { ...listeners, hidden: false, documentElement: {} });
  vi.stubGlobal("location", { get hash() { return hash; }, pathname: "/", search: "" });
  vi.stubGlobal("history", { replaceState: () => (hash = "") });
  vi.stubGlobal("BroadcastChannel", undefined);
  vi.stubGlobal("setInterval", () => 0);
  vi.stubGlobal("localStorage", {
    get length() { return stored.size; },
    key: (index: number) => [...stored.keys()][index] ?? null,
    getItem: (key: string) => stored.get(key) ?? null,
    setItem: (key: string, value: string) => stored.set(key, value),
    removeItem: (key: string) => stored.delete(key),
  });
});
afterEach(() => vi.unstubAllGlobals());

describe("logging in", () => {
  it("by the token of the address, which leaves it at once", async () => {
    hash = "#token=right";
    const page = await openPage();
    await page.actions.start();
    expect(hash).toBe("");
    expect(page.state.login.value).toBeNull();
    expect(page.state.session.value?.person).toBe("owner");
    expect(page.state.scene.value?.take).toBe("t1");
    expect(page.state.chosen.value?.id).toBe("a");
  });
  it("goes on with a session that holds, whatever an old token says", async () => {
    server.person = "ada";
    hash = "#token=old";
    const page = await openPage();
    await page.actions.start();
    expect(page.state.session.value?.person).toBe("ada");
  });
  it("asks for a name where nobody is known, and shows nothing before", async () => {
    const page = await openPage();
    await page.actions.start();
    expect(page.state.login.value).toBe("needed");
    expect(server.calls).toEqual(["GET /api/session"]);
    await expect(page.actions.enter("ada", "wrong")).rejects.toMatchObject({ kind: "no-session" });
    expect(page.state.session.value).toBeNull();
    await page.actions.enter("ada", "right");
    expect(page.state.login.value).toBeNull();
    expect(page.state.corpus.value?.takes).toHaveLength(2);
  });
  it("says that nobody answers", async () => {
    server.isUp = false;
    const page = await openPage();
    await page.actions.start();
    expect(page.state.notice.value?.tone).toBe("error");
    expect(page.state.starting.value).toBe(false);
  });
});

describe("at work", () => {
  async function begin(): Promise<Page> {
    server.person = "ada";
    const page = await openPage();
    await page.actions.start();
    return page;
  }

  it("an edit is shown once it is on disk, in the draft, the queue and the count", async () => {
    const page = await begin();
    const saved = page.actions.edit(accept("a"));
    expect(page.state.saving.value.state).toBe("saving");
    expect(statuses(page)).toBe("proposed proposed proposed");
    expect(await saved).toBe(true);
    expect(statuses(page)).toBe("reviewed proposed proposed");
    expect(page.state.shownQueue.value.map((one) => one.id)).toEqual(["b", "c"]);
    expect(page.state.unpublished.value).toBe(1);
    await settle();
    expect(page.state.saving.value.state).toBe("saved");
    expect([...stored.keys()].filter((key) => key.includes("unsaved"))).toEqual([]);
  });
  it("accepting and going on walks through the whole queue", async () => {
    const page = await begin();
    for (let left = 3; left > 0; left -= 1) {
      expect(await page.actions.edit(accept(page.state.selection.value[0]!))).toBe(true);
      await page.actions.goTo(1);
    }
    expect(server.edits).toEqual(["a", "b", "c"]);
    expect(page.state.notice.value?.tone).toBe("info");
  });
  it("another tab's edit of other segments does not stop this one", async () => {
    const page = await begin();
    server.segments[2]!.status = "reviewed";
    server.version = 7;
    expect(await page.actions.edit(accept("a"))).toBe(true);
    expect(statuses(page)).toBe("reviewed proposed reviewed");
    expect(page.state.notice.value).toBeNull();
  });
  it("another tab's edit of the same segment does, and is shown", async () => {
    const page = await begin();
    server.segments[0]!.label = "fear";
    server.version = 7;
    expect(await page.actions.edit(accept("a"))).toBe(false);
    expect(server.edits).toEqual([]);
    expect(page.state.notice.value?.tone).toBe("warning");
    expect(page.state.chosen.value?.label).toBe("fear");
    expect(page.state.saving.value.state).toBe("saved");
  });
  it("a refused edit is told and changes nothing", async () => {
    const page = await begin();
    expect(await page.actions.edit(accept("nobody"))).toBe(false);
    expect(page.state.notice.value?.text).toContain("refused: input");
    expect(page.state.saving.value.state).toBe("saved");
  });
  it("a new token against forgery is fetched, never another person's", async () => {
    const page = await begin();
    server.csrf = "two";
    expect(await page.actions.edit(accept("a"))).toBe(true);
    expect(server.edits).toEqual(["a"]);
    server.csrf = "three";
    server.person = "eve";
    void page.actions.edit(accept("b"));
    await settle();
    expect(server.edits).toEqual(["a"]);
    expect(page.state.saving.value.state).toBe("unsaved");
  });
  it("an edit that was not answered outlives the page, and further ones wait", async () => {
    const page = await begin();
    server.isUp = false;
    void page.actions.edit(accept("a"));
    await settle();
    expect(page.state.saving.value.state).toBe("unsaved");
    expect(await page.actions.edit(accept("b"))).toBe(false);
    expect(statuses(page)).toBe("proposed proposed proposed");

    server.isUp = true;
    const next = await begin();
    await settle();
    expect(server.edits).toEqual(["a"]);
    expect(statuses(next)).toBe("reviewed proposed proposed");
    expect(next.state.saving.value.state).toBe("saved");
  });
  it("a session that ends in the middle keeps the edit until the same person is back", async () => {
    const page = await begin();
    server.person = null;
    void page.actions.edit(accept("a"));
    await settle();
    expect(page.state.login.value).toBe("lost");
    expect(page.state.scene.value?.take).toBe("t1");
    await page.actions.enter("ada", "right");
    await settle();
    expect(page.state.login.value).toBeNull();
    expect(server.edits).toEqual(["a"]);
    expect(statuses(page)).toBe("reviewed proposed proposed");
  });
  it("the last take that was asked for is the one that opens", async () => {
    const page = await begin();
    const both = [page.actions.openTake("t2"), page.actions.openTake("t1"), page.actions.openTake("t2")];
    await Promise.all(both);
    expect(page.state.scene.value?.take).toBe("t2");
    expect(page.state.opening.value).toBeNull();
  });
  it("nothing is edited while another take is on its way, and the queue walks on from that one", async () => {
    const page = await begin();
    const items = page.state.queue.value!.items;
    page.state.queue.value = {
      ready: true, items: items.map((one, index) => (index === 0 ? one : { ...one, take: "t2" })),
    };
    page.actions.choose("a");
    const second = page.actions.goTo(1);
    expect(page.state.arriving.value).toBe("t2");
    expect(await page.actions.edit(accept("a"))).toBe(false);
    expect(page.state.notice.value?.text).toContain("t2");
    const third = page.actions.goTo(1);
    await Promise.all([second, third]);
    expect(page.state.arriving.value).toBeNull();
    expect(page.state.selection.value).toEqual(["c"]);
    expect(server.edits).toEqual([]);
  });

  it("coming back to a take finds the frame and the view", async () => {
    const page = await begin();
    page.state.clock.seek(321);
    page.state.range.value = { first: 300, last: 400 };
    await page.actions.openTake("t2");
    expect(page.state.clock.frame.value).toBe(0);
    await page.actions.openTake("t1");
    expect(page.state.clock.frame.value).toBe(321);
    expect(page.state.range.value).toEqual({ first: 300, last: 400 });
  });
  it("settings that change quickly are sent once, whole", async () => {
    const page = await begin();
    const before = server.calls.length;
    void page.actions.saveSettings({ language: "fr" });
    void page.actions.saveSettings({ theme: "dark" });
    await page.actions.saveSettings({ leftFolded: true });
    expect(server.settings).toEqual({ language: "fr", theme: "dark", leftFolded: true });
    expect(server.calls.slice(before).filter((one) => one === "PUT /api/settings")).toHaveLength(1);
  });
});
