/** The lead's overview: how far everybody is, what it takes, how well people agree, and what is left to settle. */
import { useMemo, useState } from "preact/hooks";
import { get } from "../api/client";
import type { Overview } from "../api/messages";
import { showPage } from "../shell/main_menu";
import { openTake } from "../state/actions";
import { dialog, page, scene, settling } from "../state/state";
import { say } from "../words";
import { formatAgo, formatDuration, formatNumber, formatPercent, formatFixed, sayCount } from "../words/numbers";
import { useLoaded } from "./loading";
import { WhenLoaded } from "./pieces";
import { sumUp } from "./progress";

/** Takes that are listed at once; more are shown when asked for. */
const ROWS_AT_ONCE = 100;

/** Show a take in the review. */
function review(take: string): void {
  showPage("review");
  if (take !== scene.value?.take) void openTake(take);
}

export function OverviewPage() {
  const overview = useLoaded<Overview>(() => get("/api/overview"));
  return (
    <main class="page pages-overview" aria-labelledby="overview-title">
      <header class="page-head">
        <button type="button" class="button" onClick={() => showPage("review")}>← {say("overview.back")}</button>
        <h1 id="overview-title" class="grow">{say("overview.title")}</h1>
        <button type="button" class="button" onClick={() => (dialog.value = "coding")}>{say("overview.coding")}</button>
        <button type="button" class="button" onClick={() => (dialog.value = "accounts")}>
          {say("overview.accounts")}
        </button>
        <button type="button" class="button" onClick={() => (dialog.value = "scheme")}>{say("overview.scheme")}</button>
        <button
          type="button"
          class="button"
          disabled={overview.loading}
          onClick={() => void overview.reload()}
        >
          {say("overview.reload")}
        </button>
      </header>
      <div class="page-body">
        <WhenLoaded of={overview}>{(value) => <Body of={value} />}</WhenLoaded>
      </div>
    </main>
  );
}

function Body({ of }: { of: Overview }) {
  const sum = useMemo(() => sumUp(of), [of]);
  return (
    <div class="pages-overview-body">
      <dl class="pages-sums">
        <Sum
          name={say("overview.takes.touched")}
          value={`${formatNumber(sum.begun)} / ${formatNumber(of.takes.length)}`}
          part={of.takes.length > 0 ? sum.begun / of.takes.length : 0}
        />
        <Sum
          name={say("overview.reviewed")}
          value={`${formatNumber(sum.reviewed)} / ${formatNumber(sum.segments)}`}
          part={sum.segments > 0 ? sum.reviewed / sum.segments : 0}
        />
        <Sum name={say("overview.unpublished")} value={formatNumber(sum.unpublished)} />
        <Sum name={say("overview.work")} value={formatDuration(sum.active)} />
        <Sum name={say("overview.to_settle")} value={formatNumber(sum.open)} />
      </dl>
      <div class="pages-columns">
        <People of={of} />
        <div class="stack pages-gap">
          <ToSettle of={of} />
          <Agreement of={of} />
        </div>
      </div>
      <Takes of={of} />
    </div>
  );
}

function Sum({ name, value, part }: { name: string; value: string; part?: number }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd class="number">{value}</dd>
      {part !== undefined && (
        <dd class="pages-sum-part" aria-hidden="true">
          <span class="meter"><span style={{ width: `${100 * part}%` }} /></span>
        </dd>
      )}
    </div>
  );
}

function People({ of }: { of: Overview }) {
  const now = Date.now();
  return (
    <section class="stack">
      <h2>{say("overview.people")}</h2>
      {of.people.length === 0 ? <p class="empty">{say("overview.nobody")}</p> : (
        <div class="table-scroll">
          <table class="table">
            <thead>
              <tr>
                <th scope="col">{say("accounts.person")}</th>
                <th scope="col" class="number">{say("overview.takes")}</th>
                <th scope="col" class="number">{say("overview.reviewed.head")}</th>
                <th scope="col" class="number" title={say("overview.edits.explained")}>{say("overview.edits")}</th>
                <th scope="col" class="number">{say("overview.work.short")}</th>
                <th scope="col" class="number" title={say("overview.per_minute.explained")}>
                  {say("overview.per_minute")}
                </th>
                <th scope="col">{say("overview.last")}</th>
              </tr>
            </thead>
            <tbody>
              {of.people.map((one) => (
                <tr key={one.person}>
                  <td>
                    <strong>{one.person}</strong>
                    {one.is_lead && <span class="badge pages-after">{say("accounts.lead")}</span>}
                  </td>
                  <td class="number">{formatNumber(one.takes)}</td>
                  <td class="number">{formatNumber(one.reviewed)}</td>
                  <td class="number">
                    {formatNumber(one.edits)}
                    {one.unpublished > 0 && (
                      <span class="soft small" title={say("overview.unpublished")}>
                        {" "}({formatNumber(one.unpublished)}&nbsp;↑)
                      </span>
                    )}
                  </td>
                  <td class="number">{formatDuration(one.active_seconds)}</td>
                  <td class="number">
                    {one.seconds_per_minute === null ? "–" : formatDuration(one.seconds_per_minute)}
                  </td>
                  <td class="soft" title={one.last_active ?? ""}>{formatAgo(one.last_active, now)}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
      <p class="soft small">{say("overview.per_minute.explained")}</p>
    </section>
  );
}

function ToSettle({ of }: { of: Overview }) {
  const settle = (one: Overview["to_settle"][number]): void => {
    settling.value = { take: one.take, tier: one.tier, first: one.first, second: one.second };
    page.value = "adjudication";
  };
  return (
    <section class="stack">
      <h2>{say("overview.to_settle")}</h2>
      {of.to_settle.length === 0 ? <p class="empty pages-quiet">{say("overview.settled_all")}</p> : (
        <div class="table-scroll">
          <table class="table">
            <thead>
              <tr>
                <th scope="col">{say("overview.take")}</th>
                <th scope="col">{say("overview.between")}</th>
                <th scope="col" class="number">{say("overview.disagreements")}</th>
                <th scope="col"><span class="visually-hidden">{say("scheme.actions")}</span></th>
              </tr>
            </thead>
            <tbody>
              {of.to_settle.map((one) => {
                const open = one.disagreements - one.settled;
                return (
                  <tr key={JSON.stringify([one.take, one.tier, one.first, one.second])}>
                    <td>{one.take} <span class="soft">{one.tier}</span></td>
                    <td class="pages-pair">{one.first} – {one.second}</td>
                    <td class="number" title={formatDuration(one.seconds)}>
                      {open === 0
                        ? <span class="badge badge-reviewed">✓ {say("overview.all_settled")}</span>
                        : `${formatNumber(one.settled)} / ${formatNumber(one.disagreements)}`}
                    </td>
                    <td class="pages-actions">
                      <button
                        type="button"
                        class={`button button-small${open > 0 ? "" : " button-quiet"}`}
                        onClick={() => settle(one)}
                        aria-label={`${say("overview.settle")}: ${one.take}, ${one.tier}, ${one.first} – ${one.second}`}
                      >
                        {open > 0 ? say("overview.settle") : say("overview.look")}
                      </button>
                    </td>
                  </tr>
                );
              })}
            </tbody>
          </table>
        </div>
      )}
    </section>
  );
}

function Agreement({ of }: { of: Overview }) {
  return (
    <section class="stack">
      <h2>{say("overview.agreement")}</h2>
      {of.agreement.length === 0 ? <p class="empty pages-quiet">{say("overview.no_agreement")}</p> : (
        <>
          <div class="table-scroll">
            <table class="table">
              <thead>
                <tr>
                  <th scope="col">{say("overview.between")}</th>
                  <th scope="col" class="number" title={say("overview.kappa.explained")}>κ</th>
                  <th scope="col" class="number" title={say("overview.alpha.explained")}>α</th>
                  <th scope="col" class="number" title={say("overview.same.explained")}>{say("overview.same")}</th>
                  <th scope="col" class="number" title={say("overview.f1.explained")}>F1@50</th>
                  <th scope="col" class="number">{say("overview.takes")}</th>
                </tr>
              </thead>
              <tbody>
                {of.agreement.map((one) => (
                  <tr key={JSON.stringify([one.tier, one.first, one.second])}>
                    <td>
                      <span class="pages-pair">{one.first} – {one.second}</span> <span class="soft">{one.tier}</span>
                    </td>
                    <td class="number"><strong>{formatFixed(one.kappa, 2)}</strong></td>
                    <td class="number">{formatFixed(one.alpha, 2)}</td>
                    <td class="number">{formatPercent(one.agreement)}</td>
                    <td class="number">{formatFixed(one.f1_50, 2)}</td>
                    <td class="number" title={formatDuration(one.seconds)}>{formatNumber(one.takes)}</td>
                  </tr>
                ))}
              </tbody>
            </table>
          </div>
          <p class="soft small">{say("overview.agreement.explained")}</p>
        </>
      )}
    </section>
  );
}

function Takes({ of }: { of: Overview }) {
  const [sought, setSought] = useState("");
  const [shown, setShown] = useState(ROWS_AT_ONCE);
  const people = useMemo(() => {
    const named = new Set(of.takes.flatMap((one) => one.by.map((each) => each.person)));
    return [...named].sort((a, b) => a.localeCompare(b));
  }, [of]);
  const words = sought.trim().toLowerCase();
  const found = of.takes.filter((one) =>
    [one.take, one.signer ?? "", one.protocol ?? ""].some((text) => text.toLowerCase().includes(words)),
  );
  return (
    <section class="stack">
      <div class="row spread">
        <h2>{say("overview.takes.all")}</h2>
        <input
          type="search"
          class="input"
          value={sought}
          placeholder={say("overview.find")}
          aria-label={say("overview.find")}
          onInput={(event) => { setSought(event.currentTarget.value); setShown(ROWS_AT_ONCE); }}
        />
      </div>
      <div class="table-scroll">
        <table class="table">
          <thead>
            <tr>
              <th scope="col">{say("overview.take")}</th>
              <th scope="col">{say("overview.signer")}</th>
              <th scope="col" class="number">{say("overview.length")}</th>
              {people.map((one) => <th key={one} scope="col">{one}</th>)}
            </tr>
          </thead>
          <tbody>
            {found.slice(0, shown).map((one) => (
              <tr key={one.take}>
                <td>
                  <button
                    type="button"
                    class="button button-small button-quiet pages-open-take"
                    title={say("overview.open")}
                    onClick={() => review(one.take)}
                  >
                    {one.take}
                  </button>
                </td>
                <td class="soft">{[one.signer, one.protocol].filter((text) => text !== null).join(" · ")}</td>
                <td class="number">{formatDuration(one.seconds)}</td>
                {people.map((person) => (
                  <td key={person}><Cell of={one.by.find((each) => each.person === person)} /></td>
                ))}
              </tr>
            ))}
          </tbody>
        </table>
        {found.length === 0 && <p class="empty">{say("overview.none")}</p>}
      </div>
      {found.length > shown && (
        <button type="button" class="button" onClick={() => setShown(shown + 5 * ROWS_AT_ONCE)}>
          {sayCount("overview.more", found.length - shown)}
        </button>
      )}
    </section>
  );
}

function Cell({ of }: { of: Overview["takes"][number]["by"][number] | undefined }) {
  if (of === undefined || (of.mode === "none" && of.segments === 0)) return <span class="soft">–</span>;
  const part = of.segments > 0 ? of.reviewed / of.segments : 0;
  return (
    <span class="row pages-cell">
      {of.mode === "blind" && <span class="badge badge-blind">{say("overview.blind")}</span>}
      {of.done && <span class="badge badge-reviewed">✓ {say("coding.done")}</span>}
      {!(of.mode === "blind" && of.segments === 0) && (
        <span class="row" title={of.mode === "blind" ? "" : `${formatPercent(part)} ${say("overview.reviewed.short")}`}>
          {of.mode !== "blind" && (
            <span class="meter" aria-hidden="true"><span style={{ width: `${100 * part}%` }} /></span>
          )}
          <span class="number small">
            {of.mode === "blind"
              ? sayCount("overview.segments", of.segments)
              : `${formatNumber(of.reviewed)} / ${formatNumber(of.segments)}`}
          </span>
        </span>
      )}
      {of.unpublished > 0 && (
        <span class="soft small number" title={say("overview.unpublished")}>
          {formatNumber(of.unpublished)}&nbsp;↑
        </span>
      )}
    </span>
  );
}
