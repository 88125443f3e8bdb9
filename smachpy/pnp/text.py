"""PNP's text forms: linear and conditional plans, execution rules, lists of PDDL actions.

    plan   = item { ";" item } [";"]
    item   = action["|"N] | "<" branch { ":" branch } ">" | term { "||" term }
           | "LABEL"text | "GOTO_LABEL"text | rule            term = action | "{" plan "}"
    branch = condition "?" [plan]          rule = ["!"] "*if*" condition "*do*" recovery ["!"]

A blank may stand for the "_" behind "GOTO"; a rule without "!" ends at the next ";".

Source: the generators of PetriNetPlans 1.4. A "#" begins a comment. No threads, time or I/O.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from smachpy.exceptions import InvalidStateError, did_you_mean
from smachpy.pnp.build import (
    LASTS,
    Action,
    Choice,
    Fork,
    GoTo,
    Interrupt,
    Mark,
    Part,
    Sequence_,
    action,
)
from smachpy.pnp.conditions import ConditionError, parse
from smachpy.pnp.problems import PlanError, PlanProblem

if TYPE_CHECKING:
    from smachpy.pnp.net import Net

# The first alternative that matches counts: rules come before words, which also match "*if*".
_TOKEN = re.compile(
    r"\s+|(?P<rule>![^!]*!|\*if\*[^;]*)|(?P<sign>\|\||[<>{}:;?])|(?P<limit>\|\s*\d+)|(?P<word>[^\s<>{}:;?|!]+)"
)
_GOTO = re.compile(r"GOTO[_\s]\s*(\S+)")
_RULE = re.compile(r"\s*\*(\w+)\*\s*(.*?)\s*\*(\w+)\*\s*(.*?)\s*", re.DOTALL)
# A line of an `.er` file; "*x* N" at its end has no effect.
_ER = re.compile(
    r"\s*\*(\w+)\*\s*(.*?)\s*\*(\w+)\*\s*(\S+)\s*\*(\w+)\*\s*(.*?)\s*(?:\*x\*\s*(\d+)\s*)?"
)
_MAX_BRACKETS: Final = 50  # brackets; the reader is recursive


class ExecutionRule(NamedTuple):
    """A line of an `.er` file.

    Attributes:
        action: Name of the action, without parameters.
        rule: The interrupt and its recovery.
        line: The line in the file.
        ignored: The part of the line that has no effect, or "".
    """

    action: str
    rule: Interrupt
    line: int = 0
    ignored: str = ""


class _Token(NamedTuple):
    kind: str
    text: str
    line: int


def parse_plan(
    text: str, rules: tuple[ExecutionRule, ...] = (), *, name: str = "plan", file: str = ""
) -> Net:
    """Read a linear or conditional plan.

    Args:
        text: The plan.
        rules: Execution rules, for each action of that name in the plan.
        name: The name of the plan.
        file: The file, for the problems.

    Raises:
        PlanError: it cannot be read; with the line.

    Warns:
        UserWarning: a rule is for no action of the plan.
    """
    net, actions = read_plan_text(text, rules, name, file)
    for problem in unmatched(rules, actions):
        warnings.warn(str(problem), stacklevel=2)
    return net


def unmatched(
    rules: tuple[ExecutionRule, ...], actions: set[str], file: str = ""
) -> list[PlanProblem]:
    """Return the problems of rules for none of these actions."""
    return [
        PlanProblem(
            "unmatched",
            "warning",
            f"got {rule.action!r}; expected an action of the plan, one of {sorted(actions)}."
            f"{did_you_mean(rule.action, actions)}",
            f"rule for {rule.action!r}",
            file,
            rule.line,
        )
        for rule in rules
        if rule.action not in actions
    ]


def read_plan_text(
    text: str, rules: tuple[ExecutionRule, ...], name: str, file: str
) -> tuple[Net, set[str]]:
    """Read a plan as `parse_plan` does; return also the actions that rules may be for."""
    reader = _PlanParser(text, rules, file)
    part = reader.plan(0)
    reader.end()
    try:
        return part.net(name, file=file), reader.actions
    except InvalidStateError as error:
        found = [PlanProblem("text", "error", p, "", file) for p in error.problems or [str(error)]]
        raise PlanError(found) from error


def parse_pddl(
    text: str, rules: tuple[ExecutionRule, ...] = (), *, name: str = "plan", file: str = ""
) -> Net:
    """Read a list of PDDL actions, one "(action p1 p2)" a line; arguments as for `parse_plan`."""
    return parse_plan(plan_of_pddl(text, file), rules, name=name, file=file)


def plan_of_pddl(text: str, file: str) -> str:
    """Return a list of PDDL actions as a linear plan with the same lines.

    Raises:
        PlanError: a line cannot be read.
    """
    # Planners put the time before the action and the duration behind it: "0.001: (a b) [1.000]".
    lines = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].strip()
        match = re.fullmatch(r"(?:[\d.]+:)?\s*\(([^()]+)\)\s*(?:\[[\d.]+\])?", words)
        if words and match is None:
            raise _error(file, number, f"got {words!r}; expected '(action p1 p2)'.")
        lines.append("_".join(match[1].split()) + ";" if match else "")
    return "\n".join(lines)


def parse_rules(text: str, *, file: str = "") -> tuple[ExecutionRule, ...]:
    """Read execution rules, one a line: `*if* COND *during* ACTION *do* RECOVERY`.

    Raises:
        PlanError: a line cannot be read; all problems at once.
    """
    found: list[ExecutionRule] = []
    problems: list[PlanProblem] = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        match = _ER.fullmatch(line)
        words = match.group(1, 3, 5) if match else ()
        if match is None or words != ("if", "during", "do"):
            message = f"got {line.strip()!r}; expected '*if* COND *during* ACTION *do* RECOVERY'."
            problems.append(PlanProblem("text", "error", message, "", file, number))
            continue
        try:
            rule = rule_of(match[2], match[6], file, number)
        except PlanError as error:
            problems += error.found
            continue
        ignored = "" if match[7] is None else f"*x* {match[7]}"
        found.append(ExecutionRule(match[4].partition("_")[0], rule, number, ignored))
    if problems:
        raise PlanError(problems)
    return tuple(found)


def _error(file: str, line: int, message: str) -> PlanError:
    return PlanError([PlanProblem("text", "error", message, "", file, line)])


def rule_of(condition: str, recovery: str, file: str = "", line: int = 0) -> Interrupt:
    """Read a rule from its two parts.

    Raises:
        PlanError: one of them cannot be read.
    """
    condition = condition.strip()
    try:
        parse(condition)
    except ConditionError as error:
        raise _error(file, line, f"condition {condition!r}: {error.problem}") from error
    *steps, last = [step.strip() for step in recovery.strip().rstrip(";").split(";")]
    goto = _GOTO.fullmatch(last)
    if last not in LASTS and goto is None:
        text = f"recovery: got {last!r} at its end; expected one of {list(LASTS)}, or GOTO_LABEL."
        raise _error(file, line, text + did_you_mean(last, LASTS))
    parts = [_act(step, file, line) for step in steps if step]
    return Interrupt(condition, tuple(parts), f"GOTO_{goto[1]}" if goto else last)


def _act(step: str, file: str, line: int) -> Action:
    """Return an action `name[|SECONDS][*]`."""
    name, _, seconds = step.rstrip("*").partition("|")
    if seconds and not seconds.strip().isdecimal():
        raise _error(file, line, f"got {step!r}; expected seconds after '|'.")
    try:
        made = action(name.strip())
    except InvalidStateError as error:
        raise _error(file, line, error.message) from error
    return replace(made, line=line, seconds=seconds.strip() or None)


class _PlanParser:
    def __init__(self, text: str, rules: tuple[ExecutionRule, ...], file: str) -> None:
        self._file = file
        self._rules = rules
        self.actions: set[str] = set()  # names of those that rules apply to, without parameters
        self._tokens = list(self._scan(text))
        self._at = 0

    def _scan(self, text: str) -> list[_Token]:
        # Comments go, line ends stay: the line of a token is counted from them.
        lines = [line.partition("#")[0] for line in text.splitlines()]
        joined, found, at, line = "\n".join(lines), [], 0, 1
        while at < len(joined):
            match = _TOKEN.match(joined, at)
            if match is None:
                raise _error(self._file, line, f"got {joined[at]!r}; expected an action.")
            if match.lastgroup is not None:
                found.append(_Token(match.lastgroup, match[0], line))
            at = match.end()
            line += match[0].count("\n")
        return found

    def _next(self) -> _Token:
        if self._at < len(self._tokens):
            return self._tokens[self._at]
        line = self._tokens[-1].line if self._tokens else 1
        return _Token("end", "", line)

    def _take(self, text: str = "") -> _Token:
        token = self._next()
        if text and token.text != text:
            got = repr(token.text) if token.text else "its end"
            raise _error(self._file, token.line, f"got {got}; expected {text!r}.")
        self._at += 1
        return token

    def plan(self, depth: int) -> Part:
        if depth > _MAX_BRACKETS:
            raise _error(self._file, self._next().line, f"got more than {_MAX_BRACKETS} levels.")
        parts: list[Part] = []
        while True:
            token = self._next()
            if token.text == ";":
                self._take()
            elif token.kind == "rule":
                parts.append(self._with_rule(parts, self._take()))
            elif token.kind == "end" or token.text in {"}", ">", ":"}:
                return Sequence_(0, tuple(parts))
            else:
                parts.append(self._item(depth))

    def _with_rule(self, parts: list[Part], token: _Token) -> Part:
        match = _RULE.fullmatch(token.text.strip("!"))
        if match is None or match.group(1, 3) != ("if", "do"):
            text = f"got {token.text!r}; expected '! *if* COND *do* RECOVERY !'."
            raise _error(self._file, token.line, text)
        # A rule applies to the action before it.
        if not (parts and isinstance(parts[-1], Action)):
            raise _error(self._file, token.line, "got a rule; expected it behind an action.")
        before = parts.pop()
        assert isinstance(before, Action)
        rule = rule_of(match[2], match[4], self._file, token.line)
        return replace(before, rules=(*before.rules, rule))

    def _item(self, depth: int) -> Part:
        token = self._next()
        if token.text == "<":
            return self._choice(depth)
        if token.kind == "word" and token.text.startswith("GOTO_"):
            return GoTo(self._take().line, token.text.removeprefix("GOTO_"))
        if token.kind == "word" and token.text == "GOTO":
            line, label = self._take().line, self._take()
            if label.kind != "word":
                raise _error(self._file, line, f"GOTO: got {label.text!r}; expected a label.")
            return GoTo(line, label.text)
        if token.kind == "word" and token.text.startswith("LABEL"):
            return Mark(self._take().line, token.text)
        parts = [self._term(depth)]
        while self._next().text == "||":
            self._take()
            parts.append(self._term(depth))
        return parts[0] if len(parts) == 1 else Fork(token.line, tuple(parts))

    def _term(self, depth: int) -> Part:
        token = self._take()
        if token.text == "{":
            part = self.plan(depth + 1)
            self._take("}")
            return part
        if token.kind != "word":
            got = repr(token.text) if token.text else "its end"
            raise _error(self._file, token.line, f"got {got}; expected an action.")
        made = _act(token.text, self._file, token.line)
        if self._next().kind == "limit":
            made = replace(made, seconds=self._take().text[1:].strip())
        # Stars behind an action are allowed, and have no effect.
        if self._next().text.startswith("*") and set(self._next().text) == {"*"}:
            self._take()
        # Rules are for the action's name without robot and parameters.
        own = made.name.partition("#")[2] or made.name
        own = own.partition("_")[0]
        self.actions.add(own)
        rules = [one.rule for one in self._rules if one.action == own]
        return replace(made, rules=tuple(rules))

    def _choice(self, depth: int) -> Part:
        line = self._take("<").line
        branches = [self._branch(depth)]
        while self._next().text == ":":
            self._take()
            branches.append(self._branch(depth))
        self._take(">")
        return Choice(line, tuple(branches))

    def _branch(self, depth: int) -> tuple[str, Part]:
        words = []
        while self._next().kind == "word":
            words.append(self._take().text)
        token = self._take("?")
        condition = " ".join(words)
        try:
            parse(condition)
        except ConditionError as error:
            text = f"condition {condition!r}: {error.problem}"
            raise _error(self._file, token.line, text) from error
        return condition, self.plan(depth + 1)

    def end(self) -> None:
        token = self._next()
        if token.kind != "end":
            raise _error(self._file, token.line, f"got {token.text!r}; expected an action.")
