"""YAML from files and command lines: parsed to plain data, or refused with a reason."""

from __future__ import annotations

import re
from copy import deepcopy
from functools import lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

MAX_YAML_PARTS: Final = 100_000
"""Most values of a text, aliases and merged keys followed; a few lines can stand for billions."""

MAX_YAML_LENGTH: Final = 1_000_000
"""Longest text [characters]; the parser, which knows the lines, takes about 10 s for it."""

MAX_YAML_NESTING: Final = 200
"""Most levels of brackets; with more, the parser takes seconds and runs out of stack."""

MAX_YAML_NUMBER: Final = 1000
"""Longest whole number [characters]: Python cannot write those of more than 4300 digits."""

_KEPT_LENGTH: Final = 10_000
"""Longest text whose data are kept for the next time [characters]."""


class YamlTextError(ValueError):
    """A text is not YAML, or is refused.

    Attributes:
        line: Number of the line, from 1; 0: unknown.
        column: Number of the column, from 1; 0: unknown.
        reason: The reason, on one line.
    """

    def __init__(self, reason: str, line: int = 0, column: int = 0) -> None:
        self.line = line
        self.column = column
        self.reason = " ".join(reason.split())
        super().__init__(f"line {line}: {self.reason}" if line else self.reason)


def load_yaml(text: str) -> object:
    """Return the data in a YAML text.

    Args:
        text: One document.

    Raises:
        YamlTextError: it is not YAML, a value does not fit its tag (`!!int x`), or it is too long,
            nested too deeply, or has too many values.
    """
    return load_with_lines(text)[0]


def load_with_lines(text: str) -> tuple[object, dict[str, int]]:
    """Return the data in a YAML text, and the line of each value by its path ("robots[0].x").

    Raises:
        YamlTextError: as for `load_yaml`.
    """
    data, marks = load_with_marks(text)
    return data, {path: line for path, (line, _) in marks.items()}


def load_with_marks(text: str) -> tuple[object, dict[str, tuple[int, int]]]:
    """Return the data in a YAML text, and the line and column of each value, both from 1.

    Raises:
        YamlTextError: as for `load_yaml`.
    """
    if len(text) > _KEPT_LENGTH:
        return _parsed(text)
    data, marks = _kept(text)
    try:
        return deepcopy(data), marks.copy()
    except RecursionError as error:
        raise YamlTextError("it is nested too deeply") from error


def _parsed(text: str) -> tuple[object, dict[str, tuple[int, int]]]:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError
    from ruamel.yaml.reader import ReaderError

    if len(text) > MAX_YAML_LENGTH:
        raise YamlTextError(f"got {len(text):,} characters; expected at most {MAX_YAML_LENGTH:,}")
    _check_depth(text)
    yaml = YAML(typ="safe", pure=True)
    yaml.composer.warn_double_anchors = False  # YAML 1.2 allows a second one of that name
    try:
        root = yaml.compose(text)
        if root is None:
            return None, {}
        # Only a text with anchors and aliases can have more values than its length allows. They are
        # counted before the values are made: merged keys (`<<`) multiply while that is done.
        if "*" in text and "&" in text:
            _count_values(root, {})
        _check_numbers(root, set())
        data: object = yaml.constructor.construct_document(root)
        return data, dict(_marks(yaml.constructor, root, ""))
    except YamlTextError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = (0, 0) if mark is None else (int(mark.line) + 1, int(mark.column) + 1)
        raise YamlTextError(str(error.problem or error.context), *place) from error
    except ReaderError as error:  # a control character
        problem = f"the character {chr(error.character)!r} is not allowed"
        raise YamlTextError(problem, *_place_in(text, error.position)) from error
    except RecursionError as error:
        raise YamlTextError("it is nested too deeply") from error
    except Exception as error:  # ruamel.yaml: any exception, for a value that does not fit its tag
        raise YamlTextError(str(error) or type(error).__name__) from error


# Each run of an exploration makes its mission, and so reads the same files again. The parser, which
# is in Python, took most of the time of short runs.
_kept = lru_cache(maxsize=64)(_parsed)


def _check_depth(text: str) -> None:
    depth = 0
    for bracket in re.finditer(r"[\[\]{}]", text):
        depth = depth + 1 if bracket[0] in "[{" else max(depth - 1, 0)
        if depth > MAX_YAML_NESTING:
            raise YamlTextError(
                f"it is nested too deeply: more than {MAX_YAML_NESTING} brackets",
                *_place_in(text, bracket.start()),
            )


def _place_in(text: str, position: int) -> tuple[int, int]:
    """Return line and column of a position, all but the position from 1."""
    return text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)


def _check_numbers(node: Any, known: set[int]) -> None:
    """Refuse whole numbers that cannot be written again.

    Args:
        node: A node of ruamel.yaml.
        known: Ids of the nodes that were looked at: aliases lead to one of them again.

    Raises:
        YamlTextError: there is one.
    """
    if node.id == "scalar":
        if len(node.value) > MAX_YAML_NUMBER and node.tag.endswith(":int"):
            got = f"a number of {len(node.value):,} characters"
            raise YamlTextError(f"got {got}; expected {MAX_YAML_NUMBER} at most", *_place(node))
    elif id(node) not in known:
        known.add(id(node))
        parts = node.value if node.id == "sequence" else chain.from_iterable(node.value)
        for part in parts:
            _check_numbers(part, known)


def _count_values(node: Any, known: dict[int, int]) -> int:
    """Return the number of values that a node of ruamel.yaml stands for.

    Args:
        node: The node.
        known: Id of a node -> its number; 0 while it is being counted.

    Raises:
        YamlTextError: there are too many, or a value contains itself.
    """
    count = known.get(id(node))
    if count == 0:
        raise YamlTextError("a value contains itself", *_place(node))
    if count is None:
        known[id(node)] = 0
        parts = node.value if node.id in {"mapping", "sequence"} else ()
        pairs = chain.from_iterable(parts) if node.id == "mapping" else parts
        count = 1 + sum(_count_values(part, known) for part in pairs)
        known[id(node)] = count
    if count > MAX_YAML_PARTS:
        problem = f"its aliases stand for more than {MAX_YAML_PARTS} values"
        raise YamlTextError(problem, *_place(node))
    return count


def _marks(constructor: Any, node: Any, path: str) -> Iterator[tuple[str, tuple[int, int]]]:
    """Yield the path and place of each value below a node of ruamel.yaml."""
    if node.id == "mapping":
        for key_node, value in node.value:
            key = constructor.construct_object(key_node, deep=True)
            inside = f"{path}.{key}" if path else str(key)
            yield inside, _place(key_node)
            yield from _marks(constructor, value, inside)
    elif node.id == "sequence":
        for i, entry in enumerate(node.value):
            yield f"{path}[{i}]", _place(entry)
            yield from _marks(constructor, entry, f"{path}[{i}]")


def _place(node: Any) -> tuple[int, int]:
    return int(node.start_mark.line) + 1, int(node.start_mark.column) + 1
