"""Servers that belong to a mission: for each run of a machine, or for one state."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from smachpy.base.problems import Problems
from smachpy.machines.state import State, get_options, set_options
from smachpy.machines.state_machine import StateMachine

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import Unpack

    from smachpy.machines.container import Container
    from smachpy.machines.state import StateOptions
    from smachpy.userdata.user_data import UserData


class Closeable(Protocol):
    """A server that is on the network until `close`, such as a `Service`."""

    def close(self) -> None:
        """Leave the network."""
        ...


class Stoppable(Protocol):
    """A server that is on the network until `stop`, such as an action server."""

    def stop(self) -> None:
        """Leave the network."""
        ...


Server: TypeAlias = Closeable | Stoppable


def serve_during(machine: Container, *makers: Callable[[], Server]) -> None:
    """Make servers when `machine` starts, and close them in reverse order when it has ended.

    They are closed when it raises, too; one attempt of `retry` has servers of its own.

    Args:
        machine: The machine.
        *makers: Functions that make one server each.

    Raises:
        InvalidStateError: one of them cannot be called without arguments.
    """
    _check("serve_during", makers)
    stack = ExitStack()

    def start(_userdata: UserData, _initial: object) -> None:
        stack.close()  # of an attempt that has raised
        _open(stack, makers)

    def end(_userdata: UserData, _final: object, _outcome: str) -> None:
        stack.close()

    hook = get_options(machine).on_exit

    def leave(userdata: UserData, outcome: str | None) -> None:
        try:
            if hook is not None:
                hook(userdata, outcome)
        finally:
            stack.close()

    machine.register_start_cb(start)
    machine.register_termination_cb(end)
    set_options(machine, on_exit=leave)  # termination callbacks are not called if it raises


def _check(where: str, makers: Iterable[object]) -> None:
    problems = Problems(where)
    for maker in makers:
        problems.function("maker", maker, "maker()", 0, optional=False)
    problems.raise_all()


def _open(stack: ExitStack, makers: Iterable[Callable[[], Server]]) -> None:
    for make in makers:
        server: Any = make()
        stack.callback(server.close if hasattr(server, "close") else server.stop)


class Serve(State):
    """Keeps servers on the network until the state is preempted, by Ctrl-C for example.

    Args:
        *makers: Functions that make one server each.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: one of them cannot be called without arguments, or an option is wrong.
    """

    def __init__(self, *makers: Callable[[], Server], **options: Unpack[StateOptions]) -> None:
        _check("Serve", makers)
        super().__init__(outcomes=["preempted"], **options)
        self.__makers = makers

    def execute(self, userdata: UserData) -> str:
        """Serve until the preempt.

        Blocks: until then.
        """
        del userdata
        with ExitStack() as stack:
            _open(stack, self.__makers)
            self.wait_preempt()
        return "preempted"


def serving_machine(name: str, *makers: Callable[[], Server]) -> StateMachine:
    """Return a machine that serves until it is preempted."""
    sm = StateMachine(outcomes=["preempted"], name=name)
    sm.add("SERVE", Serve(*makers))
    return sm
