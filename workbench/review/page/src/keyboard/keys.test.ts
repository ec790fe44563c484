import { describe, expect, it } from "vitest";
import { addShift, normalizeKeys, readPress, writeKeys, type Press } from "./keys";

function press(key: string, code: string, held = "", altGraph = false): Press {
  return {
    key, code, shiftKey: held.includes("s"), ctrlKey: held.includes("c"), altKey: held.includes("a"),
    metaKey: held.includes("m"),
    getModifierState: (name) => name === "AltGraph" && altGraph,
  };
}

describe("readPress", () => {
  it("takes letters as they are printed, whatever Caps Lock says", () => {
    expect(readPress(press("m", "KeyM"))).toEqual(["M"]);
    expect(readPress(press("M", "KeyM"))).toEqual(["M"]);
    expect(readPress(press("M", "KeyM", "s"))).toEqual(["Shift+M"]);
    // On a French keyboard A stands where others have Q.
    expect(readPress(press("a", "KeyQ"))).toEqual(["A"]);
    expect(readPress(press("z", "KeyW", "c"))).toEqual(["Ctrl+Z"]);
    expect(readPress(press("z", "KeyZ", "m"))).toEqual(["Ctrl+Z"]);
  });

  it("takes digits by their place: French keyboards write them with Shift", () => {
    expect(readPress(press("1", "Digit1"))[0]).toBe("1");
    expect(readPress(press("&", "Digit1"))[0]).toBe("1");
    expect(readPress(press("1", "Digit1", "s"))[0]).toBe("Shift+1");
    expect(readPress(press("!", "Digit1", "s"))[0]).toBe("Shift+1");
    expect(readPress(press("7", "Numpad7"))).toEqual(["7"]);
    // The sign on the digit's key is there too, where no label has the digit.
    expect(readPress(press("-", "Digit6"))).toEqual(["6", "-"]);
  });

  it("takes signs by what they write", () => {
    expect(readPress(press("?", "Slash", "s"))).toEqual(["?"]);
    expect(readPress(press("?", "KeyM", "s"))).toEqual(["?"]);
    expect(readPress(press("+", "Equal", "s"))).toEqual(["+"]);
    expect(readPress(press(".", "Comma", "s"))).toEqual(["."]);
    expect(readPress(press("@", "Digit0", "ca", true))).toEqual(["@"]);
  });

  it("knows named keys, and letters of other alphabets by their place", () => {
    expect(readPress(press(" ", "Space"))).toEqual(["Space"]);
    expect(readPress(press("ArrowLeft", "ArrowLeft", "as"))).toEqual(["Alt+Shift+ArrowLeft"]);
    expect(readPress(press("F6", "F6", "s"))).toEqual(["Shift+F6"]);
    expect(readPress(press("ь", "KeyM"))).toEqual(["Ь", "M"]);
  });

  it("says nothing of modifiers alone, nor of unfinished accents", () => {
    for (
      const key of ["Shift", "Control", "AltGraph", "Dead", "Unidentified", "Process"]
    ) expect(readPress(press(key, ""))).toEqual([]);
  });
});

describe("normalizeKeys", () => {
  it.each([
    ["a", "A"], ["shift+a", "Shift+A"], ["Shift+Ctrl+z", "Ctrl+Shift+Z"], ["1", "1"], ["Shift+1", "Shift+1"],
    [" ", "Space"], ["+", "+"],
    ["Ctrl++", "Ctrl++"], ["Shift+?", "?"], ["ArrowLeft", "ArrowLeft"], ["é", "É"],
  ])("writes %s as %s", (text, expected) => expect(normalizeKeys(text)).toBe(expected));

  it.each(["", "Hyper+A", "ab", "Ctrl+", "left arrow"])(
    "takes %s for no key", (text) => expect(normalizeKeys(text)).toBe(""),
  );

  it("leaves what a press says as it is", () => {
    const presses = [
      press("a", "KeyA", "cs"), press("?", "Slash", "s"), press("&", "Digit1", "s"), press("+", "Equal", "cs"),
      press(" ", "Space", "s"),
    ];
    for (const one of presses) for (const text of readPress(one)) expect(normalizeKeys(text)).toBe(text);
  });
});

describe("addShift", () => {
  it("adds it where it is no part of a sign", () => {
    expect(addShift("1")).toBe("Shift+1");
    expect(addShift("A")).toBe("Shift+A");
    expect(addShift("Ctrl+A")).toBe("Ctrl+Shift+A");
    expect(addShift("?")).toBe("");
    expect(addShift("Shift+A")).toBe("");
    expect(addShift("")).toBe("");
  });
});

describe("writeKeys", () => {
  it("speaks the person's language", () => {
    expect(writeKeys("Shift+Space", "fr")).toBe("Maj+Espace");
    expect(writeKeys("Alt+ArrowLeft", "en")).toBe("Alt+←");
    expect(writeKeys("Ctrl++", "en")).toBe("Ctrl++");
    expect(writeKeys("+", "fr")).toBe("+");
  });
});
