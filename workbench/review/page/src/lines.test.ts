/// <reference types="vite/client" />
import { expect, it } from "vitest";

const files = import.meta.glob<string>("./**/*.{ts,tsx,css}", { query: "?raw", import: "default", eager: true });

it("no line of the page is longer than 120 columns", () => {
  const long = Object.entries(files).flatMap(([name, text]) =>
    text.split("\n").flatMap((line, index) => ([...line].length > 120 ? [`${name}:${index + 1}`] : [])),
  );
  expect(Object.keys(files).length).toBeGreaterThan(150);
  expect(long).toEqual([]);
});
