/**
 * The coding manual's Markdown as a tree. Only what a manual needs: headings, paragraphs, nested lists, quotes, tables,
 * fenced code, rules; within a line emphasis, code and links. HTML is text like any other, images and addresses
 * outside the manual are shown as text, so that nothing in a manual can run or be fetched.
 */

export type Inline =
  | { kind: "text"; text: string }
  | { kind: "code"; text: string }
  | { kind: "emphasis"; strong: boolean; parts: Inline[] }
  /** `anchor` is a heading's, without "#"; null for an address outside, which is then part of the text. */
  | { kind: "link"; anchor: string | null; address: string; parts: Inline[] }
  | { kind: "break" };

export interface ListItem {
  parts: Inline[];
  below: Block[];
}

export type Block =
  | { kind: "heading"; level: number; anchor: string; parts: Inline[] }
  | { kind: "paragraph"; parts: Inline[] }
  | { kind: "list"; ordered: boolean; start: number; items: ListItem[] }
  | { kind: "quote"; blocks: Block[] }
  | { kind: "code"; text: string }
  | { kind: "table"; head: Inline[][]; rows: Inline[][][] }
  | { kind: "rule" };

/** How deep lists, quotes and emphasis nest; what is deeper is text. A manual cannot exhaust the stack. */
const DEEPEST = 8;

const FENCE = /^ {0,3}(`{3,}|~{3,})/;
const HEADING = /^ {0,3}(#{1,6})(?:[ \t]+(.*?))?(?:[ \t]+#+)?[ \t]*$/;
const RULE = /^ {0,3}(?:(?:\*[ \t]*){3,}|(?:-[ \t]*){3,}|(?:_[ \t]*){3,})$/;
const ITEM = /^( *)(?:([-*+])|(\d{1,9})[.)])(?:[ \t]+(.*))?$/;
const QUOTE = /^ {0,3}> ?(.*)$/;
const TABLE_RULE = /^ {0,3}\|?[ \t]*:?-+:?[ \t]*(?:\|[ \t]*:?-+:?[ \t]*)*\|?[ \t]*$/;

/** Return the manual's blocks; every text is one, there is no wrong Markdown. */
export function parseMarkdown(text: string): Block[] {
  const lines = text.replace(/\r\n?/g, "\n").split("\n").map((line) => line.replace(/\t/g, "    "));
  return parseBlocks(lines, new Map(), 0);
}

/** The anchor of a heading: its words in small letters, joined by hyphens. */
export function makeAnchor(text: string): string {
  return text
    .toLowerCase()
    .replace(/[^\p{L}\p{N}\s_-]/gu, "")
    .trim()
    .replace(/\s+/g, "-");
}

/** The text of a line without its marks. */
export function plainText(parts: Inline[]): string {
  return parts
    .map((part) => {
      if (part.kind === "break") return " ";
      return part.kind === "text" || part.kind === "code" ? part.text : plainText(part.parts);
    })
    .join("");
}

function parseBlocks(lines: string[], anchors: Map<string, number>, depth: number): Block[] {
  const blocks: Block[] = [];
  let at = 0;
  while (at < lines.length) {
    const line = lines[at]!;
    if (line.trim() === "") {
      at += 1;
      continue;
    }
    const fence = FENCE.exec(line);
    if (fence) {
      const mark = fence[1]!;
      let end = at + 1;
      while (end < lines.length && !closesFence(lines[end]!, mark)) end += 1;
      blocks.push({ kind: "code", text: lines.slice(at + 1, end).join("\n") });
      at = end + 1;
      continue;
    }
    const heading = HEADING.exec(line);
    if (heading) {
      const parts = parseInline(heading[2] ?? "");
      blocks.push({ kind: "heading", level: heading[1]!.length, anchor: nameAnchor(plainText(parts), anchors), parts });
      at += 1;
      continue;
    }
    if (RULE.test(line)) {
      blocks.push({ kind: "rule" });
      at += 1;
      continue;
    }
    if (depth < DEEPEST && QUOTE.test(line)) {
      const inner: string[] = [];
      while (at < lines.length && QUOTE.test(lines[at]!)) inner.push(QUOTE.exec(lines[at++]!)![1]!);
      blocks.push({ kind: "quote", blocks: parseBlocks(inner, anchors, depth + 1) });
      continue;
    }
    if (depth < DEEPEST && ITEM.test(line)) {
      const [list, next] = parseList(lines, at, anchors, depth);
      blocks.push(list);
      at = next;
      continue;
    }
    if (line.includes("|") && TABLE_RULE.test(lines[at + 1] ?? "")) {
      const [table, next] = parseTable(lines, at);
      if (table) {
        blocks.push(table);
        at = next;
        continue;
      }
    }
    const paragraph = [line];
    at += 1;
    while (at < lines.length && !startsBlock(lines[at]!)) paragraph.push(lines[at++]!);
    blocks.push({ kind: "paragraph", parts: parseInline(joinLines(paragraph)) });
  }
  return blocks;
}

function closesFence(line: string, mark: string): boolean {
  const text = line.trim();
  return text.length >= mark.length && text === mark[0]!.repeat(text.length);
}

function startsBlock(line: string): boolean {
  return line.trim() === "" || [FENCE, HEADING, RULE, QUOTE, ITEM].some((one) => one.test(line));
}

/** Lines of one paragraph; two blanks or a backslash at an end break the line. */
function joinLines(lines: string[]): string {
  return lines
    .map((line, index) => {
      const last = index === lines.length - 1;
      return !last && /( {2,}|\\)$/.test(line) ? `${line.replace(/( {2,}|\\)$/, "").trim()}\n` : line.trim();
    })
    .join(" ")
    .replace(/\n /g, "\n");
}

function nameAnchor(text: string, anchors: Map<string, number>): string {
  const name = makeAnchor(text) || "section";
  const used = anchors.get(name) ?? 0;
  anchors.set(name, used + 1);
  return used === 0 ? name : `${name}-${used}`;
}

/** A list goes on while lines are items at its own indent, are indented deeper, or are blank between such. */
function parseList(lines: string[], from: number, anchors: Map<string, number>, depth: number): [Block, number] {
  const first = ITEM.exec(lines[from]!)!;
  const indent = first[1]!.length;
  const ordered = first[3] !== undefined;
  const items: ListItem[] = [];
  let at = from;
  while (at < lines.length) {
    const item = ITEM.exec(lines[at]!);
    if (!item || item[1]!.length !== indent || (item[3] !== undefined) !== ordered || RULE.test(lines[at]!)) break;
    const own = [item[4] ?? ""];
    const below: string[] = [];
    at += 1;
    while (at < lines.length) {
      const line = lines[at]!;
      const blank = line.trim() === "";
      const deeper = !blank && line.length - line.trimStart().length > indent;
      if (blank) {
        const next = lines.slice(at).find((one) => one.trim() !== "");
        if (next === undefined || next.length - next.trimStart().length <= indent) break;
        below.push("");
      } else if (deeper && below.length === 0 && !startsBlock(line.trimStart())) own.push(line);
      else if (deeper) below.push(line);
      else if (!startsBlock(line) && below.length === 0) own.push(line);
      else break;
      at += 1;
    }
    items.push({
      parts: parseInline(joinLines(own)),
      below: parseBlocks(outdent(below), anchors, depth + 1),
    });
    // Blank lines between items of one list do not end it.
    let next = at;
    while (next < lines.length && lines[next]!.trim() === "") next += 1;
    const goesOn = next < lines.length ? ITEM.exec(lines[next]!) : null;
    if (goesOn && goesOn[1]!.length === indent && (goesOn[3] !== undefined) === ordered) at = next;
  }
  return [{ kind: "list", ordered, start: ordered ? Number(first[3]) : 1, items }, at];
}

function outdent(lines: string[]): string[] {
  const indents = lines.filter((line) => line.trim() !== "").map((line) => line.length - line.trimStart().length);
  const least = indents.reduce((one, other) => Math.min(one, other), Infinity);
  return Number.isFinite(least) ? lines.map((line) => line.slice(least)) : lines;
}

function parseTable(lines: string[], from: number): [Block | null, number] {
  const head = splitCells(lines[from]!);
  if (head.length !== splitCells(lines[from + 1]!).length) return [null, from];
  const rows: Inline[][][] = [];
  let at = from + 2;
  while (at < lines.length && lines[at]!.includes("|") && lines[at]!.trim() !== "") {
    const cells = splitCells(lines[at]!);
    rows.push(head.map((_, column) => parseInline(cells[column] ?? "")));
    at += 1;
  }
  return [{ kind: "table", head: head.map((cell) => parseInline(cell)), rows }, at];
}

function splitCells(line: string): string[] {
  const inner = line.trim().replace(/^\|/, "").replace(/\|$/, "");
  return inner.split(/(?<!\\)\|/).map((cell) => cell.trim().replace(/\\\|/g, "|"));
}

/** Return the parts of one line. */
export function parseInline(text: string, depth = 0): Inline[] {
  const parts: Inline[] = [];
  let plain = "";
  // A mark that is not closed behind one place is not closed behind any later one: every mark is searched once in vain.
  const open = new Set<string>();
  const flush = (): void => {
    if (plain !== "") parts.push({ kind: "text", text: plain });
    plain = "";
  };
  let at = 0;
  while (at < text.length) {
    const char = text[at]!;
    if (char === "\\" && /[!-/:-@[-`{-~]/.test(text[at + 1] ?? "")) {
      plain += text[at + 1];
      at += 2;
    } else if (char === "\n") {
      flush();
      parts.push({ kind: "break" });
      at += 1;
    } else if (char === "`") {
      const mark = /^`+/.exec(text.slice(at, at + 16))![0];
      const end = open.has(mark) ? -1 : text.indexOf(mark, at + mark.length);
      if (end < 0) {
        open.add(mark);
        plain += mark;
        at += mark.length;
      } else {
        flush();
        parts.push({ kind: "code", text: text.slice(at + mark.length, end).trim() });
        at = end + mark.length;
      }
    } else if (depth < DEEPEST && (char === "*" || char === "_")) {
      const found = findEmphasis(text, at, open);
      if (found) {
        flush();
        parts.push({ kind: "emphasis", strong: found.mark.length === 2, parts: parseInline(found.inner, depth + 1) });
        at = found.next;
      } else {
        const mark = text[at + 1] === char ? char + char : char;
        plain += mark;
        at += mark.length;
      }
    } else if (depth < DEEPEST && char === "[" && !open.has("[")) {
      const close = text.indexOf("](", at);
      const end = close < 0 ? -1 : text.indexOf(")", close);
      if (end < 0) {
        open.add("[");
        plain += char;
        at += 1;
      } else if (text.slice(at + 1, close).includes("[")) {
        plain += char;
        at += 1;
      } else {
        flush();
        const address = text.slice(close + 2, end).trim();
        const anchor = address.startsWith("#") ? address.slice(1) : null;
        parts.push({ kind: "link", anchor, address, parts: parseInline(text.slice(at + 1, close), depth + 1) });
        at = end + 1;
      }
    } else {
      plain += char;
      at += 1;
    }
  }
  flush();
  return parts;
}

interface Found {
  mark: string;
  inner: string;
  /** Where the text goes on. */
  next: number;
}

function findEmphasis(text: string, at: number, open: Set<string>): Found | null {
  const char = text[at]!;
  const mark = text[at + 1] === char ? char + char : char;
  const start = at + mark.length;
  if (open.has(mark) || start >= text.length || /\s/.test(text[start]!)) return null;
  // Underscores within words are names, not emphasis.
  if (char === "_" && /[\p{L}\p{N}]/u.test(text[at - 1] ?? " ")) return null;
  let end = text.indexOf(mark, start + 1);
  while (end >= 0) {
    const before = text[end - 1]!;
    const after = text[end + mark.length] ?? " ";
    const single = mark.length === 2 || (after !== char && before !== char);
    if (!/\s/.test(before) && single && (char === "*" || !/[\p{L}\p{N}]/u.test(after))) {
      // The longest run closes: in **a *b*** the last two marks are the outer ones.
      const wide = mark.length === 2 && after === char ? 1 : 0;
      return { mark, inner: text.slice(start, end + wide), next: end + wide + mark.length };
    }
    end = text.indexOf(mark, end + 1);
  }
  open.add(mark);
  return null;
}
