// What an address says of the view: instant, selected state, open containers, notes. All of it is in the fragment,
// which no server is sent.

const MOST_OPEN = 100; // containers
const LONGEST_OPEN = 6000; // characters of all of them
const MOST_NOTES = 20;
const LONGEST_NOTE = 300; // characters
const LATEST = 1e15; // [ms], later than any clock

/** @typedef {{ at: number, text: string }} Note at an instant [ms] */
/** @typedef {{ at: number | null, selected: string | null, opened: string[] | null, notes: Note[] }} LinkedView */

/** An instant as seconds with microseconds, no earlier than it is. @param {number} at [ms] */
const instant = (at) => (Math.ceil(at * 1000) / 1e6).toFixed(6);

/** @param {string | null} text @returns {number | null} */
function instantOf(text) {
  if (!text || !/^\d{1,12}(\.\d{1,6})?$/.test(text)) return null;
  const at = Number(text) * 1000;
  return at < LATEST ? at : null;
}

/** The fragment of an address that shows this. @param {LinkedView} view */
export function fragmentOf({ at, selected, opened, notes }) {
  const words = new URLSearchParams();
  if (at !== null) words.append("at", instant(at));
  if (selected !== null) words.append("state", selected);
  const paths = opened ?? [];
  const fits = paths.length <= MOST_OPEN && paths.join("").length <= LONGEST_OPEN;
  for (const path of fits ? paths : []) words.append("open", path);
  for (const note of notes.slice(-MOST_NOTES)) words.append("note", `${instant(note.at)} ${note.text}`);
  return words.toString();
}

/** What the fragment of an address shows; what makes no sense is left out. @param {string} text */
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
  const view = { at: instantOf(words.get("at")), selected: words.get("state"), opened: null, notes };
  if (opened.length) view.opened = opened;
  return view;
}

/**
 * Notes with one more, in the order of their instants; the oldest written go when there are too many.
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
