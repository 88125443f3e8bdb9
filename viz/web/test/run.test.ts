import assert from "node:assert/strict";
import { test } from "node:test";
import { emptyState, foldOne } from "#core/fold.ts";
import { Run } from "#core/run.ts";
import { event, fixture } from "./fixtures.ts";

function manyVisits(visits: number) {
  const events = [event("Started", "/JOB")];
  for (let i = 0; i < visits; i++)
    events.push(event("Entered", "/JOB/A"), event("Left", "/JOB/A", { outcome: i % 3 ? "ok" : "failed" }));
  return events;
}

test("every earlier state can be seen again", () => {
  for (const { events } of fixture("folds.json")) {
    const run = new Run(null, events);
    const data = emptyState();
    for (const [i, e] of events.entries()) {
      foldOne(data, e);
      assert.deepEqual(run.after(i + 1), data);
    }
    assert.deepEqual(run.after(0), emptyState());
    assert.deepEqual(run.now, data);
  }
});

test("the oldest events are forgotten, what they added up to is not", () => {
  const events = manyVisits(1000);
  const run = new Run(null, events);
  const gone = run.trim(900);
  assert.equal(gone, 800);
  assert.equal(run.events.length, events.length - gone);
  assert.deepEqual(run.now, new Run(null, events).now);
  assert.deepEqual(run.after(50), new Run(null, events).after(gone + 50));
  assert.equal(run.trim(900), 0);
  // The span of what still runs is kept, however long ago it began.
  assert.deepEqual(
    run.spans.filter((span) => span.to === null).map((span) => span.path),
    ["/JOB"],
  );
  assert.equal(run.first(), events[0].stamp_ns / 1e6);
});

test("a run goes on from what its base says is under way", () => {
  const before = manyVisits(1);
  before.push(event("Entered", "/JOB/B"), event("PreemptRequested", "/JOB/B", { source: "operator", by: "ann" }));
  const base = new Run(null, before).now;
  const run = new Run(base, [event("Left", "/JOB/B", { outcome: "preempted" })]);
  const span = run.spans.find((one) => one.path === "/JOB/B");
  assert.equal(span?.outcome, "preempted");
  assert.equal(span?.preempt, before[before.length - 1].stamp_ns / 1e6);
  assert.equal(run.preempts.length, 1);
});

test("the number of events until an instant", () => {
  const events = manyVisits(3);
  const run = new Run(null, events);
  const [first, second] = events.map((e) => e.stamp_ns / 1e6);
  assert.equal(run.indexAt(first - 1), 0);
  assert.equal(run.indexAt(first), 1);
  assert.equal(run.indexAt(second - 1), 1);
  assert.equal(run.indexAt(Infinity), events.length);
});

test("a state whose end is unknown does not run for ever", () => {
  const lost = event("Entered", "/JOB/A");
  const again = event("Entered", "/JOB/A", { dropped: 3 });
  const run = new Run(null, [event("Started", "/JOB"), lost, again]);
  const [, first, second] = run.spans;
  assert.equal(first.to, again.stamp_ns / 1e6);
  assert.equal(first.outcome, null);
  assert.equal(second.to, null);
});

test("a mission that is started again holds up no preempt of the run before", () => {
  const asked = event("PreemptRequested", "/JOB/A", { source: "signal", by: "SIGINT" });
  const run = new Run(null, [event("Started", "/JOB"), event("Entered", "/JOB/A"), asked]);
  assert.deepEqual(
    run.preemptAt(asked.stamp_ns / 1e6)?.holds.map((row) => row.path),
    ["/JOB/A"],
  );
  const restart = event("Started", "/JOB");
  run.push([restart]);
  assert.deepEqual(run.preemptAt(restart.stamp_ns / 1e6)?.holds, []);
  assert.equal(run.spans.find((span) => span.path === "/JOB/A")?.to, restart.stamp_ns / 1e6);
  assert.equal(run.spans.filter((span) => span.to === null).length, 1);
});

test("a preempt as it was at an instant", () => {
  const events = [
    event("Started", "/JOB"),
    event("Entered", "/JOB/B"),
    event("Entered", "/JOB/B/C"),
    event("PreemptRequested", "/JOB/B", { source: "operator", by: "ann", why: "stop", grace: null }),
    event("PreemptRequested", "/JOB/B/C", { source: "operator", by: "ann", why: "stop", grace: 5 }),
    event("PreemptServiced", "/JOB/B/C"),
    event("Left", "/JOB/B/C", { outcome: "preempted" }),
    event("Left", "/JOB/B", { outcome: "preempted" }),
  ];
  const run = new Run(null, events);
  const at = (i: number) => run.preemptAt(events[i].stamp_ns / 1e6);
  assert.equal(at(2), null);
  assert.deepEqual(
    at(3)?.holds.map((row) => row.path),
    ["/JOB/B"],
  );
  assert.deepEqual(
    at(4)?.holds.map((row) => [row.path, row.serviced, row.asked?.grace]),
    [["/JOB/B/C", null, 5]],
  );
  assert.equal(at(5)?.holds[0].serviced, events[5].stamp_ns / 1e6);
  assert.deepEqual(
    at(6)?.holds.map((row) => row.path),
    ["/JOB/B"],
  );
  assert.equal(at(7)?.to, events[7].stamp_ns / 1e6);
  assert.deepEqual(at(7)?.holds, []);
});

test("what the last transition wrote", () => {
  const events = [
    event("Started", "/JOB"),
    event("UserdataWritten", "/JOB", { key: "x", value: 0 }),
    event("Entered", "/JOB/A"),
    event("UserdataWritten", "/JOB/A", { key: "x", value: 1 }),
    event("Left", "/JOB/A", { outcome: "ok" }),
    event("Entered", "/JOB/B"),
    event("UserdataWritten", "/JOB/B", { key: "y", value: 2 }),
    event("Left", "/JOB/B", { outcome: "ok" }),
  ];
  const run = new Run(null, events);
  const { before, writes } = run.lastTransition(events.length);
  assert.deepEqual(
    writes.map((e) => e.key),
    ["y"],
  );
  assert.equal(before.userdata["/JOB x"].value, 1);
  assert.deepEqual(run.lastTransition(0).writes, []);
  assert.deepEqual(new Run(null, []).lastTransition(0).writes, []);
});

test("a run that another process goes on with is one: what it took up again has one bar", () => {
  const { events } = fixture("folds.json").at(-1);
  const run = new Run(null, events);
  const bars = (path: string) =>
    run.spans.filter((span) => span.path === path).map(({ to, outcome }) => [to === null, outcome]);
  assert.deepEqual(bars("/JOB"), [[true, null]]);
  assert.deepEqual(bars("/JOB/B/C"), [[false, "done"]]);
  assert.deepEqual(bars("/JOB/B/D"), [[false, null]]); // its end was not recorded
  assert.deepEqual(bars("/JOB/B/E"), [[true, null]]);
  // One that only knows the second process has the same bars of what went on.
  const late = new Run(null, events.slice(11));
  assert.deepEqual(
    late.spans.map(({ path, from }) => [path, from]),
    run.spans.filter(({ path }) => !/[AD]$/.test(path)).map(({ path, from }) => [path, from]),
  );
});
