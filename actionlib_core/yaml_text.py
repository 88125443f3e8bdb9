"""YAML from files and command lines: parsed to plain data, or refused with a reason."""

from __future__ import annotations

import re
from typing import Final, Literal

MOST_PARTS: Final = 100_000
"""Most values in a text with aliases, of which a few lines can produce billions."""


DEEPEST: Final = 200
"""Most levels of brackets; with more, the parser takes seconds and runs out of stack."""


class YamlTextError(ValueError):
    """A text is not YAML, or is refused.

    Attributes:
        line: Number of the line, from 1; 0: unknown.
        reason: The reason, on one line.
    """

    def __init__(self, reason: str, line: int = 0) -> None:
        self.line = line
        self.reason = " ".join(reason.split())
        super().__init__(f"line {line}: {self.reason}" if line else self.reason)


def load_yaml(text: str, kind: Literal["safe", "rt"] = "safe") -> object:
    """Return the data in a YAML text.

    Args:
        text: One document.
        kind: "safe": plain data; "rt": ruamel.yaml's containers, which know their lines.

    Raises:
        YamlTextError: it is not YAML, a value does not fit its tag (`!!int x`), or it is nested too
            deeply or has too many values.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError

    _check_depth(text)
    try:
        data: object = YAML(typ=kind, pure=True).load(text)
        # Only a text with anchors and aliases can have more values than its length allows.
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
    except Exception as error:  # ruamel.yaml: any exception, for a value that does not fit its tag
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
