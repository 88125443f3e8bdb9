// Receives events, from a server or from the file that this page is, and sends requests to the server.
import { batch } from "@preact/signals";
import * as store from "#core/store.js";

const SILENT_BEATS = 2; // beats without a message after which a server counts as lost
const CAUGHT_UP_MS = 1000; // time in which a new stream may bring old events
const RETRY_MS = 250; // time between two attempts to fetch a structure; it doubles
const LONGEST_RETRY_MS = 4000;

/** @type {EventSource | null} */
let stream = null;
let lastId = ""; // of the newest message of events
let silence = 0; // half beats without a message
let patience = SILENT_BEATS; // of an open stream [beats]; doubled when one was closed for its silence
/** @type {ReturnType<typeof setInterval> | undefined} */
let watchdog;
let streamBegan = 0; // [ms]
let loads = 0; // numbers the fetches of structures: only the newest one counts
/** @type {string | null} */
let token = null;
/** @type {(events: RunEvent[]) => void} */
let onEvents = () => {};
let onMachine = () => {};
/** @type {(records: Observed[]) => void} */
let onObserved = () => {};
/** @type {Why | null} */
let whyOfFile = null;

/** Whether this page is a file that contains its run. */
export const isFile = () => document.getElementById("run-data") !== null;

/** The text in an element. @param {string} id of an element with gzip data in base64 */
async function unpack(id) {
  const text = document.getElementById(id)?.textContent ?? "";
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain).text();
}

/** The bytes of zlib data in base64. @param {string} text */
export async function bytesOf(text) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(plain).arrayBuffer());
}

export async function makeLayoutWorker() {
  if (!isFile()) return new Worker("/vendor/elk-worker.min.js");
  const code = await unpack("elk-data");
  return new Worker(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
}

/**
 * @param {{ onEvents: (events: RunEvent[]) => void, onMachine: () => void,
 *   onObserved: (records: Observed[]) => void }} handlers
 */
export async function connect(handlers) {
  ({ onEvents, onMachine, onObserved } = handlers);
  readToken();
  if (isFile()) {
    const run = JSON.parse(await unpack("run-data"));
    store.connection.value = "file";
    await takeSnapshot(run.snap, run.model);
    onObserved(run.observed ?? []);
    store.statistics.value = run.statistics ?? null;
    whyOfFile = run.why ?? null;
    return;
  }
  const asked = new URLSearchParams(location.search);
  store.wanted.value = asked.get("machine") ?? "";
  if (asked.has("actions")) showActions(true);
  if (asked.has("runs")) showHome(true);
  open();
}

/**
 * Read the token from the fragment of the address, which browsers do not send to servers, and remove it there, so that
 * a copied address does not contain it.
 */
export function readToken() {
  const words = new URLSearchParams(location.hash.slice(1));
  const given = words.get("token") || null;
  words.delete("token");
  try {
    if (given) sessionStorage.setItem("smachpy.token", given);
    token = given ?? sessionStorage.getItem("smachpy.token");
  } catch {
    token = given; // a page in a file has no storage
  }
  const rest = String(words);
  if (given) history.replaceState(null, "", location.pathname + location.search + (rest && `#${rest}`));
}

export const hasToken = () => token !== null && store.settings.value.control;

/** Pause and breakpoints of the machine; null if this page cannot send commands to it. */
export function control() {
  const facts = store.facts.value;
  return hasToken() && store.connection.value === "live" && facts?.stale == null ? (facts?.control ?? null) : null;
}

/** Whether this page can answer questions of the machine shown; the mission needs no remote control for that. */
export function canAnswer() {
  const facts = store.facts.value;
  return hasToken() && store.connection.value === "live" && facts?.stale == null && !facts?.recorded;
}

/** Show the machine of that name. @param {string} name */
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

/** A text for an address; without lone surrogates, at which encodeURIComponent would throw. @param {string} text */
export const encoded = (text) => encodeURIComponent(text.replace(/\p{Surrogate}/gu, "\ufffd"));

/** The address of a resource of the machine shown. @param {string} what @param {string} [more] */
export const link = (what, more = "") => `/api/${what}?machine=${encoded(store.facts.value?.name ?? "")}${more}`;

// -- the stream of events -----------------------------------------------------------------------

function open() {
  stream?.close();
  const last = lastId ? `&last=${encoded(lastId)}` : "";
  const opened = new EventSource(`/api/events?machine=${encoded(store.wanted.value)}${last}`);
  stream = opened;
  /** @type {(name: string, take: (data: any) => void) => void} */
  const on = (name, take) =>
    opened.addEventListener(name, (/** @type {MessageEvent} */ message) => {
      silence = 0;
      lastId = message.lastEventId || lastId;
      take(JSON.parse(message.data));
    });
  on("settings", (/** @type {Settings} */ settings) => {
    streamBegan = performance.now();
    if (settings.home && !store.settings.value.home && !new URLSearchParams(location.search).has("machine"))
      showHome(true);
    store.settings.value = settings;
    store.connection.value = "live";
    watch((settings.beat ?? 0) * 1000);
  });
  on("beat", (t) => {
    patience = SILENT_BEATS;
    store.connection.value = "live";
    store.viewerLag.measure(t);
  });
  on("machines", (list) => {
    store.machines.value = list;
  });
  on("actions", (found) => {
    store.actions.value = { ...found, known: true };
  });
  on("facts", takeFacts);
  on("snap", (snapshot) => takeSnapshot(snapshot));
  on("observed", (/** @type {Observed[]} */ records) => onObserved(records));
  on("gap", (count) => {
    store.gap.value = count;
  });
  on("message", (events) => {
    if (performance.now() - streamBegan > CAUGHT_UP_MS) store.robotLag.measure(events.at(-1).stamp_ns / 1e6);
    onEvents(events);
  });
  opened.onopen = () => {
    store.connection.value = "live";
  };
  opened.onerror = () => {
    if (opened !== stream) return;
    store.connection.value = "lost";
    if (opened.readyState === EventSource.CLOSED) setTimeout(() => opened === stream && open(), 1000);
  };
}

/**
 * Reconnect when the beats stay away: a broken connection shows no error for minutes. Beats are also missing while a
 * long message arrives over a slow link, so the next stream gets twice the time.
 * @param {number} beat [ms]
 */
function watch(beat) {
  clearInterval(watchdog);
  silence = 0;
  if (!(beat > 0)) return; // a server of an older version
  watchdog = setInterval(() => {
    const isOpen = stream?.readyState === EventSource.OPEN;
    silence += 1;
    if (silence <= 2 * (isOpen ? patience : SILENT_BEATS)) return;
    if (isOpen) patience *= 2;
    reconnect();
  }, beat / 2);
}

/** Open a new stream that continues after the last message. */
export function reconnect() {
  silence = 0;
  store.connection.value = "lost";
  open();
}

/** @param {MachineFacts} facts */
async function takeFacts(facts) {
  const before = store.facts.value;
  store.facts.value = facts;
  if (before && before.revision !== facts.revision && before.epoch === facts.epoch) await load(facts);
}

/** @param {Snapshot} snapshot @param {MachinePayload} [payload] */
async function takeSnapshot(snapshot, payload) {
  store.wanted.value ||= snapshot.name;
  const known = store.facts.value;
  // Another snapshot of the same program, after a gap: its structure need not be fetched again.
  const same = known?.name === snapshot.name && known.epoch === snapshot.epoch;
  if (!same) {
    store.robotLag.forget();
    store.why.value = null;
  }
  batch(() => {
    store.facts.value = snapshot;
    store.problems.value = snapshot.problems;
    store.startRun(snapshot.base, snapshot.events);
    store.tick.value += 1;
    store.slowTick.value += 1;
  });
  if (payload) {
    store.setModel(payload);
    onMachine();
  } else if (same && store.model.value && known.revision === snapshot.revision) onEvents([]);
  else await load(snapshot);
}

/** Fetch the structure of a machine; try again until it comes or another fetch begins. @param {MachineFacts} facts */
async function load(facts) {
  loads += 1;
  const mine = loads;
  /** @type {MachinePayload | null} */
  let payload = null;
  for (let pause = RETRY_MS; !payload; pause = Math.min(2 * pause, LONGEST_RETRY_MS)) {
    payload = await fetchModel(facts.name);
    if (!payload) await new Promise((done) => setTimeout(done, pause));
    if (mine !== loads) return;
  }
  store.setModel(payload);
  onMachine();
  const statistics = await ask(link("statistics"));
  if (mine !== loads) return;
  const failed = statistics?.ok === false;
  store.statistics.value = failed ? null : /** @type {Statistics | null} */ (/** @type {unknown} */ (statistics));
  if (failed) store.notify(`Recorded runs: ${statistics.text}`, "error");
}

/** @param {string} name @returns {Promise<MachinePayload | null>} */
async function fetchModel(name) {
  try {
    const answer = await fetch(`/api/model?machine=${encoded(name)}`);
    return answer.ok ? await answer.json() : null;
  } catch {
    return null; // the page already shows a lost connection
  }
}

// -- questions and commands ---------------------------------------------------------------------

/**
 * The JSON answer of the server, or an error in the same form.
 * @param {string} address
 * @param {RequestInit} [options]
 * @returns {Promise<Answer>}
 */
export async function ask(address, options = {}) {
  let answer;
  let text;
  try {
    answer = await fetch(address, options);
    text = await answer.text();
  } catch (error) {
    return { ok: false, text: `The viewer's server does not answer (${messageOf(error)}).` };
  }
  try {
    return JSON.parse(text);
  } catch {
    const status = `${answer.status} ${answer.statusText}`.trim();
    const reason = [status, text.trim().slice(0, 300)].filter(Boolean).join(": ");
    return { ok: false, text: `The viewer's server answered ${reason}` };
  }
}

export const messageOf = (/** @type {unknown} */ error) => (error instanceof Error ? error.message : String(error));

/** @param {string} address @param {object} data */
async function post(address, data) {
  const answer = await ask(address, {
    method: "POST",
    headers: { "content-type": "application/json", "x-smachpy-token": token ?? "" },
    body: JSON.stringify(data),
  });
  if (answer.wants_token) store.tokenAsked.value = true; // a restarted viewer has another token
  return answer;
}

/** Set the token. Returns false if there is none. @param {string} text the token, or an address that contains it */
export function takeToken(text) {
  const [, found] = /#token=([\w-]+)/.exec(text) ?? /^\s*([\w-]+)\s*$/.exec(text) ?? [];
  if (!found) return false;
  token = found;
  try {
    sessionStorage.setItem("smachpy.token", found);
  } catch {
    // without storage it is lost when the page is loaded again
  }
  store.tokenAsked.value = false;
  store.notify("Try again now");
  return true;
}

/** Check or send a goal, or cancel one. @param {object} data */
export const askAction = (data) => post("/api/action", data);

/** Show or hide the causes of the run's end. @param {boolean} [open] */
export async function showWhy(open = store.why.value === null) {
  const shown = store.facts.value?.epoch;
  const answer = open ? (whyOfFile ?? (await ask(link("why")))) : null;
  if (answer && "ok" in answer) store.notify(`Why: ${answer.text}`, "error");
  else if (shown === store.facts.value?.epoch) {
    store.why.value = /** @type {Why | null} */ (answer);
    if (answer) store.part.value = "log"; // the part in which a phone shows them
  }
}

/** Send a command to the machine shown. @param {string} name @param {Record<string, unknown>} [more] */
export async function command(name, more = {}) {
  if (store.whyDisarmed.value) {
    store.notify(store.whyDisarmed.value, "error");
    return false;
  }
  const result = await post(link("control"), { command: name, ...more });
  if (result.wants_token) return false; // the page asks for the token
  if (result.ok) store.notify(`${name}${more.path ? ` ${more.path}` : ""}: done`);
  else store.notify(`${name}: ${result.text ?? "refused"}`, "error");
  return result.ok;
}

// -- the list of runs ---------------------------------------------------------------------------

const REFRESH_MS = 2000; // shortest time between two lists of runs
let refreshed = -REFRESH_MS; // [ms]
/** @type {ReturnType<typeof setTimeout> | 0} */
let refreshDue = 0;

/** Request the list of runs, at once or when it is due. */
export function refreshRuns() {
  if (refreshDue) return;
  refreshDue = setTimeout(
    async () => {
      const answer = await ask("/api/runs");
      refreshed = performance.now();
      refreshDue = 0;
      batch(() => {
        store.runsProblem.value = Array.isArray(answer.runs) ? "" : (answer.text ?? "The runs cannot be listed.");
        if (Array.isArray(answer.runs)) store.runs.value = /** @type {any} */ (answer);
        store.runsKnown.value = true;
      });
    },
    Math.max(0, refreshed + REFRESH_MS - performance.now()),
  );
}

/** The live runs together. @returns {Promise<FleetRow[] | null>} */
export async function askFleet() {
  const answer = /** @type {any} */ (await ask("/api/fleet"));
  return Array.isArray(answer) ? answer : null;
}

/** Start a batch of simulated runs, or stop one. @param {object} data */
export async function askSimulation(data) {
  const answer = await post("/api/simulate", data);
  await refreshSimulations();
  return answer;
}

/** Request the batches of simulated runs. */
export async function refreshSimulations() {
  const answer = await ask("/api/simulations");
  if (Array.isArray(answer.batches)) store.simulations.value = /** @type {any} */ (answer);
}

/** Resume or cancel a durable mission. @param {Mission} mission @param {string} what */
export async function commandMission({ journal, id }, what) {
  const answer = await post("/api/mission", { journal, id, command: what });
  if (answer.ok) store.notify(`${id}: ${answer.text}`);
  else if (!answer.wants_token) store.notify(answer.text ?? `${what}: refused`, "error");
  refreshRuns();
}

/** Show a run of the list. @param {string} id */
export async function openRun(id) {
  const answer = await ask(`/api/open?run=${encoded(id)}`);
  if (!answer.ok) {
    store.notify(`Run: ${answer.text}`, "error");
    return;
  }
  showHome(false);
  if (answer.name !== store.facts.value?.name) choose(answer.name);
}

/** @param {boolean} open */
export function showHome(open) {
  store.homeOpen.value = open;
  const address = new URL(location.href);
  if (open) address.searchParams.set("runs", "");
  else address.searchParams.delete("runs");
  history.replaceState(null, "", address);
  if (open) refreshRuns();
}

/** @param {boolean} open */
export function showActions(open) {
  store.actionsOpen.value = open;
  const address = new URL(location.href);
  if (open) address.searchParams.set("actions", "");
  else address.searchParams.delete("actions");
  history.replaceState(null, "", address);
}
