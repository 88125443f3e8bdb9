"""Modes, and kills at every write: one mission at a time, one clean-up each, no stop is lost."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, current_clock, use_clock
from smachpy import State, StateMachine
from smachpy.modes import Modes, Waiting
from tests.smachpy.durable.killing_store import Kill, KillingStore

pytestmark = [
    pytest.mark.slow,
    # A timer's thread writes to the journal, and is killed there, as all others.
    pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning"),
]


class World:
    """What outlives the processes.

    Attributes:
        deeds: What states have done, each with its time and the process.
    """

    def __init__(self) -> None:
        self.deeds: list[tuple[str, str, float, int]] = []
        self.life = 0
        self.store = KillingStore()
        self.begun_s = 0.0
        self.stopped_s: float | None = None
        self.released_s: float | None = None
        self.heard: set[float] = set()

    def now(self) -> float:
        return self.begun_s + current_clock().now()

    def note(self, what: str, name: str) -> None:
        self.deeds.append((what, name, self.now(), self.life))


def lives_on(state: State, world: World, seconds: float) -> bool:
    """Sleep as the state does, unless the process is killed meanwhile."""
    while seconds > 0.0:
        if state.sleep(min(0.25, seconds)):
            return True
        seconds -= 0.25
        if world.store.dead:
            raise Kill
    return False


class Idle(Waiting):
    world: World

    def execute(self, userdata: Any) -> str:
        lives_on(self, self.world, 1e6)
        return "preempted"


class Work(State):
    def __init__(self, world: World, name: str, seconds: float = 10.0) -> None:
        super().__init__(["done", "preempted"])
        self.world, self.name, self.seconds = world, name, seconds

    def execute(self, userdata: Any) -> str:
        self.world.note("begins", self.name)
        outcome = "preempted" if lives_on(self, self.world, self.seconds) else "done"
        self.world.note(outcome, self.name)
        return outcome


def mission(world: World, name: str) -> StateMachine:
    sm = StateMachine(["done", "preempted"])
    sm.add("A", Work(world, f"{name}/A"), {"done": "B"})
    sm.add("B", Work(world, f"{name}/B"))
    sm.add_cleanup("DOCK", Work(world, f"{name}/DOCK", 2.0))
    return sm


def robot(world: World) -> Modes:
    return Modes(
        [
            "idle",
            {"name": "auto", "mission": mission(world, "auto"), "resume": True},
            {"name": "charging", "mission": mission(world, "charging")},
            "estop",
        ],
        [
            ["start", "idle", "auto"],
            ["low", "auto", "charging"],
            ["full", "charging", "idle"],
            ["done", "charging", "idle"],
            ["reset", "estop", "idle"],
        ],
        emergency="estop",
        name="ROBOT",
    )


# What happens, and when [s]: an event, a stop, or its release.
STORIES = {
    "an event": [(1.0, "start"), (5.0, "low"), (60.0, "end")],
    "an event in a clean-up": [(1.0, "start"), (22.0, "low"), (60.0, "end")],
    "an event in the clean-up of a mission that has ended": [
        *((1.0, "start"), (22.0, "low"), (30.0, "full"), (50.0, "start"), (60.0, "end")),
    ],
    "two events": [(1.0, "start"), (5.0, "low"), (6.0, "full"), (60.0, "end")],
    "a stop": [(1.0, "start"), (5.0, "stop"), (20.0, "reset"), (60.0, "end")],
    "a stop of a clean-up": [
        (1.0, "start"),
        (5.0, "low"),
        (6.0, "stop"),
        (20.0, "reset"),
        (60.0, "end"),
    ],
    "a stop that is released": [(1.0, "start"), (5.0, "stop"), (20.0, "go on"), (60.0, "end")],
    "a stop that is released to another mode": [
        *((1.0, "start"), (5.0, "stop"), (20.0, "release"), (60.0, "end")),
    ],
    "two stops": [(1.0, "start"), (5.0, "stop"), (9.0, "stop"), (20.0, "reset"), (60.0, "end")],
}


def live(world: World, store: KillingStore, acts: list[tuple[float, str]]) -> str | None:
    """Run, or go on, in a process of its own; None: it was killed."""
    modes, world.store = robot(world), store
    for mode in modes.get_children().values():
        if isinstance(mode, Waiting):
            mode.__class__, mode.world = Idle, world

    def act(at: float, what: str) -> None:
        try:
            if what == "stop":
                world.stopped_s = world.now()
                modes.emergency_stop("button")
            elif what == "end":
                modes.request_preempt()
            elif what in {"go on", "release"}:
                target = "charging" if what == "release" else None
                world.released_s = world.now() if modes.release(target) else world.released_s
            elif modes.trigger(what) and what == "reset":
                world.released_s = world.now()
            world.heard.add(at)
        except Kill:
            modes.control._end_pause()  # a killed process waits for nobody

    with VirtualClock() as clock, use_clock(clock):
        for at, what in acts:
            if at not in world.heard:  # who gets no answer asks again
                clock.call_later(max(0.5, at - world.begun_s), partial(act, at, what))
        try:
            return smachpy.run_durable(modes, store, mission="m")
        except Kill:
            return None
        finally:
            world.begun_s += clock.now()
            world.life += 1


def check(world: World, place: Any, again: int = 0) -> None:
    """No two missions at once, each clean-up once, and nothing begins while the robot is stopped."""
    active: str | None = None
    cleaned: dict[str, int] = {}
    for what, name, at, _ in world.deeds:
        here = name.partition("/")[0]
        if what == "begins":
            assert active is None or active == here, (place, world.deeds)
            active = here
            if name.endswith("/A"):
                assert cleaned.pop(here, 0) <= 1 + again, (place, world.deeds)
            if world.stopped_s is not None:
                held = world.stopped_s < at < (world.released_s or 1e9)
                assert not held, (place, at, world.deeds)
        elif name.endswith("/DOCK") and what == "done":
            cleaned[here] = cleaned.get(here, 0) + 1
            active = None
    # What was killed before its end was written is done again: nobody knows that it had ended.
    assert max(cleaned.values(), default=0) <= 1 + again, (place, world.deeds)


def docks(world: World) -> list[str]:
    """The clean-ups that have ended, each once: those of the modes that the robot has been in."""
    done = (name for what, name, *_ in world.deeds if what == "done" and name.endswith("DOCK"))
    return list(dict.fromkeys(done))


def begun(world: World) -> list[str]:
    """The states in their order; one that is executed again after a kill counts once."""
    names = [name for what, name, *_ in world.deeds if what == "begins"]
    return [name for name, before in zip(names, ["", *names], strict=False) if name != before]


@pytest.mark.parametrize("story", STORIES)
def test_kills_at_each_step_of_a_change_of_modes(story):
    acts = STORIES[story]
    calm, store = World(), KillingStore()
    assert live(calm, store, acts) == "preempted"
    check(calm, "never")
    expected = docks(calm)
    for kill_at in range(1, store.writes):
        for written in (False, True):
            world, killed = World(), KillingStore()
            killed.arm(kill_at, written=written)
            place = (kill_at, written)
            if live(world, killed, acts) is None and killed.rows["m"].status != "ended":
                killed.arm(0, written=False)
                assert live(world, killed, acts) == "preempted", place
            check(world, place, again=not written)
            assert docks(world) == expected, (place, world.deeds)
            # What is done again takes its time, and the next event finds another state.
            assert not written or begun(world) == begun(calm), (place, world.deeds)
