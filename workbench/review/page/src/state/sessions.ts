/** Logging in and out, and how a page begins. */
import { batch, effect } from "@preact/signals";
import { ApiError, fetchSession, get, logIn, logOut, setSession, whenSessionIsLost } from "../api/client";
import type { Scene, Session } from "../api/messages";
import { say } from "../words";
import { followActivity } from "./activity";
import { countUnsaved, onOtherTab, openOutbox, sendAgain } from "./editing";
import { tell, tellError } from "./notices";
import { fetchAgain, refresh, refreshLater } from "./refreshing";
import { applySettings } from "./settings";
import {
  corpus, draft, login, notice, page, pace, queue, saving, scene, scheme, selection, session, shownQueue, starting,
} from "./state";
import { joinTabs, tellTabs } from "./tabs";
import { findPlace, keepPlace, openTake } from "./takes";
import { followPlace, openItem } from "./walking";

let following = false;

/** Log in by the token in the address or show the login page, then load corpus, scheme and queue. */
export async function start(): Promise<void> {
  whenSessionIsLost(() => {
    if (login.value === null) login.value = session.value === null ? "needed" : "lost";
  });
  starting.value = true;
  try {
    const found = await findSession();
    if (found === null) {
      login.value = "needed";
      return;
    }
    await begin(found);
  } catch (error) {
    tellError(error);
    login.value = session.value === null ? "needed" : null;
  } finally {
    starting.value = false;
  }
}

/** Log in by name and password. Raises what the server says. */
export async function enter(person: string, password: string): Promise<void> {
  const before = session.value?.person;
  const found = await logIn({ person, password });
  if (before !== undefined && before !== found.person) {
    // Somebody else sits here now: nothing of the first person's stays in this page. Unsaved edits wait in the storage.
    location.reload();
    return;
  }
  await begin(found);
}

/** End the session; edits that are not saved yet stay in the browser for the next time. */
export async function leave(): Promise<void> {
  try {
    await logOut();
  } catch (error) {
    if (!(error instanceof ApiError && error.kind === "no-session")) {
      tellError(error);
      return;
    }
  }
  tellTabs({ kind: "logout" });
  forget();
}

function forget(): void {
  setSession(null);
  batch(() => {
    for (const one of [corpus, scheme, queue, pace, scene, draft, notice, session]) one.value = null;
    selection.value = [];
    page.value = "review";
    login.value = "needed";
  });
}

/** The token stands in the fragment: no server log holds it. It leaves the address bar and the history at once. */
async function findSession(): Promise<Session | null> {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token !== null && token !== "") {
    history.replaceState(null, "", location.pathname + location.search);
    try {
      return await logIn({ token });
    } catch (error) {
      // An old token beside a session that still holds is no reason to stop.
      if (!(error instanceof ApiError) || error.isPassing && error.kind !== "no-session") throw error;
    }
  }
  try {
    return await fetchSession();
  } catch (error) {
    if (error instanceof ApiError && error.kind === "no-session") return null;
    throw error;
  }
}

async function begin(found: Session): Promise<void> {
  const again = session.value?.person === found.person && scene.value !== null;
  batch(() => {
    session.value = found;
    login.value = null;
    applySettings(found.settings);
  });
  joinTabs(found.place, found.person, (message) => {
    if (message.kind === "draft") onOtherTab(message);
    else if (message.kind === "logout") forget();
    else {
      refreshLater("corpus", 0);
      refreshLater("draft", 100);
      refreshLater("queue", 200);
      refreshLater("scheme", 300);
    }
  });
  openOutbox(found.place, found.person);
  sendAgain();
  follow();
  // Each may fail by itself; the page shows what there is.
  const corpusThere = refresh("corpus");
  const queueThere = refresh("queue");
  void refresh("scheme");
  void refresh("pace");
  if (again) {
    await refresh("draft");
    return;
  }
  const known = findPlace();
  await corpusThere;
  const takes = corpus.value?.takes.filter((one) => one.mode !== "none" && one.refusal === null) ?? [];
  if (known !== null && takes.some((one) => one.take === known)) {
    await openTake(known);
    return;
  }
  await queueThere;
  const first = shownQueue.value[0];
  if (first !== undefined) await openItem(first);
  if (first === undefined || scene.value === null) {
    const take = takes.find((one) => one.solve !== null) ?? takes[0];
    if (take !== undefined) await openTake(take.take);
  }
}

function follow(): void {
  if (following) return;
  following = true;
  followPlace();
  followActivity();
  window.addEventListener("online", sendAgain);
  window.addEventListener("pagehide", keepPlace);
  window.addEventListener("beforeunload", (event) => {
    keepPlace();
    if (countUnsaved() > 0) event.preventDefault();
  });
  window.addEventListener("focus", () => {
    if (login.value === null && session.value !== null) followCorpus().catch(() => undefined);
  });
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) keepPlace();
    else if (login.value === null && session.value !== null) {
      refreshLater("draft", 0);
      refreshLater("queue", 100);
      refreshLater("corpus", 200);
    }
  });
  setInterval(() => {
    if (document.hidden || login.value !== null || session.value === null) return;
    fetchAgain("pace").catch(() => undefined);
    followCorpus().catch(() => undefined);
  }, 15_000);
  let stuck = false;
  effect(() => {
    const state = saving.value.state;
    if (stuck && state === "saved") tell(say("saving.recovered"));
    if (state === "unsaved") stuck = true;
    else if (state === "saved") stuck = false;
  });
}

/** See what others committed meanwhile, by the command line or from their pages, and show it. */
async function followCorpus(): Promise<void> {
  const before = corpus.value?.snapshot;
  const { snapshot } = await fetchSession();
  // Asked again: this page may have published meanwhile.
  if (before === undefined || snapshot === before || corpus.value?.snapshot !== before) return;
  await fetchAgain("corpus");
  const shown = scene.value;
  if (shown === null) return;
  refreshLater("scheme", 0);
  refreshLater("queue", 100);
  refreshLater("draft", 200);
  if (notice.value === null) tell(say("corpus.changed"));
  // Another solve may be there now; the one that is shown stays.
  const now = await get<Scene>("/api/scene", { take: shown.take, solve: shown.solve });
  if (scene.value === shown) scene.value = now;
}
