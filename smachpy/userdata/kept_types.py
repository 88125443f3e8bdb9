"""Classes whose instances a journal keeps: `smachpy.register_type`."""

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
    """A class, and how its instances become values that can be kept, where they are none."""

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
    """Let journals keep the instances of a class; also a decorator.

    Dataclasses, named tuples and enums need no more than that, and bring along those of the same
    kinds that their fields are annotated with. A subclass is another class.

    Args:
        kind: The class; it must be registered before the mission runs, at each start.
        to_data: Of other classes: makes an instance a value that can be kept.
        from_data: The reverse.

    Returns:
        `kind`.

    Raises:
        InvalidStateError: it is no class, or one that needs both functions.
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
                f"register_type: got {kind.__qualname__}: {problem}; expected a dataclass, a named "
                "tuple or an enum. Try to_data=... and from_data=..."
            )
    REGISTERED[name_of(kind)] = RegisteredType(kind, to_data, from_data)
    if to_data is None:
        register_annotations(kind)
    return kind


def register_annotations(kind: type) -> None:
    """Register what the fields of a class are annotated with, as far as it registers by itself.

    Args:
        kind: A dataclass, a TypedDict or another class; its annotations may be nested,
            `dict[str, list[Waypoint]]`.
    """
    try:
        hints = typing.get_type_hints(kind)
    except Exception:  # noqa: BLE001  a name that only type checkers see: that field is left out
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
    """Say why a class needs functions of its own, None when it does not."""
    if issubclass(kind, enum.Enum) or is_named_tuple(kind):
        return None
    if not dataclasses.is_dataclass(kind):
        return "it is another class"
    fields = {field.name for field in dataclasses.fields(kind)}
    constructor = inspect.signature(kind).parameters if kind.__dataclass_params__.init else ()  # type: ignore[attr-defined]
    return None if fields.issuperset(constructor) else NO_CONSTRUCTOR


def is_named_tuple(kind: type) -> bool:
    """Tell whether a class is a named tuple."""
    return issubclass(kind, tuple) and hasattr(kind, "_fields")


def name_of(kind: type) -> str:
    """Return the name of a class in journals: "module:Class"."""
    return f"{kind.__module__}:{kind.__qualname__}"
