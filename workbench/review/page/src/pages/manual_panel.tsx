/**
 * The coding manual at hand: a panel beside the page, which stays usable, so that one reads and labels at once. First
 * what each label means, the chosen segment's on top of the mind, then the manual of the tier.
 */
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import type { SchemeLabel, Vocabulary } from "../api/messages";
import { DialogFrame } from "../shell/dialog_frame";
import { Key, Swatch } from "../shell/pieces";
import { activeVocabulary, chosen, dialog, scheme, session } from "../state/state";
import { say } from "../words";
import { type Block, parseMarkdown } from "./markdown";
import { MarkdownView, Sought } from "./markdown_view";
import { Tabs } from "./pieces";

const close = (): void => void (dialog.value = null);

export function ManualPanel() {
  const vocabularies = scheme.value?.vocabularies ?? [];
  const [picked, setPicked] = useState<string | null>(null);
  const [sought, setSought] = useState("");
  const pickedOne = vocabularies.find((one) => one.name === picked);
  const vocabulary = pickedOne ?? activeVocabulary.value ?? vocabularies[0] ?? null;

  return (
    <DialogFrame title={say("manual.title")} onClose={close} modal={false} class="pages-manual">
      {/* Focus lies on the text, so that the keys of the page go on working. */}
      <div class="pages-manual-inner" tabIndex={0} autofocus role="region" aria-label={say("manual.title")}>
        {vocabularies.length > 1 && vocabulary !== null && (
          <Tabs
            name={say("manual.vocabularies")}
            of={vocabularies.map((one) => one.name)}
            chosen={vocabulary.name}
            title={(one) => one}
            onChoose={setPicked}
          />
        )}
        {vocabulary === null ? (
          <p class="empty">{say("manual.none")}</p>
        ) : (
          <>
            <input
              type="search"
              class="input"
              placeholder={say("manual.search")}
              aria-label={say("manual.search")}
              value={sought}
              onInput={(event) => setSought(event.currentTarget.value)}
            />
            <Labels vocabulary={vocabulary} sought={sought} />
            <Text vocabulary={vocabulary} sought={sought} />
            {session.value?.is_lead && (
              <button
                type="button"
                class="button button-small"
                onClick={() => (dialog.value = "scheme")}
              >
                {say("manual.edit")}
              </button>
            )}
          </>
        )}
      </div>
    </DialogFrame>
  );
}

const matches = (one: SchemeLabel, sought: string): boolean =>
  [one.label, one.note, ...one.aliases].some((text) => text.toLowerCase().includes(sought.trim().toLowerCase()));

function Labels({ vocabulary, sought }: { vocabulary: Vocabulary; sought: string }) {
  const current = useRef<HTMLElement>(null);
  const label = chosen.value?.label ?? null;
  const shown = vocabulary.labels.filter((one) => !one.retired && matches(one, sought));

  useEffect(() => current.current?.scrollIntoView({ block: "nearest" }), [label]);

  return (
    <dl class="pages-glossary" aria-label={say("manual.labels")}>
      {shown.map((one) => {
        const isCurrent = label !== null && (one.label === label || one.aliases.includes(label));
        return (
          <div
            key={one.label}
            ref={isCurrent ? (current as never) : undefined}
            class={isCurrent ? "pages-glossary-current" : ""}
            aria-current={isCurrent || undefined}
          >
            <dt>
              <Swatch colours={[one.colour]} /> <strong>{one.label}</strong> <Key keys={one.key} />
              {one.aliases.length > 0 && <span class="soft small"> {one.aliases.join(", ")}</span>}
            </dt>
            <dd class={one.note === "" ? "soft" : ""}>{one.note === "" ? say("manual.no_note") : one.note}</dd>
          </div>
        );
      })}
      {shown.length === 0 && <p class="empty">{say("manual.not_found")}</p>}
      {vocabulary.transitions && sought === "" && <p class="soft small">{say("manual.transitions")}</p>}
    </dl>
  );
}

function Text({ vocabulary, sought }: { vocabulary: Vocabulary; sought: string }) {
  const blocks = useMemo(() => parseMarkdown(vocabulary.manual), [vocabulary.manual]);
  const text = useRef<HTMLElement>(null);
  const [found, setFound] = useState(0);
  useEffect(() => {
    const marks = text.current?.querySelectorAll("mark");
    setFound(marks?.length ?? 0);
    if (sought.trim().length > 1) marks?.[0]?.scrollIntoView({ block: "nearest" });
  }, [sought, blocks]);
  if (vocabulary.manual.trim() === "") return <p class="soft">{say("manual.empty")}</p>;
  const headings = blocks.flatMap((block) => (block.kind === "heading" && block.level <= 2 ? [block] : []));
  const contents: Block = {
    kind: "list",
    ordered: false,
    start: 1,
    items: headings.map((one) => ({
      below: [], parts: [{ kind: "link", anchor: one.anchor, address: "", parts: one.parts }],
    })),
  };
  return (
    <>
      {sought.trim() !== "" && <p class="soft small" aria-live="polite">{say("manual.found", { count: found })}</p>}
      {headings.length > 3 && (
        <nav aria-label={say("manual.contents")} class="pages-contents">
          <MarkdownView prefix="manual-" blocks={[contents]} />
        </nav>
      )}
      <article ref={text} class="prose pages-manual-text">
        <Sought.Provider value={sought}><MarkdownView blocks={blocks} prefix="manual-" /></Sought.Provider>
      </article>
    </>
  );
}
