// Receives events, from a server or from the file that this page is, and sends requests to the server.

import { batch } from "@preact/signals";
import type { Message } from "#core/hub.ts";
import { Hub } from "#core/hub.ts";
import { pageOf, showPage } from "#core/pages.ts";
import { store } from "#core/store.ts";
import type {
  FleetRuns,
  MachineFacts,
  MachinePayload,
  MachineSummary,
  Mission,
  Observed,
  RunEvent,
  Snapshot,
  Why,
} from "#core/types.ts";
import type { Answers, BatchStarted, CheckedGoal, Done, Failure, GoalAccepted, StreamData } from "#core/wire.ts";

const CAUGHT_UP_MS = 1000; // time in which a new stream may bring old events
const RETRY_MS = 250; // time between two attempts to fetch a structure; it doubles
const LONGEST_RETRY_MS = 4000;
const ANSWER_MS = 3000; // time in which every command is answered, or has failed

let hub: Pick<MessagePort, "postMessage" | "onmessage"> | null = null; // the other end of this page's stream
let streamBegan = 0; // [ms]
let epoch = ""; // of the program whose events this page has
let newest = 0; // number of the newest of them
let seen = -1; // number of the newest record of robot topics
let isNew = false; // whether the last snapshot replaced what this page had
let loads = 0; // numbers the fetches of structures: only the newest one counts
let token: string | null = null; // for commands
let view = ""; // the token for reading
let onEvents: (events: RunEvent[]) => void = () => {};
let onMachine = () => {};
let onObserved: (records: Observed[]) => void = () => {};
let whyOfFile: Why | null = null;

/** Whether this page is a file that contains its run. */
export const isFile = () => document.getElementById("run-data") !== null;

/** The text in an element. @param id of an element with gzip data in base64 */
async function unpack(id: string) {
  const text = document.getElementById(id)?.textContent ?? "";
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain).text();
}

/** The bytes of zlib data in base64. */
export async function bytesOf(text: string) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(plain).arrayBuffer());
}

/** Start a worker: a file of the server, or a part of this page if that is a file. */
export async function makeWorker(name: "elk" | "film") {
  if (!isFile()) return new Worker(`/${name}-worker.js`);
  const code = await unpack(`${name}-data`);
  return new Worker(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
}

export async function connect(handlers: {
  onEvents: (events: RunEvent[]) => void;
  onMachine: () => void;
  onObserved: (records: Observed[]) => void;
  onView: (fragment: string) => void;
}) {
  ({ onEvents, onMachine, onObserved } = handlers);
  readToken();
  if (isFile()) {
    const run = JSON.parse(await unpack("run-data"));
    store.data.connection.value = "file";
    if (run.view && location.hash.length < 2) handlers.onView(String(run.view));
    await takeSnapshot(run.snap, run.model);
    onObserved(run.observed ?? []);
    store.data.statistics.value = run.statistics ?? null;
    whyOfFile = run.why ?? null;
    return;
  }
  await logIn();
  store.data.wanted.value = new URLSearchParams(location.search).get("machine") ?? "";
  showPage(pageOf(location.search), { replace: true });
  addEventListener("popstate", () => {
    const machine = new URLSearchParams(location.search).get("machine") ?? store.data.wanted.value;
    store.view.pageShown.value = pageOf(location.search);
    if (machine !== store.data.wanted.value) follow(machine);
  });
  openHub();
  tellHub();
}

/**
 * Read the token from the fragment of the address, which browsers do not send to servers, and remove it there, so that
 * a copied address does not contain it.
 */
export function readToken() {
  const words = new URLSearchParams(location.hash.slice(1));
  const given = words.get("token") || null;
  view = words.get("view") ?? "";
  words.delete("token");
  words.delete("view");
  try {
    if (given) sessionStorage.setItem("smachpy.token", given);
    token = given ?? sessionStorage.getItem("smachpy.token");
  } catch {
    token = given; // a page in a file has no storage
  }
  const rest = String(words);
  if (given || view) history.replaceState(null, "", location.pathname + location.search + (rest && `#${rest}`));
}

/** Get the cookie by which links, pictures and streams may read. */
async function logIn() {
  const known = token ?? view;
  if (known) await ask("/api/login", { method: "POST", body: JSON.stringify({ token: known }) });
}

export const hasToken = () => token !== null && store.data.settings.value.control;

/** Show the machine of that name. */
export function choose(name: string) {
  showPage("machine", { machine: name });
  if (name !== store.data.wanted.value || store.data.facts.value?.name !== name) follow(name);
}

/** Follow the machine of that name. */
function follow(name: string) {
  store.data.wanted.value = name;
  store.data.facts.value = null;
  store.data.statistics.value = null;
  epoch = "";
  newest = 0;
  seen = -1;
  loads += 1;
  tellHub();
}

/** A text for an address; without lone surrogates, at which encodeURIComponent would throw. */
export const encoded = (text: string) => encodeURIComponent(text.replace(/\p{Surrogate}/gu, "\ufffd"));

/** The address of a resource of a machine, by default the one shown. */
export const link = (what: string, more: string = "", machine = store.data.facts.value?.name ?? "") =>
  `/api/${what}?machine=${encoded(machine)}${more}`;

// -- the stream of events -----------------------------------------------------------------------

const HERE_MS = 20_000; // time between two signs of life for the hub

function openHub() {
  if (typeof SharedWorker === "undefined") {
    const { port1, port2 } = new MessageChannel();
    new Hub({ isShared: false }).add(port1);
    hub = port2;
  } else hub = new SharedWorker("/hub-worker.js", "smachpy").port;
  hub.onmessage = ({ data }: MessageEvent<Message>) => takeMessage(data);
  setInterval(() => hub?.postMessage({ kind: "here" }), HERE_MS);
  document.addEventListener("visibilitychange", tellHub);
  addEventListener("pageshow", (e) => e.persisted && tellHub());
  addEventListener("pagehide", () => hub?.postMessage({ kind: "bye" }));
}

/** Tell the hub what this page follows, and what it has. A hidden page gets only the list of machines. */
function tellHub() {
  streamBegan = performance.now();
  const last = epoch ? `${epoch}:${newest}` : "";
  hub?.postMessage({ kind: "follow", machine: store.data.wanted.value, last, seen, hidden: document.hidden });
}

/** What a page gets of the stream: the hub makes a list of the changes of the list. */
type Taken = Omit<StreamData, "machines"> & { machines: MachineSummary[] };

const TAKERS: { [K in keyof Taken]: (data: Taken[K]) => unknown } = {
  settings(settings) {
    streamBegan = performance.now();
    const asked = new URLSearchParams(location.search);
    if (
      settings.home &&
      !store.data.settings.value.home &&
      !asked.has("machine") &&
      pageOf(location.search) === "machine"
    )
      showPage("runs", { replace: true });
    store.data.settings.value = settings;
  },
  beat: (t) => store.data.viewerLag.measure(t),
  machines(list) {
    store.data.machines.value = list.sort((a, b) => (a.name < b.name ? -1 : 1));
  },
  actions(found) {
    store.data.actions.value = found;
  },
  facts: takeFacts,
  snap: takeStreamed,
  gap({ missed }) {
    if (isNew) store.data.gap.value = missed;
  },
  observed({ records }) {
    const unknown = records.filter(({ n }) => (n ?? 0) > seen);
    for (const { n } of unknown) seen = Math.max(seen, n ?? 0);
    onObserved(unknown);
  },
  events: (told) => told.epoch === epoch && takeNew(told),
};

function takeMessage(message: Message) {
  if ("standing" in message) {
    const { state, problem, wantsToken } = message.standing;
    store.data.connection.value = state;
    store.data.problem.value = problem;
    if (wantsToken) store.view.tokenAsked.value = true;
  } else (TAKERS as Record<string, (data: unknown) => unknown>)[message.event]?.(JSON.parse(message.text));
}

function takeNew({ seq, events }: { seq: number; events: RunEvent[] }) {
  const unknown = events.filter((one) => one.seq > newest);
  newest = Math.max(newest, seq);
  if (!unknown.length) return;
  if (performance.now() - streamBegan > CAUGHT_UP_MS)
    store.data.robotLag.measure(unknown[unknown.length - 1].stamp_ns / 1e6);
  onEvents(unknown);
}

/**
 * Take a snapshot of the stream. One that came for another page of the browser only adds what this page has not seen.
 */
function takeStreamed(snapshot: Snapshot) {
  const [first] = snapshot.events;
  isNew = snapshot.epoch !== epoch || !first || first.seq - (first.dropped ?? 0) > newest + 1;
  if (isNew && snapshot.epoch === epoch && snapshot.seq === newest) isNew = false;
  if (!isNew) {
    takeFacts(snapshot);
    takeNew(snapshot);
    return;
  }
  epoch = snapshot.epoch;
  newest = snapshot.seq;
  seen = -1;
  takeSnapshot(snapshot);
}

/** Open a new stream that continues after the last message. */
export const reconnect = () => hub?.postMessage({ kind: "reconnect" });

async function takeFacts(facts: MachineFacts) {
  const before = store.data.facts.value;
  store.data.facts.value = facts;
  if (before && before.revision !== facts.revision && before.epoch === facts.epoch) await load(facts);
}

async function takeSnapshot(snapshot: Snapshot, payload?: MachinePayload) {
  store.data.wanted.value ||= snapshot.name;
  const known = store.data.facts.value;
  // Another snapshot of the same program, after a gap: its structure need not be fetched again.
  const same = known?.name === snapshot.name && known.epoch === snapshot.epoch;
  if (!same) {
    store.data.robotLag.forget();
    store.data.why.value = null;
  }
  batch(() => {
    store.data.facts.value = snapshot;
    store.data.problems.value = snapshot.problems;
    store.startRun(snapshot.base, snapshot.events);
    store.playback.renew();
  });
  if (payload) {
    store.view.setModel(payload);
    onMachine();
  } else if (same && store.data.model.value && known.revision === snapshot.revision) onEvents([]);
  else await load(snapshot);
}

/** Fetch the structure of a machine; try again until it comes or another fetch begins. */
async function load(facts: MachineFacts) {
  loads += 1;
  const mine = loads;
  let payload: MachinePayload | null = null;
  for (let pause = RETRY_MS; !payload; pause = Math.min(2 * pause, LONGEST_RETRY_MS)) {
    payload = await fetchModel(facts.name);
    if (!payload) await new Promise((done) => setTimeout(done, pause));
    if (mine !== loads) return;
  }
  store.view.setModel(payload);
  onMachine();
  const statistics = await ask<Answers["GET /api/statistics"]>(link("statistics"));
  if (mine !== loads) return;
  if (isFailure(statistics)) store.view.notify(`Recorded runs: ${statistics.text}`, "error");
  store.data.statistics.value = isFailure(statistics) ? null : statistics;
}

async function fetchModel(name: string): Promise<MachinePayload | null> {
  try {
    const answer = await fetch(`/api/model?machine=${encoded(name)}`);
    return answer.ok ? await answer.json() : null;
  } catch {
    return null; // the page already shows a lost connection
  }
}

// -- questions and commands ---------------------------------------------------------------------

/** The JSON answer of the server, or an error in the same form. */
export async function ask<T>(address: string, options: RequestInit = {}): Promise<T | Failure> {
  let answer: Response;
  let text: string;
  try {
    answer = await fetch(address, options);
    text = await answer.text();
  } catch (error) {
    return failure(`The viewer's server does not answer (${messageOf(error)}).`);
  }
  try {
    return JSON.parse(text);
  } catch {
    const status = `${answer.status} ${answer.statusText}`.trim();
    const reason = [status, text.trim().slice(0, 300)].filter(Boolean).join(": ");
    return failure(`The viewer's server answered ${reason}`);
  }
}

const failure = (text: string): Failure => ({ ok: false, text, wants_token: false, problems: [] });

export const isFailure = (answer: unknown): answer is Failure =>
  typeof answer === "object" && answer !== null && "ok" in answer && answer.ok === false;

export const messageOf = (error: unknown) => (error instanceof Error ? error.message : String(error));

/** Send a command. After 3 s without an answer it counts as failed, as nobody watches a button for longer. */
export async function post<T extends { ok: true }>(address: string, data: object): Promise<T | Failure> {
  const limit = new AbortController();
  const timer = setTimeout(() => limit.abort(), ANSWER_MS);
  const answer = await ask<T>(address, {
    method: "POST",
    headers: { "content-type": "application/json", "x-smachpy-token": token ?? "" },
    body: JSON.stringify(data),
    signal: limit.signal,
  });
  clearTimeout(timer);
  if (limit.signal.aborted)
    return failure(`no answer in ${ANSWER_MS / 1000} s; it may still be carried out: look at the machine.`);
  if (isFailure(answer) && answer.wants_token) store.view.tokenAsked.value = true; // a new viewer's is another one
  return answer;
}

/** Set the token. Returns false if there is none. @param text the token, or an address that contains it */
export function takeToken(text: string) {
  const [, found] = /#token=([\w-]+)/.exec(text) ?? /^\s*([\w-]+)\s*$/.exec(text) ?? [];
  if (!found) return false;
  token = found;
  try {
    sessionStorage.setItem("smachpy.token", found);
  } catch {
    // without storage it is lost when the page is loaded again
  }
  store.view.tokenAsked.value = false;
  logIn().then(reconnect);
  store.view.notify("Try again now");
  return true;
}

/** Check or send a goal, or cancel one. */
export const askAction = (data: object) => post<CheckedGoal | GoalAccepted | Done>("/api/action", data);

/** Show or hide the causes of the run's end. */
export async function showWhy(open: boolean = store.data.why.value === null) {
  const shown = store.data.facts.value?.epoch;
  const answer = open ? (whyOfFile ?? (await ask<Answers["GET /api/why"]>(link("why")))) : null;
  if (isFailure(answer)) store.view.notify(`Why: ${answer.text}`, "error");
  else if (shown === store.data.facts.value?.epoch) {
    store.data.why.value = answer;
    if (answer) store.view.part.value = "log"; // the part in which a phone shows them
  }
}

// -- the list of runs ---------------------------------------------------------------------------

const REFRESH_MS = 2000; // shortest time between two lists of runs
let refreshed = -REFRESH_MS; // [ms]
let refreshDue: ReturnType<typeof setTimeout> | 0 = 0;

/** Request the list of runs, at once or when it is due. */
export function refreshRuns() {
  if (refreshDue) return;
  refreshDue = setTimeout(
    async () => {
      const answer = await ask<Answers["GET /api/runs"]>("/api/runs");
      refreshed = performance.now();
      refreshDue = 0;
      batch(() => {
        store.data.runsProblem.value = isFailure(answer) ? answer.text : "";
        if (!isFailure(answer)) store.data.runs.value = answer;
        store.data.runsKnown.value = true;
      });
    },
    Math.max(0, refreshed + REFRESH_MS - performance.now()),
  );
}

/** Some of the live runs together: those after the first `skip`. */
export async function askFleet(skip: number): Promise<FleetRuns | null> {
  const answer = await ask<Answers["GET /api/fleet"]>(`/api/fleet?skip=${skip}`);
  return isFailure(answer) ? null : answer;
}

/** Start a batch of simulated runs, or stop one. */
export async function askSimulation(data: object) {
  const answer = await post<Done | BatchStarted>("/api/simulate", data);
  await refreshSimulations();
  return answer;
}

/** Request the batches of simulated runs. */
export async function refreshSimulations() {
  const answer = await ask<Answers["GET /api/simulations"]>("/api/simulations");
  if (!isFailure(answer)) store.data.simulations.value = answer;
}

/** Resume or cancel a durable mission. */
export async function commandMission({ journal, id }: Mission, what: string) {
  const answer = await post<Done>("/api/mission", { journal, id, command: what });
  if (answer.ok) store.view.notify(`${id}: ${answer.text}`);
  else if (!answer.wants_token) store.view.notify(answer.text, "error");
  refreshRuns();
}

/** Show a run of the list. */
export async function openRun(id: string) {
  const answer = await ask<Answers["GET /api/open"]>(`/api/open?run=${encoded(id)}`);
  if (!answer.ok) {
    store.view.notify(`Run: ${answer.text}`, "error");
    return;
  }
  choose(answer.name);
}
