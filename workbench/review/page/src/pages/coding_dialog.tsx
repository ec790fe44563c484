/** Double coding: which share of the takes several people code without seeing each other or the machine. */
import { useEffect, useState } from "preact/hooks";
import { get, put } from "../api/client";
import type { AccountRow, CodingPlan, Overview } from "../api/messages";
import { DialogFrame } from "../shell/dialog_frame";
import { refresh } from "../state/actions";
import { describeError } from "../state/notices";
import { corpus, dialog, scheme, session } from "../state/state";
import { say } from "../words";
import { formatPercent, sayCount } from "../words/numbers";
import { useLoaded } from "./loading";
import { Message, WhenLoaded } from "./pieces";

const close = (): void => void (dialog.value = null);

/** What the form starts from. */
interface Start {
  plan: CodingPlan | null;
  people: string[];
}

/** Everybody with an account; where nobody has one, whoever has worked here. */
async function fetchStart(): Promise<Start> {
  const [plan, accounts, overview] = await Promise.all([
    get<CodingPlan | null>("/api/coding"),
    get<AccountRow[]>("/api/accounts"),
    get<Overview>("/api/overview"),
  ]);
  const active = accounts.filter((one) => one.is_active).map((one) => one.person);
  const people = [...active, ...overview.people.map((one) => one.person), ...(plan?.coders ?? [])];
  const own = session.value?.person;
  const names = [...new Set(own === undefined ? people : [...people, own])];
  return { plan: plan ?? null, people: names.sort((a, b) => a.localeCompare(b)) };
}

export function CodingDialog() {
  const start = useLoaded<Start>(fetchStart);
  return (
    <DialogFrame title={say("coding.title")} onClose={close} size="wide"
      foot={<button type="button" class="button" onClick={close}>{say("pages.close")}</button>}>
      <WhenLoaded of={start}>
        {(value) => <Plan start={value} onDone={(plan) => start.show({ ...value, plan })} />}
      </WhenLoaded>
    </DialogFrame>
  );
}

function Plan({ start, onDone }: { start: Start; onDone: (plan: CodingPlan) => void }) {
  const tiers = [...new Set((scheme.value?.vocabularies ?? []).flatMap((one) => one.tiers))];
  const before = start.plan;
  const [tier, setTier] = useState(before?.tier || tiers[0] || "affect");
  const [percent, setPercent] = useState(Math.round((before?.share ?? 0) * 100));
  const [coders, setCoders] = useState<string[]>(before?.coders ?? []);
  const [each, setEach] = useState(before?.coders_per_take ?? 2);
  const [seed, setSeed] = useState(before?.seed ?? 1);
  const [busy, setBusy] = useState(false);
  const [problem, setProblem] = useState<string | null>(null);
  const [warned, setWarned] = useState(false);

  const total = corpus.value?.takes.length ?? 0;
  const drawn = Math.round((percent / 100) * total);
  const begun = before?.takes.some((one) => one.done.length > 0) ?? false;
  const wrong = percent > 0 && coders.length < each ? say("coding.few", { each }) : null;
  useEffect(() => setWarned(false), [tier, percent, coders, each, seed]);

  const save = async (): Promise<void> => {
    if (begun && !warned) {
      setWarned(true);
      return;
    }
    setBusy(true);
    setProblem(null);
    try {
      const body = { tier, share: percent / 100, coders, coders_per_take: each, seed, takes: [] };
      onDone(await put<CodingPlan>("/api/coding", body));
      await Promise.all([refresh("corpus"), refresh("queue")]);
    } catch (thrown) {
      setProblem(describeError(thrown));
    }
    setWarned(false);
    setBusy(false);
  };

  return (
    <div class="stack">
      <p class="soft">{say("coding.explained")}</p>
      {problem !== null && <Message tone="error">{problem}</Message>}
      <form
        class="pages-coding"
        onSubmit={(event) => { event.preventDefault(); if (wrong === null && !busy) void save(); }}
      >
        <label class="field">
          <span>{say("coding.tier")}</span>
          <select class="select" value={tier} onChange={(event) => setTier(event.currentTarget.value)}>
            {[...new Set([...tiers, tier])].map((one) => <option key={one} value={one}>{one}</option>)}
          </select>
        </label>
        <label class="field">
          <span>{say("coding.share")}</span>
          <span class="row">
            <input type="range" class="grow" min={0} max={100} step={5} value={percent} aria-valuetext={`${percent} %`}
              onInput={(event) => setPercent(Number(event.currentTarget.value))} />
            <strong class="number">{percent} %</strong>
          </span>
          <span class="soft small">{sayCount("coding.takes", drawn, { total })}</span>
        </label>
        <label class="field">
          <span>{say("coding.each")}</span>
          <input type="number" class="input" min={2} max={Math.max(2, start.people.length)} value={each}
            onInput={(event) => setEach(Math.max(2, Math.round(event.currentTarget.valueAsNumber) || 2))} />
        </label>
        <label class="field">
          <span>{say("coding.seed")}</span>
          <input type="number" class="input" min={0} max={2147483647} step={1} value={seed}
            onInput={(event) => setSeed(Math.max(0, Math.round(event.currentTarget.valueAsNumber) || 0))} />
          <span class="soft small">{say("coding.seed.explained")}</span>
        </label>
        <fieldset class="field pages-people">
          <legend>{say("coding.coders")}</legend>
          {start.people.map((person) => (
            <label key={person} class="check">
              <input
                type="checkbox"
                checked={coders.includes(person)}
                onChange={(event) => {
                  const others = coders.filter((one) => one !== person);
                  setCoders(event.currentTarget.checked ? [...others, person] : others);
                }}
              />
              {person}
            </label>
          ))}
          {start.people.length < 2 && <p class="soft small">{say("coding.nobody")}</p>}
        </fieldset>
        <div class="row pages-coding-do">
          <button type="submit" class="button button-primary" disabled={busy || wrong !== null}>
            {warned ? say("coding.do.really") : say("coding.do")}
          </button>
          <span class={warned || wrong !== null ? "pages-problem" : "soft small"} aria-live="polite">
            {wrong ?? (warned ? say("coding.begun") : "")}
          </span>
        </div>
      </form>
      {before !== null && before.takes.length > 0 && <Drawn plan={before} />}
    </div>
  );
}

function Drawn({ plan }: { plan: CodingPlan }) {
  const done = plan.takes.reduce((sum, one) => sum + one.done.length, 0);
  const all = plan.takes.reduce((sum, one) => sum + one.coders.length, 0);
  return (
    <section class="stack">
      <h3>
        {sayCount("coding.drawn", plan.takes.length)}{" "}
        <span class="soft">
          {say("coding.finished", { done, all, part: formatPercent(all > 0 ? done / all : 0) })}
        </span>
      </h3>
      <div class="table-scroll">
        <table class="table">
          <thead><tr><th scope="col">{say("overview.take")}</th><th scope="col">{say("coding.coders")}</th></tr></thead>
          <tbody>
            {plan.takes.map((one) => (
              <tr key={one.take}>
                <td>{one.take}</td>
                <td>
                  <span class="row row-wrap">
                    {one.coders.map((person) => (
                      <span
                        key={person}
                        class={`badge ${one.done.includes(person) ? "badge-reviewed" : "badge-blind"}`}
                      >
                        {person} {one.done.includes(person) ? `✓ ${say("coding.done")}` : say("coding.at_work")}
                      </span>
                    ))}
                  </span>
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}
