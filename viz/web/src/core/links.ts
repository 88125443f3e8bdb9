// The view in an address: instant, selected state and stretch, open containers, panels, plots, notes. It is all in the
// fragment, which browsers do not send to servers.
import type { Arrangement } from "#core/arrangement.ts";
import { arrangementOf, wordOf } from "#core/arrangement.ts";
import { knownPlots } from "#core/series.ts";

const MOST_OPEN = 100; // containers
const LONGEST_OPEN = 6000; // characters of all of them
const MOST_NOTES = 20;
const LONGEST_NOTE = 300; // characters
const LATEST = 1e15; // [ms], later than any clock

/** at an instant [ms]; `by`: who wrote it, of a shared one */
export type Note = { at: number; text: string; by?: string };
export type LinkedView = {
  at: number | null; // instant [ms]; null: now
  selected: string | null; // path
  opened: string[] | null; // paths; null: the page's choice
  notes: Note[];
  stretch: [number, number] | null; // the selected one, from and to [ms]
  panels: Arrangement | null; // null: the reader's own
  plots: string[][] | null; // ids of series; null: the usual ones
};

/**
 * An instant in seconds, rounded up to microseconds: the event at the instant must be included.
 * @param at [ms]
 */
const instant = (at: number) => (Math.ceil(at * 1000) / 1e6).toFixed(6);

function instantOf(text: string | null): number | null {
  if (!text || !/^\d{1,12}(\.\d{1,6})?$/.test(text)) return null;
  const at = Number(text) * 1000;
  return at < LATEST ? at : null;
}

/** The fragment of an address for a view. */
export function fragmentOf({ at, selected, opened, notes, stretch, panels, plots }: LinkedView) {
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

/** The view of an address's fragment; invalid parts are left out. */
export function viewOf(text: string) {
  const words = new URLSearchParams(text.replace(/^#/, ""));
  const notes = [];
  for (const word of words.getAll("note").slice(0, MOST_NOTES)) {
    const [, when, what] = /^(\S+) (.+)$/s.exec(word) ?? [];
    const at = instantOf(when ?? null);
    if (at !== null) notes.push({ at, text: what.slice(0, LONGEST_NOTE) });
  }
  const opened = words.getAll("open").slice(0, MOST_OPEN);
  const view: LinkedView = {
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
 */
export function withNotes(notes: Note[], more: Note[], most = MOST_NOTES) {
  const clean = more.map((one) => ({ ...one, text: one.text.trim().slice(0, LONGEST_NOTE) })).filter((one) => one.text);
  const isKnown = (one: Note) => notes.some((other) => other.text === one.text && same(other, one));
  const all = [...notes, ...clean.filter((one) => !isKnown(one))].slice(-most);
  return all.sort((a, b) => a.at - b.at);
}

const same = (a: Note, b: Note) => Math.abs(a.at - b.at) < 0.01;
