// The page for the actions on the network: sends goals, shows those of others, and cancels goals.

import { useEffect, useRef, useState } from "preact/hooks";
import { askFirst } from "#core/commands.ts";
import { outcomeClass } from "#core/outcomes.ts";
import { isFile } from "#core/page_file.ts";
import { ask, askAction, encoded, hasToken, isFailure } from "#core/requests.ts";
import { store } from "#core/store.ts";
import { duration, shorten } from "#core/text.ts";
import type { ActionServer, SentGoal, ServerGoal } from "#core/types.ts";
import type { Answers } from "#core/wire.ts";
import { GoalForm } from "#panels/goal_pane.tsx";
import { ProgressBar } from "#panels/goals.tsx";
import { togglePage } from "#panels/keys.tsx";

const CANCELLING: Record<string, string> = {
  WAITING_FOR_CANCEL_ACK: "asked to cancel",
  PREEMPTING: "stopping",
  RECALLING: "stopping",
};
const GOALS_MS = 2000; // time between two lists of the goals of others
export function ActionsButton({ id }: { id?: string }) {
  if (isFile()) return null;
  const open = store.view.pageShown.value === "actions";
  const running = (store.data.actions.value?.goals ?? []).filter((goal) => goal.ended == null).length;
  return (
    <button
      id={id}
      class={open ? "on" : ""}
      aria-pressed={open}
      title="send goals to actions (a)"
      onClick={() => togglePage("actions")}
    >
      Actions {running > 0 && <span class="count-badge">{running}</span>}
    </button>
  );
}

export const ActionsPage = () => (store.view.pageShown.value === "actions" ? <OpenPage /> : null);

function OpenPage() {
  const actions = store.data.actions.value?.actions ?? [];
  const chosen = store.view.chosenAction.value ?? actions[0]?.name ?? null;
  const heading = useRef<HTMLHeadingElement | null>(null);
  useEffect(() => heading.current?.focus(), []);
  // The chosen action stays in the list while its server is away.
  const isAway = chosen !== null && !actions.some((one) => one.name === chosen);
  const listed = isAway ? [...actions, { name: chosen }] : actions;
  const server = actions.find((one) => one.name === chosen);
  return (
    <section class="actions-page" aria-labelledby="actions-title">
      <nav class="action-list" aria-label="actions on the network">
        <h2 id="actions-title" tabindex={-1} ref={heading}>
          Actions <span class="number">{actions.length}</span>
        </h2>
        {!actions.length && (
          <p class="hint">No action server on the network yet. This list shows each as soon as it runs.</p>
        )}
        <ul>
          {listed.map((one) => (
            <li key={one.name}>
              <Choice one={one} on={one.name === chosen} />
            </li>
          ))}
        </ul>
      </nav>
      <div class="goal-pane">{chosen !== null && <GoalForm key={chosen} name={chosen} server={server} />}</div>
      <aside class="sent-goals" aria-label="goals">
        {server && <ServerGoals key={chosen} name={chosen} />}
        <SentGoals />
      </aside>
    </section>
  );
}

function Choice({ one, on }: { one: Partial<ActionServer>; on: boolean }) {
  const more = (one.servers ?? 1) - 1;
  const rivals = more > 0 ? ` and ${more} more: several servers have this name` : "";
  const onClick = () => {
    store.view.chosenAction.value = one.name ?? null;
  };
  return (
    <button class={`action ${on ? "on" : ""}`} aria-current={on} onClick={onClick}>
      <b>/{one.name}</b>
      <small>{one.type ?? "its server is gone"}</small>
      {one.node && (
        <small>
          node /{one.node}
          {rivals}
        </small>
      )}
    </button>
  );
}

/** The running goals of an action's server, whoever sent them. */
function ServerGoals({ name }: { name: string }) {
  const [goals, setGoals] = useState<ServerGoal[]>([]);
  const [problem, setProblem] = useState("");
  const own = new Set(store.data.actions.value?.goals.map((goal) => goal.id));
  useEffect(() => {
    let open = true;
    const read = async () => {
      const found = await ask<Answers["GET /api/goals"]>(`/api/goals?name=${encoded(name)}`);
      if (!open) return;
      setGoals(isFailure(found) ? [] : found);
      setProblem(isFailure(found) ? found.text : "");
    };
    read();
    const timer = setInterval(() => document.hidden || read(), GOALS_MS);
    return () => {
      open = false;
      clearInterval(timer);
    };
  }, []);
  const others = goals.filter((goal) => !own.has(goal.id));
  const askFor = (goal: ServerGoal) =>
    askFirst({
      title: `Cancel the goal of ${senderText(goal)} to /${name}?`,
      yes: "Cancel the goal",
      lines: () => [
        goal.mission ? "Its mission goes on with the transition for a cancelled goal." : "",
        goal.gone ? "Its program is gone: nobody else can cancel it." : "Its program is told, and may send another.",
      ],
      situation: () => JSON.stringify([store.view.pageShown.value, store.data.connection.value]),
      give: async () => {
        const answer = await askAction({ command: "cancel", name, goal: goal.id });
        store.view.notify(
          answer.ok ? `goal ${goal.id}: asked to cancel` : (answer.text ?? "refused"),
          answer.ok ? "info" : "error",
        );
      },
    });
  if (!others.length && !problem) return null;
  return (
    <section aria-label={`goals of others to /${name}`}>
      <h2>
        Goals of others to /{name} <span class="number">{others.length || ""}</span>
      </h2>
      {problem && <p class="hint">{problem}</p>}
      {others.map((goal) => (
        <article key={goal.id} class={`goal sent ${goal.gone ? "waiting" : "active"}`}>
          <div class="head">
            <b>{senderText(goal)}</b>
            <span class="times">{duration(Math.max(0, Date.now() - goal.stamp / 1e6) / 1000)}</span>
          </div>
          <div class="text">
            <span class={`pill-text ${goal.gone ? "waiting" : "active"}`}>
              {goal.gone ? "its client is gone" : goal.status.toLowerCase()}
            </span>{" "}
            {shorten(goal.text, 200)}
          </div>
          {hasToken() && (
            <button class="warn" onClick={() => askFor(goal)}>
              Cancel
            </button>
          )}
          <small class="id" title={goal.id}>
            {goal.id}
          </small>
        </article>
      ))}
    </section>
  );
}

/** Who sent a goal. */
const senderText = (goal: ServerGoal) =>
  shorten(goal.mission || (goal.sender ? `node /${goal.sender}` : "an unknown client"), 80);

function SentGoals() {
  const goals = store.data.actions.value?.goals ?? [];
  store.playback.watch();
  return (
    <section aria-label="goals sent from here">
      <h2>
        Goals sent from here <span class="number">{goals.length || ""}</span>
      </h2>
      {!goals.length && <p class="hint">none yet</p>}
      {goals.map((goal) => (
        <Goal key={goal.id} goal={goal} />
      ))}
    </section>
  );
}

/** The class of a goal's colours, and its status in words. */
function statusOf(goal: SentGoal) {
  if (goal.ended != null) return { kind: outcomeClass(goal.status), text: goal.status.toLowerCase() };
  if (goal.state in CANCELLING) return { kind: "preempted", text: CANCELLING[goal.state] };
  if (goal.cancelled) return { kind: "preempted", text: "asked to cancel" };
  if (goal.state === "ACTIVE") return { kind: "active", text: "active" };
  if (goal.state === "WAITING_FOR_GOAL_ACK") return { kind: "waiting", text: "sent" };
  return { kind: "waiting", text: goal.state.toLowerCase().replaceAll("_", " ") };
}

function Goal({ goal }: { goal: SentGoal }) {
  const ended = goal.ended != null;
  const { kind, text } = statusOf(goal);
  const part = goal.status === "SUCCEEDED" ? 1 : goal.fraction;
  const until = goal.ended != null ? goal.ended / 1e6 : Date.now();
  const took = duration(Math.max(0, until - goal.sent / 1e6) / 1000);
  const distance = goal.distance != null && !ended ? `${goal.distance.toFixed(2)} m left` : "";
  const cancel = async () => {
    const answer = await askAction({ command: "cancel", goal: goal.id });
    if (!answer.ok) store.view.notify(answer.text ?? "refused", "error");
  };
  return (
    <article class={`goal sent ${kind}`} aria-label={`goal to /${goal.action}, ${text}`}>
      <div class="head">
        <b>/{goal.action}</b>
        <span class="times">{took}</span>
      </div>
      <ProgressBar part={part} ended={ended} />
      <div class="text">
        <span class={`pill-text ${kind}`} role="status">
          {text}
        </span>{" "}
        {goal.status === "LOST" && "The server of this goal is gone; how the goal ended is not known. "}
        {[goal.text, distance].filter(Boolean).join(" \u00b7 ")}
        {part !== null && !ended && <span class="times">{Math.round(part * 100)} %</span>}
      </div>
      {!ended && hasToken() && (
        <button class="warn" onClick={cancel} disabled={goal.cancelled}>
          Cancel
        </button>
      )}
      {goal.result != null && (
        <details open>
          <summary>result</summary>
          <pre>{goal.result === "{}" ? "no fields" : goal.result}</pre>
        </details>
      )}
      {goal.feedback != null && (
        <details open={!ended}>
          <summary>feedback, the newest of {goal.feedback_count}</summary>
          <pre>{goal.feedback}</pre>
        </details>
      )}
      <small class="id" title={goal.id}>
        {goal.id}
      </small>
    </article>
  );
}
