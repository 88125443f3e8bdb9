// What no linter looks at: widths in templates, which module may import which, and the versions of libraries.
import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";

const ROOT = new URL("../../", import.meta.url);
const ROOMS = ["core", "drawing", "panels"]; // each imports only of those before it, and of itself
const read = (/** @type {string} */ name) => readFileSync(new URL(name, ROOT), "utf-8");
const files = [...ROOMS, "test"].flatMap((room) =>
  readdirSync(new URL(`js/${room}/`, ROOT)).map((name) => `js/${room}/${name}`),
);

test("no line is wider than 120 columns", () => {
  const wide = [...files, "js/app.js", "types.d.ts", "index.html"].flatMap((name) =>
    read(name)
      .split("\n")
      .flatMap((line, i) => (line.length > 120 ? [`${name}:${i + 1}`] : [])),
  );
  assert.deepEqual(wide, []);
});

test("imports go one way: core, drawing, panels", () => {
  for (const [i, room] of ROOMS.entries())
    for (const name of files.filter((file) => file.startsWith(`js/${room}/`))) {
      const imported = [...read(name).matchAll(/(?:from|import) "([#./][^"]*)"|import\("([#./][^"]*)"\)/g)];
      for (const [, direct, typed] of imported) {
        const target = (direct ?? typed).match(/^#(\w+)\//)?.[1] ?? "a relative path";
        assert.ok(ROOMS.slice(0, i + 1).includes(target), `${name} imports ${direct ?? typed}`);
      }
    }
});

test("the type checker sees the libraries that are shipped", () => {
  const shipped = new Set(
    read("vendor/SHA256SUMS.txt")
      .split("\n")
      .map((line) => line.split("  ")[2]),
  );
  const { devDependencies } = JSON.parse(read("package.json"));
  for (const name of ["preact", "htm", "@preact/signals", "@preact/signals-core"])
    assert.ok(shipped.has(`${name}@${devDependencies[name]}`), name);
});
