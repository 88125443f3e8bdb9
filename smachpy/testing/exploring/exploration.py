"""Runs a mission with all combinations of choices, and finds a shortest run that fails."""

from __future__ import annotations

import ast
import contextlib
import copy
import inspect
import logging
import math
import pickle
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import RealClock, VirtualClock
from smachpy.base.functions import name_of
from smachpy.base.problems import Problems, unknown_arguments
from smachpy.engine.described import walk
from smachpy.events.introspection import describe
from smachpy.exceptions import SmachError
from smachpy.machines.container import Container, below
from smachpy.testing import session
from smachpy.testing.doubles import Double, Places
from smachpy.testing.exploring.ahead import Ahead
from smachpy.testing.exploring.explorer import (
    DEFAULTS,
    FAULTS,
    Explorer,
    Orders,
    RunOptions,
    begins,
)
from smachpy.testing.exploring.search import Search
from smachpy.testing.exploring.verdicts import judge
from smachpy.testing.kit import MissionKit, check_limits, check_machine
from smachpy.testing.process import Killed

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
    from typing import Self, TypeAlias, Unpack

    from smachpy.base.cluster import Cluster
    from smachpy.events.introspection import StateRecord
    from smachpy.testing.exploring.ahead import Found, Known, Prefix
    from smachpy.testing.exploring.kills import Kill, MemoryJournal
    from smachpy.testing.exploring.search import ScheduleChoice
    from smachpy.testing.exploring.verdicts import Verdict
    from smachpy.testing.runs import Run

    Machine: TypeAlias = Container | Callable[[], Container]

COMPUTER = RealClock()  # measures the computer's time: a run's own time is virtual
SHRINKING_RUNS = 300  # the most runs to shorten a counterexample
AHEAD_AFTER_S = 2.0  # [s] shorter explorations have one process: others take a second to begin
ORDERS = 100  # the most thread orders that are compared with a run with a kill


class ReplayError(SmachError):
    """A replayed run came to another choice than the recorded one.

    Try: explore again: the mission has changed since, or depends on more than the explorer chooses.
    """


@dataclass(frozen=True, slots=True)
class Counterexample:
    """A run that breaks an invariant.

    Attributes:
        reason: What is wrong with it.
        run: The run.
        choices: Its choices, as texts for `replay`.
        script: A program that repeats it.
        picture: The machine with this run; None if no drawing package is installed.
        is_cut: Whether `max_time` ended its shortening: then a faster computer may find a shorter
            one. Otherwise the counterexample is the same on every computer.
    """

    reason: str
    run: Run
    choices: tuple[str, ...]
    script: str
    picture: Path | None = None
    is_cut: bool = False

    def __str__(self) -> str:
        shown = "" if self.picture is None else f"\npicture: {self.picture}"
        if self.is_cut:
            shown += "\n(max_time ended its shortening: a faster computer may find a shorter one)"
        return f"{self.reason}\n{self.run.explain()}{shown}\nTo repeat it:\n\n{self.script}"


@dataclass(frozen=True, slots=True)
class Exploration:
    """The result of `explore`.

    Attributes:
        ok: Whether every run kept all invariants.
        runs: Number of runs, without those for shortening.
        exhaustive: Whether there are no more runs: every choice was tried in every situation.
        stopped_by: Why not: "max_runs", "max_time", "max_depth", "timeout" or "counterexample".
        counterexample: A shortest run that breaks an invariant.
        seconds: How long it took.
        not_raised: Exceptions in `on_exception` or `retry` that no run raised, because they
            cannot be made from a text alone.
        no_time_for: What no run tried, because a `timeout` of the machine leaves no time for it,
            such as "/M/A to outlast /M/B".
    """

    ok: bool
    runs: int
    exhaustive: bool
    stopped_by: str
    counterexample: Counterexample | None
    seconds: float
    not_raised: tuple[str, ...] = ()
    no_time_for: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return self.ok

    def assert_ok(self) -> None:
        """Fail with the counterexample, if there is one.

        It does not fail if a limit has ended the exploration before every run was tried; pytest's
        summary then lists it. Use `assert found.exhaustive` if all is to be tried.

        Raises:
            AssertionError: a run breaks an invariant.
        """
        __tracebackhide__ = True
        if not self.ok:
            raise AssertionError(str(self))

    def __str__(self) -> str:
        extent = "all there are" if self.exhaustive else f"stopped by {self.stopped_by}"
        names = ", ".join(self.not_raised)
        left_out = f" (not raised, as they want arguments: {names})" if names else ""
        if self.no_time_for:
            first, *more = self.no_time_for
            rest = f" (and {len(more)} more)" if more else ""
            extent = f"not all there are: a timeout leaves no time for {first}{rest}"
        head = f"{self.runs} runs in {self.seconds:.1f} s, {extent}"
        if self.counterexample is None:
            return f"{head}: no counterexample{left_out}"
        return f"{head}{left_out}: {self.counterexample}"


def explore(
    machine: Machine,
    *,
    max_runs: int = 1_000,
    max_time: float = 60.0,
    max_depth: int = 60,
    invariants: Iterable[Callable[[Run], object]] = (),
    grace: float = 10.0,
    folder: Callable[[], Path] | None = None,
    on_run: Callable[[Run], object] | None = None,
    jobs: int | None = None,
    cluster: Cluster | None = None,
    progress: Callable[[int], object] | None = None,
    **options: Unpack[RunOptions],
) -> Exploration:
    """Run a mission with every combination of leaf outcomes, preempts, faults and interleavings.

    Each leaf is replaced by a double that takes one second, less within a timeout of a few seconds,
    and ends with each of its outcomes in turn. If several run at once, each may be the next to end;
    it outlasts the others then. Other durations are not varied: those of kept states, of pauses
    before retries, of scripted servers. Runs with few unusual choices come first. Without
    invariants of your own, each situation (active states, outcomes, items, userdata, threads that
    can continue) is entered once, which makes machines with loops finite; state that leaves keep
    elsewhere is not seen. Your own invariant may look at the whole past, so then every sequence of
    choices is a case of its own.

    These invariants are always checked: the mission ends; it does not raise; after a preempt it
    ends within `grace`; no goal is left running.

    Args:
        machine: A container, or a function that makes one (necessary if its items run out).
        max_runs: The most runs.
        max_time: The longest time [s of the computer]. What it cuts off depends on the computer,
            and `stopped_by` says so. Shortening a counterexample may take as long again;
            `Counterexample.is_cut` says whether that was too short.
        max_depth: Choices of a run after this many are not varied.
        invariants: Called with each run. A false value other than None, or an exception, is a
            counterexample.
        grace: Longest time from a preempt to the end [s].
        folder: Returns the folder for the picture.
        on_run: Called with each run, for coverage; by default that of the test session.
        jobs: Number of processes, as far as `machine` and `invariants` are functions that another
            process can import, and there are no kills; 1: this one only; by default all cores, for
            explorations that take some seconds. The result does not depend on it, if `invariants`
            only look at the run.
        cluster: Has the processes, on other computers; None: this computer.
        progress: Called before each run with the number of those done.
        **options: See `RunOptions`.

    Raises:
        TypeError: `machine` is neither a container nor a function, or there is no such option.
        InvalidStateError: an invariant is no plain function of the run, `limit` or `steps` is none,
            or `faults` or `keep` is no list.
        ValueError: there is no such fault, or `jobs` is less than 1.
        UnknownStateError: `keep` or `writes` names a state that does not exist; or a name in
            `writes` is ambiguous.
    """
    check_machine(machine, "explore", functions=True)
    own = _invariants(invariants)
    if jobs is not None and jobs < 1:
        raise ValueError(f"explore: jobs: got {jobs}; expected 1 or more.")
    on_run = on_run or session.current().on_run
    budget = _Budget(max_runs, max_time)
    search = Search(max_depth)
    with (
        Ahead(
            runs_of,
            (machine, own, grace, options),
            jobs,
            cluster,
            wants_runs=on_run is not None,
        ) as ahead,
        RepeatedRun("explore", machine, options, merges=not own) as runner,
    ):

        def verdict_on(run: Run, error: Exception | None) -> Verdict | None:
            return judge(run, error, runner.explorer, grace=grace, invariants=own)

        tries = _Tries(runner, ahead, search, budget, verdict_on, on_run, progress)
        example, stopped_by = tries.all(max_time)
    no_time_for = tries.no_time_for()
    stopped_by = "counterexample" if example is not None else stopped_by
    stopped_by = stopped_by or ("max_depth" if search.is_cut else "")
    stopped_by = stopped_by or ("timeout" if no_time_for else "")
    if example is not None and folder is not None:
        file = folder() / f"{example.run.record.label}-counterexample.svg"
        example = replace(example, picture=example.run.draw(file))
    left_out = runner.explorer.not_raised
    note = session.current().on_cut
    if example is None and stopped_by and note is not None:
        path = runner.explorer.root_path
        note(f"{path}: explored {budget.runs} runs, not all there are: {stopped_by}")
    return Exploration(
        example is None,
        budget.runs,
        not stopped_by,
        stopped_by,
        example,
        budget.seconds,
        left_out,
        no_time_for if stopped_by == "timeout" else (),
    )


@dataclass(frozen=True, slots=True)
class _Tries:
    """The runs of one exploration, in this process and in others."""

    runner: RepeatedRun
    ahead: Ahead
    search: Search
    budget: _Budget
    verdict_on: Callable[[Run, Exception | None], Verdict | None]
    on_run: Callable[[Run], object] | None
    progress: Callable[[int], object] | None
    orders: Orders = field(default_factory=Orders)

    def no_time_for(self) -> tuple[str, ...]:
        """Return what a timeout has cut off in some runs, and no run had the time for."""
        left = sorted(self.orders.cut - self.orders.ended)
        return tuple(f"{a} to end" if a == b else f"{a} to outlast {b}" for a, b in left)

    def all(self, max_time: float) -> tuple[Counterexample | None, str]:
        """Try what the search asks for; return the counterexample, and why not all was tried."""
        while (prefix := self.search.next()) is not None:
            stopped_by = self.budget.take()
            if stopped_by:
                return None, stopped_by
            if self.progress is not None:
                self.progress(self.budget.runs - 1)
            if self._was_done_elsewhere(prefix):
                continue
            run, error = self.runner.run(prefix)
            self._tell(run)
            verdict = self.verdict_on(run, error)
            if verdict is not None:
                return _shrunk(self.runner, self.verdict_on, max_time, verdict, run), ""
            choices = self.runner.explorer.choices
            self.orders.add(self.runner.explorer.orders)
            self.ahead.note(prefix, choices)
            self.search.add(prefix, choices)
            example, stopped_by = _killed_anywhere(self.runner, self.verdict_on, self.budget)
            if example is not None or stopped_by:
                return example, stopped_by
        return None, ""

    def _was_done_elsewhere(self, prefix: tuple[int, ...]) -> bool:
        """Take a run that another process has done, and that keeps all invariants."""
        if "kill" in self.runner.options["faults"] or self.budget.seconds < AHEAD_AFTER_S:
            return False
        found = self.ahead.found(prefix, self.search)
        if found is None:
            return False
        choices, run, orders = found
        self._tell(run)
        self.orders.add(orders)
        self.search.add(prefix, choices)
        return True

    def _tell(self, run: Run | None) -> None:
        if self.on_run is not None and run is not None:
            self.on_run(run)


def replay(machine: Machine, choices: Sequence[str], **options: Unpack[RunOptions]) -> Run:
    """Repeat a run of `explore`.

    Args:
        machine: As in `explore`.
        choices: Those of the counterexample; later choices are the usual ones.
        **options: Those given to `explore`.

    Raises:
        ReplayError: the machine has changed.
        Exception: the run raised it.
    """
    check_machine(machine, "replay", functions=True)
    kill = None
    with RepeatedRun("replay", machine, options) as runner:
        if "kill" in runner.options["faults"] and choices:
            from smachpy.testing.exploring.kills import parse_kill

            kill = parse_kill(choices[-1])
        run, error = runner.run(choices if kill is None else choices[:-1])
        if kill is not None:
            run, error = runner.run((), kill, like=runner.explorer.picks)
    if error is not None:
        raise error
    return run


def _invariants(given: Iterable[Callable[[Run], object]]) -> tuple[Callable[[Run], object], ...]:
    problems = Problems("explore")
    checked = problems.values("invariants", given)
    for number, one in enumerate(checked):
        problems.function(f"invariants[{number}]", one, "invariant(run)", 1, optional=False)
    problems.raise_all()
    return checked


class _Budget:
    """Counts the runs, and limits their number and time."""

    def __init__(self, max_runs: int, max_time: float) -> None:
        self._max_runs, self._max_time = max_runs, max_time
        self._begun = COMPUTER.now()
        self.runs = 0

    @property
    def seconds(self) -> float:
        """Time since the first run [s of the computer]."""
        return COMPUTER.now() - self._begun

    def take(self) -> str:
        """Count a run; return why there may be no more, else ""."""
        if self.runs >= self._max_runs:
            return "max_runs"
        if self.runs > 0 and self.seconds > self._max_time:  # one run in any case, on any computer
            return "max_time"
        self.runs += 1
        return ""


class RepeatedRun:
    """Runs a machine many times, always from the same initial state.

    Args:
        call: The function that the user called, for errors.
        machine: The machine, or a function that makes it.
        given: The options that differ from the defaults.
        merges: As in `Explorer`.

    Raises:
        TypeError: there is no such option.
        ValueError: there is no such fault.
        InvalidStateError: `limit` or `steps` is none, or `faults` or `keep` is no list.
    """

    def __init__(
        self, call: str, machine: Machine, given: RunOptions, *, merges: bool = True
    ) -> None:
        named = (explore if call == "explore" else replay).__kwdefaults__ or {}
        unknown = unknown_arguments(given, (*DEFAULTS, *named))
        if unknown:
            raise TypeError(f"{call}: {unknown}")
        options: RunOptions = {**DEFAULTS, **given}
        # These may be iterators, which can be read only once.
        problems = Problems(call)
        options["faults"] = problems.values("faults", options["faults"])
        options["keep"] = problems.values("keep", options["keep"])
        problems.raise_all()
        faults = sorted(set(options["faults"]) - FAULTS)
        if faults:
            raise ValueError(f"{call}: faults: got {faults}; expected some of {sorted(FAULTS)}.")
        options["limit"], options["steps"] = check_limits(call, options["limit"], options["steps"])
        self.source = machine
        self.options = options
        self._call = call
        self._merges = merges
        self._places = Places()
        self._around = contextlib.ExitStack()
        self._killed_at: set[object] = set()
        self.facts: dict[str, Any] = {}
        self._machine: Container
        self._whole: StateRecord | None

    def __enter__(self) -> Self:
        with contextlib.ExitStack() as around:
            # `time` is patched once for all runs: each of them only adds its own clock.
            clock = around.enter_context(VirtualClock())
            around.enter_context(clock.patched())
            around.enter_context(_silence())
            self._prepare()
            self._around = around.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._around.close()
        self._restore()
        self._places.restore()

    def _prepare(self, journal: MemoryJournal | None = None) -> None:
        """Make the machine, and put doubles into it.

        Args:
            journal: The journal of a run that this process continues; None: a new run begins.
        """
        if journal is None or not isinstance(self.source, Container):
            self._places.restore()  # the machine before
            source = self.source
            made: object = source if isinstance(source, Container) else source()
            if not isinstance(made, Container):
                name = name_of(source)
                hint = f" Try `return` at the end of {name}." if made is None else ""
                raise TypeError(
                    f"{self._call}: machine: {name}() returned {made!r}; expected a machine.{hint}"
                )
            machine = self._machine = made
            self._whole = describe(machine) if self.options["doubles"] else None
            for path, make, made in self.options["doubles"]:
                made[:] = [self._places.put(machine, path, make)]
        machine = self._machine
        if journal is None:
            self.explorer = Explorer(machine, self.options, self._places, merges=self._merges)
        else:
            self.explorer.go_on(machine, self._places, journal.active())
        containers = [each for each in below(machine) if isinstance(each, Container)]
        self._userdata = [
            (c.userdata, {key: c.userdata[key] for key in c.userdata.keys()})  # noqa: SIM118
            for c in containers
        ]
        self._begins = [(each, begins(each)) for each in containers]
        self._scripts = [
            (path, state, state.script)
            for path, state in walk(machine, f"/{machine.name or 'SM_ROOT'}")
            if isinstance(state, Double)
        ]
        self._restore()  # the runs get copies, so that none can change the values stored here
        if journal is not None:
            for path, double, script in self._scripts:
                double.script = script[min(journal.ends(path), len(script) - 1) :]

    def _restore(self) -> None:
        """Reset the userdata, where the machines begin, and the test's doubles."""
        for _, double, script in self._scripts:
            double.script = script
        for userdata, values in self._userdata:
            for key in userdata.keys():  # noqa: SIM118
                del userdata[key]
            userdata.update(_copied(values))
        for container, (goes_on, stopped_at, initial) in self._begins:
            live = container._smachpy.live
            live.goes_on, live.stopped_at = goes_on, stopped_at
            if hasattr(container._smachpy, "next_initial"):
                container._smachpy.next_initial = initial

    def run(
        self,
        prefix: Sequence[int | str],
        kill: Kill | None = None,
        *,
        like: Mapping[Hashable, str] | None = None,
    ) -> tuple[Run, Exception | None]:
        """Run once, beginning with these choices; return the run and the exception it raised.

        Args:
            prefix: The choices.
            kill: Where the process is killed.
            like: The choices of the run to follow; `prefix` has only the turns of threads then.

        Raises:
            ReplayError: it came to other choices.
        """
        if not isinstance(self.source, Container) and self.explorer.choices:
            self._restore()  # the function may return the same machine each time
            self._prepare()
        self._restore()
        explorer, options = self.explorer, self.options
        runs: list[Run] = []
        error: Exception | None = None
        # A new kit for each run: threads and timers left over from one must not reach the next.
        kit = MissionKit(choose=explorer.turn, on_run=runs.append)
        self.journal = None
        if "kill" in options["faults"]:
            from smachpy.testing.exploring.kills import (
                MemoryJournal,  # slow to import, and seldom needed
            )

            self.journal = MemoryJournal(self._machine, kill)
        begins = None if self.journal is None else self.journal.begins
        explorer.begin(kit, prefix, picks=like, begins=begins)
        with kit:
            kit.draws, kit.call = False, self._call
            for server in options["servers"]:
                server.copy_to(kit)
            if options["real_actions"]:
                explorer.serve_actions()
            try:
                userdata = _copied(options["userdata"])
                if self.journal is None:
                    self._execute(kit, userdata)
                else:
                    self._execute_kept(kit, userdata, self.journal)
            except Exception as caught:  # noqa: BLE001  judged by the caller
                error = caught
            finally:
                explorer.end()
            if self.journal is not None:
                self.facts = self.journal.facts(kit.ends)
        if explorer.mismatch:
            raise ReplayError(explorer.mismatch) from error
        run = runs[-1]
        return (run if self._whole is None else replace(run, whole=self._whole)), error

    def kills(self) -> Iterator[Kill]:
        """Yield the kills for the last run, each place once; none without that fault.

        Only for runs in which the threads take turns: their order starts anew in another process.
        """
        explorer, journal = self.explorer, self.journal
        if journal is None or any(turn.picked for turn in explorer.turns):
            return
        from smachpy.testing.exploring.kills import kills_of

        yield from kills_of(journal, self._killed_at)

    def _execute(self, kit: MissionKit, userdata: Mapping[str, Any] | None) -> None:
        options = self.options
        unsubscribe = self._machine.subscribe(self.explorer.on_event)
        try:
            kit(self._machine, userdata, limit=options["limit"], steps=options["steps"])
        finally:
            unsubscribe()

    def _execute_kept(
        self, kit: MissionKit, userdata: Mapping[str, Any] | None, journal: MemoryJournal
    ) -> None:
        """Run with a journal, in one process after another until none is killed."""
        from smachpy.durable.mission import kept_mission

        store = journal.as_store()
        while True:
            try:
                with kit.process() as process:
                    journal.die = process.kill
                    with kept_mission(self._machine, store, "explored", lease_s=math.inf):
                        self._execute(kit, userdata)
            except Killed:
                self._prepare(journal)
                userdata = None if journal.position.visits else userdata
            else:
                return


_compared: dict[bytes, bool] = {}  # by the job: whether this process does what its sender does


def runs_of(
    job: bytes, known: Known, prefixes: Sequence[Prefix], wants_runs: bool
) -> list[Found | None] | None:
    """Do runs; return None for each that breaks an invariant, or is not possible.

    Args:
        job: What is run.
        known: Runs of the process that asks; if they are not the same here, None is returned.
        prefixes: The runs.
        wants_runs: Whether the runs are needed, besides their choices.

    Blocks: until they are done.
    """
    machine, invariants, grace, options = pickle.loads(job)  # noqa: S301  of the process that began this one
    with RepeatedRun("explore", machine, options, merges=not invariants) as runner:

        def found(prefix: Prefix) -> Found | None:
            try:
                run, error = runner.run(prefix)
            except ReplayError:
                return None
            explorer = runner.explorer
            is_ok = judge(run, error, explorer, grace=grace, invariants=invariants) is None
            told = run if wants_runs else None
            return (explorer.choices, told, explorer.orders) if is_ok else None

        if job not in _compared:
            mine = [found(prefix) for prefix, _ in known]
            _compared[job] = [one and one[0] for one in mine] == [choices for _, choices in known]
        return [found(prefix) for prefix in prefixes] if _compared[job] else None


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Log nothing: errors in a run are reported as its verdict."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _copied(values: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return copies of values; what cannot be copied, such as a lock or a socket, is shared.

    The copies are made with one `memo`, so that values with a part in common have one again.
    """
    # One object `memo` to the end: `deepcopy` notes its address in it. With another memo for each
    # value, a dict that is made during a later copy could get this address.
    copies, memo = {}, dict[int, Any]()
    for key, value in (values or {}).items():
        before = set(memo)
        try:
            copies[key] = copy.deepcopy(value, memo)
        except Exception:  # noqa: BLE001  of any kind: the value's own code decides
            copies[key] = value
            for part in memo.keys() - before:  # unfinished copies
                del memo[part]
    return copies


# -- the counterexample ----------------------------------------------------------------------------


def _shrunk(
    runner: RepeatedRun,
    verdict_on: Callable[[Run, Exception | None], Verdict | None],
    max_time: float,
    verdict: Verdict,
    run: Run,
) -> Counterexample:
    """Return the shortest run found that fails in the same way."""
    choices = runner.explorer.choices
    reason = verdict.reason
    end = COMPUTER.now() + max_time
    tries = 0
    simpler = _simpler(choices)
    late = False
    while (prefix := next(simpler, None)) is not None and tries < SHRINKING_RUNS:
        tries += 1
        late = COMPUTER.now() > end
        if late:
            break
        try:
            found, error = runner.run(prefix)
        except ReplayError:
            continue  # there is no run with these choices
        why = verdict_on(found, error)
        others = runner.explorer.choices
        if why is None or why.kind != verdict.kind:
            continue
        if _size(found, others) < _size(run, choices):
            run, choices, reason = found, others, why.reason
            simpler = _simpler(choices)
    texts = _texts(choices)
    script = _script(runner, texts, reason)
    return Counterexample(reason, run, texts, script, is_cut=late)


def _killed_anywhere(
    runner: RepeatedRun,
    verdict_on: Callable[[Run, Exception | None], Verdict | None],
    budget: _Budget,
) -> tuple[Counterexample | None, str]:
    """Repeat the last run with kills, if that fault is on.

    Returns:
        The first run that does not continue as without the kill, and why not all were tried.
    """
    explorer, expected = runner.explorer, runner.facts
    for kill in runner.kills():
        stopped_by = budget.take()
        if stopped_by:
            return None, stopped_by
        run, error = runner.run((), kill, like=explorer.picks)
        verdict = verdict_on(run, error)
        reason = (
            verdict.reason if verdict is not None else _difference(runner, kill, explorer, expected)
        )
        if reason:
            reason = f"{kill}, it does not go on as without that: {reason}"
            texts = (*_texts(explorer.choices), str(kill))
            return Counterexample(reason, run, texts, _script(runner, texts, reason)), ""
    return None, ""


def _texts(choices: list[ScheduleChoice]) -> tuple[str, ...]:
    """Return choices as texts, up to the last unusual one; later ones are the usual ones."""
    last = max((number for number, choice in enumerate(choices, 1) if choice.picked), default=0)
    return tuple(map(str, choices[:last]))


def _difference(
    runner: RepeatedRun, kill: Kill, explorer: Explorer, expected: Mapping[str, Any]
) -> str:
    """Return how the last run, with a kill, differs from the one without; "" if not at all."""
    from smachpy.testing.exploring.kills import difference

    if kill.loses_request:
        return ""
    facts = runner.facts
    found = difference(facts, expected)
    return "" if found and _is_other_order(runner, explorer.picks, facts) else found


def _is_other_order(
    runner: RepeatedRun, picks: Mapping[Hashable, str], facts: Mapping[str, Any]
) -> bool:
    """Return whether the run ends like that without a kill, in another order of its threads.

    Threads that are ready at the same moment run in another order in another process, so such a
    difference is not the kill's fault.
    """
    search = Search(depth=math.inf)
    for _ in range(ORDERS):
        prefix = search.next()
        if prefix is None:
            return False
        runner.run(prefix, like=picks)
        if runner.facts == facts:
            return True
        search.add(prefix, runner.explorer.turns)
    return False


def _simpler(choices: list[ScheduleChoice]) -> Iterator[tuple[int, ...]]:
    """Yield prefixes of runs that may be shorter, the shortest first."""
    picks = tuple(choice.picked for choice in choices)
    for number, choice in enumerate(choices):
        for other in range(len(choice.options)):
            if other != choice.picked:
                yield (*picks[:number], other)
                if number + 1 < len(picks):
                    yield (*picks[:number], other, picks[number + 1])


def _size(run: Run, choices: list[ScheduleChoice]) -> tuple[int, int]:
    return len(run.path), sum(choice.picked != 0 for choice in choices)


def _script(runner: RepeatedRun, choices: tuple[str, ...], reason: str) -> str:
    """Return a program that repeats a run."""
    options: dict[str, Any] = dict(runner.options)
    call, note = "replay", "from smachpy.testing import replay\n"
    of_test = [f"mission.replace(...) of {path}" for path, _, _ in options.pop("doubles")]
    of_test += [f"{type(end).__name__} {end.name!r}" for end in options.pop("servers")]
    if of_test:
        call, note = "mission.replay", f"# in the test, after its {', '.join(of_test)}\n"
    defaults: dict[str, Any] = dict(DEFAULTS)
    extra = ""
    for name, value in options.items():
        usual = defaults[name]
        if value != usual and (value or usual):
            text, mark, gap = _literal(value).partition("  #")
            extra += f"    {name}={text},{mark}{gap}\n"
    listed = "".join(f"        {choice!r},\n" for choice in choices)
    return (
        f"# {reason.splitlines()[0]}\n{note}\n{_import_of(runner.source)}\n\n"
        f"run = {call}(\n    machine,\n    [\n{listed}    ],\n{extra})\nprint(run.explain())\n"
    )


def _import_of(source: Any) -> str:
    """Return the line of a script that imports the machine's source, or a placeholder."""
    module = sys.modules.get(getattr(source, "__module__", None) or "")
    names = [] if module is None else [n for n, v in vars(module).items() if v is source]
    if module is not None and names:
        home = module.__name__
        if home == "__main__":  # a script: its file can be imported
            home = Path(getattr(module, "__file__", None) or "?").stem
        if all(word.isidentifier() for word in (*home.split("."), names[0])):
            return f"from {home} import {names[0]} as machine"
    given = "the machine, or a function that makes it"
    if inspect.isfunction(source):
        code = source.__code__
        given = f"the function of line {code.co_firstlineno} of {Path(code.co_filename).name}"
    return f"machine = ...  # put in {given}"


def _literal(value: object) -> str:
    """Return a value as Python source, or a placeholder with a comment."""
    text = repr(value)
    try:
        ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return f"...  # as it was given to explore: {' '.join(text.split())}"
    return text
