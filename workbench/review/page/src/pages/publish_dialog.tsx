/** Publishing: what would become one commit, what others changed meanwhile and how to settle it, then the commit. */
import { useEffect, useRef, useState } from "preact/hooks";
import { ApiError, get, post } from "../api/client";
import type { PublishAnswer, PublishChange, PublishConflict, PublishPlan } from "../api/messages";
import { DialogFrame } from "../shell/dialog_frame";
import { openTake, refresh, tellTabs } from "../state/actions";
import { describeError } from "../state/notices";
import { corpus, dialog, notice, page, purpose, saving, unpublished } from "../state/state";
import { say } from "../words";
import { formatTime, sayCount } from "../words/numbers";
import { useLoaded } from "./loading";
import { Message, Strip, WhenLoaded } from "./pieces";
import {
  type TierChanges, countKinds, describeChange, groupChanges, isDecided, keepChoices, proposeMessage,
} from "./publish_plan";

/** Changes of one tier that are drawn at once; more are shown when asked for. */
const ROWS_AT_ONCE = 100;

const rateOf = (take: string): number => corpus.value?.takes.find((one) => one.take === take)?.rate ?? NaN;
const close = (): void => void (dialog.value = null);

export function PublishDialog() {
  const plan = useLoaded<PublishPlan>(() => get("/api/publish"));
  const [choices, setChoices] = useState<Record<string, string>>({});
  const [message, setMessage] = useState<string | null>(null);
  const [busy, setBusy] = useState(false);
  const [problem, setProblem] = useState<string | null>(null);
  const unsaved = saving.value.state !== "saved";
  const field = useRef<HTMLInputElement>(null);
  const known = plan.value !== null;

  // Enter publishes what is shown, not what the key that opened the dialog was meant for.
  useEffect(() => {
    if (known) field.current?.focus();
  }, [known]);
  // What was in flight when the dialog opened is part of the plan once it is saved.
  useEffect(() => {
    if (!unsaved && plan.value !== null) void plan.reload();
  }, [unsaved]);
  useEffect(() => {
    if (plan.value !== null) setChoices((before) => keepChoices(plan.value!, before));
  }, [plan.value]);

  const count = plan.value === null ? 0 : plan.value.changes.length + plan.value.conflicts.length;
  const text = message ?? (plan.value === null ? "" : proposeMessage(plan.value));
  const decided = plan.value !== null && isDecided(plan.value, choices);
  const ready = count > 0 && decided && !unsaved && !busy && !plan.loading && text.trim() !== "";

  const publish = async (): Promise<void> => {
    if (plan.value === null || !ready) return;
    setBusy(true);
    setProblem(null);
    try {
      const answer = await post<PublishAnswer>(
        "/api/publish", { plan: plan.value.plan, message: text.trim(), choices }, { timeout: 120_000 },
      );
      notice.value = {
        tone: "info",
        text: [
          sayCount("publish.done", answer.changes), sayCount("publish.in.takes", answer.takes),
          `(${answer.snapshot.slice(0, 8)})`,
        ].join(" "),
      };
      close();
      tellTabs({ kind: "corpus" });
      await Promise.all([refresh("corpus"), refresh("draft"), refresh("queue"), refresh("pace")]);
    } catch (thrown) {
      const isOther = thrown instanceof ApiError && (thrown.kind === "stale" || thrown.kind === "conflict");
      setProblem(isOther ? say("publish.newer") : `${say("publish.failed")} ${describeError(thrown)}`);
      if (isOther) await plan.reload();
      setBusy(false);
    }
  };

  const foot = (
    <>
      <label class="dialog-foot-left grow">
        <span class="soft">{say("publish.message")}</span>
        <input
          ref={field}
          class="input grow"
          value={text}
          maxLength={500}
          disabled={count === 0}
          onInput={(event) => setMessage(event.currentTarget.value)}
          onKeyDown={(event) => {
            if (event.key === "Enter" && !event.isComposing && !event.repeat) void publish();
          }}
        />
      </label>
      <button type="button" class="button" onClick={close}>{say("pages.cancel")}</button>
      <button type="button" class="button button-primary" disabled={!ready} onClick={() => void publish()}>
        {busy ? say("publish.busy") : sayCount("publish.do", count)}
      </button>
    </>
  );

  return (
    <DialogFrame title={say("publish.title")} onClose={close} size="wide" foot={foot} class="pages-publish">
      <div class="stack">
        {problem !== null && <Message tone="error">{problem}</Message>}
        {unsaved && <Message tone="warning">{say("publish.unsaved")}</Message>}
        <WhenLoaded of={plan}>
          {(value) => (
            <Plan plan={value} choices={choices} onChoose={(chosen) => setChoices({ ...choices, ...chosen })} />
          )}
        </WhenLoaded>
      </div>
    </DialogFrame>
  );
}

interface PlanProps {
  plan: PublishPlan;
  choices: Record<string, string>;
  onChoose: (choices: Record<string, string>) => void;
}

function Plan({ plan, choices, onChoose }: PlanProps) {
  const groups = groupChanges(plan.changes);
  const edits = unpublished.value;
  const open = plan.conflicts.filter((one) => choices[one.key] === undefined).length;
  if (plan.changes.length + plan.conflicts.length + plan.held_back.length === 0) {
    return <p class="empty">{say("publish.nothing")}</p>;
  }
  return (
    <>
      {plan.held_back.map((one) => (
        <Message key={one.take} tone="warning">
          <strong>{one.take}</strong> {say("publish.held")} {one.message}
        </Message>
      ))}
      {plan.conflicts.length > 0 && (
        <section class="stack" aria-label={say("publish.conflicts")}>
          <div class="row spread">
            <h3>
              {sayCount("publish.conflicts.count", plan.conflicts.length)}{" "}
              <span class={open > 0 ? "badge badge-blind" : "badge badge-reviewed"}>
                {open > 0 ? sayCount("publish.open", open) : `✓ ${say("publish.decided")}`}
              </span>
            </h3>
            {plan.conflicts.length > 1 && (
              <div class="row small">
                <span class="soft">{say("publish.all")}</span>
                {(["ours", "theirs"] as const).map((choice) => (
                  <button
                    key={choice}
                    type="button"
                    class="button button-small"
                    onClick={() => onChoose(Object.fromEntries(plan.conflicts.map((one) => [one.key, choice])))}
                  >
                    {say(`publish.all.${choice}`)}
                  </button>
                ))}
              </div>
            )}
          </div>
          <p class="soft small">{say("publish.conflicts.explained")}</p>
          {plan.conflicts.map((one) => (
            <Conflict
              key={one.key}
              conflict={one}
              chosen={choices[one.key]}
              onChoose={(choice) => onChoose({ [one.key]: choice })}
            />
          ))}
        </section>
      )}
      {plan.changes.length > 0 && (
        <section class="stack" aria-label={say("publish.changed")}>
          <div class="row row-wrap">
            <h3>{sayCount("publish.changes", plan.changes.length)} {sayCount("publish.in.takes", groups.length)}</h3>
            {countKinds(plan.changes).map(({ kind, count }) => (
              <span key={kind} class="badge">{sayCount(`publish.kind.${kind}`, count)}</span>
            ))}
            {edits > plan.changes.length && <span class="soft small">{sayCount("publish.of-edits", edits)}</span>}
          </div>
          {groups.map((group, index) => (
            <details key={group.take} class="pages-take" open={index < 3 && group.count <= 60}>
              <summary>
                <span class="elide">{group.take}</span>
                <span class="soft number">{sayCount("publish.changes", group.count)}</span>
              </summary>
              {group.tiers.map((tier) => <Changes key={`${tier.purpose} ${tier.tier}`} of={tier} />)}
            </details>
          ))}
        </section>
      )}
    </>
  );
}

function Changes({ of }: { of: TierChanges }) {
  const [shown, setShown] = useState(ROWS_AT_ONCE);
  const rate = rateOf(of.take);
  return (
    <>
      <h4 class="pages-tier soft small">
        {of.tier}{of.purpose === "adjudication" && (
          <span class="badge badge-adjudicated">{say("publish.settled")}</span>
        )}
      </h4>
      <ul class="pages-changes">
        {of.changes.slice(0, shown).map((change, index) => <Change key={index} change={change} rate={rate} />)}
      </ul>
      {of.changes.length > shown && (
        <button type="button" class="button button-small" onClick={() => setShown(shown + 10 * ROWS_AT_ONCE)}>
          {sayCount("publish.more", of.changes.length - shown)}
        </button>
      )}
    </>
  );
}

function Change({ change, rate }: { change: PublishChange; rate: number }) {
  const both = [...change.before, ...change.after];
  const first = Math.min(...both.map((one) => one.onset));
  const last = Math.max(...both.map((one) => one.offset));
  const margin = Math.max(1, 0.1 * (last - first));
  const strip = { first: first - margin, last: last + margin, tier: change.tier, small: true };
  return (
    <li class="pages-change">
      <GoTo take={change.take} frame={change.onset} rate={rate} adjudication={change.purpose === "adjudication"} />
      <span class="grow">{describeChange(change, rate)}</span>
      <span class="pages-change-strips">
        <Strip segments={change.before} name={say("publish.before")} {...strip} />
        <Strip segments={change.after} name={say("publish.after")} {...strip} />
      </span>
    </li>
  );
}

/** The time of a change; pressing it closes the dialog and shows the place. */
function GoTo(props: { take: string; frame: number; rate: number; adjudication: boolean }) {
  const time = formatTime(props.frame, props.rate);
  if (props.adjudication) return <span class="number small soft pages-time">{time}</span>;
  const go = (): void => {
    close();
    page.value = "review";
    purpose.value = "own";
    void openTake(props.take, { frame: props.frame });
  };
  return (
    <button
      type="button"
      class="button button-small button-quiet number pages-time"
      title={say("publish.go")}
      aria-label={`${say("publish.go")} ${time}`}
      onClick={go}
    >
      {time}
    </button>
  );
}

interface ConflictProps {
  conflict: PublishConflict;
  chosen: string | undefined;
  onChoose: (choice: string) => void;
}

function Conflict({ conflict, chosen, onChoose }: ConflictProps) {
  const rate = rateOf(conflict.take);
  const all = [...conflict.base, ...conflict.ours, ...conflict.theirs];
  const first = Math.min(conflict.onset, ...all.map((one) => one.onset));
  const last = Math.max(conflict.offset, ...all.map((one) => one.offset));
  const states = { base: conflict.base, ours: conflict.ours, theirs: conflict.theirs };
  return (
    <fieldset class="pages-conflict">
      <legend>
        <strong>{conflict.take}</strong> · {conflict.tier} ·{" "}
        <span class="number">{formatTime(first, rate)} – {formatTime(last, rate)}</span>
      </legend>
      <p class="soft small">{say("publish.by", { author: conflict.author, message: conflict.message })}</p>
      {(["ours", "theirs", "base", "both"] as const)
        .filter((choice) => conflict.choices.includes(choice))
        .map((choice) => (
          <label key={choice} class={`pages-choice${chosen === choice ? " pages-choice-chosen" : ""}`}>
            <input
              type="radio"
              name={`conflict-${conflict.key}`}
              checked={chosen === choice}
              onChange={() => onChoose(choice)}
            />
            <span class="pages-choice-name">{say(`publish.choice.${choice}`, { author: conflict.author })}</span>
            {choice === "both" ? (
              <span class="soft small grow">{say("publish.choice.both.explained")}</span>
            ) : (
              <span class="grow">
                <Strip
                  segments={states[choice]}
                  first={first}
                  last={last}
                  tier={conflict.tier}
                  name={say(`publish.choice.${choice}`, { author: conflict.author })}
                />
              </span>
            )}
          </label>
        ))}
    </fieldset>
  );
}
