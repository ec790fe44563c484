/** Who is there: name and password, over the page where a session ended in the middle of work. */
import { useEffect, useRef, useState } from "preact/hooks";
import { ApiError } from "../api/client";
import { enter, start } from "../state/actions";
import { login, notice, session } from "../state/state";
import { describeError } from "../state/notices";
import { say } from "../words";
import { WarningIcon } from "./icons";

export function Login() {
  const why = login.value;
  const [problem, setProblem] = useState<string | null>(null);
  const [isBusy, setBusy] = useState(false);
  const person = useRef<HTMLInputElement>(null);
  const password = useRef<HTMLInputElement>(null);
  const whole = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    // Modal: above any dialog that is open, and nothing below can be reached.
    if (why !== null && whole.current?.open === false) whole.current.showModal();
  }, [why]);
  useEffect(() => {
    if (why !== null) (why === "lost" ? password : person).current?.focus();
  }, [why]);
  if (why === null) return null;
  // Before there is a page, what went wrong at the start has no other place.
  const said = problem ?? (session.value === null ? (notice.value?.text ?? null) : null);

  const submit = async (event: Event) => {
    event.preventDefault();
    setBusy(true);
    setProblem(null);
    try {
      await enter(person.current?.value ?? "", password.current?.value ?? "");
    } catch (error) {
      const wrong = error instanceof ApiError && error.kind === "no-session";
      setProblem(wrong ? say("login.wrong") : describeError(error));
      password.current?.select();
    } finally {
      setBusy(false);
    }
  };

  return (
    <dialog class={`login-place ${why === "lost" ? "" : "login-alone"}`} ref={whole} aria-labelledby="login-title"
      onCancel={(event) => event.preventDefault()}>
      <form class="login" onSubmit={(event) => void submit(event)}>
        <h1 id="login-title">mimique</h1>
        {why === "lost" && <p class="message message-warning"><WarningIcon /><span>{say("login.lost")}</span></p>}
        <label class="field">
          <span>{say("login.person")}</span>
          <input class="input" ref={person} name="person" autocomplete="username" required maxLength={256}
            defaultValue={session.value?.person ?? ""} />
        </label>
        <label class="field">
          <span>{say("login.password")}</span>
          <input class="input" ref={password} name="password" type="password"
            autocomplete="current-password" required maxLength={1024} />
        </label>
        <p class="message message-error" role="alert" hidden={said === null}><WarningIcon /><span>{said}</span></p>
        <button type="submit" class="button button-primary button-wide" disabled={isBusy}>{say("login.enter")}</button>
        <p class="soft small">{say("login.token")}</p>
        <button type="button" class="button button-quiet button-small"
          onClick={() => void start()}>{say("login.retry")}</button>
      </form>
    </dialog>
  );
}
