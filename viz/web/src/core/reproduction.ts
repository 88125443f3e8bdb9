// The finished run shown, run again with today's code: asked for, followed, and what it has found.

import type { Signal } from "@preact/signals";
import { signal } from "@preact/signals";
import type { Note } from "#core/links.ts";
import { isFile } from "#core/page_file.ts";
import { ask, encoded, hasToken, isFailure, link, post } from "#core/requests.ts";
import { Run } from "#core/run.ts";
import { store } from "#core/store.ts";
import { beginOf } from "#core/two_runs.ts";
import type { RunEvent } from "#core/types.ts";
import type { Answers, Done, Found, ReproductionStarted } from "#core/wire.ts";

const POLL_MS = 400;
const AGAIN = ", again "; // in the names of machines that show a run of today

/** `now` is today's run, once it is known. */
export type Reproduction = {
  id: string;
  what: "run" | "test";
  epoch: string; // of the run that it is about
  problem: string;
  found: Found | null;
  now: Run | null;
};

export const newest: Signal<Reproduction | null> = signal(null);
export const twoRunsShown = signal(false); // whether the timeline shows both runs

/** The reproduction of the run shown; null if there is none. */
export function reproduction() {
  const one = newest.value;
  return one && one.epoch === store.data.facts.value?.epoch ? one : null;
}

/** Whether the run shown is over, and this page may have it run again. */
export function canReproduce() {
  store.playback.watch();
  const facts = store.data.facts.value;
  if (!facts || isFile() || !hasToken() || !store.data.settings.value.reproduces) return false;
  if (facts.name.includes(AGAIN)) return false;
  return (
    store.data.run.now.started != null && (store.data.run.now.ended != null || facts.recorded || facts.stale != null)
  );
}

/**
 * Run the run shown again, or have a test of it written.
 * @param expect the outcome that the test expects; "" for what was recorded
 */
export async function reproduce(what: "run" | "test", expect = "") {
  const { name = "", epoch = "" } = store.data.facts.value ?? {};
  const asked = { command: "start", machine: name, what, expect };
  const answer = await post<ReproductionStarted>("/api/reproduce", asked);
  if (isFailure(answer)) {
    if (!answer.wants_token) store.view.notify(`Reproduce: ${answer.text}`, "error");
    return;
  }
  const mine: Reproduction = { id: answer.id, what, epoch, problem: "", found: null, now: null };
  newest.value = mine;
  twoRunsShown.value = false;
  store.view.part.value = "log"; // the part in which a phone shows it
  await follow(mine);
}

async function follow(mine: Reproduction) {
  for (;;) {
    const answer = await ask<Answers["GET /api/reproduction"]>(`/api/reproduction?id=${encoded(mine.id)}`);
    if (newest.value?.id !== mine.id) return;
    if (isFailure(answer) || !answer.running) {
      const problem = isFailure(answer) ? answer.text : answer.problem;
      const found = isFailure(answer) ? null : answer.found;
      const now = found?.machine ? await runOf(found.machine) : null;
      if (newest.value?.id !== mine.id) return;
      newest.value = { ...mine, problem, found, now };
      twoRunsShown.value = found?.kind === "differs" && now !== null;
      return;
    }
    await new Promise((done) => setTimeout(done, POLL_MS));
  }
}

/** The run of a machine, from its recording: a header, then a record a line. */
async function runOf(machine: string) {
  try {
    const answer = await fetch(link("export", "&format=jsonl", machine));
    const lines = (await answer.text()).split("\n").slice(1).filter(Boolean);
    const records: RunEvent[] = lines.map((line) => JSON.parse(line));
    return answer.ok
      ? new Run(
          null,
          records.filter(({ path }) => path),
        )
      : null;
  } catch (error) {
    store.view.notify(`Today's run: ${error}`, "error");
    return null;
  }
}

export const stopReproduction = (id: string) => post<Done>("/api/reproduce", { command: "stop", id });

export function closeReproduction() {
  newest.value = null;
  twoRunsShown.value = false;
}

/** The first difference on the clock of the run shown [ms]; null without one. */
export function differenceAt() {
  const { found, now } = reproduction() ?? {};
  return found?.difference && now ? beginOf(store.data.run) + 1000 * found.difference.at : null;
}

/** Go to the first difference. */
export function seekDifference() {
  const at = differenceAt();
  if (at !== null) store.playback.seek(at);
}

/** The notes of the run, and a mark at the first difference: pins in the timeline. */
export function pins(): Note[] {
  const at = differenceAt();
  return at === null ? store.notes.all.value : [...store.notes.all.value, { at, text: "\u2260 differs from today" }];
}
