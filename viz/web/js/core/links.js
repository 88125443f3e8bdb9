// The view in an address: instant, selected state and stretch, open containers, panels, plots, notes. It is all in the
// fragment, which browsers do not send to servers.
import { arrangementOf, wordOf } from "#core/arrangement.js";
import { knownPlots } from "#core/series.js";

const MOST_OPEN = 100; // containers
const LONGEST_OPEN = 6000; // characters of all of them
const MOST_NOTES = 20;
const LONGEST_NOTE = 300; // characters
const LATEST = 1e15; // [ms], later than any clock

/** @typedef {{ at: number, text: string }} Note at an instant [ms] */
/**
 * @typedef {object} LinkedView
 * @property {number | null} at instant [ms]; null: now
 * @property {string | null} selected path
 * @property {string[] | null} opened paths; null: the page's choice
 * @property {Note[]} notes
 * @property {[number, number] | null} stretch the selected one, from and to [ms]
 * @property {import("#core/arrangement.js").Arrangement | null} panels null: the reader's own
 * @property {string[][] | null} plots ids of series; null: the usual ones
 */

/**
 * An instant in seconds, rounded up to microseconds: the event at the instant must be included.
 * @param {number} at [ms]
 */
const instant = (at) => (Math.ceil(at * 1000) / 1e6).toFixed(6);

/** @param {string | null} text @returns {number | null} */
function instantOf(text) {
  if (!text || !/^\d{1,12}(\.\d{1,6})?$/.test(text)) return null;
  const at = Number(text) * 1000;
  return at < LATEST ? at : null;
}

/** The fragment of an address for a view. @param {LinkedView} view */
export function fragmentOf({ at, selected, opened, notes, stretch, panels, plots }) {
  const words = new URLSearchParams();
  if (at !== null) words.append("at", instant(at));
  if (selected !== null) words.append("state", selected);
  const paths = opened ?? [];
  const fits = paths.length <= MOST_OPEN && paths.join("").length <= LONGEST_OPEN;
  for (const path of fits ? paths : []) words.append("open", path);
  for (const note of notes.slice(-MOST_NOTES)) words.append("note", `${instant(note.at)} ${note.text}`);
  if (stretch) words.append("stretch", stretch.map(instant).join(" "));
  if (panels) words.append("panels", wordOf(panels));
  for (const plot of plots ?? []) words.append("plot", plot.join(";"));
  if (plots && !plots.length) words.append("plot", "");
  return words.toString();
}

/** The view of an address's fragment; invalid parts are left out. @param {string} text */
export function viewOf(text) {
  const words = new URLSearchParams(text.replace(/^#/, ""));
  const notes = [];
  for (const word of words.getAll("note").slice(0, MOST_NOTES)) {
    const [, when, what] = /^(\S+) (.+)$/s.exec(word) ?? [];
    const at = instantOf(when ?? null);
    if (at !== null) notes.push({ at, text: what.slice(0, LONGEST_NOTE) });
  }
  const opened = words.getAll("open").slice(0, MOST_OPEN);
  /** @type {LinkedView} */
  const view = {
    at: instantOf(words.get("at")),
    selected: words.get("state"),
    opened: null,
    notes,
    stretch: null,
    panels: arrangementOf(words.get("panels")),
    plots: null,
  };
  const [from, to] = (words.get("stretch") ?? "").split(" ").map(instantOf);
  if (from && to && from < to) view.stretch = [from, to];
  if (opened.length) view.opened = opened;
  if (words.has("plot")) view.plots = knownPlots(words.getAll("plot").map((plot) => plot.split(";")));
  return view;
}

/**
 * Notes and further ones, in the order of their instants; if there are too many, the ones written first are dropped.
 * @param {Note[]} notes @param {Note[]} more
 */
export function withNotes(notes, more) {
  const clean = more
    .map(({ at, text }) => ({ at, text: text.trim().slice(0, LONGEST_NOTE) }))
    .filter((one) => one.text);
  const isKnown = (/** @type {Note} */ one) => notes.some((other) => other.text === one.text && same(other, one));
  const all = [...notes, ...clean.filter((one) => !isKnown(one))].slice(-MOST_NOTES);
  return all.sort((a, b) => a.at - b.at);
}

const same = (/** @type {Note} */ a, /** @type {Note} */ b) => Math.abs(a.at - b.at) < 0.01;
