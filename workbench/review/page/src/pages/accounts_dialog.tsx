/** Who may log in: a lead adds people, gives them another password or the rights of a lead, and lets them out. */
import { useState } from "preact/hooks";
import { get, post, remove } from "../api/client";
import type { AccountRequest, AccountRow } from "../api/messages";
import { DialogFrame } from "../shell/dialog_frame";
import { describeError } from "../state/notices";
import { dialog, session } from "../state/state";
import { say } from "../words";
import { type Loaded, useLoaded } from "./loading";
import { Message, WhenLoaded } from "./pieces";
import { SHORTEST_PASSWORD, proposePassword } from "./passwords";

const close = (): void => void (dialog.value = null);

type Asked = { person: string; what: "password" | "out" } | null;

export function AccountsDialog() {
  const accounts = useLoaded<AccountRow[]>(() => get("/api/accounts"));
  const [problem, setProblem] = useState<string | null>(null);
  const [done, setDone] = useState<string | null>(null);
  const [busy, setBusy] = useState(false);

  const act = async (doing: () => Promise<unknown>, said: string): Promise<boolean> => {
    setBusy(true);
    setProblem(null);
    setDone(null);
    try {
      await doing();
      setDone(said);
      await accounts.reload();
      return true;
    } catch (thrown) {
      setProblem(describeError(thrown));
      return false;
    } finally {
      setBusy(false);
    }
  };
  const send = (request: AccountRequest, said: string): Promise<boolean> =>
    act(() => post<AccountRow>("/api/accounts", request), said);

  const foot = (
    <>
      <span class="dialog-foot-left soft small" aria-live="polite">{done !== null && `✓ ${done}`}</span>
      <button type="button" class="button" onClick={close}>{say("pages.close")}</button>
    </>
  );
  return (
    <DialogFrame title={say("accounts.title")} onClose={close} size="wide" foot={foot}>
      <div class="stack">
        {session.value?.named === false && <Message tone="info">{say("accounts.token")}</Message>}
        {problem !== null && <Message tone="error">{problem}</Message>}
        <WhenLoaded of={accounts}>
          {() => (
            <Rows
              accounts={accounts}
              busy={busy}
              send={send}
              letOut={(person) => act(() => remove("/api/accounts", { person }), say("accounts.out.done", { person }))}
            />
          )}
        </WhenLoaded>
        <NewAccount
          busy={busy}
          taken={(accounts.value ?? []).filter((one) => one.is_active).map((one) => one.person)}
          send={send}
        />
      </div>
    </DialogFrame>
  );
}

interface RowsProps {
  accounts: Loaded<AccountRow[]>;
  busy: boolean;
  send: (request: AccountRequest, said: string) => Promise<boolean>;
  letOut: (person: string) => Promise<boolean>;
}

function Rows({ accounts, busy, send, letOut }: RowsProps) {
  const [asked, setAsked] = useState<Asked>(null);
  const [password, setPassword] = useState("");
  const ask = (next: Asked): void => {
    setAsked(next);
    setPassword(next?.what === "password" ? proposePassword() : "");
  };
  const rows = accounts.value ?? [];
  if (rows.length === 0) return <p class="empty">{say("accounts.none")}</p>;
  return (
    <div class="table-scroll">
      <table class="table">
        <thead>
          <tr>
            <th scope="col">{say("accounts.person")}</th>
            <th scope="col">{say("accounts.rights")}</th>
            <th scope="col"><span class="visually-hidden">{say("scheme.actions")}</span></th>
          </tr>
        </thead>
        <tbody>
          {rows.map((one) => {
            const isOwn = one.person === session.value?.person;
            const open = asked?.person === one.person ? asked.what : null;
            return [
              <tr key={one.person} class={one.is_active ? "" : "pages-retired"}>
                <td>
                  <strong>{one.person}</strong>
                  {isOwn && <span class="soft"> {say("accounts.you")}</span>}
                  {!one.is_active && <span class="badge pages-after">{say("accounts.inactive")}</span>}
                </td>
                <td>
                  <label class="check">
                    <input type="checkbox" checked={one.is_lead} disabled={busy || isOwn || !one.is_active}
                      aria-label={`${say("accounts.lead")}: ${one.person}`}
                      onChange={(event) => {
                        const is_lead = event.currentTarget.checked;
                        const key = is_lead ? "accounts.lead.done" : "accounts.lead.undone";
                        const said = say(key, { person: one.person });
                        void send({ person: one.person, password: null, is_lead }, said);
                      }} />
                    {say("accounts.lead")}
                  </label>
                </td>
                <td class="pages-actions">
                  {one.is_active && (
                    <>
                      <button
                        type="button"
                        class="button button-small"
                        disabled={busy}
                        aria-expanded={open === "password"}
                        onClick={() => ask(open === "password" ? null : { person: one.person, what: "password" })}
                      >
                        {say("accounts.password.new")}
                      </button>
                      <button
                        type="button"
                        class="button button-small"
                        disabled={busy || isOwn}
                        aria-expanded={open === "out"}
                        onClick={() => ask(open === "out" ? null : { person: one.person, what: "out" })}
                      >
                        {say("accounts.out")}
                      </button>
                    </>
                  )}
                </td>
              </tr>,
              open !== null && (
                <tr key={`${one.person} open`} class="pages-open">
                  <td colSpan={3}>
                    {open === "password" ? (
                      <form class="row row-wrap" onSubmit={(event) => {
                        event.preventDefault();
                        if (password.length < SHORTEST_PASSWORD) return;
                        const said = say("accounts.password.done", { person: one.person });
                        const request = { person: one.person, password, is_lead: one.is_lead };
                        void send(request, said).then((kept) => kept && ask(null));
                      }}>
                        <label class="row grow">
                          <span class="soft">{say("accounts.password")}</span>
                          <input
                            class="input mono grow"
                            value={password}
                            autocomplete="off"
                            spellcheck={false}
                            onInput={(event) => setPassword(event.currentTarget.value)}
                          />
                        </label>
                        <button type="button" class="button button-small" onClick={() => ask(null)}>
                          {say("pages.cancel")}
                        </button>
                        <button
                          type="submit"
                          class="button button-small button-primary"
                          disabled={busy || password.length < SHORTEST_PASSWORD}
                        >
                          {say("pages.save")}
                        </button>
                      </form>
                    ) : (
                      <div class="row row-wrap">
                        <span class="grow">{say("accounts.out.explained", { person: one.person })}</span>
                        <button type="button" class="button button-small" onClick={() => ask(null)}>
                          {say("pages.cancel")}
                        </button>
                        <button
                          type="button"
                          class="button button-small button-danger"
                          disabled={busy}
                          onClick={() => void letOut(one.person).then((kept) => kept && ask(null))}
                        >
                          {say("accounts.out")}
                        </button>
                      </div>
                    )}
                  </td>
                </tr>
              ),
            ];
          })}
        </tbody>
      </table>
    </div>
  );
}

function NewAccount(props: { busy: boolean; taken: string[]; send: RowsProps["send"] }) {
  const [person, setPerson] = useState("");
  const [password, setPassword] = useState(proposePassword);
  const [isLead, setIsLead] = useState(false);
  const isTaken = props.taken.includes(person.trim());
  const ready = person.trim() !== "" && !isTaken && password.length >= SHORTEST_PASSWORD && !props.busy;
  const add = async (): Promise<void> => {
    if (!ready) return;
    const name = person.trim();
    const said = say("accounts.added", { person: name, password });
    if (await props.send({ person: name, password, is_lead: isLead }, said)) {
      setPerson("");
      setPassword(proposePassword());
      setIsLead(false);
    }
  };
  return (
    <form class="pages-card stack" onSubmit={(event) => { event.preventDefault(); void add(); }}>
      <h3>{say("accounts.add")}</h3>
      <div class="row row-wrap pages-label-line">
        <label class="field grow">
          <span>{say("accounts.person")}</span>
          <input
            class="input"
            value={person}
            maxLength={80}
            autocomplete="off"
            spellcheck={false}
            aria-invalid={isTaken}
            onInput={(event) => setPerson(event.currentTarget.value)}
          />
        </label>
        <label class="field grow">
          <span>{say("accounts.password")}</span>
          <input
            class="input mono"
            value={password}
            autocomplete="off"
            spellcheck={false}
            onInput={(event) => setPassword(event.currentTarget.value)}
          />
        </label>
        <label class="check">
          <input
            type="checkbox"
            checked={isLead}
            onChange={(event) => setIsLead(event.currentTarget.checked)}
          /> {say("accounts.lead")}
        </label>
        <button type="submit" class="button button-primary" disabled={!ready}>{say("accounts.add.do")}</button>
      </div>
      <p class="soft small">{isTaken ? say("accounts.taken") : say("accounts.password.explained")}</p>
    </form>
  );
}
