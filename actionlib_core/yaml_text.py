"""YAML from people's files and command lines: read as plain data, or refused with one reason."""

from __future__ import annotations

import re
from typing import Final, Literal

MOST_PARTS: Final = 100_000
"""A text with aliases stands for at most so many values: a few lines can stand for billions."""


DEEPEST: Final = 200
"""Levels of brackets in each other; with more the parser takes seconds and runs out of stack."""


class YamlTextError(ValueError):
    """A text is no YAML, or cannot be read.

    Attributes:
        line: Where, from 1; 0 when nobody knows.
        reason: Why, on one line.
    """

    def __init__(self, reason: str, line: int = 0) -> None:
        self.line = line
        self.reason = " ".join(reason.split())
        super().__init__(f"line {line}: {self.reason}" if line else self.reason)


def load_yaml(text: str, kind: Literal["safe", "rt"] = "safe") -> object:
    """Return what a YAML text says.

    Args:
        text: One document.
        kind: "safe" gives plain data; "rt" gives ruamel.yaml's own, whose parts know their lines.

    Raises:
        YamlTextError: it is no YAML, one of its values is none of its kind (`!!int x`), it is
            nested too deeply, or stands for too much.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError

    _check_depth(text)
    try:
        data: object = YAML(typ=kind, pure=True).load(text)
        if "*" in text and "&" in text:
            _check_size(data)
    except YamlTextError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = int(mark.line) + 1 if mark is not None else 0
        raise YamlTextError(str(error.problem or error.context), line) from error
    except RecursionError as error:
        raise YamlTextError("it is nested too deeply") from error
    except Exception as error:  # a tag whose value is none lets any exception out
        raise YamlTextError(str(error) or type(error).__name__) from error
    return data


def _check_depth(text: str) -> None:
    depth = 0
    for bracket in re.findall(r"[\[\]{}]", text):
        depth = depth + 1 if bracket in "[{" else max(depth - 1, 0)
        if depth > DEEPEST:
            raise YamlTextError(f"it is nested too deeply: more than {DEEPEST} brackets")


def _check_size(data: object) -> None:
    left, count = [data], 0
    while left:
        count += 1
        if count > MOST_PARTS:
            raise YamlTextError(f"its aliases stand for more than {MOST_PARTS} values")
        part = left.pop()
        if isinstance(part, dict):
            left += [*part.keys(), *part.values()]
        elif isinstance(part, list | tuple | set):
            left += part
