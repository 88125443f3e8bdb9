"""Which containers are open: `with sm:` and the `add` functions that find them.

The open containers are a context variable, so machines can be built in several threads and
coroutines at once, and an exception inside a `with` leaves nothing behind.
"""

from __future__ import annotations

import contextlib
import types
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Concatenate, Generic, NoReturn, ParamSpec, TypeVar

from smachpy.exceptions import InconsistentMachineError, InvalidConstructionError
from smachpy.slips import accepts

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType
    from typing import Self

P = ParamSpec("P")
R_co = TypeVar("R_co", covariant=True)

OPEN: ContextVar[tuple[Openable, ...]] = ContextVar("smachpy_open_containers", default=())


def innermost(kind: type) -> Any:
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


class Openable:
    """The part of a container that `with` opens."""

    _smachpy: Any

    def check_consistency(self) -> None:
        """Check the container and all below it."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        """Open the container for `add`."""
        self._smachpy.open_tokens.append(OPEN.set((*OPEN.get(), self)))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close it; at the outermost container everything is checked."""
        OPEN.reset(self._smachpy.open_tokens.pop())
        if error is None and not OPEN.get() and self._smachpy.context_kwargs.get("check", True):
            try:
                self.check_consistency()
            except InconsistentMachineError as problems:
                if not accepts(str(problems)):  # SMACH only logged it here
                    raise

    @contextlib.contextmanager
    def opened(self, **kwargs: Any) -> Iterator[Self]:
        """Open the container in a `with` block.

        Args:
            **kwargs: `check=False` leaves the check to the next `with` or to `execute`, so that
                a machine can be built in several steps.
        """
        before, self._smachpy.context_kwargs = self._smachpy.context_kwargs, kwargs
        try:
            with self:
                yield self
        finally:
            self._smachpy.context_kwargs = before

    def open(self) -> None:
        """Open the container for `add`, until `close`."""
        self.__enter__()

    def close(self) -> None:
        """Close what `open` opened.

        Raises:
            InvalidConstructionError: it is not the container that was opened last.
        """
        if not OPEN.get() or OPEN.get()[-1] is not self:
            raise InvalidConstructionError(
                f"{type(self).__name__}.close: it is not the container opened last: got "
                f"{[type(c).__name__ for c in OPEN.get()]} open; expected it last."
            )
        self.__exit__(None, None, None)

    def is_opened(self) -> bool:
        """Tell whether `add` goes to this container."""
        return bool(OPEN.get()) and OPEN.get()[-1] is self

    def assert_opened(self, msg: str = "") -> None:
        """Raise unless it is open."""
        if not self.is_opened():
            raise InvalidConstructionError(
                f"{type(self).__name__}: not open: expected `with sm:`. {msg}".rstrip()
            )

    @classmethod
    def _any_containers_opened(cls) -> bool:
        return bool(OPEN.get())

    @classmethod
    def _currently_opened_container(cls) -> Any:
        found = innermost(cls)
        if found is None:
            raise InvalidConstructionError(
                f"{cls.__name__}: none is open; expected one. Try `with sm:`."
            )
        return found
