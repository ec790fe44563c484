/** The left column: what is to review, filtered and in order, and how much is left. */
import { useState } from "preact/hooks";
import { saveSettings } from "../state/actions";
import { countFilters, type Filters } from "../state/queue";
import { draft, filters, pace, queue, session, shownQueue } from "../state/state";
import { say } from "../words";
import { formatNumber } from "../words/numbers";
import { DownIcon, LoopIcon } from "./icons";
import { listValues } from "./matching";
import { Command, Spinner } from "./pieces";
import { QueueList } from "./queue_list";

const NO_FILTERS = { label: null, signer: null, status: "proposed", confidence: 1, take: "all" } as const;

export function QueuePanel() {
  const items = shownQueue.value;
  const [isOpen, setOpen] = useState(false);
  const count = countFilters(filters.value);
  return (
    <aside class="column column-left" data-region="" tabIndex={-1} aria-label={say("app.queue")}>
      <div class="column-head">
        <h2>{say("queue.title")}</h2>
        <span class="soft number" data-count={items.length}>{formatNumber(items.length)}</span>
        <span class="grow" />
        {queue.value !== null && !queue.value.ready && queue.value.items.length > 0 && (
          <span title={say("queue.counting")}><Spinner /></span>
        )}
        <button type="button" class="button button-small button-quiet" aria-expanded={isOpen}
          onClick={() => setOpen(!isOpen)}>
          {count === 0 ? say("queue.filters") : say("queue.filters-set", { count })} <DownIcon />
        </button>
      </div>
      <div class="queue-order">
        <select class="select button-wide" aria-label={say("queue.order")} value={filters.value.order}
          onChange={(event) => set({ order: event.currentTarget.value as Filters["order"] })}>
          <option value="usefulness">{say("queue.order-usefulness")}</option>
          <option value="time">{say("queue.order-time")}</option>
        </select>
      </div>
      {isOpen && <FilterFields count={count} />}
      {items.length > 0 ? <QueueList /> : <Nothing count={count} />}
      <Foot />
    </aside>
  );
}

function set(change: Partial<Filters>): void {
  filters.value = { ...filters.value, ...change };
}

function FilterFields(props: { count: number }) {
  const now = filters.value;
  const items = queue.value?.items ?? [];
  const labels = listValues([...items.map((one) => one.label), now.label]);
  const signers = listValues([...items.map((one) => one.signer), now.signer]);
  const percent = Math.round(now.confidence * 100);
  return (
    <div class="filters">
      <Choice name={say("queue.status")} value={now.status}
        onChange={(value) => set({ status: value as Filters["status"] })}
        options={(["proposed", "reviewed", "all"] as const).map((one) => [one, say(`queue.status-${one}`)])} />
      <Choice name={say("queue.take")} value={now.take} onChange={(value) => set({ take: value as Filters["take"] })}
        options={(["all", "this"] as const).map((one) => [one, say(`queue.take-${one}`)])} />
      <Choice name={say("queue.label")} value={now.label ?? ""}
        onChange={(value) => set({ label: value === "" ? null : value })}
        options={[["", say("queue.label-all")], ...labels.map((one): [string, string] => [one, one])]} />
      <Choice name={say("queue.signer")} value={now.signer ?? ""}
        onChange={(value) => set({ signer: value === "" ? null : value })}
        options={[["", say("queue.signer-all")], ...signers.map((one): [string, string] => [one, one])]} />
      <label class="field filters-wide">
        <span class="row spread"><span>{say("queue.confidence")}</span><span class="number">{percent} %</span></span>
        <input type="range" aria-label={say("queue.confidence")} aria-valuetext={`${percent} %`} min="5" max="100"
          step="5" value={percent}
          onInput={(event) => set({ confidence: Number(event.currentTarget.value) / 100 })} />
      </label>
      {props.count > 0 && (
        <button type="button" class="button button-small filters-wide" onClick={() => set(NO_FILTERS)}>
          {say("queue.clear")}
        </button>
      )}
    </div>
  );
}

interface ChoiceProps {
  name: string;
  value: string;
  options: [string, string][];
  onChange: (value: string) => void;
}

function Choice(props: ChoiceProps) {
  return (
    <label class="field">
      <span>{props.name}</span>
      <select class="select" aria-label={props.name} value={props.value}
        onChange={(event) => props.onChange(event.currentTarget.value)}>
        {props.options.map(([value, text]) => <option key={value} value={value}>{text}</option>)}
      </select>
    </label>
  );
}

function Nothing(props: { count: number }) {
  if (queue.value === null) return <div class="queue-nothing"><Spinner /></div>;
  const remaining = queue.value.items.some((one) => one.status === "proposed");
  const text =
    queue.value.items.length === 0 ? say(draft.value?.mode === "blind" ? "queue.none-blind" : "queue.empty")
    : props.count > 0 ? say("queue.nothing-filtered")
    : remaining ? say("queue.nothing") : say("queue.all-done");
  const isNew = queue.value.items.length === 0 && draft.value !== null && draft.value.mode !== "blind";
  return (
    <div class="queue-nothing">
      <p class="empty">{text}</p>
      {isNew && <p class="empty small queue-hint">{say("queue.empty-hint")} <Command text="mimique label CORPUS" /></p>}
      {props.count > 0 && (
        <button type="button" class="button button-small" onClick={() => set(NO_FILTERS)}>{say("queue.clear")}</button>
      )}
    </div>
  );
}

function Foot() {
  const now = pace.value;
  const plays = session.value?.settings["playOnArrival"] === true;
  const total = now === null ? 0 : now.reviewed + now.remaining;
  return (
    <div class="column-foot stack">
      <button type="button" class="button button-small button-wide" aria-pressed={plays}
        onClick={() => void saveSettings({ playOnArrival: !plays })}>
        <LoopIcon /> {say("queue.play")}
      </button>
      {now !== null && total > 0 && (
        <div class="row small soft">
          <span class="meter grow" aria-hidden="true">
            <span class="meter-good" style={{ width: `${(100 * now.reviewed) / total}%` }} />
          </span>
          <span class="number">
            {say("queue.progress", { reviewed: formatNumber(now.reviewed), total: formatNumber(total) })}
          </span>
        </div>
      )}
    </div>
  );
}
