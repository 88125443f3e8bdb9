// The bar above the diagram: machine, status, breadcrumb, search, view and commands.
import { useEffect, useRef, useState } from "preact/hooks";
import { choose, encoded, isFile, link, showHome, showWhy } from "#core/connection.js";
import { KIND_NAMES } from "#core/model.js";
import { MODES, OF_RECORDED_RUNS } from "#core/statistics.js";
import * as store from "#core/store.js";
import { shorten } from "#core/text.js";
import { isDark } from "#drawing/theme.js";
import { ActionsButton } from "#panels/actions.js";
import { CompareChip, CompareLine } from "#panels/comparison.js";
import { Controls } from "#panels/controls.js";
import { PanelLines } from "#panels/docks.js";
import { fieldValue, html } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

const MOST_FOUND = 12;
const MOST_LEVELS = 9; // levels with a button of their own
const ALL_LEVELS = 99;
const MOST_ACTIVE = 200; // active states in the address of a picture

/** @param {{ page: Page }} props */
export function TopBar({ page }) {
  const status = store.runStatus.value;
  const problems = store.problems.value.length;
  return html`<header class="top">
    <button class="states-button" aria-expanded=${store.treeOpen.value} title="the states as a tree (t)"
      onClick=${toggleTree}>States</button>
    <${RunsButton} />
    <${Chooser} />
    <span class=${`status ${status.kind}`} role="status" data-testid="status">${status.word}</span>
    ${
      canAskWhy() &&
      html`<button class=${`why-button ${store.why.value ? "on" : ""}`} aria-pressed=${store.why.value !== null}
        title="from the first cause to the outcome (w)" onClick=${() => showWhy()}>Why?</button>`
    }
    ${
      problems > 0 &&
      html`<span class="chip" title="problems of the machine's structure; see the inspector">\u26a0 ${problems}</span>`
    }
    <${CompareChip} page=${page} />
    <${Crumbs} page=${page} />
    <span class="spread"></span>
    <${Search} page=${page} />
    <button class=${store.follow.value ? "on" : ""} aria-pressed=${store.follow.value}
      title="follow the running states (o)" onClick=${() => page.setFollow(!store.follow.value)}>Follow</button>
    <${ViewMenu} page=${page} />
    <${ActionsButton} />
    <${Controls} />
  </header>`;
}

function RunsButton() {
  if (isFile()) return null;
  const open = store.homeOpen.value;
  return html`<button id="runs" class=${open ? "on" : ""} aria-pressed=${open} title="live and past runs (h)"
    onClick=${() => showHome(!open || !store.model.value)}>Runs</button>`;
}

/** Whether the run is over: it has ended, or its program is gone. */
function canAskWhy() {
  store.tick.value;
  const { now } = store.run;
  const about = store.facts.value;
  return now.started != null && (now.ended != null || about?.recorded || about?.stale != null || isFile());
}

const toggleTree = () => {
  store.treeOpen.value = !store.treeOpen.value;
};

function Chooser() {
  const facts = store.facts.value;
  const list = store.machines.value;
  const name = facts ? shorten(facts.label, 60) : "no machine yet";
  const others = list.some((machine) => machine.name !== facts?.name);
  if (isFile() || !others) return html`<h1 title=${facts?.name}>${name}</h1>`;
  const choice = (/** @type {MachineSummary} */ machine) => {
    const title = machine.node ? `in node ${machine.node}` : "";
    return html`<option value=${machine.name} title=${title}>${machine.name} \u2013 ${statusOf(machine)}</option>`;
  };
  return html`<label class="chooser"><span class="hidden">machine</span>
    <select value=${facts?.name ?? ""} onChange=${(/** @type {Event} */ e) => choose(fieldValue(e))}>
      ${!facts && html`<option value="" disabled>${shorten(store.wanted.value || "choose a machine", 60)}</option>`}
      ${list.map(choice)}
    </select></label>`;
}

/** @param {MachineSummary} machine */
function statusOf({ recorded, stale, ended, outcome, questions }) {
  if (questions && stale == null && !recorded) return "asks you";
  if (ended != null) return `${recorded ? "recorded" : "ended"}: ${outcome}`;
  if (recorded) return "recording, without an end";
  return stale != null ? "stale" : "running";
}

/** The breadcrumb of the selected state, otherwise of the running one. @param {{ page: Page }} props */
function Crumbs({ page }) {
  const model = store.model.value;
  const selected = store.selected.value;
  const leaves = store.activeLeaves.value;
  const node = model?.get(selected ?? leaves[0]);
  if (!model || !node) return null;
  const more = selected ? 0 : leaves.length - 1;
  const crumb = (/** @type {StateNode} */ one, /** @type {number} */ i) =>
    html`${i > 0 && html`<i>\u203a</i>`}<button onClick=${() => page.goTo(one.path)}>${one.name}</button>`;
  return html`<nav class="crumbs" aria-label=${`path of the ${selected ? "selected" : "active"} state`}>
    ${[...model.ancestors(node.path), node].map(crumb)}
    ${more > 0 && html`<span class="chip" title=${leaves.join("\n")}>+${more} active</span>`}
  </nav>`;
}

/** @param {{ page: Page }} props */
function Search({ page }) {
  const [at, setAt] = useState(0);
  const text = store.query.value;
  const found = text ? (store.model.value?.search(text) ?? []) : [];
  const shown = found.slice(0, MOST_FOUND);
  const pick = (/** @type {StateNode | undefined} */ node) => {
    if (!node) return;
    page.goTo(node.path);
    store.query.value = "";
    if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ e) => {
    if (e.key === "Enter") pick(shown[Math.min(at, shown.length - 1)]);
    else if (e.key === "Escape") {
      store.query.value = "";
      /** @type {HTMLElement} */ (e.target).blur();
    } else if (e.key === "ArrowDown" || e.key === "ArrowUp") {
      const to = e.key === "ArrowDown" ? Math.min(at + 1, shown.length - 1) : at - 1;
      setAt(Math.max(to, 0));
      e.preventDefault();
    } else return;
    e.stopPropagation();
  };
  const onInput = (/** @type {Event} */ e) => {
    store.query.value = fieldValue(e);
    setAt(0);
  };
  useEffect(() => page.markHits(found.map((node) => node.path)), [text]);
  return html`<div class="search">
    <input id="search" placeholder="Search states" aria-label="Search states" value=${text} autocomplete="off"
      spellcheck=${false} onInput=${onInput} onKeyDown=${onKeyDown} />
    ${!text && html`<kbd>/</kbd>`}
    ${
      text &&
      html`<ul class="results" role="listbox">
        ${shown.map((node, i) => html`<${Found} key=${node.path} node=${node} chosen=${i === at} onPick=${pick} />`)}
        ${!found.length && html`<li class="none">no state of this name</li>`}
        ${found.length > shown.length && html`<li class="none">and ${found.length - shown.length} more</li>`}
      </ul>`
    }
  </div>`;
}

/** @param {{ node: StateNode, chosen: boolean, onPick: (node: StateNode) => void }} props */
const Found = ({ node, chosen, onPick }) =>
  html`<li role="option" aria-selected=${chosen} class=${chosen ? "at" : ""} onPointerDown=${() => onPick(node)}>
    <b>${node.name}</b><small>${node.parent ? node.parent.path : KIND_NAMES[node.kind]}</small></li>`;

/** @param {{ page: Page }} props */
function ViewMenu({ page }) {
  const [open, setOpen] = useState(false);
  const box = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    const away = (/** @type {PointerEvent} */ e) => {
      if (!box.current?.contains(/** @type {Node} */ (e.target))) setOpen(false);
    };
    addEventListener("pointerdown", away);
    return () => removeEventListener("pointerdown", away);
  }, []);
  const showKeys = () => {
    store.help.value = true;
    setOpen(false);
  };
  const onImplicit = (/** @type {Event} */ e) => page.setImplicit(/** @type {HTMLInputElement} */ (e.target).checked);
  const onTheme = (/** @type {Event} */ e) => page.setTheme(/** @type {Theme} */ (fieldValue(e)));
  return html`<div class="menu" ref=${box}>
    <button aria-expanded=${open} onClick=${() => setOpen(!open)}>View</button>
    ${
      open &&
      html`<div class="sheet">
        <${Levels} page=${page} />
        <label class="line"><span>Implicit transitions</span>
          <input type="checkbox" checked=${store.implicit.value} onChange=${onImplicit} /></label>
        <${NumbersLine} page=${page} />
        <${CompareLine} page=${page} onDone=${() => setOpen(false)} />
        <label class="line"><span>Colours</span>
          <select value=${store.theme.value} onChange=${onTheme}>
            <option value="system">as the system</option>
            <option value="light">light</option>
            <option value="dark">dark</option></select></label>
        ${!store.isPhone.value && html`<${PanelLines} />`}
        ${!isFile() && html`<${AboutQuestions} />`}
        ${!isFile() && html`<${Downloads} />`}
        <div class="line"><span>Keys</span><button onClick=${showKeys}>show (?)</button></div>
      </div>`
    }
  </div>`;
}

/** Settings for questions: sound, and the name under which they are answered. */
function AboutQuestions() {
  const onSound = (/** @type {Event} */ e) => {
    store.sound.value = /** @type {HTMLInputElement} */ (e.target).checked;
    store.save("sound", store.sound.value);
  };
  const onName = (/** @type {Event} */ e) => {
    store.operator.value = fieldValue(e);
    store.save("operator", store.operator.value);
  };
  return html`<label class="line"><span>Sound for questions</span>
      <input type="checkbox" checked=${store.sound.value} onChange=${onSound} /></label>
    <label class="line"><span>You answer as</span>
      <input maxlength="60" placeholder="your name" value=${store.operator.value} onInput=${onName} /></label>`;
}

/** @param {{ page: Page }} props */
function Levels({ page }) {
  const depths = store.model.value?.order.map((node) => node.depth) ?? [];
  const deepest = depths.reduce((most, depth) => Math.max(most, depth), 1);
  const levels = Array.from({ length: Math.min(deepest, MOST_LEVELS) }, (_, i) => i + 1);
  return html`<div class="line"><span>Levels</span><span class="group">
    ${levels.map((level) => html`<button onClick=${() => page.setDepth(level)}>${level}</button>`)}
    <button onClick=${() => page.setDepth(ALL_LEVELS)}>all</button></span></div>`;
}

/** @param {{ page: Page }} props */
function NumbersLine({ page }) {
  const isMissing = (/** @type {string} */ mode) => OF_RECORDED_RUNS.includes(mode) && !store.statistics.value;
  return html`<label class="line"><span>Numbers</span>
    <select value=${store.numbers.value} onChange=${(/** @type {Event} */ e) => page.setNumbers(fieldValue(e))}>
      ${MODES.map(([mode, text]) => html`<option value=${mode} disabled=${isMissing(mode)}>${text}</option>`)}
    </select></label>`;
}

/** Downloads: pictures of the whole machine with the states active at the instant shown, and the run. */
function Downloads() {
  const active = store.activePaths.value.slice(0, MOST_ACTIVE).map((path) => `&active=${encoded(path)}`);
  const looks = `&theme=${isDark() ? "dark" : "light"}${active.join("")}`;
  const picture = (/** @type {string} */ format) =>
    html`<a class="button" href=${link("picture", `&format=${format}${looks}`)} download>${format}</a>`;
  return html`<div class="line"><span>Save picture</span>
      <span class="group">${["svg", "png", "pdf", "dot"].map(picture)}</span></div>
    <div class="line"><span>Save run</span><span class="group">
      <a class="button" href=${link("export", "&format=html")} download>html page</a>
      <a class="button" href=${link("export", "&format=jsonl")} download>recording</a></span></div>`;
}
