// The operator's hand on the machine; there only when the server was started with --control.
import { h } from "preact";
import { useState } from "preact/hooks";
import htm from "htm";
import * as store from "viewer/store";
import { canControl, command } from "viewer/source";

const html = htm.bind(h);

// A button that asks once more before it does something that cannot be taken back.
export function Confirm({ text, question, onSure, className = "", id, title }) {
  const [asked, setAsked] = useState(false);
  if (!asked) return html`<button id=${id} title=${title} class=${className} onClick=${() => setAsked(true)}>${text}</button>`;
  return html`<span class="confirm" role="alertdialog" aria-label=${question}>${question}
    <button class="warn" onClick=${() => { setAsked(false); onSure(); }}>Yes</button>
    <button onClick=${() => setAsked(false)}>No</button></span>`;
}

export function Controls() {
  if (!canControl()) return null;
  const paused = store.facts.value.control.paused;
  return html`<span class="controls">
    <button id="pause" title=${paused ? "go on (Space)" : "before the next state; what runs goes on (Space)"} onClick=${() => command(paused ? "resume" : "pause")}>${paused ? "Resume" : "Pause"}</button>
    ${!paused && html`<${Confirm} text="Pause now" id="pause-now" question="Stop what runs? It begins again after the resume."
      title="do not wait for the end of what runs" onSure=${() => command("pause", { running: "cancel" })} />`}
    <button id="step" onClick=${() => command("step")} disabled=${!paused} title="one state, then pause again (s)">Step</button>
    <${Confirm} text="Preempt" question="Preempt the mission?" className="warn"
      onSure=${() => command("preempt", { path: store.model.value.root.path })} />
  </span>`;
}

// In the list of a state's outcomes: pause after it has ended with this one.
export function StopAfter({ node, outcome }) {
  if (!canControl() || !node.parent) return null;
  const on = store.facts.value.control.breakpoints.some(([p, o]) => p === node.path && o === outcome);
  return html`<button class=${`stop-after ${on ? "on" : ""}`} aria-pressed=${on} aria-label=${`breakpoint after ${outcome}`}
    title=${`${on ? "do not pause" : "pause"} after ${outcome}`} onClick=${() => command(on ? "unbreak" : "break", { path: node.path, outcome })}>\u25cf</button>`;
}

export function StateControls({ node, state }) {
  const [outcome, setOutcome] = useState("");
  if (!canControl()) return null;
  const path = node.path;
  const active = state?.since != null;
  const stops = store.facts.value.control.breakpoints;
  const stopped = stops.some(([p, o]) => p === path && o === null);
  const parent = node.parent;
  const chosen = node.outcomes.includes(outcome) ? outcome : node.outcomes[0];
  return html`<div class="actions">
    <button class=${stopped ? "on" : ""} aria-pressed=${stopped} onClick=${() => command(stopped ? "unbreak" : "break", { path })}>
      ${stopped ? "Remove breakpoint" : "Breakpoint"}</button>
    ${parent && parent.kind !== "concurrence" && html`<${Confirm} text="Jump here" question=${`Go on at ${node.name}?`} onSure=${() => command("jump", { path })} />`}
    ${parent && parent.kind !== "concurrence" && html`<button title="the next run of the container begins here"
      onClick=${() => command("initial", { path: parent.path, states: [node.label] })}>Begin here</button>`}
    ${active && html`<${Confirm} text="Preempt" question=${`Preempt ${node.name}?`} className="warn" onSure=${() => command("preempt", { path })} />`}
    ${active && parent && html`<span class="force"><select aria-label="outcome" value=${chosen} onChange=${(e) => setOutcome(e.target.value)}>
      ${node.outcomes.map((o) => html`<option value=${o}>${o}</option>`)}</select>
      <${Confirm} text="End with it" question=${`End with ${chosen}?`} onSure=${() => command("force", { path, outcome: chosen })} /></span>`}
  </div>`;
}
