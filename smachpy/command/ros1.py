"""`smachpy run --ros1`: runs an unchanged script for ROS 1."""

from __future__ import annotations

import contextlib
import sys
import traceback
from typing import TYPE_CHECKING, Any, Final

from actionlib_core import shutdown
from actionlib_core.clock import Deadlock, current_clock
from actionlib_core.node import Node, get_node, use_node
from actionlib_core.process.output import printable, tell
from smachpy.command.mission_run import (
    EXIT_OTHER_OUTCOME,
    EXIT_SUCCESS,
    good_outcomes,
    show_run,
    signal_exit,
)
from smachpy.command.needs import needed_servers
from smachpy.command.out_folder import OutFolder
from smachpy.command.ros1_options import script_of, tell_stubs
from smachpy.command.surroundings import is_of_robot, open_surroundings
from smachpy.command.watching import watched
from smachpy.events.introspection import describe
from smachpy.exceptions import InvalidUserCodeError, MissionError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from actionlib_core.ros1 import Ros1Bridge
    from smachpy.command.mission_run import RunOptions
    from smachpy.command.ros1_options import Ros1Options
    from smachpy.command.surroundings import Surroundings
    from smachpy.machines.container import Container

LINGER_S: Final = 60.0
"""Virtual time for a script to continue after its last machine has ended [s]."""


def run_ros1(
    text: str, ros1: Ros1Options, options: RunOptions, robot: Ros1Bridge | None = None
) -> int:
    """Run a script for ROS 1 to its end and return the exit code.

    That is the script's own, if it ends by `sys.exit` with another code than 0; else the outcome
    of the last machine counts, as for a mission; without a machine it is 0. Parameters that the
    script has not set are read from `robot`, if given.

    Blocks: until the script has ended. In virtual time it is asked to end when nothing can
        happen any more, or `LINGER_S` after its last machine has ended.
    """
    from smachpy.ros1 import install, session
    from smachpy.ros1.session import Session

    script = script_of(text)
    with contextlib.ExitStack() as stack:
        ending = stack.enter_context(shutdown.handle_signals())
        surroundings = stack.enter_context(
            open_surroundings(options.pace, options.robot, options.names, options.namespace)
        )
        if options.pace.virtual:
            clock: Any = current_clock()
            stack.enter_context(clock.patched())
        install(script, stub_missing=ros1.stub_missing)
        argv = list(ros1.words)
        made = Session(
            [str(script), *argv],
            make_node=_node_maker(options, stack),
            stub_missing=ros1.stub_missing,
        )
        made.shows_transitions = True
        made.parameters.merge("/", ros1.parameters())
        made.parameters.robot = robot
        session.begin(made)
        stack.callback(session.end, made)
        runs = _ScriptRuns(script.stem, options, surroundings, stack)
        made.on_action = runs.need
        runs.observe()
        if options.robot.start:
            runs.put_robot()
        code = _run(script, argv, options)
        made.run_hooks("exit")
        surroundings.over()
        tell_stubs(made.stubbed)
        runs.finish(ending)
        if code is None:
            code = runs.exit_code()
        return signal_exit(ending) if ending.requested() and runs.was_interrupted(ending) else code


def _run(script: Path, argv: list[str], options: RunOptions) -> int | None:
    """Run the script; return the exit code that it asks for, None if none.

    Raises:
        MissionError: in virtual time, nothing can happen any more.
    """
    from smachpy.ros1.names.rospy.exceptions import ROSInterruptException
    from smachpy.ros1.program import LoadError, run_script, where_raised

    try:
        run_script(script, argv)
    except SystemExit as end:
        if end.code is None or end.code == 0:
            return None
        if isinstance(end.code, int):
            return end.code
        tell("smachpy", str(end.code))
        return EXIT_OTHER_OUTCOME
    except LoadError:
        raise
    except Deadlock as error:
        raise MissionError(f"--time {options.pace}: {error}\nTry --time real.") from error
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001  the script's: reported here
        cause = error.__cause__ if isinstance(error, InvalidUserCodeError) else error
        if shutdown.requested() and isinstance(cause, ROSInterruptException | KeyboardInterrupt):
            return None
        if options.debug:
            sys.stderr.write(printable("".join(traceback.format_exception(error))))
        else:
            text = where_raised(cause or error, script)
            tell("smachpy", text if cause is error else f"{error}\n  {text}")
        return EXIT_OTHER_OUTCOME
    return None


def _node_maker(options: RunOptions, stack: contextlib.ExitStack) -> Callable[[str], Node]:
    from smachpy.ros1.session import make_default

    def make(name: str) -> Node:
        if not options.pace.virtual:
            return make_default(name, ())

        before = get_node()
        node = Node(
            name,
            transport=before.transport,
            clock=before.clock,
            namespace=before.namespace,
            arguments=before.arguments,
        )
        stack.enter_context(node)
        stack.enter_context(use_node(node))
        return node

    return make


class _ScriptRuns:
    """Shows every machine that a script runs, and keeps the outcome of the last one."""

    def __init__(
        self,
        name: str,
        options: RunOptions,
        surroundings: Surroundings,
        stack: contextlib.ExitStack,
    ) -> None:
        self._name = name
        self._options = options
        self._surroundings = surroundings
        self._stack = stack
        self._seen: dict[int, Container] = {}
        self._robots: set[str] = set()
        self._out: OutFolder | None = None
        self._last: tuple[str | None, bool] | None = None
        self._running = 0
        self._timer: Any = None
        self._watch: Any = None

    def observe(self) -> None:
        """Start observing the machines of this process."""
        from smachpy.engine.threads import OBSERVERS

        OBSERVERS.append(self._begin)
        self._stack.callback(OBSERVERS.remove, self._begin)

    def need(self, action: str, type_name: str) -> None:
        """In virtual time, start the simulated robot whose action is called, unless it is there."""
        node = get_node()
        name = node.resolve(action, "action name")  # as the command line renames it
        prefix = name.removeprefix(f"{node.namespace}/").rpartition("/")[0]
        wanted = self._options.pace.virtual and is_of_robot(name, type_name)
        if wanted and prefix not in self._robots:
            self._robots.add(prefix)
            self._surroundings.put_robot(prefix, self._options.server_timeout)

    def put_robot(self) -> None:
        """Start the robot that the command line asks for."""
        self._robots.add("")
        self._surroundings.put_robot("", self._options.server_timeout)

    def _begin(self, machine: Container) -> Callable[[str | None], object]:
        record = describe(machine)
        for action, type_name in needed_servers(record).items():
            self.need(action, type_name)
        options, clock = self._options, current_clock()
        if id(machine) not in self._seen:
            self._seen[id(machine)] = machine
            if options.out is not None and self._out is None:
                self._out = OutFolder(options.out, self._name, machine, options.robot)
                self._stack.enter_context(self._out.collecting())
            if len(self._seen) == 1:
                watching = watched(self._name, machine, record.path, options.watching)
                self._watch = self._stack.enter_context(watching)
        self._running += 1
        if self._timer is not None:
            self._timer.cancel()
        show = show_run(record, options)
        show.__enter__()
        forget = machine.subscribe(show.on_event)

        def end(outcome: str | None) -> None:
            forget()
            show.__exit__(None, None, None)
            show.print_summary(outcome)
            self._last = outcome, outcome in good_outcomes(record, options)
            self._running -= 1
            if options.pace.virtual and not self._running:
                self._timer = clock.call_later(LINGER_S, _end_program)

        return end

    def exit_code(self) -> int:
        """Return the exit code for the outcome of the last machine."""
        if self._last is None or self._last[1]:
            return EXIT_SUCCESS
        return EXIT_OTHER_OUTCOME

    def was_interrupted(self, ending: shutdown.Shutdown) -> bool:
        """Return whether a signal asked the program to end."""
        return (ending.reason or "").startswith("SIG")

    def finish(self, ending: shutdown.Shutdown) -> None:
        """Write the files of the run, and keep its page for a while."""
        if self._out is not None:
            facts = {
                "mission": self._name,
                "outcome": self._last[0] if self._last else None,
                "exit_code": self.exit_code(),
                "time": str(self._options.pace),
            }
            print(printable(f"\nWritten: {', '.join(map(str, self._out.write(facts)))}"))
        if self._watch is not None:
            self._watch.linger(self._last[0] if self._last else None, ending)


def _end_program() -> None:
    shutdown.request("its machines have ended")
