"""Runs the mission of a recording again, in the world of the recording, and compares."""

from __future__ import annotations

import contextlib
import json
import random
import sys
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from actionlib_core import border
from actionlib_core.clock import Deadlock, RealClock
from actionlib_core.exceptions import ActionlibError
from actionlib_core.names import parse_arguments
from smachpy.command.arguments import Text
from smachpy.command.durable import whole_target
from smachpy.command.mission_run import build
from smachpy.command.queued import Allowed, check_is_mission
from smachpy.command.targets import load_target
from smachpy.engine.journal import NO_JOURNAL, RunJournal
from smachpy.events.code import code_facts
from smachpy.events.introspection import describe
from smachpy.exceptions import MissionError, SmachError, error_text
from smachpy.reproduce.changes import changes, code_has_changed
from smachpy.reproduce.compare import (
    compare,
    is_tolerated,
    limit_changes,
    odd_verdicts,
    own_states,
    steps_of,
    unknown_tolerated,
)
from smachpy.reproduce.play import Player
from smachpy.reproduce.world import first_run, world_of
from smachpy.testing.kit import MissionKit
from smachpy.testing.runs import TimeLimitError
from smachpy.userdata.json_text import decoded
from smachpy.userdata.secret import MASK

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator
    from pathlib import Path

    from actionlib_core.border import Crossing
    from smachpy.engine.frame import Frame
    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Recording
    from smachpy.machines.container import Container
    from smachpy.reproduce.compare import Comparison, Odd
    from smachpy.reproduce.world import World

LONGER_S: Final = 60.0
"""A run may take so much longer than its recording; then it is ended [s]."""

LARGEST_BUFFER: Final = 10_000_000


class ReproductionError(SmachError):
    """A recording cannot be reproduced.

    Try: record again with `--record`; docs/reproduce.md says what a recording needs.

    Attributes:
        path: The file.
        problem: Why not.
    """

    def __init__(self, path: object, problem: str) -> None:
        self.path = str(path)
        self.problem = problem
        super().__init__(f"{self.path}: cannot be reproduced: {problem}")


@dataclass(frozen=True, slots=True)
class Reproduction:
    """A run of today's code in the world of a recording.

    Attributes:
        name: The machine's name.
        comparison: How it compares.
        duration: How long the recorded run took [s].
        seconds: How long this one took on the computer [s].
        outcome: Outcome of this run; None if it did not end.
        notes: What was lacking or could not be played, in words.
        changed: What has changed in machine, constants and files, in words.
        events: The events of this run, as records.
        record: The machine of today.
    """

    name: str
    comparison: Comparison
    duration: float
    seconds: float
    outcome: str | None
    notes: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    events: list[dict[str, Any]] = field(default_factory=list)
    record: StateRecord | None = None

    @property
    def is_same(self) -> bool:
        """Whether there is no difference."""
        return self.comparison.difference is None


def reproduce(
    recording: Recording,
    *,
    mission: str = "",
    allow: Iterable[str | Path] = (),
    make: Callable[[], Container] | None = None,
    seed: int | None = None,
    tolerate: Collection[str] = (),
    world: World | None = None,
) -> Reproduction:
    """Run the mission of a recording again, and compare.

    Args:
        recording: The recording.
        mission: The mission, as for `smachpy run`; "": the one that it names.
        allow: Places whose missions it may name, besides the installed ones: files, folders and
            modules.
        make: Makes the machine instead.
        seed: Picks the interleaving of threads.
        tolerate: What may differ, see `steps_of`.
        world: The world; None: as recorded.

    Raises:
        ReproductionError: the recording does not say enough, or the mission cannot be made.

    Blocks: until the run has ended, in virtual time.
    """
    events = first_run(recording.events)
    if not events:
        raise ReproductionError(
            recording.path,
            "it does not begin with the begin of a run; expected all of a run, or its first part.",
        )
    if recording.origin is None:
        raise ReproductionError(
            recording.path,
            "it has no inputs; expected what the mission was answered. It was made by an older "
            "version, or with --record-inputs none.",
        )
    world = world or world_of(recording)
    make = make or maker(recording, mission, allow)
    started = RealClock().now()
    then = dict(recording.origin["mission"])
    random.seed(then.get("seed"))
    cancelled: set[str] = set()
    try:
        kit = MissionKit(
            seed=seed,
            begin_ns=recording.stamp_ns,
            namespace=recording.origin["namespace"],
            arguments=parse_arguments(list(then.get("names", ()))),
        )
    except ActionlibError as error:
        raise ReproductionError(recording.path, f"line 1: origin: {first_line(error)}") from error
    kit.draws = False
    with kit, _cancels(cancelled):
        try:
            machine = make()
            notes = _restore_userdata(machine, recording)
        except (SmachError, ActionlibError) as error:
            raise ReproductionError(recording.path, str(error)) from error
        record = describe(machine)
        check_machine(recording, events[0]["path"], record)
        player = Player(kit, world, events)
        player.open()
        buffer = machine.event_buffer(limit=LARGEST_BUFFER)
        end = player.begin(machine)
        machine._smachpy.live.journal = Recorded(world, player)
        ends: list[str] = []  # why the run has no outcome
        outcome = None
        random.seed(then.get("seed"))
        try:
            outcome = kit(machine, limit=world.ended - world.began + LONGER_S).outcome
        except (Deadlock, TimeLimitError, AssertionError, SmachError) as error:
            if not isinstance(error, SmachError) or isinstance(error, TimeLimitError):
                ends.append(first_line(error).partition(" Try mission(")[0])
        finally:
            end()
            buffer.close()
            machine._smachpy.live.journal = NO_JOURNAL
        with contextlib.suppress(Exception):
            kit._take_errors()  # noqa: SLF001
        now = buffer.read()
    comparison = compare(
        steps_of(events, recording.record, recorded_cancels(world), tolerate),
        steps_of(first_run(now), record, cancelled, tolerate),
        is_complete=world.is_complete,
        limits=limit_changes(recording.record, record),
        changed=own_states(record) if code_has_changed(recording) else (),
        odds=_odds(recording, player, now, tolerate),
    )
    is_same = comparison.difference is None
    unknown = unknown_tolerated(tolerate, (recording.record, record), (*events, *now))
    return Reproduction(
        name=recording.record.label,
        comparison=comparison,
        duration=world.ended - world.began,
        seconds=RealClock().now() - started,
        outcome=outcome,
        notes=(
            *unknown,
            *world.lacks,
            *notes,
            *(() if is_same else ends),
            *dict.fromkeys(player.problems),
        ),
        changed=() if is_same else tuple(changes(recording, record, code_facts())),
        events=now,
        record=record,
    )


def _odds(
    recording: Recording, player: Player, now: list[dict[str, Any]], tolerate: Collection[str]
) -> list[Odd]:
    """Return what differs besides the events."""
    began = next((event["t"] for event in now if "t" in event), 0.0)
    odds = list(odd_verdicts(recording.inputs, player.said, began))
    if "goals" not in tolerate:
        odds += [replace(one, at=one.at - began) for one in player.odd_requests]
    return [one for one in odds if not is_tolerated({"path": one.path}, tolerate)]


def first_line(error: BaseException) -> str:
    """Return the first line of an error; further ones are for whoever looks closer."""
    return str(error).partition("\n")[0].rstrip(":")


class Recorded(RunJournal):
    """The journal of a reproduced run: calls of `smachpy.once` return what they returned then."""

    def __init__(self, world: World, player: Player) -> None:
        self._left = {place: list(values) for place, values in world.once.items()}
        self._player = player

    def once(self, frame: Frame, key: str, call: Callable[[], Any]) -> Any:
        """Return the recorded result, or that of `call` if there is none."""
        left = self._left.get((frame.path, key))
        if not left:
            return call()
        value = left.pop(0)
        problem = "it has a secret, which is not recorded; it was called again"
        if MASK not in json.dumps(value):
            try:
                return decoded(value, key)
            except ValueError as error:
                problem = str(error)
        self._player.problems.append(f"{frame.path}: once {key!r}: {problem}")
        return call()


@contextlib.contextmanager
def _cancels(found: set[str]) -> Iterator[None]:
    """Collect the ids of goals that are cancelled inside the block."""

    def note(crossing: Crossing) -> None:
        if crossing.what == "cancel":
            found.add(crossing.key)

    leave = border.listen(note)
    try:
        yield
    finally:
        leave()


def recorded_cancels(world: World) -> set[str]:
    """Return the ids of the goals that the recorded run cancelled."""
    goals = (goal for action in world.actions.values() for goal in action.goals)
    return {goal.id for goal in goals if goal.cancelled is not None}


def maker(
    recording: Recording, mission: str = "", allow: Iterable[str | Path] = ()
) -> Callable[[], Container]:
    """Return a function that makes the machine of a recording.

    A recording is data of others: it chooses among the installed missions and those of `allow`.

    Raises:
        ReproductionError: the recording names no mission, or one that is not allowed, or was begun
            with secrets.
    """
    assert recording.origin is not None
    then = recording.origin["mission"]
    recorded = str(then.get("target") or "")
    if not (mission or recorded):
        raise ReproductionError(
            recording.path,
            "it does not name its mission, as a program has made it; expected one. Try --mission "
            "MODULE:FUNCTION",
        )
    problem = "" if mission else Allowed(allow).problem(recorded, "recording")
    if problem:
        raise ReproductionError(recording.path, f"{recorded}: {problem}")
    words, inputs = tuple(then.get("words", ())), dict(then.get("inputs", {}))
    if any(MASK in text for text in (*words, *inputs.values())):
        raise ReproductionError(
            recording.path,
            "it was begun with a secret, which is not recorded. Try --mission with a function that "
            "needs none.",
        )

    packages = [str(one) for one in allow]  # of which a mission file may name code

    def make() -> Container:
        if mission and whole_target(mission) != recorded:
            return load_target(mission, allow=packages).build()
        folder = str(then.get("folder") or "")
        # For a module that is named from there. Whoever made the recording has chosen the folder.
        if folder and folder not in sys.path and not Allowed(allow).problem(f"{folder}/"):
            sys.path.append(folder)
        target = load_target(mission or recorded, allow=packages)
        if not mission:
            check_is_mission(target, "recording")
        return build(target, {key: Text(value) for key, value in inputs.items()}, words)

    return make


def check_machine(recording: Recording, root: str, record: StateRecord) -> None:
    """Check that a recording, whose run is that of `root`, is one of this machine.

    Raises:
        ReproductionError: it is of another one.
    """
    recorded = {recording.record.path, root}
    if recorded != {record.path}:
        names = " and ".join(repr(path.strip("/")) for path in sorted(recorded))
        raise ReproductionError(
            recording.path,
            f"it is of the machine {names}; expected one of {record.label!r}, which the mission "
            "is. Try --mission with the recorded one.",
        )


def _restore_userdata(machine: Container, recording: Recording) -> list[str]:
    """Give the machine the values that keys had at the begin and have no longer.

    Returns what could not be restored, in words.
    """
    assert recording.origin is not None
    notes = []
    for key, value in recording.origin["userdata"].items():
        if MASK in json.dumps(value):
            if key not in machine.userdata:
                notes.append(f"userdata key {key!r} had a secret, which is not recorded")
        elif key not in machine.userdata or not recording.origin["mission"]:
            try:
                machine.userdata[key] = decoded(value, key)
            except ValueError as error:
                if key not in machine.userdata:
                    raise MissionError(f"userdata key {key!r}: {error_text(error)}") from error
    return notes
