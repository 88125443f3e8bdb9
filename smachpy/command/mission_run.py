"""Runs one mission for a user: robot, terminal view, signals, pictures, exit code."""

from __future__ import annotations

import contextlib
import random
import signal
import sys
import traceback
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from actionlib_core import shutdown
from actionlib_core.clock import RealClock, current_clock
from actionlib_core.names import NameArguments
from actionlib_core.process.output import printable, tell
from smachpy.command.arguments import (
    MisfitError,
    Text,
    check_kept,
    fit,
    parameters_of,
    read_secret,
    read_words,
)
from smachpy.command.bag import playing
from smachpy.command.durable import DurableOptions, journalled
from smachpy.command.extras import load_view
from smachpy.command.needs import needed_servers
from smachpy.command.out_folder import OutFolder
from smachpy.command.surroundings import REAL_TIME, Pace, RobotOptions, open_surroundings
from smachpy.command.targets import raised_text
from smachpy.command.watching import Watching, watched
from smachpy.events.introspection import describe
from smachpy.events.outcome_classes import is_good
from smachpy.exceptions import InvalidUserCodeError, MissionError
from smachpy.machines.mission_info import mission_info
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.userdata.secret import MASK, Secret, holds_secret, is_secret_name, masked

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path
    from typing import TextIO

    from smachpy.command.evidence import Seal
    from smachpy.command.targets import Target
    from smachpy.events.introspection import StateRecord
    from smachpy.machines.container import Container

EXIT_SUCCESS: Final = 0
EXIT_OTHER_OUTCOME: Final = 1
OFFICE: Final = RobotOptions(start=False, map=OFFICE_MAP, config=OFFICE_ROBOT)
NO_NAMES: Final = NameArguments()


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How to run a mission.

    Attributes:
        inputs: Arguments of the mission's function, or values of its userdata keys.
        words: Arguments of its function, in order.
        pace: How time passes.
        robot: The simulated robot of the run.
        names: Remapping from the command line.
        namespace: Prefix of the mission's relative names; "" uses the configuration's.
        out: Folder for events, pictures and summary; None writes none.
        bag: A bag whose topics are published during the run.
        plain: Only lines, no panel.
        events: Stream for events as lines of JSON, which replace the terminal view.
        success: Outcomes that count as success; empty: 'succeeded', or all that do not look like a
            failure.
        server_timeout: How long to wait for the action servers that the mission needs [s].
        debug: Show the traceback of a mission that raises.
        watching: Page, network and recording of the run.
        durable: Journal of the run; None for a run that need not survive.
        seal: What evidence there is of the mission; None if nobody wants to know it.
    """

    inputs: Mapping[str, object] = field(default_factory=dict)
    words: tuple[str, ...] = ()
    pace: Pace = REAL_TIME
    robot: RobotOptions = OFFICE
    names: NameArguments = NO_NAMES
    namespace: str = ""
    out: Path | None = None
    bag: Path | None = None
    plain: bool = False
    events: TextIO | None = None
    success: tuple[str, ...] = ()
    server_timeout: float = 10.0
    debug: bool = False
    watching: Watching = field(default_factory=Watching)
    durable: DurableOptions | None = None
    seal: Seal | None = None


def run_mission(target: Target, options: RunOptions) -> int:
    """Run a mission to its end and return the exit code.

    Ctrl-C, SIGTERM, a closed terminal and SIGQUIT request the shutdown, which preempts the mission,
    or suspends a durable one unless it was Ctrl-C; a second one ends the process.

    Raises:
        SmachError: the inputs do not fit, a server is missing, or the robot cannot start.

    Blocks: until the mission has ended.
    """
    needs = mission_info(target.thing)
    if options.pace.virtual and needs.real_time:
        raise MissionError(
            f"--time {options.pace}: mission {target.name!r} needs real time: {needs.real_time}. "
            "Try --time real."
        )
    if options.pace.virtual and options.watching.view and options.watching.control:
        raise MissionError(
            f"--control: got --time {options.pace} beside it, where a mission that is paused would "
            "hold up all time; expected real time. Try without --control."
        )
    with contextlib.ExitStack() as stack:
        ending = stack.enter_context(shutdown.handle_signals())
        surroundings = stack.enter_context(
            open_surroundings(options.pace, options.robot, options.names, options.namespace)
        )
        kept = options.durable is not None
        if ending.requested():
            return signal_exit(ending)
        with shutdown.terminable(shutdown.SIGNALS):  # there is nothing to preempt yet
            machine = build(target, options.inputs, options.words, kept=kept)
        record = describe(machine)
        _check_success(target, record, options)
        out = None
        if options.out is not None:
            name = target.shown_name or target.name
            out = OutFolder(options.out, name, machine, options.robot)
        needed = needed_servers(record)
        others = {name: needed[name] for name in needed.keys() - set(needs.serves)}
        surroundings.start(machine, others)
        if not surroundings.wait(options.server_timeout):
            return signal_exit(ending)
        if out is not None:
            stack.enter_context(out.collecting())
        # A stack of its own, closed right after the mission: the journal must be complete before
        # the page lingers, which may take hours.
        journal = stack.enter_context(contextlib.ExitStack())
        closing: list[Callable[[], object]] = []
        journal.enter_context(journalled(target, machine, options.durable, closing))
        if options.seal is not None:
            stack.callback(options.seal.watch(machine))
        watch = stack.enter_context(
            watched(target.shown_name or target.name, machine, record.path, options.watching)
        )
        show = show_run(record, options)
        stack.enter_context(show)
        closing += [show.close, watch.close]
        stack.callback(machine.subscribe(show.on_event))
        with journal, playing(options.bag):
            outcome = _execute(machine, show, options)
        surroundings.over()
        good = outcome in good_outcomes(record, options)
        code = EXIT_SUCCESS if good else EXIT_OTHER_OUTCOME
        if ending.requested():
            code = signal_exit(ending)
        if out is not None:
            facts = {
                "mission": target.name,
                "outcome": outcome,
                "exit_code": code,
                "time": str(options.pace),
            }
            print(printable(f"\nWritten: {', '.join(map(str, out.write(facts)))}"))
        watch.linger(outcome, ending)
    return code


def show_run(record: StateRecord, options: RunOptions) -> Any:
    """Return the view of the run: the terminal, or an event stream."""
    clock = current_clock()
    if options.events is not None:
        from smachpy.command.event_stream import EventStream

        return EventStream(options.events, record, clock.time_ns())
    # If time jumps, a panel would show nothing between two lines.
    jumps = options.pace.virtual and options.pace.rate is None
    return load_view("terminal")(
        record,
        plain=options.plain or jumps,
        clock=clock,
        drawing=None if options.pace.rate is None else RealClock(),
    )


def build(
    target: Target,
    inputs: Mapping[str, object],
    words: Sequence[str] = (),
    *,
    kept: bool = False,
    to_run: bool = True,
) -> Container:
    """Build the machine.

    Args:
        target: The mission.
        inputs: Arguments of its function, or values of its userdata keys, by name.
        words: Arguments of its function, the words after `--`.
        kept: They are kept in a journal or queue, where no secret is to be.
        to_run: False to look at it only: input keys need no values.

    Raises:
        MissionError: an argument does not fit, is missing or unknown.
    """
    machine = target.build(**read_words(target, words, inputs, kept=kept))
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
            machine.userdata[key] = _fit_userdata(machine, key, value, kept=kept)
    missing = sorted(key for key in keys if key not in machine.userdata)
    if missing and to_run:
        raise MissionError(
            f"mission {target.name!r}: input keys {missing} have no value; expected one for each. "
            f"Try --input {missing[0]}=VALUE."
        )
    return machine


def _fit_userdata(machine: Container, key: str, value: object, *, kept: bool) -> object:
    """Return an input with the type of the machine's own value for that key, if there is one."""
    own = machine.userdata[key] if key in machine.userdata else None  # noqa: SIM401  no dict
    hint: Any = Any
    if isinstance(own, bool | str):
        hint = type(own)
    elif isinstance(own, int | float):
        hint = int | float
    elif isinstance(own, list | dict | Secret):
        hint = type(own)
    try:
        if isinstance(value, Text) and (hint is Secret or is_secret_name(key)):
            secret = str(read_secret(value, f"--input {key}", kept=kept))
            # What a journal does not keep, each process reads again.
            return Secret(secret) if kept or hint is Secret else secret
        if kept:
            check_kept(value)
        return fit(value, hint)
    except MisfitError as error:
        is_hidden = hint is Secret or holds_secret(str(value))
        got = MASK if is_hidden else str(masked(value, key))
        mine = masked(own, key)
        raise MissionError(
            f"--input {key}: got {got:.60}; expected {error}, as the mission's own {mine!r}."
        ) from error


def good_outcomes(record: StateRecord, options: RunOptions) -> set[str]:
    """Return the outcomes that count as success."""
    if options.success:
        return set(options.success)
    if record.success is None and "succeeded" in record.outcomes:
        return {"succeeded"}
    return {outcome for outcome in record.outcomes if is_good(outcome, record.success)}


def _check_success(target: Target, record: StateRecord, options: RunOptions) -> None:
    unknown = sorted(set(options.success) - set(record.outcomes))
    if unknown:
        raise MissionError(
            f"--success {unknown[0]}: mission {target.name!r} has no such outcome; expected one of "
            f"{sorted(record.outcomes)}."
        )


def _execute(machine: Container, show: Any, options: RunOptions) -> str | None:
    """Run the machine; return None if its code raised, after reporting it.

    Raises:
        MissionError: in virtual time, everything waits for something that cannot happen.
    """
    outcome: str | None = None
    try:
        seed = options.watching.origin.get("seed")
        if seed is not None and options.watching.records:
            random.seed(seed)  # a run that is reproduced throws the same dice again
        outcome = machine.execute()
    except Exception as error:
        show.close()
        stuck = _stuck(error) if options.pace.virtual else None
        if stuck is not None:
            raise MissionError(f"--time {options.pace}: {stuck}\nTry --time real.") from error
        if not isinstance(error, InvalidUserCodeError):
            raise
        if options.debug:
            sys.stderr.write(printable("".join(traceback.format_exception(error))))
        else:
            tell("smachpy", raised_text(error.__cause__ or error, str(error)))
    show.print_summary(outcome)
    return outcome


def _stuck(error: BaseException | None) -> str | None:
    """Return the text of a deadlock in virtual time, if that is why the mission raised."""
    from actionlib_core.clock import Deadlock

    while error is not None and not isinstance(error, Deadlock):
        error = error.__cause__
    return None if error is None else str(error)


def signal_exit(ending: shutdown.Shutdown) -> int:
    """Return the exit code of a program that was ended by a signal."""
    members = signal.Signals.__members__
    return shutdown.EXIT_SIGNAL + members.get(ending.reason or "", signal.SIGINT)
