import assert from "node:assert/strict";
import { test } from "node:test";
import { emptyState, foldOne } from "#core/fold.ts";
import { answerText, buttonsOf, heldStates, isUrgent, questionsOf, titleOf } from "#core/questions.ts";
import type { RunEvent } from "#core/types.ts";
import { event, fixture } from "./fixtures.ts";

const QUESTION = { text: "Go on?", answers: ["yes", "no"], words: ["Go on", ""], default: "no_answer" };
const ASKED = { ...QUESTION, patience: 60, service: "operator/questions/q1", has_picture: false };
const UNANSWERED = { ...ASKED, asked: 0, answer: null, by: null, answered: null };

function fold(events: RunEvent[]) {
  const data = emptyState();
  for (const e of events) foldOne(data, e);
  return data;
}

test("the questions that wait are those that Python finds", () => {
  for (const { events, questions } of fixture("folds.json")) {
    const now = events.at(-1).stamp_ns / 1e6;
    const open = questionsOf(fold(events), now).filter((one) => one.isOpen);
    assert.deepEqual(
      open.map((one) => one.path),
      questions ?? [],
    );
  }
});

test("a question counts down, is answered, and closes a moment later", () => {
  const asked = event("QuestionAsked", "/JOB/ASK", ASKED);
  const events = [event("Started", "/JOB"), event("Entered", "/JOB/ASK"), asked];
  const at = asked.stamp_ns / 1e6;
  const [waits] = questionsOf(fold(events), at + 15_000);
  assert.deepEqual([waits.left, waits.share, waits.isOpen, isUrgent(waits)], [45, 0.75, true, false]);
  assert.equal(isUrgent(questionsOf(fold(events), at + 50_000)[0]), true);
  assert.equal(questionsOf(fold(events), at + 90_000)[0].left, 0);
  const answered = event("QuestionAnswered", "/JOB/ASK", { answer: "yes", by: "ann" });
  const [over] = questionsOf(fold([...events, answered]), answered.stamp_ns / 1e6 + 2000);
  assert.deepEqual([over.isOpen, answerText(over)], [false, "answered yes by ann, 2 s ago"]);
  assert.deepEqual(questionsOf(fold([...events, answered]), answered.stamp_ns / 1e6 + 3000), []);
  const ended = event("Finished", "/JOB", { outcome: "done" });
  assert.deepEqual(questionsOf(fold([...events, answered, ended]), ended.stamp_ns / 1e6), []);
  const silence = { ...over, by: "", answer: "no_answer" };
  assert.equal(answerText(silence), "nobody answered: no_answer, 2 s ago");
});

test("the safe answer stands first", () => {
  const order = (facts: object) => buttonsOf({ ...UNANSWERED, ...facts }).map((one) => one.text);
  assert.deepEqual(order({}), ["no", "Go on"]);
  assert.deepEqual(order({ default: "yes" }), ["Go on", "no"]);
  assert.deepEqual(order({ answers: ["retry", "home", "stop"], words: ["", "Drive home", ""] }), [
    "stop",
    "retry",
    "Drive home",
  ]);
  assert.deepEqual(
    buttonsOf(UNANSWERED).map((one) => one.isFirst),
    [false, true],
  );
});

test("the title counts the questions, and blinks when one is urgent", () => {
  const asked = event("QuestionAsked", "/JOB/ASK", ASKED);
  const data = fold([event("Started", "/JOB"), event("Entered", "/JOB/ASK"), asked]);
  const title = (waited: number) => titleOf("JOB", questionsOf(data, asked.stamp_ns / 1e6 + 1000 * waited), 0);
  assert.equal(title(1), "(1) JOB");
  assert.deepEqual([title(52.5), title(53.5)], ["? Go on?", "(1) JOB"]);
  assert.equal(titleOf("JOB", [], 0), "JOB");
  assert.equal(titleOf("JOB", [], 2), "(2) JOB");
});

test("a breakpoint asks too, a pause of the operator's own does not", () => {
  const events = [event("Started", "/JOB"), event("Paused", "/JOB/A", { reason: "breakpoint" })];
  assert.deepEqual(heldStates(fold(events)), ["/JOB/A"]);
  assert.deepEqual(heldStates(fold([...events, event("Resumed", "/JOB/A")])), []);
  assert.deepEqual(heldStates(fold([events[0], event("Paused", "/JOB/A", { reason: "pause" })])), []);
});
