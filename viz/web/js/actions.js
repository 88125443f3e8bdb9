// The actions on the network: a goal from a form or as YAML, its feedback and result, its cancel.
import { h } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import htm from "htm";
import * as store from "viewer/store";
import { ask, askAction, encoded, hasToken, isFile, showActions } from "viewer/source";
import { Fields, homeless, toState, toYaml } from "viewer/goalform";
import { outcomeClass } from "viewer/model";
import { span } from "viewer/diagram";
import { ms } from "viewer/fold";

const html = htm.bind(h);
const ASKED = { WAITING_FOR_CANCEL_ACK: "asked to cancel", PREEMPTING: "stopping", RECALLING: "stopping" };

export function ActionsButton() {
  if (isFile()) return null;
  const open = store.actionsOpen.value, running = store.actions.value.goals.filter((g) => g.ended == null).length;
  return html`<button id="actions" class=${open ? "on" : ""} aria-pressed=${open} title="send goals to actions (a)"
    onClick=${() => showActions(!open)}>Actions${running > 0 && html` <span class="count-badge">${running}</span>`}</button>`;
}

export function ActionsPage() {
  if (!store.actionsOpen.value) return null;
  return html`<${Open} />`;
}

function Open() {
  const { actions } = store.actions.value;
  const picked = store.picked.value ?? actions[0]?.name ?? null;
  const heading = useRef();
  useEffect(() => { heading.current?.focus(); }, []);
  return html`<section class="actions-page" aria-labelledby="actions-title">
    <nav class="action-list" aria-label="actions on the network">
      <h2 id="actions-title" tabindex="-1" ref=${heading}>Actions <span class="number">${actions.length}</span></h2>
      ${!actions.length && html`<p class="hint">No action server on the network yet. Each shows up here as soon as it runs.</p>`}
      <ul>${names(actions, picked).map((one) => html`<li key=${one.name}><button class=${`action ${one.name === picked ? "on" : ""}`} aria-current=${one.name === picked}
        onClick=${() => { store.picked.value = one.name; }}><b>/${one.name}</b>
        <small>${one.type ?? "its server is gone"}</small>
        ${one.node && html`<small>node /${one.node}${one.servers > 1 ? ` and ${one.servers - 1} more: two servers of one name` : ""}</small>`}</button></li>`)}</ul>
    </nav>
    <div class="goal-pane">${picked ? html`<${GoalForm} key=${picked} name=${picked} there=${actions.find((a) => a.name === picked)} />` : ""}</div>
    <${SentGoals} />
  </section>`;
}

// The action that was picked stays in the list while its server is away.
const names = (actions, picked) =>
  picked && !actions.some((a) => a.name === picked) ? [...actions, { name: picked }] : actions;

function GoalForm({ name, there }) {
  const [about, setAbout] = useState(null);
  const [failure, setFailure] = useState(null);
  const [tab, setTab] = useState("form");
  const [state, setState] = useState(null);
  const [yaml, setYaml] = useState("");
  const [problems, setProblems] = useState([]);
  const [, redraw] = useState(0);
  const [busy, setBusy] = useState(false);
  const box = useRef();
  const type = there?.type ?? about?.type;

  useEffect(() => {
    if (!there || about?.type === type) return;
    setFailure(null);
    ask(`/api/action?name=${encoded(name)}`).then((found) => {
      if (!found.fields) { setFailure(found.text); return; }
      setAbout(found);
      begin(found);
    });
  }, [name, type, !there]);
  const begin = (from) => { setState(toState(from.fields, from.values)); setYaml(from.yaml); setProblems([]); };

  const why = !store.settings.value.control
    ? html`This viewer only looks. To send goals, start it with <code>smachpy view --control</code> and open the address that it prints.`
    : !hasToken() ? html`The address of this page has no token. To send goals, open the address that <code>smachpy</code> printed.`
    : store.connection.value !== "live" ? html`The viewer\u2019s server does not answer; nothing can be sent.` : null;
  const gone = !there ? html`No server of <b>/${name}</b> on the network: it has left or died. The form stays; it can be sent when the server is back.` : null;
  const head = html`<header><h2>/${name}</h2>${type && html`<span class="type">${type}</span>`}</header>
    ${about?.about && html`<p class="doc">${about.about}</p>`}
    ${gone && html`<p class="banner-line waiting" role="status">${gone}</p>`}
    ${why && html`<p class="banner-line preempted" role="note" id="why">${why}</p>`}`;
  if (failure) return html`${head}<pre class="error" role="alert">${failure}</pre>`;
  if (!about || !state) return html`${head}<p class="hint">${there ? "Asking for its definition\u2026" : ""}</p>`;

  const text = () => (tab === "form" ? toYaml(about.fields, state) : yaml);
  const refuse = (answer) => {
    setProblems(answer.problems?.length ? answer.problems : [{ path: "", text: answer.text }]);
    requestAnimationFrame(() => box.current?.querySelector("[aria-invalid=true]")?.focus());
  };
  const turn = async (to) => {
    if (to === tab) return;
    if (!why && there) { // the server translates, and says what is wrong
      const answer = await askAction({ command: "check", name, yaml: text() });
      if (!answer.ok) { refuse(answer); return; }
      begin({ ...about, ...answer });
    }
    setTab(to);
  };
  const send = async () => {
    if (why || !there || busy) return;
    setBusy(true);
    const answer = await askAction({ command: "send", name, yaml: text() });
    setBusy(false);
    if (answer.ok) { setProblems([]); store.say(`goal sent to /${name}`); } else refuse(answer);
  };
  const onKeyDown = (e) => { if (e.key === "Enter" && (e.ctrlKey || e.metaKey)) { e.preventDefault(); send(); } };
  const lost = tab === "form" ? homeless(problems, about.fields, state) : problems;
  const tabs = ["form", "yaml"];
  const onTabKey = (e) => {
    if (!["ArrowLeft", "ArrowRight"].includes(e.key)) return;
    e.preventDefault(); e.stopPropagation();
    turn(tabs[1 - tabs.indexOf(tab)]).then(() => box.current?.querySelector("[role=tab][aria-selected=true]")?.focus());
  };
  return html`<div class="goal-form" ref=${box} onKeyDown=${onKeyDown}>${head}
    <div class="tabs" role="tablist" aria-label="how to write the goal">${tabs.map((one) => html`<button role="tab" type="button" id=${`tab-${one}`}
      aria-selected=${tab === one} tabindex=${tab === one ? 0 : -1} aria-controls="goal-text" onKeyDown=${onTabKey} onClick=${() => turn(one)}>${one === "form" ? "Form" : "YAML"}</button>`)}
      <span class="spread"></span><button type="button" disabled=${!!why} onClick=${() => begin(about)}>Defaults</button></div>
    ${lost.length > 0 && html`<ul class="error problem-list" role="alert">${lost.map((p) => html`<li>${p.path && html`<code>${p.path}</code> `}${p.text}</li>`)}</ul>`}
    <div id="goal-text" role="tabpanel" aria-labelledby=${`tab-${tab}`}>
      ${tab === "form" ? html`<${Fields} fields=${about.fields} state=${state} problems=${problems} disabled=${!!why} onChange=${() => redraw((n) => n + 1)} />
          ${!about.fields.length && html`<p class="hint">This goal has no fields.</p>`}`
        : html`<textarea aria-label="the goal as YAML" aria-invalid=${problems.length > 0} spellcheck=${false} wrap="off" readonly=${!!why} value=${yaml}
          rows=${Math.min(40, Math.max(10, yaml.split("\n").length + 1))} onInput=${(e) => setYaml(e.target.value)}></textarea>`}
    </div>
    <div class="send-line"><button type="button" id="send-goal" class="primary" disabled=${!!why || !there || busy} aria-describedby=${why ? "why" : undefined} onClick=${send}>${busy ? "Sending\u2026" : "Send goal"}</button>
      ${!why && html`<small class="hint">or Ctrl+Enter</small>`}</div>
  </div>`;
}

function SentGoals() {
  const goals = store.actions.value.goals;
  store.tick.value;
  return html`<aside class="sent-goals" aria-label="goals sent from here">
    <h2>Goals sent from here <span class="number">${goals.length || ""}</span></h2>
    ${!goals.length && html`<p class="hint">none yet</p>`}
    ${goals.map((goal) => html`<${Goal} key=${goal.id} goal=${goal} />`)}
  </aside>`;
}

function Goal({ goal }) {
  const over = goal.ended != null;
  const kind = over ? outcomeClass(["REJECTED", "LOST"].includes(goal.status) ? "failed" : goal.status)
    : goal.state in ASKED || goal.cancelled ? "preempted" : goal.state === "ACTIVE" ? "active" : "waiting";
  const word = over ? goal.status.toLowerCase() : ASKED[goal.state] ?? (goal.cancelled ? "asked to cancel" : goal.state === "WAITING_FOR_GOAL_ACK" ? "sent" : goal.state.toLowerCase().replaceAll("_", " "));
  const part = over && goal.status === "SUCCEEDED" ? 1 : goal.fraction;
  const until = over ? ms(goal.ended) : Date.now();
  const cancel = async () => {
    const answer = await askAction({ command: "cancel", goal: goal.id });
    if (!answer.ok) store.say(answer.text, "error");
  };
  const lost = goal.status === "LOST" ? "The server of this goal is gone; what became of the goal is not known. " : "";
  return html`<article class=${`goal sent ${kind}`} aria-label=${`goal to /${goal.action}, ${word}`}>
    <div class="head"><b>/${goal.action}</b><span class="times">${span(Math.max(0, until - ms(goal.sent)) / 1000)}</span></div>
    <div class=${`bar ${part == null && !over ? "unknown" : ""}`} role="progressbar" aria-label="progress" aria-valuemin="0" aria-valuemax="100" aria-valuenow=${part == null ? undefined : Math.round(part * 100)}>
      <i style=${{ width: `${Math.round((part ?? (over ? 1 : 0)) * 100)}%` }}></i></div>
    <div class="text"><span class=${`pill-text ${kind}`} role="status">${word}</span>${" "}${lost}${[goal.text, goal.distance != null && !over && `${goal.distance.toFixed(2)} m left`].filter(Boolean).join(" \u00b7 ")}
      ${part != null && !over && html`<span class="times">${Math.round(part * 100)} %</span>`}</div>
    ${!over && hasToken() && html`<button class="warn" onClick=${cancel} disabled=${goal.cancelled}>Cancel</button>`}
    ${goal.result != null && html`<details open><summary>result</summary><pre>${goal.result === "{}" ? "no fields" : goal.result}</pre></details>`}
    ${goal.feedback != null && html`<details open=${!over}><summary>feedback, the newest of ${goal.heard}</summary><pre>${goal.feedback}</pre></details>`}
    <small class="id" title=${goal.id}>${goal.id}</small>
  </article>`;
}
