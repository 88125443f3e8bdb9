"use strict";
(() => {
  // src/core/hub.ts
  var SILENT_BEATS = 2;
  var GONE_MS = 15e4;
  var OPEN_MS = 20;
  var TIDY_MS = 5e3;
  var RETRY_MS = 1e3;
  var MOST_FOLLOWED = 32;
  var HEAD = /^\{"name": ?("(?:[^"\\]|\\.)*")/;
  var Hub = class {
    isShared;
    #pages = /* @__PURE__ */ new Map();
    #stream = null;
    #names = [];
    // machines that the stream follows
    #lasts = /* @__PURE__ */ new Map();
    // newest event by machine
    #machines = /* @__PURE__ */ new Map();
    // the list, by name
    #settings = "";
    #actions = "";
    #standing = { state: "connecting", problem: "", wantsToken: false };
    #silence = 0;
    // half beats without a message
    #patience = SILENT_BEATS;
    // of an open stream [beats]; doubled when one was closed for its silence
    #watchdog;
    #due;
    /** @param where without a shared worker, a hidden page needs no stream */
    constructor({ isShared }) {
      this.isShared = isShared;
    }
    add(port) {
      this.#pages.set(port, { follow: null, heard: Date.now(), follows: "", hasAll: false });
      port.onmessage = ({ data }) => this.#take(port, data);
    }
    #take(port, told) {
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
    #greet(port) {
      if (this.#settings) port.postMessage({ event: "settings", text: this.#settings });
      port.postMessage({ event: "machines", text: JSON.stringify([...this.#machines.values()]) });
      if (this.#actions) port.postMessage({ event: "actions", text: this.#actions });
      port.postMessage({ event: "standing", standing: this.#standing });
    }
    #tellAll(message) {
      for (const [port, { follow }] of this.#pages) if (follow) port.postMessage(message);
    }
    /** The pages that are to get the events of their machine. */
    get #looking() {
      for (const [port, { heard }] of this.#pages) if (Date.now() - heard > GONE_MS) this.#pages.delete(port);
      return [...this.#pages.values()].filter(({ follow }) => follow && !follow.hidden);
    }
    /** Open a stream for what the pages follow now, in a moment. @param pause [ms] */
    #open(pause, anyway = false) {
      clearTimeout(this.#due);
      this.#due = setTimeout(() => this.#openNow(anyway), pause);
    }
    /** @param anyway also if it follows these machines already */
    #openNow(anyway) {
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
        const of = looking.filter(({ follows }) => follows === name).map(({ follow }) => follow);
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
    #listen(stream) {
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
    #remember(id) {
      const words = id.split(" ");
      if (!id || words.length !== this.#names.length) return;
      for (const [i, name] of this.#names.entries()) this.#lasts.set(name, decodeURIComponent(words[i]));
      for (const { follow, follows, hasAll } of this.#looking)
        if (follow && hasAll) follow.last = this.#lasts.get(follows) ?? follow.last;
    }
    #pass(event, text) {
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
      const all = [...this.#machines.values()].sort((a, b) => a.name < b.name ? -1 : 1);
      return (all.find((one) => one.stale === null) ?? all[0])?.name ?? "";
    }
    #set(state, problem = "", wantsToken = false) {
      const isSame = this.#standing.state === state && this.#standing.problem === problem;
      this.#standing = { state, problem, wantsToken };
      if (!isSame) this.#tellAll({ event: "standing", standing: this.#standing });
    }
    /** The server refused the stream: an EventSource does not tell why. */
    async #askWhy(address) {
      const limit = new AbortController();
      try {
        const answer = await fetch(address, { signal: limit.signal });
        if (!answer.ok) {
          const { text, wants_token } = await answer.json();
          this.#set("lost", text, wants_token === true);
        }
      } catch {
      }
      limit.abort();
      this.#open(RETRY_MS, true);
    }
    /**
     * Reconnect when the beats stay away: a broken connection shows no error for minutes. Beats are also missing while a
     * long message arrives over a slow link, so the next stream gets twice the time.
     * @param beat [s]
     */
    #watch(beat) {
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
  };
  function older(a, b) {
    const [i, j] = [a.lastIndexOf(":"), b.lastIndexOf(":")];
    if (!a || !b || a.slice(0, i) !== b.slice(0, j)) return "";
    return Number(a.slice(i + 1)) < Number(b.slice(j + 1)) ? a : b;
  }
  var encoded = (text) => encodeURIComponent(text.replace(/\p{Surrogate}/gu, "�"));

  // src/core/hub_worker.ts
  var hub = new Hub({ isShared: true });
  self.addEventListener("connect", (event) => hub.add(event.ports[0]));
})();
