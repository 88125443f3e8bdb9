// What is behind the picture: the selected state, who is asked to stop, goals, userdata, the log.
import { h } from "preact";
import { useState } from "preact/hooks";
import { signal } from "@preact/signals";
import htm from "htm";
import * as store from "viewer/store";
import { askerText, ms } from "viewer/fold";
import { KIND_NAMES, outcomeClass, shorten } from "viewer/model";
import { span } from "viewer/diagram";
import { ask, encoded, isFile, link } from "viewer/source";
import { StateControls, StopAfter } from "viewer/controls";
import { Differences } from "viewer/comparison";
import { coverage } from "viewer/statistics";

const html = htm.bind(h);
const FLASH_MS = 900;
const LOG_LINES = 70, LOOKED_THROUGH = 6000; // lines, events; so many more at each "older"
const MOST_VALUES = 60, MOST_CHANGES = 8;
const SHORT = 160, LINE = 200; // characters; the browser takes minutes to break lines of thousands
const RECENT_MS = 30_000; // a preempt that is over is shown so long while the mission goes on
const MOST_ROWS = 24;

const count = (events) => `${events.toLocaleString("en")} event${events === 1 ? "" : "s"}`;
const Section = ({ title, count, children }) =>
  html`<section><h2>${title}${count != null && html` <span class="number">${count}</span>`}</h2>${children}</section>`;
const State = ({ path, page }) => {
  const name = store.model.value?.get(path)?.name ?? shorten(path.split("/").at(-1));
  return html`<button class="link" title=${shorten(path, 400)} onClick=${() => page.goTo(path)}>${name}</button>`;
};

export function Inspector({ page }) {
  store.slowTick.value;
  const model = store.model.value;
  if (!model) return html`<aside class="inspector"></aside>`;
  const data = store.shown(), now = store.nowMs();
  return html`<aside class="inspector" aria-label="details">
    ${store.gap.value !== null && html`<p class="hint gap" role="status">This page could not follow: ${count(store.gap.value)} and what was before are counted, but are not in the timeline.</p>`}
    ${data.dropped > 0 && html`<p class="hint gap" role="status">The mission was faster than it can be told: ${count(data.dropped)} are missing, and what is counted is too low.</p>`}
    <${Selected} page=${page} data=${data} now=${now} model=${model} />
    <${Differences} page=${page} State=${State} />
    <${Preempts} page=${page} data=${data} now=${now} />
    <${Goals} page=${page} data=${data} now=${now} />
    <${Userdata} page=${page} data=${data} now=${now} />
    <${Difference} page=${page} />
    <${Numbers} />
    <${Problems} page=${page} />
    <${Log} page=${page} />
  </aside>`;
}

function Selected({ page, data, now, model }) {
  const node = model.get(store.selected.value);
  if (!node) return null;
  const state = data.states[node.path];
  const active = state?.since != null;
  const keys = model.keys[node.path];
  const inside = keys ? new Map(keys.remapping) : null;
  const key = (k) => html`<code>${k}${inside.has(k) && inside.get(k) !== k ? html` \u2190 ${inside.get(k)}` : ""}</code> `;
  const recorded = store.statistics.value?.states?.[node.path];
  const facts = [
    ["kind", `${KIND_NAMES[node.kind] ?? node.kind} (${node.type_name})`], ...node.details,
    ["visits", state?.visits ?? 0],
    state?.visits > 0 && ["time inside", span(state.seconds + (active ? (now - ms(state.since)) / 1000 : 0))],
    active && ["runs for", span((now - ms(state.since)) / 1000)],
    state?.attempt > 1 && ["attempt", state.attempt],
    recorded && ["recorded runs", `median ${span(recorded.median ?? 0)}, 95 % under ${span(recorded.p95 ?? 0)}, ${Math.round(recorded.failures * 100)} % failed of ${recorded.visits}`],
  ].filter(Boolean);
  return html`<${Section} title=${node.name}>
    ${node.doc && html`<p class="doc">${node.doc}</p>`}
    <dl class="facts">${facts.map(([k, v]) => html`<dt>${k}</dt><dd>${v}</dd>`)}
      ${keys?.inputs.length > 0 && html`<dt>reads</dt><dd>${keys.inputs.map(key)}</dd>`}
      ${keys?.outputs.length > 0 && html`<dt>writes</dt><dd>${keys.outputs.map(key)}</dd>`}
    </dl>
    ${state?.error && html`<p class="error">${shorten(state.error, 2000)}</p>`}
    <ul class="outcomes">${node.outcomes.map((o) => {
      const edge = node.parent?.links.find((l) => l.source === node.label && l.outcomes.includes(o));
      return html`<li><${StopAfter} node=${node} outcome=${o} /><span class=${`pill-text ${outcomeClass(o)}`}>${shorten(o, 60)}</span><span>${edge ? ` \u2192 ${shorten(edge.target)}` : ""}</span>
        <span class="times">${state?.outcomes?.[o] ? `\u00d7${state.outcomes[o]}` : ""}</span></li>`;
    })}</ul>
    <${StateControls} node=${node} state=${state} />
  <//>`;
}

// A preempt as something that takes time: who asked, who has taken it up, who holds it up.
function Preempts({ page, data, now }) {
  const found = store.run.preemptAt(now);
  if (!found || found.from < (ms(data.started) ?? 0)) return null;
  if (found.to !== null && data.ended == null && now - found.to > RECENT_MS) return null;
  const end = found.to ?? now, whole = Math.max(end - found.from, 1);
  const askers = [...new Set(found.rows.map((row) => askerText(row.asked) ?? "not recorded"))];
  const at = (t) => `${((t - found.from) / whole) * 100}%`;
  const bar = (from, to, kind) => html`<i class=${kind} style=${{ left: at(from), width: `${Math.max(1.5, ((to - from) / whole) * 100)}%` }}></i>`;
  const rows = [...found.rows].sort((x, y) => x.path.split("/").length - y.path.split("/").length || x.preempt - y.preempt).slice(0, MOST_ROWS);
  return html`<${Section} title="Preempt"><div class="preempt">
    <dl class="facts"><dt>asked by</dt><dd>${askers.map((one) => html`<div>${one}</div>`)}</dd>
      <dt>first asked</dt><dd><${State} path=${found.rows[0].path} page=${page} /> ${span((now - found.from) / 1000)} ago</dd>
      ${found.to === null ? html`<dt>held up by</dt><dd>${found.holds.map((row, i) => html`${i > 0 ? ", " : ""}<b><${State} path=${row.path} page=${page} /></b> for ${holdText(row, now)}`)}</dd>`
        : html`<dt>took</dt><dd>${span(whole / 1000)}; longest: <${State} path=${longest(found.rows).path} page=${page} /></dd>`}</dl>
    <div class="waterfall" role="list">${rows.map((row) => {
      const until = row.to ?? now, holds = found.holds.some((one) => one.path === row.path);
      const cut = row.abandoned ?? row.serviced ?? until;
      const word = row.abandoned !== null ? "\u2715 left behind" : row.to !== null ? `\u2713 ${span((row.to - row.preempt) / 1000)}`
        : row.serviced !== null ? `\u2713 cleans up ${span((now - row.serviced) / 1000)}` : holds ? `\u25a0 ${span((now - row.preempt) / 1000)}` : "waits for children";
      return html`<div role="listitem" title=${waterfallTitle(row, until)}><${State} path=${row.path} page=${page} />
        <span aria-hidden="true">${bar(row.preempt, cut, row.to === null && row.serviced === null ? "preempted" : "asked")}${cut < until && bar(cut, until, row.abandoned !== null ? "failure" : "success")}
          ${row.serviced !== null && html`<b style=${{ left: at(row.serviced) }}></b>`}</span><small>${word}</small></div>`;
    })}${found.rows.length > MOST_ROWS && html`<div class="hint">and ${found.rows.length - MOST_ROWS} more</div>`}</div>
    <p class="hint key"><i class="preempted"></i> asked, not taken up <i class="asked"></i> until taken up <i class="success"></i> cleaning up</p></div><//>`;
}

const longest = (rows) => {
  const leaves = rows.filter((row) => !rows.some((other) => other.path.startsWith(`${row.path}/`)));
  return leaves.reduce((a, b) => (b.to - b.preempt > a.to - a.preempt ? b : a));
};
export const holdText = (row, now) => {
  const grace = row.asked?.grace;
  return `${span((now - row.preempt) / 1000)}${grace != null ? ` of ${span(grace)}` : ""}${row.serviced !== null ? ", cleaning up" : ""}`;
};
const waterfallTitle = (row, until) => [row.path, `asked by ${askerText(row.asked) ?? "?"}`,
  row.serviced !== null && `taken up after ${((row.serviced - row.preempt) / 1000).toFixed(3)} s`,
  row.abandoned !== null && `left behind after ${((row.abandoned - row.preempt) / 1000).toFixed(3)} s`,
  row.to !== null && `ended with ${row.outcome} after ${((until - row.preempt) / 1000).toFixed(3)} s`,
  row.asked?.grace != null && `left behind after ${row.asked.grace} s at the latest`].filter(Boolean).join("\n");

function Goals({ page, data, now }) {
  const goals = Object.entries(data.goals).map(([id, g]) => ({ id, ...g }))
    .filter((g) => g.ended == null || now - ms(g.ended) < 60_000)
    .sort((a, b) => (a.ended ?? Infinity) < (b.ended ?? Infinity) ? 1 : -1).slice(0, 6);
  return html`<${Section} title="Goals">
    ${!goals.length && html`<p class="hint">none</p>`}
    ${goals.map((g) => {
      const waits = store.unserved(g);
      const kind = waits ? "waiting" : g.ended == null ? "active" : outcomeClass(g.status === "REJECTED" || g.status === "LOST" ? "failed" : g.status);
      const part = g.ended != null && g.status === "SUCCEEDED" ? 1 : g.progress?.fraction;
      const until = g.ended != null ? ms(g.ended) : now;
      return html`<div class=${`goal ${kind}`} key=${g.id} title=${g.id}>
        <div class="head"><${State} path=${g.path} page=${page} /><span class="action">${g.action}</span>
          <span class="times">${g.attempt > 1 ? `attempt ${g.attempt} \u00b7 ` : ""}${span((until - ms(g.since)) / 1000)}</span></div>
        <div class=${`bar ${part == null && g.ended == null ? "unknown" : ""}`} role="progressbar" aria-valuenow=${part == null ? undefined : Math.round(part * 100)}>
          <i style=${{ width: `${Math.round((part ?? (g.ended != null ? 1 : 0)) * 100)}%` }}></i></div>
        <div class="text"><span class=${`pill-text ${kind}`}>${waits ? "no server seen" : g.ended == null ? "active" : g.status.toLowerCase()}</span>
          ${" "}${g.text || [g.progress?.distance != null ? `${g.progress.distance.toFixed(2)} m left` : "", g.progress?.text ?? ""].filter(Boolean).join(" \u00b7 ")}
          ${part != null && g.ended == null ? html`<span class="times">${Math.round(part * 100)} %</span>` : ""}</div>
        <${More} label="goal" value=${g.goal} /></div>`;
    })}<//>`;
}

function More({ label, value }) {
  const [open, setOpen] = useState(false);
  if (value == null) return null;
  return html`<details open=${open} onToggle=${(e) => setOpen(e.target.open)}><summary>${label}</summary>${open && html`<pre>${pretty(value)}</pre>`}</details>`;
}

// Enter and Space on a row do what a click does.
const pressAsClick = (e) => {
  if (e.target !== e.currentTarget || (e.key !== "Enter" && e.key !== " ")) return;
  e.preventDefault();
  e.currentTarget.click();
};

const plain = (value) => value?.$msg ? { [value.$msg]: value.fields } : value;
const pretty = (value) => JSON.stringify(value, (_k, v) => (v && v.$msg ? v.fields : v), 1).replace(/"([a-z_0-9]+)":/gi, "$1:").slice(0, 20_000);
export function brief(value) {
  const text = typeof value === "string" ? value
    : JSON.stringify(plain(value), (_k, v) => (v && v.$msg ? v.fields : typeof v === "number" && !Number.isInteger(v) ? Number(v.toPrecision(6)) : v));
  return text ?? "";
}

function Userdata({ page, data, now }) {
  // What runs comes first, then what was written last.
  const rank = new Map();
  for (const entry of Object.values(data.userdata)) {
    const runs = data.states[entry.container]?.since != null ? 1e20 : 0;
    rank.set(entry.container, Math.max(rank.get(entry.container) ?? 0, runs ? runs - entry.container.length : entry.at / 1e6));
  }
  const all = Object.entries(data.userdata).sort(([a, x], [b, y]) =>
    rank.get(y.container) - rank.get(x.container) || (a < b ? -1 : 1));
  const [open, setOpen] = useState(null);
  const [most, setMost] = useState(MOST_VALUES);
  const several = new Set(all.map(([, entry]) => entry.container)).size > 1;
  let container = null;
  return html`<${Section} title="Userdata" count=${all.length || null}>
    ${!all.length && html`<p class="hint">nothing written yet</p>`}
    <div class="scroller"><table class="userdata"><tbody>${all.slice(0, most).map(([id, entry]) => {
      const text = brief(entry.value);
      const fresh = now - ms(entry.at) < FLASH_MS;
      const first = several && entry.container !== container;
      container = entry.container;
      return html`${first && html`<tr class="group"><th colspan="2" title=${container}>${container.split("/").filter(Boolean).slice(-2).map((part) => shorten(part)).join(" \u203a ")}</th></tr>`}<tr key=${id} class=${fresh ? "fresh" : ""} tabindex="0" aria-expanded=${open === id} onClick=${() => setOpen(open === id ? null : id)} onKeyDown=${pressAsClick}>
        <th scope="row" title=${shorten(entry.container, 400)}>${shorten(entry.key, 80)}</th>
        <td><code>${open === id ? html`<pre>${pretty(entry.value)}</pre>` : text.slice(0, SHORT)}${open !== id && text.length > SHORT ? "\u2026" : ""}</code>
          ${open === id && wasShortened(text) && html`<${Whole} entry=${entry} />`}
          <small>by <${State} path=${entry.writer} page=${page} /> ${clock(entry.at, data)}</small></td></tr>`;
    })}</tbody></table></div><${Cut} left=${all.length - most} onMore=${() => setMost(most + 4 * MOST_VALUES)} /><//>`;
}

// Says that a list is cut, and goes on.
const Cut = ({ left, onMore }) => (left > 0 ? html`<button class="small" onClick=${onMore}>and ${left.toLocaleString("en")} more</button>` : null);

// Events tell only the beginning of long values; the mission has the rest.
const wasShortened = (text) => /\u2026$|\u2026"|<\S+ of \d+ elements>/.test(text);
const wholes = signal({}); // what has been fetched, by container and key; rows come and go
function Whole({ entry }) {
  // Labels may hold slashes, so the path alone does not tell what is inside what.
  const container = store.model.value?.get(entry.writer)?.parent?.path ?? entry.container;
  const id = `${store.facts.value?.epoch} ${container} ${entry.key}`;
  const found = wholes.value[id];
  if (isFile() || store.facts.value?.recorded) return html`<small>shortened when it was recorded</small>`;
  const put = (answer) => { wholes.value = { ...wholes.value, [id]: answer }; };
  const fetchIt = async (e) => {
    e.stopPropagation();
    put({ text: "Asking the mission\u2026" });
    put(await ask(link("value", `&container=${encoded(container)}&key=${encoded(entry.key)}`)));
  };
  if (!found) return html`<button class="small whole" onClick=${fetchIt}>Fetch the whole value</button>`;
  return html`<div class="whole-value" onClick=${(e) => e.stopPropagation()}>${found.ok ? html`<small>as it was when it was asked for, ${found.text.length.toLocaleString("en")} characters
    <button class="small" onClick=${fetchIt}>again</button></small><textarea readonly rows="14" wrap="off" aria-label=${`the whole value of ${entry.key}`} value=${found.text}></textarea>` : html`<p class="error">${found.text}</p>`}</div>`;
}

const clock = (ns, data) => {
  const t = (ms(ns) - (ms(data.started) ?? store.run.first() ?? ms(ns))) / 1000;
  return `at ${t.toFixed(t < 100 ? 2 : 0)} s`;
};

// What the transition at the cursor changed.
function Difference({ page }) {
  const [whole, setWhole] = useState(false);
  if (store.cursor.value === null) return null;
  const run = store.run, at = store.happened();
  let from = at - 1;
  while (from > 0 && !["Left", "Failed", "Finished", "Started"].includes(run.events[from]?.kind)) from--;
  let before = from - 1;
  while (before > 0 && !["Left", "Failed", "Started"].includes(run.events[before]?.kind)) before--;
  const changes = run.events.slice(Math.max(0, before), at).filter((e) => e.kind === "UserdataWritten");
  const shown = whole ? changes : changes.slice(-MOST_CHANGES);
  const old = run.after(Math.max(0, before)).userdata;
  return html`<${Section} title="Changed by this transition">
    ${!changes.length && html`<p class="hint">no userdata was written</p>`}
    ${shown.map((e) => {
      const container = e.path.slice(0, e.path.lastIndexOf("/"));
      const was = old[`${container} ${e.key}`];
      return html`<div class="diff"><b>${e.key}</b> <del>${was ? brief(was.value).slice(0, 60) : "unset"}</del> <ins>${brief(e.value).slice(0, 60)}</ins> <small>by <${State} path=${e.path} page=${page} /></small></div>`;
    })}<${Cut} left=${changes.length - shown.length} onMore=${() => setWhole(true)} /><//>`;
}

function Numbers() {
  store.slowTick.value;
  if (store.heat.value === "none") return null;
  const { taken, all } = coverage();
  const recorded = store.statistics.value;
  return html`<${Section} title="Numbers"><dl class="facts">
    <dt>transitions taken</dt><dd>${taken} of ${all} (${all ? Math.round((taken / all) * 100) : 0} %)</dd>
    ${recorded && html`<dt>recorded runs</dt><dd>${recorded.runs}, median ${span(recorded.median ?? 0)}</dd>
      <dt>they ended</dt><dd>${Object.entries(recorded.outcomes).map(([o, n]) => html`<span class=${`pill-text ${outcomeClass(o)}`}>${o} \u00d7${n}</span> `)}</dd>`}
  </dl><//>`;
}

function Problems({ page }) {
  const found = store.problems.value;
  if (!found.length) return null;
  const words = (p) => (p.text.startsWith(`${p.path}: `) ? p.text.slice(p.path.length + 2) : p.text);
  return html`<section><details class="fold-up"><summary><h2>Problems of the machine <span class="number">${found.length}</span></h2></summary>
    <ul class="problems">${found.slice(0, 30).map((p) => html`<li class=${p.severity}><${State} path=${p.path} page=${page} /> ${shorten(words(p), 600)}</li>`)}</ul></details></section>`;
}

const LINES = {
  Started: () => ["started", "active"], Finished: (e) => [`ended: ${e.outcome ?? "exception"}`, outcomeClass(e.outcome ?? "exception")],
  Left: (e) => [e.outcome, outcomeClass(e.outcome)], Failed: (e) => [e.error, "failure"],
  PreemptRequested: (e) => [`asked to stop${askerText(e) ? ` by ${askerText(e)}` : ""}${e.grace != null ? `, within ${span(e.grace)}` : ""}`, "preempted"],
  PreemptServiced: () => ["takes the preempt up", "preempted"], Abandoned: (e) => [`left behind after ${e.grace} s`, "failure"],
  TimedOut: (e) => [`timeout of ${e.timeout} s`, "preempted"], Retried: (e) => [`again: ${e.reason}`, "preempted"],
  Iterated: (e) => [`item ${e.number + 1}`, "other"], CallbackFailed: (e) => [`${e.callback}: ${e.error}`, "failure"],
  Paused: (e) => [`paused (${e.reason})`, "waiting"], Resumed: () => ["goes on", "active"], Jumped: (e) => [`sent to ${e.label}`, "waiting"],
  OutcomeForced: (e) => [`forced: ${e.outcome}`, "waiting"], GoalSent: (e) => [`goal to ${e.action}`, "active"],
  GoalDone: (e) => [`${e.action}: ${e.status.toLowerCase()} ${e.text}`, outcomeClass(e.status)],
  UserdataWritten: (e) => [`${e.key} = ${brief(e.value).slice(0, 60)}`, "other"],
};
const GROUPS = { all: null, transitions: ["Started", "Finished", "Left", "Failed"], goals: ["GoalSent", "GoalDone"],
  userdata: ["UserdataWritten"], trouble: ["Failed", "PreemptRequested", "PreemptServiced", "Abandoned", "TimedOut", "Retried", "CallbackFailed"] };

function Log({ page }) {
  store.slowTick.value; // components that read signals are drawn again only when those change
  const [text, setText] = useState("");
  const [reach, setReach] = useState(1);
  const run = store.run, kinds = GROUPS[store.logFilter.value];
  const end = store.happened();
  const begun = ms(store.shown().started) ?? run.first();
  const lines = [];
  const wanted = text.toLowerCase();
  const most = reach * LOG_LINES, last = Math.max(0, end - reach * LOOKED_THROUGH);
  let i = end - 1;
  for (; i >= last && lines.length < most; i--) {
    const e = run.events[i], missing = i + 1 < end && run.events[i + 1].dropped;
    if (missing) lines.push(html`<li key=${-e.seq} class="hint">${count(missing)} missing here</li>`);
    if (!(e.kind in LINES) || (kinds && !kinds.includes(e.kind)) || (!kinds && e.kind === "UserdataWritten")) continue;
    const at = i + 1;
    const [words, kind] = LINES[e.kind](e);
    if (wanted && !`${e.path} ${words}`.toLowerCase().includes(wanted)) continue;
    const edge = e.kind === "Left" ? target(e) : "";
    lines.push(html`<li key=${e.seq} onClick=${() => { if (store.cursor.value !== null) store.seekTo(at); }}>
      <time>${((ms(e.stamp_ns) - begun) / 1000).toFixed(2)}</time><${State} path=${e.path} page=${page} /> <span class=${`word ${kind}`}>${shorten(words, LINE)}</span>${edge}</li>`);
  }
  return html`<${Section} title="Log"><div class="filter">
    <select aria-label="kinds" value=${store.logFilter.value} onChange=${(e) => { store.logFilter.value = e.target.value; }}>${Object.keys(GROUPS).map((g) => html`<option value=${g}>${g}</option>`)}</select>
    <input aria-label="filter the log" placeholder="filter" value=${text} onInput=${(e) => setText(e.target.value)} /></div>
    <ol class="log">${lines}</ol>${i >= 0 && html`<button class="small" onClick=${() => setReach(reach + 1)}>${lines.length < most
      ? `nothing more in the last ${(end - last).toLocaleString("en")} of ${end.toLocaleString("en")} events; look at older ones` : "older"}</button>`}<//>`;
}

function target(e) {
  const node = store.model.value?.get(e.path);
  const link = node?.parent?.links.find((l) => l.source === node.label && l.outcomes.includes(e.outcome));
  return link && link.target !== e.outcome ? ` \u2192 ${shorten(link.target)}` : "";
}
