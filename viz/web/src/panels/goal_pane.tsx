// The form of a goal: fields or YAML, sent to the server, which also checks it.

import { useEffect, useRef, useState } from "preact/hooks";
import { type FormState, problemsWithoutField, toState, toYaml } from "#core/goal_values.ts";
import { ask, askAction, encoded, hasToken, isFailure } from "#core/requests.ts";
import { store } from "#core/store.ts";
import type { ActionServer, FieldProblem } from "#core/types.ts";
import type { GoalForm as Definition, Failure } from "#core/wire.ts";
import { fieldValue } from "#panels/components.tsx";
import { Fields } from "#panels/goal_form.tsx";

const TABS = ["form", "yaml"];

const MOST_LINES = 40; // lines of YAML that are shown without scrolling

export function GoalForm({ name, server }: { name: string; server: ActionServer | undefined }) {
  const [definition, setDefinition] = useState<Definition | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const [tab, setTab] = useState("form");
  const [state, setState] = useState<FormState>({});
  const [yaml, setYaml] = useState("");
  const [problems, setProblems] = useState<FieldProblem[]>([]);
  const [, redraw] = useState(0);
  const [busy, setBusy] = useState(false);
  const box = useRef<HTMLDivElement | null>(null);
  const type = server?.type ?? definition?.type;
  const why = refusal();

  const begin = (from: Definition) => {
    setState(toState(from.fields, from.values));
    setYaml(from.yaml);
    setProblems([]);
  };
  useEffect(() => {
    if (!server || definition?.type === type) return;
    setFailure(null);
    ask<Definition>(`/api/action?name=${encoded(name)}`).then((found) => {
      if (isFailure(found)) {
        setFailure(found.text);
        return;
      }
      setDefinition(found);
      begin(found);
    });
  }, [name, type, !server]);

  const head = (
    <>
      <header>
        <h2>/{name}</h2>
        {type && <span class="type">{type}</span>}
      </header>
      {definition?.about && <p class="doc">{definition.about}</p>}
      {!server && (
        <p class="banner-line waiting" role="status">
          No server of <b>/{name}</b> on the network: it has left or died. The form stays; you can send it when the
          server is back.
        </p>
      )}
      {why && (
        <p class="banner-line preempted" role="note" id="why">
          {why}
        </p>
      )}
    </>
  );
  if (failure)
    return (
      <>
        {head}
        <pre class="error" role="alert">
          {failure}
        </pre>
      </>
    );
  if (!definition)
    return (
      <>
        {head}
        <p class="hint">{server ? "Asking for its definition\u2026" : ""}</p>
      </>
    );

  const { fields } = definition;
  const text = () => (tab === "form" ? toYaml(fields, state) : yaml);
  const refuse = (answer: Failure) => {
    setProblems(answer.problems.length ? answer.problems : [{ path: "", text: answer.text }]);
    requestAnimationFrame(() => focusIn(box.current, "[aria-invalid=true]"));
  };
  const turnTo = async (other: string) => {
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
      store.view.notify(`goal sent to /${name}`);
    }
  };
  const onKeyDown = (e: KeyboardEvent) => {
    if (e.key !== "Enter" || !(e.ctrlKey || e.metaKey)) return;
    e.preventDefault();
    send();
  };
  const onTabKey = (e: KeyboardEvent) => {
    if (!["ArrowLeft", "ArrowRight"].includes(e.key)) return;
    e.preventDefault();
    e.stopPropagation();
    turnTo(TABS[1 - TABS.indexOf(tab)]).then(() => focusIn(box.current, "[role=tab][aria-selected=true]"));
  };
  const tabButton = (one: string) => (
    <button
      role="tab"
      type="button"
      id={`tab-${one}`}
      aria-selected={tab === one}
      aria-controls="goal-text"
      tabindex={tab === one ? 0 : -1}
      onKeyDown={onTabKey}
      onClick={() => turnTo(one)}
    >
      {one === "form" ? "Form" : "YAML"}
    </button>
  );
  const listed = tab === "form" ? problemsWithoutField(problems, fields, state) : problems;
  return (
    <div class="goal-form" ref={box} onKeyDown={onKeyDown}>
      {head}
      <div class="tabs" role="tablist" aria-label="how to write the goal">
        {TABS.map(tabButton)}
        <span class="spread" />
        <button type="button" disabled={Boolean(why)} onClick={() => begin(definition)}>
          Defaults
        </button>
      </div>
      <ProblemList problems={listed} />
      <div id="goal-text" role="tabpanel" aria-labelledby={`tab-${tab}`}>
        {tab === "form" ? (
          <>
            <Fields
              fields={fields}
              state={state}
              problems={problems}
              disabled={Boolean(why)}
              onChange={() => redraw((n) => n + 1)}
            />
            {!fields.length && <p class="hint">This goal has no fields.</p>}
          </>
        ) : (
          <YamlText yaml={yaml} invalid={problems.length > 0} readonly={Boolean(why)} onChange={setYaml} />
        )}
      </div>
      <div class="send-line">
        <button
          type="button"
          id="send-goal"
          class="primary"
          disabled={Boolean(why) || !server || busy}
          aria-describedby={why ? "why" : undefined}
          onClick={send}
        >
          {busy ? "Sending\u2026" : "Send goal"}
        </button>
        {!why && <small class="hint">or Ctrl+Enter</small>}
      </div>
    </div>
  );
}

const focusIn = (box: HTMLElement | null, selector: string) =>
  (box?.querySelector(selector) as HTMLElement | null)?.focus();

const ProblemList = ({ problems }: { problems: FieldProblem[] }) =>
  problems.length ? (
    <ul class="error problem-list" role="alert">
      {problems.map((one) => (
        <li>
          {one.path && <code>{one.path}</code>} {one.text}
        </li>
      ))}
    </ul>
  ) : null;

function YamlText({
  yaml,
  invalid,
  readonly,
  onChange,
}: {
  yaml: string;
  invalid: boolean;
  readonly: boolean;
  onChange: (text: string) => void;
}) {
  const rows = Math.min(MOST_LINES, Math.max(10, yaml.split("\n").length + 1));
  return (
    <textarea
      aria-label="the goal as YAML"
      aria-invalid={invalid}
      spellcheck={false}
      wrap="off"
      readonly={readonly}
      value={yaml}
      rows={rows}
      onInput={(e: Event) => onChange(fieldValue(e))}
    />
  );
}

/** Why this page may not send goals, or null. */
export function refusal() {
  if (!store.data.settings.value.control)
    return (
      <>
        This viewer sends no commands. To send goals, start it with <code>smachpy view --control</code> and open the
        address that it prints.
      </>
    );
  if (!hasToken())
    return (
      <>
        The address of this page has no token. To send goals, open the address that <code>smachpy</code> printed.
      </>
    );
  return store.data.connection.value !== "live" ? "The viewer's server does not answer; nothing can be sent." : null;
}
