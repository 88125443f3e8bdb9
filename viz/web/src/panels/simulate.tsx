// Simulated runs: starts batches, shows their progress and reports.

import { useEffect, useRef, useState } from "preact/hooks";
import { outcomeClass } from "#core/outcomes.ts";
import { showPage } from "#core/pages.ts";
import { encoded, hasToken } from "#core/requests.ts";
import { beganText } from "#core/run_list.ts";
import { askSimulation, refreshSimulations } from "#core/run_requests.ts";
import type { Form } from "#core/simulations.ts";
import { doneOf, startOf } from "#core/simulations.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { Batch } from "#core/types.ts";
import { fieldValue, Pill } from "#panels/components.tsx";

const REFRESH_MS = 1000;
const FORM: Form = { mission: "", runs: "20", vary: "", seed: "1", limit: "4h", compare: "" };

export const SimulatePage = () => (store.view.pageShown.value === "simulate" ? <OpenPage /> : null);

function OpenPage() {
  const [form, setForm] = useState(FORM);
  const [problems, setProblems] = useState("");
  const { missions, batches } = store.data.simulations.value;
  const names = Object.keys(missions);
  const known = store.data.simulationsKnown.value;
  const mission = form.mission || names[0] || "";
  const heading = useRef<HTMLHeadingElement | null>(null);
  useEffect(() => heading.current?.focus(), []);
  useEffect(() => {
    refreshSimulations();
    const timer = setInterval(refreshSimulations, REFRESH_MS);
    return () => clearInterval(timer);
  }, []);
  const onSubmit = async (e: Event) => {
    e.preventDefault();
    const { asked, problem } = startOf({ ...form, mission });
    setProblems(problem);
    if (!asked) return;
    const answer = await askSimulation(asked);
    setProblems(answer.ok ? "" : (answer.text ?? "refused"));
  };
  const change: (name: keyof typeof FORM) => (e: Event) => void = (name) => (e) =>
    setForm({ ...form, [name]: fieldValue(e) });
  const earlier = batches.filter((one) => one.mission === mission && !one.running && one.report);
  return (
    <section class="simulate" aria-labelledby="simulate-title">
      <header>
        <h2 id="simulate-title" tabindex={-1} ref={heading}>
          Simulated runs
        </h2>
        <span class="spread" />
        <button onClick={() => showPage("runs")}>Close</button>
      </header>
      {hasToken() ? (
        <form onSubmit={onSubmit}>
          <label>
            Mission{" "}
            <select value={mission} onChange={change("mission")}>
              {!names.length && <option value="">{known ? "none installed" : "reading the missions\u2026"}</option>}
              {names.map((name) => (
                <option value={name}>{name}</option>
              ))}
            </select>
          </label>
          <label>
            Runs <input inputmode="numeric" value={form.runs} onInput={change("runs")} />
          </label>
          <label>
            Seed <input inputmode="numeric" value={form.seed} onInput={change("seed")} />
          </label>
          <label>
            Limit of a run <input value={form.limit} onInput={change("limit")} />
          </label>
          <label class="wide">
            Varied values, one per line
            <textarea
              rows={2}
              placeholder="battery=0.2..1.0"
              spellcheck={false}
              value={form.vary}
              onInput={change("vary")}
            />
          </label>
          <label class="wide">
            Compare with{" "}
            <select value={form.compare} onChange={change("compare")}>
              <option value="">nothing</option>
              {earlier.map((one) => (
                <option value={one.id}>
                  {one.runs} runs of {beganText(one.began_ns, new Date())}
                </option>
              ))}
            </select>
          </label>
          {problems && <p class="problem wide">{problems}</p>}
          <p class="wide">
            <button class="primary" type="submit" disabled={!mission}>
              Start
            </button>
            <span class="hint">{shorten(missions[mission] ?? "", 90)}</span>
          </p>
        </form>
      ) : (
        <p class="hint">Only a viewer with --control can start runs, at its address with the token.</p>
      )}
      <ul class="batches">
        {batches.map((one) => (
          <BatchRow key={one.id} batch={one} />
        ))}
      </ul>
    </section>
  );
}

function BatchRow({ batch }: { batch: Batch }) {
  const { id, mission, runs, running, outcomes, failed, problem, report, vary } = batch;
  const done = doneOf(batch);
  const why = problem || batch.first_failure;
  const stop = () => askSimulation({ command: "stop", batch: id });
  return (
    <li>
      <div>
        <b>{shorten(mission, 40)}</b>{" "}
        <span class="hint">
          {beganText(batch.began_ns, new Date())}
          {vary.length > 0 && `, ${shorten(vary.join(", "), 60)}`}
        </span>
      </div>
      <div>
        {running ? (
          <>
            <progress max={runs} value={done} /> {done} of {runs}{" "}
          </>
        ) : (
          `${done} runs `
        )}
        {Object.entries(outcomes).map(([outcome, count]) => (
          <>
            <Pill kind={outcomeClass(outcome)}>
              {shorten(outcome, 20)} ×{count}
            </Pill>{" "}
          </>
        ))}
        {failed > 0 && <Pill kind="failure">no end ×{failed}</Pill>}{" "}
        {running && hasToken() && (
          <button class="small" aria-label={`stop ${id}`} onClick={stop}>
            Stop
          </button>
        )}
        {report && (
          <a
            href={`/api/report?batch=${encoded(id)}`}
            target="_blank"
            rel="noopener noreferrer"
            aria-label={`report of ${id}`}
          >
            Report
          </a>
        )}
      </div>
      {why && <small class="problem">{shorten(why, 200)}</small>}
    </li>
  );
}
