// What the server, or the file that the page is, told: the machine shown, its run up to now, the other machines, the
// list of runs.

import type { Signal } from "@preact/signals";
import { computed, signal } from "@preact/signals";
import { emptyState, ms } from "#core/fold.ts";
import { innermost } from "#core/lists.ts";
import type { Model } from "#core/model.ts";
import { Marks } from "#core/playback.ts";
import { Run } from "#core/run.ts";
import { robotOf, Scene } from "#core/scene.ts";
import { shorten } from "#core/text.ts";
import type {
  ActionsSeen,
  Batch,
  Comparison,
  MachineFacts,
  MachineSummary,
  Observed,
  Problem,
  RunEvent,
  RunRow,
  RunState,
  Settings,
  Statistics,
  Why,
} from "#core/types.ts";
import { wayOf } from "#core/why.ts";

export class Data {
  readonly connection: Signal<"connecting" | "live" | "lost" | "file"> = signal("connecting");
  readonly problem = signal(""); // why the server refuses this page a stream
  readonly settings: Signal<Settings> = signal({
    follow: false,
    control: false,
    beat: 0,
    kept: 0,
    home: false,
    reproduces: false,
  });
  readonly machines: Signal<MachineSummary[]> = signal([]);
  readonly wanted = signal(""); // name of the machine to show
  readonly facts: Signal<MachineFacts | null> = signal(null); // of the machine shown
  readonly problems: Signal<Problem[]> = signal([]);
  readonly model: Signal<Model | null> = signal(null);
  readonly statistics: Signal<Statistics | null> = signal(null);
  readonly gap: Signal<number | null> = signal(null); // number of events that this page missed
  /** Null before they are known. */
  readonly actions: Signal<ActionsSeen | null> = signal(null);
  readonly comparison: Signal<Comparison | null> = signal(null);
  readonly failure: Signal<string | null> = signal(null); // why nothing is shown
  readonly why: Signal<Why | null> = signal(null); // the causes of the run's end, while they are shown
  /** The ends of states that led to the outcome. */
  readonly wayShown = computed(() => wayOf(this.why.value));
  readonly runs: Signal<{ runs: RunRow[]; folders: string[]; journals: { name: string; problem: string }[] }> = signal({
    runs: [],
    folders: [],
    journals: [],
  });
  readonly runsKnown = signal(false);
  readonly runsProblem = signal(""); // why the runs cannot be listed
  readonly simulations: Signal<{ missions: Record<string, string>; batches: Batch[] }> = signal({
    missions: {},
    batches: [],
  });

  readonly simulationsKnown = signal(false);

  run = new Run(emptyState(), []);
  scene = new Scene();
  marks = new Marks(); // targets of jumps
  readonly robotLag = new Lag();
  readonly viewerLag = new Lag();
  #lostAt = 0; // when the server was lost, on this clock [ms]

  constructor() {
    this.connection.subscribe((state) => {
      if (state === "live") this.#lostAt = 0;
      else if (state === "lost") this.#lostAt ||= Date.now();
    });
  }

  startRun(base: RunState | null, events: RunEvent[]) {
    this.run = new Run(base, events);
    this.scene = new Scene();
    this.scene.addEvents(events);
    this.marks = new Marks();
    this.marks.push(events);
    this.gap.value = null;
  }

  /** Add new events; drop the oldest if there are more than the server keeps. Returns the number of those. */
  addEvents(events: RunEvent[]) {
    this.run.push(events);
    this.scene.addEvents(events);
    this.marks.push(events);
    const gone = this.run.trim(this.settings.value.kept || Infinity);
    if (gone) this.marks.forget(gone);
    return gone;
  }

  /** Add records of robot topics. */
  addObserved(records: Observed[]) {
    this.scene.addObserved(records);
  }

  /**
   * The present, or the end of a run that is over, on the robot's clock [ms since the epoch]. It stands still when the
   * server is lost, and at the last sign of life of a program that is gone.
   */
  liveMs() {
    const { run } = this;
    const about = this.facts.value;
    const isOver = run.now.ended != null || about?.recorded || this.connection.value === "file";
    const behind = ms(about?.behind) ?? 0;
    const lag = this.robotLag.value ?? (this.viewerLag.value ?? 0) + behind;
    const robot = about?.stale == null ? (this.#lostAt || Date.now()) - lag : about.stale / 1e6 - behind;
    return isOver ? (run.last() ?? robot) : Math.max(robot, run.last() ?? 0);
  }

  /** Whether there is nothing to show, nor on its way: no machine runs, or none with the name asked for. */
  readonly isMissing = computed(() => {
    if (this.connection.value !== "live" || this.model.value) return false;
    const wanted = this.wanted.value;
    return !this.machines.value.length || (wanted !== "" && !this.machines.value.some(({ name }) => name === wanted));
  });

  /** The running innermost states now, independent of the instant shown. */
  runningLeaves() {
    const { states } = this.run.now;
    const paths = Object.keys(states).filter((path) => states[path].since != null);
    return innermost(paths, (path) => path);
  }

  /** The names of the robots that the machine shown drives: the namespaces of its actions, or its own. */
  robotNames() {
    const names = new Set(Object.values(this.run.now.goals).map((goal) => robotOf(goal.action)));
    for (const name of this.scene.robots.keys()) names.add(name);
    names.delete("");
    const own = this.facts.value?.name.split("/").slice(0, -1).join("/");
    return names.size || !own ? [...names].sort() : [own];
  }

  /** The name of a state, with that of its container if several states have it. */
  nameOf(path: string) {
    const node = this.model.value?.get(path);
    if (!node) return shorten(path.slice(path.lastIndexOf("/") + 1));
    return node.isRepeated && node.parent?.parent ? `${node.parent.name} \u203a ${node.name}` : node.name;
  }

  /**
   * Names of the actions that have a server and of those that had one; null before they are known. As JSON text, so
   * that the signal does not change when a new list has the same names.
   */
  readonly serversSeen = computed(() => {
    if (!this.actions.value) return null;
    const { actions: there, gone } = this.actions.value;
    return JSON.stringify([there.map((one) => one.name), gone]);
  });
}

const LAG_WINDOW_MS = 30_000; // after a change of the other clock, the lag is right after at most twice this time

// How far another clock is behind this one [ms], transport included. It is the minimum over two windows of time,
// because the message with the shortest delay shows the difference of the clocks best.
class Lag {
  since = performance.now();
  least = Infinity; // in this window
  before = Infinity; // in the previous window
  forget() {
    this.since = performance.now();
    this.least = Infinity;
    this.before = Infinity;
  }
  /** @param t time on that clock when the message was sent [ms] */
  measure(t: number) {
    if (performance.now() - this.since > LAG_WINDOW_MS) {
      this.since = performance.now();
      this.before = this.least;
      this.least = Infinity;
    }
    this.least = Math.min(this.least, Date.now() - t);
  }
  get value() {
    const least = Math.min(this.least, this.before);
    return least === Infinity ? null : least;
  }
}
