import assert from "node:assert/strict";
import { test } from "node:test";
import { problemOf, problemsWithoutField, problemText, toState, toYaml } from "#core/goal_values.ts";
import type { FormField } from "#core/types.ts";
import { fixture } from "./fixtures.ts";

const { fields, read, typed } = fixture("forms.json");
const defaults = () => toState(fields, read[0].values);
const field = (name: string) => fields.find((one: FormField) => one.name === name);

for (const [i, { values, yaml }] of read.entries())
  test(`values become YAML that Python reads as they are: ${i}`, () => {
    assert.equal(toYaml(fields, toState(fields, values)), yaml);
  });

for (const [i, one] of typed.entries())
  test(`what is typed becomes YAML that Python judges: ${i}`, () => {
    assert.equal(toYaml(fields, { ...defaults(), ...one.typed }), one.yaml);
  });

test("a time may be now", () => {
  assert.match(toYaml(fields, { ...defaults(), begin: " now " }), /begin: now,/);
});

test("every problem is shown, at its field or in the list", () => {
  const [, , bad, nested] = typed;
  const state = { ...defaults(), ...bad.typed };
  assert.deepEqual(problemsWithoutField(bad.problems, fields, state), []);
  assert.match(problemOf(bad.problems, "$.doors", field("doors")) ?? "", /^item 2: expected uint16/);
  assert.match(problemOf(bad.problems, "$.serial", field("serial")) ?? "", /^expected int64/);
  assert.equal(problemOf(bad.problems, "$.color", field("color")), null);
  const inside = { ...defaults(), ...nested.typed };
  assert.deepEqual(problemsWithoutField(nested.problems, fields, inside), []);
  const homeless = [
    { path: "", text: "malformed YAML" },
    { path: "$.names[9]", text: "of a row that is not there" },
    { path: "$.corners[0].position.q", text: "no such field" },
  ];
  assert.deepEqual(problemsWithoutField(homeless, fields, inside), homeless);
});

test("a problem quotes what was typed, whatever it is", () => {
  assert.equal(problemText("expected int64, got str", "abc"), "expected int64, got \u201cabc\u201d");
  assert.equal(problemText("expected int64, got str", "$& $1"), "expected int64, got \u201c$& $1\u201d");
  assert.equal(problemText("expected int64, got str", "  "), "expected int64, got nothing");
  assert.equal(problemText("expected int64, got float", "1.5"), "expected int64, got float");
  const robots = "\u{1f916}".repeat(50);
  assert.equal(problemText("got str", robots), `got \u201c${"\u{1f916}".repeat(40)}\u2026\u201d`);
});
