import assert from "node:assert/strict";
import { test } from "node:test";
import { lineOf } from "#core/log_lines.ts";
import { event } from "./fixtures.ts";

test("a transition of a plan is called by its name, and by its id where no plan is known", () => {
  const fired = event("Fired", "/PLAN", { transition: "t6", marking: [] });
  const plan: any = { children: [{ label: "t6", name: "join" }] };
  assert.equal(lineOf(fired, plan).text, "join fired");
  assert.equal(lineOf(fired, { children: [] } as any).text, "t6 fired");
  assert.equal(lineOf(fired).text, "t6 fired");
});
