"""Simulates many runs of one mission, with values that vary from run to run."""

from __future__ import annotations

import contextlib
import io
import math
import random
import tempfile
import threading
from concurrent.futures import as_completed
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import current_clock
from actionlib_core.process.private_files import open_private
from smachpy.base.workers import WorkerError, Workers, cores
from smachpy.command.arguments import Text, parameters_of
from smachpy.command.extras import advice
from smachpy.command.mission_run import NO_NAMES, build
from smachpy.command.needs import needed_servers
from smachpy.command.surroundings import Pace, RobotOptions, open_surroundings
from smachpy.command.targets import load_target
from smachpy.engine.preempt import asking
from smachpy.events import Entered, Failed, Left
from smachpy.events.introspection import describe
from smachpy.events.recording import Recorder, RecordingError
from smachpy.events.run_state import innermost
from smachpy.exceptions import MissionError
from smachpy.machines.mission_info import mission_info
from smachpy.network.robot_topics import RobotTopics
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.robot_file import load_config

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from concurrent.futures import Executor

    from smachpy.command.targets import Target
    from smachpy.events import Event
    from smachpy.machines.container import Container

    Value = float | int | str

SHORT = {"battery": "battery.charge"}
"""Short names of the simulated robot's parameters."""
SERVER_TIMEOUT_S = 10.0
"""Longest wait for the mission's servers before its start [s]."""
LIMIT_S = 4 * 3600.0
"""Default limit for the virtual time of a run [s]."""

MAX_VARIED_RUNS = 100_000
"""More events than this at one instant of virtual time mean a loop that never waits."""


@dataclass(frozen=True, slots=True)
class Vary:
    """One value that varies.

    Attributes:
        key: A parameter of the mission's function, one of its userdata keys, or a parameter of the
            simulated robot such as "battery.charge", in short "battery".
        low, high: The range of a number.
        choices: Instead of a range: the values, used in turn.
        whole: Whether the values in the range are integers.
    """

    key: str
    low: float = 0.0
    high: float = 0.0
    choices: tuple[str, ...] = ()
    whole: bool = False

    @classmethod
    def read(cls, text: str) -> Vary:
        """Read "battery=0.2..1.0" or "place=lab,office".

        Raises:
            ValueError: the text has neither form.
        """
        key, equals, values = text.partition("=")
        low, dots, high = values.partition("..")
        if not (key.strip() and equals and values.strip()):
            raise ValueError(f"got {text!r}; expected KEY=LOW..HIGH or KEY=ONE,OTHER")
        if not dots:  # no range
            return cls(key.strip(), choices=tuple(word.strip() for word in values.split(",")))
        try:
            first, last = float(low), float(high)
        except ValueError:  # reported below, together with limits in the wrong order
            first = last = math.nan
        if not (math.isfinite(first) and math.isfinite(last) and first <= last):
            raise ValueError(
                f"got {text!r}; expected two numbers, the lower one first, such as {key}=0.2..1.0"
            )
        whole = "." not in low + high and first.is_integer() and last.is_integer()
        return cls(key.strip(), first, last, whole=whole)

    def value(self, run: int, runs: int, seed: int) -> Value:
        """Return the value for a run, by Latin hypercube sampling.

        The range is divided into as many equal parts as there are runs, and each run gets a random
        value from another part. Each key has its own random order of the parts.

        Args:
            run: Number of the run, from 0.
            runs: Number of runs.
            seed: Determines the order and the value within each part.
        """
        if self.choices:
            return self.choices[run % len(self.choices)]
        # Seeded by run and key, so that a value depends on no other call: runs are done anywhere.
        order = list(range(runs))
        random.Random(f"{seed} {self.key}").shuffle(order)  # noqa: S311  no secret
        inside = random.Random(f"{seed} {self.key} {run}").random()  # noqa: S311
        share = (order[run] + inside) / runs
        if self.whole:  # share is below 1: each whole number, the highest too, is equally likely
            return int(self.low) + int(share * (int(self.high) - int(self.low) + 1))
        return self.low + share * (self.high - self.low)


@dataclass(frozen=True, slots=True)
class SimulatedRun:
    """One run, as it is sent to a worker.

    Attributes:
        mission: As for `smachpy run`: a name, a file or module:factory.
        number: Number of the run, from 1.
        seed: Determines the order of events at the same instant, and seeds Python's `random`.
        values: The varied values by key.
        file: File for the recording.
        limit: Virtual time after which the run is preempted [s].
        allow: Packages of which a mission file may name code.
        sends: The recording is sent back: the file's folder is not that of the process which runs.
    """

    mission: str
    number: int
    seed: int
    values: Mapping[str, Value]
    file: Path
    limit: float
    allow: Sequence[str] = ()
    sends: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """The end of a run.

    Attributes:
        task: The run.
        outcome: None if it raised an exception, could not begin or did not end.
        error: The reason for no outcome.
        recording: Content of the recording, if it is sent.
    """

    task: SimulatedRun
    outcome: str | None
    error: str = ""
    recording: bytes = b""


@dataclass(frozen=True, slots=True)
class SimulationPlan:
    """The runs to simulate.

    Attributes:
        mission: As for `smachpy run`.
        runs: Number of runs.
        folder: Folder for the recordings; must exist.
        vary: The values that vary.
        seed: The same seed makes the same runs.
        limit: Virtual time that a run may take [s].
        allow: Packages of which a mission file may name code.
    """

    mission: str
    runs: int
    folder: Path
    vary: Sequence[Vary] = field(default=())
    seed: int = 1
    limit: float = LIMIT_S
    allow: Sequence[str] = ()

    def tasks(self) -> list[SimulatedRun]:
        """Return the runs.

        Raises:
            SmachError: the mission does not exist, needs real time, or lacks a key of `vary`.
        """
        target = load_target(self.mission, allow=self.allow)
        self._check(target)
        return [
            SimulatedRun(
                self.mission,
                run + 1,
                self.seed * 1_000_003 + run,  # no two plans with other seeds share a run's
                {vary.key: vary.value(run, self.runs, self.seed) for vary in self.vary},
                self.folder / f"{run + 1:04}.jsonl",
                self.limit,
                self.allow,
            )
            for run in range(self.runs)
        ]

    def _check(self, target: Target) -> None:
        info = mission_info(target.thing)
        if info.real_time:
            raise MissionError(
                f"mission {target.name!r} needs real time: {info.real_time}; expected one that "
                "runs in virtual time."
            )
        parameters = {*parameters_of(target.thing)}
        robot = _robot_parameters()
        # A mission without parameters takes its userdata keys as arguments, as in `smachpy run`.
        keys = set() if parameters else {*describe(target.build()).input_keys}
        known = parameters | keys
        for vary in self.vary:
            key = SHORT.get(vary.key, vary.key)
            if vary.key in known:
                continue
            if key not in robot:
                names = ", ".join(sorted({*known, *SHORT, *robot}))
                raise MissionError(
                    f"--vary {vary.key}: mission {target.name!r} has no such argument or key, and "
                    f"the simulated robot no such parameter; expected one of {names}."
                )
            if info.world is not None:
                raise MissionError(
                    f"--vary {vary.key}: mission {target.name!r} runs in its own world "
                    f"({info.world.name}); expected one of {sorted(parameters)}."
                )


def _robot_parameters() -> dict[str, float]:
    config = load_config(OFFICE_ROBOT)
    return {
        f"{section}.{name}": getattr(getattr(config, section), name)
        for section in ("robot", "planner", "control", "recovery", "scan", "battery")
        for name in getattr(config, section).__slots__
    }


def simulate(
    plan: SimulationPlan,
    executor: Executor | None = None,
    on_result: Callable[[Result], object] = lambda _: None,
    *,
    jobs: int | None = None,
) -> list[Result]:
    """Do the runs of a plan in virtual time and record each of them.

    Args:
        plan: The runs.
        executor: Does the runs; by default a pool of processes. Its workers need this package and
            the mission, and send their recordings back.
        on_result: Called in the caller's thread after each run.
        jobs: Number of processes in the default pool; by default one per core.

    Returns:
        The results in the order of the tasks.

    Raises:
        SmachError: as `SimulationPlan.tasks`, or a recording is there already.

    Blocks: until all runs have ended.
    """
    tasks = plan.tasks()
    for task in tasks:
        if task.file.exists():
            raise RecordingError(
                task.file, "the file exists; expected a new name, runs are never overwritten."
            )
    with contextlib.ExitStack() as stack:
        sends = executor is not None
        if executor is None:
            executor = stack.enter_context(_pool(jobs, len(tasks)))
        futures = {executor.submit(run_one, replace(task, sends=sends)): task for task in tasks}
        results = {}
        # In the order of their ends, for the progress; the results are sorted at the end.
        for future in as_completed(futures):
            task = futures[future]
            error = future.exception()
            result = future.result() if error is None else Result(task, None, _words(error))
            result = replace(result, task=task)
            if result.recording:
                # Written at once and dropped: thousands of recordings would fill the memory.
                with open_private(task.file, "wb") as file:
                    file.write(result.recording)
                result = replace(result, recording=b"")
            results[task.number] = result
            on_result(result)
    return [results[task.number] for task in tasks]


@contextlib.contextmanager
def _pool(jobs: int | None, runs: int) -> Iterator[Executor]:
    """A pool of processes for the runs; runs that have not begun at the end are cancelled.

    An exception such as Ctrl-C kills the processes at once, because a run may never end.

    Args:
        jobs: Number of processes; None: one per core.
        runs: Number of runs, the upper limit for the number of processes.
    """
    executor = Workers(min(jobs or cores(), runs))
    try:
        yield executor
    except BaseException:
        # First take the waiting runs away, so that no process begins another one.
        executor.shutdown(wait=False, cancel_futures=True)
        executor.kill()
        raise
    finally:
        executor.shutdown(cancel_futures=True)


def _words(error: BaseException) -> str:
    if isinstance(error, ImportError) and (text := advice(error)):
        return text
    if isinstance(error, WorkerError):
        return str(error)
    return f"{type(error).__name__}: {error}".partition("\n")[0]


def run_one(task: SimulatedRun) -> Result:
    """Do one run in virtual time, with the simulated robot in this process.

    Blocks: until the run has ended.
    """
    # Missions may print, and the command prints results to standard output. Redirecting it affects
    # all threads, so it is not done where an executor runs this in several.
    quiet: Any = contextlib.nullcontext()
    if threading.current_thread() is threading.main_thread():
        quiet = contextlib.redirect_stdout(io.StringIO())
    try:
        with quiet, contextlib.ExitStack() as stack:
            here = task
            if task.sends:
                folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="smachpy-run-"))
                here = replace(task, file=Path(folder) / task.file.name)
            # An executor of threads runs this in the caller's process: restore its `random`.
            stack.callback(random.setstate, random.getstate())
            random.seed(task.seed)
            here.file.unlink(missing_ok=True)  # of a process that died
            try:
                outcome, error = _execute(here)
            except Exception as problem:  # noqa: BLE001  as below, and there may be a recording
                outcome, error = None, _words(problem)
            recording = here.file.read_bytes() if task.sends and here.file.exists() else b""
            return Result(task, outcome, error, recording)
    except Exception as error:  # noqa: BLE001  whatever the mission's code does is a result
        return Result(task, None, _words(error))


def _execute(task: SimulatedRun) -> tuple[str | None, str]:
    """Do a run; return its outcome and "", or None and the reason for ending it."""
    target = load_target(task.mission, allow=task.allow)
    # Sort the values into parameters of the robot and arguments of the mission. A key that both
    # have is the mission's; the mission is built for its keys only if there is such a doubt.
    own = {*parameters_of(target.thing)}
    if not own and task.values.keys() & SHORT.keys():
        own = {*describe(target.build()).input_keys}
    robot = _robot_parameters()
    robot_values = {
        SHORT.get(key, key): value
        for key, value in task.values.items()
        if key not in own and SHORT.get(key, key) in robot
    }
    inputs = {
        key: Text(value) if isinstance(value, str) else value
        for key, value in task.values.items()
        if key in own or SHORT.get(key, key) not in robot_values
    }
    info = mission_info(target.thing)
    with contextlib.ExitStack() as stack:
        config = OFFICE_ROBOT
        if robot_values:  # beside the recording, which has a name of its own for each run
            config = task.file.with_suffix(".yaml")
            _write_config(config, robot_values)
            stack.callback(config.unlink)
        # A mission that calls no robot is simulated without the robot's extra, too.
        simulated = find_spec("scipy") is not None or bool(robot_values or info.world)
        options = RobotOptions(start=simulated, map=OFFICE_MAP, config=config, world=info.world)
        surroundings = stack.enter_context(
            open_surroundings(Pace(virtual=True, seed=task.seed), options, NO_NAMES, "")
        )
        machine = build(target, inputs)
        # Servers that the mission itself starts are not there yet: wait only for the others.
        needed = needed_servers(describe(machine))
        others = {name: needed[name] for name in needed.keys() - set(info.serves)}
        if others and not simulated:
            raise MissionError(
                f"the mission calls {', '.join(sorted(others))}: the simulated robot needs the "
                "package 'scipy'. Try: pip install 'smachpy[sim]'"
            )
        surroundings.start(machine, others)
        if not surroundings.wait(SERVER_TIMEOUT_S):
            raise MissionError("the program was asked to end")
        with _recorded(task.file, machine), _limited(machine, task.limit) as limit:
            outcome = machine.execute()
        surroundings.over()
    return (outcome, "") if limit.reached is None else (None, limit.reached)


@contextlib.contextmanager
def _recorded(file: Path, machine: Container) -> Iterator[None]:
    """Record a machine, and its robot without scans: these would take longer than the run."""
    with RobotTopics(scans=False) as robot, Recorder(file, machine) as recorder:
        ends = robot.listen(recorder.observe)
        try:
            yield
        finally:
            ends()


class _Limit:
    """Preempts a machine that does not end by itself.

    Args:
        machine: The machine.
        seconds: Virtual time that it may take [s].

    Attributes:
        reached: The reason for the preempt; None without one.
    """

    def __init__(self, machine: Container, seconds: float) -> None:
        self.reached: str | None = None
        self._machine = machine
        self._seconds = seconds
        self._instant, self._events = 0.0, 0  # newest instant, and number of events at it
        self._active: dict[str, None] = {}  # paths of running states, in the order of their begin
        self._newest = "no state"  # path of the state that was left last

    def on_time(self) -> None:
        """End the run: its virtual time is over."""
        self._end(f"had not ended after {self._seconds:g} s of virtual time")

    def on_event(self, event: Event) -> None:
        """Count events at one instant, and keep track of the running states."""
        if isinstance(event, (Left, Failed)):
            self._active.pop(event.path, None)
            self._newest = event.path
        elif isinstance(event, Entered):
            self._active[event.path] = None
        self._events = self._events + 1 if event.t == self._instant else 0
        self._instant = event.t
        if self._events > MAX_VARIED_RUNS:
            self._end(f"went on for {MAX_VARIED_RUNS} events without waiting")

    def _end(self, why: str) -> None:
        if self.reached is None:
            self.reached = f"{why}; it was in {', '.join(innermost(self._active)) or self._newest}"
            with asking("program", "smachpy simulate", "its time is over"):
                self._machine.request_preempt()


@contextlib.contextmanager
def _limited(machine: Container, seconds: float) -> Iterator[_Limit]:
    limit = _Limit(machine, seconds)
    unsubscribe = machine.subscribe(limit.on_event)
    timer = current_clock().call_later(seconds, limit.on_time)
    try:
        yield limit
    finally:
        timer.cancel()
        unsubscribe()


def _write_config(file: Path, values: Mapping[str, Value]) -> None:
    """Write the office robot's parameters with other values."""
    from ruamel.yaml import YAML

    yaml = YAML()
    document = yaml.load(OFFICE_ROBOT)
    for key, value in values.items():
        section, _, name = key.partition(".")
        try:
            number = float(value) if isinstance(value, str) else value
        except ValueError:
            raise ValueError(f"{key}: got {value!r}; expected a number.") from None
        document.setdefault(section, {})[name] = number
    with file.open("w", encoding="utf-8") as stream:
        yaml.dump(document, stream)
