"""Which containers are open: `with sm:` and the `add` functions that find them.

The open containers are a context variable, so machines can be built in several threads and
coroutines at once, and an exception inside a `with` leaves nothing behind.
"""

from __future__ import annotations

import types
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Concatenate, Generic, NoReturn, ParamSpec, TypeVar

from smachpy.exceptions import InvalidConstructionError

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.container import Container

P = ParamSpec("P")
R_co = TypeVar("R_co", covariant=True)

OPEN: ContextVar[tuple[Container, ...]] = ContextVar("smachpy_open_containers", default=())


def innermost(kind: type[Container]) -> Any:
    """Return the container of this kind that was opened last, else None."""
    for container in reversed(OPEN.get()):
        if isinstance(container, kind):
            return container
    return None


class _NoneOpen:
    """Stands in for the container when none is open: any use of it says so."""

    def __init__(self, kind: type, name: str) -> None:
        object.__setattr__(self, "_what", (kind.__name__, name))

    def __getattr__(self, _name: str) -> NoReturn:
        kind, name = object.__getattribute__(self, "_what")
        opened = [type(container).__name__ for container in OPEN.get()]
        raise InvalidConstructionError(
            f"{kind}.{name}: no {kind} is open: got open containers {opened}; expected one. "
            f"Try `with sm:` around it, or call {name} on the container itself."
        )


class construction_method(Generic[P, R_co]):  # noqa: N801  a decorator
    """A method that, called on the class, works on the innermost open container of that class."""

    def __init__(self, function: Callable[Concatenate[Any, P], R_co]) -> None:
        self._function = function
        self.__doc__ = function.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type[Any]) -> Callable[P, R_co]:
        container = instance if instance is not None else innermost(owner)
        if container is None:
            container = _NoneOpen(owner, self._name)
        return types.MethodType(self._function, container)
