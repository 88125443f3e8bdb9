"""The labels of PNP's places and transitions; no threads, time or I/O.

A label consists of tokens separated by blanks; text in ( ) or [ ] belongs to one token. Source:
PetriNetPlans 1.4, which silently ignores the cases that are warnings here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

from smachpy.pnp.conditions import Condition, ConditionError, parse

Severity: TypeAlias = Literal["error", "warning", "note"]

FUNCTIONS = {
    "start": "start",
    "end": "end",
    "interrupt": "interrupt",
    "interr": "interrupt",
    "resume": "resume",
    "res": "resume",
    "fail": "fail",
}
"""Words after the dot of a transition's label -> their function."""

BEGINS = frozenset({"start", "resume"})
"""Functions that begin an action; the others end it."""


_GOAL = re.compile(r"(goal|fail)(?:\((\d{1,6})\))?")
# Likely mistakes for "NAME.exec", which PNP takes for a comment, so that the action never runs.
_NEAR_EXEC = re.compile(r".+\.(exec\w+|\w?exec|execute|start|end|run)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Fault:
    """A problem of a label.

    Attributes:
        rule: Id of the rule, see `smachpy.pnp.problems`.
        severity: "error": the plan is refused.
        message: The text found and the text expected.
        hint: A suggestion, or "".
    """

    rule: str
    severity: Severity
    message: str
    hint: str = ""


@dataclass(frozen=True, slots=True)
class PlaceLabel:
    """The meaning of a place's label.

    Attributes:
        action: The action that runs while the place is marked, or "".
        goal: Tokens that the place holds at the plan's goal; None if it is not a goal place.
        fail: Likewise for a failed plan.
        faults: The problems of the label.
    """

    action: str = ""
    goal: int | None = None
    fail: int | None = None
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True)
class TransitionLabel:
    """The meaning of a transition's label.

    Attributes:
        calls: Pairs (action, function) in their order; the action is "" if it is that of the exec
            places beside the transition.
        condition: Its guard as written, or None.
        faults: The problems of the label.
    """

    calls: tuple[tuple[str, str], ...] = ()
    condition: Condition | None = None
    faults: tuple[Fault, ...] = ()


def split(label: str) -> list[str]:
    """Return the tokens of a label."""
    tokens: list[str] = []
    token, depth = "", 0
    for char in label:
        if char.isspace() and depth == 0:  # blanks in brackets do not separate tokens
            tokens += [token] if token else []
            token = ""
            continue
        depth += (char in "([") - (char in ")]")
        token += char
    return [*tokens, token] if token else tokens


def place_label(label: str) -> PlaceLabel:
    """Read the label of a place."""
    action, faults = "", []
    counts: dict[str, int] = {}
    for token in split(label):
        name, dot, function = token.rpartition(".")
        if dot and name and function in {"exec", "ex"}:
            found = name
        elif token.startswith("ex.") and len(token) > len("ex."):
            found = token[3:]
        else:
            match = _GOAL.fullmatch(token)
            if match is not None:
                counts[match[1]] = 1 if match[2] is None else int(match[2])
            else:
                faults += _faults_of_comment(token)
            continue
        if action:
            faults.append(
                Fault("label", "error", f"got two actions, {action!r} and {found!r}; expected one.")
            )
        action = action or found
    return PlaceLabel(action, counts.get("goal"), counts.get("fail"), tuple(faults))


def _faults_of_comment(token: str) -> list[Fault]:
    """Return the likely mistakes in a token that PNP takes for a comment."""
    low = token.lower()
    if low in {"goal", "fail"}:
        text = f"got {token!r}, which is a comment; expected {low!r} for a {low} place."
        return [Fault("comment", "warning", text, f"Try {low!r}.")]
    if low.startswith(("goal", "fail")) and "." not in token:
        text = f"got {token!r}, which is a comment; expected {low[:4]!r} or '{low[:4]}(N)'."
        return [Fault("comment", "warning", text)]
    if _NEAR_EXEC.fullmatch(token):
        name = token.rpartition(".")[0]
        text = f"got {token!r}, a plain place; expected '{name}.exec' where an action runs."
        return [Fault("comment", "warning", text, f"Try '{name}.exec'.")]
    return []


def transition_label(label: str) -> TransitionLabel:
    """Read the label of a transition.

    As in PNP, an unknown function ends the reading: a condition behind it is lost.
    """
    calls: list[tuple[str, str]] = []
    conditions: list[Condition | None] = []  # None: an empty or wrong one, which also counts
    faults: list[Fault] = []
    tokens = split(label)
    for number, token in enumerate(tokens):
        if token.startswith("["):
            conditions.append(_condition(token, faults))
            continue
        name, dot, function = token.rpartition(".")
        # "start" alone is for the exec places beside the transition.
        if not dot and token in FUNCTIONS:
            calls.append(("", FUNCTIONS[token]))
        elif dot and name and function in FUNCTIONS:
            calls.append((name, FUNCTIONS[function]))
        elif "." in token:
            faults.append(_unknown_function(token, tokens[number + 1 :]))
            break
    if len(conditions) > 1:
        faults.append(
            Fault("label", "error", f"got {len(conditions)} conditions; expected one.", "Try and.")
        )
    return TransitionLabel(tuple(calls), next(iter(conditions), None), tuple(faults))


def _unknown_function(token: str, rest: list[str]) -> Fault:
    known = ", ".join(dict.fromkeys(FUNCTIONS.values()))
    text = f"got {token!r}; expected one of {known} after the dot."
    # "A.end[c]" without a blank is one token, and its function is unknown.
    bracket = token.find("[")
    hint = ""
    if bracket > 0:
        text += " Its condition is lost, the transition has no guard."
        hint = f"Try a blank: {token[:bracket]!r} {token[bracket:]!r}."
    elif rest:
        text += f" What follows is lost: {' '.join(rest)!r}."
    return Fault("lost-guard" if bracket > 0 or rest else "label", "warning", text, hint)


def _condition(token: str, faults: list[Fault]) -> Condition | None:
    """Read a condition in its square brackets; None when it is empty or wrong."""
    if not token.endswith("]"):
        faults.append(
            Fault("condition", "error", f"got {token!r}; expected a condition that ends with ']'.")
        )
        return None
    text = token[1:-1]
    if not text.strip():
        return None
    try:
        found = parse(text)
    except ConditionError as error:
        faults.append(Fault("condition", "error", f"[{text}]: {error.problem}"))
        return None

    if text.startswith(" ") and text.lstrip().startswith("(") and found.operator in {"and", "or"}:
        message = f"got {token!r}, which PNP itself reads as false; expected no blank after '['."
        faults.append(Fault("condition", "warning", message, f"Try '[{text.strip()}]'."))
    faults += [
        Fault(
            "condition",
            "warning",
            f"got {name!r}, in which PNP itself ignores the '@'; expected a name.",
        )
        for name in found.atoms()
        if name.startswith("@")
    ]
    return found
