// What is asked about runs: the list of runs, the live ones together, simulated ones, durable missions.

import { batch } from "@preact/signals";
import { choose } from "#core/connection.ts";
import { ask, encoded, isFailure, post } from "#core/requests.ts";
import { store } from "#core/store.ts";
import type { FleetRuns, Mission } from "#core/types.ts";
import type { Answers, BatchStarted, Done } from "#core/wire.ts";

const REFRESH_MS = 2000; // shortest time between two lists of runs
let refreshed = -REFRESH_MS; // [ms]
let refreshDue: ReturnType<typeof setTimeout> | 0 = 0;

/** Request the list of runs, at once or when it is due. */
export function refreshRuns() {
  if (refreshDue) return;
  refreshDue = setTimeout(
    async () => {
      const answer = await ask<Answers["GET /api/runs"]>("/api/runs");
      refreshed = performance.now();
      refreshDue = 0;
      batch(() => {
        store.data.runsProblem.value = isFailure(answer) ? answer.text : "";
        if (!isFailure(answer)) store.data.runs.value = answer;
        store.data.runsKnown.value = true;
      });
    },
    Math.max(0, refreshed + REFRESH_MS - performance.now()),
  );
}

/** Some of the live runs together: those after the first `skip`. */
export async function askFleet(skip: number): Promise<FleetRuns | null> {
  const answer = await ask<Answers["GET /api/fleet"]>(`/api/fleet?skip=${skip}`);
  return isFailure(answer) ? null : answer;
}

/** Start a batch of simulated runs, or stop one. */
export async function askSimulation(data: object) {
  const answer = await post<Done | BatchStarted>("/api/simulate", data);
  await refreshSimulations();
  return answer;
}

/** Request the batches of simulated runs. */
export async function refreshSimulations() {
  const answer = await ask<Answers["GET /api/simulations"]>("/api/simulations");
  if (isFailure(answer)) return;
  store.data.simulations.value = answer;
  store.data.simulationsKnown.value = true;
}

/** Resume or cancel a durable mission. */
export async function commandMission({ journal, id }: Mission, what: string) {
  const answer = await post<Done>("/api/mission", { journal, id, command: what });
  if (answer.ok) store.view.notify(`${id}: ${answer.text}`);
  else if (!answer.wants_token) store.view.notify(answer.text, "error");
  refreshRuns();
}

/** Show a run of the list. */
export async function openRun(id: string) {
  const answer = await ask<Answers["GET /api/open"]>(`/api/open?run=${encoded(id)}`);
  if (!answer.ok) {
    store.view.notify(`Run: ${answer.text}`, "error");
    return;
  }
  choose(answer.name);
}
