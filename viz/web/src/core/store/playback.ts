// The instant shown: now, or an earlier one that the user looks at or plays from.

import type { Signal } from "@preact/signals";
import { batch, computed, signal } from "@preact/signals";
import { ms } from "#core/fold.ts";
import type { Stretch } from "#core/playback.ts";
import { instantAt, loopedAt } from "#core/playback.ts";
import { save, saved } from "#core/storage.ts";
import type { Data } from "#core/store/data.ts";
import type { View } from "#core/store/view.ts";
import type { RunState } from "#core/types.ts";

const SHORTEST_MS = 20; // the shortest stretch that can be selected

export class Playback {
  /** The run changes in place, and often: these count the updates of what is drawn of it. */
  readonly #updates = signal(0);
  readonly #slowUpdates = signal(0); // of panels with much text
  readonly cursor: Signal<number | null> = signal(null); // the instant shown [ms]; null: now
  /** number of events up to there: several may have the same instant */
  readonly #position: Signal<number | null> = signal(null);
  readonly instant = computed(() => [this.cursor.value, this.#position.value]);
  readonly rate: Signal<number> = signal(saved("rate", 1)); // of playing
  readonly playing: Signal<{ t: number; since: number; rate: number } | null> = signal(null);
  readonly stretch: Signal<Stretch | null> = signal(null); // the selected part of the run [ms]
  readonly looping = signal(false); // whether playing repeats the stretch
  readonly filmed: Signal<number | null> = signal(null); // progress of a film [%]
  readonly followedKey: Signal<string | null> = signal(null); // the userdata key whose changes are targets of jumps
  #data: Data;
  #view: View;
  #stateAtCursor: RunState | null = null;

  constructor(data: Data, view: View) {
    this.#data = data;
    this.#view = view;
  }

  /** Show the present of a new run. */
  restart() {
    this.#stateAtCursor = null;
    this.cursor.value = null;
    this.#position.value = null;
    this.playing.value = null;
    this.stretch.value = null;
    this.looping.value = false;
    this.followedKey.value = null;
  }

  /** Stay at the same event after the oldest ones were dropped. @param gone their number */
  forget(gone: number) {
    const at = this.#position.value;
    if (gone && at !== null) this.#position.value = Math.max(0, at - gone);
  }

  /** The state of the run at the instant shown. */
  shown() {
    return this.cursor.value === null ? this.#data.run.now : (this.#stateAtCursor ?? this.#data.run.now);
  }

  /** The instant shown, on the robot's clock [ms since the epoch]. */
  nowMs() {
    return this.cursor.value ?? this.#data.liveMs();
  }

  /** The beginning of the run shown [ms]. */
  began() {
    return ms(this.shown().started) ?? this.#data.run.first();
  }

  /** The number of kept events up to the instant shown. */
  eventsShown() {
    return this.#position.value ?? this.#data.run.events.length;
  }

  /** Whether the instant shown moves by itself: a run is played, or a running one is shown live. */
  readonly goes = computed(() => {
    this.watch();
    const { run, facts, connection } = this.#data;
    const isOver = run.now.ended != null || facts.value?.recorded || facts.value?.stale != null;
    return this.playing.value !== null || (this.cursor.value === null && !isOver && connection.value !== "file");
  });

  /** Have the panel or computed value that calls this updated with the run shown. Returns the number of updates. */
  watch() {
    return this.#updates.value;
  }

  /** The same less often, for a panel with much text. */
  watchSlowly() {
    return this.#slowUpdates.value;
  }

  /** Update who watches. */
  update() {
    this.#updates.value += 1;
  }

  /** Update who watches slowly. */
  updateSlow() {
    this.#slowUpdates.value += 1;
  }

  /** Update all. */
  renew() {
    this.update();
    this.updateSlow();
  }

  #show(t: number | null, count: number | null) {
    this.#stateAtCursor = count === null ? null : this.#data.run.after(count);
    batch(() => {
      this.cursor.value = t;
      this.#position.value = count;
      this.renew();
    });
  }

  /** The instant of the run that is nearest to another one [ms]. */
  #inRun(t: number) {
    const { run } = this.#data;
    return Math.max(run.first() ?? t, Math.min(t, run.last() ?? t));
  }

  /** Show the instant t [ms]; null: now. Playing continues from there. */
  seek(t: number | null) {
    if (t === null) {
      this.playing.value = null;
      this.#show(null, null);
      return;
    }
    const within = this.#inRun(t);
    if (this.playing.value) this.#playFrom(within);
    this.#show(within, this.#data.run.indexAt(within));
  }

  /** Show the state after the first `count` events. */
  seekTo(count: number) {
    const event = this.#data.run.events[count - 1];
    this.playing.value = null;
    if (event) this.#show(event.stamp_ns / 1e6, count);
  }

  /** Go forward or back by a number of events. */
  seekEvent(step: number) {
    const to = Math.max(1, this.eventsShown() + step);
    const all = this.#data.run.events.length;
    if (to >= all && step > 0) this.seek(null);
    else this.seekTo(Math.min(to, all));
  }

  // -- playing ----------------------------------------------------------------------------------

  #playFrom(t: number, since = performance.now()) {
    this.playing.value = { t, since, rate: this.rate.value };
  }

  /** Pause or play; at the end of a run that is over, play from the beginning. */
  togglePlaying() {
    if (this.playing.value) this.playing.value = null;
    else if (this.goes.value) this.seek(this.nowMs());
    else {
      const t = this.cursor.value ?? this.#data.run.first();
      if (t === null) return;
      this.#playFrom(t);
      this.seek(t);
    }
  }

  /** While playing, show the instant that is due, and finally now. @param moment [ms] */
  playOn(moment: number) {
    if (!this.playing.value) return;
    const { run } = this.#data;
    const stretch = this.looping.value ? this.stretch.value : null;
    let t = instantAt(this.playing.value, moment);
    if (stretch && t >= stretch.to) {
      t = loopedAt(t, stretch);
      this.#playFrom(t, moment);
    }
    if (t >= (run.last() ?? t)) this.seek(null);
    else this.#show(t, run.indexAt(t));
  }

  setRate(factor: number) {
    this.rate.value = factor;
    save("rate", factor);
    if (this.playing.value) this.seek(this.cursor.value);
  }

  // -- the selected stretch ---------------------------------------------------------------------

  /** Select a stretch of the run between two instants [ms]; none if it is too short. */
  selectStretch(a: number, b: number = a) {
    const [from, to] = [this.#inRun(Math.min(a, b)), this.#inRun(Math.max(a, b))];
    this.stretch.value = to - from >= SHORTEST_MS ? { from, to } : null;
    if (!this.stretch.value) this.looping.value = false;
  }

  /** Repeat the selected stretch, otherwise the visit of the selected state, otherwise the whole run. */
  toggleLoop() {
    const { run } = this.#data;
    this.looping.value = !this.looping.value;
    if (!this.looping.value) return;
    if (!this.stretch.value) {
      const selected = this.#view.selected.value;
      const visit = selected === null ? null : run.visitAt(selected, this.nowMs());
      if (visit) this.selectStretch(visit.from, visit.to ?? this.#data.liveMs());
      else this.selectStretch(run.first() ?? 0, run.last() ?? 0);
    }
    if (!this.stretch.value) {
      this.looping.value = false;
      this.#view.notify("There is nothing to loop over yet");
      return;
    }
    const { from, to } = this.stretch.value;
    const now = this.nowMs();
    const t = now >= from && now < to ? now : from;
    this.#playFrom(t);
    this.seek(t);
  }

  /** Move the beginning or end of the selected stretch to the instant shown. */
  moveStretch(end: "from" | "to") {
    const { run } = this.#data;
    const at = this.nowMs();
    const other = end === "from" ? (this.stretch.value?.to ?? run.last()) : (this.stretch.value?.from ?? run.first());
    const isTurned = other !== null && (end === "from" ? at >= other : at <= other);
    if (other === null || isTurned) this.#view.notify("The selected stretch would end before it begins", "error");
    else this.selectStretch(at, other);
  }

  // -- jumps ------------------------------------------------------------------------------------

  /** The number of events up to the next or previous mark; when live, the newest mark counts as the next one. */
  jumpOf(name: string, step: number) {
    const { marks, model, run } = this.#data;
    const next = marks.find(name, this.eventsShown(), step, model.value);
    if (next !== null || step < 0 || this.cursor.value !== null) return next;
    return marks.find(name, run.events.length + 1, -1, model.value);
  }

  /** Go to a mark, or notify the user that there is none. @param name of `Marks.find` */
  jump(name: string, step: number) {
    const count = this.jumpOf(name, step);
    if (count !== null) this.seekTo(count);
    else this.#view.notify(`No ${name.replace(/^kind |^key /, "")} ${step > 0 ? "ahead" : "before"}`);
  }
}
