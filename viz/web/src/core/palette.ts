// What the palette finds: states, userdata keys, instants, machines and runs, and commands.

export type Kind = "command" | "state" | "key" | "instant" | "run";
/** `more` says where it is or what it does, `keys` how it is done without the palette. */
export type Item = { kind: Kind; name: string; more: string; keys?: string; pick: () => unknown };

/** Signs at the beginning of a text that ask for one kind only. */
export const SIGNS: Record<string, Kind> = { ">": "command", "@": "state", ".": "key", ":": "instant", "#": "run" };
const ORDER: Kind[] = ["instant", "state", "command", "run", "key"];
const MOST = 40;

/** The kind that a text asks for, and the rest of the text. */
export function asked(text: string): { kind: Kind | null; words: string } {
  const kind = SIGNS[text.trimStart()[0]] ?? null;
  return { kind, words: kind ? text.trimStart().slice(1).trim() : text.trim() };
}

/** The items that contain all words of a text, names that begin with it first, then by kind. */
export function ranked(items: Item[], text: string): Item[] {
  const { kind, words } = asked(text);
  const parts = words.toLowerCase().split(/\s+/).filter(Boolean);
  const found = items.filter((item) => {
    if (kind !== null && item.kind !== kind) return false;
    const all = `${item.name} ${item.more}`.toLowerCase();
    return item.kind === "instant" || parts.every((part) => all.includes(part));
  });
  const rank = ({ name, kind: of }: Item) => {
    const low = name.toLowerCase();
    const place = low.startsWith(parts[0] ?? "") ? 0 : parts.every((part) => low.includes(part)) ? 1 : 2;
    return place * ORDER.length + ORDER.indexOf(of);
  };
  const ranks = new Map(found.map((item) => [item, rank(item)]));
  return found.sort((a, b) => (ranks.get(a) ?? 0) - (ranks.get(b) ?? 0)).slice(0, MOST);
}
