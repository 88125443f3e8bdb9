// Paints what the store shows onto the diagram: states, joins, tokens, numbers, the way to the end of the run.

import { containerOf, RAISED } from "#core/fold.ts";
import { insideText } from "#core/purposes.ts";
import { reproduction } from "#core/reproduction.ts";
import { numbersFor } from "#core/statistics.ts";
import { store } from "#core/store.ts";
import type { RunEvent } from "#core/types.ts";
import type { Diagram } from "#drawing/diagram.ts";

export class Painter {
  diagram: Diagram;

  constructor(diagram: Diagram) {
    this.diagram = diagram;
  }

  /** Paint the states with these paths, and what their containers show of them, as they are now. */
  paintChanged(paths: Iterable<string>) {
    const { diagram } = this;
    const data = store.data.run.now;
    const now = store.playback.nowMs();
    for (const path of paths) {
      diagram.paintJoins(path, data.states);
      diagram.paintJoins(containerOf(path), data.states);
      diagram.paintNet(path, data.states[path]);
      if (!diagram.picture.states.has(path)) continue;
      const goal = Object.values(data.goals).findLast((one) => one.path === path && one.ended == null);
      diagram.paint(path, data.states[path], now, goal, store.status.hasNoServer(goal));
    }
  }

  /** Paint everything, as it was at the instant shown. */
  paintAll() {
    const { diagram } = this;
    if (!diagram.size) return;
    const data = store.playback.shown();
    const now = store.playback.nowMs();
    const running = Object.values(data.goals).filter((goal) => goal.ended == null);
    const goals = new Map(running.map((goal) => [goal.path, goal]));
    for (const path of diagram.picture.boxes.keys()) {
      const goal = goals.get(path);
      diagram.paint(path, data.states[path], now, goal, store.status.hasNoServer(goal));
    }
    for (const path of diagram.picture.joins.keys()) diagram.paintJoins(path, data.states);
    diagram.paintCards(insideText);
    for (const path of diagram.picture.boxes.keys()) diagram.paintNet(path, data.states[path]);
    const stops = store.data.facts.value?.control?.breakpoints ?? [];
    const pathsOf = (some: typeof stops) => some.map(([path]) => path);
    diagram.mark(pathsOf(stops.filter(([, outcome]) => outcome === null)), "stopped");
    diagram.mark(pathsOf(stops.filter(([, outcome]) => outcome !== null)), "stopped-after");
    diagram.mark(store.view.selected.value ? [store.view.selected.value] : [], "selected");
    const differing = reproduction()?.found?.difference?.path;
    diagram.mark(differing ? [differing] : [], "differs");
    diagram.showWay(store.data.wayShown.value);
    this.showNumbers();
  }

  /** Flash the transitions that were just taken. @param moment [ms] */
  flash(events: RunEvent[], moment: number) {
    for (const e of events)
      if (e.kind === "Fired") this.diagram.flashFired(e.path, e.transition, moment);
      else this.diagram.flash(e.path, e.kind === "Left" ? e.outcome : RAISED, moment);
  }

  /** Paint what changes without events: the clocks of running states, closed containers, numbers. */
  paintBeat() {
    if (store.playback.cursor.value === null) {
      const { states } = store.data.run.now;
      const now = store.playback.nowMs();
      for (const path of store.status.activePaths.value)
        if (states[path]) this.diagram.updateBadge(path, states[path], now);
      this.diagram.paintCards(insideText);
    }
    if (store.view.numbers.value !== "none") this.showNumbers();
  }

  showNumbers() {
    const { statistics, model } = store.data;
    const { states } = store.playback.shown();
    const { countOf, heatOf } = numbersFor(store.view.numbers.value, states, statistics.value, model.value);
    this.diagram.showNumbers(countOf, heatOf);
  }
}
