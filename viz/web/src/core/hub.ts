// One stream of events for all pages of a browser, which opens only six connections to a server. It runs in a shared
// worker, or in the page itself where there are none.
//
// A page sends what it follows (`Follow`), "here" now and then, and "bye"; it gets the messages of the stream as texts
// (smachpy_viz.live.wire.STREAM) and the state of the connection. Every page of a machine gets all messages about it
// and leaves out what it has: a stream that begins anew for one of them brings a snapshot.

import type { MachineSummary } from "#core/types.ts";

const SILENT_BEATS = 2; // beats without a message after which a server counts as lost
const GONE_MS = 150_000; // a page that says nothing for so long is gone; hidden ones speak once a minute
const OPEN_MS = 20; // time to gather what pages follow before a stream is opened
const TIDY_MS = 5000; // time after which a stream no longer follows machines without a page
const RETRY_MS = 1000;
const MOST_FOLLOWED = 32; // as in smachpy_viz.live.streams
const HEAD = /^\{"name": ?("(?:[^"\\]|\\.)*")/;

/** Of a page: `last` is the newest event that it has, "" for none, `seen` the newest record of robot topics. */
export type Follow = { kind: "follow"; machine: string; last: string; seen: number; hidden: boolean };
export type Told = Follow | { kind: "here" } | { kind: "bye" } | { kind: "reconnect" };
/** Of the connection. */
export type Standing = { state: "connecting" | "live" | "lost"; problem: string; wantsToken: boolean };
export type Message = { event: string; text: string } | { event: "standing"; standing: Standing };
/** `follows` is the machine's name; `hasAll`: the page has got all its events up to now. */
export type Listener = { follow: Follow | null; heard: number; follows: string; hasAll: boolean };
export type Port = Pick<MessagePort, "postMessage" | "onmessage">;

export class Hub {
  isShared: boolean;
  #pages: Map<Port, Listener> = new Map();
  #stream: EventSource | null = null;
  #names: string[] = []; // machines that the stream follows
  #lasts: Map<string, string> = new Map(); // newest event by machine
  #machines: Map<string, MachineSummary> = new Map(); // the list, by name
  #settings = "";
  #actions = "";
  #standing: Standing = { state: "connecting", problem: "", wantsToken: false };
  #silence = 0; // half beats without a message
  #patience = SILENT_BEATS; // of an open stream [beats]; doubled when one was closed for its silence
  #watchdog: ReturnType<typeof setInterval> | undefined;
  #due: ReturnType<typeof setTimeout> | undefined;

  /** @param where without a shared worker, a hidden page needs no stream */
  constructor({ isShared }: { isShared: boolean }) {
    this.isShared = isShared;
  }

  add(port: Port) {
    this.#pages.set(port, { follow: null, heard: Date.now(), follows: "", hasAll: false });
    port.onmessage = ({ data }) => this.#take(port, data);
  }

  #take(port: Port, told: Told) {
    const page = this.#pages.get(port) ?? { follow: null, heard: 0, follows: "", hasAll: false };
    page.heard = Date.now();
    this.#pages.set(port, page);
    if (told.kind === "bye") {
      this.#pages.delete(port);
      this.#open(TIDY_MS);
    } else if (told.kind === "reconnect") {
      this.#standing = { state: "lost", problem: "", wantsToken: false };
      this.#tellAll({ event: "standing", standing: this.#standing });
      this.#open(0, true);
    } else if (told.kind === "follow") {
      const isNew = page.follow === null;
      page.follow = told;
      page.follows = told.machine;
      if (isNew && this.#stream?.readyState === 1) this.#greet(port);
      page.hasAll = told.last !== "" && this.#stream !== null && this.#lasts.get(told.machine) === told.last;
      if (told.hidden) this.#open(TIDY_MS);
      else if (!page.hasAll) this.#open(OPEN_MS, true);
    }
  }

  /** Tell a page what is the same for all. */
  #greet(port: Port) {
    if (this.#settings) port.postMessage({ event: "settings", text: this.#settings });
    port.postMessage({ event: "machines", text: JSON.stringify([...this.#machines.values()]) });
    if (this.#actions) port.postMessage({ event: "actions", text: this.#actions });
    port.postMessage({ event: "standing", standing: this.#standing });
  }

  #tellAll(message: Message) {
    for (const [port, { follow }] of this.#pages) if (follow) port.postMessage(message);
  }

  /** The pages that are to get the events of their machine. */
  get #looking(): Listener[] {
    for (const [port, { heard }] of this.#pages) if (Date.now() - heard > GONE_MS) this.#pages.delete(port);
    return [...this.#pages.values()].filter(({ follow }) => follow && !follow.hidden);
  }

  /** Open a stream for what the pages follow now, in a moment. @param pause [ms] */
  #open(pause: number, anyway: boolean = false) {
    clearTimeout(this.#due);
    this.#due = setTimeout(() => this.#openNow(anyway), pause);
  }

  /** @param anyway also if it follows these machines already */
  #openNow(anyway: boolean) {
    const looking = this.#looking;
    const first = this.#firstMachine();
    for (const page of looking) page.follows ||= first;
    const names = [...new Set(looking.map(({ follows }) => follows))].filter(Boolean).slice(0, MOST_FOLLOWED);
    const isSame = names.length === this.#names.length && names.every((name) => this.#names.includes(name));
    if (isSame && !anyway) return;
    this.#close();
    this.#names = names;
    this.#lasts.clear();
    if (!looking.length && (!this.isShared || !this.#pages.size)) return;
    const words = ["actions=1"];
    for (const name of names) {
      const of = looking.filter(({ follows }) => follows === name).map(({ follow }) => follow as Follow);
      const last = of.map((one) => one.last).reduce(older);
      words.push(`machine=${encoded(name)}`, `last=${encoded(last)}`);
      words.push(`seen=${last ? of.reduce((least, one) => Math.min(least, one.seen), Infinity) : -1}`);
      this.#lasts.set(name, last);
    }
    for (const page of looking) page.hasAll = page.follow?.last !== "" && names.includes(page.follows);
    this.#listen(new EventSource(`/api/events?${words.join("&")}`));
  }

  #close() {
    this.#stream?.close();
    this.#stream = null;
    clearInterval(this.#watchdog);
  }

  #listen(stream: EventSource) {
    this.#stream = stream;
    for (const event of ["settings", "beat", "machines", "actions", "facts", "snap", "observed", "gap", "events"])
      stream.addEventListener(event, (message) => {
        if (stream !== this.#stream) return;
        this.#silence = 0;
        this.#pass(event, message.data);
        this.#remember(message.lastEventId);
      });
    stream.onopen = () => this.#set("live");
    stream.onerror = () => {
      if (stream !== this.#stream) return;
      this.#set("lost");
      if (stream.readyState === 2) this.#askWhy(stream.url);
    };
    this.#watch(JSON.parse(this.#settings || "{}").beat);
  }

  /** Note how far the stream is, and with it the pages. @param id of a message */
  #remember(id: string) {
    const words = id.split(" ");
    if (!id || words.length !== this.#names.length) return;
    for (const [i, name] of this.#names.entries()) this.#lasts.set(name, decodeURIComponent(words[i]));
    for (const { follow, follows, hasAll } of this.#looking)
      if (follow && hasAll) follow.last = this.#lasts.get(follows) ?? follow.last;
  }

  #pass(event: string, text: string) {
    const message = { event, text };
    if (event === "beat") {
      this.#patience = SILENT_BEATS;
      this.#set("live");
    } else if (event === "settings") {
      this.#settings = text;
      this.#machines.clear();
      this.#watch(JSON.parse(text).beat);
    } else if (event === "actions") this.#actions = text;
    else if (event === "machines") {
      const { machines, gone } = JSON.parse(text);
      for (const one of machines) this.#machines.set(one.name, one);
      for (const name of gone) this.#machines.delete(name);
      message.text = JSON.stringify([...this.#machines.values()]);
      if (this.#looking.some(({ follows }) => !follows) && this.#firstMachine()) this.#open(0);
    } else {
      const name = JSON.parse(HEAD.exec(text)?.[1] ?? '""');
      for (const [port, page] of this.#pages) {
        if (!page.follow || page.follow.hidden || page.follows !== name) continue;
        page.hasAll ||= event === "snap";
        if (page.hasAll) port.postMessage(message);
      }
      return;
    }
    this.#tellAll(message);
  }

  /** The machine that a page shows which asks for none: as `smachpy_viz.live.machines.Machines.first`. */
  #firstMachine() {
    const all = [...this.#machines.values()].sort((a, b) => (a.name < b.name ? -1 : 1));
    return (all.find((one) => one.stale === null) ?? all[0])?.name ?? "";
  }

  #set(state: "live" | "lost", problem = "", wantsToken = false) {
    const isSame = this.#standing.state === state && this.#standing.problem === problem;
    this.#standing = { state, problem, wantsToken };
    if (!isSame) this.#tellAll({ event: "standing", standing: this.#standing });
  }

  /** The server refused the stream: an EventSource does not tell why. */
  async #askWhy(address: string) {
    const limit = new AbortController();
    try {
      const answer = await fetch(address, { signal: limit.signal });
      if (!answer.ok) {
        const { text, wants_token } = await answer.json();
        this.#set("lost", text, wants_token === true);
      }
    } catch {
      // no server: the page says so
    }
    limit.abort();
    this.#open(RETRY_MS, true);
  }

  /**
   * Reconnect when the beats stay away: a broken connection shows no error for minutes. Beats are also missing while a
   * long message arrives over a slow link, so the next stream gets twice the time.
   * @param beat [s]
   */
  #watch(beat: number) {
    clearInterval(this.#watchdog);
    this.#silence = 0;
    if (!(beat > 0)) return;
    this.#watchdog = setInterval(() => {
      const isOpen = this.#stream?.readyState === 1;
      this.#silence += 1;
      if (this.#silence <= 2 * (isOpen ? this.#patience : SILENT_BEATS)) return;
      if (isOpen) this.#patience *= 2;
      this.#set("lost");
      this.#open(0, true);
    }, beat * 500);
  }
}

/** The older one of two newest events; none is the oldest, as of two programs a snapshot is needed. */
function older(a: string, b: string) {
  const [i, j] = [a.lastIndexOf(":"), b.lastIndexOf(":")];
  if (!a || !b || a.slice(0, i) !== b.slice(0, j)) return "";
  return Number(a.slice(i + 1)) < Number(b.slice(j + 1)) ? a : b;
}

const encoded = (text: string) => encodeURIComponent(text.replace(/\p{Surrogate}/gu, "\ufffd"));
