// The operator's commands; only shown if the server was started with --control.
import { useState } from "preact/hooks";
import { command, control } from "#core/connection.js";
import { isPartOfNet } from "#core/model.js";
import * as store from "#core/store.js";
import { fieldValue, html } from "#panels/html.js";

/**
 * A button for a command; disabled, with the reason, while the past is shown.
 * @param {{ onClick: () => unknown, children?: any, title?: string, [attribute: string]: any }} props
 */
function Command({ onClick, children, title, ...more }) {
  const why = store.whyDisarmed.value;
  const refuse = () => store.notify(why ?? "", "error");
  return html`<button ...${more} title=${why ?? title} aria-disabled=${why !== null}
    onClick=${why === null ? onClick : refuse}>${children}</button>`;
}

/**
 * A button that asks for confirmation, for commands that cannot be undone.
 * @param {{
 *   text: string, question: string, onConfirm: () => unknown, className?: string, id?: string, title?: string,
 * }} props
 */
function Confirm({ text, question, onConfirm, className = "", id, title }) {
  const [asked, setAsked] = useState(false);
  const confirm = () => {
    setAsked(false);
    onConfirm();
  };
  if (!asked || store.whyDisarmed.value !== null)
    return html`<${Command} id=${id} title=${title} class=${className} onClick=${() => setAsked(true)}>${text}<//>`;
  return html`<span class="confirm" role="alertdialog" aria-label=${question}>${question}
    <button class="warn" onClick=${confirm}>Yes</button>
    <button onClick=${() => setAsked(false)}>No</button></span>`;
}

export function Controls() {
  const paused = control()?.paused;
  store.tick.value;
  const isOver = store.run.now.ended != null;
  if (paused === undefined || (isOver && !paused)) return null;
  const title = paused ? "continue (Space)" : "pause before the next state (Space)";
  return html`<span class="controls">
    <${Command} id="pause" title=${title} onClick=${() => command(paused ? "resume" : "pause")}>
      ${paused ? "Resume" : "Pause"}<//>
    ${
      !paused &&
      html`<${Confirm} text="Pause now" id="pause-now"
        question="Preempt the running states? They start again on resume."
        title="preempt the running states instead of waiting for their ends"
        onConfirm=${() => command("pause", { running: "cancel" })} />`
    }
    <${Command} id="step" disabled=${!paused} title="run one state, then pause again (s)"
      onClick=${() => command("step")}>Step<//>
    <${Confirm} text="Preempt" question="Preempt the mission?" className="warn"
      onConfirm=${() => command("preempt", { path: store.model.value?.root.path })} />
  </span>`;
}

/** A breakpoint after one outcome of a state. @param {{ node: StateNode, outcome: string }} props */
export function OutcomeBreakpoint({ node, outcome }) {
  const breakpoints = control()?.breakpoints;
  if (!breakpoints || !node.parent) return null;
  const on = breakpoints.some(([path, after]) => path === node.path && after === outcome);
  return html`<${Command} class=${`stop-after ${on ? "on" : ""}`} aria-pressed=${on}
    aria-label=${`breakpoint after ${outcome}`} title=${`${on ? "do not pause" : "pause"} after ${outcome}`}
    onClick=${() => command(on ? "unbreak" : "break", { path: node.path, outcome })}>\u25cf<//>`;
}

/** @param {{ node: StateNode, state: StateRun | undefined }} props */
export function StateControls({ node, state }) {
  const [outcome, setOutcome] = useState("");
  const breakpoints = control()?.breakpoints;
  if (!breakpoints) return null;
  const { path, parent } = node;
  if (isPartOfNet(node))
    return node.kind === "transition" && parent
      ? html`<div class="actions"><${Confirm} text="Fire" question=${`Fire ${node.name}, whatever its guard says?`}
          onConfirm=${() => command("fire", { path: parent.path, transition: node.label })} /></div>`
      : null;
  const active = state?.since != null;
  const stops = breakpoints.some(([at, after]) => at === path && after === null);
  const chosen = node.outcomes.includes(outcome) ? outcome : node.outcomes[0];
  const canJump = parent && parent.kind !== "concurrence";
  return html`<div class="actions">
    <${Command} class=${stops ? "on" : ""} aria-pressed=${stops}
      onClick=${() => command(stops ? "unbreak" : "break", { path })}>
      ${stops ? "Remove breakpoint" : "Breakpoint"}<//>
    ${
      canJump &&
      html`<${Confirm} text="Jump here" question=${`Continue at ${node.name}?`}
        onConfirm=${() => command("jump", { path })} />
      <${Command} title="the next run of the container starts with this state"
        onClick=${() => command("initial", { path: parent.path, states: [node.label] })}>Start here<//>`
    }
    ${
      active &&
      html`<${Confirm} text="Preempt" question=${`Preempt ${node.name}?`} className="warn"
        onConfirm=${() => command("preempt", { path })} />`
    }
    ${
      active &&
      parent &&
      html`<span class="force">
        <select aria-label="outcome" value=${chosen} onChange=${(/** @type {Event} */ e) => setOutcome(fieldValue(e))}>
          ${node.outcomes.map((one) => html`<option value=${one}>${one}</option>`)}</select>
        <${Confirm} text="Force outcome" question=${`End with ${chosen}?`}
          onConfirm=${() => command("force", { path, outcome: chosen })} /></span>`
    }
  </div>`;
}
