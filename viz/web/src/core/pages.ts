// The pages of the viewer and their addresses: a machine, the list of runs, the live runs together, the actions,
// simulated runs. The browser's Back goes to the one before.
import { store } from "#core/store.ts";

export type PageName = "machine" | "runs" | "fleet" | "actions" | "simulate";

/** Those with a word in the address; without one it is the machine. */
const PAGES: PageName[] = ["runs", "fleet", "actions", "simulate"];

/** The page in an address. */
export function pageOf(search: string): PageName {
  const asked = new URLSearchParams(search);
  return PAGES.find((name) => asked.has(name)) ?? "machine";
}

/**
 * The address of a page.
 * @param address the present one
 * @param machine by default the one in the present address; the view of another one is not kept
 */
export function addressOf(address: string, name: PageName, machine?: string) {
  const next = new URL(address);
  for (const other of PAGES) next.searchParams.delete(other);
  if (name !== "machine") next.searchParams.set(name, "");
  if (machine !== undefined && machine !== next.searchParams.get("machine")) {
    next.searchParams.set("machine", machine);
    next.hash = "";
  }
  return String(next);
}

/** Show a page; the browser's Back leads to the present one. */
export function showPage(name: PageName, { machine, replace = false }: { machine?: string; replace?: boolean } = {}) {
  const address = addressOf(location.href, name, machine);
  store.view.pageShown.value = name;
  if (address === location.href) return;
  if (replace) history.replaceState(null, "", address);
  else history.pushState(null, "", address);
}
