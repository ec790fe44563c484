/** The coding manual of a vocabulary: its Markdown, and beside it what people will read. */
import { useMemo, useState } from "preact/hooks";
import { session } from "../state/state";
import { say } from "../words";
import { parseMarkdown } from "./markdown";
import { MarkdownView } from "./markdown_view";
import type { SchemeViewProps } from "./scheme_dialog";

export function SchemeManual({ vocabulary, change, mayChange }: SchemeViewProps) {
  const [text, setText] = useState(vocabulary.manual);
  const blocks = useMemo(() => parseMarkdown(text), [text]);
  const isLead = session.value?.is_lead === true;
  const changed = text !== vocabulary.manual;
  const read = text.trim() === ""
    ? <p class="empty">{say("manual.empty")}</p>
    : <MarkdownView blocks={blocks} prefix="draft-" />;
  if (!isLead) return <article class="prose">{read}</article>;
  return (
    <div class="stack pages-write">
      <div class="pages-write-columns">
        <label class="field">
          <span>{say("scheme.manual.source")}</span>
          <textarea
            class="input mono"
            spellcheck
            value={text}
            disabled={!mayChange}
            onInput={(event) => setText(event.currentTarget.value)}
          />
        </label>
        <div class="field">
          <span class="soft small">{say("scheme.manual.read")}</span>
          <article class="prose pages-write-read" tabIndex={0} aria-label={say("scheme.manual.read")}>{read}</article>
        </div>
      </div>
      <div class="row">
        <button type="button" class="button button-primary" disabled={!changed || !mayChange}
          onClick={() => void change({ kind: "manual", vocabulary: vocabulary.name, text })}>
          {say("scheme.manual.save")}
        </button>
        <button
          type="button"
          class="button"
          disabled={!changed}
          onClick={() => setText(vocabulary.manual)}
        >
          {say("pages.discard")}
        </button>
        <span class="soft small">{changed ? say("scheme.manual.changed") : say("scheme.manual.help")}</span>
      </div>
    </div>
  );
}
