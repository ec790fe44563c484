/** One's own password: the old one, the new one twice. Other windows that are logged in by the old one are ended. */
import { useState } from "preact/hooks";
import { ApiError, changePassword } from "../api/client";
import { describeError } from "../state/notices";
import { session } from "../state/state";
import { say } from "../words";
import { SHORTEST_PASSWORD } from "./passwords";
import { Message } from "./pieces";

interface Said {
  tone: "info" | "error";
  text: string;
}

export function OwnPassword() {
  const [typed, setTyped] = useState({ old: "", first: "", second: "" });
  const [isBusy, setBusy] = useState(false);
  const [said, setSaid] = useState<Said | null>(null);
  const isReady = typed.old !== "" && typed.first.length >= SHORTEST_PASSWORD && typed.first === typed.second;

  const send = async (): Promise<void> => {
    if (!isReady || isBusy) return;
    setBusy(true);
    try {
      session.value = await changePassword({ old: typed.old, new: typed.first });
      setTyped({ old: "", first: "", second: "" });
      setSaid({ tone: "info", text: say("password.done") });
    } catch (error) {
      const isWrong = error instanceof ApiError && error.kind === "no-session";
      setSaid({ tone: "error", text: isWrong ? say("password.wrong") : describeError(error) });
    } finally {
      setBusy(false);
    }
  };
  const field = (part: keyof typeof typed, name: string, complete: "current-password" | "new-password") => (
    <label class="field">
      <span>{name}</span>
      <input class="input" type="password" autocomplete={complete} value={typed[part]}
        onInput={(event) => setTyped({ ...typed, [part]: event.currentTarget.value })} />
    </label>
  );
  return (
    <details>
      <summary class="pages-summary">{say("password.change")}</summary>
      <form class="stack pages-password"
        onSubmit={(event) => {
          event.preventDefault();
          void send();
        }}>
        {/* So that the browser's own store of passwords knows whose it is. */}
        <input type="text" hidden autocomplete="username" value={session.value?.person ?? ""} readOnly />
        {field("old", say("password.old"), "current-password")}
        {field("first", say("password.new"), "new-password")}
        {field("second", say("password.again"), "new-password")}
        <p class="soft small">
          {typed.second !== "" && typed.first !== typed.second ? say("password.differ") : say("password.explained")}
        </p>
        {said !== null && <Message tone={said.tone}>{said.text}</Message>}
        <div><button type="submit" class="button" disabled={!isReady || isBusy}>{say("password.do")}</button></div>
      </form>
    </details>
  );
}
