"""What an old program runs in: its node, its parameters, and whether it runs at all or only builds.

A dry session builds a program's machine without running it: nothing is waited for, sent, written
or started, and the first call that would run the machine ends the program there.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core import shutdown
from actionlib_core.clock import RealClock, current_clock
from actionlib_core.exceptions import NodeError
from actionlib_core.node import get_node, init
from smachpy.ros1.parameters import Parameters

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.node import Node

T = TypeVar("T")

DRY_LIMIT_S = 3600.0
"""Virtual time after which a dry program is taken to serve for ever [s]."""
SETTLE_S = 1.0
"""Virtual time that the threads of a dry program have left when it would wait or has ended [s]."""


class Stop(SystemExit):
    """Ends a dry program where it would begin to run its machine; threads end by it silently.

    Attributes:
        machine: What would run; None when the program would serve or wait for ever.
    """

    def __init__(self, machine: Any = None) -> None:
        self.machine = machine
        super().__init__()


class Session:
    """One program for ROS 1.

    Args:
        argv: Its command line, the program's name in front.
        dry: Only build its machine.
        make_node: Makes the node that `init_node` asks for by name, and puts it in force.
        stub_missing: Missing parameters, modules and packages get stand-ins.

    Attributes:
        parameters: Its parameters.
        name: What `init_node` called it; "" before.
        named_node: Its node has that name, maybe renamed by the command line.
        stubbed: What got a stand-in.
        stopped: How a dry program ended, once it has.
        shows_transitions: Somebody shows them already, so SMACH's log need not.
        loaded: Its machine was built, and may be run by somebody else.
        rosout: Publishes what the program logs; None before it has a node.
        on_action: Called with the name of each action that a client of the program is made for.
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
        self.stopped: Stop | None = None
        self.hooks: list[Callable[[str], object]] = []
        self.named_node = False
        self.shows_transitions = False
        self.loaded = False
        self.rosout: Any = None
        self.on_action: Callable[[str], object] = lambda _name: None
        self._make_node = make_node or _make_default
        self._handling = contextlib.ExitStack()

    def begin_node(self, name: str) -> Node:
        """Make the node that the program calls `name`, and put it in force."""
        self.name = name
        node = self._make_node(name)
        self.named_node = node.name == name or not self.dry
        return node

    def stop(self, machine: Any = None) -> None:
        """End a dry program here; another one goes on.

        Raises:
            Stop: the program is dry.
        """
        if self.dry:
            if self.stopped is None or (machine is not None and self.stopped.machine is None):
                self.stopped = Stop(machine)
            raise self.stopped

    def settle(self) -> None:
        """Let the threads of a dry program get to where they run a machine; others go on."""
        if self.dry and self.stopped is None:
            current_clock().sleep(SETTLE_S)

    def check_time(self) -> None:
        """End a dry program that was stopped, or waits for what never comes.

        Raises:
            Stop: it is dry, and that is so.
        """
        if self.dry and (self.stopped is not None or current_clock().now() > DRY_LIMIT_S):
            self.stop()

    def is_shutdown(self) -> bool:
        """Tell whether the program is to end."""
        return self.stopped is not None or shutdown.requested()

    def be_live(self) -> None:
        """Let what was only built do what it says from now on: its states run later."""
        self.dry, self.stopped, self.loaded = False, None, True
        self.hooks.clear()

    def add_hook(self, hook: Callable[[str], object]) -> None:
        """Call `hook(reason)` once when the program is to end, or at its end."""
        if not self.hooks:
            shutdown.current_shutdown().at_exit(lambda: self.run_hooks("exit"))
        self.hooks.append(hook)

    def handle_signals(self) -> None:
        """Let Ctrl-C and SIGTERM ask the program to end, unless somebody handles them already."""
        real = isinstance(current_clock(), RealClock)
        if real and threading.current_thread() is threading.main_thread():
            defaults = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
            ours = tuple(n for n, default in defaults.items() if signal.getsignal(n) is default)
            if ours:
                self._handling.enter_context(shutdown.handle_signals(ours))
                shutdown.current_shutdown().at_exit(self._handling.close)

    def run_hooks(self, reason: str) -> None:
        """Call what the program wants to have called at its end; each once."""
        hooks, self.hooks = self.hooks, []
        if self.dry:
            return
        for hook in hooks:
            hook(reason)

    def stand_in(self, what: str) -> None:
        """Note that `what` was missing and got a stand-in."""
        if what not in self.stubbed:
            self.stubbed.append(what)


def _make_default(name: str) -> Node:
    try:
        return init(name)
    except NodeError:  # something was made before `init_node`: the node has another name
        return get_node()


_sessions: list[Session] = []


def session() -> Session:
    """Return the session of the program that runs; one is made for a program run by hand."""
    if not _sessions:
        _sessions.append(Session())
    return _sessions[-1]


def begin(made: Session) -> None:
    """Put a session in force."""
    _sessions.append(made)


def end(made: Session) -> None:
    """Take a session out of force; without effect when it is not in force."""
    if made in _sessions:
        _sessions.remove(made)


def forget_loaded() -> None:
    """Take the sessions of machines that were loaded out of force."""
    _sessions[:] = [made for made in _sessions if not made.loaded]
