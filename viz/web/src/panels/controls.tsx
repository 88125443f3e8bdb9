// The operator's commands; only shown if the server was started with --control.

import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import {
  askFirst,
  command,
  confirmation,
  confirmationNow,
  control,
  endsText,
  keyOf,
  sent,
  situationAt,
  situationOf,
  targetText,
} from "#core/commands.ts";
import { isPartOfNet } from "#core/model.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { StateNode, StateRun } from "#core/types.ts";
import { fieldValue } from "#panels/components.tsx";

const LONG = 18; // characters of a target, from which it is written in three small lines

/**
 * A button for a command; disabled, with the reason, while no command may be sent, and red after one that failed.
 * @param props `does` is `keyOf` the command, `why` a further reason to disable it
 */
function Command({
  does,
  onClick,
  children,
  title,
  why = null,
  class: name = "",
  ...more
}: {
  does: string;
  onClick: () => unknown;
  children?: ComponentChildren;
  title?: string;
  why?: string | null;
  class?: string;
  id?: string;
  "aria-label"?: string;
  "aria-pressed"?: boolean;
}) {
  const reason = store.status.whyDisarmed.value ?? why;
  const mine = sent.value?.key === does ? sent.value : null;
  const state = mine && (mine.failure === null ? "sent" : "failed");
  const refuse = () => store.view.notify(reason ?? "", "error");
  return (
    <button
      {...more}
      class={`${name} ${state ?? ""}`}
      title={mine?.failure ?? reason ?? title}
      aria-disabled={reason !== null}
      aria-busy={state === "sent"}
      onClick={reason === null ? onClick : refuse}
    >
      {children}
    </button>
  );
}

/** The commands to the machine on view, always at the same place. */
export function OperatorBar() {
  store.playback.watch();
  const facts = control();
  if (!facts || store.view.pageShown.value !== "machine") return null;
  const { paused } = facts;
  if (store.data.run.now.ended != null && !paused) return null;
  const target = targetText();
  const isLong = target.length > LONG;
  return (
    <div class="operator" role="toolbar" aria-label={`commands to ${target}`}>
      <Command
        id="pause"
        does={keyOf(paused ? "resume" : "pause")}
        title={paused ? "continue (Space)" : "pause before the next state (Space)"}
        onClick={() => command(paused ? "resume" : "pause")}
      >
        {paused ? "Resume" : "Pause"}
      </Command>
      <Command
        id="pause-now"
        does={keyOf("pause now")}
        why={paused ? "It is paused" : null}
        title="preempt the running states instead of waiting for their ends"
        onClick={() => askForPause(target)}
      >
        Pause now
      </Command>
      <Command
        id="step"
        does={keyOf("step")}
        title="run one state, then pause again (s)"
        why={paused ? null : "Pause first: a step runs one state of a paused mission"}
        onClick={() => command("step")}
      >
        Step
      </Command>
      <Command
        id="preempt"
        class={isLong ? "warn long" : "warn"}
        does={keyOf("preempt", store.data.model.value?.root.path)}
        title={`Preempt ${target}`}
        onClick={() => askForPreempt(target)}
      >
        <span>Preempt {shorten(target, 60)}</span>
      </Command>
    </div>
  );
}

function askForPause(target: string) {
  const path = store.data.model.value?.root.path ?? "";
  const machine = store.data.facts.value?.name;
  askFirst({
    title: `Pause ${target} now?`,
    yes: "Pause now",
    lines: () => [...endsText(path), "These states are preempted, and begin again on Resume."],
    situation: () => situationOf(control()?.paused),
    give: () => command("pause", { running: "cancel" }, machine),
  });
}

function askForPreempt(target: string) {
  const path = store.data.model.value?.root.path ?? "";
  const machine = store.data.facts.value?.name;
  askFirst({
    title: `Preempt ${target}?`,
    yes: "Preempt",
    lines: () => [...endsText(path), "The mission ends with an outcome for preemption; it is not resumed."],
    situation: () => situationOf(),
    give: () => command("preempt", { path }, machine),
  });
}

/** The question before a command that cannot be undone. It is withdrawn when what it is about changes. */
export function ConfirmationSheet() {
  store.playback.watch();
  const box = useRef<HTMLElement | null>(null);
  const before = useRef<Element | null>(null);
  const given = confirmation.value;
  const asked = given && confirmationNow();
  useEffect(() => {
    if (!asked) return;
    before.current = document.activeElement;
    (box.current?.querySelector("button") as HTMLElement | null)?.focus();
    return () => {
      if (before.current instanceof HTMLElement) before.current.focus();
    };
  }, [asked]);
  if (!asked) return null;
  const close = () => {
    confirmation.value = null;
  };
  const give = () => {
    if (confirmationNow() !== asked) return;
    close();
    asked.give();
  };
  return (
    <section
      class="confirm"
      role="alertdialog"
      aria-labelledby="confirm-title"
      aria-describedby="confirm-text"
      ref={box}
    >
      <h2 id="confirm-title">{asked.title}</h2>
      <div id="confirm-text">
        {asked.lines().map((line) => (
          <p>{line}</p>
        ))}
      </div>
      <p class="answers">
        <button class="answer" onClick={close}>
          No
        </button>
        <button class="answer warn" onClick={give}>
          {asked.yes}
        </button>
      </p>
    </section>
  );
}

/** A breakpoint after one outcome of a state. */
export function OutcomeBreakpoint({ node, outcome }: { node: StateNode; outcome: string }) {
  const breakpoints = control()?.breakpoints;
  if (!breakpoints || !node.parent) return null;
  const on = breakpoints.some(([path, after]) => path === node.path && after === outcome);
  return (
    <Command
      class={`stop-after ${on ? "on" : ""}`}
      aria-pressed={on}
      does={keyOf(on ? "unbreak" : "break", `${node.path} after ${outcome}`)}
      aria-label={`breakpoint after ${outcome}`}
      title={`${on ? "do not pause" : "pause"} after ${outcome}`}
      onClick={() => command(on ? "unbreak" : "break", { path: node.path, outcome })}
    >
      ●
    </Command>
  );
}

export function StateControls({ node, state }: { node: StateNode; state: StateRun | undefined }) {
  const [outcome, setOutcome] = useState("");
  const breakpoints = control()?.breakpoints;
  if (!breakpoints) return null;
  const { path, parent } = node;
  const [machine, target] = [store.data.facts.value?.name, targetText()];
  const ask: (name: string, title: string, yes: string, within: string, end: string, more?: object) => void = (
    name,
    title,
    yes,
    within,
    end,
    more = { path },
  ) =>
    askFirst({
      title,
      yes,
      lines: () => [...endsText(within), end],
      situation: () => situationAt(path, within),
      give: () => command(name, { ...more }, machine),
    });
  if (isPartOfNet(node)) {
    if (node.kind !== "transition" || !parent) return null;
    const fire = () =>
      ask("fire", `Fire ${node.name} of ${target}?`, "Fire", parent.path, "Its guard is not asked.", {
        path: parent.path,
        transition: node.label,
      });
    return (
      <div class="actions">
        <Command does={keyOf("fire", parent.path)} onClick={fire}>
          Fire
        </Command>
      </div>
    );
  }
  const active = state?.since != null;
  const stops = breakpoints.some(([at, after]) => at === path && after === null);
  const chosen = node.outcomes.includes(outcome) ? outcome : node.outcomes[0];
  const canJump = parent && parent.kind !== "concurrence";
  const jump = () =>
    parent &&
    ask("jump", `Continue ${target} at ${node.name}?`, "Jump", parent.path, `They end, and ${node.name} begins.`);
  const preempt = () =>
    ask("preempt", `Preempt ${node.name} of ${target}?`, "Preempt", path, "The mission goes on with its transition.");
  const force = () =>
    ask("force", `End ${node.name} of ${target} with ${chosen}?`, `End with ${chosen}`, path, goesTo(node, chosen), {
      path,
      outcome: chosen,
    });
  return (
    <div class="actions">
      <Command
        class={stops ? "on" : ""}
        aria-pressed={stops}
        does={keyOf(stops ? "unbreak" : "break", path)}
        onClick={() => command(stops ? "unbreak" : "break", { path })}
      >
        {stops ? "Remove breakpoint" : "Breakpoint"}
      </Command>
      {canJump && (
        <>
          <Command does={keyOf("jump", path)} onClick={jump}>
            Jump here
          </Command>
          <Command
            does={keyOf("initial", parent.path)}
            title="the next run of the container starts with this state"
            onClick={() => command("initial", { path: parent.path, states: [node.label] })}
          >
            Start here
          </Command>
        </>
      )}
      {active && parent && (
        <Command class="warn" does={keyOf("preempt", path)} onClick={preempt}>
          Preempt
        </Command>
      )}
      {active && parent && (
        <span class="force">
          <select aria-label="outcome" value={chosen} onChange={(e: Event) => setOutcome(fieldValue(e))}>
            {node.outcomes.map((one) => (
              <option value={one}>{one}</option>
            ))}
          </select>
          <Command does={keyOf("force", path)} onClick={force}>
            Force outcome
          </Command>
        </span>
      )}
    </div>
  );
}

/** Where the mission goes on after an outcome. */
function goesTo(node: StateNode, outcome: string) {
  const target = store.data.model.value?.linkOf(node, outcome)?.target;
  return target ? `The mission goes on with ${shorten(target)}.` : "Its container decides how the mission goes on.";
}
