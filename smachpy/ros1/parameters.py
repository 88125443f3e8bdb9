"""Parameters: a tree of values under ROS names, as on ROS 1's parameter server.

Source:
    https://wiki.ros.org/Parameter%20Server for types, namespaces and `search_param`.
"""

from __future__ import annotations

import contextlib
import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError
from actionlib_core.inputs.checked_file import CheckedFile
from actionlib_core.inputs.suggest import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from actionlib_core.inputs.checked_file import Problem
    from actionlib_core.ros1.bridging import Ros1Bridge


class ParameterFileError(ActionlibError):
    """A file of parameters cannot be read.

    Try: correct the YAML at the line that is shown.

    Attributes:
        path: The file.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.path = Path(problems[0].file)
        super().__init__("\n".join(f"parameters {problem}" for problem in problems))


class Parameters:
    """A tree of values. Names are full, with or without a slash in front.

    Attributes:
        robot: The bridge to a robot, from which values that are missing here are read at each call.
            It is never written. None: there is no robot.

    Threads: any; single operations on dicts are atomic in CPython, and reading returns a copy.
    """

    def __init__(self) -> None:
        self._tree: dict[str, Any] = {}
        self.robot: Ros1Bridge | None = None

    def get(self, name: str) -> Any:
        """Return a copy of a value; for a namespace, a dict of its values.

        Raises:
            KeyError: there is none.
        """
        found: list[Any] = []
        with contextlib.suppress(KeyError):
            found.append(copy.deepcopy(self._find(name)))
        # A namespace may have values on both sides.
        if self.robot is not None and (not found or isinstance(found[0], dict)):
            with contextlib.suppress(KeyError):
                found.append(self.robot.get_param(f"/{_clean(name)}"))
        if not found:
            known = self.names()
            raise KeyError(
                f"parameter '/{_clean(name)}': got no value; expected one."
                + did_you_mean(f"/{_clean(name)}", known)
            )
        return _merged(*found)

    def set(self, name: str, value: Any) -> None:
        """Set a value; a dict becomes a namespace."""
        words = _words(name)
        value = _plain(value)
        if not words:
            if not isinstance(value, dict):
                raise TypeError(f"parameter '/': got {value!r}; expected a dict.")
            self._tree = value
            return
        tree = self._tree
        for word in words[:-1]:
            below = tree.get(word)
            if not isinstance(below, dict):
                below = tree[word] = {}
            tree = below
        tree[words[-1]] = value

    def merge(self, name: str, values: dict[Any, Any]) -> None:
        """Set every value of a tree below `name`, and keep the other values there."""
        for key, value in values.items():
            full = f"{_clean(name)}/{key}"
            if isinstance(value, dict) and value:
                self.merge(full, value)
            else:
                self.set(full, value)

    def has(self, name: str) -> bool:
        """Return whether a name has a value."""
        try:
            self._find(name)
        except KeyError:
            return self.robot is not None and f"/{_clean(name)}" in self._robot_names()
        return True

    def delete(self, name: str) -> None:
        """Delete a value, or a whole namespace.

        Raises:
            KeyError: there is none.
        """
        words = _words(name)
        if not words:
            self._tree = {}
            return
        tree = self._find("/".join(words[:-1]))
        if not isinstance(tree, dict) or words[-1] not in tree:
            raise KeyError(f"parameter '/{_clean(name)}': got no value; expected one to delete.")
        del tree[words[-1]]

    def search(self, namespace: str, key: str) -> str | None:
        """Return the full name of `key` in the nearest namespace from `namespace` upwards.

        Only the first word of `key` must exist there, as on ROS 1's server.
        """
        words = _words(namespace)
        wanted = _clean(key)
        first = wanted.partition("/")[0]
        while True:
            if self.has("/".join([*words, first])):
                return "/" + "/".join([*words, wanted])
            if not words:
                return None
            words.pop()

    def names(self) -> list[str]:
        """Return the full names of all values, including the robot's."""
        own = [f"/{name}" for name in _leaves(self._tree)]
        return own if self.robot is None else sorted({*own, *self.robot.param_names()})

    def _robot_names(self) -> Collection[str]:
        """Return the names of the robot's values and of their namespaces."""
        assert self.robot is not None
        words = [_words(name) for name in self.robot.param_names()]
        return {f"/{'/'.join(name[:end])}" for name in words for end in range(1, len(name) + 1)}

    def load(self, path: Path, namespace: str = "/") -> None:
        """Set the values of a YAML file below `namespace`.

        Raises:
            ParameterFileError: the file cannot be read, or is not a dict.
        """
        values = read_file(path)
        self.merge(namespace, values)

    def _find(self, name: str) -> Any:
        found: Any = self._tree
        for word in _words(name):
            if not isinstance(found, dict):
                raise KeyError(name)
            found = found[word]
        return found


def read_file(path: Path) -> dict[str, Any]:
    """Return the values of a YAML file of parameters.

    Raises:
        ParameterFileError: the file cannot be read, or is not a dict.
    """
    top = CheckedFile(path, ParameterFileError, may_be_empty=True).top
    return {name: top.value(name) for name in top}


def _clean(name: str) -> str:
    return "/".join(_words(name))


def _words(name: str) -> list[str]:
    return [word for word in name.split("/") if word]


def _leaves(tree: dict[str, Any]) -> Iterator[str]:
    for name, value in tree.items():
        if isinstance(value, dict) and value:
            yield from (f"{name}/{below}" for below in _leaves(value))
        else:
            yield name


def _merged(own: Any, robots: Any = None) -> Any:
    """Return a value of the program, which hides the robot's; of two namespaces, both's values."""
    if not (isinstance(own, dict) and isinstance(robots, dict)):
        return own
    return robots | {key: _merged(value, robots.get(key)) for key, value in own.items()}


def _plain(value: Any) -> Any:
    """Return a copy as the server keeps it: tuples are lists, keys of dicts are strings."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value
