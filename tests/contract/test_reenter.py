"""A machine that goes on where it was interrupted: shallow, deep, and after a kill."""

from __future__ import annotations

import contextlib
import copy
import threading
from typing import Any

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, current_clock, use_clock
from smachpy import InvalidStateError, Sequence, State, StateMachine
from smachpy.modes import Modes
from smachpy.testing import mission_kit
from tests.smachpy.durable.killing_store import Kill, KillingStore

ENDS = ["done", "aborted", "preempted"]


class Work(State):
    """Works for some time; counts how often it has finished."""

    def __init__(self, seconds: float = 10.0, **options: Any) -> None:
        super().__init__(["done", "preempted"], io_keys=["count"], **options)
        self.seconds = seconds

    def execute(self, userdata: Any) -> str:
        if self.sleep(self.seconds):
            return "preempted"
        userdata.count += 1
        return "done"


class Finishes(Work):
    """Finishes its work whoever asks it to stop."""

    def execute(self, userdata: Any) -> str:
        self.clock().sleep(self.seconds)
        userdata.count += 1
        return "done"


def inner_of(reenter: Any = "first", *states: State, **options: Any) -> StateMachine:
    inner = StateMachine(ENDS, userdata={"count": 0}, reenter=reenter, **options)
    one, two, three = states or (Work(), Work(), Work())
    inner.add("ONE", one, {"done": "TWO"})
    inner.add("TWO", two, {"done": "THREE"})
    inner.add("THREE", three)
    return inner


def root_of(inner: State) -> StateMachine:
    """Goes on with the inner machine 5 s after its timeout has interrupted it."""
    root = StateMachine(ENDS, name="R", userdata={"count": 0})
    root.add("IN", inner, {"aborted": "WAIT"})
    root.add("WAIT", Work(5.0), {"done": "IN"})
    return root


def labels(run: Any) -> list[str]:
    return [path.removeprefix("/R/") for path in run.path]


def test_it_goes_on_in_the_state_that_was_interrupted_with_its_userdata():
    inner = inner_of("last", timeout=15.0)
    with mission_kit() as mission:
        run = mission(root_of(inner))
    first, second, third = ["IN/ONE", "IN/TWO"], ["IN/TWO", "IN/THREE"], ["IN/THREE"]
    assert labels(run) == [*first, "WAIT", *second, "WAIT", *third]
    assert inner.userdata["count"] == 3


def test_by_default_it_begins_anew():
    root = StateMachine(ENDS, name="R", userdata={"count": 0})
    root.add("IN", inner_of())
    with mission_kit() as mission:
        mission.preempt(at=15.0)
        mission(root)
        assert labels(mission(root)) == ["IN/ONE", "IN/TWO", "IN/THREE"]


@pytest.mark.parametrize(
    ("reenter", "second"),
    [
        ("first", ["BEFORE", "IN/ONE", "IN/TWO", "IN/THREE"]),
        ("last", ["IN/ONE", "IN/TWO", "IN/THREE"]),
        ("deep", ["IN/TWO", "IN/THREE"]),
    ],
)
def test_deep_goes_on_in_the_machines_inside_too(reenter, second):
    root = StateMachine(ENDS, name="R", userdata={"count": 0}, reenter=reenter)
    root.add("BEFORE", Work(1.0), {"done": "IN"})
    root.add("IN", inner_of())
    with mission_kit() as mission:
        mission.preempt(at=15.0)
        mission(root)
    with mission_kit() as mission:
        assert labels(mission(root)) == second
    with mission_kit() as mission:  # the second run has ended by itself
        assert labels(mission(root)) == ["BEFORE", "IN/ONE", "IN/TWO", "IN/THREE"]


def test_work_that_was_finished_is_not_done_again():
    root = StateMachine(ENDS, name="R", userdata={"count": 0}, reenter="last")
    root.add("ONE", Finishes(10.0), {"done": "TWO"})
    root.add("TWO", Work())
    with mission_kit() as mission:
        mission.preempt(at=5.0)
        run = mission(root)
    assert (run.outcome, labels(run)) == ("preempted", ["ONE"])
    with mission_kit() as mission:
        assert labels(mission(root)) == ["TWO"]


def test_a_state_that_tidies_up_is_not_the_one_that_was_interrupted():
    root = StateMachine(ENDS, name="R", userdata={"count": 0}, reenter="last")
    root.add("ONE", Work(), {"done": "TWO"})
    root.add("TWO", Work(), {"preempted": "TIDY"})
    root.add("TIDY", Work(1.0), {"done": "preempted"})
    with mission_kit() as mission:
        mission.preempt(at=15.0)
        assert labels(mission(root)) == ["ONE", "TWO", "TIDY"]
    with mission_kit() as mission:
        assert labels(mission(root)) == ["TWO"]


def test_a_second_request_while_it_tidies_up_changes_nothing():
    root = StateMachine(ENDS, name="R", userdata={"count": 0}, reenter="last")
    root.add("ONE", Work(), {"done": "TWO"})
    root.add("TWO", Work(), {"preempted": "TIDY"})
    root.add("TIDY", Finishes(5.0), {"done": "MORE"})
    root.add("MORE", Work(1.0), {"done": "preempted"})
    with mission_kit() as mission:
        mission.preempt(at=15.0)
        mission.preempt(on="TIDY", after=1.0)
        assert mission(root).outcome == "preempted"
    with mission_kit() as mission:
        assert labels(mission(root))[0] == "TWO"


def test_a_second_request_before_the_first_state_changes_nothing():
    root = StateMachine(ENDS, name="R", userdata={"count": 0}, reenter="last")
    root.add("ONE", Work(), {"done": "TWO"})
    root.add("TWO", Work())
    with mission_kit() as mission:
        mission.preempt(at=15.0)
        mission(root)
    root.request_preempt()
    assert root.execute() == "preempted"
    with mission_kit() as mission:
        assert labels(mission(root)) == ["TWO"]


def test_one_whose_thread_was_left_behind_goes_on_there():
    released = threading.Event()

    class Deaf(Work):
        def execute(self, userdata: Any) -> str:
            both.request_preempt()
            released.wait()  # no interruption ends it
            return "done"

    inner = inner_of("last", Work(0.0), Deaf(preempt_timeout=0.0), Work(0.0))
    both = smachpy.Concurrence(ENDS, "done", name="R", userdata={"count": 0})
    both.add("IN", inner)
    try:
        both.execute()
        assert inner._smachpy.live.stopped_at == "TWO"
    finally:
        released.set()


def test_an_initial_state_that_was_set_comes_first():
    root = StateMachine(ENDS, name="R", userdata={"count": 0}, reenter="last")
    root.add("ONE", Work(), {"done": "TWO"})
    root.add("TWO", Work())
    with mission_kit() as mission:
        mission.preempt(at=15.0)
        mission(root)
    root.set_initial_state(["ONE"])
    with mission_kit() as mission:
        assert labels(mission(root)) == ["ONE", "TWO"]


def test_a_sequence_has_it_and_a_copy_too():
    sequence = Sequence(ENDS, "done", name="R", userdata={"count": 0}, reenter="last")
    sequence.add("ONE", Work())
    sequence.add("TWO", Work())
    again = copy.deepcopy(sequence)
    with mission_kit() as mission:
        mission.preempt(at=15.0)
        mission(again)
    with mission_kit() as mission:
        assert labels(mission(again)) == ["TWO"]
    assert ("reenter", "last") in smachpy.describe(again).details


def test_another_word_is_refused():
    with pytest.raises(InvalidStateError, match=r"reenter: got 'history'; expected one of"):
        StateMachine(ENDS, reenter="history")


def test_every_request_at_every_moment_goes_on_and_no_work_is_done_twice():
    for twice in range(21, 65, 4):
        inner = inner_of("last", timeout=twice / 2)
        with mission_kit() as mission:
            run = mission(root_of(inner))
        assert run.outcome == "done"
        assert inner.userdata["count"] == 3


def live(root: Any, store: KillingStore) -> str | None:
    """Run, or go on, in a process of its own; None: it was killed."""
    try:
        with VirtualClock() as clock, use_clock(clock):
            return smachpy.run_durable(root, store, mission="m")
    except Kill:
        return None


class Once(Work):
    """The robot's deed, counted outside of the mission, by processes that are not killed yet."""

    def __init__(self, deeds: list[str], name: str, store: KillingStore) -> None:
        super().__init__(10.0)
        self.deeds, self.name, self.store = deeds, name, store

    def execute(self, userdata: Any) -> str:
        outcome = super().execute(userdata)
        if self.store.dead:
            raise Kill
        if outcome == "done":
            self.deeds.append(self.name)
        return outcome


@pytest.mark.parametrize("reenter", ["last", "deep"])
def test_killed_at_any_write_it_goes_on_in_the_same_state(reenter):
    def make(deeds: list[str], store: KillingStore) -> StateMachine:
        """Another branch interrupts the machine after 15 s; both begin again until it is done."""
        works = [Once(deeds, name, store) for name in ("ONE", "TWO", "THREE")]
        inner = inner_of(reenter if reenter == "last" else "first", *works)
        if reenter == "deep":
            deep = StateMachine(ENDS, userdata={"count": 0}, reenter="deep")
            deep.add("DEEP", inner)
            inner = deep
        both = smachpy.Concurrence(
            ["done", "again"],
            "again",
            outcome_map={"done": {"IN": "done"}},
            child_termination_cb=lambda _: True,
        )
        both.userdata.count = 0
        both.add("IN", inner)
        both.add("CLOCK", Work(15.0))
        root = StateMachine(ENDS, name="R")
        root.add("BOTH", both, {"again": "BOTH"})
        return root

    calm, store = list[str](), KillingStore()
    assert live(make(calm, store), store) == "done"
    assert calm == ["ONE", "TWO", "THREE"]
    for kill_at in range(1, store.writes):
        for written in (False, True):
            hit, deeds = KillingStore(), list[str]()
            hit.arm(kill_at, written=written)
            assert live(make(deeds, hit), hit) is None
            hit.arm(0, written=False)
            assert live(make(deeds, hit), hit) == "done", kill_at
            # What was done and not written is done again, as ever.
            assert list(dict.fromkeys(deeds)) == calm, kill_at
            assert not written or deeds == calm, kill_at


class Left(Once):
    """Five seconds after its first begin it is left for something else."""

    def __init__(self, deeds: list[str], store: KillingStore, leave: Any, left: list[str]) -> None:
        super().__init__(deeds, "TWO", store)
        self.leave, self.left = leave, left

    def execute(self, userdata: Any) -> str:
        current_clock().call_later(5.0, self.leave_once)
        return super().execute(userdata)

    def leave_once(self) -> None:
        if not self.left and not self.store.dead:
            self.left.append("left")
            with contextlib.suppress(
                Kill
            ):  # the thread of the timer; that of the run is killed, too
                self.leave()


def check_kills(make: Any, outcome: str, calm: list[str]) -> None:
    """Kill at any write; `make` gets the deeds, the store, and a list, empty until it is left."""
    done, store = list[str](), KillingStore()
    assert live(make(done, store, []), store) == outcome
    assert done == calm
    for kill_at in range(1, store.writes):
        for written in (False, True):
            hit, deeds, left = KillingStore(), list[str](), list[str]()
            hit.arm(kill_at, written=written)
            assert live(make(deeds, hit, left), hit) is None
            hit.arm(0, written=False)
            assert live(make(deeds, hit, left), hit) == outcome, kill_at
            # If it was not written that it is left, nobody has left it.
            expected = calm if "ELSEWHERE" in deeds else ["ONE", "TWO", "THREE"]
            assert list(dict.fromkeys(deeds)) == expected, (kill_at, deeds)
            assert not written or deeds == expected, (kill_at, deeds)


@pytest.mark.parametrize("reenter", ["last", "deep"])
def test_killed_at_any_write_it_goes_on_where_an_operator_has_left_it(reenter):
    def make(deeds: list[str], store: KillingStore, left: list[str]) -> StateMachine:
        two = Left(deeds, store, lambda: root.control.jump("/R/ELSEWHERE"), left)
        works = [Once(deeds, "ONE", store), two, Once(deeds, "THREE", store)]
        inner = inner_of(reenter if reenter == "last" else "first", *works)
        if reenter == "deep":
            deep = StateMachine(ENDS, userdata={"count": 0}, reenter="deep")
            deep.add("DEEP", inner)
            inner = deep
        root = StateMachine(ENDS, name="R", userdata={"count": 0})
        root.add("TOUR", inner)
        root.add("ELSEWHERE", Once(deeds, "ELSEWHERE", store), {"done": "TOUR"})
        return root

    check_kills(make, "done", ["ONE", "ELSEWHERE", "TWO", "THREE"])


class Ends(State):
    """Ends the modes."""

    def __init__(self, modes: list[Modes]) -> None:
        super().__init__(["preempted"])
        self.modes = modes

    def execute(self, userdata: Any) -> str:
        self.modes[0].request_preempt()
        return "preempted"


@pytest.mark.parametrize("cleanup", [False, True])
def test_killed_at_any_write_modes_go_on_where_an_event_has_left_a_mission(cleanup):
    def make(deeds: list[str], store: KillingStore, left: list[str]) -> Modes:
        two = Left(deeds, store, lambda: modes.trigger("leave"), left)
        inner = inner_of("first", Once(deeds, "ONE", store), two, Once(deeds, "THREE", store))
        mission, elsewhere, last = (StateMachine(ENDS, userdata={"count": 0}) for _ in range(3))
        mission.add("INNER", inner)
        if cleanup:
            mission.add_cleanup("DOCK", Work(2.0))
        elsewhere.add("ELSEWHERE", Once(deeds, "ELSEWHERE", store))
        last.add("ENDS", Ends(made))
        modes = Modes(
            [
                {"name": "auto", "mission": mission, "resume": True},
                {"name": "elsewhere", "mission": elsewhere},
                {"name": "end", "mission": last},
            ],
            [
                ["leave", "auto", "elsewhere"],
                ["done", "elsewhere", "auto"],
                ["done", "auto", "end"],
            ],
            name="M",
        )
        made[:] = [modes]
        return modes

    made: list[Modes] = []
    check_kills(make, "preempted", ["ONE", "ELSEWHERE", "TWO", "THREE"])
