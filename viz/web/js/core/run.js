// One machine's run: its state now and after each kept event, the spans of time in which its states ran, and the
// preempts. Times in spans are milliseconds since the epoch.
import { emptyState, foldOne, ms, RAISED, requestOf } from "#core/fold.js";
import { countWhile, innermost } from "#core/lists.js";

const KEYFRAME = 400; // events between two stored states: an earlier state is folded from at most this many

export class Run {
  /** @type {RunEvent[]} */
  events = [];
  /** @type {Span[]} */
  spans = [];
  /** @type {{ from: number, rows: PreemptedSpan[] }[]} */
  preempts = []; // each with a row for every state that was asked to stop
  /** @type {string[]} */
  frames = []; // states as JSON, one before every KEYFRAME events
  /** @type {Map<string, Span>} */
  open = new Map(); // spans of the running states, by path
  /** @type {number | null} */
  begun = null;
  forgotten = 0; // number of the oldest events that were dropped

  /**
   * @param {RunState | null | undefined} base the state before the events
   * @param {RunEvent[]} events
   */
  constructor(base, events) {
    this.base = JSON.stringify(base ?? emptyState());
    /** @type {RunState} */
    this.now = JSON.parse(this.base);
    this.#resume();
    this.push(events);
  }

  /** @param {RunEvent[]} events */
  push(events) {
    for (const e of events) {
      if (this.events.length % KEYFRAME === 0) this.frames.push(JSON.stringify(this.now));
      this.events.push(e);
      this.#follow(e);
      foldOne(this.now, e);
    }
  }

  /**
   * Drop the oldest events if there are more than `limit`, in whole blocks of KEYFRAME; returns their number.
   * @param {number} limit
   */
  trim(limit) {
    const blocks = Math.floor((this.events.length - limit) / KEYFRAME);
    if (blocks < 1) return 0;
    const gone = blocks * KEYFRAME;
    this.frames.splice(0, blocks);
    this.base = this.frames[0] ?? JSON.stringify(this.now);
    this.events.splice(0, gone);
    this.forgotten += gone;
    const first = this.events.length ? timeOf(this.events[0]) : Infinity;
    const kept = (/** @type {Span} */ span) =>
      span.to === null ? this.open.get(span.path) === span : span.to >= first;
    this.spans = this.spans.filter(kept);
    this.preempts = this.preempts.filter((one) => one.rows.some(kept));
    this.begun = this.spans.reduce((least, span) => Math.min(least, span.from), first);
    return gone;
  }

  /** Open spans for the states that run in the base, and the preempt of some of them. */
  #resume() {
    const rows = [];
    for (const [path, state] of Object.entries(this.now.states)) {
      if (state.since == null) continue;
      const span = this.#openSpan(path, state.since / 1e6);
      if (state.preempt == null) continue;
      rows.push(
        Object.assign(span, {
          preempt: state.preempt / 1e6,
          asked: state.asked ?? null,
          serviced: ms(state.serviced),
          abandoned: ms(state.abandoned),
        }),
      );
    }
    rows.sort((a, b) => a.preempt - b.preempt);
    if (rows.length) this.preempts.push({ from: rows[0].preempt, rows });
  }

  /** @param {string} path @param {number} from @returns {Span} */
  #openSpan(path, from) {
    const before = this.open.get(path);
    if (before) before.to = from; // its end is unknown: events were dropped
    const span = { path, from, to: null, outcome: null, preempt: null, asked: null, serviced: null, abandoned: null };
    this.open.set(path, span);
    this.spans.push(span);
    if (this.begun == null || from < this.begun) this.begun = from;
    return span;
  }

  /** @param {RunEvent} e */
  #follow(e) {
    const t = timeOf(e);
    if (e.kind === "Recovered") this.#recover(e, t);
    if (e.kind === "Started" || e.kind === "Entered") {
      if (e.kind === "Started") {
        for (const span of this.open.values()) span.to = t; // left open by a run that was cut off
        this.open.clear();
      }
      this.#openSpan(e.path, t);
      return;
    }
    const span = this.open.get(e.path);
    if (!span) return;
    if (e.kind === "Left" || e.kind === "Failed" || e.kind === "Finished") {
      Object.assign(span, { to: t, outcome: e.outcome || RAISED });
      this.open.delete(e.path);
    } else if (e.kind === "PreemptRequested" && span.preempt === null) {
      const row = Object.assign(span, { preempt: t, asked: requestOf(e) });
      const last = this.preempts.at(-1);
      if (last?.rows.some((one) => one.to === null && this.open.get(one.path) === one)) last.rows.push(row);
      else this.preempts.push({ from: t, rows: [row] });
    } else if (e.kind === "PreemptServiced" && span.preempt !== null) span.serviced = t;
    else if (e.kind === "Abandoned" && span.preempt !== null) span.abandoned = t;
  }

  /**
   * Continue the spans that the resumed mission is in, even if the end of its process had ended them. The outcome of
   * the others is unknown.
   * @param {RunEvent} e @param {number} t
   */
  #recover(e, t) {
    const active = new Map(e.active);
    for (const [path, span] of this.open) {
      if (active.has(path)) continue;
      span.to = t;
      this.open.delete(path);
    }
    for (const [path, since] of active) {
      if (this.open.has(path)) continue;
      const last = this.spans.findLast((span) => span.path === path);
      if (last?.to != null && last.to * 1e6 >= since) {
        Object.assign(last, { to: null, outcome: null, preempt: null, asked: null, serviced: null, abandoned: null });
        this.open.set(path, last);
      } else this.#openSpan(path, since / 1e6);
    }
  }

  /**
   * The newest preempt at the instant t [ms], as it was then; null if there is none.
   * `holds` are the innermost states that were asked and still run.
   * @param {number} t
   * @returns {Preempt | null}
   */
  preemptAt(t) {
    const found = this.preempts.findLast((one) => one.from <= t);
    if (!found) return null;
    const until = (/** @type {number | null} */ at) => (at !== null && at <= t ? at : null);
    const rows = found.rows
      .filter((row) => row.preempt <= t)
      .map((row) => ({
        ...row,
        to: until(row.to),
        serviced: until(row.serviced),
        abandoned: until(row.abandoned),
      }));
    const running = rows.filter((row) => row.to === null);
    const holds = innermost(running, (row) => row.path);
    const to = running.length ? null : Math.max(...rows.map((row) => row.to ?? t));
    return { from: found.from, to, rows, holds };
  }

  first() {
    return this.begun ?? (this.events.length ? timeOf(this.events[0]) : null);
  }
  last() {
    const newest = this.events.at(-1);
    return newest ? timeOf(newest) : this.begun;
  }

  /**
   * The number of events up to and including the instant t [ms].
   * @param {number} t
   */
  indexAt(t) {
    return countWhile(this.events, (e) => timeOf(e) <= t);
  }

  /**
   * The state after the first `count` events.
   * @param {number} count
   * @returns {RunState}
   */
  after(count) {
    const frame = Math.min(Math.floor(count / KEYFRAME), this.frames.length - 1);
    if (frame < 0) return JSON.parse(this.base);
    const data = JSON.parse(this.frames[frame]);
    for (let i = frame * KEYFRAME; i < count; i++) foldOne(data, this.events[i]);
    return data;
  }

  /**
   * The userdata written during the last transition, and the state before it.
   * @param {number} count number of events up to the instant shown
   */
  lastTransition(count) {
    const ends = ["Left", "Failed", "Finished", "Started", "Recovered"];
    let end = count - 1; // of the transition: the newest event that ends a state
    while (end > 0 && !ends.includes(this.events[end]?.kind)) end--;
    let begin = end - 1;
    while (begin > 0 && !["Left", "Failed", "Started", "Recovered"].includes(this.events[begin]?.kind)) begin--;
    begin = Math.max(0, begin);
    const writes = this.events.slice(begin, count).filter((e) => e.kind === "UserdataWritten");
    return { before: this.after(begin), writes };
  }
}

const timeOf = (/** @type {RunEvent} */ e) => e.stamp_ns / 1e6;
