// The bar above the diagram: machine, status, breadcrumb, search and view.

import { useEffect, useState } from "preact/hooks";
import { choose, showWhy } from "#core/connection.ts";
import { KIND_NAMES } from "#core/model.ts";
import { isFile } from "#core/page_file.ts";
import { showPage } from "#core/pages.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { MachineSummary, StateNode } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";
import { ActionsButton } from "#panels/actions.tsx";
import { CompareChip } from "#panels/comparison.tsx";
import { fieldValue } from "#panels/components.tsx";
import { togglePage } from "#panels/keys.tsx";
import { ReproduceButtons } from "#panels/reproduction.tsx";
import { FollowButton, toggleTree, ViewMenu } from "#panels/view_menu.tsx";

const MOST_FOUND = 12;
const ENDED = "ended: "; // left out in narrow windows, as the colour says it
const SEAL = "evidence: "; // how the notes of a root begin that say what evidence there is

export function TopBar({ page }: { page: Page }) {
  if (store.view.pageShown.value !== "machine")
    return (
      <header class="top">
        <RunsButton />
        {store.data.model.value && (
          <button class="back" title="back to this machine (Esc)" onClick={() => showPage("machine")}>
            ← {shorten(store.data.facts.value?.label ?? "", 40)}
          </button>
        )}
        <span class="spread" />
        <ViewMenu page={page} />
        <ActionsButton id="actions" />
      </header>
    );
  const status = store.status.runStatus.value;
  const problems = store.data.problems.value.length;
  return (
    <header class="top">
      <button
        class="states-button"
        aria-expanded={store.view.treeOpen.value}
        title="the states as a tree (t)"
        onClick={toggleTree}
      >
        States
      </button>
      <RunsButton />
      <Chooser />
      <span class={`status ${status.kind}`} role="status" title={status.word} data-testid="status">
        {status.word.startsWith(ENDED) ? <span class="ended-word">{ENDED}</span> : ""}
        {status.word.startsWith(ENDED) ? status.word.slice(ENDED.length) : status.word}
      </span>
      {canAskWhy() && (
        <button
          class={`why-button ${store.data.why.value ? "on" : ""}`}
          aria-pressed={store.data.why.value !== null}
          title="from the first cause to the outcome (w)"
          onClick={() => showWhy()}
        >
          Why?
        </button>
      )}
      <SealChip />
      <ReproduceButtons class="wide" />
      {problems > 0 && (
        <span class="chip" title="problems of the machine's structure; see the inspector">
          ⚠ {problems}
        </span>
      )}
      <CompareChip page={page} />
      <Crumbs page={page} />
      <span class="spread" />
      <Search page={page} />
      <span class="wide">
        <FollowButton page={page} />
      </span>
      <ViewMenu page={page} />
      <span class="wide">
        <ActionsButton id="actions" />
      </span>
    </header>
  );
}

function RunsButton() {
  if (isFile()) return null;
  const open = store.view.pageShown.value === "runs";
  return (
    <button
      id="runs"
      class={open ? "on" : ""}
      aria-pressed={open}
      title="live and past runs (h)"
      onClick={() => togglePage("runs")}
    >
      Runs
    </button>
  );
}

/** Whether the run is over: it has ended, or its program is gone. */
function canAskWhy() {
  store.playback.watch();
  const { now } = store.data.run;
  const about = store.data.facts.value;
  return now.started != null && (now.ended != null || about?.recorded || about?.stale != null || isFile());
}

/** What evidence the run has, which its root notes, and whether it did what nobody has tried. */
function SealChip() {
  store.playback.watch();
  const root = store.data.model.value?.root.path ?? "";
  const note = store.data.run.now.states[root]?.note ?? "";
  if (!note.startsWith(SEAL)) return null;
  const text = note.slice(SEAL.length);
  const [sign, word] = text.startsWith("valid")
    ? ["✓", "certified"]
    : ["⚠", text.startsWith("nothing") ? "not tried" : "no evidence"];
  return (
    <span class="chip seal" title={note} data-testid="seal">
      {sign} <span class="seal-word">{word}</span>
    </span>
  );
}

function Chooser() {
  const facts = store.data.facts.value;
  const list = store.data.machines.value;
  const name = facts ? shorten(facts.label, 60) : "no machine yet";
  const others = list.some((machine) => machine.name !== facts?.name);
  if (isFile() || !others) return <h1 title={facts?.name}>{name}</h1>;
  const choice = (machine: MachineSummary) => {
    const title = machine.node ? `in node ${machine.node}` : "";
    return (
      <option value={machine.name} title={title}>
        {machine.name} – {statusOf(machine)}
      </option>
    );
  };
  return (
    <label class="chooser">
      <span class="hidden">machine</span>
      <select value={facts?.name ?? ""} onChange={(e: Event) => choose(fieldValue(e))}>
        {!facts && (
          <option value="" disabled>
            {shorten(store.data.wanted.value || "choose a machine", 60)}
          </option>
        )}
        {list.map(choice)}
      </select>
    </label>
  );
}

function statusOf({ recorded, stale, ended, outcome, questions }: MachineSummary) {
  if (questions && stale == null && !recorded) return "asks you";
  if (ended != null) return `${recorded ? "recorded" : "ended"}: ${outcome}`;
  if (recorded) return "recording, without an end";
  return stale != null ? "stale" : "running";
}

/** The breadcrumb of the selected state, otherwise of the running one. */
function Crumbs({ page }: { page: Page }) {
  const model = store.data.model.value;
  const selected = store.view.selected.value;
  const leaves = store.status.activeLeaves.value;
  const node = model?.get(selected ?? leaves[0]);
  if (!model || !node) return null;
  const more = selected ? 0 : leaves.length - 1;
  const crumb = (one: StateNode, i: number) => (
    <>
      {i > 0 && <i>›</i>}
      <button onClick={() => page.goTo(one.path)}>{one.name}</button>
    </>
  );
  return (
    <nav class="crumbs" aria-label={`path of the ${selected ? "selected" : "active"} state`}>
      {[...model.ancestors(node.path), node].map(crumb)}
      {more > 0 && (
        <span class="chip" title={leaves.join("\n")}>
          +{more} active
        </span>
      )}
    </nav>
  );
}

function Search({ page }: { page: Page }) {
  const [at, setAt] = useState(0);
  const text = store.view.query.value;
  const found = text ? (store.data.model.value?.search(text) ?? []) : [];
  const shown = found.slice(0, MOST_FOUND);
  const pick = (node: StateNode | undefined) => {
    if (!node) return;
    page.goTo(node.path);
    store.view.query.value = "";
    if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
  };
  const onKeyDown = (e: KeyboardEvent) => {
    if (e.key === "Enter") pick(shown[Math.min(at, shown.length - 1)]);
    else if (e.key === "Escape") {
      store.view.query.value = "";
      (e.target as HTMLElement).blur();
    } else if (e.key === "ArrowDown" || e.key === "ArrowUp") {
      const to = e.key === "ArrowDown" ? Math.min(at + 1, shown.length - 1) : at - 1;
      setAt(Math.max(to, 0));
      e.preventDefault();
    } else return;
    e.stopPropagation();
  };
  const onInput = (e: Event) => {
    store.view.query.value = fieldValue(e);
    setAt(0);
  };
  useEffect(() => page.markHits(found.map((node) => node.path)), [text]);
  return (
    <div class="search">
      <input
        id="search"
        placeholder="Search"
        aria-label="Search states"
        value={text}
        autocomplete="off"
        spellcheck={false}
        onInput={onInput}
        onKeyDown={onKeyDown}
      />
      {!text && <kbd>/</kbd>}
      {text && (
        <ul class="results" role="listbox">
          {shown.map((node, i) => (
            <Found key={node.path} node={node} chosen={i === at} onPick={pick} />
          ))}
          {!found.length && <li class="none">no state of this name</li>}
          {found.length > shown.length && <li class="none">and {found.length - shown.length} more</li>}
        </ul>
      )}
    </div>
  );
}

const Found = ({ node, chosen, onPick }: { node: StateNode; chosen: boolean; onPick: (node: StateNode) => void }) => (
  <li role="option" aria-selected={chosen} class={chosen ? "at" : ""} onPointerDown={() => onPick(node)}>
    <b>{node.name}</b>
    <small>{node.parent ? node.parent.path : KIND_NAMES[node.kind]}</small>
  </li>
);
