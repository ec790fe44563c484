/**
 * Adjudication: where two people read a take differently, one place after the other, with the face, both readings and
 * what is settled under each other. What is settled goes into the draft of the author "adjudicated".
 */
import { useEffect, useRef, useState } from "preact/hooks";
import { get } from "../api/client";
import type { Adjudication } from "../api/messages";
import { describeKeys } from "../keyboard/bindings";
import { findVocabulary } from "../labels/labels";
import { findCommand, forget, register } from "../keyboard/commands";
import { showPage } from "../shell/main_menu";
import { Key } from "../shell/pieces";
import { Stage } from "../stage/stage";
import { Transport } from "../stage/transport";
import { edit, openTake, undo } from "../state/actions";
import { activeTier, clock, dialog, draft, marked, purpose, saving, scene, scheme, settling } from "../state/state";
import { say } from "../words";
import { formatLength, formatTime, sayCount } from "../words/numbers";
import {
  type Disagreement, chooseWindow, findCandidates, findFirst, findNearest, findNext, findPart, findRest,
} from "./disagreements";
import { Lanes } from "./lanes";
import { type Loaded, useLoaded } from "./loading";
import { LabelName, Message, WhenLoaded } from "./pieces";

export function AdjudicationPage() {
  const what = settling.value;
  return what === null ? <Nothing /> : <Settling key={JSON.stringify(what)} of={what} />;
}

function Nothing() {
  return (
    <main class="page">
      <p class="empty">{say("settle.none")}</p>
      <p class="empty">
        <button type="button" class="button" onClick={() => showPage("overview")}>{say("settle.to_overview")}</button>
      </p>
    </main>
  );
}

interface SettlingProps {
  of: { take: string; tier: string; first: string; second: string };
}

function Settling({ of }: SettlingProps) {
  const both = useLoaded<Adjudication>(() => get("/api/adjudication", { ...of }));
  const version = draft.value?.purpose === "adjudication" && draft.value.take === of.take ? draft.value.version : null;

  useEffect(() => {
    purpose.value = "adjudication";
    void openTake(of.take, { tier: of.tier }).then(() => {
      if (purpose.value === "adjudication") activeTier.value = of.tier;
    });
  }, []);
  // What is settled is known at the server; every edit, undo and redo may change it.
  const seen = useRef<number | null>(null);
  useEffect(() => {
    if (version !== null && seen.current !== null && seen.current !== version) void both.reload();
    seen.current = version;
  }, [version]);

  return (
    <main class="page pages-adjudication" aria-labelledby="settle-title">
      <header class="page-head">
        <button type="button" class="button" onClick={() => showPage("overview")}>← {say("overview.title")}</button>
        <h1 id="settle-title" class="elide grow">
          {say("settle.title")} <span class="soft">{of.take} · {of.tier}</span>
        </h1>
        {both.value !== null && <Progress of={both.value.disagreements} />}
        <button
          type="button"
          class="button"
          disabled={draft.value?.undo == null}
          onClick={() => void undo()}
        >
          {say("settle.undo")}
        </button>
      </header>
      {both.value === null ? (
        <div class="page-body"><WhenLoaded of={both}>{() => null}</WhenLoaded></div>
      ) : (
        <Compare both={both} of={both.value} ready={version !== null} />
      )}
    </main>
  );
}

function Progress({ of }: { of: Disagreement[] }) {
  const settled = of.filter((one) => one.settled).length;
  return (
    <span class="row" role="status">
      <span class="meter pages-wide-meter" aria-hidden="true">
        <span style={{ width: `${of.length > 0 ? (100 * settled) / of.length : 100}%` }} />
      </span>
      <span class="number">{say("settle.progress", { settled, all: of.length })}</span>
    </span>
  );
}

interface CompareProps {
  both: Loaded<Adjudication>;
  of: Adjudication;
  /** Whether the draft that settles it is there. */
  ready: boolean;
}

function Compare({ both, of, ready }: CompareProps) {
  const all = of.disagreements;
  const [index, setIndex] = useState(() => findFirst(all));
  const [busy, setBusy] = useState(false);
  const at = Math.min(index, Math.max(0, all.length - 1));
  const current = all[at];
  const part = current === undefined ? null : findPart(current, marked.value);
  const labels = (findVocabulary(scheme.value, of.tier)?.labels ?? []).filter((one) => !one.retired);

  /** Show one of them: in and out around it, so that the keys of labels settle it, and played over and over. */
  const show = (to: number | null, play = true): void => {
    const one = to === null ? undefined : all[to];
    if (to === null || one === undefined) return;
    setIndex(to);
    marked.value = { onset: one.onset, offset: one.offset };
    const shown = chooseWindow(one, clock.frames, clock.rate);
    clock.setLoop({ onset: Math.floor(shown.first), offset: Math.ceil(shown.last) });
    clock.seek(Math.floor(shown.first));
    if (play) clock.play();
  };
  useEffect(() => {
    if (!ready) return;
    show(at, false);
    return () => {
      clock.pause();
      clock.setLoop(null);
      marked.value = { onset: null, offset: null };
    };
  }, [ready]);

  // On to the next one as soon as the server says that this one is settled; back to one that an undo has opened.
  const before = useRef(all);
  const settledPart = useRef(part);
  useEffect(() => {
    const was = before.current;
    before.current = all;
    if (!ready || was === all || current === undefined) return;
    const opened = all.findIndex((one, each) => !one.settled && was[each]?.settled === true);
    if (opened >= 0) show(opened, false);
    else if (current.settled && was[at]?.settled === false) show(findNext(all, at, 1, true));
    else if (!current.settled) marked.value = findRest(current, settledPart.current);
  }, [all]);
  // In and out never fall away: without them the keys of labels would mean another segment.
  useEffect(() => {
    if (part !== null) settledPart.current = part;
    const { onset, offset } = marked.value;
    if (ready && current !== undefined && onset === null && offset === null) {
      marked.value = { onset: current.onset, offset: current.offset };
    }
  }, [marked.value, ready, at]);

  const settle = async (label: string | null): Promise<void> => {
    if (part === null || busy || !ready) return;
    setBusy(true);
    await edit({ kind: "settle", tier: of.tier, onset: part.onset, offset: part.offset, label });
    setBusy(false);
  };
  const step = (by: 1 | -1): void => show(findNext(all, at, by, false));
  const choices = current === undefined ? [] : listChoices(current, of, labels.map((one) => one.label));
  const readings = choices.filter((one) => one.label !== null && one.who.length > 0);
  useSettleKeys({
    next: () => step(1), previous: () => step(-1), nothing: () => settle(null),
    readings: READINGS.map((_, place) => () => {
      const reading = readings[place];
      return reading === undefined ? undefined : settle(reading.label);
    }),
  });

  return (
    <div class="pages-settle">
      <List
        all={all}
        at={at}
        tier={of.tier}
        rate={clock.rate}
        names={[of.first.author, of.second.author]}
        onShow={show}
      />
      <div class="pages-settle-middle">
        <div class="pages-settle-stage"><Stage /></div>
        <Transport />
        {current !== undefined && part !== null && scene.value !== null && (
          <Lanes
            of={of}
            settled={draft.value?.tiers.find((one) => one.tier === of.tier)?.segments ?? []}
            current={current}
            part={part}
            frames={scene.value.frames}
            rate={scene.value.rate}
            onChoose={(frame) => show(findNearest(all, frame))}
          />
        )}
      </div>
      <aside class="pages-settle-choice" aria-label={say("settle.choice")}>
        {both.error !== null && <Message tone="error">{both.error}</Message>}
        {current === undefined || part === null ? (
          <p class="empty">{say("settle.agree")}</p>
        ) : (
          <>
            <div class="row spread">
              <h2>{say("settle.place", { at: at + 1, all: all.length })}</h2>
              {current.settled && <span class="badge badge-adjudicated">✓✓ {say("settle.settled")}</span>}
            </div>
            <div class="pages-settle-part">
              <span class="number soft">
                {formatTime(part.onset, clock.rate)} – {formatTime(part.offset, clock.rate)} ·{" "}
                {formatLength(part.offset - part.onset, clock.rate)}
              </span>
              {part.onset !== current.onset || part.offset !== current.offset ? (
                <button
                  type="button"
                  class="button button-small"
                  onClick={() => (marked.value = { onset: current.onset, offset: current.offset })}
                >
                  {say("settle.whole")}
                </button>
              ) : (
                <span class="soft small">
                  {say("settle.part", {
                    keys: [describeKeys("edit.set-in"), describeKeys("edit.set-out")].join(" / "),
                  })}
                </span>
              )}
            </div>
            <div class="stack" role="group" aria-label={say("settle.question")}>
              <h3>{say("settle.question")}</h3>
              {choices.map((one) => (
                <button
                  key={JSON.stringify(one.label)}
                  type="button"
                  class={`button button-wide pages-pick${one.who.length > 0 ? " pages-pick-said" : ""}`}
                  disabled={!ready || busy || saving.value.state === "unsaved"}
                  onClick={() => void settle(one.label)}
                >
                  <LabelName label={one.label} tier={of.tier} />
                  <span class="soft small elide grow">{one.who.join(", ")}</span>
                  <Key keys={describeChoice(one, readings.indexOf(one))} />
                </button>
              ))}
            </div>
            <div class="row pages-settle-steps">
              <button
                type="button"
                class="button grow"
                disabled={at === 0}
                onClick={() => step(-1)}
              >
                ← {say("settle.previous")} <Key keys={describeKeys("queue.previous")} />
              </button>
              <button
                type="button"
                class="button grow"
                disabled={at === all.length - 1}
                onClick={() => step(1)}
              >
                {say("settle.next")} → <Key keys={describeKeys("queue.next")} />
              </button>
            </div>
            {all.every((one) => one.settled) && (
              <Message tone="info">
                <div class="stack">
                  {say("settle.done")}
                  <button
                    type="button"
                    class="button button-primary"
                    onClick={() => (dialog.value = "publish")}
                  >
                    {say("settle.publish")}
                  </button>
                </div>
              </Message>
            )}
          </>
        )}
      </aside>
    </div>
  );
}

interface SettleKeys {
  next: () => void;
  previous: () => void;
  nothing: () => void | Promise<unknown>;
  readings: (() => void | Promise<unknown>)[];
}

/** What the coders said has keys of its own: their labels may be none of the scheme's, as a transition is. */
const READINGS = [
  { id: "settle.first", key: "E", name: "settle.first" },
  { id: "settle.second", key: "R", name: "settle.second" },
] as const;

/** The keys of a choice: of a reading, and of its label where that has one. */
function describeChoice(one: PickChoice, place: number): string {
  if (one.label === null) return describeKeys("settle.nothing");
  const reading = READINGS[place];
  return [reading === undefined ? "" : describeKeys(reading.id), describeKeys(`label:${one.label}`)]
    .filter((keys) => keys !== "")
    .join(" / ");
}

/** While the page is shown, the queue's keys walk through the disagreements, and one more says that nothing holds. */
function useSettleKeys(keys: SettleKeys): void {
  const now = useRef(keys);
  now.current = keys;
  useEffect(() => {
    const usual = ["queue.next", "queue.previous"].flatMap((id) => findCommand(id) ?? []);
    const [next, previous] = usual;
    if (next !== undefined) register({ ...next, run: () => now.current.next() });
    if (previous !== undefined) register({ ...previous, run: () => now.current.previous() });
    register({
      id: "settle.nothing", group: "label", name: "settle.nothing", keys: ["X"], run: () => now.current.nothing(),
    });
    READINGS.forEach(({ id, key, name }, place) => {
      register({ id, group: "label", name, keys: [key], run: () => now.current.readings[place]?.() });
    });
    return () => {
      register(...usual);
      forget("settle.nothing", ...READINGS.map((one) => one.id));
    };
  }, []);
}

interface PickChoice {
  label: string | null;
  /** Who said so. */
  who: string[];
}

/** The two readings first, then nothing, then every other label. */
function listChoices(one: Disagreement, of: Adjudication, labels: string[]): PickChoice[] {
  const whoSaid = (label: string | null): string[] => [
    ...(one.first === label ? [of.first.author] : []),
    ...(one.second === label ? [of.second.author] : []),
  ];
  const said = findCandidates(one, []);
  const rest = labels.filter((label) => !said.includes(label));
  return [...said, null, ...rest].map((label) => ({ label, who: whoSaid(label) }));
}

interface ListProps {
  all: Disagreement[];
  at: number;
  tier: string;
  rate: number;
  names: [string, string];
  onShow: (index: number) => void;
}

function List({ all, at, tier, rate, names, onShow }: ListProps) {
  const chosen = useRef<HTMLButtonElement>(null);
  useEffect(() => chosen.current?.scrollIntoView({ block: "nearest" }), [at]);
  return (
    <nav class="pages-settle-list" aria-label={say("overview.disagreements")}>
      <p class="soft small pages-settle-names">{sayCount("settle.count", all.length)} · {names[0]} – {names[1]}</p>
      <ol>
        {all.map((one, index) => (
          <li key={one.onset}>
            <button
              ref={index === at ? chosen : undefined}
              type="button"
              class="pages-settle-row"
              aria-current={index === at || undefined}
              onClick={() => onShow(index)}
            >
              <span class="row spread">
                <span class="number small soft">{formatTime(one.onset, rate)}</span>
                <span class="small soft">
                  {one.settled ? `✓ ${say("settle.settled")}` : formatLength(one.offset - one.onset, rate)}
                </span>
              </span>
              <span class="row pages-settle-pair">
                <LabelName
                  label={one.first}
                  tier={tier}
                /><span class="soft" aria-hidden="true">≠</span><LabelName label={one.second} tier={tier} />
              </span>
            </button>
          </li>
        ))}
      </ol>
    </nav>
  );
}
