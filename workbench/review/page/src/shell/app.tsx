/** The page as a whole: top bar, queue, centre, segment; dialogs and login above it. */
import { effect } from "@preact/signals";
import { render } from "preact";
import { HelpDialog } from "../keyboard/help";
import { installKeyboard } from "../keyboard/bindings";
import { Dialogs, Pages } from "../pages";
import { start } from "../state/actions";
import { arriving, login, page, scene, session, starting } from "../state/state";
import "../style/index.css";
import { language, say } from "../words";
import { Centre } from "./centre";
import { isFolded } from "./layout";
import { Login } from "./login";
import { nameOf } from "./matching";
import { NoticeBar, ProblemStrips } from "./notice_bar";
import { Spinner } from "./pieces";
import { QueuePanel } from "./queue_panel";
import { UnsavedStrip } from "./save_indicator";
import { SegmentPanel } from "./segment_panel";
import { followTheme } from "./theme";
import { TopBar } from "./top_bar";

/** Show the page in an element and begin. */
export function mount(root: HTMLElement): void {
  followTheme();
  effect(() => {
    document.documentElement.lang = language.value;
  });
  effect(() => {
    const where = [scene.value?.take, session.value === null ? undefined : nameOf(session.value.corpus)];
    document.title = [...where.filter((one) => one !== undefined), "mimique"].join(" · ");
  });
  installKeyboard();
  render(<App />, root);
  void start();
}

function App() {
  if (session.value === null) {
    return starting.value ? <div class="waiting-place"><Spinner /></div> : <Login />;
  }
  const onReview = page.value === "review";
  return (
    <>
      <div class="shell" data-left={isFolded("left") ? "folded" : "open"}
        data-right={isFolded("right") ? "folded" : "open"} data-arriving={arriving.value !== null || undefined}>
        <a class="skip" href="#timeline">{say("app.skip")}</a>
        <TopBar />
        <div class="strips"><UnsavedStrip /><ProblemStrips /></div>
        {onReview && !isFolded("left") && <QueuePanel />}
        {onReview && <Centre />}
        {onReview && !isFolded("right") && <SegmentPanel />}
        <Pages />
        <Dialogs />
        <HelpDialog />
        <NoticeBar />
      </div>
      {/* Where a session ended over work, the page stays as it is below. */}
      {login.value !== null && <Login />}
    </>
  );
}
