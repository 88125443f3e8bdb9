// Questions of a mission to its operator: which are shown, the order of their answers, how urgent they are.

import { ms } from "#core/fold.ts";
import type { Question, RunState } from "#core/types.ts";

const CLOSES_MS = 3000; // time for which an answered question is still shown
const URGENT_S = 10; // time left from which a question is urgent

export type ShownQuestion = Question & { path: string; left: number; share: number; isOpen: boolean; ago: number };

/**
 * The unanswered and the just answered questions, the oldest first.
 * @param now [ms]
 */
export function questionsOf(data: RunState, now: number): ShownQuestion[] {
  const shown = [];
  for (const [path, state] of Object.entries(data.states)) {
    const { question } = state;
    if (!question) continue;
    const isOpen = state.since != null && question.answered === null;
    const ago = question.answered === null ? Infinity : now - (ms(question.answered) ?? 0);
    if (!isOpen && (data.ended != null || !(ago < CLOSES_MS))) continue;
    const waited = (now - (ms(question.asked) ?? 0)) / 1000;
    const left = Math.max(0, question.patience - waited);
    shown.push({ ...question, path, left, share: Math.min(1, left / question.patience), isOpen, ago });
  }
  return shown.sort((a, b) => a.asked - b.asked || (a.path < b.path ? -1 : 1));
}

export const isUrgent = (one: ShownQuestion) => one.isOpen && one.left <= URGENT_S;

/** The answers with the texts of their buttons: first the default, which is the safe one, otherwise the last one. */
export function buttonsOf({ answers, words, default: otherwise }: Question) {
  const safe = answers.includes(otherwise) ? otherwise : answers[answers.length - 1];
  const all = answers.map((answer, i) => ({ answer, text: words[i] || answer, isFirst: answer === answers[0] }));
  return [...all.filter((one) => one.answer === safe), ...all.filter((one) => one.answer !== safe)];
}

/** The answer that a question got, as text. */
export function answerText({ answer, by, ago }: ShownQuestion) {
  const seconds = `${Math.max(0, Math.round(ago / 1000))} s ago`;
  return by ? `answered ${answer} by ${by}, ${seconds}` : `nobody answered: ${answer}, ${seconds}`;
}

/**
 * The title of the page: the number of unanswered questions and, every other second, the urgent question.
 * @param elsewhere number of unanswered questions of other machines
 */
export function titleOf(title: string, shown: ShownQuestion[], elsewhere: number) {
  const waiting = shown.filter((one) => one.isOpen);
  const urgent = waiting.find(isUrgent);
  const count = waiting.length + elsewhere;
  if (urgent && Math.floor(urgent.left) % 2) return `? ${urgent.text}`;
  return count ? `(${count}) ${title}` : title;
}

/** Paths of the states that wait at a breakpoint for the operator. */
export const heldStates = (data: RunState) =>
  Object.entries(data.states)
    .filter(([, state]) => state.since != null || state.waits != null)
    .filter(([, state]) => state.waits === "breakpoint")
    .map(([path]) => path);
