// Where events come from: a server, or the file that this page is.
import { batch } from "@preact/signals";
import * as store from "viewer/store";

let stream = null;
let token = null;
let wanted = new URLSearchParams(location.search).get("machine") ?? "";
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
  wanted = name;
  const address = new URL(location.href);
  address.searchParams.set("machine", name);
  history.replaceState(null, "", address);
  store.facts.value = null;
  open();
}

const named = (name) => encodeURIComponent(name ?? store.facts.value?.name ?? "");
export const link = (what, more = "") => `/api/${what}?machine=${named()}${more}`;

function open() {
  stream?.close();
  stream = new EventSource(`/api/events?machine=${encodeURIComponent(wanted)}`);
  const on = (name, take) =>
    stream.addEventListener(name, (message) => take(JSON.parse(message.data)));
  on("settings", (s) => { store.settings.value = s; store.connection.value = "live"; });
  on("machines", (list) => { store.machines.value = list; });
  on("actions", (found) => { store.actions.value = found; });
  on("facts", takeFacts);
  on("snap", takeSnap);
  stream.onmessage = (message) => onEvents(JSON.parse(message.data));
  stream.onopen = () => { store.connection.value = "live"; };
  stream.onerror = () => {
    store.connection.value = "lost";
    if (stream.readyState === EventSource.CLOSED) setTimeout(open, 1000);
  };
}

async function takeFacts(facts) {
  const before = store.facts.value;
  store.facts.value = facts;
  if (before && before.revision !== facts.revision && before.epoch === facts.epoch) await load(facts);
}

async function takeSnap(snap, payload) {
  wanted ||= snap.name;
  const known = store.facts.value;
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

async function load(facts) {
  const answer = await fetch(`/api/model?machine=${named(facts.name)}`);
  if (!answer.ok) return;
  store.setModel(await answer.json());
  fetch(`/api/statistics?machine=${named(facts.name)}`).then(async (found) => {
    if (found.ok) store.statistics.value = await found.json();
  });
  onMachine();
}

// The JSON answer of the server; when it does not answer, the same shape.
export async function ask(address, options = {}) {
  try { return await (await fetch(address, options)).json(); }
  catch (error) { return { ok: false, text: `The viewer\u2019s server does not answer (${error.message}).` }; }
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
