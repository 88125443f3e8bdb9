// One machine's run: its state now and after each kept event, the spans of time in which its states ran, and the
// preempts. Times in spans are milliseconds since the epoch.

import { emptyState, foldOne, ms, RAISED, requestOf } from "#core/fold.ts";
import { countWhile, innermost } from "#core/lists.ts";
import type { EventOf, Preempt, PreemptedSpan, RunEvent, RunState, Span, Wait } from "#core/types.ts";

const KEYFRAME = 400; // events between two stored states: an earlier state is folded from at most this many

export class Run {
  base: string;
  now: RunState;
  events: RunEvent[] = [];
  spans: Span[] = [];
  preempts: { from: number; rows: PreemptedSpan[] }[] = []; // each with a row for every state that was asked to stop
  frames: string[] = []; // states as JSON, one before every KEYFRAME events
  waits: Wait[] = []; // times in which states were paused, or asked
  open: Map<string, Span> = new Map(); // spans of the running states, by path
  #waiting: Map<string, Wait> = new Map(); // the present waits, by path and kind
  begun: number | null = null;
  forgotten = 0; // number of the oldest events that were dropped

  /** @param base the state before the events */
  constructor(base: RunState | null | undefined, events: RunEvent[]) {
    this.base = JSON.stringify(base ?? emptyState());
    this.now = JSON.parse(this.base);
    this.#resume();
    this.push(events);
  }

  push(events: RunEvent[]) {
    for (const e of events) {
      if (this.events.length % KEYFRAME === 0) this.frames.push(JSON.stringify(this.now));
      this.events.push(e);
      this.#follow(e);
      foldOne(this.now, e);
    }
  }

  /** Drop the oldest events if there are more than `limit`, in whole blocks of KEYFRAME; returns their number. */
  trim(limit: number) {
    const blocks = Math.floor((this.events.length - limit) / KEYFRAME);
    if (blocks < 1) return 0;
    const gone = blocks * KEYFRAME;
    this.frames.splice(0, blocks);
    this.base = this.frames[0] ?? JSON.stringify(this.now);
    this.events.splice(0, gone);
    this.forgotten += gone;
    const first = this.events.length ? timeOf(this.events[0]) : Infinity;
    const kept = (span: Span) => (span.to === null ? this.open.get(span.path) === span : span.to >= first);
    this.spans = this.spans.filter(kept);
    this.waits = this.waits.filter((one) => one.to === null || one.to >= first);
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

  #openSpan(path: string, from: number): Span {
    const before = this.open.get(path);
    if (before) before.to = from; // its end is unknown: events were dropped
    const span = { path, from, to: null, outcome: null, preempt: null, asked: null, serviced: null, abandoned: null };
    this.open.set(path, span);
    this.spans.push(span);
    if (this.begun == null || from < this.begun) this.begun = from;
    return span;
  }

  #wait(path: string, kind: "paused" | "asks", from: number, text: string) {
    if (this.#waiting.has(`${kind} ${path}`)) return;
    const wait = { path, kind, from, to: null, text };
    this.waits.push(wait);
    this.#waiting.set(`${kind} ${path}`, wait);
  }

  #endWaits(path: string, to: number, kinds: ("paused" | "asks")[]) {
    for (const kind of kinds) {
      const wait = this.#waiting.get(`${kind} ${path}`);
      if (wait) wait.to = to;
      this.#waiting.delete(`${kind} ${path}`);
    }
  }

  /** What is told about visits besides their beginnings and ends. */
  #note(e: RunEvent, t: number) {
    const { path } = e;
    const span = this.open.get(path);
    switch (e.kind) {
      case "Paused":
        return this.#wait(path, "paused", t, e.reason === "pause" ? "paused" : `paused (${e.reason})`);
      case "QuestionAsked":
        return this.#wait(path, "asks", t, "asks");
      case "QuestionAnswered":
        return this.#endWaits(path, t, ["asks"]);
      case "Resumed":
        return this.#endWaits(path, t, ["paused"]);
      case "Entered":
      case "Left":
      case "Failed":
        return this.#endWaits(path, t, ["paused", "asks"]);
      case "Started":
      case "Finished":
        for (const wait of this.#waiting.values()) wait.to = t;
        return this.#waiting.clear();
      case "GoalSent":
        if (span) span.sent = { id: e.goal_id, goal: e.goal };
        return;
      case "Noted":
        if (span) span.note = e.text;
        return;
      case "Retried":
        if (span) span.attempt = e.attempt + 1;
    }
  }

  #follow(e: RunEvent) {
    const t = timeOf(e);
    this.#note(e, t);
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
      Object.assign(span, { to: t, outcome: (e.kind !== "Failed" && e.outcome) || RAISED });
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
   */
  #recover(e: EventOf<"Recovered">, t: number) {
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
   */
  preemptAt(t: number): Preempt | null {
    const found = this.preempts.findLast((one) => one.from <= t);
    if (!found) return null;
    const until = (at: number | null) => (at !== null && at <= t ? at : null);
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

  /** The newest visit of a state that had begun at an instant; null if there is none. @param t [ms] */
  visitAt(path: string, t: number = Infinity) {
    return this.spans.findLast((one) => one.path === path && one.from <= t) ?? null;
  }

  first() {
    return this.begun ?? (this.events.length ? timeOf(this.events[0]) : null);
  }
  last() {
    const newest = this.events.at(-1);
    return newest ? timeOf(newest) : this.begun;
  }

  /** The number of events up to and including the instant t [ms]. */
  indexAt(t: number) {
    return countWhile(this.events, (e) => timeOf(e) <= t);
  }

  /** The state after the first `count` events. */
  after(count: number): RunState {
    const frame = Math.min(Math.floor(count / KEYFRAME), this.frames.length - 1);
    if (frame < 0) return JSON.parse(this.base);
    const data = JSON.parse(this.frames[frame]);
    for (let i = frame * KEYFRAME; i < count; i++) foldOne(data, this.events[i]);
    return data;
  }

  /**
   * The userdata written during the last transition, and the state before it.
   * @param count number of events up to the instant shown
   */
  lastTransition(count: number) {
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

const timeOf = (e: RunEvent) => e.stamp_ns / 1e6;
