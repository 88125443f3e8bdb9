"""Servers that a mission brings along: for one run of a machine, or for one state."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Protocol

from smachpy import State, StateMachine, UserData
from smachpy.checks import ignore

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.container import Container


class Server(Protocol):
    """Anything that is on the network from when it is made until `close`."""

    def close(self) -> None:
        """Leave the network."""
        ...


def serve_during(machine: Container, *makers: Callable[[], Server]) -> None:
    """Make servers when `machine` starts and close them, the last one first, when it has ended.

    Args:
        machine: Whose runs.
        *makers: Each makes one server.
    """
    stack = ExitStack()

    def start(_userdata: UserData, _initial: object) -> None:
        for make in makers:
            stack.callback(make().close)

    def end(_userdata: UserData, _final: object, _outcome: str) -> None:
        stack.close()

    machine.register_start_cb(start)
    machine.register_termination_cb(end)


class Serve(State):
    """Keeps servers on the network until the state is preempted, by Ctrl-C for example."""

    def __init__(self, *makers: Callable[[], Server]) -> None:
        super().__init__(outcomes=["preempted"])
        self._makers = makers

    def execute(self, userdata: UserData) -> str:
        """Serve until then.

        Blocks: until the preempt.
        """
        del userdata
        with ExitStack() as stack:
            for make in self._makers:
                stack.callback(make().close)
            self.wait_preempt()
        return "preempted"


def serving_machine(name: str, *makers: Callable[[], Server]) -> StateMachine:
    """Return a machine that serves until it is preempted."""
    sm = StateMachine(outcomes=["preempted"], name=name)
    with sm:
        StateMachine.add("SERVE", ignore(Serve(*makers), "no-timeout", "it serves until Ctrl-C"))
    return sm
