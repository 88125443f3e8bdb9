"""Switches rules off, with a reason: for a state, in a comment, or in pyproject.toml."""

from __future__ import annotations

import fnmatch
import functools
import inspect
import linecache
import re
import tomllib
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile
from smachpy.checks.model import RULES
from smachpy.exceptions import SmachError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from actionlib_core.inputs.checked_file import Parsed, Section
    from actionlib_core.inputs.checked_file import Problem as WrongField
    from smachpy.checks.model import Problem
    from smachpy.machines.state import State

S = TypeVar("S", bound="State")

ATTRIBUTE = "_ignored_rules"
_COMMENT = re.compile(r"#\s*smachpy:\s*ignore\[([^\]]*)\]\s*(.*)")


class IgnoreError(SmachError):
    """A rule is switched off incorrectly.

    Try: write `# smachpy: ignore[rule]` with a rule of `docs/check.md`.
    """


@dataclass(frozen=True, slots=True)
class Ignore:
    """A rule that is off for some states.

    Attributes:
        rule: Id of the rule.
        reason: The reason.
        path: Paths for which it is off; `*` and `?` as in file names.
    """

    rule: str
    reason: str
    path: str = "*"

    def covers(self, problem: Problem) -> bool:
        """Return whether it switches `problem` off."""
        return self.rule == problem.rule and fnmatch.fnmatchcase(problem.path, self.path)


def ignore(state: S, rule: str, reason: str) -> S:
    """Switch a rule off for one state, and return the state.

    Raises:
        IgnoreError: there is no such rule, or the reason is empty.
    """
    _check("ignore", rule, reason)
    setattr(state, ATTRIBUTE, {**getattr(state, ATTRIBUTE, {}), rule: reason})
    return state


def of_state(state: State, function: Callable[..., Any] | None) -> dict[str, str]:
    """Return rule -> reason for a state: from `ignore`, and from the comments in its code.

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
    if (code.__module__ or "").partition(".")[0] == "smachpy":
        return {}
    where = f"comment in {'class' if isinstance(code, type) else 'function'} {code.__name__}"
    found = {}
    for match in map(_COMMENT.search, _lines(code)):
        if match is not None:
            for rule in match[1].split(","):
                _check(where, rule.strip(), match[2].strip())
                found[rule.strip()] = match[2].strip()
    return found


def _lines(code: Any) -> list[str]:
    """Return the lines of a class or function; none if its file has no such comments."""
    try:
        # `getsourcelines` parses the whole file to find a class, which takes longer than the rest
        # of a check; so look for a comment first.
        file = linecache.getlines(inspect.getsourcefile(code) or "")
        return inspect.getsourcelines(code)[0] if any(map(_COMMENT.search, file)) else []
    except (OSError, TypeError):
        return []  # typed at a prompt: no source, no comments


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings in pyproject.toml, [tool.smachpy.check].

    Attributes:
        ignores: From `ignore = [{rule = "no-timeout", path = "/PATROL/*", reason = "..."}]`.
        enable: From `enable = ["no-timeout"]`.
        properties: From `properties = {PATROL = ["never(ABORT)"]}`: machine -> texts.
    """

    ignores: tuple[Ignore, ...] = ()
    enable: tuple[str, ...] = ()
    properties: tuple[tuple[str, tuple[str, ...]], ...] = ()


def read_settings(start: Path) -> Settings:
    """Return the settings of the nearest pyproject.toml at or above `start`.

    Raises:
        IgnoreError: they are invalid; all problems at once, with their lines.
    """
    for folder in (start, *start.resolve().parents):
        path = folder / "pyproject.toml"
        if path.is_file():
            file = CheckedFile(path, _error, _parse_toml)
            settings = _settings(file.top.section("tool").section("smachpy").section("check"))
            file.check()
            return settings
    return Settings()


def _error(problems: Sequence[WrongField]) -> IgnoreError:
    return IgnoreError("\n".join(map(str, problems)))


def _parse_toml(file: CheckedFile, text: str) -> Parsed:
    """Return the data in a TOML text, and the lines of its tables and of their keys.

    Python's parser does not tell lines. Values inside others have the line of the outer one.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        file.report("", f"not TOML: {error}.", 0)
        return None, {}
    except RecursionError:
        file.report("", "not TOML that people write: it is nested too deeply.", 0)
        return None, {}
    lines, table, counts = {}, "", Counter[str]()
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*(\[\[?)([\w.-]+)\]", line):
            table = header[2]
            if header[1] == "[[":
                table = f"{header[2]}[{counts[header[2]]}]"
                counts[header[2]] += 1
            lines[table] = number
        elif key := re.match(r"\s*([\w.-]+)\s*=", line):
            lines[f"{table}.{key[1]}"] = number
    return data, lines


def _settings(section: Section) -> Settings:
    ignores = []
    for row in section.rows("ignore", ()):
        rule, reason = row.text("rule", REQUIRED, tuple(RULES)), row.text("reason", REQUIRED)
        ignores.append(Ignore(rule, reason, row.text("path", "*")))
        row.close()
    enable = section.texts("enable", (), tuple(RULES))
    properties = section.section("properties")
    texts = tuple((name, properties.texts(name, ())) for name in properties)
    section.close()
    return Settings(tuple(ignores), enable, texts)


def check_rule(where: str, rule: object) -> None:
    """Check that a rule exists.

    Raises:
        IgnoreError: it does not.
    """
    if not isinstance(rule, str) or rule not in RULES:
        raise IgnoreError(
            f"{where}: rule: got {rule!r}; expected one of {sorted(RULES)}."
            f"{did_you_mean(str(rule), RULES)}"
        )


def _check(where: str, rule: str, reason: str) -> None:
    check_rule(where, rule)
    if not reason.strip():
        raise IgnoreError(f"{where}: rule {rule!r}: got no reason; expected why it is off.")
