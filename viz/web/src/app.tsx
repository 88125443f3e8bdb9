// Puts the page together. The diagram, timeline and map draw themselves outside the virtual DOM; the panels are Preact
// components.
import type { PanelName } from "#core/arrangement.ts";
import "@preact/signals";
import { type ComponentChildren, render } from "preact";
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { DOCKS } from "#core/arrangement.ts";
import { control } from "#core/commands.ts";
import { choose, reconnect } from "#core/connection.ts";
import { ask, messageOf } from "#core/requests.ts";
import type { ClockName } from "#core/store/clock.ts";
import { store } from "#core/store.ts";
import { Page } from "#drawing/page.ts";
import { el } from "#drawing/svg.ts";
import { applyTheme } from "#drawing/theme.ts";
import { ActionsPage } from "#panels/actions.tsx";
import { fieldValue } from "#panels/components.tsx";
import { ConfirmationSheet, OperatorBar } from "#panels/controls.tsx";
import { Dock, Parts } from "#panels/docks.tsx";
import { FleetPage } from "#panels/fleet.tsx";
import { HomePage } from "#panels/home.tsx";
import { Inspector } from "#panels/inspector.tsx";
import { listenToKeys } from "#panels/keys.tsx";
import { MapPanel } from "#panels/map.tsx";
import { Help, Laying, Legend, Notice, Overlay, TokenDialog } from "#panels/messages.tsx";
import { NoteDialog, ShareButtons } from "#panels/notes.tsx";
import { Palette } from "#panels/palette.tsx";
import { PlayBar } from "#panels/play.tsx";
import { AddLine, PlotsPanel } from "#panels/plots.tsx";
import { Questions } from "#panels/questions.tsx";
import { TwoRunsView } from "#panels/reproduction.tsx";
import { SimulatePage } from "#panels/simulate.tsx";
import { TopBar } from "#panels/top_bar.tsx";
import { Tree } from "#panels/tree.tsx";

const svg = el("svg", { class: "diagram", role: "application", "aria-label": "state machine", tabindex: 0 });
const minimap = el("svg", { class: "minimap", "aria-hidden": "true" });
const canvas = document.createElement("canvas");
canvas.tabIndex = 0;
canvas.setAttribute("role", "slider");
canvas.setAttribute("aria-label", "time; arrow keys go from event to event");

const whole = document.createElement("canvas");
whole.setAttribute("role", "img");
whole.setAttribute("aria-label", "the whole run, with failures; the keys of the timeline do the same");

const floor = document.createElement("canvas");
floor.tabIndex = 0;
floor.setAttribute("role", "img");

/** Holds an element from outside the virtual DOM. */
function Mounted({ element }: { element: Element }) {
  const place = useRef<HTMLDivElement | null>(null);
  useLayoutEffect(() => place.current?.replaceChildren(element), [element]);
  return <div class="mounted" ref={place} />;
}

/** Which clock tells instants, and the lanes to show. */
function StripTools() {
  return (
    <div class="strip-tools">
      <select
        aria-label="clock"
        title="how instants are told everywhere (c)"
        value={store.clock.chosen.value}
        onChange={(e: Event) => store.clock.choose(fieldValue(e) as ClockName)}
      >
        <option value="run">run time</option>
        <option value="wall">wall clock</option>
        <option value="relative">relative</option>
      </select>
      <input
        class="lane-filter"
        aria-label="lanes to show, by their names"
        placeholder="lanes"
        value={store.view.laneFilter.value}
        onInput={(e: Event) => {
          store.view.laneFilter.value = fieldValue(e);
        }}
      />
    </div>
  );
}

/** Folds all idle times, or unfolds them; not there in a run without any. */
function FoldIdle() {
  const { clock, playback } = store;
  playback.watchSlowly(); // idle times end while the run goes on
  if (!clock.idle().length) return null;
  const folds = clock.folds().length > 0;
  return (
    <button
      class={folds ? "on" : ""}
      aria-pressed={folds}
      title="fold long times in which nothing happened: they take little room, and a click unfolds one"
      onClick={() => clock.foldIdle(!folds)}
    >
      Idle
    </button>
  );
}

function TimeTools() {
  const { timeline } = page;
  const showAll = () => {
    timeline.window.fitAll();
    timeline.draw();
  };
  const addPlot = (id: string) => store.panels.setPlots([...store.panels.plotsShown.value, [id]]);
  return (
    <div class="time-tools">
      <button title="show the whole run" onClick={showAll}>
        All
      </button>
      <FoldIdle />
      <AddLine label="plot a number of the run" text="Plot" onPick={addPlot} />
    </div>
  );
}

function ZoomButtons() {
  const { view } = store;
  const small = view.textIsSmall.value;
  const on = view.outline.value;
  const isLeast = view.overview.value && view.opened.value.size < 2; // the picture cannot show less
  const showTree = () => {
    view.treeOpen.value = true;
  };
  return (
    <span class="zoom">
      {(on || (small && !isLeast)) && (
        <button
          class={on ? "offer on" : "offer"}
          aria-pressed={on}
          title={on ? "show the arrows again" : "names or labels are small: show less of the machine"}
          onClick={() => page.layouts.toggleOutline()}
        >
          Outline
        </button>
      )}
      {small && isLeast && (
        <button class="offer of-tree" title="the names are small: show the states as a tree" onClick={showTree}>
          States
        </button>
      )}
      <button title="smaller (-)" aria-label="zoom out" onClick={() => page.view.zoom(0.8)}>
        −
      </button>
      <button title="larger (+)" aria-label="zoom in" onClick={() => page.view.zoom(1.25)}>
        +
      </button>
      <button title="show everything (0)" onClick={() => page.layouts.refit()}>
        Fit
      </button>
    </span>
  );
}

const panels: Record<PanelName, () => ComponentChildren> = {
  tree: () => <Tree page={page} />,
  map: () => (
    <MapPanel page={page}>
      <Mounted element={floor} />
    </MapPanel>
  ),
  details: () => <Inspector page={page} />,
  time: () => (
    <div class="timeline">
      <Mounted element={whole} />
      <StripTools />
      <Mounted element={canvas} />
      <TimeTools />
      <TwoRunsView page={page} />
    </div>
  ),
  plots: () => <PlotsPanel page={page} />,
};

function App() {
  const paused = store.data.facts.value?.control?.paused && store.playback.cursor.value === null;
  useEffect(() => {
    page.start().catch((error) => {
      store.data.failure.value = `The viewer could not start: ${messageOf(error)}`;
    });
  }, []);
  const classes = [
    "app",
    paused && "paused",
    store.playback.cursor.value !== null && "past",
    store.view.treeOpen.value && "with-tree",
    store.data.isMissing.value && "without-machine",
    control() && store.view.pageShown.value === "machine" && "operated",
    `part-${store.view.part.value}`,
    `on-${store.view.pageShown.value}`,
  ];
  return (
    <div class={classes.filter(Boolean).join(" ")}>
      <TopBar page={page} />
      <OperatorBar />
      <Questions page={page} />
      {DOCKS.map((name) => (
        <Dock key={name} name={name} panels={panels} />
      ))}
      <main class="stage">
        <Mounted element={svg} />
        <Overlay page={page} />
        <Laying />
        <Mounted element={minimap} />
        <div class="strip">
          <Legend />
          <ShareButtons page={page} />
          <ZoomButtons />
        </div>
      </main>
      <PlayBar page={page} />
      <Parts />
      <HomePage />
      <FleetPage />
      <ActionsPage />
      <div id="announced" class="hidden" aria-live="polite" />
      <ConfirmationSheet />
      <Notice />
      <Help />
      <Palette page={page} />
      <TokenDialog />
      <NoteDialog />
      <SimulatePage />
    </div>
  );
}

declare global {
  interface Window {
    smachpy: object;
  }
}

applyTheme();
const page = new Page(svg as SVGSVGElement, minimap as SVGSVGElement, canvas, floor, whole);
listenToKeys(page);
window.smachpy = { page, store, ask, choose, reconnect }; // for tests, and for looking around in the browser's console
render(<App />, document.getElementById("app") as HTMLElement);
document.querySelector(".boot")?.remove();
