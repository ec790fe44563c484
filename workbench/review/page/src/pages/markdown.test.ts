import { describe, expect, it } from "vitest";
import { type Block, makeAnchor, parseInline, parseMarkdown, plainText } from "./markdown";

const words = (blocks: Block[]): string =>
  blocks
    .map((block) => {
      if (block.kind === "heading" || block.kind === "paragraph") return plainText(block.parts);
      if (block.kind === "list") return block.items.map((item) => plainText(item.parts) + words(item.below)).join("|");
      if (block.kind === "quote") return words(block.blocks);
      return block.kind === "code" ? block.text : "";
    })
    .join("\n");

describe("parseMarkdown", () => {
  it("reads headings, paragraphs, rules and code", () => {
    const blocks = parseMarkdown("# Manual\n\nFirst\nline\n\n---\n```\n<b> *x*\n```\n## Joy ##\n");
    expect(blocks.map((block) => block.kind)).toEqual(["heading", "paragraph", "rule", "code", "heading"]);
    expect(blocks[1]).toEqual({ kind: "paragraph", parts: [{ kind: "text", text: "First line" }] });
    expect(blocks[3]).toEqual({ kind: "code", text: "<b> *x*" });
    expect(blocks[4]).toMatchObject({ level: 2, anchor: "joy" });
  });

  it("gives headings of one name anchors of their own", () => {
    const blocks = parseMarkdown("# Joie de vivre\n# Joie de vivre\n# !\n");
    const anchors = blocks.map((one) => one.kind === "heading" && one.anchor);
    expect(anchors).toEqual(["joie-de-vivre", "joie-de-vivre-1", "section"]);
    expect(makeAnchor("Colère, dégoût ?")).toBe("colère-dégoût");
  });

  it("nests lists and keeps numbers", () => {
    const [list] = parseMarkdown("3. one\n   - inner *a*\n   - inner b\n     on\n\n4. two\nlazy\n");
    expect(list).toMatchObject({ kind: "list", ordered: true, start: 3 });
    if (list?.kind !== "list") throw new Error("no list");
    expect(list.items.map((item) => plainText(item.parts))).toEqual(["one", "two lazy"]);
    const [inner] = list.items[0]!.below;
    expect(inner).toMatchObject({ kind: "list", ordered: false });
    expect(words([inner!])).toBe("inner a|inner b on");
  });

  it("tells lists of two kinds apart, and reads quotes", () => {
    expect(parseMarkdown("- a\n1. b\n> c\n> - d").map((block) => block.kind)).toEqual(["list", "list", "quote"]);
  });

  it("reads tables, and leaves a line with bars alone", () => {
    const [table, paragraph] = parseMarkdown("| label | sign |\n|---|:-:|\n| joy | a \\| b |\n| anger |\n\na | b\n");
    expect(table).toMatchObject({ kind: "table" });
    if (table?.kind !== "table") throw new Error("no table");
    expect(table.rows.map((row) => row.map(plainText))).toEqual([["joy", "a | b"], ["anger", ""]]);
    expect(paragraph).toMatchObject({ kind: "paragraph" });
  });

  it("takes HTML as text", () => {
    const [block] = parseMarkdown('<script>alert(1)</script> <img src=x onerror="y">');
    expect(block).toEqual({
      kind: "paragraph",
      parts: [{ kind: "text", text: '<script>alert(1)</script> <img src=x onerror="y">' }],
    });
  });

  it("breaks lines at two blanks", () => {
    expect(parseMarkdown("a  \nb\\\nc")[0]).toMatchObject({
      parts: [{ text: "a" }, { kind: "break" }, { text: "b" }, { kind: "break" }, { text: "c" }],
    });
  });

  it("stays quick and whole on hostile texts", () => {
    const hard = [
      "*a ".repeat(20_000), "[".repeat(50_000), "> ".repeat(5000), "- ".repeat(5000), "`a``".repeat(9000),
    ];
    for (const text of hard) {
      const start = performance.now();
      expect(() => parseMarkdown(text)).not.toThrow();
      expect(performance.now() - start).toBeLessThan(3000);
    }
  });
});

describe("parseInline", () => {
  it("reads emphasis, strong and code", () => {
    expect(parseInline("a *b* **c `d*`** e")).toEqual([
      { kind: "text", text: "a " },
      { kind: "emphasis", strong: false, parts: [{ kind: "text", text: "b" }] },
      { kind: "text", text: " " },
      {
        kind: "emphasis",
        strong: true,
        parts: [{ kind: "text", text: "c " }, { kind: "code", text: "d*" }],
      },
      { kind: "text", text: " e" },
    ]);
  });

  it("keeps what is no mark", () => {
    for (const text of ["2 * 3 * 4", "browInnerUp_left_1", "a ** b", "*open", "a]b(c)", "`"]) {
      expect(plainText(parseInline(text))).toBe(text);
    }
    expect(plainText(parseInline("\\*no\\*"))).toBe("*no*");
  });

  it("nests emphasis", () => {
    expect(parseInline("**a *b***")).toEqual([
      {
        kind: "emphasis",
        strong: true,
        parts: [
          { kind: "text", text: "a " }, { kind: "emphasis", strong: false, parts: [{ kind: "text", text: "b" }] },
        ],
      },
    ]);
  });

  it("lets links lead to anchors only", () => {
    const parts = parseInline("[joy](#joy) [x](javascript:alert(1)) [y](https://example.org)");
    const links = parts.filter((part) => part.kind === "link");
    expect(links.map((link) => link.kind === "link" && link.anchor)).toEqual(["joy", null, null]);
  });
});
