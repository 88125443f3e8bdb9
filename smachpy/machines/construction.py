"""The open containers: `with sm:`, and the `add` functions that work on the innermost one.

They are in a context variable (SMACH: a class attribute), so that machines can be built in several
threads and coroutines at once, and an exception inside a `with` leaves no container open.
"""

from __future__ import annotations

import contextlib
import functools
import types
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Concatenate, Generic, NoReturn, ParamSpec, TypeVar

from smachpy.base.slips import accepts
from smachpy.exceptions import InconsistentMachineError, InvalidConstructionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType
    from typing import Self

P = ParamSpec("P")
R_co = TypeVar("R_co", covariant=True)

OPEN: ContextVar[tuple[Openable, ...]] = ContextVar("smachpy_open_containers", default=())


def innermost(kind: type) -> Any:
    """Return the innermost open container of this kind, or None."""
    for container in reversed(OPEN.get()):
        if isinstance(container, kind):
            return container
    return None


class construction_method(Generic[P, R_co]):  # noqa: N801  a decorator
    """A method that works on the innermost open container if it is called on the class."""

    def __init__(self, function: Callable[Concatenate[Any, P], R_co]) -> None:
        self._function = self.__wrapped__ = function
        self.__doc__ = function.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type[Any]) -> Callable[P, R_co]:
        container = instance if instance is not None else innermost(owner)
        if container is not None:
            return types.MethodType(self._function, container)

        # Raised by the call, not here, so that `StateMachine.add` itself can be read, by `help` for
        # instance.
        @functools.wraps(self._function)
        def refuse(kind: type, *_args: Any, **_kwargs: Any) -> NoReturn:
            opened = [type(container).__name__ for container in OPEN.get()]
            raise InvalidConstructionError(
                f"{kind.__name__}.{self._name}: no {kind.__name__} is open: got open containers "
                f"{opened}; expected one. Try `with sm:` around it, or call {self._name} on the "
                "container itself."
            )

        return types.MethodType(refuse, owner)


class Openable:
    """A container as a context manager."""

    _smachpy: Any

    def check_consistency(self) -> None:
        """Check this container and all containers below it."""
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
        """Close it; the outermost container checks everything below it."""
        OPEN.reset(self._smachpy.open_tokens.pop())
        # Not after an error, whose message would be hidden by those of a half-built machine.
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
        """Close the container after `open`.

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
        """Return whether `add` goes to this container."""
        return bool(OPEN.get()) and OPEN.get()[-1] is self

    def assert_opened(self, msg: str = "") -> None:
        """Raise an error unless the container is open."""
        if not self.is_opened():
            raise InvalidConstructionError(
                f"{type(self).__name__}: not open: expected `with sm:`. {msg}".rstrip()
            )

    # SMACH's names, for containers that users have written themselves.

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
