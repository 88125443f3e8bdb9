"""The session of an old program: its node and parameters, and whether it runs or only builds.

A dry session builds a program's machine without running it: nothing is waited for, sent, written
or started, and the first call that would run the machine ends the program.
"""

from __future__ import annotations

import contextlib
import sys
import threading
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core import shutdown
from actionlib_core.clock import RealClock, current_clock
from actionlib_core.exceptions import NodeError
from actionlib_core.node import get_node, init
from smachpy.ros1.parameters import Parameters

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.node import Node

T = TypeVar("T")

DRY_LIMIT_S = 3600.0
"""Virtual time after which a dry program counts as one that serves for ever [s]."""
SETTLE_S = 1.0
"""Virtual time that a dry program's threads get when its main thread waits or has ended [s]."""


class DryRunOver(SystemExit):
    """Ends a dry program where it would run its machine.

    It is a `SystemExit`, which ends a thread silently and passes `except Exception` in the program.

    Attributes:
        machine: The machine; None when the program would serve or wait for ever.
    """

    def __init__(self, machine: Any = None) -> None:
        self.machine = machine
        super().__init__()


class Session:
    """One program for ROS 1.

    Args:
        argv: Its command line, beginning with the program's name.
        dry: Only build its machine.
        make_node: Makes the node for the name in `init_node` and makes it the current one.
        stub_missing: Missing parameters, modules and packages are replaced by stand-ins.

    Attributes:
        parameters: Its parameters.
        name: The name in `init_node`; "" before.
        named_node: Its node has that name, or the one that the command line gives it.
        stubbed: Names of what was replaced by stand-ins.
        stopped: How a dry program has ended; None before.
        executed: A dry program has ended by executing a machine.
        shows_transitions: The command shows transitions, so SMACH's log need not.
        loaded: Its machine was built by `load`, and may be run by other code.
        rosout: Publishes the program's log; None before it has a node.
        logged: Level and line of the program -> when and what it has logged, for `throttle` and
            `once`.
        on_action: Called with name and type of each action for which the program makes a client.
    """

    def __init__(
        self,
        argv: list[str] | None = None,
        *,
        dry: bool = False,
        make_node: Callable[[str], Node] | None = None,
        stub_missing: bool = False,
    ) -> None:
        self.argv = sys.argv if argv is None else argv
        self.dry = dry
        self.stub_missing = stub_missing
        self.parameters = Parameters()
        self.name = ""
        self.stubbed: list[str] = []
        self.stopped: DryRunOver | None = None
        self.executed = False
        self.hooks: list[Callable[[str], object]] = []
        self.named_node = False
        self.shows_transitions = False
        self.loaded = False
        self.rosout: Any = None
        self.logged: dict[tuple[Any, ...], Any] = {}
        self.on_action: Callable[[str, str], object] = lambda _name, _type: None
        self._make_node = make_node or make_default
        self._handling = contextlib.ExitStack()

    def begin_node(self, name: str) -> Node:
        """Make the node that the program calls `name`, and make it the current one."""
        self.name = name
        node = self._make_node(name)
        self.named_node = node.name == name or not self.dry
        return node

    def stop(self, machine: Any = None) -> None:
        """End a dry program; for others, do nothing.

        Raises:
            Stop: the program is dry.
        """
        if self.dry:
            # Several threads may get here; a machine counts more than an endless wait.
            if self.stopped is None or (machine is not None and self.stopped.machine is None):
                self.stopped = DryRunOver(machine)
            raise self.stopped

    def settle(self) -> None:
        """Give the threads of a dry program time to reach their machine's `execute`."""
        if self.dry and self.stopped is None:
            current_clock().sleep(SETTLE_S)

    def check_time(self) -> None:
        """End a dry program if it was stopped or waits without end; for others, do nothing.

        Raises:
            Stop: the program is ended.
        """
        if self.dry and (self.stopped is not None or current_clock().now() > DRY_LIMIT_S):
            self.stop()

    def is_shutdown(self) -> bool:
        """Return whether the program is to end."""
        return self.stopped is not None or shutdown.requested()

    def be_live(self) -> None:
        """End the dry mode: the states of the machine run later, and then are to have effects."""
        self.executed = self.stopped is not None and self.stopped.machine is not None
        self.dry, self.stopped, self.loaded = False, None, True
        self.hooks.clear()
        self.logged.clear()

    def add_hook(self, hook: Callable[[str], object]) -> None:
        """Call `hook(reason)` once, when the program is asked to end or at its end."""
        if not self.hooks:
            shutdown.current_shutdown().at_exit(lambda: self.run_hooks("exit"))
        self.hooks.append(hook)

    def handle_signals(self) -> None:
        """Let signals ask the program to end, unless they already have handlers."""
        real = isinstance(current_clock(), RealClock)
        if real and threading.current_thread() is threading.main_thread():
            ours = shutdown.default_signals()
            if ours:
                self._handling.enter_context(shutdown.handle_signals(ours))
                shutdown.current_shutdown().at_exit(self._handling.close)

    def run_hooks(self, reason: str) -> None:
        """Call the program's hooks, each once."""
        hooks, self.hooks = self.hooks, []
        if self.dry:
            return
        for hook in hooks:
            hook(reason)

    def stand_in(self, what: str) -> None:
        """Note that `what` was replaced by a stand-in."""
        if what not in self.stubbed:
            self.stubbed.append(what)


def make_default(name: str, argv: Sequence[str] | None = None) -> Node:
    """Return the default node under the name in `init_node`.

    Scripts make publishers and clients before `init_node`, and the command's remappings need a node
    as well, so that it may exist already.

    Args:
        name: The name.
        argv: Arguments with remapping for a new node; None: those of the program.
    """
    try:
        return init(name, argv)
    except NodeError:
        node = get_node()
        node.rename(name)
        return node


_sessions: list[Session] = []


def session() -> Session:
    """Return the current session; if there is none, make one for a program run by `python`."""
    if not _sessions:
        _sessions.append(Session())
    return _sessions[-1]


def begin(made: Session) -> None:
    """Make a session the current one."""
    _sessions.append(made)


def end(made: Session) -> None:
    """End a session; the one before it is the current one again."""
    if made in _sessions:
        _sessions.remove(made)


def forget_loaded() -> None:
    """End the sessions of machines that were loaded by `load`."""
    _sessions[:] = [made for made in _sessions if not made.loaded]
