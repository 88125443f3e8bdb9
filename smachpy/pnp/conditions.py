"""The conditions of PNP: how they are read and evaluated; no threads, time or I/O.

    guard  = body | "(" body ")"            cond = ATOM | "(" body ")"
    body   = "and" cond cond {cond} | "or" cond cond {cond} | "not" cond | ATOM

Source: the grammar of PetriNetPlans 1.4. There a wrong condition is false, and unknown characters
are skipped; here both are errors.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable

Operator: TypeAlias = Literal["atom", "not", "and", "or"]

# An atom as in PNP's grammar; any other character is an error, except brackets.
_TOKEN = re.compile(r"\s*(?:(?P<atom>@?[A-Za-z][A-Za-z0-9\-@._#{},<>+^/\"]*)|(?P<other>\S))")
_KEYWORDS = {"and": "and", "AND": "and", "or": "or", "OR": "or", "not": "not", "NOT": "not"}
_MAX_BRACKETS = 50  # brackets; the reader is recursive
OF_ACTION = ("finished", "failed")
"""States of an action that a condition may test: `goto_kitchen.finished`."""


class ConditionError(ValueError):
    """A condition cannot be read.

    Attributes:
        text: The condition.
        at: The position in it, from 0.
        problem: The characters found, those expected, and a hint.
    """

    def __init__(self, text: str, at: int, problem: str) -> None:
        self.text = text
        self.at = at
        self.problem = problem
        super().__init__(f"condition [{text}]: {problem}")


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition.

    Attributes:
        operator: Its operator; "atom" for a name.
        name: The name, for an atom.
        parts: The operands of "not", "and" and "or".
    """

    operator: Operator
    name: str = ""
    parts: tuple[Condition, ...] = ()

    def atoms(self) -> tuple[str, ...]:
        """Return the names in it, each once, in their order."""
        if self.operator == "atom":
            return (self.name,)
        return tuple(dict.fromkeys(name for part in self.parts for name in part.atoms()))

    def holds(self, value: Callable[[str], bool]) -> bool:
        """Return whether it is true, if `value` returns the value of each atom.

        Every atom is evaluated, even if the result is known before: reading an event uses it up.
        """
        if self.operator == "atom":
            return value(self.name)
        values = [part.holds(value) for part in self.parts]
        if self.operator == "not":
            return not values[0]
        return all(values) if self.operator == "and" else any(values)

    def __str__(self) -> str:
        if self.operator == "atom":
            return self.name
        parts = (str(part) if part.operator == "atom" else f"({part})" for part in self.parts)
        return f"{self.operator} {' '.join(parts)}"


def atom(name: str) -> Condition:
    """Return a condition of one atom."""
    return Condition("atom", name)


def both(*parts: Condition) -> Condition:
    """Return the conjunction of conditions; for a single one, that one."""
    return parts[0] if len(parts) == 1 else Condition("and", "", parts)


def parse(text: str) -> Condition:
    """Read a condition: `c`, `not c`, `and a b (not c)`.

    Raises:
        ConditionError: the text cannot be read.
    """
    reader = _ConditionParser(text)
    found = reader.body(0)
    reader.end()
    return found


class _ConditionParser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens: list[tuple[str, int]] = []
        for match in _TOKEN.finditer(text):
            kind = match.lastgroup
            if kind is None:
                continue
            word, at = match[kind], match.start(kind)
            if kind == "other" and word not in {"(", ")"}:
                hint = {
                    "!": " Try not NAME.",
                    "&": " Try and A B.",
                    "|": " Try or A B.",
                    "=": " Try one name for the whole condition.",
                }.get(word, "")
                raise ConditionError(
                    text, at, f"got {word!r}; expected names, and, or, not and ( ).{hint}"
                )
            self._tokens.append((word, at))
        self._at = 0

    def _next(self) -> str:
        return self._tokens[self._at][0] if self._at < len(self._tokens) else ""

    def _take(self) -> str:
        token = self._next()
        self._at += 1
        return token

    def _fail(self, expected: str, hint: str = "") -> ConditionError:
        found = self._next()
        at = self._tokens[self._at][1] if found else len(self._text)
        got = repr(found) if found else "its end"
        return ConditionError(self._text, at, f"got {got}; expected {expected}.{hint}")

    def body(self, depth: int) -> Condition:
        if depth > _MAX_BRACKETS:
            raise self._fail(f"at most {_MAX_BRACKETS} brackets in each other")
        if self._next() == "(":
            return self._bracket(depth)
        operator = _KEYWORDS.get(self._next())
        if operator is None:
            return self._atom()
        self._take()
        if operator == "not":
            # The grammar requires brackets here: not (and a b).
            if self._next() in _KEYWORDS:
                raise self._fail("a name or ( ) after not", " Try not (...).")
            return Condition("not", "", (self._operand(depth),))
        # Two operands at least: "and a" is an error.
        parts = [self._operand(depth), self._operand(depth)]
        while self._next() not in {"", ")"}:
            parts.append(self._operand(depth))
        return Condition("and" if operator == "and" else "or", "", tuple(parts))

    def _operand(self, depth: int) -> Condition:
        if self._next() == "(":
            return self._bracket(depth)
        if self._next() in _KEYWORDS:
            raise self._fail("a name or ( )", f" Try ({self._next()} ...).")
        return self._atom()

    def _bracket(self, depth: int) -> Condition:
        self._take()
        found = self.body(depth + 1)
        if self._next() != ")":
            raise self._fail("')'", self._infix())
        self._take()
        return found

    def _atom(self) -> Condition:
        name = self._next()
        if name in {"", "(", ")"}:
            raise self._fail("a name")
        if "." in name and name.rpartition(".")[2] not in OF_ACTION:
            raise self._fail("a name without '.', ACTION.finished or ACTION.failed")
        self._take()
        return Condition("atom", name)

    def end(self) -> None:
        if self._at < len(self._tokens):
            raise self._fail("its end", self._infix())

    def _infix(self) -> str:
        # Most languages write "a and b".
        token = self._next()
        if token in _KEYWORDS and _KEYWORDS[token] != "not":
            return f" Operators stand in front: try {_KEYWORDS[token]} A B."
        return ""
