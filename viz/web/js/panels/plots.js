// Plots below the timeline, on its axis, with the values at the instant shown and a choice of further series.
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { idOf, labelOf, numberText, originOf, originsIn, ownerOf, Samples, unitOf, valueAt } from "#core/series.js";
import * as store from "#core/store.js";
import { shorten } from "#core/text.js";
import { Plot } from "#drawing/plot.js";
import { fieldValue, html } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */
/** @typedef {import("#core/series.js").Origin} Origin */

/** @type {[string, string][]} */
const GROUPS = [
  ["topic", "topics"],
  ["progress", "goals"],
  ["userdata", "userdata"],
  ["feedback", "feedback"],
];

/** @param {Origin} origin */
const unitFor = (origin) =>
  origin.source === "topic" ? (store.scene.series.get(origin.owner)?.unit ?? "") : unitOf(origin);

/** @param {{ page: Page }} props */
export function PlotsPanel({ page }) {
  const plots = store.plotsShown.value;
  return html`<section class=${`plots ${plots.length ? "" : "none"}`} aria-label="plots">
    ${plots.map((ids, i) => html`<${PlotRow} key=${ids.join(" ")} page=${page} ids=${ids} number=${i} />`)}
  </section>`;
}

/** @param {{ page: Page, ids: string[], number: number }} props */
function PlotRow({ page, ids, number }) {
  const place = useRef(/** @type {HTMLElement | null} */ (null));
  const origins = ids.map((id) => /** @type {Origin} */ (originOf(id)));
  const unit = unitFor(origins[0]);
  useLayoutEffect(() => {
    if (!place.current) return undefined;
    const plot = new Plot(place.current, ids, unit);
    page.addPlot(plot);
    return () => page.removePlot(plot);
  }, [ids.join(" "), unit]);
  return html`<div class="plot">
    <ul class="plot-names">${origins.map(
      (origin, i) =>
        html`<${Line} key=${ids[i]} origin=${origin} label=${namesOf(origins)[i]} colour=${i}
          onRemove=${() => store.removeLine(number, ids[i])} />`,
    )}<li><${AddLine} label="add a line to this plot" text="+"
      onPick=${(/** @type {string} */ id) => store.addLine(number, id)} /></li></ul>
    <div class="plot-area" ref=${place}></div></div>`;
}

/** The names of a plot's lines; equal labels get their owners' names. @param {Origin[]} origins */
function namesOf(origins) {
  const labels = origins.map(labelOf);
  const isRepeated = (/** @type {string} */ label) => labels.indexOf(label) < labels.lastIndexOf(label);
  return labels.map((label, i) => (isRepeated(label) ? `${ownerOf(origins[i])} ${label}` : label));
}

/** @param {{ origin: Origin, label: string, colour: number, onRemove: () => void }} props */
function Line({ origin, label, colour, onRemove }) {
  store.tick.value;
  const samples = useRef(/** @type {Samples | null} */ (null));
  samples.current ??= new Samples(idOf(origin));
  const list = samples.current.update(store.run, store.scene.series);
  const value = valueAt(list, store.pointed.value ?? store.nowMs());
  const nothing = list.length ? "\u2013" : "no values yet";
  const text = value === null ? nothing : `${numberText(value)} ${unitFor(origin)}`.trim();
  const title = [labelOf(origin), ownerOf(origin)].filter(Boolean).join(", ");
  return html`<li title=${shorten(title, 200)}><i class=${`line s${colour + 1}`}></i>
    <span class="plot-name">${shorten(label, 40)}</span>
    <button class="remove" aria-label=${`remove ${label} from the plots`} onClick=${onRemove}>\u2715</button>
    <output>${text}</output></li>`;
}

/**
 * A choice of the series that are not plotted yet. They are searched only when the pointer or focus comes, since that
 * looks into all values.
 * @param {{ label: string, text: string, onPick: (id: string) => void }} props
 */
export function AddLine({ label, text, onPick }) {
  const [found, setFound] = useState(/** @type {Origin[]} */ ([]));
  const look = () => {
    const shown = new Set(store.plotsShown.value.flat());
    const all = originsIn(store.shown(), store.scene.series.keys());
    setFound(all.filter((one) => !shown.has(idOf(one))));
  };
  const onChange = (/** @type {Event} */ e) => {
    const id = fieldValue(e);
    /** @type {HTMLSelectElement} */ (e.target).value = "";
    if (id) onPick(id);
  };
  const option = (/** @type {Origin} */ one) => {
    const about = [labelOf(one), ownerOf(one)].filter(Boolean).join(" \u2013 ");
    return html`<option key=${idOf(one)} value=${idOf(one)}>${shorten(about, 70)}</option>`;
  };
  return html`<select class="add-line" aria-label=${label} title=${label} value="" onChange=${onChange}
      onPointerEnter=${look} onFocus=${look}>
    <option value="">${text}</option>
    ${GROUPS.map(([source, name]) => {
      const some = found.filter((one) => one.source === source);
      return some.length > 0 && html`<optgroup label=${name}>${some.map(option)}</optgroup>`;
    })}
    ${!found.length && html`<option disabled>no other numbers yet</option>`}</select>`;
}
