/** The coding manual as elements: made one by one from its tree, never from a text of HTML. */
import { type ComponentChildren, type JSX, createContext } from "preact";
import { useContext } from "preact/hooks";
import type { Block, Inline } from "./markdown";

/** What is marked wherever it stands in the text; "" for nothing. */
export const Sought = createContext("");

interface ViewProps {
  blocks: Block[];
  /** Before the anchors of headings, so that they differ from other ids of the page. */
  prefix: string;
}

export function MarkdownView({ blocks, prefix }: ViewProps) {
  return <>{blocks.map((block, index) => <BlockView key={index} block={block} prefix={prefix} />)}</>;
}

function BlockView({ block, prefix }: { block: Block; prefix: string }): JSX.Element {
  const inline = (parts: Inline[]): ComponentChildren => <InlineView parts={parts} prefix={prefix} />;
  switch (block.kind) {
    case "heading": {
      // The dialog's title is the h2 above them.
      const Tag = (["h3", "h3", "h4", "h5", "h6", "h6"] as const)[block.level - 1] ?? "h6";
      return (
        <Tag id={`${prefix}${block.anchor}`} class={`pages-heading-${block.level}`} tabIndex={-1}>
          {inline(block.parts)}
        </Tag>
      );
    }
    case "paragraph":
      return <p>{inline(block.parts)}</p>;
    case "quote":
      return <blockquote><MarkdownView blocks={block.blocks} prefix={prefix} /></blockquote>;
    case "code":
      return <pre><code>{block.text}</code></pre>;
    case "rule":
      return <hr />;
    case "list": {
      const items = block.items.map((item, index) => (
        <li key={index}>
          {inline(item.parts)}
          {item.below.length > 0 && <MarkdownView blocks={item.below} prefix={prefix} />}
        </li>
      ));
      return block.ordered ? <ol start={block.start}>{items}</ol> : <ul>{items}</ul>;
    }
    case "table":
      return (
        <table>
          <thead><tr>{block.head.map((cell, index) => <th key={index} scope="col">{inline(cell)}</th>)}</tr></thead>
          <tbody>
            {block.rows.map((row, index) => (
              <tr key={index}>{row.map((cell, column) => <td key={column}>{inline(cell)}</td>)}</tr>
            ))}
          </tbody>
        </table>
      );
  }
}

function InlineView({ parts, prefix }: { parts: Inline[]; prefix: string }) {
  return (
    <>
      {parts.map((part, index) => {
        switch (part.kind) {
          case "text": return <Marked key={index} text={part.text} />;
          case "break": return <br key={index} />;
          case "code": return <code key={index}><Marked text={part.text} /></code>;
          case "emphasis": {
            const inner = <InlineView parts={part.parts} prefix={prefix} />;
            return part.strong ? <strong key={index}>{inner}</strong> : <em key={index}>{inner}</em>;
          }
          case "link": {
            const inner = <InlineView parts={part.parts} prefix={prefix} />;
            const { anchor } = part;
            // Nothing outside the machine is opened from here: the address is there to read.
            if (anchor === null) return <span key={index}>{inner} <span class="soft">({part.address})</span></span>;
            return (
              <a
                key={index}
                href={`#${prefix}${anchor}`}
                onClick={(event) => go(event, `${prefix}${anchor}`)}
              >
                {inner}
              </a>
            );
          }
        }
      })}
    </>
  );
}

/** A text with what is sought marked, whether in small letters or large. */
function Marked({ text }: { text: string }) {
  const sought = useContext(Sought).trim().toLowerCase();
  if (sought === "") return <>{text}</>;
  const parts: ComponentChildren[] = [];
  const small = text.toLowerCase();
  let from = 0;
  // Letters whose small form is longer would shift the places; such a text is shown as it is.
  for (let at = small.indexOf(sought); at >= 0 && small.length === text.length; at = small.indexOf(sought, from)) {
    parts.push(text.slice(from, at), <mark key={at}>{text.slice(at, at + sought.length)}</mark>);
    from = at + sought.length;
  }
  return <>{[...parts, text.slice(from)]}</>;
}

/** Scroll there without touching the page's address. */
function go(event: MouseEvent, id: string): void {
  event.preventDefault();
  const heading = document.getElementById(id);
  heading?.scrollIntoView({ block: "start" });
  heading?.focus({ preventScroll: true });
}
