// The operator's commands to the machine shown: which may be sent, the question before those that cannot be undone, and
// what became of the last one.
import type { Signal } from "@preact/signals";
import { signal } from "@preact/signals";
import { own } from "#core/fold.ts";
import { goalText } from "#core/purposes.ts";
import { hasToken, link, post } from "#core/requests.ts";
import { store } from "#core/store.ts";
import { duration } from "#core/text.ts";

const MOST_NAMED = 4; // states or goals in a question

/** Pause and breakpoints of the machine shown; null if it is none that this page commands. */
export function control() {
  const facts = store.data.facts.value;
  return hasToken() && !facts?.recorded ? (facts?.control ?? null) : null;
}

/** Whether this page can answer questions of the machine shown; the mission needs no remote control for that. */
export function canAnswer() {
  const facts = store.data.facts.value;
  return hasToken() && store.data.connection.value === "live" && facts?.stale == null && !facts?.recorded;
}

/** `failure` is null while it has no answer */
export type Sent = { key: string; failure: string | null };

/** The command that waits for its answer, or the one that just failed. */
export const sent: Signal<Sent | null> = signal(null);

const FAILED_MS = 8000; // time for which a failed command's button is red

/** What identifies a command's button. */
export const keyOf = (name: string, path?: unknown) => `${name} ${path ?? ""}`;

/**
 * Send a command to a machine.
 * @param machine by default the one shown
 */
export async function command(
  name: string,
  more: Record<string, unknown> = {},
  machine: string = store.data.facts.value?.name ?? "",
) {
  if (store.status.whyDisarmed.value) {
    store.view.notify(store.status.whyDisarmed.value, "error");
    return false;
  }
  const mine: Sent = { key: keyOf(name, more.path), failure: null };
  sent.value = mine;
  const result = await post(link("control", "", machine), { command: name, ...more });
  const isNewest = sent.value === mine;
  if (result.ok) {
    // Of an answer its card tells, and by whom.
    if (name !== "answer") store.view.notify(`${name}${more.path ? ` ${more.path}` : ""}: done`);
    if (isNewest) sent.value = null;
  } else if (result.wants_token) {
    if (isNewest) sent.value = null; // the page asks for the token
  } else {
    const failure = `${name}: ${result.text ?? "refused"}`;
    store.view.notify(failure, "error");
    if (isNewest) {
      const failed = { ...mine, failure };
      sent.value = failed;
      setTimeout(() => {
        if (sent.value === failed) sent.value = null;
      }, FAILED_MS);
    }
  }
  return Boolean(result.ok);
}

// -- the question before a command --------------------------------------------------------------

/** `situation` is what the question is about: when it changes, the question is withdrawn */
export type Confirmation = {
  title: string;
  yes: string;
  lines: () => string[];
  give: () => unknown;
  situation: () => string;
  was: string;
};

export const confirmation: Signal<Confirmation | null> = signal(null);

/** What every question is about: this run of this machine, as it is now. */
export const situationOf = (...more: unknown[]) =>
  JSON.stringify([
    ...[
      store.data.facts.value?.name,
      store.data.facts.value?.epoch,
      store.data.run.now.started,
      store.data.run.now.ended,
    ],
    ...[store.view.pageShown.value, store.status.whyDisarmed.value, ...more],
  ]);

/**
 * What a question about a state is about: that it is selected, and the visits of the states that the command ends.
 * @param path of the state
 * @param within path of the states that it ends
 */
export function situationAt(path: string, within: string) {
  const visits = store.data.run.now.states;
  const running = Object.keys(visits).filter((one) => visits[one].since != null && `${one}/`.startsWith(`${within}/`));
  return situationOf(
    store.view.selected.value === path,
    running.map((one) => [one, visits[one].since]),
  );
}

/** Ask before a command is sent. */
export function askFirst(asked: Omit<Confirmation, "was">) {
  confirmation.value = { ...asked, was: asked.situation() };
}

/** Withdraw the question if what it is about has changed. Returns the question that stays. */
export function confirmationNow() {
  const asked = confirmation.value;
  if (!asked || asked.situation() === asked.was) return asked;
  confirmation.value = null;
  store.view.notify(`\u201c${asked.title}\u201d was closed: what it was about has changed`, "error");
  return null;
}

/** The machine and its robots, for people: "PATROL on carrier". */
export function targetText() {
  const name = store.data.facts.value?.label ?? "";
  const robots = store.data.robotNames();
  if (!robots.length) return name;
  return robots.length === 1 ? `${name} on ${robots[0]}` : `${name} on ${robots.length} robots`;
}

/** What a command ends: the running innermost states, and their goals. @param within path */
export function endsText(within: string) {
  const inside = (path: string) => `${path}/`.startsWith(`${within}/`);
  const { states, goals } = store.data.run.now;
  const now = store.data.liveMs();
  const leaves = store.data.runningLeaves().filter(inside);
  const running = leaves.slice(0, MOST_NAMED).map((path) => {
    const since = own(states, path)?.since;
    return `${store.data.nameOf(path)}${since == null ? "" : ` (${duration((now - since / 1e6) / 1000)})`}`;
  });
  const sentGoals = Object.entries(goals).filter(([, goal]) => goal.ended == null && inside(goal.path));
  const targets = sentGoals.slice(0, MOST_NAMED).map(([id, goal]) => goalText(id, goal));
  const more = (count: number) => (count > MOST_NAMED ? `, and ${count - MOST_NAMED} more` : "");
  return [
    running.length ? `Running: ${running.join(", ")}${more(leaves.length)}.` : "No state runs.",
    targets.length
      ? `Cancels the goal${targets.length > 1 ? "s" : ""} ${targets.join("; ")}${more(sentGoals.length)}.`
      : "",
  ].filter(Boolean);
}
