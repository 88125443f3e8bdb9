import assert from "node:assert/strict";
import { test } from "node:test";
import { brief, fieldsOf, pretty, wasShortened } from "#core/values.ts";
import { fixture } from "./fixtures.ts";

/** JavaScript does not know 1.0 from 1. */
const plain = (text: string) => text.replace(/(\d)\.0\b/g, "$1");

test("values are written as Python writes them", () => {
  for (const { value, text } of fixture("values.json")) {
    assert.equal(brief(value), plain(text));
    assert.equal(pretty(value), plain(text));
  }
});

test("a long value has a line for each part, and a short text rounds", () => {
  const long = {
    names: Array.from({ length: 12 }, (_, i) => `place ${i}`),
    at: { $object: "P", fields: { x: 1 / 3 } },
  };
  assert.match(pretty(long), /^\{\n {2}'names': \[\n {4}'place 0',\n/);
  assert.match(pretty(long), /'at': P\(x=0\.3333333333333333\)\n\}$/);
  assert.equal(brief(long.at), "P(x=0.333333)");
});

test("damaged and odd values are shown as they are", () => {
  assert.equal(brief({ $tuple: 5 }), "{'$tuple': 5}");
  assert.equal(brief(undefined), "None");
  assert.equal(brief('it\'s "so"'), `'it\\'s "so"'`);
  assert.equal(brief({ __proto__: null, a: true }), "{'a': True}");
});

test("a value says whether something was left out", () => {
  assert.equal(wasShortened([{ a: { $cut: "x", length: 5000 } }]), true);
  assert.equal(wasShortened({ $repr: "<Thing\u2026" }), true);
  assert.equal(wasShortened({ $msg: "a/B", fields: { text: "\u2026" } }), false);
});

test("only messages, objects and dicts have fields", () => {
  assert.deepEqual(fieldsOf({ $object: "P", fields: { x: 1 } }), { x: 1 });
  assert.deepEqual(fieldsOf({ x: 1 }), { x: 1 });
  for (const one of [null, 5, "x", [1], { $tuple: [1] }]) assert.equal(fieldsOf(one), null);
});
