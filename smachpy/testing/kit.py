"""Runs a mission under test: virtual time, a network in memory, doubles, preempts."""

from __future__ import annotations

import asyncio
import contextlib
import math
import signal
import tempfile
import threading
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from actionlib_core.clock import Deadlock, TimeLimit, use_clock
from actionlib_core.clock._virtual import START_TIME_NS
from actionlib_core.interfaces.bags import read_bag
from actionlib_core.node import use_node
from actionlib_core.shutdown import Shutdown, use_shutdown
from actionlib_core.transport.memory import MemoryNetwork
from smachpy.base.problems import Problems
from smachpy.engine.preempt import asking
from smachpy.events.introspection import describe
from smachpy.exceptions import error_text
from smachpy.machines.container import Container
from smachpy.testing import session
from smachpy.testing.doubles import Double, Places
from smachpy.testing.process import MissionNode, Process
from smachpy.testing.recorder import STEPS, TURN_STEPS, MissionClock, RunRecorder, Stuck, Trigger
from smachpy.testing.ros2_node import ScriptedNode, ScriptedRos1Node
from smachpy.testing.runs import Run, TimeLimitError
from smachpy.testing.servers import (
    ScriptedActionServer,
    ScriptedEnd,
    ScriptedService,
    ScriptedTopic,
    raise_errors,
)

if TYPE_CHECKING:
    from collections.abc import (
        Awaitable,
        Callable,
        Collection,
        Iterable,
        Iterator,
        Mapping,
        Sequence,
    )
    from types import TracebackType
    from typing import Self

    from actionlib_core.names import NameArguments
    from smachpy.testing.doubles import Replacement
    from smachpy.testing.exploring.exploration import Exploration

LIMIT_S = 6 * 3600.0  # [s] virtual time of a run, unless the test gives a limit
SETTLE_S = 0.1  # [s] after a run, for messages that are still on their way to a server


class UnfiredWarning(UserWarning):
    """A preempt or interrupt of the test never came: the run ended before its moment."""


class _Shutdown(Shutdown):
    """The shutdown of a test, in which signals are meant for the program that tests."""

    _signal = ""
    _asking = 0  # the thread that requests the shutdown, in which no signal is noted

    def request(self, reason: str = "requested") -> bool:
        """Request the shutdown; see `Shutdown`."""
        self._asking = threading.get_ident()
        try:
            return super().request(reason)
        finally:
            self._asking = 0

    def note(self, reason: str) -> None:
        """Note a signal that has come during a run, or what is requested."""
        if threading.get_ident() != self._asking:
            self._signal = self._signal or reason
        super().note(reason)

    def pass_on(self) -> None:
        """Give the signal to the program, once it has its handlers again."""
        name, self._signal = self._signal, ""
        if name:
            signal.raise_signal(signal.Signals[name])


class MissionKit:
    """Runs machines in virtual time on a network in memory; the `mission` fixture is one.

    Use it as a context manager; inside, its clock, node and shutdown are the current ones.

    Args:
        seed: Picks the thread interleaving; None: threads take turns.
        rate: Virtual seconds per real second, for watching; None: as fast as possible.
        choose: As for `VirtualClock`.
        folder: Returns the folder for pictures of failed runs; called when one is drawn.
        on_run: Called with every run, for coverage.
        begin_ns: The wall time at its begin [ns since the epoch].
        namespace: Prefix of the mission's relative names.
        arguments: Remapping of its names.

    Attributes:
        clock: The clock.
        network: The network; other sessions may join.
        node: The mission's node.
        shutdown: The program's shutdown, requested by `interrupt`.
        draws: Whether to draw runs that raise.
        call: The function that accepts another limit, for errors.
        on_run: See above.
    """

    def __init__(
        self,
        *,
        seed: int | None = None,
        rate: float | None = None,
        choose: Callable[[list[str]], int] | None = None,
        folder: Callable[[], Path] | None = None,
        on_run: Callable[[Run], object] | None = None,
        begin_ns: int = START_TIME_NS,
        namespace: str = "",
        arguments: NameArguments | None = None,
    ) -> None:
        self.seed = seed
        self.clock = MissionClock(seed, rate=rate, choose=choose, begin_ns=begin_ns)
        self.network = MemoryNetwork(self.clock)
        self.transport = self.network.session()
        self.node = MissionNode(
            "mission",
            transport=self.transport,
            clock=self.clock,
            namespace=namespace,
            arguments=arguments,
        )
        self.shutdown = _Shutdown()
        self.draws = True
        self.call = "mission"
        self._folder = folder or _temporary_folder
        self.on_run = on_run
        self._places = Places()
        self._triggers: list[Trigger] = []
        self._replacements: list[Replacement] = []
        self._servers: list[ScriptedEnd] = []
        self._stack = contextlib.ExitStack()
        self._is_open = False
        self._process: Process | None = None

    def __enter__(self) -> Self:
        self._stack.enter_context(self.clock)
        self._stack.enter_context(use_clock(self.clock))
        self._stack.enter_context(use_node(self.node))
        self._stack.enter_context(use_shutdown(self.shutdown))
        self._is_open = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        errors, causes = self._take_errors()
        self._is_open = False
        self._places.restore()
        try:
            for server in reversed(self._servers):
                server.close()
            self.node.close()
        finally:
            self._stack.close()
        if error is None:
            raise_errors(errors, causes)
        else:
            _note(error, errors)

    @property
    def ends(self) -> tuple[ScriptedEnd, ...]:
        """The scripted servers and topics of the test."""
        return tuple(self._servers)

    # -- running -------------------------------------------------------------------------------

    def __call__(
        self,
        machine: Container = None,  # type: ignore[assignment]
        userdata: Mapping[str, Any] | None = None,
        *,
        limit: float = LIMIT_S,
        steps: int = STEPS,
    ) -> Run:
        """Run `machine` to its end.

        Args:
            machine: Any container.
            userdata: Values written to its userdata before the run.
            limit: The longest run on the test's clock [s].
            steps: The most steps while no time passes: a transition counts as one, a turn of a
                waiting thread as five.

        Raises:
            TypeError: it is not a container.
            InvalidStateError: `limit` is no number of seconds, or `steps` is less than 1.
            RuntimeError: the kit is not open: its `with` block or its test has ended.
            Deadlock: everything waits for something that cannot happen.
            TimeLimitError: it did not end in time, or took too many steps.
            SmachError: a state raised, or the machine is inconsistent; as for `execute`.
            AssertionError: a scripted server got a goal without a reply in its script, or a
                function of the test (`clock.spawn`, `custom_reply`) raised. If the run raises
                something else, this is added to it as a note.

        Warns:
            UnfiredWarning: a preempt or interrupt of the test never came.
        """
        __tracebackhide__ = True
        check_machine(machine, "mission")
        if not self._is_open:  # the run would be in real time, on the network
            raise RuntimeError(
                "mission: got a kit that is not open; expected a call in `with mission_kit() as "
                "mission:`, or in the test that has the fixture."
            )
        limit, steps = check_limits(self.call, limit, steps)
        for name, make, made in self._replacements:
            made.append(self._places.put(machine, name, make))
        self._replacements.clear()
        for key, value in (userdata or {}).items():
            machine.userdata[key] = value
        record, whole = describe(machine), self._places.describe_whole(machine)
        triggers, self._triggers = self._triggers, []
        recorder = RunRecorder(self.clock, machine, record, triggers, steps)
        self.clock.limit, self.clock.most_turns = self.clock.now() + limit, steps // TURN_STEPS
        try:
            with self.clock.patched(), recorder.installed():
                outcome, error = self._execute(machine)
        finally:
            self.clock.limit = self.clock.most_turns = None
        self.shutdown.pass_on()
        duration = self.clock.now() - recorder.started
        if self._servers and error is None:
            self.clock.sleep(SETTLE_S)
        run = Run(
            record,
            outcome,
            tuple(recorder.events),
            {key: machine.userdata[key] for key in machine.userdata.keys()},  # noqa: SIM118
            duration,
            self.seed,
            self._folder,
            recorder.unfired(),
            whole,
            tuple(goal_id for server in self._servers for goal_id in server.left),
            tuple(goal_id for server in self._servers for goal_id in server.ignored),
        )
        if self.on_run is not None:
            self.on_run(run)
        errors, causes = self._take_errors()
        if error is not None:
            _reraise(self, error, run, limit, steps, errors)
        raise_errors(errors, causes)
        for text in run.unfired:
            warnings.warn(UnfiredWarning(f"{record.path}: {text}"), stacklevel=2)
        return run

    def _take_errors(self) -> tuple[list[str], list[BaseException]]:
        """Return and clear the errors of the test's own functions and scripted servers."""
        failures, self.clock.failures = self.clock.failures, []
        errors = [f"{name}: {error_text(error)}" for name, error in failures]
        causes = [error for _, error in failures]
        for server in self._servers:
            more, raised = server.take_errors()
            errors += more
            causes += raised
        return errors, causes

    def _execute(self, machine: Container) -> tuple[str | None, BaseException | None]:
        """Run the machine here, or in a thread if this one runs an event loop already."""

        def execute() -> tuple[str | None, BaseException | None]:
            try:
                return machine.execute(), None
            except (Exception, Stuck) as error:  # noqa: BLE001  raised again, with the run as a note
                return None, error

        if self._process is not None:
            try:
                return self._process.run(execute)
            except (Deadlock, TimeLimit) as error:
                return None, error
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return execute()
        found: list[tuple[str | None, BaseException | None]] = []
        try:
            self.clock.spawn(lambda: found.append(execute()), name="mission").join()
        except (Deadlock, TimeLimit) as error:
            return None, error
        return found[0]

    @contextlib.contextmanager
    def process(self) -> Iterator[Process]:
        """Run the mission within this block in a simulated process, which can be killed.

        A killed run raises `Killed`; the test's servers and topics continue.
        """
        process = self._process = Process(self.clock, self.network)
        process.node.on_client = self.node.on_client
        try:
            with process.current():
                yield process
        finally:
            self._process = None

    # -- doubles -------------------------------------------------------------------------------

    def replace(
        self,
        path: str,
        outcomes: Iterable[str] = (),
        *,
        duration: float = 0.0,
        writes: Mapping[str, Any] | None = None,
        execute: Callable[[Any], str | Awaitable[str]] | None = None,
    ) -> list[Double]:
        """Replace a state by a double, from the next run to the end of the test.

        Args:
            path: Path of the state, or an unambiguous end of it.
            outcomes: Its outcomes, run after run; the last one is repeated.
            duration: How long each run takes [s]; a preempt ends it early with 'preempted'.
            writes: Userdata that it writes.
            execute: A function of the userdata instead of all this; it may be async.

        Returns:
            A list that holds the double once the run has begun.

        Raises:
            InvalidStateError: `duration` is no number of seconds, or `outcomes` no list.
            UnknownStateError, DoubleError: it does not fit the machine; raised by the run.
        """
        made: list[Double] = []
        problems = Problems("replace")
        script = problems.values("outcomes", outcomes)
        seconds = problems.seconds("duration", duration, optional=False)
        problems.raise_all()

        def make(state: Any) -> Double:
            return Double(state, script, duration=seconds or 0.0, writes=writes, execute=execute)

        self._replacements.append((path, make, made))
        return made

    # -- preempts ------------------------------------------------------------------------------

    def preempt(
        self,
        *,
        at: float | None = None,
        on: str | None = None,
        after: float = 0.0,
        visit: int = 1,
    ) -> None:
        """Preempt the next run.

        Args:
            at: This long after its start [s].
            on: While this state (a path, or the end of one) runs: as soon as it waits.
            after: With `on`: this long after the state began [s].
            visit: With `on`: at this visit of the state, from 1.

        Raises:
            ValueError: neither or both of `at` and `on`, or `after` or `visit` without `on`.
            InvalidStateError: a time is no number of seconds, or `visit` is less than 1.
        """
        self._add_trigger("preempt", at, on, after, visit)

    def interrupt(
        self,
        *,
        at: float | None = None,
        on: str | None = None,
        after: float = 0.0,
        visit: int = 1,
    ) -> None:
        """End the program during the next run, as Ctrl-C does: a shutdown, which preempts the run.

        Arguments and errors as for `preempt`; without `at` and `on` it comes at once.
        """
        self._add_trigger("interrupt", 0.0 if at is None and on is None else at, on, after, visit)

    def trigger(
        self,
        event: str | Callable[[Any], object],
        *,
        at: float | None = None,
        on: str | None = None,
        after: float = 0.0,
        visit: int = 1,
    ) -> None:
        """Trigger an event of `smachpy.modes.Modes` during the next run, or call a function.

        Args:
            event: The event; or a function of the machine, such as `Modes.emergency_stop`.
            at: As for `preempt`, like the other arguments and the errors.
            on: See there.
            after: See there.
            visit: See there.
        """

        def act(machine: Any) -> None:
            with asking("test"):
                if isinstance(event, str):
                    machine.trigger(event)
                else:
                    event(machine)

        self._add_trigger("trigger", at, on, after, visit, act)

    def _add_trigger(
        self,
        what: str,
        at: float | None,
        on: str | None,
        after: float,
        visit: int,
        act: Callable[[Container], None] | None = None,
    ) -> None:
        if (at is None) == (on is None):
            raise ValueError(f"{what}: got at={at!r} and on={on!r}; expected one of them.")
        if on is None and (after, visit) != (0.0, 1):
            raise ValueError(
                f"{what}: got after={after!r} and visit={visit!r} without on; expected a state."
            )
        problems = Problems(what)
        if at is not None:
            at = problems.seconds("at", at, optional=False)
        delay = problems.seconds("after", after, optional=False)
        visit = problems.whole("visit", visit, 1, "a whole number >= 1")
        problems.raise_all()

        def ask(machine: Container) -> None:
            if what == "interrupt":
                self.shutdown.request("interrupted by the test")
            with asking("test", "", "interrupt" if what == "interrupt" else ""):
                machine.request_preempt()

        act = act or ask
        self._triggers.append(Trigger(what, act, at, on, delay or 0.0, visit))

    # -- servers and topics --------------------------------------------------------------------

    def action_server(self, name: str, action_class: Any) -> ScriptedActionServer:
        """Offer an action with scripted replies."""
        return ScriptedActionServer(self, name, action_class)

    def service_server(self, name: str, service_class: Any) -> ScriptedService:
        """Offer a service with scripted replies."""
        return ScriptedService(self, name, service_class)

    def topic(self, name: str, message_class: Any) -> ScriptedTopic:
        """Publish on a topic, and record its messages."""
        return ScriptedTopic(self, name, message_class)

    def ros2_node(
        self, name: str, parameters: Mapping[str, Any] | None = None, *, state: str = ""
    ) -> ScriptedNode:
        """Be a ROS 2 node with parameters and, with a `state`, a life cycle."""
        return ScriptedNode(self, name, parameters, state)

    def ros1_node(self, name: str, parameters: Mapping[str, Any]) -> ScriptedRos1Node:
        """Be a ROS 1 node with parameters of dynamic_reconfigure."""
        return ScriptedRos1Node(self, name, parameters)

    def play(
        self,
        bag: str | Path,
        *,
        topics: Collection[str] | None = None,
        remap: Mapping[str, str] | None = None,
        start: float = 0.0,
    ) -> list[ScriptedTopic]:
        """Publish the messages of a bag at their times, the first one `start` [s] from now.

        Args:
            bag: A file of rosbag1 (.bag) or MCAP (.mcap), or a folder of rosbag2.
            topics: Only these topics; None: all whose types are known.
            remap: Topic of the bag -> topic of the mission.
            start: See above.

        Returns:
            The topics.

        Raises:
            BagError: it cannot be read.
        """
        names = {old.strip("/"): new for old, new in (remap or {}).items()}
        made: dict[str, ScriptedTopic] = {}
        for one in read_bag(bag, topics):
            name = names.get(one.topic, f"/{one.topic}")
            if name not in made:
                made[name] = self.topic(name, type(one.message))
            made[name].publish_at(start + one.at, one.message)
        return list(made.values())

    def add_end(self, end: ScriptedEnd) -> None:
        """Add a scripted server or topic to the test, which closes it at its end."""
        self._servers.append(end)

    # -- all runs ------------------------------------------------------------------------------

    def explore(self, machine: Any, **options: Any) -> Exploration:
        """Run a mission with all combinations of choices; see `exploration.explore`.

        States given to `replace` have their doubles in every run, and kept states meet the test's
        servers and topics with their current scripts.

        Raises:
            TypeError: it is neither a container nor a function.
            ValueError: the test asked for a preempt: every run chooses its own.
        """
        from smachpy.testing.exploring.exploration import explore

        options = {"folder": self._folder, "on_run": self.on_run, **options}
        return explore(machine, **self._own_options("explore"), **options)

    def replay(self, machine: Any, choices: Sequence[str], **options: Any) -> Run:
        """Repeat a run of `explore`; see `exploration.replay`. Errors: those of both."""
        from smachpy.testing.exploring.exploration import replay

        return replay(machine, choices, **self._own_options("replay"), **options)

    def _own_options(self, what: str) -> dict[str, Any]:
        """Return the test's doubles and servers for explored runs, which choose their preempts."""
        if self._triggers:
            got = ", ".join(map(str, self._triggers))
            raise ValueError(
                f"mission.{what}: got {got} of the test; expected none: every run chooses its own "
                f"preempts. Try mission.{what}(..., preempts=1) without it."
            )
        return {"doubles": tuple(self._replacements), "servers": tuple(self._servers)}


def check_machine(given: object, call: str, *, functions: bool = False) -> None:
    """Check that an argument is a machine.

    Args:
        given: The argument.
        call: The call's name.
        functions: Whether a function that makes one is allowed, too.

    Raises:
        TypeError: it is not.
    """
    if isinstance(given, Container):
        return
    if given is None or isinstance(given, MissionKit):
        raise TypeError(
            f"{call}: got {'no machine' if given is None else 'the fixture `mission` itself'}; "
            "expected a machine. In a test the argument `mission` is the fixture, also where the "
            "file has imported a function of the same name. Try `from your_file import mission as "
            f"make_mission` and {call}(make_mission())."
        )
    if not callable(given) or isinstance(given, type):
        raise TypeError(f"{call}: machine: got {given!r}; expected a container.")
    if not functions:
        name = getattr(given, "__name__", repr(given))
        raise TypeError(
            f"{call}: machine: got the function {name}; expected a container. Try to call it."
        )


def check_limits(call: str, limit: float, steps: int) -> tuple[float, int]:
    """Return the limits of a run in the form to use.

    Args:
        call: The call's name.
        limit: The longest run [s].
        steps: The most steps while no time passes.

    Raises:
        InvalidStateError: one of them is none.
    """
    problems = Problems(call)
    seconds = problems.seconds("limit", limit)
    steps = problems.whole("steps", steps, 1, "a whole number >= 1")
    problems.raise_all()
    return math.inf if seconds is None else seconds, steps


def _reraise(
    kit: MissionKit, error: BaseException, run: Run, limit: float, steps: int, errors: list[str]
) -> NoReturn:
    """Raise the error that ended a run, with the run and `errors` as notes.

    A deadlock or time limit deep in the causes is raised itself: states wrap it as user errors.
    """
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, Deadlock | TimeLimit | Stuck):
        cause = cause.__cause__
    if isinstance(cause, TimeLimit | Stuck):
        over = TimeLimitError(run, limit, _untimed(cause, steps), kit.call)
        _note(over, errors)
        raise over from cause
    chosen = error if cause is None else cause
    picture = run.draw() if kit.draws else None
    _note(chosen, errors)
    if run.active:
        chosen.add_note("active: " + ", ".join(run.active))
    chosen.add_note(run.explain())
    if picture is not None:
        chosen.add_note(f"picture: {picture}")
    raise chosen


def _untimed(cause: TimeLimit | Stuck, steps: int) -> str:
    """Return what a run did while no time passed; "" if the time limit was exceeded."""
    if isinstance(cause, Stuck):
        return f"it took {steps} steps"
    return f"its threads took {cause.turns} turns ({TURN_STEPS} steps each)" if cause.turns else ""


def _note(error: BaseException, errors: list[str]) -> None:
    for text in errors:
        error.add_note(text)


def _temporary_folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="smachpy-"))


@contextlib.contextmanager
def mission_kit(
    *, seed: int | None = None, rate: float | None = None, folder: Path | None = None
) -> Iterator[MissionKit]:
    """Test missions without pytest.

    `with mission_kit() as mission: run = mission(machine)`

    Under pytest, its options apply: coverage, and seed and rate unless given here.

    Args:
        seed: Picks the thread interleaving.
        rate: Virtual seconds per real second.
        folder: Folder for pictures of failed runs.
    """
    around = session.current()
    with MissionKit(
        seed=around.seeds[0] if seed is None else seed,
        rate=around.rate if rate is None else rate,
        folder=None if folder is None else lambda: folder,
        on_run=around.on_run,
    ) as kit:
        yield kit
