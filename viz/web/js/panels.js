// Top bar, tree, search: everything around the diagram that is not the inspector.
import { h } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import htm from "htm";
import * as store from "viewer/store";
import { choose, encoded, isFile, link } from "viewer/source";
import { MODES } from "viewer/statistics";
import { Controls } from "viewer/controls";
import { CompareChip, CompareLine } from "viewer/comparison";
import { ActionsButton } from "viewer/actions";
import { KIND_NAMES, SIGNS, outcomeClass, shorten } from "viewer/model";

export const html = htm.bind(h);
const ROW = 24;
const MOST_NAMES = 12, MOST_FOUND = 12;
const MOST_ACTIVE = 200; // in an address
const GLYPH = { action: "\u25b6", service: "\u21c4", monitor: "\u25c9", condition: "?", machine: "\u25a3",
  sequence: "\u2192", concurrence: "\u2016", iterator: "\u21bb", missing: "\u2715" };

const Toggle = ({ on, onClick, children, title, disabled }) =>
  html`<button class=${on ? "on" : ""} aria-pressed=${on} onClick=${onClick} title=${title} disabled=${disabled}>${children}</button>`;

export function TopBar({ page }) {
  const status = store.runStatus.value;
  return html`<header class="top">
    <${Chooser} />
    <span class=${`status ${status.kind}`} role="status" data-testid="status">${status.word}</span>
    ${store.problems.value.length > 0 && html`<span class="chip" title="problems found without running it; see the inspector">
      \u26a0 ${store.problems.value.length}</span>`}
    <${CompareChip} page=${page} />
    <${Crumbs} page=${page} />
    <span class="spread"></span>
    <${Search} page=${page} />
    <${Toggle} on=${store.follow.value} onClick=${() => page.setFollow(!store.follow.value)} title="show what runs (o)">Follow<//>
    <${View} page=${page} />
    <${ActionsButton} />
    <${Controls} />
  </header>`;
}

function Chooser() {
  const list = store.machines.value, facts = store.facts.value;
  const name = facts ? shorten(facts.label, 60) : "no machine yet";
  const others = list.some((m) => m.name !== facts?.name);
  if (isFile() || !others) return html`<h1 title=${facts?.name}>${name}</h1>`;
  const word = (m) => m.recorded ? "recording" : m.stale != null && m.ended == null ? "stale" : m.ended != null ? `ended: ${m.outcome}` : "running";
  return html`<label class="chooser"><span class="hidden">machine</span>
    <select value=${facts?.name ?? ""} onChange=${(e) => choose(e.target.value)}>
      ${!facts && html`<option value="" disabled>${shorten(store.wanted.value || "choose a machine", 60)}</option>`}
      ${list.map((m) => html`<option value=${m.name} title=${m.node ? `in node ${m.node}` : ""}>${m.name} \u2013 ${word(m)}</option>`)}
    </select></label>`;
}

function Crumbs({ page }) {
  const model = store.model.value;
  const leaf = store.selected.value ?? store.activeLeaves.value[0];
  const node = model?.get(leaf);
  if (!node) return null;
  const path = [...model.ancestors(node.path), node];
  const more = store.selected.value ? 0 : store.activeLeaves.value.length - 1;
  return html`<nav class="crumbs" aria-label="path of the ${store.selected.value ? "selected" : "active"} state">
    ${path.map((n, i) => html`${i > 0 && html`<i>\u203a</i>`}<button onClick=${() => page.goTo(n.path)}>${n.name}</button>`)}
    ${more > 0 && html`<span class="chip" title=${store.activeLeaves.value.join("\n")}>+${more} active</span>`}
  </nav>`;
}

function Search({ page }) {
  const [at, setAt] = useState(0);
  const text = store.query.value;
  const found = text ? store.model.value?.search(text) ?? [] : [];
  const shown = found.slice(0, MOST_FOUND);
  const pick = (node) => { if (node) { page.goTo(node.path); store.query.value = ""; document.activeElement?.blur(); } };
  const onKeyDown = (e) => {
    if (e.key === "Enter") pick(shown[Math.min(at, shown.length - 1)]);
    else if (e.key === "ArrowDown") { setAt(Math.min(at + 1, shown.length - 1)); e.preventDefault(); }
    else if (e.key === "ArrowUp") { setAt(Math.max(at - 1, 0)); e.preventDefault(); }
    else if (e.key === "Escape") { store.query.value = ""; e.target.blur(); }
    else return;
    e.stopPropagation();
  };
  useEffect(() => { page.markHits(found.map((n) => n.path)); }, [text]);
  return html`<div class="search">
    <input id="search" placeholder="Search states" aria-label="Search states" value=${text} autocomplete="off" spellcheck=${false}
      onInput=${(e) => { store.query.value = e.target.value; setAt(0); }} onKeyDown=${onKeyDown} />
    ${!text && html`<kbd>/</kbd>`}
    ${text && html`<ul class="results" role="listbox">
      ${shown.map((n, i) => html`<li role="option" aria-selected=${i === at} class=${i === at ? "at" : ""}
        onPointerDown=${() => pick(n)}><b>${n.name}</b><small>${n.parent ? n.parent.path : KIND_NAMES[n.kind]}</small></li>`)}
      ${!found.length && html`<li class="none">nothing is called that</li>`}
      ${found.length > shown.length && html`<li class="none">and ${found.length - shown.length} more</li>`}
    </ul>`}
  </div>`;
}

function View({ page }) {
  const [open, setOpen] = useState(false);
  const box = useRef();
  useEffect(() => {
    const away = (e) => { if (!box.current?.contains(e.target)) setOpen(false); };
    addEventListener("pointerdown", away);
    return () => removeEventListener("pointerdown", away);
  }, []);
  const deepest = Math.max(1, ...(store.model.value?.order.map((n) => n.depth) ?? [1]));
  const levels = Array.from({ length: Math.min(deepest, 9) }, (_, i) => i + 1);
  return html`<div class="menu" ref=${box}>
    <button aria-expanded=${open} onClick=${() => setOpen(!open)}>View</button>
    ${open && html`<div class="sheet">
      <div class="line"><span>Levels</span><span class="group">${levels.map((n) => html`<button onClick=${() => page.setDepth(n)}>${n}</button>`)}
        <button onClick=${() => page.setDepth(99)}>all</button></span></div>
      <label class="line"><span>Transitions nobody wrote down</span><input type="checkbox" checked=${store.implicit.value}
        onChange=${(e) => page.setImplicit(e.target.checked)} /></label>
      <label class="line"><span>Numbers</span><select value=${store.heat.value} onChange=${(e) => page.setHeat(e.target.value)}>
        ${MODES.map(([key, text]) => html`<option value=${key} disabled=${["runs", "failures", "compare"].includes(key) && !store.statistics.value}>${text}</option>`)}
      </select></label>
      <${CompareLine} page=${page} done=${() => setOpen(false)} />
      <label class="line"><span>Colours</span><select value=${store.theme.value} onChange=${(e) => page.setTheme(e.target.value)}>
        <option value="system">as the system</option><option value="light">light</option><option value="dark">dark</option></select></label>
      ${!isFile() && html`<${SavePicture} />
      <div class="line"><span>Save run</span><span class="group"><a class="button" href=${link("export", "&format=html")} download>html page</a>
        <a class="button" href=${link("export", "&format=jsonl")} download>recording</a></span></div>`}
      <div class="line"><span>Keys</span><button onClick=${() => { store.help.value = true; setOpen(false); }}>show (?)</button></div>
    </div>`}
  </div>`;
}

// The whole machine in the page's colours, with what is active at the instant shown.
function SavePicture() {
  const active = store.activePaths.value.slice(0, MOST_ACTIVE).map((path) => `&active=${encoded(path)}`).join("");
  const looks = `&theme=${store.isDark() ? "dark" : "light"}${active}`;
  return html`<div class="line"><span>Save picture</span><span class="group">${["svg", "png", "pdf", "dot"].map((f) =>
    html`<a class="button" href=${link("picture", `&format=${f}${looks}`)} download>${f}</a>`)}</span></div>`;
}

// The tree draws only the rows that are in view.
export function Tree({ page }) {
  const [top, setTop] = useState(0);
  const [folded, setFolded] = useState(() => new Map());
  const [chosen, setChosen] = useState(null);
  const box = useRef();
  store.tick.value;
  const model = store.model.value;
  if (!model) return html`<aside class="tree"></aside>`;
  const states = store.shown().states;
  const rows = [];
  const walk = (node) => {
    rows.push(node);
    const own = folded.get(node.path);
    const open = own ?? (states[node.path]?.since != null || store.opened.value.has(node.path));
    node.treeOpen = open;
    if (open) node.children.forEach(walk);
  };
  walk(model.root);
  const height = box.current?.clientHeight ?? 800;
  const first = Math.max(0, Math.floor(top / ROW) - 4);
  const visible = rows.slice(first, first + Math.ceil(height / ROW) + 8);
  const fold = (node) => setFolded(new Map(folded).set(node.path, !node.treeOpen));
  const at = Math.max(0, rows.findIndex((node) => node.path === (chosen ?? store.selected.value)));
  const choose = (row) => {
    const to = Math.max(0, Math.min(row, rows.length - 1)), y = to * ROW + 6;
    setChosen(rows[to].path);
    box.current.scrollTop = Math.max(y + ROW - height, Math.min(box.current.scrollTop, y - 6));
  };
  const onKeyDown = (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const node = rows[at], inside = node.children.length > 0, screen = Math.max(1, Math.floor(height / ROW) - 1);
    const rowOf = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: rows.length - 1, PageDown: at + screen, PageUp: at - screen };
    if (e.key in rowOf) choose(rowOf[e.key]);
    else if (e.key === "ArrowRight") { if (inside && !node.treeOpen) fold(node); else if (inside) choose(at + 1); }
    else if (e.key === "ArrowLeft") { if (inside && node.treeOpen) fold(node); else if (node.parent) choose(rows.indexOf(node.parent)); }
    else if (e.key === "Enter" || e.key === " ") page.goTo(node.path);
    else return;
    e.preventDefault();
    e.stopPropagation();
  };
  return html`<aside class="tree" aria-label="states" role="tree" ref=${box} onScroll=${(e) => setTop(e.target.scrollTop)}
    tabindex="0" aria-activedescendant=${`row-${rows[at].number}`} onKeyDown=${onKeyDown}>
    <div style=${{ height: `${rows.length * ROW}px` }} class="rows">
      ${visible.map((node, i) => {
        const state = states[node.path];
        const active = state?.since != null;
        const kind = state?.outcome != null ? outcomeClass(state.outcome) : "";
        return html`<div key=${node.path} role="treeitem" id=${`row-${node.number}`} aria-level=${node.depth + 1} aria-selected=${store.selected.value === node.path}
          aria-expanded=${node.children.length ? node.treeOpen : undefined}
          class=${`row ${first + i === at ? "at" : ""} ${active ? "active" : ""} ${state?.preempt && active ? "preempting" : ""} ${store.selected.value === node.path ? "selected" : ""}`}
          style=${{ top: `${(first + i) * ROW}px`, paddingLeft: `${8 + Math.min(node.depth, 12) * 14}px` }} title=${node.path}
          onClick=${() => { setChosen(node.path); page.goTo(node.path); }}>
          ${node.children.length ? html`<button class="fold" tabindex="-1" aria-label=${node.treeOpen ? "close" : "open"} onClick=${(e) => { e.stopPropagation(); fold(node); }}>${node.treeOpen ? "\u25be" : "\u25b8"}</button>`
            : html`<span class="kind">${GLYPH[node.kind] ?? "\u00b7"}</span>`}
          <span class="name">${node.name}</span>
          ${!active && kind && html`<span class=${`ended ${kind}`}>${{ success: "\u2713", failure: "\u2715", preempted: "\u25a0", other: "\u2022" }[kind]}</span>`}
          ${state?.visits > 1 && html`<span class="times">\u00d7${state.visits}</span>`}
        </div>`;
      })}
    </div></aside>`;
}

export function Legend() {
  if (store.comparison.value)
    return html`<div class="legend" aria-hidden="true">${["added", "removed", "changed"].map((kind) => html`<span><b class=${kind}></b>${SIGNS[kind]} ${kind}</span>`)}</div>`;
  const kinds = [["active", "running"], ["success", "succeeded"], ["failure", "failed"], ["preempted", "preempted"], ["waiting", "waiting"]];
  return html`<div class="legend" aria-hidden="true">${kinds.map(([kind, word]) => html`<span><b class=${kind}></b>${word}</span>`)}</div>`;
}

export function Notice() {
  const notice = store.notice.value;
  return html`<div class="notices" aria-live="assertive">${notice && html`<div class=${`notice ${notice.kind}`}>${notice.text}</div>`}</div>`;
}

const KEYS = [["/", "search"], ["f", "fit everything"], ["o", "follow what runs"], ["+ \u2212", "zoom"], ["\u2190 \u2191 \u2192 \u2193", "move the view, or step to a neighbour of the selected state"],
  ["Enter", "open or close the selected state"], [", .", "one event back or on"], ["l", "back to now"], ["1 \u2026 9", "levels to open"],
  ["i", "transitions nobody wrote down"], ["a", "actions"], ["d", "dark or light"], ["Space", "pause or go on (with control)"], ["s", "step (with control)"], ["Esc", "select nothing"]];

export function Help() {
  if (!store.help.value) return null;
  return html`<div class="veil" onClick=${() => { store.help.value = false; }}><div class="card" role="dialog" aria-label="keys">
    <h2>Keys</h2><dl>${KEYS.map(([key, text]) => html`<dt><kbd>${key}</kbd></dt><dd>${text}</dd>`)}</dl></div></div>`;
}

export function Empty() {
  const name = store.wanted.value, list = store.machines.value;
  if (store.connection.value === "lost") return html`<div class="empty"><p>The viewer\u2019s server does not answer. This page tries again.</p></div>`;
  const missing = name && !list.some((m) => m.name === name);
  const word = missing ? `No machine is called \u201c${shorten(name, 80)}\u201d. It shows up here as soon as one runs.`
    : "No machine on the network yet. It shows up here as soon as one runs.";
  if (!missing && list.length) return null; // it comes
  return html`<div class="empty"><p>${word}</p>${list.length ? html`<p>What there is:</p>
    <p class="others">${list.slice(0, MOST_NAMES).map((m) => html`<button onClick=${() => choose(m.name)}>${shorten(m.name, 60)}</button>`)}
      ${list.length > MOST_NAMES && `and ${list.length - MOST_NAMES} more, in the list above`}</p>` : html`<pre>smachpy run patrol --start-robot</pre>`}</div>`;
}
