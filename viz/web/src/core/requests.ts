// Requests to the viewer's server, with the token that it gave for them.

import { store } from "#core/store.ts";
import type { CheckedGoal, Done, Failure, GoalAccepted } from "#core/wire.ts";

const ANSWER_MS = 3000; // time in which every command is answered, or has failed

let token: string | null = null; // for commands
let view = ""; // the token for reading

// -- tokens -------------------------------------------------------------------------------------

/**
 * Read the token from the fragment of the address, which browsers do not send to servers, and remove it there, so that
 * a copied address does not contain it.
 */
export function readToken() {
  const words = new URLSearchParams(location.hash.slice(1));
  const given = words.get("token") || null;
  view = words.get("view") ?? "";
  words.delete("token");
  words.delete("view");
  try {
    if (given) sessionStorage.setItem("smachpy.token", given);
    token = given ?? sessionStorage.getItem("smachpy.token");
  } catch {
    token = given; // a page in a file has no storage
  }
  const rest = String(words);
  if (given || view) history.replaceState(null, "", location.pathname + location.search + (rest && `#${rest}`));
}

/** Get the cookie by which links, pictures and streams may read. */
export async function logIn() {
  const known = token ?? view;
  if (known) await ask("/api/login", { method: "POST", body: JSON.stringify({ token: known }) });
}

export const hasToken = () => token !== null && store.data.settings.value.control;

/** Set the token. Returns false if there is none. @param text the token, or an address that contains it */
export function setToken(text: string) {
  const [, found] = /#token=([\w-]+)/.exec(text) ?? /^\s*([\w-]+)\s*$/.exec(text) ?? [];
  if (!found) return false;
  token = found;
  try {
    sessionStorage.setItem("smachpy.token", found);
  } catch {
    // without storage it is lost when the page is loaded again
  }
  return true;
}

// -- requests -----------------------------------------------------------------------------------

/** A text for an address; without lone surrogates, at which encodeURIComponent would throw. */
export const encoded = (text: string) => encodeURIComponent(text.replace(/\p{Surrogate}/gu, "\ufffd"));

/** The address of a resource of a machine, by default the one shown. */
export const link = (what: string, more: string = "", machine = store.data.facts.value?.name ?? "") =>
  `/api/${what}?machine=${encoded(machine)}${more}`;

/** The JSON answer of the server, or an error in the same form. */
export async function ask<T>(address: string, options: RequestInit = {}): Promise<T | Failure> {
  let answer: Response;
  let text: string;
  try {
    answer = await fetch(address, options);
    text = await answer.text();
  } catch (error) {
    return failure(`The viewer's server does not answer (${messageOf(error)}).`);
  }
  try {
    return JSON.parse(text);
  } catch {
    const status = `${answer.status} ${answer.statusText}`.trim();
    const reason = [status, text.trim().slice(0, 300)].filter(Boolean).join(": ");
    return failure(`The viewer's server answered ${reason}`);
  }
}

const failure = (text: string): Failure => ({ ok: false, text, wants_token: false, problems: [] });

export const isFailure = (answer: unknown): answer is Failure =>
  typeof answer === "object" && answer !== null && "ok" in answer && answer.ok === false;

export const messageOf = (error: unknown) => (error instanceof Error ? error.message : String(error));

/** Send a command. After 3 s without an answer it counts as failed, as nobody watches a button for longer. */
export async function post<T extends { ok: true }>(address: string, data: object): Promise<T | Failure> {
  const limit = new AbortController();
  const timer = setTimeout(() => limit.abort(), ANSWER_MS);
  const answer = await ask<T>(address, {
    method: "POST",
    headers: { "content-type": "application/json", "x-smachpy-token": token ?? "" },
    body: JSON.stringify(data),
    signal: limit.signal,
  });
  clearTimeout(timer);
  if (limit.signal.aborted)
    return failure(`no answer in ${ANSWER_MS / 1000} s; it may still be carried out: look at the machine.`);
  if (isFailure(answer) && answer.wants_token) store.view.tokenAsked.value = true; // a new viewer's is another one
  return answer;
}

/** Check or send a goal, or cancel one. */
export const askAction = (data: object) => post<CheckedGoal | GoalAccepted | Done>("/api/action", data);
