// What runs at the instant shown, and how the run stands.

import { computed } from "@preact/signals";
import { innermost } from "#core/lists.ts";
import { isInCleanup } from "#core/model.ts";
import { outcomeClass } from "#core/outcomes.ts";
import type { Data } from "#core/store/data.ts";
import type { Playback } from "#core/store/playback.ts";
import type { GoalRun, RunState } from "#core/types.ts";

export class Status {
  #data: Data;
  #playback: Playback;

  constructor(data: Data, playback: Playback) {
    this.#data = data;
    this.#playback = playback;
  }

  readonly activePaths = computed(() => {
    this.#playback.watch();
    return Object.entries(this.#playback.shown().states)
      .filter(([, state]) => state.since != null)
      .map(([path]) => path);
  });

  readonly activeLeaves = computed(() => innermost(this.activePaths.value, (path) => path));

  /** The running innermost states; after the end of a run, the innermost state that was left last. */
  readonly lastLeaves = computed(() => {
    if (this.activeLeaves.value.length) return this.activeLeaves.value;
    const left = Object.entries(this.#playback.shown().states).filter(([, state]) => state.left != null);
    if (!left.length) return [];
    const depth = (path: string) => path.split("/").length;
    // Containers are left after the state inside, so the last one left is a container around it.
    const [last] = left.reduce((a, b) => ((b[1].left ?? 0) > (a[1].left ?? 0) ? b : a));
    const entered = (this.#data.run.visitAt(last)?.from ?? 0) * 1e6; // [ns]
    const isWithin = (path: string, top: string) => `${path}/`.startsWith(`${top}/`);
    const inside = left.filter(([path, state]) => isWithin(path, last) && (state.left ?? 0) >= entered);
    const end = innermost(inside, ([path]) => path);
    const newest = end.reduce((a, b) => {
      const later = (b[1].left ?? 0) - (a[1].left ?? 0);
      return later > 0 || (later === 0 && depth(b[0]) > depth(a[0])) ? b : a;
    });
    return [newest[0]];
  });

  readonly runStatus = computed(() => {
    this.#playback.watch();
    const data = this.#playback.shown();
    const about = this.#data.facts.value;
    const connection = this.#data.connection.value;
    const cutShort = data.ended == null && data.started != null;
    if (!about) return { word: "waiting", kind: "other" };
    if (this.#playback.cursor.value !== null) return { word: "replay", kind: "preempted" };
    if (connection === "file" && cutShort) return { word: "recording ends here", kind: "active" };
    if (about.stale != null && data.ended == null) return { word: "stale", kind: "waiting" };
    if (connection === "lost") return { word: "reconnecting", kind: "waiting" };
    if (data.ended != null) return { word: `ended: ${data.outcome}`, kind: outcomeClass(data.outcome) };
    if (asks(data)) return { word: "asks you", kind: "waiting" };
    if (about.control?.paused) return { word: this.#pausedText(data), kind: "waiting" };
    const { model } = this.#data;
    const isTidying = this.activeLeaves.value.some((path) => isInCleanup(model.value?.get(path)));
    const isAsked = data.states[model.value?.root.path ?? ""]?.preempt;
    if (isTidying) return { word: "tidying up", kind: isAsked ? "preempted" : "active" };
    if (isAsked) return { word: "preempting", kind: "preempted" };
    if (data.started == null) return { word: "not started", kind: "other" };
    return { word: about.recorded ? "recording ends here" : "running", kind: "active" };
  });

  /** The paused state and the reason, as text. */
  #pausedText(data: RunState) {
    const held = Object.entries(data.states).filter(([, state]) => state.waits != null);
    if (!held.length) return "paused";
    const [path, state] = held[0];
    const why = state.waits === "pause" ? "" : ` (${state.waits})`;
    return `paused before ${this.#data.nameOf(path)}${held.length > 1 ? ` and ${held.length - 1} more` : ""}${why}`;
  }

  /** Why commands are disabled; null if they are not. */
  readonly whyDisarmed = computed(() => {
    if (this.#playback.cursor.value !== null) return "You look at the past: back to live first (l)";
    if (this.#data.connection.value === "lost") return "The viewer's server does not answer";
    return this.#data.facts.value?.stale == null ? null : "The mission's program does not answer";
  });

  /** Whether a goal seems to wait for a server. A server behind a bridge has no token and shows only by its answers. */
  hasNoServer(goal: GoalRun | null | undefined) {
    const { serversSeen, connection, facts, run } = this.#data;
    if (serversSeen.value === null || !goal || goal.ended != null || goal.feedback != null) return false;
    if (connection.value !== "live" || this.#playback.cursor.value !== null) return false;
    if (facts.value?.stale != null || facts.value?.recorded) return false;
    const plain = (name: string) => name.replace(/^\//, "");
    const name = plain(goal.action);
    const [there, gone] = JSON.parse(serversSeen.value);
    if (there.includes(name)) return false;
    if (gone.includes(name)) return true;
    const answered = (one: GoalRun) => plain(one.action) === name && (one.feedback != null || one.result != null);
    return !Object.values(run.now.goals).some(answered);
  }
}

/** Whether a question is open. */
const asks = (data: RunState) =>
  Object.values(data.states).some(({ since, question }) => since != null && question?.answered === null);
