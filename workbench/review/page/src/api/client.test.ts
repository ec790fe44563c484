import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import {
  addressOf, ApiError, get, getFloats, logIn, post, postFile, remove, setSession, whenSessionIsLost,
} from "./client";

type Answer = () => Response | Promise<Response>;
let asked: { address: string; init: RequestInit }[] = [];
let answer: Answer = () => Response.json({});

beforeEach(() => {
  asked = [];
  setSession(null);
  whenSessionIsLost(() => undefined);
  vi.stubGlobal("fetch", async (address: string, init: RequestInit) => {
    asked.push({ address, init });
    return answer();
  });
});
afterEach(() => vi.unstubAllGlobals());

const header = (name: string) => (asked[0]!.init.headers as Record<string, string>)[name];

async function failure(call: Promise<unknown>): Promise<ApiError> {
  const error: unknown = await call.then(() => null, (thrown: unknown) => thrown);
  if (!(error instanceof ApiError)) throw new Error(`expected an ApiError, but got ${String(error)}`);
  return error;
}

describe("addresses", () => {
  it("carry any name whole", () => {
    for (const take of ["a b", "../x", "ä/%2F", "a&b=c#d", "line\nbreak", "😀", ""]) {
      const address = addressOf("/api/scene", { take });
      expect(address.startsWith("/api/scene?take=")).toBe(true);
      expect(new URL(address, "http://x").searchParams.get("take")).toBe(take);
      expect(new URL(address, "http://x").pathname).toBe("/api/scene");
    }
  });
  it("leave out what is not given", () => {
    expect(addressOf("/api/scene", { take: "a", solve: null, more: undefined })).toBe("/api/scene?take=a");
    expect(addressOf("/api/corpus")).toBe("/api/corpus");
  });
});

describe("the CSRF header", () => {
  it("goes with what changes something, and with nothing else", async () => {
    setSession({ person: "Ève", csrf: "abc" });
    answer = () => Response.json({});
    await get("/api/corpus");
    expect(header("X-Mimique-CSRF")).toBeUndefined();
    for (const call of [() => post("/api/draft/edit", {}), () => remove("/api/x"), () => postFile("/api/elan/preview",
      new Blob(["x"]))]) {
      asked = [];
      await call();
      expect(header("X-Mimique-CSRF")).toBe("abc");
    }
  });
  it("is the one of the login", async () => {
    answer = () => Response.json({ csrf: "from-login" });
    await logIn({ person: "ada", password: "x" });
    asked = [];
    await post("/api/draft/undo", {});
    expect(header("X-Mimique-CSRF")).toBe("from-login");
  });
});

describe("answers", () => {
  it("are read as numbers where they are floats", async () => {
    answer = () => new Response(new Float32Array([1.5, -2]).buffer);
    expect([...(await getFloats("/api/curve"))]).toEqual([1.5, -2]);
  });
  it("may be empty", async () => {
    answer = () => new Response(null, { status: 204 });
    expect(await remove("/api/session")).toBeUndefined();
  });
  it("that are errors say what the server says", async () => {
    answer = () => Response.json({ error: { kind: "stale", message: "Version 3, but 4 was expected." } },
      { status: 409 });
    const error = await failure(post("/api/draft/edit", {}));
    expect([error.kind, error.status, error.message]).toEqual(["stale", 409, "Version 3, but 4 was expected."]);
    expect(error.isPassing).toBe(false);
  });
  it("of something between (a proxy) still have a kind", async () => {
    answer = () => new Response("<html>Bad gateway</html>", { status: 502 });
    const error = await failure(get("/api/corpus"));
    expect([error.kind, error.status, error.isPassing]).toEqual(["server", 502, true]);
  });
  it("that are no JSON are an error, not a crash", async () => {
    answer = () => new Response("<html>Log in to the hotel's network</html>");
    expect((await failure(get("/api/corpus"))).kind).toBe("server");
  });
  it("that never come pass", async () => {
    answer = () => Promise.reject(new TypeError("Failed to fetch"));
    const error = await failure(get("/api/corpus"));
    expect([error.kind, error.isPassing]).toEqual(["no-answer", true]);
  });
  it("too late count as none", async () => {
    vi.stubGlobal("fetch", (_: string, init: RequestInit) =>
      new Promise((_resolve, reject) => init.signal?.addEventListener("abort",
        () => reject(init.signal?.reason as Error))));
    expect((await failure(get("/api/corpus", {}, { timeout: 5 }))).kind).toBe("no-answer");
    const stop = new AbortController();
    const call = failure(get("/api/corpus", {}, { signal: stop.signal }));
    stop.abort();
    expect((await call).kind).toBe("stopped");
  });
});

describe("a session that ended", () => {
  it("is told by any call but the login itself", async () => {
    const lost = vi.fn();
    whenSessionIsLost(lost);
    answer = () => Response.json({ error: { kind: "no-session", message: "Log in." } }, { status: 401 });
    await failure(logIn({ person: "ada", password: "wrong" }));
    expect(lost).not.toHaveBeenCalled();
    await failure(get("/api/corpus"));
    expect(lost).toHaveBeenCalledTimes(1);
  });
});
