/** Which take is open, and a list to find another in. */
import { useState } from "preact/hooks";
import type { TakeRow } from "../api/messages";
import { openTake } from "../state/actions";
import { corpus, opening, scene } from "../state/state";
import { say } from "../words";
import { formatMinutes } from "../words/numbers";
import { CheckIcon, DownIcon, NextIcon, PreviousIcon } from "./icons";
import { matchesTake } from "./matching";
import { Spinner } from "./pieces";
import { Popover } from "./popover";

/** Takes that this person may open. */
function openTakes(): TakeRow[] {
  return corpus.value?.takes.filter((one) => one.mode !== "none") ?? [];
}

export function TakePicker() {
  const takes = openTakes();
  const current = opening.value ?? scene.value?.take ?? null;
  const at = takes.findIndex((one) => one.take === current);
  const row = takes[at];
  const go = (step: 1 | -1) => {
    const next = takes[at + step];
    if (next !== undefined) void openTake(next.take);
  };
  return (
    <div class="row take-picker">
      <Popover
        label={say("top.takes")}
        role="dialog"
        class="take-menu"
        buttonClass="button-quiet take-button"
        disabled={takes.length === 0}
        button={
          <>
            <span class="elide take-name">{current ?? say("top.takes")}</span>
            {opening.value === null ? <DownIcon /> : <Spinner />}
          </>
        }
      >
        {(close) => <TakeList takes={takes} current={current} close={close} />}
      </Popover>
      <div class="button-group" role="group">
        <button type="button" class="button button-quiet button-icon button-small" disabled={at <= 0}
          aria-label={say("top.previous-take")} title={say("top.previous-take")} onClick={() => go(-1)}>
          <PreviousIcon />
        </button>
        <button type="button" class="button button-quiet button-icon button-small"
          disabled={at < 0 || at >= takes.length - 1}
          aria-label={say("top.next-take")} title={say("top.next-take")} onClick={() => go(1)}>
          <NextIcon />
        </button>
      </div>
      {row?.simulated && <span class="badge" title={say("top.simulated-hint")}>{say("top.simulated")}</span>}
      {row?.mode === "blind" && <span class="badge badge-blind" title={say("blind.text")}>{say("top.blind")}</span>}
    </div>
  );
}

function TakeList(props: { takes: TakeRow[]; current: string | null; close: () => void }) {
  const [typed, setTyped] = useState("");
  const found = props.takes.filter((one) => matchesTake(one, typed));
  const choose = (take: string) => {
    props.close();
    void openTake(take);
  };
  return (
    <>
      <input
        class="input take-search" data-first type="search" placeholder={say("top.take-search")}
        aria-label={say("top.take-search")} value={typed}
        onInput={(event) => setTyped(event.currentTarget.value)}
        onKeyDown={(event) => {
          const first = found[0];
          if (event.key === "Enter" && first !== undefined) choose(first.take);
        }}
      />
      <div class="take-list">
        {found.length === 0 && <p class="empty">{say("top.take-none")}</p>}
        {found.map((row) => (
          <button
            type="button" class="menu-item" key={row.take} disabled={row.refusal !== null}
            title={row.refusal ?? row.take}
            aria-current={row.take === props.current ? "true" : undefined} onClick={() => choose(row.take)}
          >
            <span class="grow stack take-item">
              <span class="elide">{row.take}</span>
              <span class="soft small elide">
                {row.refusal ?? [row.signer, row.protocol, formatMinutes(row.seconds)].filter(Boolean).join(" · ")}
              </span>
            </span>
            {row.mode === "blind" && <span class="badge badge-blind">{say("top.blind")}</span>}
            {row.unpublished > 0 && (
              <span class="badge" title={say("top.publish-hint", { count: row.unpublished })}>{row.unpublished}</span>
            )}
            <TakeProgress row={row} />
          </button>
        ))}
      </div>
    </>
  );
}

function TakeProgress(props: { row: TakeRow }) {
  const { reviewed, proposed, done } = props.row;
  const total = reviewed + proposed;
  if (done || (total > 0 && proposed === 0)) return <span class="take-done"><CheckIcon /></span>;
  const name = say("queue.progress", { reviewed, total });
  return (
    <span class="row take-progress" title={name}>
      <span class="meter" aria-hidden="true">
        <span style={{ width: `${total === 0 ? 0 : (100 * reviewed) / total}%` }} />
      </span>
      <span class="number small soft">{reviewed}/{total}</span>
    </span>
  );
}
