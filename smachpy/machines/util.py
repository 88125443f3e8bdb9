"""The interface of a callback, and the other names of SMACH's module `util`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, ParamSpec, TypeVar

from smachpy.base.problems import Problems, unique_names
from smachpy.engine.shutdown_check import is_shutdown, set_shutdown_check
from smachpy.machines.preempt_handler import set_preempt_handler
from smachpy.machines.state import has_smach_interface

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.base.names import Names

__all__ = [
    "CBInterface",
    "cb_interface",
    "has_smach_interface",
    "is_shutdown",
    "set_preempt_handler",
    "set_shutdown_check",
]

P = ParamSpec("P")
R_co = TypeVar("R_co", covariant=True)


class CBInterface(Generic[P, R_co]):
    """A callback together with the outcomes and keys that it adds to its state.

    Args:
        cb: The callback.
        outcomes: Outcomes that it may return.
        input_keys: Userdata keys that it reads.
        output_keys: Userdata keys that it writes.
        io_keys: Keys that it reads and writes.
    """

    def __init__(
        self,
        cb: Callable[P, R_co],
        outcomes: Names | None = None,
        input_keys: Names | None = None,
        output_keys: Names | None = None,
        io_keys: Names | None = None,
    ) -> None:
        problems = Problems(type(self).__name__)
        problems.function("cb", cb, "cb(userdata, ...)", optional=False, plain=False)
        problems.raise_all()
        both = unique_names(io_keys or (), "io_keys")
        self._cb = cb
        self._outcomes = unique_names(outcomes or (), "outcomes")
        self._input_keys = unique_names((*unique_names(input_keys or (), "input_keys"), *both))
        self._output_keys = unique_names((*unique_names(output_keys or (), "output_keys"), *both))
        self.__doc__ = cb.__doc__
        self.__name__ = getattr(cb, "__name__", type(cb).__name__)
        self.__wrapped__ = cb

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R_co:
        """Call the callback."""
        return self._cb(*args, **kwargs)

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        """Bind to an instance, so that the decorator works on methods too."""
        if instance is None or not hasattr(self._cb, "__get__"):
            return self
        bound = self._cb.__get__(instance, owner)
        return CBInterface(bound, self._outcomes, self._input_keys, self._output_keys)

    def get_registered_outcomes(self) -> tuple[str, ...]:
        """Return the outcomes, in the order of their declaration."""
        return self._outcomes

    def get_registered_input_keys(self) -> tuple[str, ...]:
        """Return the keys that the callback reads."""
        return self._input_keys

    def get_registered_output_keys(self) -> tuple[str, ...]:
        """Return the keys that the callback writes."""
        return self._output_keys


class cb_interface:  # noqa: N801  SMACH's name
    """Decorator that declares a callback's outcomes and keys; returns a `CBInterface`."""

    def __init__(
        self,
        outcomes: Names | None = None,
        input_keys: Names | None = None,
        output_keys: Names | None = None,
        *,
        io_keys: Names | None = None,
    ) -> None:
        problems = Problems("cb_interface")
        self._interface = (
            problems.names("outcomes", outcomes or ()),
            problems.names("input_keys", input_keys or ()),
            problems.names("output_keys", output_keys or ()),
            problems.names("io_keys", io_keys or ()),
        )
        problems.raise_all()

    def __call__(self, cb: Callable[P, R_co]) -> CBInterface[P, R_co]:
        """Attach the interface to `cb`."""
        return CBInterface(cb, *self._interface)
