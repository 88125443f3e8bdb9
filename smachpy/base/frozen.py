"""Values that do not change, for classes that users make objects of."""

from __future__ import annotations

from typing import Any


class Frozen:
    """Its attributes are those of `__slots__`; a `_name` counts neither for `==` nor in `repr`.

    It is what a frozen dataclass is. `import smachpy` makes no dataclasses: to generate their
    methods, and to import `dataclasses` with `inspect`, took more than a third of its time.
    """

    __slots__: tuple[str, ...] = ()

    def _set(self, **values: Any) -> None:
        """Set the attributes, in `__init__` only."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _shown(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.__slots__ if not name.startswith("_")}

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"cannot assign to {name!r}: a {type(self).__name__} does not change")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"cannot delete {name!r}: a {type(self).__name__} does not change")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)) or not isinstance(self, type(other)):
            return NotImplemented
        return self._shown() == other._shown()

    def __hash__(self) -> int:
        return hash(tuple(self._shown().values()))

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value!r}" for name, value in self._shown().items())
        return f"{type(self).__name__}({values})"

    def __setstate__(self, state: tuple[None, dict[str, Any]]) -> None:
        self._set(**state[1])  # of a copy, or out of a pickle
