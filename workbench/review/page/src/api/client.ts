/**
 * Calls to the server: typed, with the CSRF header on whatever changes something, and errors by kind.
 *
 * Names of takes, tiers and people travel in the query or the body, so a path here is always a constant.
 */
import type { ErrorMessage, PasswordRequest, Session } from "./messages";

/** What went wrong: what the server says, or that it said nothing. */
export type ErrorKind = ErrorMessage["error"]["kind"] | "no-answer" | "stopped";

/** A call that came to nothing. `message` is one line for a person, in English; `status` is 0 without an answer. */
export class ApiError extends Error {
  constructor(
    readonly kind: ErrorKind,
    message: string,
    readonly status: number,
  ) {
    super(message);
    this.name = "ApiError";
  }

  /** Whether sending the very same thing again may succeed: nothing was decided about it. */
  get isPassing(): boolean {
    return (
      this.kind === "no-answer" || this.kind === "not-saved" || this.kind === "too-many" ||
      this.kind === "no-session" || this.kind === "csrf" || this.status >= 500
    );
  }
}

export type Query = Record<string, string | number | boolean | null | undefined>;

export interface CallOptions {
  signal?: AbortSignal;
  /** Milliseconds after which a call counts as not answered. */
  timeout?: number;
}

const USUAL_TIMEOUT = 20_000;
const CSRF_HEADER = "X-Mimique-CSRF";

const PASSWORD = "/api/password";
const PERSON_HEADER = "X-Mimique-Person";
let csrf = "";
/** Whose page this is; the cookie may become another's, where somebody logs in in another tab. */
let person = "";
let onSessionLost: () => void = () => undefined;

/** Whose session the calls that follow belong to, and its CSRF token; null for nobody's. */
export function setSession(session: Pick<Session, "person" | "csrf"> | null): void {
  csrf = session?.csrf ?? "";
  person = session?.person ?? "";
}

/** Say what happens when the server no longer knows the session (any call may find out). */
export function whenSessionIsLost(then: () => void): void {
  onSessionLost = then;
}

/** The address of a GET, for `<video src>`, downloads and loaders that fetch by themselves. */
export function addressOf(path: string, query: Query = {}): string {
  const parameters = new URLSearchParams();
  for (const [name, value] of Object.entries(query)) {
    if (value !== null && value !== undefined) parameters.set(name, String(value));
  }
  const text = parameters.toString();
  return text === "" ? path : `${path}?${text}`;
}

/** GET JSON. */
export async function get<T>(path: string, query: Query = {}, options: CallOptions = {}): Promise<T> {
  return readJson<T>(await call("GET", addressOf(path, query), undefined, options));
}

/** GET little-endian float32 numbers, as /api/weights, /api/markers and /api/curve send them. */
export async function getFloats(path: string, query: Query = {}, options: CallOptions = {}): Promise<Float32Array> {
  return new Float32Array(await getBytes(path, query, options));
}

/** GET a whole curve of a take, one number a frame; `solve` null is the current one. */
export async function fetchCurve(take: string, solve: string | null, curve: string): Promise<Float32Array> {
  return getFloats("/api/curve", { take, solve, curve });
}

/** GET bytes, as /api/rig sends them. */
export async function getBytes(path: string, query: Query = {}, options: CallOptions = {}): Promise<ArrayBuffer> {
  const response = await call("GET", addressOf(path, query), undefined, options);
  return guard(() => response.arrayBuffer(), options);
}

/** POST a JSON body, read a JSON answer. */
export async function post<T>(path: string, body: unknown, options: CallOptions & { query?: Query } = {}): Promise<T> {
  return readJson<T>(await call("POST", addressOf(path, options.query), jsonBody(body), options));
}

/** PUT a JSON body, read a JSON answer. */
export async function put<T>(path: string, body: unknown, options: CallOptions & { query?: Query } = {}): Promise<T> {
  return readJson<T>(await call("PUT", addressOf(path, options.query), jsonBody(body), options));
}

/** DELETE what the query names. */
export async function remove<T>(path: string, query: Query = {}, options: CallOptions = {}): Promise<T> {
  return readJson<T>(await call("DELETE", addressOf(path, query), undefined, options));
}

/** POST a file as it is, read a JSON answer. */
export async function postFile<T>(path: string, file: Blob, query: Query = {}, options: CallOptions = {}): Promise<T> {
  const body: Body = { data: file, type: "application/octet-stream" };
  return readJson<T>(await call("POST", addressOf(path, query), body, { timeout: 120_000, ...options }));
}

/** Begin a session by the token of the opened address, or by name and password. */
export async function logIn(with_: { token: string } | { person: string; password: string }): Promise<Session> {
  const session = await post<Session>("/api/session", with_);
  setSession(session);
  return session;
}

/**
 * Ask who is logged in; raises the kind "no-session" where nobody is.
 *
 * On a page that has its person already, somebody else's session counts as lost: nothing is done in their name.
 */
export async function fetchSession(): Promise<Session> {
  let session: Session;
  try {
    session = await get<Session>("/api/session");
    if (person !== "" && session.person !== person) {
      throw new ApiError("no-session", `Expected a session of ${person}, but got one of ${session.person}.`, 401);
    }
  } catch (error) {
    if (person !== "" && error instanceof ApiError && error.kind === "no-session") onSessionLost();
    throw error;
  }
  setSession(session);
  return session;
}

/** Change one's own password: the session goes on with another token, other windows are logged out. */
export async function changePassword(change: PasswordRequest): Promise<Session> {
  const session = await put<Session>(PASSWORD, change);
  setSession(session);
  return session;
}

/** End the session. */
export async function logOut(): Promise<void> {
  await remove<unknown>("/api/session");
  setSession(null);
}

interface Body {
  data: string | Blob;
  type: string;
}

function jsonBody(body: unknown): Body {
  return { data: JSON.stringify(body), type: "application/json" };
}

async function call(method: string, address: string, body: Body | undefined, options: CallOptions): Promise<Response> {
  const response = await guard(() => {
    const headers: Record<string, string> = { Accept: "application/json, */*;q=0.5" };
    // A login may be another's; every other call is for the person whose page this is.
    if (person !== "" && !(method === "POST" && address === "/api/session")) {
      headers[PERSON_HEADER] = encodeURIComponent(person);
    }
    if (method !== "GET" && csrf !== "") headers[CSRF_HEADER] = csrf;
    if (body !== undefined) headers["Content-Type"] = body.type;
    const timeout = AbortSignal.timeout(options.timeout ?? USUAL_TIMEOUT);
    const signal = options.signal === undefined ? timeout : AbortSignal.any([options.signal, timeout]);
    const init: RequestInit = { method, headers, signal, credentials: "same-origin", cache: "default" };
    if (body !== undefined) init.body = body.data;
    return fetch(address, init);
  }, options);
  if (response.ok) return response;
  const error = await readError(response);
  // A wrong password is also a 401; it is no session that was lost.
  const isLogin = address.startsWith("/api/session") || address.startsWith(PASSWORD);
  if (error.kind === "no-session" && !isLogin) onSessionLost();
  throw error;
}

/** Turn what fetch throws (no server, no network, too slow, stopped by the caller) into an ApiError. */
async function guard<T>(doing: () => Promise<T>, options: CallOptions): Promise<T> {
  try {
    return await doing();
  } catch (thrown) {
    if (options.signal?.aborted) throw new ApiError("stopped", "The call was stopped.", 0);
    const reason = thrown instanceof Error && thrown.name === "TimeoutError" ? "in time" : "";
    throw new ApiError("no-answer", `The server does not answer ${reason}`.trimEnd() + ".", 0);
  }
}

async function readJson<T>(response: Response): Promise<T> {
  if (response.status === 204) return undefined as T;
  const text = await guard(() => response.text(), {});
  if (text === "") return undefined as T;
  try {
    return JSON.parse(text) as T;
  } catch {
    throw new ApiError("server", `The server's answer is not JSON: "${text.slice(0, 80)}"`, response.status);
  }
}

async function readError(response: Response): Promise<ApiError> {
  let said: Partial<ErrorMessage["error"]> | undefined;
  try {
    said = (JSON.parse(await response.text()) as Partial<ErrorMessage>).error;
  } catch {
    said = undefined;
  }
  const kind = said?.kind ?? kindOf(response.status);
  return new ApiError(kind, said?.message ?? `The server answers ${response.status}.`, response.status);
}

function kindOf(status: number): ErrorKind {
  switch (status) {
    case 401: return "no-session";
    case 403: return "forbidden";
    case 404: return "not-found";
    case 409: return "conflict";
    case 413: return "too-large";
    case 422: return "input";
    case 429: return "too-many";
    case 503: return "corpus";
    default: return "server";
  }
}
