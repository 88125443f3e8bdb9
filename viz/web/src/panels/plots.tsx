// Plots below the timeline, on its axis, with the values at the instant shown and a choice of further series.

import { useLayoutEffect, useRef, useState } from "preact/hooks";
import type { Origin } from "#core/series.ts";
import { idOf, labelOf, numberText, originOf, originsIn, ownerOf, Samples, unitOf, valueAt } from "#core/series.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { Page } from "#drawing/page.ts";
import { Plot } from "#drawing/plot.ts";
import { fieldValue } from "#panels/components.tsx";

const GROUPS: [string, string][] = [
  ["topic", "topics"],
  ["progress", "goals"],
  ["userdata", "userdata"],
  ["feedback", "feedback"],
];

const unitFor = (origin: Origin) =>
  origin.source === "topic" ? (store.data.scene.series.get(origin.owner)?.unit ?? "") : unitOf(origin);

export function PlotsPanel({ page }: { page: Page }) {
  const plots = store.panels.plotsShown.value;
  return (
    <section class={`plots ${plots.length ? "" : "none"}`} aria-label="plots">
      {plots.map((ids, i) => (
        <PlotRow key={ids.join(" ")} page={page} ids={ids} number={i} />
      ))}
    </section>
  );
}

function PlotRow({ page, ids, number }: { page: Page; ids: string[]; number: number }) {
  const place = useRef<HTMLDivElement | null>(null);
  const origins = ids.map((id) => originOf(id) as Origin);
  const unit = unitFor(origins[0]);
  useLayoutEffect(() => {
    if (!place.current) return undefined;
    const plot = new Plot(place.current, ids, unit);
    page.addPlot(plot);
    return () => page.removePlot(plot);
  }, [ids.join(" "), unit]);
  return (
    <div class="plot">
      <ul class="plot-names">
        {origins.map((origin, i) => (
          <Line
            key={ids[i]}
            origin={origin}
            label={namesOf(origins)[i]}
            colour={i}
            onRemove={() => store.panels.removeLine(number, ids[i])}
          />
        ))}
        <li>
          <AddLine label="add a line to this plot" text="+" onPick={(id: string) => store.panels.addLine(number, id)} />
        </li>
      </ul>
      <div class="plot-area" ref={place} />
    </div>
  );
}

/** The names of a plot's lines; equal labels get their owners' names. */
function namesOf(origins: Origin[]) {
  const labels = origins.map(labelOf);
  const isRepeated = (label: string) => labels.indexOf(label) < labels.lastIndexOf(label);
  return labels.map((label, i) => (isRepeated(label) ? `${ownerOf(origins[i])} ${label}` : label));
}

function Line({
  origin,
  label,
  colour,
  onRemove,
}: {
  origin: Origin;
  label: string;
  colour: number;
  onRemove: () => void;
}) {
  store.playback.watch();
  const samples = useRef<Samples | null>(null);
  samples.current ??= new Samples(idOf(origin));
  const list = samples.current.update(store.data.run, store.data.scene.series);
  const value = valueAt(list, store.pointer.pointed.value ?? store.playback.nowMs());
  const nothing = list.length ? "\u2013" : "no values yet";
  const text = value === null ? nothing : `${numberText(value)} ${unitFor(origin)}`.trim();
  const title = [labelOf(origin), ownerOf(origin)].filter(Boolean).join(", ");
  return (
    <li title={shorten(title, 200)}>
      <i class={`line s${colour + 1}`} />
      <span class="plot-name">{shorten(label, 40)}</span>
      <button class="remove" aria-label={`remove ${label} from the plots`} onClick={onRemove}>
        ✕
      </button>
      <output>{text}</output>
    </li>
  );
}

/**
 * A choice of the series that are not plotted yet. They are searched only when the pointer or focus comes, since that
 * looks into all values.
 */
export function AddLine({ label, text, onPick }: { label: string; text: string; onPick: (id: string) => void }) {
  const [found, setFound] = useState<Origin[]>([]);
  const look = () => {
    const shown = new Set(store.panels.plotsShown.value.flat());
    const all = originsIn(store.playback.shown(), store.data.scene.series.keys());
    setFound(all.filter((one) => !shown.has(idOf(one))));
  };
  const onChange = (e: Event) => {
    const id = fieldValue(e);
    (e.target as HTMLSelectElement).value = "";
    if (id) onPick(id);
  };
  const option = (one: Origin) => {
    const about = [labelOf(one), ownerOf(one)].filter(Boolean).join(" \u2013 ");
    return (
      <option key={idOf(one)} value={idOf(one)}>
        {shorten(about, 70)}
      </option>
    );
  };
  return (
    <select
      class="add-line"
      aria-label={label}
      title={label}
      value=""
      onChange={onChange}
      onPointerEnter={look}
      onFocus={look}
    >
      <option value="">{text}</option>
      {GROUPS.map(([source, name]) => {
        const some = found.filter((one) => one.source === source);
        return some.length > 0 && <optgroup label={name}>{some.map(option)}</optgroup>;
      })}
      {!found.length && <option disabled>no other numbers yet</option>}
    </select>
  );
}
