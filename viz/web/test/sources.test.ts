// What no linter looks at: widths in texts, lengths of modules, and which may import which.
import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";

const ROOMS = ["core", "drawing", "panels"]; // each imports only of those before it, and of itself
const files = ["src", "test"].flatMap(
  (top) =>
    readdirSync(top, { recursive: true })
      .map((name) => `${top}/${name}`)
      .filter((name) => /\.tsx?$/.test(name) && name !== "src/core/wire.ts"), // which is made
);

test("no line is wider than 120 columns", () => {
  const wide = files
    .filter((name) => name !== "src/core/wire.ts")
    .flatMap((name) =>
      readFileSync(name, "utf-8")
        .split("\n")
        .flatMap((line, i) => (line.length > 120 ? [`${name}:${i + 1}`] : [])),
    );
  assert.deepEqual(wide, []);
});

test("no module is longer than 350 lines", () => {
  const long = files.filter((name) => readFileSync(name, "utf-8").split("\n").length > 351);
  assert.deepEqual(long, []);
});

test("imports go one way: core, drawing, panels", () => {
  for (const [i, room] of ROOMS.entries())
    for (const name of files.filter((file) => file.startsWith(`src/${room}/`))) {
      const imported = [...readFileSync(name, "utf-8").matchAll(/(?:from|import) ?\(?"([#./][^"]*)"/g)];
      for (const [, path] of imported) {
        const target = path.match(/^#(\w+)\//)?.[1] ?? "a relative path";
        assert.ok(ROOMS.slice(0, i + 1).includes(target), `${name} imports ${path}`);
      }
    }
});
