/** The tiers that a vocabulary is for: take one away, add one to it, or begin a tier with labels of its own. */
import { useState } from "preact/hooks";
import type { Vocabulary } from "../api/messages";
import { scheme } from "../state/state";
import { say } from "../words";
import type { Change } from "./scheme_dialog";
import { LONGEST_NAME, checkName } from "./scheme_rules";

interface SchemeTiersProps {
  vocabulary: Vocabulary | null;
  change: Change;
  mayChange: boolean;
}

export function SchemeTiers({ vocabulary, change, mayChange }: SchemeTiersProps) {
  const [name, setName] = useState("");
  const [own, setOwn] = useState(vocabulary === null);
  const [asked, setAsked] = useState<string | null>(null);
  const taken = (scheme.value?.vocabularies ?? []).flatMap((one) => [...one.tiers, one.name]);
  const isFree = (one: string) => !own && one === vocabulary?.name && !vocabulary.tiers.includes(one);
  const problem = checkName(name, taken.filter((one) => !isFree(one)));
  const add = async (): Promise<void> => {
    if (problem !== null || !mayChange) return;
    const of = own ? null : (vocabulary?.name ?? null);
    if (await change({ kind: "add-tier", tier: name, vocabulary: of })) setName("");
  };
  return (
    <div class="stack">
      {vocabulary !== null && (
        <>
          <p class="soft">{say("scheme.tiers.explained", { vocabulary: vocabulary.name })}</p>
          <ul class="pages-tiers">
            {vocabulary.tiers.map((tier) => (
              <li key={tier} class="row">
                <strong class="grow elide">{tier}</strong>
                {asked === tier ? (
                  <>
                    <span class="soft small">{say("scheme.tiers.stay")}</span>
                    <button
                      type="button"
                      class="button button-small"
                      onClick={() => setAsked(null)}
                    >
                      {say("pages.cancel")}
                    </button>
                    <button
                      type="button"
                      class="button button-small button-danger"
                      disabled={!mayChange}
                      onClick={() => {
                        const removal = { kind: "remove-tier" as const, tier, vocabulary: vocabulary.name };
                        void change(removal).then(() => setAsked(null));
                      }}
                    >
                      {say("scheme.tiers.remove")}
                    </button>
                  </>
                ) : (
                  <button
                    type="button"
                    class="button button-small"
                    disabled={!mayChange}
                    aria-label={`${say("scheme.tiers.remove")}: ${tier}`}
                    onClick={() => setAsked(tier)}
                  >
                    {say("scheme.tiers.remove")}
                  </button>
                )}
              </li>
            ))}
          </ul>
        </>
      )}
      <form class="pages-card stack" onSubmit={(event) => { event.preventDefault(); void add(); }}>
        <h3>{say("scheme.tiers.new")}</h3>
        <label class="field">
          <span>{say("scheme.tiers.name")}</span>
          <input
            class="input"
            value={name}
            maxLength={LONGEST_NAME}
            aria-invalid={problem !== null && name !== ""}
            onInput={(event) => setName(event.currentTarget.value)}
          />
        </label>
        {vocabulary !== null && (
          <div class="stack" role="radiogroup" aria-label={say("scheme.tiers.labels")}>
            <label class="check">
              <input
                type="radio"
                name="tier-labels"
                checked={!own}
                onChange={() => setOwn(false)}
              /> {say("scheme.tiers.same", { vocabulary: vocabulary.name })}
            </label>
            <label class="check">
              <input
                type="radio"
                name="tier-labels"
                checked={own}
                onChange={() => setOwn(true)}
              /> {say("scheme.tiers.own")}
            </label>
          </div>
        )}
        <div class="row">
          <button
            type="submit"
            class="button button-primary"
            disabled={problem !== null || !mayChange}
          >
            {say("scheme.tiers.add")}
          </button>
          {problem !== null && name !== "" && <span class="pages-problem">{say(`scheme.problem.${problem}`)}</span>}
        </div>
      </form>
    </div>
  );
}
