/** The coding scheme: labels with colours, keys and meanings, manual, tiers. Leads change it, others read it. */
import { useState } from "preact/hooks";
import { ApiError, post } from "../api/client";
import type { Scheme, SchemeChange, Vocabulary } from "../api/messages";
import { DialogFrame } from "../shell/dialog_frame";
import { refresh, tellTabs } from "../state/actions";
import { describeError } from "../state/notices";
import { dialog, scheme, session } from "../state/state";
import { say } from "../words";
import { Message, Tabs } from "./pieces";
import { SchemeLabels } from "./scheme_labels";
import { SchemeManual } from "./scheme_manual";
import { SchemeTiers } from "./scheme_tiers";

const VIEWS = ["labels", "manual", "tiers"] as const;

/** Send one change, which is one commit at the server; true once it holds. */
export type Change = (...changes: SchemeChange[]) => Promise<boolean>;

export interface SchemeViewProps {
  vocabulary: Vocabulary;
  change: Change;
  /** False while a change is under way, and for people who only read. */
  mayChange: boolean;
}

export function SchemeDialog() {
  const [picked, setPicked] = useState<string | null>(null);
  const [view, setView] = useState<(typeof VIEWS)[number]>("labels");
  const [busy, setBusy] = useState(false);
  const [problem, setProblem] = useState<string | null>(null);
  const [done, setDone] = useState(false);
  const isLead = session.value?.is_lead === true;
  const vocabularies = scheme.value?.vocabularies ?? [];
  const vocabulary = vocabularies.find((one) => one.name === picked) ?? vocabularies[0] ?? null;

  const change: Change = async (...changes) => {
    setBusy(true);
    setProblem(null);
    setDone(false);
    try {
      for (const one of changes) {
        const snapshot = scheme.value?.snapshot ?? "";
        scheme.value = await post<Scheme>("/api/scheme", { snapshot, change: one }, { timeout: 120_000 });
      }
      setDone(true);
      tellTabs({ kind: "corpus" });
      // Segments and tiers may be called otherwise now.
      if (changes.some((one) => !["describe", "manual", "order"].includes(one.kind))) {
        await Promise.all([refresh("corpus"), refresh("draft"), refresh("queue")]);
      }
      return true;
    } catch (thrown) {
      const isStale = thrown instanceof ApiError && thrown.kind === "stale";
      if (isStale) await refresh("scheme");
      setProblem(isStale ? say("scheme.stale") : describeError(thrown));
      return false;
    } finally {
      setBusy(false);
    }
  };

  const close = (): void => void (dialog.value = null);
  const foot = (
    <>
      <span class="dialog-foot-left soft small" aria-live="polite">
        {busy
          ? say("scheme.busy")
          : done ? `✓ ${say("scheme.saved")}` : say(isLead ? "scheme.each" : "scheme.read_only")}
      </span>
      <button type="button" class="button" onClick={close}>{say("pages.close")}</button>
    </>
  );

  return (
    <DialogFrame title={say("scheme.title")} onClose={close} size="full" foot={foot} class="pages-scheme">
      {problem !== null && <Message tone="error">{problem}</Message>}
      {vocabulary === null ? (
        <>
          <p class="empty">{say("scheme.none")}</p>
          {isLead && <SchemeTiers vocabulary={null} change={change} mayChange={!busy} />}
        </>
      ) : (
        <div class="stack">
          <div class="row spread pages-scheme-head">
            {vocabularies.length > 1 ? (
              <label class="row">
                <span class="soft">{say("scheme.vocabulary")}</span>
                <select
                  class="select"
                  value={vocabulary.name}
                  onChange={(event) => setPicked(event.currentTarget.value)}
                >
                  {vocabularies.map((one) => <option key={one.name} value={one.name}>{one.name}</option>)}
                </select>
              </label>
            ) : (
              <span><span class="soft">{say("scheme.vocabulary")}</span> <strong>{vocabulary.name}</strong></span>
            )}
            <Tabs
              name={say("scheme.views")}
              of={VIEWS}
              chosen={view}
              title={(one) => say(`scheme.view.${one}`)}
              onChoose={setView}
            />
          </div>
          {view === "labels" && (
            <SchemeLabels key={vocabulary.name} vocabulary={vocabulary} change={change} mayChange={isLead && !busy} />
          )}
          {view === "manual" && (
            <SchemeManual key={vocabulary.name} vocabulary={vocabulary} change={change} mayChange={isLead && !busy} />
          )}
          {view === "tiers" && (
            <SchemeTiers key={vocabulary.name} vocabulary={vocabulary} change={change} mayChange={isLead && !busy} />
          )}
        </div>
      )}
    </DialogFrame>
  );
}
