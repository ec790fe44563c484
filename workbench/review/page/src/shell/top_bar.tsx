/** The top bar: where one is, whether it is saved, how far one has come, and publishing. */
import type { ComponentChildren } from "preact";
import { describeKeys } from "../keyboard/bindings";
import { describeStep, redo, saveSettings, undo } from "../state/actions";
import { dialog, draft, pace, page, session, settling, unpublished } from "../state/state";
import { say } from "../words";
import { formatFixed, formatNumber } from "../words/numbers";
import { LeftPanelIcon, RedoIcon, RightPanelIcon, UndoIcon } from "./icons";
import { isFolded } from "./layout";
import { MainMenu, showPage } from "./main_menu";
import { nameOf } from "./matching";
import { SaveIndicator } from "./save_indicator";
import { TakePicker } from "./take_picker";

export function TopBar() {
  const person = session.value;
  const onReview = page.value === "review";
  return (
    <header class="top-bar" data-region="" tabIndex={-1} aria-label={say("top.bar")}>
      {onReview && <Fold side="left" />}
      <span class="corpus-name elide" title={person?.corpus}>{nameOf(person?.corpus ?? "mimique")}</span>
      {person?.is_lead && <PageTabs />}
      {onReview && <span class="top-line" />}
      {onReview && <TakePicker />}
      <span class="grow" />
      {onReview && <Progress />}
      <SaveIndicator />
      {page.value !== "overview" && <Steps />}
      <PublishButton />
      <MainMenu />
      {onReview && <Fold side="right" />}
    </header>
  );
}

function Fold(props: { side: "left" | "right" }) {
  const folded = isFolded(props.side);
  const name = say(`top.fold-${props.side}`);
  return (
    <button type="button" class="button button-quiet button-icon" aria-label={name} title={name} aria-pressed={!folded}
      onClick={() => void saveSettings({ [`${props.side}Folded`]: !folded })}>
      {props.side === "left" ? <LeftPanelIcon /> : <RightPanelIcon />}
    </button>
  );
}

function PageTabs() {
  const pages = settling.value === null && page.value !== "adjudication"
    ? (["review", "overview"] as const)
    : (["review", "overview", "adjudication"] as const);
  return (
    <nav class="button-group page-tabs" aria-label={say("top.bar")}>
      {pages.map((one) => (
        <button type="button" class="button button-small" key={one} aria-pressed={page.value === one}
          onClick={() => showPage(one)}>
          {say(`top.${one}`)}
        </button>
      ))}
    </nav>
  );
}

function Progress() {
  const now = pace.value;
  if (now === null) return null;
  const minutes = now.minutes_left;
  const more =
    minutes === null ? "" : minutes < 90 ? say("queue.minutes-left", { minutes: formatNumber(Math.ceil(minutes)) })
    : say("queue.hours-left", { hours: formatFixed(minutes / 60, 1) });
  const progress = say("queue.progress", { reviewed: now.reviewed, total: now.reviewed + now.remaining });
  const speed = now.per_minute === null ? "" : formatFixed(now.per_minute, now.per_minute < 10 ? 1 : 0);
  const words = [say("top.left", { count: formatNumber(now.remaining) }), speed && say("top.pace", { count: speed })];
  return (
    <span class="soft number progress" title={[progress, more].filter(Boolean).join(" · ")} data-left={now.remaining}>
      {words.filter(Boolean).join(" · ")}
    </span>
  );
}

function Steps() {
  const now = draft.value;
  return (
    <div class="button-group" role="group">
      <Step name={now?.undo == null ? say("top.undo") : say("top.undo-what", { step: describeStep(now.undo) })}
        keys={describeKeys("edit.undo")} disabled={now?.undo == null} run={undo}><UndoIcon /></Step>
      <Step name={now?.redo == null ? say("top.redo") : say("top.redo-what", { step: describeStep(now.redo) })}
        keys={describeKeys("edit.redo")} disabled={now?.redo == null} run={redo}><RedoIcon /></Step>
    </div>
  );
}

interface StepProps {
  name: string;
  keys: string;
  disabled: boolean;
  run: () => Promise<boolean>;
  children: ComponentChildren;
}

function Step(props: StepProps) {
  return (
    <button type="button" class="button button-quiet button-icon" aria-label={props.name} disabled={props.disabled}
      title={props.keys === "" ? props.name : `${props.name} (${props.keys})`} onClick={() => void props.run()}>
      {props.children}
    </button>
  );
}

function PublishButton() {
  const count = unpublished.value;
  const hint = count === 0 ? say("top.publish-none") : say("top.publish-hint", { count });
  const keys = describeKeys("page.publish");
  return (
    <button type="button" class={`button ${count > 0 ? "button-primary" : ""} publish`}
      title={keys === "" ? hint : `${hint} (${keys})`}
      onClick={() => (dialog.value = "publish")}>
      {count === 0 ? say("top.publish") : say("top.publish-count", { count: formatNumber(count) })}
    </button>
  );
}
