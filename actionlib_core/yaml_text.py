"""YAML from files and command lines: parsed to plain data, or refused with a reason."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

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


def load_yaml(text: str) -> object:
    """Return the data in a YAML text.

    Args:
        text: One document.

    Raises:
        YamlTextError: it is not YAML, a value does not fit its tag (`!!int x`), or it is nested too
            deeply or has too many values.
    """
    return load_with_lines(text)[0]


def load_with_lines(text: str) -> tuple[object, dict[str, int]]:
    """Return the data in a YAML text, and the line of each value by its path ("robots[0].x").

    Raises:
        YamlTextError: as for `load_yaml`.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError

    _check_depth(text)
    yaml = YAML(typ="safe", pure=True)
    try:
        root = yaml.compose(text)
        if root is None:
            return None, {}
        data: object = yaml.constructor.construct_document(root)
        # Only a text with anchors and aliases can have more values than its length allows.
        if "*" in text and "&" in text:
            _check_size(data)
        return data, dict(_lines(yaml.constructor, root, ""))
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


def _lines(constructor: Any, node: Any, path: str) -> Iterator[tuple[str, int]]:
    """Yield the path and line of each value below a node of ruamel.yaml."""
    if node.id == "mapping":
        for key_node, value in node.value:
            key = constructor.construct_object(key_node, deep=True)
            inside = f"{path}.{key}" if path else str(key)
            yield inside, key_node.start_mark.line + 1
            yield from _lines(constructor, value, inside)
    elif node.id == "sequence":
        for i, entry in enumerate(node.value):
            yield f"{path}[{i}]", entry.start_mark.line + 1
            yield from _lines(constructor, entry, f"{path}[{i}]")
