import assert from "node:assert/strict";
import { test } from "node:test";
import { asked, type Item, type Kind, ranked } from "#core/palette.ts";

const item = (kind: Kind, name: string, more = ""): Item => ({ kind, name, more, pick: () => {} });
const ITEMS = [
  item("command", "Pause PATROL"),
  item("state", "DRIVE", "/PATROL/VISIT"),
  item("state", "DRIVE_TO_DOCK", "/PATROL/RECHARGE"),
  item("key", "drive_count", "3"),
  item("run", "patrol", "succeeded"),
  item("state", "OVERDRIVE", "/PATROL"),
];
const names = (text: string) => ranked(ITEMS, text).map(({ name }) => name);

test("a sign in front asks for one kind", () => {
  assert.deepEqual(asked("> pause"), { kind: "command", words: "pause" });
  assert.deepEqual(asked(" 01:32"), { kind: null, words: "01:32" });
  assert.deepEqual(names("."), ["drive_count"]);
  assert.deepEqual(names("#"), ["patrol"]);
});

test("names that begin with the text come first, states before keys", () => {
  assert.deepEqual(names("drive"), ["DRIVE", "DRIVE_TO_DOCK", "drive_count", "OVERDRIVE"]);
});

test("all words are looked for, also in what stands beside the name", () => {
  assert.deepEqual(names("dock recharge"), ["DRIVE_TO_DOCK"]);
  assert.deepEqual(names("patrol pause"), ["Pause PATROL"]);
  assert.deepEqual(names("nothing like it"), []);
});
