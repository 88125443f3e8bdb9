// The selected state: its kind, visits, userdata keys, transitions and commands.

import { own } from "#core/fold.ts";
import type { Model } from "#core/model.ts";
import { KIND_NAMES } from "#core/model.ts";
import { endClass } from "#core/outcomes.ts";
import { store } from "#core/store.ts";
import { duration, shorten } from "#core/text.ts";
import type { MachinePayload, RunState, StateNode, StateRun, StateStatistics } from "#core/types.ts";
import { Pill, Section } from "#panels/components.tsx";
import { OutcomeBreakpoint, StateControls } from "#panels/controls.tsx";

export function SelectedState({ data, now, model }: { data: RunState; now: number; model: Model }) {
  const node = model.get(store.view.selected.value);
  if (!node) return null;
  const state = own(data.states, node.path);
  return (
    <Section title={node.name}>
      <StateControls key={node.path} node={node} state={state} />
      {node.doc && <p class="doc">{node.doc}</p>}
      <dl class="facts">
        {factsOf(node, state, now).map(([name, value]) => (
          <>
            <dt>{name}</dt>
            <dd>{value}</dd>
          </>
        ))}
        <Keys keys={model.keys[node.path]} />
      </dl>
      {state?.error && <p class="error">{shorten(state.error, 2000)}</p>}
      <ul class="outcomes">
        {node.outcomes.map((outcome) => (
          <Outcome node={node} outcome={outcome} times={own(state?.outcomes, outcome)} model={model} />
        ))}
      </ul>
    </Section>
  );
}

function factsOf(node: StateNode, state: StateRun | undefined, now: number): [string, string | number][] {
  const running = state?.since != null ? (now - state.since / 1e6) / 1000 : null;
  const recorded = own(store.data.statistics.value?.states, node.path);
  const facts: [string, string | number][] = [
    ["kind", `${KIND_NAMES[node.kind] ?? node.kind} (${node.type_name})`],
    ...node.details,
  ];
  facts.push(["visits", state?.visits ?? 0]);
  if (state?.visits) facts.push(["time inside", duration(state.seconds + (running ?? 0))]);
  if (running !== null) facts.push(["running for", duration(running)]);
  if (state?.attempt && state.attempt > 1) facts.push(["attempt", state.attempt]);
  if (recorded) facts.push(["recorded runs", recordedText(recorded)]);
  return facts;
}

function recordedText({ median, p95, failures, visits }: StateStatistics) {
  const times = `median ${duration(median ?? 0)}, 95 % under ${duration(p95 ?? 0)}`;
  return `${times}, ${Math.round(failures * 100)} % failed of ${visits}`;
}

/** The userdata keys of a state, with their names in the container if remapped. */
function Keys({ keys }: { keys: MachinePayload["keys"][string] | undefined }) {
  if (!keys) return null;
  const outside = new Map(keys.remapping);
  const key = (name: string) => {
    const other = outside.get(name);
    return (
      <>
        <code>
          {name}
          {other !== undefined && other !== name ? ` \u2190 ${other}` : ""}
        </code>{" "}
      </>
    );
  };
  return (
    <>
      {keys.inputs.length > 0 && (
        <>
          <dt>reads</dt>
          <dd>{keys.inputs.map(key)}</dd>
        </>
      )}
      {keys.outputs.length > 0 && (
        <>
          <dt>writes</dt>
          <dd>{keys.outputs.map(key)}</dd>
        </>
      )}
    </>
  );
}

function Outcome({
  node,
  outcome,
  times,
  model,
}: {
  node: StateNode;
  outcome: string;
  times: number | undefined;
  model: Model;
}) {
  const link = model.linkOf(node, outcome);
  return (
    <li>
      <OutcomeBreakpoint node={node} outcome={outcome} />
      <Pill kind={endClass(node, outcome)}>{shorten(outcome, 60)}</Pill>
      <span>{link ? ` \u2192 ${shorten(link.target)}` : ""}</span>
      <span class="times">{times ? `\u00d7${times}` : ""}</span>
    </li>
  );
}
