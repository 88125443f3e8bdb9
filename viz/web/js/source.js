// Where events come from: a server, or the file that this page is.
import { batch } from "@preact/signals";
import * as store from "viewer/store";

const SILENT_BEATS = 2; // a server that says nothing for so long is lost
const CAUGHT_UP_MS = 1000; // until then a stream may tell of what happened long ago
const AGAIN_MS = 250, LATEST_MS = 4000; // between two tries to fetch a structure

let stream = null;
let lastId = ""; // of the newest message of events
let silence = 0; // half beats without a word
let patience = SILENT_BEATS; // with a stream that is open; longer when one was cut before a beat came
let watchdog = 0;
let begun = 0; // when the stream began [ms]
let loads = 0; // the newest one counts
let token = null;
let onEvents = () => {};
let onMachine = () => {};

export const isFile = () => document.getElementById("run-data") !== null;

async function unpack(id) {
  const text = document.getElementById(id).textContent;
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain).text();
}

export async function makeWorker() {
  if (!isFile()) return new Worker("/vendor/elk-worker.min.js");
  const code = await unpack("elk-data");
  return new Worker(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
}

export async function connect(handlers) {
  ({ onEvents, onMachine } = handlers);
  takeToken();
  if (isFile()) {
    const run = JSON.parse(await unpack("run-data"));
    store.connection.value = "file";
    takeSnap(run.snap, run.model);
    store.statistics.value = run.statistics ?? null;
    return;
  }
  if (new URLSearchParams(location.search).has("actions")) showActions(true);
  open();
}

function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  try {
    if (given) sessionStorage.setItem("smachpy.token", given);
    token = given ?? sessionStorage.getItem("smachpy.token");
  } catch { token = given; }
  if (given) history.replaceState(null, "", location.pathname + location.search);
}

export const hasToken = () => token !== null && store.settings.value.control;

export const canControl = () =>
  store.settings.value.control && token !== null && store.facts.value?.control != null &&
  store.connection.value === "live" && store.facts.value.stale == null;

export function choose(name) {
  store.wanted.value = name;
  const address = new URL(location.href);
  address.searchParams.set("machine", name);
  history.replaceState(null, "", address);
  store.facts.value = null;
  store.statistics.value = null;
  lastId = "";
  loads += 1;
  open();
}

// For an address; half of a pair of UTF-16, which a name may hold, has no place in one.
export const encoded = (text) => encodeURIComponent(String(text).replace(/\p{Surrogate}/gu, "\ufffd"));
export const link = (what, more = "") => `/api/${what}?machine=${encoded(store.facts.value?.name ?? "")}${more}`;

function open() {
  stream?.close();
  const last = lastId ? `&last=${encodeURIComponent(lastId)}` : "";
  stream = new EventSource(`/api/events?machine=${encodeURIComponent(store.wanted.value)}${last}`);
  const on = (name, take) => stream.addEventListener(name, (message) => {
    silence = 0;
    lastId = message.lastEventId || lastId;
    take(JSON.parse(message.data));
  });
  on("settings", (s) => { begun = performance.now(); store.settings.value = s; store.connection.value = "live"; watch(s.beat * 1000); });
  on("beat", (t) => { patience = SILENT_BEATS; store.connection.value = "live"; store.viewerLag.hear(t); });
  on("machines", (list) => { store.machines.value = list; });
  on("actions", (found) => { store.actions.value = { ...found, known: true }; });
  on("facts", takeFacts);
  on("snap", takeSnap);
  on("gap", (count) => { store.gap.value = count; });
  on("message", (events) => {
    if (performance.now() - begun > CAUGHT_UP_MS) store.robotLag.hear(events.at(-1).stamp_ns / 1e6);
    onEvents(events);
  });
  stream.onopen = () => { store.connection.value = "live"; };
  stream.onerror = () => {
    store.connection.value = "lost";
    if (stream.readyState === EventSource.CLOSED) setTimeout(open, 1000);
  };
}

// A connection that was cut shows no error for minutes: it is lost when the beats [ms] stay away.
// So they do while a long message comes over a slow link: the next time it is given twice as long.
function watch(beat) {
  clearInterval(watchdog);
  silence = 0;
  if (!(beat > 0)) return; // a server of an older version
  watchdog = setInterval(() => {
    const comes = stream.readyState === EventSource.OPEN;
    silence += 1;
    if (silence <= 2 * (comes ? patience : SILENT_BEATS)) return;
    if (comes) patience *= 2;
    reconnect();
  }, beat / 2);
}

// Ask anew for what comes after the last message.
export function reconnect() {
  silence = 0;
  store.connection.value = "lost";
  open();
}

async function takeFacts(facts) {
  const before = store.facts.value;
  store.facts.value = facts;
  if (before && before.revision !== facts.revision && before.epoch === facts.epoch) await load(facts);
}

async function takeSnap(snap, payload) {
  store.wanted.value ||= snap.name;
  const known = store.facts.value;
  if (known?.name !== snap.name || known.epoch !== snap.epoch) store.robotLag.forget();
  batch(() => {
    store.facts.value = snap;
    store.problems.value = snap.problems;
    store.begin(snap.base, snap.events);
    store.tick.value += 1;
    store.slowTick.value += 1;
  });
  const same = known && store.model.value && known.name === snap.name && known.revision === snap.revision
    && known.epoch === snap.epoch;
  if (payload) { store.setModel(payload); onMachine(); }
  else if (same) onEvents([]);
  else await load(snap);
}

// Fetch the structure of a machine, until it comes or another one is wanted.
async function load(facts) {
  const mine = loads += 1;
  const wait = (time) => new Promise((done) => { setTimeout(done, time); });
  const fetched = async () => {
    try {
      const answer = await fetch(`/api/model?machine=${encoded(facts.name)}`);
      return answer.ok ? await answer.json() : null;
    } catch { return null; } // the connection tells that the server is gone
  };
  let found = null;
  for (let pause = AGAIN_MS; !found; pause = Math.min(2 * pause, LATEST_MS)) {
    found = await fetched();
    if (!found) await wait(pause);
    if (mine !== loads) return;
  }
  store.setModel(found);
  onMachine();
  const statistics = await ask(link("statistics"));
  if (mine !== loads) return;
  const wrong = statistics?.ok === false;
  store.statistics.value = wrong ? null : statistics;
  if (wrong) store.say(`Recorded runs: ${statistics.text}`, "error");
}

// The JSON answer of the server; when it gives none, the same shape.
export async function ask(address, options = {}) {
  let answer, text;
  try {
    answer = await fetch(address, options);
    text = await answer.text();
  } catch (error) { return { ok: false, text: `The viewer\u2019s server does not answer (${error.message}).` }; }
  try { return JSON.parse(text); } catch { /* told as it is */ }
  const said = [`${answer.status} ${answer.statusText}`.trim(), text.trim().slice(0, 300)].filter(Boolean).join(": ");
  return { ok: false, text: `The viewer\u2019s server answered ${said}` };
}
const post = (address, data) => ask(address, {
  method: "POST",
  headers: { "content-type": "application/json", "x-smachpy-token": token ?? "" },
  body: JSON.stringify(data),
});
export const askAction = (data) => post("/api/action", data);

export function showActions(open) {
  store.actionsOpen.value = open;
  const address = new URL(location.href);
  if (open) address.searchParams.set("actions", ""); else address.searchParams.delete("actions");
  history.replaceState(null, "", address);
}

export async function command(name, more = {}) {
  const result = await post(link("control"), { command: name, ...more });
  if (result.ok) store.say(`${name}${more.path ? ` ${more.path}` : ""}: done`);
  else store.say(`${name}: ${result.text ?? "refused"}`, "error");
  return result.ok;
}
