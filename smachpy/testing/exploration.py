"""Running a mission over everything that can happen, and the shortest run that goes wrong."""

from __future__ import annotations

import contextlib
import copy
import inspect
import logging
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.clock import RealClock, VirtualClock
from smachpy.container import Container
from smachpy.exceptions import SmachError
from smachpy.introspection import describe
from smachpy.testing import session
from smachpy.testing._core.search import Choice, Search
from smachpy.testing._core.values import Snapshot
from smachpy.testing.action_choices import serve_actions
from smachpy.testing.doubles import Double, Places
from smachpy.testing.explorers import Explorer, Options, kept_by
from smachpy.testing.kit import MissionKit
from smachpy.testing.runs import find_path
from smachpy.testing.verdicts import judge
from smachpy.testing.watch import STEPS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import Self

    from smachpy.introspection import StateRecord
    from smachpy.testing.action_servers import ScriptedActionServer
    from smachpy.testing.doubles import Replacement
    from smachpy.testing.runs import Run
    from smachpy.testing.verdicts import Verdict

LIMIT_S = 3600.0
_COMPUTER = RealClock()  # for the time of the computer: `time` is a mission's while it runs
SHRINKING_RUNS = 300
_OUTSIDE = frozenset({"monitor", "condition", "service"})
FAULTS = frozenset({"hang", "raise", "deaf"})


class ReplayError(SmachError):
    """A run to be repeated came to another choice than the one that was noted."""


@dataclass(frozen=True, slots=True)
class Counterexample:
    """A run that breaks an invariant.

    Attributes:
        reason: What is wrong with it.
        run: The run.
        choices: What was chosen in it, as texts for `replay`.
        script: A program that repeats it.
        picture: The machine with this run; None when nothing that draws is installed.
        is_cut: `max_time` ended its shortening: a faster computer may find a shorter one. Otherwise
            it is the same on all.
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
    """What `explore` found.

    Attributes:
        ok: Whether every run kept all invariants.
        runs: Number of runs, those for shrinking left out.
        exhaustive: Whether there are no further runs: every choice was tried in every situation.
        stopped_by: Why it is not: "max_runs", "max_time", "max_depth" or "counterexample".
        counterexample: A shortest run that breaks an invariant.
        seconds: How long it took.
        not_raised: Exceptions that `on_exception` or `retry` name and no run raised, since they
            cannot be made from a text alone.
    """

    ok: bool
    runs: int
    exhaustive: bool
    stopped_by: str
    counterexample: Counterexample | None
    seconds: float
    not_raised: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return self.ok

    def __str__(self) -> str:
        extent = "all there are" if self.exhaustive else f"stopped by {self.stopped_by}"
        head = f"{self.runs} runs in {self.seconds:.1f} s, {extent}"
        names = ", ".join(self.not_raised)
        left_out = f" (not raised, as they want arguments: {names})" if names else ""
        if self.counterexample is None:
            return f"{head}: no counterexample{left_out}"
        return f"{head}{left_out}: {self.counterexample}"


def explore(
    machine: Container | Callable[[], Container],
    *,
    max_runs: int = 1_000,
    max_time: float = 10.0,
    max_depth: int = 60,
    max_steps: int = 200,
    limit: float = LIMIT_S,
    steps: int = STEPS,
    invariants: Iterable[Callable[[Run], object]] = (),
    faults: Iterable[str] = (),
    preempts: int = 1,
    interleavings: bool = True,
    grace: float = 10.0,
    keep: Iterable[str] = (),
    writes: Mapping[str, Mapping[str, Any]] | None = None,
    real_actions: bool = False,
    userdata: Mapping[str, Any] | None = None,
    folder: Callable[[], Path] | None = None,
    on_run: Callable[[Run], object] | None = None,
    doubles: Iterable[Replacement] = (),
) -> Exploration:
    """Run a mission over every leaf outcome, preempt point, fault and interleaving.

    Every leaf is stood in for by a double that takes one second and ends with each of its outcomes
    in turn. Of those that run at once, each may be the next to end: it outlasts the others then.
    Other times are not varied: those of what is kept, of retries' pauses, of scripted servers.
    Runs with few unusual choices come first. Without invariants of your own, situations
    that are equal (active states, outcomes, items, userdata, tasks that can go on) are entered
    once, which makes machines with loops finite; what states keep elsewhere is not seen. An own
    invariant may look at the whole past, so then every sequence of choices is a case of its own.

    These always hold, or are reported: the mission ends; it does not raise; after a preempt it ends
    within `grace`; no goal is left running.

    Args:
        machine: A container, or a function that makes one; needed when its items run out.
        max_runs: Most runs.
        max_time: Longest time [s of the computer]; to shorten what it found as long again, which
            `Counterexample.is_cut` tells of.
        max_depth: Choices of a run after this many are not varied.
        max_steps: Leaves with doubles in a run; with more it counts as one that never ends.
        limit: Longest run [s of its own clock, without what outlasts others]; so, too.
        steps: Most steps while no time passes, as in `mission(...)`; so, too.
        invariants: Called with each run. Anything false but None, or an exception, is a
            counterexample.
        faults: "hang": any leaf may never finish; "raise": may raise, a RuntimeError and whatever
            `on_exception` and `retry` of it and of its containers name, if it can be made from a
            text alone; "deaf": may ignore a preempt. Leaves with a timeout, and watchers beside
            others, hang anyway.
        preempts: Preempts per run, at most.
        interleavings: Whether to vary who goes on first, and who outlasts whom.
        grace: Longest time from a preempt to the end [s].
        keep: Leaves, or containers with all leaves in them, that stay as they are; a name may mean
            several. A preempt comes as soon as such a leaf waits.
        writes: Leaf -> userdata that its double writes.
        real_actions: Only services, monitors and conditions are stood in for. Scripted servers do
            to each goal all that servers do: succeed, abort, reject, accept late, die, come back,
            lose the result, deliver twice, ignore a cancel; preempts come while one works.
        userdata: Put into the machine's userdata before each run.
        folder: Gives the folder for the picture.
        on_run: Called with each run, for coverage; without it that of the session, if it measures.
        doubles: Those of the test, from `mission.replace`; kept as they are, from the beginning of
            their scripts in each run.

    Raises:
        ValueError: there is no such fault.
        UnknownStateError: `keep` or `writes` names a state that the machine does not have, or
            `writes` one of several.
    """
    unknown = sorted(set(faults) - FAULTS)
    if unknown:
        raise ValueError(f"explore: faults: got {unknown}; expected some of {sorted(FAULTS)}.")
    own = tuple(invariants)
    options = Options(
        frozenset(faults), preempts, interleavings, max_steps, dict(writes or {}), merges=not own
    )
    times = _Times(limit, steps)
    on_run = on_run or session.current().on_run
    begun = _COMPUTER.now()
    search = Search(max_depth)
    with _Runner(
        machine, options, tuple(keep), userdata, doubles, times, real_actions=real_actions
    ) as runner:
        shrinker = _Shrinker(runner, own, grace, max_time)
        runs = 0
        stopped_by = ""
        found: tuple[Verdict, Run] | None = None
        while found is None and (told := search.next()) is not None:
            if runs >= max_runs or _COMPUTER.now() - begun > max_time:
                stopped_by = "max_runs" if runs >= max_runs else "max_time"
                break
            run, error = runner.run(told)
            runs += 1
            if on_run is not None:
                on_run(run)
            verdict = shrinker.verdict(run, error)
            if verdict is not None:
                found = (verdict, run)
            else:
                search.took(told, runner.explorer.choices)
        example = None if found is None else shrinker.shrink(*found)
        left_out = runner.explorer.not_raised
    stopped_by = "counterexample" if example else stopped_by or ("max_depth" * search.is_cut)
    if example is not None:
        example = _drawn(example, folder)
    seconds = _COMPUTER.now() - begun
    return Exploration(
        example is None, runs, not stopped_by, stopped_by, example, seconds, left_out
    )


def replay(
    machine: Container | Callable[[], Container],
    choices: Sequence[str],
    *,
    faults: Iterable[str] = (),
    preempts: int = 1,
    interleavings: bool = True,
    max_steps: int = 200,
    limit: float = LIMIT_S,
    steps: int = STEPS,
    keep: Iterable[str] = (),
    writes: Mapping[str, Mapping[str, Any]] | None = None,
    real_actions: bool = False,
    userdata: Mapping[str, Any] | None = None,
    doubles: Iterable[Replacement] = (),
) -> Run:
    """Repeat a run of `explore`.

    Args:
        machine: As in `explore`, and so all others.
        choices: Those of the counterexample; what comes after them goes as usual.
        faults: See there.
        preempts: See there.
        interleavings: See there.
        max_steps: See there.
        limit: See there.
        steps: See there.
        keep: See there.
        writes: See there.
        real_actions: See there.
        userdata: See there.
        doubles: See there.

    Raises:
        ReplayError: the machine has changed.
        Exception: what the run raised.
    """
    options = Options(frozenset(faults), preempts, interleavings, max_steps, dict(writes or {}))
    times = _Times(limit, steps, "replay")
    with _Runner(
        machine, options, tuple(keep), userdata, doubles, times, real_actions=real_actions
    ) as runner:
        run, error = runner.run(choices)
    if error is not None:
        raise error
    return run


class _Times(NamedTuple):
    """How long a run may take.

    Attributes:
        limit_s: On its own clock [s].
        steps: While no time passes.
        call: Who takes other ones.
    """

    limit_s: float = LIMIT_S
    steps: int = STEPS
    call: str = "explore"


_TIMES = _Times()


class _Runner:
    """Runs a machine again and again, each time from the same beginning."""

    def __init__(
        self,
        machine: Container | Callable[[], Container],
        options: Options,
        keep: tuple[str, ...],
        userdata: Mapping[str, Any] | None,
        doubles: Iterable[Replacement] = (),
        times: _Times = _TIMES,
        *,
        real_actions: bool,
    ) -> None:
        self.source = machine
        self.options = options
        self.times = times
        self.keep = keep
        self.userdata = dict(userdata or {})
        self.doubles = tuple(doubles)
        self.real_actions = real_actions
        self._places = Places()
        self._machine: Container | None = None
        self._whole: StateRecord | None = None
        self.goals_left: list[str] = []
        self._snapshot: list[tuple[Container, Snapshot]] = []
        self._scripts: list[tuple[Double, tuple[str, ...]]] = []
        self._around = contextlib.ExitStack()

    def __enter__(self) -> Self:
        with contextlib.ExitStack() as around:
            # Put on the clock once for all runs: each of them only adds its own clock.
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

    def _prepare(self) -> None:
        """Make the machine, and put doubles into it."""
        source = self.source
        self._places.restore()  # and forget the machine before
        machine = source if isinstance(source, Container) else source()
        self._machine = machine
        self._whole = describe(machine) if self.doubles else None
        for path, make, made in self.doubles:
            made[:] = [self._places.put(machine, path, make)]  # type: ignore[list-item]
        record = describe(machine)
        writes = {find_path(record, leaf): data for leaf, data in self.options.writes.items()}
        self.explorer = Explorer(machine, self.options._replace(writes=writes))
        self._snapshot = [
            (container, Snapshot(dict(container.userdata._data)))  # noqa: SLF001  one house
            for container in _containers(machine)
        ]
        self._scripts = [
            (state, state.script)
            for container in _containers(machine)
            for state in container.get_children().values()
            if isinstance(state, Double)
        ]
        named = kept_by(record, self.keep)

        def kept(path: str, state: Any) -> bool:
            if path in named or isinstance(state, Double):
                return True
            return self.real_actions and state.kind not in _OUTSIDE

        self.explorer.stand_in(self._places, machine, record.path, kept)
        if self.real_actions:
            self.explorer.served.update(s.path for s in record.walk() if s.kind == "action")

    def _restore(self) -> None:
        """Put the machine's userdata and the test's doubles back to the beginning."""
        for double, script in self._scripts:
            double.script = script
        for container, data in self._snapshot:
            container.userdata._data.clear()  # noqa: SLF001  one house
            container.userdata._data.update(data.copy())  # noqa: SLF001

    def run(self, told: Sequence[int | str]) -> tuple[Run, Exception | None]:
        """Run once; what it raised comes back with the run."""
        machine = self._machine
        if not isinstance(self.source, Container) and self.explorer.choices:
            self._restore()  # of a function that gives the same machine each time
            self._prepare()  # a new machine for each run
            machine = self._machine
        assert machine is not None
        self._restore()
        self.explorer.begin(told)
        runs: list[Run] = []
        unsubscribe = machine.subscribe(self.explorer.on_event)
        error: Exception | None = None
        # A kit for each run: what still waits in one must not reach into the next.
        with MissionKit(choose=self.explorer.turn, on_run=runs.append) as kit:
            kit.draws, kit.call = False, self.times.call
            self.explorer.clock = kit.clock
            servers: list[ScriptedActionServer] = []
            if self.real_actions:
                servers = serve_actions(kit, machine, self.explorer)
            try:
                limit_s, steps, _ = self.times
                kit(machine, copy.deepcopy(self.userdata), limit=limit_s, steps=steps)
            except Exception as caught:  # noqa: BLE001  judged by the caller
                error = caught
            finally:
                unsubscribe()
                self.explorer.end()
            self.goals_left = [goal for server in servers for goal in server.left]
        if self.explorer.mismatch:
            raise ReplayError(self.explorer.mismatch) from error
        run = runs[0]
        return (run if self._whole is None else replace(run, whole=self._whole)), error


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Keep the log quiet: what goes wrong in a run is its verdict's business."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _containers(container: Container) -> Iterator[Container]:
    yield container
    for child in container.get_children().values():
        if isinstance(child, Container):
            yield from _containers(child)


@dataclass(frozen=True, slots=True)
class _Shrinker:
    """Tells good runs from bad ones, and finds the shortest bad one."""

    runner: _Runner
    own: tuple[Callable[[Run], object], ...]
    grace: float
    max_time: float

    def verdict(self, run: Run, error: Exception | None) -> Verdict | None:
        """Return what is wrong with the runner's last run."""
        return judge(
            run,
            error,
            self.runner.explorer,
            grace=self.grace,
            goals_left=self.runner.goals_left,
            invariants=self.own,
        )

    def shrink(self, verdict: Verdict, run: Run) -> Counterexample:
        """Return the shortest run that can be found that is wrong in the same way."""
        best = run, verdict, list(self.runner.explorer.choices)
        tries = 0
        end = _COMPUTER.now() + self.max_time
        better, late = True, False
        while better and tries < SHRINKING_RUNS:
            better = False
            for told in _simpler(best[2]):
                tries += 1
                late = _COMPUTER.now() > end
                if tries >= SHRINKING_RUNS or late:
                    break
                try:
                    found, error = self.runner.run(told)
                except ReplayError:
                    continue  # there is no such run
                why = self.verdict(found, error)
                choices = list(self.runner.explorer.choices)
                if why is None or why.kind != verdict.kind:
                    continue
                if _size(found, choices) >= _size(run, best[2]):
                    continue
                run, best, better = found, (found, why, choices), True
                break
        run, (_, reason), choices = best
        texts = tuple(str(choice) for choice in _without_usual_end(choices))
        script = _script(self.runner, texts, reason)
        return Counterexample(reason, run, texts, script, is_cut=late)


def _simpler(choices: list[Choice]) -> Iterator[tuple[int, ...]]:
    """Yield beginnings of runs that may be shorter, the shortest first."""
    picks = tuple(choice.picked for choice in choices)
    for number, choice in enumerate(choices):
        for other in range(len(choice.options)):
            if other != choice.picked:
                yield (*picks[:number], other)
                if number + 1 < len(picks):
                    yield (*picks[:number], other, *picks[number + 1 :][:1])


def _size(run: Run, choices: list[Choice]) -> tuple[int, int]:
    return len(run.path), sum(choice.picked != 0 for choice in choices)


def _without_usual_end(choices: list[Choice]) -> list[Choice]:
    """Return the choices up to the last that is not the usual one."""
    unusual = [number for number, choice in enumerate(choices) if choice.picked]
    return choices[: unusual[-1] + 1] if unusual else []


def _script(runner: _Runner, choices: tuple[str, ...], reason: str) -> str:
    """Return a program that repeats a run."""
    source: Any = runner.source
    if inspect.isfunction(source) and "<locals>" not in source.__qualname__:
        make = f"from {source.__module__} import {source.__name__} as machine"
    else:
        make = "machine = ...  # the machine, or a function that makes it"
    call, note = "replay", "from smachpy.testing import replay\n"
    if runner.doubles:
        names = ", ".join(path for path, _, _ in runner.doubles)
        call, note = "mission.replay", f"# in the test, after its mission.replace(...) of {names}\n"
    options, times = runner.options, runner.times
    arguments = [
        f"faults={sorted(options.faults)!r}" if options.faults else "",
        f"preempts={options.preempts}" if options.preempts != 1 else "",
        "" if options.interleavings else "interleavings=False",
        f"max_steps={options.most_steps}" if options.most_steps != Options().most_steps else "",
        f"limit={times.limit_s!r}" if times.limit_s != LIMIT_S else "",
        f"steps={times.steps}" if times.steps != STEPS else "",
        f"keep={list(runner.keep)!r}" if runner.keep else "",
        f"writes={dict(options.writes)!r}" if options.writes else "",
        "real_actions=True" if runner.real_actions else "",
        f"userdata={runner.userdata!r}" if runner.userdata else "",
    ]
    extra = "".join(f"    {argument},\n" for argument in arguments if argument)
    listed = "".join(f"        {choice!r},\n" for choice in choices)
    first = reason.splitlines()[0]
    return (
        f"# {first}\n{note}\n{make}\n\n"
        f"run = {call}(\n    machine,\n    [\n{listed}    ],\n{extra})\nprint(run.explain())\n"
    )


def _drawn(example: Counterexample, folder: Callable[[], Path] | None) -> Counterexample:
    if folder is None:
        return example
    picture = example.run.draw(folder() / f"{example.run.record.label}-counterexample.svg")
    return replace(example, picture=picture)
