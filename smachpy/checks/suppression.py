"""Switching rules off, with a reason: on a state, in a comment, or in pyproject.toml."""

from __future__ import annotations

import fnmatch
import functools
import inspect
import linecache
import re
import tomllib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from smachpy.checks._core.rules import RULES
from smachpy.exceptions import SmachError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from smachpy.checks._core.model import Problem
    from smachpy.state import State

S = TypeVar("S", bound="State")

ATTRIBUTE = "_ignored_rules"
_COMMENT = re.compile(r"#\s*smachpy:\s*ignore\[([^\]]*)\]\s*(.*)")


class IgnoreError(SmachError):
    """A rule is switched off in a way that makes no sense."""


@dataclass(frozen=True, slots=True)
class Ignore:
    """A rule that is off for some states.

    Attributes:
        rule: Id of the rule.
        reason: Why.
        path: Paths it is off for; `*` and `?` as in file names.
    """

    rule: str
    reason: str
    path: str = "*"

    def covers(self, problem: Problem) -> bool:
        """Tell whether it switches `problem` off."""
        return self.rule == problem.rule and fnmatch.fnmatchcase(problem.path, self.path)


def ignore(state: S, rule: str, reason: str) -> S:
    """Switch a rule off for one state, and return the state.

    Raises:
        IgnoreError: there is no such rule, or the reason is empty.
    """
    _check("ignore", rule, reason)
    rules = dict(getattr(state, ATTRIBUTE, {}))
    rules[rule] = reason
    setattr(state, ATTRIBUTE, rules)
    return state


def of_state(state: State, function: Callable[..., Any] | None) -> dict[str, str]:
    """Return rule -> reason for a state: what `ignore` said, and the comments of its code.

    Args:
        state: The state.
        function: The plain function that it calls, if it is made from one.
    """
    kind: Any = type(state)
    called: Any = function
    comments = _comments(kind) if called is None else {**_comments(kind), **_comments(called)}
    return {**comments, **getattr(state, ATTRIBUTE, {})}


@functools.lru_cache(maxsize=1024)
def _comments(code: Any) -> dict[str, str]:
    """Return rule -> reason from the comments of a class or function."""
    if code.__module__.partition(".")[0] == "smachpy":
        return {}
    is_class = isinstance(code, type)
    where = f"comment in {'class' if is_class else 'function'} {code.__name__}"
    found = {}
    for match in map(_COMMENT.search, _lines(code) if is_class else _lines_of(code)):
        if match is not None:
            for rule in match[1].split(","):
                _check(where, rule.strip(), match[2].strip())
                found[rule.strip()] = match[2].strip()
    return found


def _lines(cls: type) -> list[str]:
    """Return the lines of a class: those of its methods, and those above the first one."""
    methods = [inspect.unwrap(m) for m in vars(cls).values() if inspect.isfunction(m)]
    lines: list[str] = []
    for method in methods:
        lines += _lines_of(method)
    if methods:
        first = min(methods, key=lambda m: m.__code__.co_firstlineno)
        above = linecache.getlines(first.__code__.co_filename)[: first.__code__.co_firstlineno - 1]
        for line in reversed(above):
            lines.append(line)
            if re.match(rf"\s*class\s+{cls.__name__}\b", line):
                break
    return lines


def _lines_of(function: Callable[..., Any]) -> list[str]:
    try:
        return inspect.getsourcelines(function)[0]
    except (OSError, TypeError):
        return []  # typed at a prompt: there are no comments to be seen


@dataclass(frozen=True, slots=True)
class Settings:
    """What pyproject.toml says in [tool.smachpy.check].

    Attributes:
        ignores: From `ignore = [{rule = "no-timeout", path = "/PATROL/*", reason = "..."}]`.
        properties: From `properties = {PATROL = ["never(ABORT)"]}`: machine -> texts.
    """

    ignores: tuple[Ignore, ...] = ()
    properties: tuple[tuple[str, tuple[str, ...]], ...] = ()


def read_settings(start: Path) -> Settings:
    """Return the settings of the nearest pyproject.toml at or above `start`.

    Raises:
        IgnoreError: they make no sense; all problems at once.
    """
    for folder in (start, *start.resolve().parents):
        file = folder / "pyproject.toml"
        if file.is_file():
            table = tomllib.loads(file.read_text(encoding="utf-8"))
            return _settings(file, table.get("tool", {}).get("smachpy", {}).get("check", {}))
    return Settings()


def _settings(file: Path, table: dict[str, Any]) -> Settings:
    where = f"{file}: [tool.smachpy.check]"
    unknown = sorted(set(table) - {"ignore", "properties"})
    if unknown:
        raise IgnoreError(f"{where}: got {unknown}; expected 'ignore' and 'properties'.")
    ignores = []
    for i, entry in enumerate(table.get("ignore", [])):
        if not isinstance(entry, dict) or set(entry) - {"rule", "path", "reason"}:
            raise IgnoreError(
                f"{where}: ignore[{i}]: got {entry!r}; expected a table with 'rule', 'reason' and "
                "maybe 'path'."
            )
        _check(f"{where}: ignore[{i}]", str(entry.get("rule", "")), str(entry.get("reason", "")))
        ignores.append(Ignore(entry["rule"], entry["reason"], entry.get("path", "*")))
    return Settings(tuple(ignores), tuple(_properties(where, table.get("properties", {}))))


def _properties(where: str, given: Any) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the properties of each machine."""
    if not isinstance(given, dict):
        raise IgnoreError(
            f"{where}: properties: got {given!r}; expected a table of machines' names."
        )
    for name, texts in given.items():
        if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
            hint = f" Try [{texts!r}]." if isinstance(texts, str) else ""
            raise IgnoreError(
                f"{where}: properties: {name}: got {texts!r}; expected a list of texts.{hint}"
            )
        yield name, tuple(texts)


def _check(where: str, rule: str, reason: str) -> None:
    if rule not in RULES:
        raise IgnoreError(
            f"{where}: rule: got {rule!r}; expected one of {sorted(RULES)}."
            f"{did_you_mean(rule, RULES)}"
        )
    if not reason.strip():
        raise IgnoreError(f"{where}: rule {rule!r}: got no reason; expected why it is off.")
