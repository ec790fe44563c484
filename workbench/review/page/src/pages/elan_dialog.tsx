/** ELAN: the take's tiers as an .eaf to take away, and an .eaf to bring back, looked at first. */
import { useState } from "preact/hooks";
import { addressOf, postFile } from "../api/client";
import type { EditAnswer, ElanPreview } from "../api/messages";
import { DialogFrame } from "../shell/dialog_frame";
import { refresh, tellTabs } from "../state/actions";
import { describeError } from "../state/notices";
import { dialog, draft, notice, purpose, saving, scene } from "../state/state";
import { say } from "../words";
import { formatNumber, sayCount } from "../words/numbers";
import { type Mapping, chosenTiers, countSegments, findClashes, startMapping } from "./elan_mapping";
import { Message } from "./pieces";

/** What the server takes. */
const LARGEST = 20 * 2 ** 20;
const close = (): void => void (dialog.value = null);

export function ElanDialog() {
  const take = scene.value?.take ?? null;
  const [file, setFile] = useState<File | null>(null);
  const [preview, setPreview] = useState<ElanPreview | null>(null);
  const [mapping, setMapping] = useState<Mapping>({});
  const [busy, setBusy] = useState(false);
  const [problem, setProblem] = useState<string | null>(null);
  const [over, setOver] = useState(false);
  const unsaved = saving.value.state !== "saved";
  const tiers = draft.value?.tiers.map((one) => one.tier) ?? [];
  const clashes = findClashes(mapping);
  const count = preview === null ? 0 : countSegments(preview, mapping);
  const hasTiers = Object.keys(chosenTiers(mapping)).length > 0;
  const ready = preview !== null && hasTiers && clashes.length === 0 && !unsaved && !busy;

  const look = async (chosen: File): Promise<void> => {
    setFile(chosen);
    setPreview(null);
    setProblem(null);
    if (chosen.size > LARGEST) {
      setProblem(say("elan.large", { name: chosen.name, size: formatNumber(chosen.size / 1e6, 1) }));
      return;
    }
    setBusy(true);
    try {
      const found = await postFile<ElanPreview>("/api/elan/preview", chosen, { take });
      setPreview(found);
      setMapping(startMapping(found));
    } catch (thrown) {
      setProblem(`${chosen.name}: ${describeError(thrown)}`);
    }
    setBusy(false);
  };

  const bring = async (): Promise<void> => {
    if (!ready || file === null || draft.value === null) return;
    setBusy(true);
    setProblem(null);
    try {
      const query = {
        take,
        version: draft.value.version,
        request: crypto.randomUUID(),
        tiers: JSON.stringify(chosenTiers(mapping)),
      };
      const answer = await postFile<EditAnswer>("/api/elan/import", file, query);
      tellTabs({ kind: "draft", take: draft.value.take, purpose: "own", version: answer.version });
      await Promise.all([refresh("draft"), refresh("queue"), refresh("pace")]);
      const changed = answer.changes.some((one) => one.added.length + one.removed.length > 0);
      const text = changed ? sayCount("elan.done", count, { name: file.name }) : say("elan.same", { name: file.name });
      notice.value = { tone: "info", text };
      close();
    } catch (thrown) {
      setProblem(describeError(thrown));
      // Where another tab went on meanwhile, the next try starts from what is there now.
      await refresh("draft");
      setBusy(false);
    }
  };

  const foot = (
    <>
      <button type="button" class="button" onClick={close}>{say("pages.close")}</button>
      {preview !== null && (
        <button type="button" class="button button-primary" disabled={!ready} onClick={() => void bring()}>
          {sayCount("elan.bring", count)}
        </button>
      )}
    </>
  );

  return (
    <DialogFrame title={say("elan.title")} onClose={close} size={preview === null ? "usual" : "wide"} foot={foot}>
      {take === null ? (
        <p class="empty">{say("elan.no_take")}</p>
      ) : (
        <div class="stack pages-sections">
          <section class="stack">
            <h3>{say("elan.out")}</h3>
            <p class="soft">{say(draft.value?.mode === "blind" ? "elan.out.blind" : "elan.out.explained", { take })}</p>
            <div>
              <a
                class="button"
                href={addressOf("/api/elan", { take, purpose: purpose.value })}
                download
              >
                {say("elan.download")}
              </a>
            </div>
          </section>
          {purpose.value === "own" && (
            <section class="stack">
              <h3>{say("elan.in")}</h3>
              <p class="soft">{say("elan.in.explained")}</p>
              {problem !== null && <Message tone="error">{problem}</Message>}
              {unsaved && <Message tone="warning">{say("publish.unsaved")}</Message>}
              <label
                class={`pages-drop${over ? " pages-drop-over" : ""}`}
                onDragOver={(event) => { event.preventDefault(); setOver(true); }}
                onDragLeave={() => setOver(false)}
                onDrop={(event) => {
                  event.preventDefault();
                  setOver(false);
                  const dropped = event.dataTransfer?.files[0];
                  if (dropped !== undefined && !busy) void look(dropped);
                }}
              >
                <input
                  type="file"
                  accept=".eaf"
                  class="visually-hidden"
                  disabled={busy}
                  onChange={(event) => {
                    const chosen = event.currentTarget.files?.[0];
                    event.currentTarget.value = "";
                    if (chosen !== undefined) void look(chosen);
                  }}
                />
                <span>
                  {busy
                    ? say("elan.reading")
                    : file === null ? say("elan.choose") : say("elan.other", { name: file.name })}
                </span>
              </label>
              {preview !== null && (
                <Preview preview={preview} mapping={mapping} tiers={tiers} clashes={clashes} onChange={setMapping} />
              )}
            </section>
          )}
        </div>
      )}
    </DialogFrame>
  );
}

interface PreviewProps {
  preview: ElanPreview;
  mapping: Mapping;
  tiers: string[];
  clashes: string[];
  onChange: (mapping: Mapping) => void;
}

function Preview({ preview, mapping, tiers, clashes, onChange }: PreviewProps) {
  return (
    <>
      {preview.warnings.map((one) => <Message key={one} tone="warning">{one}</Message>)}
      {clashes.map((one) => <Message key={one} tone="error">{say("elan.clash", { tier: one })}</Message>)}
      {preview.tiers.length === 0 ? (
        <p class="empty">{say("elan.empty")}</p>
      ) : (
        <div class="table-scroll">
          <table class="table">
            <thead>
              <tr>
                <th scope="col">{say("elan.file_tier")}</th>
                <th scope="col" class="number">{say("scheme.segments")}</th>
                <th scope="col">{say("elan.into")}</th>
                <th scope="col">{say("elan.problems")}</th>
              </tr>
            </thead>
            <tbody>
              {preview.tiers.map((one) => (
                <tr key={one.name}>
                  <td>{one.name}</td>
                  <td class="number">{formatNumber(one.segments)}</td>
                  <td>
                    <select
                      class="select"
                      value={mapping[one.name] ?? ""}
                      aria-label={say("elan.into.of", { tier: one.name })}
                      aria-invalid={mapping[one.name] != null && clashes.includes(mapping[one.name]!)}
                      onChange={(event) => onChange({ ...mapping, [one.name]: event.currentTarget.value || null })}
                    >
                      <option value="">{say("elan.leave_out")}</option>
                      {[...new Set([...tiers, ...(one.tier === null ? [] : [one.tier])])].map((tier) => (
                        <option key={tier} value={tier}>{tier}</option>
                      ))}
                    </select>
                  </td>
                  <td class="small">
                    {one.problems.length === 0 && <span class="soft">–</span>}
                    {one.problems.map((each) => <div key={each} class="pages-problem">{each}</div>)}
                  </td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
      <p class="soft small">{say("elan.replaces")}</p>
    </>
  );
}
