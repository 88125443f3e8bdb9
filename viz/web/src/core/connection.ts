// Receives events, from a server or from the file that this page is.

import { batch } from "@preact/signals";
import type { Message } from "#core/hub.ts";
import { Hub } from "#core/hub.ts";
import { isFile, unpack } from "#core/page_file.ts";
import { pageOf, showPage } from "#core/pages.ts";
import { ask, encoded, isFailure, link, logIn, readToken, setToken } from "#core/requests.ts";
import { notesOf, readNotes } from "#core/shared_notes.ts";
import { store } from "#core/store.ts";
import type { MachineFacts, MachinePayload, MachineSummary, Observed, RunEvent, Snapshot, Why } from "#core/types.ts";
import type { Answers, StreamData } from "#core/wire.ts";

const CAUGHT_UP_MS = 1000; // time in which a new stream may bring old events
const RETRY_MS = 250; // time between two attempts to fetch a structure; it doubles
const LONGEST_RETRY_MS = 4000;

let hub: Pick<MessagePort, "postMessage" | "onmessage"> | null = null; // the other end of this page's stream
let streamBegan = 0; // [ms]
let epoch = ""; // of the program whose events this page has
let newest = 0; // number of the newest of them
let seen = -1; // number of the newest record of robot topics
let isNew = false; // whether the last snapshot replaced what this page had
let loads = 0; // numbers the fetches of structures: only the newest one counts
let onEvents: (events: RunEvent[]) => void = () => {};
let onMachine = () => {};
let onObserved: (records: Observed[]) => void = () => {};
let whyOfFile: Why | null = null;

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
    store.notes.shared.value = notesOf(run.notes ?? []);
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
  if (before && (before.noted !== facts.noted || before.epoch !== facts.epoch)) readNotes();
  if (before && before.revision !== facts.revision && before.epoch === facts.epoch) await load(facts);
}

async function takeSnapshot(snapshot: Snapshot, payload?: MachinePayload) {
  store.data.wanted.value ||= snapshot.name;
  const known = store.data.facts.value;
  // Another snapshot of the same program, after a gap: its structure need not be fetched again.
  const same = known?.name === snapshot.name && known.epoch === snapshot.epoch;
  if (!same) {
    if (!payload) store.notes.shared.value = [];
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
  readNotes();
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

/** Take another token, and open the stream with it. Returns false if there is none in the text. */
export function takeToken(text: string) {
  if (!setToken(text)) return false;
  store.view.tokenAsked.value = false;
  logIn().then(reconnect);
  store.view.notify("Try again now");
  return true;
}

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
