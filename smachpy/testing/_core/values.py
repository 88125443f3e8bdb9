"""Userdata in an exploration: compared often, copied often, and mostly unchangeable."""

from __future__ import annotations

import copy
import dataclasses
from typing import TYPE_CHECKING, Any

from smachpy._core.readonly import ATOMS, writable

if TYPE_CHECKING:
    from collections.abc import Hashable


class Values:
    """Gives values as what can be compared; one that cannot change is looked at only once."""

    def __init__(self) -> None:
        self._texts: dict[int, tuple[object, str]] = {}  # with the object, so that it keeps its id

    def comparable(self, value: Any) -> Hashable:
        """Return something equal for values that look the same."""
        value = writable(value)
        kind = type(value)
        if kind in ATOMS:
            return repr(value)
        known = self._texts.get(id(value))
        if known is not None:
            return known[1]
        if kind is list or kind is tuple:
            return (kind.__name__, *[self.comparable(item) for item in value])
        text = repr(value)
        if is_frozen(value):
            self._texts[id(value)] = (value, text)
        return text


class Snapshot:
    """A dict to be copied again and again; what cannot change in it is shared by the copies."""

    def __init__(self, data: dict[str, Any]) -> None:
        self._data = data
        self._shared: dict[int, Any] = {}
        for value in data.values():
            self._share(value)

    def copy(self) -> dict[str, Any]:
        """Return a deep copy."""
        return copy.deepcopy(self._data, dict(self._shared))

    def _share(self, value: Any) -> None:
        if type(value) in ATOMS:
            return
        if is_frozen(value):
            self._shared[id(value)] = value
        elif type(value) is list:
            for item in value:
                self._share(item)


def is_frozen(value: Any) -> bool:
    """Tell whether nothing in it can be changed: numbers, texts, tuples, frozen dataclasses."""
    if type(value) in ATOMS:
        return True
    if isinstance(value, tuple):
        return not hasattr(value, "__dict__") and all(map(is_frozen, value))
    parameters = getattr(type(value), "__dataclass_params__", None)
    if parameters is None or not parameters.frozen:
        return False
    return all(is_frozen(getattr(value, field.name)) for field in dataclasses.fields(value))
