import assert from "node:assert/strict";
import { test } from "node:test";
import type { Cause } from "#core/types.ts";
import { wayOf } from "#core/why.ts";

test("the way to the end is made of the ends of states, each once", () => {
  const step = (path: string, outcome = "") =>
    ({
      path,
      outcome,
      stamp_ns: 1,
      what: "",
      kind: "failure",
      reason: "",
      detail: "",
      written: [],
      read: [],
    }) as Cause;
  const steps = [step("/J/A"), step("/J/A", "aborted"), step("/J/A"), step("/J/A", "aborted"), step("/J", "done")];
  const why = { label: "J", outcome: "done", began: 1, ended: 2, steps, text: "" };
  assert.deepEqual(wayOf(why), [
    { path: "/J/A", outcome: "aborted" },
    { path: "/J", outcome: "done" },
  ]);
  assert.deepEqual(wayOf(null), []);
});
