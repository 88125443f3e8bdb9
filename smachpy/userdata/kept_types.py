"""Classes whose instances can be kept in a journal: `smachpy.register_type`."""

from __future__ import annotations

import dataclasses
import enum
import inspect
import typing
from typing import TYPE_CHECKING, Any, Final, TypeVar

from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Callable

C = TypeVar("C", bound=type)

NO_CONSTRUCTOR: Final = "its constructor takes more than its fields"


@dataclasses.dataclass(frozen=True)
class RegisteredType:
    """A class, and the functions that convert its instances, if it needs them."""

    kind: type
    to_data: Callable[[Any], Any] | None = None
    from_data: Callable[[Any], Any] | None = None


REGISTERED: Final[dict[str, RegisteredType]] = {}  # by `name_of`


def register_type(
    kind: C,
    *,
    to_data: Callable[[Any], Any] | None = None,
    from_data: Callable[[Any], Any] | None = None,
) -> C:
    """Allow instances of a class in journals; also usable as a decorator.

    Dataclasses, named tuples and enums need no functions; the dataclasses, named tuples and enums
    in the annotations of their fields are registered too. A subclass must be registered itself.

    Args:
        kind: The class; register it at each start, before the mission runs.
        to_data: For any other class: converts an instance to a value that can be kept.
        from_data: Converts it back.

    Returns:
        `kind`.

    Raises:
        InvalidStateError: `kind` is not a class, or it needs both functions.
    """
    if not isinstance(kind, type):
        raise InvalidStateError(f"register_type: got {kind!r}; expected a class.")
    if (to_data is None) != (from_data is None):
        raise InvalidStateError(
            f"register_type: {kind.__qualname__}: got one of to_data and from_data; expected both."
        )
    if to_data is None:
        problem = problem_of(kind)
        if problem is not None:
            raise InvalidStateError(
                f"register_type: got {kind.__qualname__} ({problem}); expected a dataclass, a "
                "named tuple or an enum. Try to_data=... and from_data=..."
            )
    REGISTERED[name_of(kind)] = RegisteredType(kind, to_data, from_data)
    if to_data is None:
        register_annotations(kind)
    return kind


def register_annotations(kind: type) -> None:
    """Register the classes in the annotations of a class, if they need no functions.

    Args:
        kind: A dataclass, a TypedDict or another class; its annotations may be nested,
            `dict[str, list[Waypoint]]`.
    """
    try:
        hints = typing.get_type_hints(kind)
    except Exception:  # noqa: BLE001  a name imported under TYPE_CHECKING: nothing is registered
        hints = {}
    for hint in hints.values():
        _register_hint(hint)


def _register_hint(hint: Any) -> None:
    for inner in typing.get_args(hint):
        _register_hint(inner)
    if not isinstance(hint, type) or name_of(hint) in REGISTERED:
        return
    if typing.is_typeddict(hint):
        register_annotations(hint)
    elif problem_of(hint) is None:
        register_type(hint)


def problem_of(kind: type) -> str | None:
    """Return why a class needs `to_data` and `from_data`; None if it does not."""
    if issubclass(kind, enum.Enum) or is_named_tuple(kind):
        return None
    if not dataclasses.is_dataclass(kind):
        return "it is another class"
    fields = {field.name for field in dataclasses.fields(kind)}
    constructor = inspect.signature(kind).parameters if kind.__dataclass_params__.init else ()  # type: ignore[attr-defined]
    return None if fields.issuperset(constructor) else NO_CONSTRUCTOR


def is_named_tuple(kind: type) -> bool:
    """Return whether a class is a named tuple."""
    return issubclass(kind, tuple) and hasattr(kind, "_fields")


def name_of(kind: type) -> str:
    """Return the name of a class in journals: "module:Class"."""
    return f"{kind.__module__}:{kind.__qualname__}"
