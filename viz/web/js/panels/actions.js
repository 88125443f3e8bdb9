// The page for the actions on the network: sends goals from a form or as YAML, shows feedback and results, and cancels
// goals.
import { useEffect, useRef, useState } from "preact/hooks";
import { ask, askAction, encoded, hasToken, isFile, showActions } from "#core/connection.js";
import { problemsWithoutField, toState, toYaml } from "#core/goal_values.js";
import { outcomeClass } from "#core/outcomes.js";
import * as store from "#core/store.js";
import { duration } from "#core/text.js";
import { Fields } from "#panels/goal_form.js";
import { ProgressBar } from "#panels/goals.js";
import { fieldValue, html } from "#panels/html.js";

/**
 * The server's description of an action's goal.
 * @typedef {{ type: string, about: string, fields: FormField[], values: Record<string, any>, yaml: string }} Definition
 */

/** @type {Record<string, string>} */
const CANCELLING = { WAITING_FOR_CANCEL_ACK: "asked to cancel", PREEMPTING: "stopping", RECALLING: "stopping" };
const TABS = ["form", "yaml"];
const MOST_LINES = 40; // lines of YAML that are shown without scrolling

export function ActionsButton() {
  if (isFile()) return null;
  const open = store.actionsOpen.value;
  const running = store.actions.value.goals.filter((goal) => goal.ended == null).length;
  return html`<button id="actions" class=${open ? "on" : ""} aria-pressed=${open} title="send goals to actions (a)"
    onClick=${() => showActions(!open)}>Actions${running > 0 && html` <span class="count-badge">${running}</span>`}
  </button>`;
}

export const ActionsPage = () => (store.actionsOpen.value ? html`<${OpenPage} />` : null);

function OpenPage() {
  const { actions } = store.actions.value;
  const chosen = store.chosenAction.value ?? actions[0]?.name ?? null;
  const heading = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => heading.current?.focus(), []);
  // The chosen action stays in the list while its server is away.
  const isAway = chosen !== null && !actions.some((one) => one.name === chosen);
  const listed = isAway ? [...actions, { name: chosen }] : actions;
  const server = actions.find((one) => one.name === chosen);
  return html`<section class="actions-page" aria-labelledby="actions-title">
    <nav class="action-list" aria-label="actions on the network">
      <h2 id="actions-title" tabindex="-1" ref=${heading}>Actions <span class="number">${actions.length}</span></h2>
      ${
        !actions.length &&
        html`<p class="hint">No action server on the network yet. This list shows each as soon as it runs.</p>`
      }
      <ul>${listed.map((one) => html`<li key=${one.name}><${Choice} one=${one} on=${one.name === chosen} /></li>`)}</ul>
    </nav>
    <div class="goal-pane">
      ${chosen !== null && html`<${GoalForm} key=${chosen} name=${chosen} server=${server} />`}</div>
    <${SentGoals} />
  </section>`;
}

/** @param {{ one: Partial<ActionServer>, on: boolean }} props */
function Choice({ one, on }) {
  const more = (one.servers ?? 1) - 1;
  const rivals = more > 0 ? ` and ${more} more: several servers have this name` : "";
  const onClick = () => {
    store.chosenAction.value = one.name ?? null;
  };
  return html`<button class=${`action ${on ? "on" : ""}`} aria-current=${on} onClick=${onClick}>
    <b>/${one.name}</b><small>${one.type ?? "its server is gone"}</small>
    ${one.node && html`<small>node /${one.node}${rivals}</small>`}</button>`;
}

/** Why this page may not send goals, or null. */
function refusal() {
  if (!store.settings.value.control)
    return html`This viewer sends no commands. To send goals, start it with <code>smachpy view --control</code>${" "}
      and open the address that it prints.`;
  if (!hasToken())
    return html`The address of this page has no token. To send goals, open the address that${" "}
      <code>smachpy</code> printed.`;
  return store.connection.value !== "live" ? "The viewer's server does not answer; nothing can be sent." : null;
}

/** @param {{ name: string, server: ActionServer | undefined }} props */
function GoalForm({ name, server }) {
  const [definition, setDefinition] = useState(/** @type {Definition | null} */ (null));
  const [failure, setFailure] = useState(/** @type {string | null} */ (null));
  const [tab, setTab] = useState("form");
  const [state, setState] = useState(/** @type {Record<string, any>} */ ({}));
  const [yaml, setYaml] = useState("");
  const [problems, setProblems] = useState(/** @type {FieldProblem[]} */ ([]));
  const [, redraw] = useState(0);
  const [busy, setBusy] = useState(false);
  const box = useRef(/** @type {HTMLElement | null} */ (null));
  const type = server?.type ?? definition?.type;
  const why = refusal();

  const begin = (/** @type {Definition} */ from) => {
    setState(toState(from.fields, from.values));
    setYaml(from.yaml);
    setProblems([]);
  };
  useEffect(() => {
    if (!server || definition?.type === type) return;
    setFailure(null);
    ask(`/api/action?name=${encoded(name)}`).then((/** @type {any} */ found) => {
      if (!found.fields) {
        setFailure(found.text);
        return;
      }
      setDefinition(found);
      begin(found);
    });
  }, [name, type, !server]);

  const head = html`<header><h2>/${name}</h2>${type && html`<span class="type">${type}</span>`}</header>
    ${definition?.about && html`<p class="doc">${definition.about}</p>`}
    ${
      !server &&
      html`<p class="banner-line waiting" role="status">No server of <b>/${name}</b> on the network: it has left or
        died. The form stays; you can send it when the server is back.</p>`
    }
    ${why && html`<p class="banner-line preempted" role="note" id="why">${why}</p>`}`;
  if (failure) return html`${head}<pre class="error" role="alert">${failure}</pre>`;
  if (!definition) return html`${head}<p class="hint">${server ? "Asking for its definition\u2026" : ""}</p>`;

  const { fields } = definition;
  const text = () => (tab === "form" ? toYaml(fields, state) : yaml);
  const refuse = (/** @type {Answer} */ answer) => {
    setProblems(answer.problems?.length ? answer.problems : [{ path: "", text: answer.text }]);
    requestAnimationFrame(() => focusIn(box.current, "[aria-invalid=true]"));
  };
  const turnTo = async (/** @type {string} */ other) => {
    if (other === tab) return;
    if (!why && server) {
      // the server converts between form and YAML, and finds the problems
      const answer = await askAction({ command: "check", name, yaml: text() });
      if (!answer.ok) {
        refuse(answer);
        return;
      }
      begin({ ...definition, ...answer });
    }
    setTab(other);
  };
  const send = async () => {
    if (why || !server || busy) return;
    setBusy(true);
    const answer = await askAction({ command: "send", name, yaml: text() });
    setBusy(false);
    if (!answer.ok) refuse(answer);
    else {
      setProblems([]);
      store.notify(`goal sent to /${name}`);
    }
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ e) => {
    if (e.key !== "Enter" || !(e.ctrlKey || e.metaKey)) return;
    e.preventDefault();
    send();
  };
  const onTabKey = (/** @type {KeyboardEvent} */ e) => {
    if (!["ArrowLeft", "ArrowRight"].includes(e.key)) return;
    e.preventDefault();
    e.stopPropagation();
    turnTo(TABS[1 - TABS.indexOf(tab)]).then(() => focusIn(box.current, "[role=tab][aria-selected=true]"));
  };
  const tabButton = (/** @type {string} */ one) =>
    html`<button role="tab" type="button" id=${`tab-${one}`} aria-selected=${tab === one} aria-controls="goal-text"
      tabindex=${tab === one ? 0 : -1} onKeyDown=${onTabKey} onClick=${() => turnTo(one)}>
      ${one === "form" ? "Form" : "YAML"}</button>`;
  const listed = tab === "form" ? problemsWithoutField(problems, fields, state) : problems;
  return html`<div class="goal-form" ref=${box} onKeyDown=${onKeyDown}>${head}
    <div class="tabs" role="tablist" aria-label="how to write the goal">${TABS.map(tabButton)}
      <span class="spread"></span>
      <button type="button" disabled=${Boolean(why)} onClick=${() => begin(definition)}>Defaults</button></div>
    <${ProblemList} problems=${listed} />
    <div id="goal-text" role="tabpanel" aria-labelledby=${`tab-${tab}`}>${
      tab === "form"
        ? html`<${Fields} fields=${fields} state=${state} problems=${problems} disabled=${Boolean(why)}
              onChange=${() => redraw((n) => n + 1)} />
            ${!fields.length && html`<p class="hint">This goal has no fields.</p>`}`
        : html`<${YamlText} yaml=${yaml} invalid=${problems.length > 0} readonly=${Boolean(why)} onChange=${setYaml} />`
    }</div>
    <div class="send-line">
      <button type="button" id="send-goal" class="primary" disabled=${Boolean(why) || !server || busy}
        aria-describedby=${why ? "why" : undefined} onClick=${send}>${busy ? "Sending\u2026" : "Send goal"}</button>
      ${!why && html`<small class="hint">or Ctrl+Enter</small>`}</div>
  </div>`;
}

/** @param {HTMLElement | null} box @param {string} selector */
const focusIn = (box, selector) => /** @type {HTMLElement | null} */ (box?.querySelector(selector))?.focus();

/** @param {{ problems: FieldProblem[] }} props */
const ProblemList = ({ problems }) =>
  problems.length
    ? html`<ul class="error problem-list" role="alert">${problems.map(
        (one) => html`<li>${one.path && html`<code>${one.path}</code> `}${one.text}</li>`,
      )}</ul>`
    : null;

/** @param {{ yaml: string, invalid: boolean, readonly: boolean, onChange: (text: string) => void }} props */
function YamlText({ yaml, invalid, readonly, onChange }) {
  const rows = Math.min(MOST_LINES, Math.max(10, yaml.split("\n").length + 1));
  return html`<textarea aria-label="the goal as YAML" aria-invalid=${invalid} spellcheck=${false} wrap="off"
    readonly=${readonly} value=${yaml} rows=${rows}
    onInput=${(/** @type {Event} */ e) => onChange(fieldValue(e))}></textarea>`;
}

function SentGoals() {
  const { goals } = store.actions.value;
  store.tick.value;
  return html`<aside class="sent-goals" aria-label="goals sent from here">
    <h2>Goals sent from here <span class="number">${goals.length || ""}</span></h2>
    ${!goals.length && html`<p class="hint">none yet</p>`}
    ${goals.map((goal) => html`<${Goal} key=${goal.id} goal=${goal} />`)}
  </aside>`;
}

/** The class of a goal's colours, and its status in words. @param {SentGoal} goal */
function statusOf(goal) {
  if (goal.ended != null) return { kind: outcomeClass(goal.status), text: goal.status.toLowerCase() };
  if (goal.state in CANCELLING) return { kind: "preempted", text: CANCELLING[goal.state] };
  if (goal.cancelled) return { kind: "preempted", text: "asked to cancel" };
  if (goal.state === "ACTIVE") return { kind: "active", text: "active" };
  if (goal.state === "WAITING_FOR_GOAL_ACK") return { kind: "waiting", text: "sent" };
  return { kind: "waiting", text: goal.state.toLowerCase().replaceAll("_", " ") };
}

/** @param {{ goal: SentGoal }} props */
function Goal({ goal }) {
  const ended = goal.ended != null;
  const { kind, text } = statusOf(goal);
  const part = goal.status === "SUCCEEDED" ? 1 : goal.fraction;
  const until = goal.ended != null ? goal.ended / 1e6 : Date.now();
  const took = duration(Math.max(0, until - goal.sent / 1e6) / 1000);
  const distance = goal.distance != null && !ended ? `${goal.distance.toFixed(2)} m left` : "";
  const cancel = async () => {
    const answer = await askAction({ command: "cancel", goal: goal.id });
    if (!answer.ok) store.notify(answer.text ?? "refused", "error");
  };
  return html`<article class=${`goal sent ${kind}`} aria-label=${`goal to /${goal.action}, ${text}`}>
    <div class="head"><b>/${goal.action}</b><span class="times">${took}</span></div>
    <${ProgressBar} part=${part} ended=${ended} />
    <div class="text"><span class=${`pill-text ${kind}`} role="status">${text}</span>${" "}
      ${goal.status === "LOST" && "The server of this goal is gone; how the goal ended is not known. "}
      ${[goal.text, distance].filter(Boolean).join(" \u00b7 ")}
      ${part !== null && !ended && html`<span class="times">${Math.round(part * 100)} %</span>`}</div>
    ${!ended && hasToken() && html`<button class="warn" onClick=${cancel} disabled=${goal.cancelled}>Cancel</button>`}
    ${
      goal.result != null &&
      html`<details open><summary>result</summary>
        <pre>${goal.result === "{}" ? "no fields" : goal.result}</pre></details>`
    }
    ${
      goal.feedback != null &&
      html`<details open=${!ended}><summary>feedback, the newest of ${goal.feedback_count}</summary>
        <pre>${goal.feedback}</pre></details>`
    }
    <small class="id" title=${goal.id}>${goal.id}</small>
  </article>`;
}
