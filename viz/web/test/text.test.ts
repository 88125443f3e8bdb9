import assert from "node:assert/strict";
import { test } from "node:test";
import { KINDS_OF, lineOf } from "#core/log_lines.ts";
import { commonClass, FAILURE, outcomeClass, PREEMPTED_PREFIXES, SUCCESS } from "#core/outcomes.ts";
import { askerText, duration, endOfPath, holdText, shorten, shortenLines } from "#core/text.ts";
import { event, fixture } from "./fixtures.ts";

const texts = fixture("texts.json");

test("paths that end alike are told apart by more of them", () => {
  const paths = ["/a/smachpy/runs", "/home/x/runs", "/y/simulated", "runs", "/b/simulated/runs"];
  const ends = paths.map((one) => endOfPath(one, paths));
  assert.deepEqual(ends, ["smachpy/runs", "x/runs", "simulated", "runs", "simulated/runs"]);
  assert.equal(endOfPath("/runs", ["/runs"]), "runs");
  assert.equal(endOfPath("/runs/", ["/runs/", "/x/runs/"]), "/runs/");
});

test("names are shortened as in Python", () => {
  for (const [text, length, short] of texts.shorten) assert.equal(shorten(text, length), short);
});

test("texts of several lines keep their line breaks", () => {
  assert.equal(shortenLines("Boxes:\n  2 red\r\n\n3 blue", 600), "Boxes:\n2 red\n\n3 blue");
  assert.equal(shortenLines("one\ntwo\nthree", 8), "one\ntwo\n\u2026");
  assert.equal(shortenLines("word ".repeat(500), 600).length, 600);
  assert.equal(shortenLines("\n".repeat(5000), 600), "");
});

test("askers are called as in Python", () => {
  for (const { text, ...asked } of texts.askers) assert.equal(askerText(asked), text);
  assert.equal(askerText(null), null);
  assert.equal(askerText({ source: null }), null);
  assert.equal(askerText({ source: "constructor", by: "x" }), "constructor x");
});

test("outcomes are classed as in Python", () => {
  const table = fixture("outcome_classes.json");
  assert.deepEqual([...SUCCESS].sort(), table.success);
  assert.deepEqual([...FAILURE].sort(), table.failure);
  assert.deepEqual([...PREEMPTED_PREFIXES].sort(), [...table.preempted_prefixes].sort());
  for (const [outcome, expected] of Object.entries(table.classes)) assert.equal(outcomeClass(outcome), expected);
  const monitor = { kind: "monitor" } as any;
  assert.equal(commonClass(null, ["succeeded", "done"]), "success");
  assert.equal(commonClass(null, ["succeeded", "aborted"]), "other");
  assert.equal(commonClass(null, ["invalid"]), "failure");
  assert.equal(commonClass(monitor, ["invalid"]), "other");
  assert.equal(commonClass(monitor, ["exception"]), "failure");
  assert.equal(commonClass(monitor, ["aborted"]), "failure");
  assert.equal(commonClass(null, []), "other");
  const says = { kind: "monitor", success: ["invalid"] } as any;
  assert.equal(commonClass(says, ["invalid"]), "success");
  assert.equal(commonClass(says, ["valid"]), "failure");
  assert.equal(commonClass(says, ["preempted"]), "preempted");
});

test("spans of time", () => {
  for (const [seconds, text] of texts.spans) assert.equal(duration(seconds), text);
  const cases = {
    0: "0.0 s",
    9.94: "9.9 s",
    9.99: "10.0 s",
    61: "61 s",
    121: "2 min 01",
    3725: "62 min 05",
    7260: "2 h 01",
  };
  for (const [seconds, text] of Object.entries(cases)) assert.equal(duration(Number(seconds)), text);
});

test("how long a state holds a preempt up", () => {
  const asked = { source: "operator", by: "ann", why: "", grace: 5 };
  const row = { path: "/A", from: 0, to: null, outcome: null, preempt: 1000, asked, serviced: null, abandoned: null };
  assert.equal(holdText(row, 3000), "2.0 s of 5.0 s");
  assert.equal(holdText({ ...row, asked: null, serviced: 2000 }, 3000), "2.0 s, cleaning up");
});

test("every kind of event that a filter lets through has a line", () => {
  const facts = { outcome: "ok", error: "no", action: "drive", status: "SUCCEEDED", text: "", key: "x", value: 1 };
  Object.assign(facts, { guards: ["ready"], transition: "go", label: "A", answer: "yes", by: "ann" });
  const named = (kind: string) => (kind === "Noted" ? { ...facts, text: "aisle 7" } : facts);
  for (const kinds of Object.values(KINDS_OF))
    for (const kind of kinds) {
      const { text } = lineOf(event(kind, "/JOB", named(kind)));
      assert.ok(text && !text.endsWith(" "), `${kind}: ${text}`);
    }
  assert.equal(KINDS_OF.all.has("constructor"), false);
  const asked = { source: "operator", by: "ann", why: "stop", grace: 5 };
  assert.equal(
    lineOf(event("PreemptRequested", "/JOB", asked)).text,
    "asked to stop by operator ann: stop, within 5.0 s",
  );
});
