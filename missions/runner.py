"""Run one mission for a person: robot, terminal view, signals, pictures, exit code."""

from __future__ import annotations

import contextlib
import importlib
import signal
import sys
import traceback
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import viz
from actionlib_core import shutdown
from actionlib_core.clock import current_clock
from actionlib_core.node import get_node
from actionlib_core.presence import Kind, parse_token, token_pattern
from missions.arguments import MisfitError, fit, parameters_of, read_words
from missions.exceptions import MissionError
from missions.maps import OFFICE_MAP, OFFICE_ROBOT
from missions.recorder import TrackRecorder
from missions.robot_process import RobotProcess
from missions.watching import Watching, watched
from smachpy import InvalidUserCodeError, describe

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence
    from smachpy.container import Container
    from smachpy.introspection import StateRecord
    from smachpy.targets import Target

EXIT_SUCCESS: Final = 0
EXIT_OTHER_OUTCOME: Final = 1
_SIGNAL_EXIT: Final = 128  # plus the signal's number, as shells have it
_BAD_OUTCOMES: Final = frozenset(
    {"aborted", "preempted", "failed", "failure", "error", "invalid", "false", "lost", "rejected"}
)


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How to run a mission.

    Attributes:
        inputs: Arguments of the mission's function, or values of its userdata keys.
        words: Arguments of its function, in order.
        start_robot: Start the simulated robot as a process of its own.
        robot_arguments: Further arguments for it.
        map: The robot's map, also for the picture of the track.
        config: The robot's parameters.
        out: Folder for pictures; None writes none.
        plain: Only lines, no panel.
        success: Outcomes that count as success; empty takes 'succeeded', or all that do not sound
            like a failure.
        server_timeout: How long to wait for the action servers that the mission needs [s].
        debug: Show the traceback of a mission that raises.
        watching: Who else may see it, and the file that it is written to.
    """

    inputs: Mapping[str, object] = field(default_factory=dict)
    words: tuple[str, ...] = ()
    start_robot: bool = False
    robot_arguments: tuple[str, ...] = ()
    map: Path = OFFICE_MAP
    config: Path = OFFICE_ROBOT
    out: Path | None = None
    plain: bool = False
    success: tuple[str, ...] = ()
    server_timeout: float = 10.0
    debug: bool = False
    watching: Watching = field(default_factory=Watching)


def run_mission(target: Target, options: RunOptions) -> int:
    """Run it to its end and return the exit code.

    Ctrl-C and SIGTERM request the shutdown, which preempts the mission; a second Ctrl-C ends the
    process.

    Raises:
        SmachError: the inputs do not fit, a server is missing, or the robot cannot start.

    Blocks: until the mission has ended.
    """
    machine = build(target, options.inputs, options.words)
    record = describe(machine)
    needed = needed_servers(record) - set(getattr(target.thing, "serves", ()))
    recorder = TrackRecorder()
    with contextlib.ExitStack() as stack:
        ending = stack.enter_context(shutdown.handle_signals())
        waiter = _ServerWait(needed)
        stack.callback(waiter.close)
        stack.callback(ending.on_shutdown(waiter.wake))
        robot = None
        if options.start_robot:
            arguments = ("--map", str(options.map), "--config", str(options.config))
            robot = RobotProcess((*arguments, *options.robot_arguments), on_change=waiter.wake)
            robot.on_refusal(machine.request_preempt)
            stack.enter_context(robot)
        if options.out is not None:
            _prepare(options.out / f"{target.name}.svg", machine)
        if not waiter.wait(options.server_timeout, robot):
            return _signal_exit(ending)
        stack.callback(machine.subscribe(recorder.on_event))
        stack.enter_context(watched(target.name, machine, record.path, options.watching))
        view = stack.enter_context(viz.TerminalView(record, plain=options.plain))
        stack.callback(machine.subscribe(view.on_event))
        outcome = _execute(machine, view, debug=options.debug)
        if robot is not None:
            if robot.refused():  # an older robot of its name turned up late, and got the goals
                robot.check()
            robot.let_go()
        if options.out is not None:
            files = write_pictures(target.name, machine, view.history, recorder, outcome, options)
            sys.stdout.write(f"\nWritten: {', '.join(map(str, files))}\n")
        if ending.requested():
            return _signal_exit(ending)
    return EXIT_SUCCESS if outcome in good_outcomes(record, options) else EXIT_OTHER_OUTCOME


def build(target: Target, inputs: Mapping[str, object], words: Sequence[str] = ()) -> Container:
    """Make the machine.

    Args:
        target: The mission.
        inputs: Arguments of its function, or values of its userdata keys, by name.
        words: Arguments of its function as they stand after `--`.

    Raises:
        MissionError: one of them does not fit, is missing, or is not known.
    """
    machine = target.build(**read_words(target, words, inputs))
    parameters = parameters_of(target.thing)
    keys = machine.get_registered_input_keys()
    known = {*parameters, *keys, *machine.userdata.keys()}
    for key, value in inputs.items():
        if key not in known:
            raise MissionError(
                f"--input {key}: mission {target.name!r} has no such input; expected one of "
                f"{sorted(known)}."
            )
        if key not in parameters:
            machine.userdata[key] = _fit_userdata(machine, key, value)
    missing = sorted(key for key in keys if key not in machine.userdata)
    if missing:
        raise MissionError(
            f"mission {target.name!r}: input keys {missing} have no value; expected one for each. "
            f"Try --input {missing[0]}=VALUE."
        )
    return machine


def _fit_userdata(machine: Container, key: str, value: object) -> object:
    """Return an input as the machine's own value of that key has it, if there is one."""
    own = machine.userdata[key] if key in machine.userdata else None  # noqa: SIM401  no dict
    hint: Any = Any
    if isinstance(own, bool | str):
        hint = type(own)
    elif isinstance(own, int | float):
        hint = int | float
    elif isinstance(own, list | dict):
        hint = type(own)
    try:
        return fit(value, hint)
    except MisfitError as error:
        raise MissionError(
            f"--input {key}: got {value!s:.60}; expected {error}, as the mission's own {own!r}."
        ) from error


def needed_servers(record: StateRecord) -> set[str]:
    """Return the names of the actions that a machine's states call."""
    return {
        value
        for state in record.walk()
        if state.kind == "action"
        for name, value in state.details
        if name == "action"
    }


def good_outcomes(record: StateRecord, options: RunOptions) -> set[str]:
    """Return the outcomes that count as success."""
    if options.success:
        return set(options.success)
    if "succeeded" in record.outcomes:
        return {"succeeded"}
    return {outcome for outcome in record.outcomes if outcome.lower() not in _BAD_OUTCOMES}


def write_pictures(
    name: str,
    machine: Container,
    history: viz.History,
    recorder: TrackRecorder,
    outcome: str | None,
    options: RunOptions,
) -> list[Path]:
    """Write `<out>/<name>.svg`, and `<out>/<name>_track.png` if the robot had places to go to.

    Returns:
        The files.

    Raises:
        MissionError: a file cannot be written.
    """
    out = options.out
    assert out is not None
    try:
        files = [viz.render(machine, out / f"{name}.svg", run=history)]
        if recorder.has_goals:
            from missions.move_base.config import load_config
            from missions.move_base.occupancy import load_map

            dock = load_config(options.config).dock
            title = f"{name}: {outcome}"
            picture = out / f"{name}_track.png"
            recorder.draw(picture, load_map(options.map), dock=dock, title=title)
            files.append(picture)
    except OSError as error:
        raise _cannot_write(out, error) from error
    return files


def _cannot_write(out: Path, error: OSError) -> MissionError:
    why = error.strerror or str(error)
    return MissionError(f"--out {out}: got {why!r}; expected a folder to write pictures to.")


def _prepare(picture: Path, machine: Container) -> None:
    """Draw the machine that has not run yet, while the robot's process starts.

    What cannot be drawn or written is known before anything moves.

    Raises:
        MissionError: the file cannot be written.
        SmachError: there is no `dot` program.
    """
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        viz.render(machine, picture)
    except OSError as error:
        raise _cannot_write(picture.parent, error) from error
    importlib.import_module("missions.move_base.track")


def _execute(machine: Container, view: viz.TerminalView, *, debug: bool) -> str | None:
    """Run it; None when its own code raised, which is said here."""
    outcome: str | None = None
    try:
        outcome = machine.execute()
    except InvalidUserCodeError as error:
        view.close()
        if debug:
            traceback.print_exception(error)
        else:
            sys.stderr.write(f"smachpy: {error}\n")
    view.print_summary(outcome)
    return outcome


def _signal_exit(ending: shutdown.Shutdown) -> int:
    members = signal.Signals.__members__
    return _SIGNAL_EXIT + members.get(ending.reason or "", signal.SIGINT)


class _ServerWait:
    """Waits until every needed action has a server, or something makes waiting pointless."""

    def __init__(self, names: set[str]) -> None:
        self._clock = current_clock()
        self._wake = self._clock.event()
        self._missing: dict[str, str] = {}
        self._watches: list[Closable] = []
        if names:
            self._watch(get_node(), names)

    def _watch(self, node: Node, names: set[str]) -> None:
        self._missing = {node.resolve(name, "action name"): name for name in names}
        for full in list(self._missing):
            pattern = token_pattern(Kind.ACTION_SERVER, full)
            self._watches.append(node.transport.watch_alive(pattern, self._on_presence))

    def wake(self) -> None:
        """Look again whether to go on waiting; from any thread."""
        self._wake.set()

    def close(self) -> None:
        """Stop watching."""
        for watch in self._watches:
            watch.close()

    def wait(self, timeout: float, robot: RobotProcess | None) -> bool:
        """Wait for the servers, and for `robot` to be ready; False when the program is to end.

        Raises:
            MissionError: a server is missing after `timeout` [s], or the robot could not start.

        Blocks: `timeout` at most.
        """
        deadline = self._clock.now() + timeout
        while not shutdown.requested():
            if robot is not None:
                robot.check()
            if not self._missing and (robot is None or robot.ready()):
                return True
            left = deadline - self._clock.now()
            if left <= 0:
                names = list(self._missing.values()) or ["move_base"]
                raise MissionError(_missing_text(names, timeout))
            self._wake.wait(left)
            self._wake.clear()
        return False

    def _on_presence(self, presence: Presence) -> None:
        endpoint = parse_token(presence.key)
        if endpoint is not None and presence.alive:
            self._missing.pop(endpoint.name, None)
            self._wake.set()


def _missing_text(names: list[str], timeout: float) -> str:
    listed = ", ".join(repr(name) for name in sorted(names))
    what, be = ("action", "has") if len(names) == 1 else ("actions", "have")
    text = f"{what} {listed}: {be} no server after {timeout:g} s; expected one."
    if set(names) <= {"move_base", "charge"}:
        return f"{text} Try --start-robot, or in another terminal: python -m missions.move_base"
    return f"{text} Try starting it; `actionlib list` shows those that run."
