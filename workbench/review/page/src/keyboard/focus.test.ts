import { describe, expect, it } from "vitest";
import { isTextField, keysOfControl } from "./focus";

/** What of an element counts, without a browser. */
function make(tag: string, attributes: Record<string, string> = {}, isEditable = false): Element {
  return {
    tagName: tag.toUpperCase(), isContentEditable: isEditable, getAttribute: (name: string) => attributes[name] ?? null,
  } as unknown as Element;
}

describe("isTextField", () => {
  it("knows where keys write", () => {
    for (const type of ["text", "search", "password", "number", "email"])
      expect(isTextField(make("input", { type }))).toBe(true);
    for (const element of [make("input"), make("textarea"), make("select"), make("div", {}, true)])
      expect(isTextField(element)).toBe(true);
    for (const type of ["button", "checkbox", "radio", "range", "color", "file"])
      expect(isTextField(make("input", { type }))).toBe(false);
    for (const element of [null, make("div"), make("button"), make("canvas")]) expect(isTextField(element)).toBe(false);
  });
});

describe("keysOfControl", () => {
  it("leaves controls the keys that work them", () => {
    expect(keysOfControl(make("button"))).toEqual(["Enter", "Space"]);
    expect(keysOfControl(make("input", { type: "range" }))).toContain("ArrowLeft");
    expect(keysOfControl(make("div", { role: "slider" }))).toContain("Home");
    expect(keysOfControl(make("input", { type: "radio" }))).toContain("ArrowDown");
    expect(keysOfControl(make("button", { role: "tab" }))).toContain("ArrowRight");
    // The arrows go from tier to tier by a command.
    expect(keysOfControl(make("button", { role: "radio" }))).toEqual(["Enter", "Space"]);
    expect(keysOfControl(make("section"))).toEqual([]);
    expect(keysOfControl(null)).toEqual([]);
  });
});
