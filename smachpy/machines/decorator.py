"""`@smachpy.state(...)`: a plain function as a state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.machines.state import CBState, Retry, State
from smachpy.machines.state import StateOptions as _StateOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import Unpack


class FunctionState(CBState):
    """A state made from a function `f(userdata) -> outcome`; calling it calls the function."""

    def __init__(
        self,
        function: Callable[..., Any],
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        io_keys: Iterable[str] = (),
        **options: Unpack[_StateOptions],
    ) -> None:
        super().__init__(function, (), None, outcomes, input_keys, output_keys, io_keys, **options)
        self.__doc__ = function.__doc__
        self.__name__ = getattr(function, "__name__", "state")
        self.__wrapped__ = function

    def __call__(self, userdata: Any) -> Any:
        """Call the function, as a test of it does."""
        return self._smachpy.code[0](userdata)


class _StateDecorator:
    """The decorator `@smachpy.state(outcomes, ...)`; see `help(smachpy.state.__call__)`.

    Its attributes are those of SMACH's module `smach.state`: programs write `smach.state.State`;
    here the name `state` is the decorator, so both must work.
    """

    State: ClassVar[type[State]] = State
    CBState: ClassVar[type[CBState]] = CBState
    Retry: ClassVar[type[Retry]] = Retry
    StateOptions: ClassVar[Any] = _StateOptions

    def __call__(
        self,
        outcomes: Iterable[str],
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        io_keys: Iterable[str] = (),
        **options: Unpack[_StateOptions],
    ) -> Callable[[Callable[..., Any]], FunctionState]:
        """Turn a function `f(userdata) -> outcome`, plain or `async`, into a state.

            @smachpy.state(outcomes=["charged", "failed"], output_keys=["level"])
            def charge(userdata):
                userdata.level = 1.0
                return "charged"

            StateMachine.add("CHARGE", charge, {"charged": "DRIVE"})

        In the function, `smachpy.current_state()` is the state, for `sleep` and
        `preempt_requested`.

        Args:
            outcomes: Names of the ways it can end; the function returns one of them.
            input_keys: Userdata keys that it reads.
            output_keys: Userdata keys that it writes.
            io_keys: Keys that it reads and writes.
            **options: See `StateOptions`.

        Raises:
            InvalidStateError: a list or an option is wrong, or the function cannot be called so.

        Threads: the function runs in the thread of its container.
        """

        def make(function: Callable[..., Any]) -> FunctionState:
            return FunctionState(function, outcomes, input_keys, output_keys, io_keys, **options)

        return make


state = _StateDecorator()
