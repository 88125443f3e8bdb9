import assert from "node:assert/strict";
import { test } from "node:test";
import { arrangementOf } from "#core/arrangement.ts";
import { fragmentOf, viewOf, withNotes } from "#core/links.ts";

const EMPTY = { at: null, selected: null, opened: null, notes: [], stretch: null, panels: null, plots: null };

test("an address says what is shown, whatever names and texts hold", () => {
  const at = 1795377854028.148;
  const notes = [{ at, text: "why here? #1 & 100 % \u65e5\u672c\nsecond line" }];
  const view = {
    ...EMPTY,
    at,
    selected: "/JOB/A&state=#x",
    opened: ["/JOB", "/JOB/\u{1f916} B"],
    notes,
    plots: [["topic,battery"]],
  };
  const found = viewOf(`#${fragmentOf(view)}`);
  assert.deepEqual([found.selected, found.opened], [view.selected, view.opened]);
  assert.equal(found.notes[0].text, notes[0].text);
  assert.ok(found.at !== null && found.at >= at - 1e-6 && found.at - at < 0.002);
  assert.deepEqual(viewOf(fragmentOf(EMPTY)), EMPTY);
});

test("what makes no sense in an address is left out", () => {
  for (const text of [
    "",
    "#",
    "#at=",
    "#at=NaN",
    "#at=-1",
    "#at=1e99",
    "#at=99999999999999",
    "#note=x",
    "#note=1",
    "#%",
  ])
    assert.deepEqual({ ...viewOf(text) }, EMPTY, text);
  const long = viewOf(`#note=1.5+${"x".repeat(9000)}${"&note=2+y".repeat(500)}`);
  assert.equal(long.notes[0].text.length, 300);
  assert.equal(long.notes.length, 20);
});

test("an address names plots by where their numbers come from", () => {
  const plots = [["topic,a%3Bb%20c", "userdata,%2FJOB,count"], ["progress,move_base,distance"]];
  assert.deepEqual(viewOf(fragmentOf({ ...EMPTY, plots })).plots, plots);
  assert.deepEqual(viewOf(fragmentOf({ ...EMPTY, plots: [] })).plots, []); // chosen: none
  assert.deepEqual(viewOf("#plot=topic,x;nonsense&plot=%25&plot=progress,a,constructor").plots, [["topic,x"]]);
});

test("an address names a stretch of the run", () => {
  const stretch = [1795377854028.25, 1795377860000.5] as [number, number];
  assert.deepEqual(viewOf(fragmentOf({ ...EMPTY, stretch })).stretch, stretch);
  for (const odd of ["5 1", "1", "1 x", "nan nan", "1 1", "0 -1"])
    assert.equal(viewOf(`#stretch=${encodeURIComponent(odd)}`).stretch, null);
});

test("an address names the places of the panels", () => {
  const panels = arrangementOf("|details,map|plots:90|300:500");
  assert.deepEqual(viewOf(fragmentOf({ ...EMPTY, panels })).panels, panels);
  assert.equal(viewOf("#panels=%3Cscript%3E|||1:2").panels, null);
});

test("very many open containers are not in the address", () => {
  const opened = Array.from({ length: 500 }, (_, i) => `/JOB/${i}`);
  assert.equal(viewOf(fragmentOf({ ...EMPTY, opened })).opened, null);
});

test("notes stand in the order of their instants, each once, and not too many", () => {
  const notes = withNotes(
    [{ at: 5, text: "b" }],
    [
      { at: 1, text: " a " },
      { at: 5, text: "b" },
      { at: 9, text: "  " },
    ],
  );
  assert.deepEqual(notes, [
    { at: 1, text: "a" },
    { at: 5, text: "b" },
  ]);
  const many = Array.from({ length: 60 }, (_, i) => ({ at: i, text: "x" }));
  assert.equal(withNotes([], many).length, 20);
});
