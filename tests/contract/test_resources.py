"""One holder of a resource at a time; who waits is told by whom, can be stopped, and gets it."""

from __future__ import annotations

import contextlib
from functools import partial
from random import Random
from typing import Any

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, current_clock, use_clock
from actionlib_core.resources import Resources
from smachpy import Concurrence, InvalidStateError, Resource, State, StateMachine
from smachpy.durable.store import Lease
from smachpy.durable.store import ResourceUse as ResourceRow
from smachpy.events import Event, PreemptRequested, ResourceUse
from smachpy.states import Wait
from smachpy.testing import explore, mission_kit
from tests.smachpy.durable.killing_store import Kill, KillingStore

ENDS = ["done", "refused", "aborted", "preempted"]


class Step(State):
    """Takes some seconds, and says when it begins to work."""

    def __init__(self, seconds: float, **options: Any) -> None:
        super().__init__(["done", "preempted"], **options)
        self.seconds = seconds

    def execute(self, userdata: Any) -> str:
        del userdata
        self.note("works")
        return "preempted" if self.sleep(self.seconds) else "done"


def together(**branches: State) -> Concurrence:
    both = Concurrence(ENDS, "done", name="C", outcome_cb=outcomes_of)
    for label, branch in branches.items():
        both.add(label, branch)
    return both


found: dict[str, str] = {}


def outcomes_of(outcomes: dict[str, str]) -> str:
    found.clear()
    found.update(outcomes)
    return "done"


def inside(state: State, **options: Any) -> StateMachine:
    sm = StateMachine(["done", "preempted"], **options)
    sm.add("IN", state)
    return sm


def uses(events: list[Event]) -> list[tuple[str, ...]]:
    return [(e.path, e.status, e.resource, e.holder) for e in events if type(e) is ResourceUse]


def test_one_waits_until_the_other_has_ended():
    heard: list[Event] = []
    with mission_kit() as mission:
        machine = together(A=Step(2.0, resource="base"), B=Step(3.0, resource="base"))
        machine.subscribe(heard.append)
        run = mission(machine)
    assert (run.outcome, run.duration) == ("done", 5.0)
    first, second = ("/C/A", "/C/B") if uses(heard)[0][0] == "/C/A" else ("/C/B", "/C/A")
    assert held_at_once(heard) == 1
    assert sorted(uses(heard)) == sorted(
        [
            (first, "holds", "base", ""),
            (second, "waits", "base", first),
            (first, "free", "base", ""),
            (second, "holds", "base", ""),
            (second, "free", "base", ""),
        ]
    )


def test_others_do_not_wait():
    with mission_kit() as mission:
        run = mission(
            together(A=Step(2.0, resource="base"), B=Step(3.0, resource="arm"), D=Step(1))
        )
    assert run.duration == 3.0


def test_it_is_refused_while_another_one_has_it():
    late = StateMachine(["done", "refused", "preempted"])
    late.add("WAIT", Wait(1.0), {"done": "USE"})
    late.add("USE", Step(3.0, resource=("base", "refuse")))
    with mission_kit() as mission:
        run = mission(together(A=Step(2.0, resource="base"), B=late))
    assert (found, run.duration) == ({"A": "done", "B": "refused"}, 2.0)


def test_one_that_was_refused_may_try_again():
    again = Step(3.0, resource=("base", "refuse"), retry=(5, 1.0, "refused"))
    late = StateMachine(["done", "refused", "preempted"])
    late.add("WAIT", Wait(0.5), {"done": "USE"})
    late.add("USE", again)
    with mission_kit() as mission:
        run = mission(together(A=Step(2.0, resource="base"), B=late))
    assert (found, run.duration) == ({"A": "done", "B": "done"}, 6.5)  # tried at 0.5, 1.5 and 3.5


def test_one_that_preempts_stops_the_holder_and_its_machine_follows_that():
    heard: list[Event] = []
    late = StateMachine(["done", "preempted"])
    late.add("WAIT", Wait(1.0), {"done": "USE"})
    late.add("USE", Step(3.0, resource=("base", "preempt")))
    early = StateMachine(["done", "preempted"])
    early.add("USE", Step(9.0, resource="base"), {"preempted": "ELSE"})
    early.add("ELSE", Step(1.0))
    with mission_kit() as mission:
        machine = together(A=early, B=late)
        machine.subscribe(heard.append)
        run = mission(machine)
    assert (found, run.duration) == ({"A": "done", "B": "done"}, 4.0)
    (asked,) = [e for e in heard if isinstance(e, PreemptRequested)]
    assert (asked.path, asked.asker) == ("/C/A/USE", "state /C/B/USE: takes base")


def test_a_container_that_holds_it_is_stopped_with_all_in_it():
    late = StateMachine(["done", "preempted"])
    late.add("WAIT", Wait(1.0), {"done": "USE"})
    late.add("USE", Step(3.0, resource=("base", "preempt")))
    with mission_kit() as mission:
        run = mission(together(A=inside(inside(Step(9.0)), resource="base"), B=late))
    assert (found, run.duration) == ({"A": "preempted", "B": "done"}, 4.0)


def test_states_inside_of_the_holder_have_it_too():
    nested = inside(
        inside(Step(2.0, resource="base"), resource="base"), resource=("base", "refuse")
    )
    with mission_kit() as mission:
        run = mission(together(A=nested))
    assert (found, run.duration) == ({"A": "done"}, 2.0)


def test_branches_inside_of_the_holder_take_turns():
    branches = Concurrence(["done", "preempted"], "done", resource="base")
    branches.add("L", Step(2.0, resource="base"))
    branches.add("R", Step(3.0, resource="base"))
    with mission_kit() as mission:
        run = mission(together(A=branches, B=Step(1.0, resource="base")))
    assert run.duration == 6.0


@pytest.mark.parametrize("make", [Step, lambda *a, **o: inside(Step(*a), **o)])
def test_one_that_waits_can_be_stopped(make: Any):
    with mission_kit() as mission:
        machine = together(A=Step(9.0, resource="base"), B=make(9.0, resource="base"))
        mission.preempt(at=2.0)
        run = mission(machine)
    assert (found, run.duration) == ({"A": "preempted", "B": "preempted"}, 2.0)


def test_the_timeout_of_a_state_covers_its_wait():
    quick = Step(0.5, resource="base", timeout=1.0)
    late = StateMachine(["done", "aborted", "preempted"])
    late.add("WAIT", Wait(0.5), {"done": "USE"})
    late.add("USE", quick)
    with mission_kit() as mission:
        run = mission(together(A=Step(5.0, resource="base"), B=late))
    assert (found, run.duration) == ({"A": "done", "B": "aborted"}, 5.0)


def test_it_is_free_after_an_exception():
    class Raises(State):
        def __init__(self) -> None:
            super().__init__(["done"], resource="base", on_exception={OSError: "done"})

        def execute(self, userdata: Any) -> str:
            self.sleep(1.0)
            raise OSError("no floor")

    with mission_kit() as mission:
        run = mission(together(A=Raises(), B=Step(2.0, resource="base")))
    assert run.duration == 3.0


@pytest.mark.parametrize("where", ["root", "state"])
def test_missions_of_one_process_share_it(where: str):
    heard: list[Event] = []
    clock = VirtualClock()

    def mission() -> StateMachine:
        root, state = ("base", None) if where == "root" else (None, "base")
        sm = StateMachine(["done", "preempted"], name=f"M{len(missions)}", resource=root)
        sm.add("USE", Step(2.0, resource=state))
        sm.subscribe(heard.append)
        return sm

    missions: list[StateMachine] = []
    with use_clock(clock):
        began = clock.now()
        for _ in range(3):
            missions.append(mission())
        tasks = [clock.spawn(each.execute, name=each.name) for each in missions]
        for task in tasks:
            task.join()
    assert clock.now() == pytest.approx(began + 6.0, abs=1e-6)
    assert held_at_once(heard) == 1


def test_two_clocks_share_nothing():
    for _ in range(2):
        with mission_kit() as mission:
            assert mission(inside(Step(2.0, resource="base"), name="M")).duration == 2.0


def test_a_wait_in_a_circle_is_refused_and_says_who_waits_for_whom():
    one = inside(_then(Step(2.0, resource="arm")), resource="base")
    other = inside(_then(Step(2.0, resource="base")), resource="arm")
    with mission_kit() as mission, pytest.raises(smachpy.InvalidUserCodeError) as caught:
        mission(together(A=one, B=other))
    problem: BaseException = caught.value
    while problem.__cause__ is not None:
        problem = problem.__cause__
    text = str(getattr(problem, "exceptions", [problem])[0])
    assert "circle" in text
    assert "base" in text
    assert "arm" in text


def test_a_circle_through_the_machine_around_a_holder_is_found():
    """The holder itself waits for nothing; another branch of the machine around it does."""
    one = Concurrence(ENDS, "done", resource="base")
    one.add("USES", Step(2.0, resource="base"))
    one.add("WAITS", _then(Step(1.0, resource="arm")))
    late = StateMachine(ENDS, resource="arm")
    late.add("FIRST", Wait(1.5), {"done": "NEXT"})
    late.add("NEXT", Step(1.0, resource="base"))
    with mission_kit() as mission, pytest.raises(smachpy.InvalidUserCodeError, match="circle"):
        mission(together(A=one, B=late))


def test_what_the_holder_does_after_it_was_asked_to_stop_may_close_a_circle():
    """The one that had asked it and the holder waited for each other for ever."""
    other = StateMachine(ENDS, resource="arm")
    other.add("REACH", Step(60.0), {"preempted": "BRAKE"})
    other.add("BRAKE", Step(1.0, resource="base"))
    taking = inside(_then(Step(2.0, resource=("arm", "preempt"))), resource="base")
    with mission_kit() as mission, pytest.raises(smachpy.InvalidUserCodeError, match="circle"):
        mission(together(A=taking, B=other))


def test_a_wait_of_the_holder_that_is_asked_to_stop_is_no_circle():
    other = StateMachine(ENDS, resource="arm")
    other.add("WAIT", Wait(0.5), {"done": "MORE"})
    other.add("MORE", Step(1.0, resource="base"))
    taking = inside(_then(Step(2.0, resource=("arm", "preempt"))), resource="base")
    with mission_kit() as mission:
        run = mission(together(A=taking, B=other))
    assert (found, run.duration) == ({"A": "done", "B": "preempted"}, 3.0)


def test_one_that_preempts_stops_the_outermost_holder():
    late = StateMachine(["done", "preempted"])
    late.add("WAIT", Wait(1.0), {"done": "USE"})
    late.add("USE", Step(3.0, resource=("base", "preempt")))
    holder = StateMachine(ENDS, resource="base")
    holder.add("USE", Step(9.0, resource="base"), {"preempted": "MORE"})
    holder.add("MORE", Step(50.0))
    with mission_kit() as mission:
        run = mission(together(A=holder, B=late))
    assert (found["B"], run.duration < 60.0) == ("done", True)


def test_one_that_is_stopped_as_it_becomes_free_never_had_it():
    heard: list[Event] = []
    with mission_kit() as mission:
        machine = together(A=Step(2.0, resource="base"), B=Step(2.0, resource="base"))
        machine.subscribe(heard.append)
        mission.preempt(at=2.0)
        mission(machine)
    told = [use[:2] for use in uses(heard)]
    assert all((path, "holds") in told for path, status in told if status == "free")


def after(seconds: float, state: State) -> StateMachine:
    sm = StateMachine(ENDS)
    sm.add("WAIT", Wait(seconds), {"done": "USE"})
    sm.add("USE", state)
    return sm


@pytest.mark.parametrize(("policy", "order"), [("wait", "ABD"), ("preempt", "ADB")])
def test_it_is_given_in_the_order_of_the_claims_but_first_to_one_that_preempts(policy, order):
    heard: list[Event] = []
    with mission_kit() as mission:
        machine = together(
            A=Step(9.0, resource="base"),
            B=after(1.0, Step(1.0, resource="base")),
            D=after(2.0, Step(1.0, resource=("base", policy))),
        )
        machine.subscribe(heard.append)
        mission(machine)
    held = [path for path, status, *_ in uses(heard) if status == "holds"]
    assert [path[3] for path in held] == list(order)


@pytest.mark.parametrize("stops", [False, True])
def test_what_gets_it_while_the_machine_is_paused_does_not_begin(stops):
    heard: list[Event] = []
    with mission_kit() as mission:
        machine = together(A=Step(5.0, resource="base"), B=after(1.0, Step(2.0, resource="base")))
        machine.subscribe(heard.append)
        mission.clock.call_later(2.0, machine.control.pause)
        mission.clock.call_later(20.0, machine.request_preempt if stops else machine.control.resume)
        run = mission(machine)
    assert run.duration == (20.0 if stops else 22.0)
    held = [path for path, status, *_ in uses(heard) if status == "holds"]
    assert held == ["/C/A", *([] if stops else ["/C/B/USE"])]


def test_a_request_that_comes_after_the_holder_has_ended_stops_nothing(monkeypatch: Any):
    real = Resources.claim

    def slow(self: Resources, claim: Any) -> Any:
        holder = real(self, claim)
        if claim.policy == "preempt":
            current_clock().sleep(3.0)
        return holder

    monkeypatch.setattr(Resources, "claim", slow)
    early = StateMachine(ENDS)
    early.add("USE", Step(2.0, resource="base"), {"done": "ELSE"})
    early.add("ELSE", Step(9.0))
    with mission_kit() as mission:
        run = mission(together(A=early, B=after(1.0, Step(1.0, resource=("base", "preempt")))))
    assert (found, run.duration) == ({"A": "done", "B": "done"}, 11.0)


def _then(state: State) -> StateMachine:
    sm = StateMachine(["done", "preempted"])
    sm.add("FIRST", Wait(1.0), {"done": "NEXT"})
    sm.add("NEXT", state)
    return sm


class Deaf(State):
    """Ignores its preempt, and every interruption, for 20 s."""

    def __init__(self) -> None:
        super().__init__(["done", "preempted"], resource="base", preempt_timeout=0.0)

    def execute(self, userdata: Any) -> str:
        del userdata
        end = self.clock().now() + 20.0
        while self.clock().now() < end:
            with contextlib.suppress(BaseException):
                self.clock().sleep(0.5)
        return "done"


@pytest.mark.parametrize("policy", ["wait", "preempt"])
def test_a_thread_that_is_left_behind_keeps_it_and_says_so(caplog: Any, policy: str):
    heard: list[Event] = []
    clock = VirtualClock()
    with use_clock(clock):
        deaf = together(A=Deaf())
        clock.call_later(1.0, deaf.request_preempt)
        clock.spawn(deaf.execute, name="deaf").join()
        left = clock.now()
        user = inside(Step(2.0, resource=("base", policy)), name="M")
        user.subscribe(heard.append)
        clock.spawn(user.execute, name="user").join()
    assert left < 5.0
    assert clock.now() == pytest.approx(22.0, abs=1.0)
    assert uses(heard)[0][3] == "/C/A (its thread was left behind)"
    assert "its thread is left behind, and still holds base" in caplog.text


@pytest.mark.parametrize(
    "given", [7, "", "a b", ("base", "steal"), ("base", "wait", 1), [], {"name": "base"}]
)
def test_wrong_resources_are_refused(given: Any):
    with pytest.raises(InvalidStateError, match="resource"):
        Step(1.0, resource=given)


def test_it_is_in_the_description():
    _, details = Step(1.0, resource=("base", "preempt")).describe_details()
    assert ("resource", "base, preempt") in details
    assert Step(1.0, resource=("base", "refuse"))._smachpy.options.made_outcomes() == ("refused",)
    assert Resource("base") == Resource("base", "wait")


def test_exploration_follows_it_and_finds_two_at_once_never():
    def mission() -> Concurrence:
        both = Concurrence(["done", "preempted"], "done", name="C")
        both.add("A", Step(2.0, resource="base"))
        both.add("B", Step(3.0, resource="base"))
        return both

    explored = explore(mission)
    assert explored.ok
    assert explored.exhaustive


def held_at_once(events: list[Event]) -> int:
    most = now = 0
    for event in events:
        if isinstance(event, ResourceUse) and event.status != "waits":
            now += 1 if event.status == "holds" else -1
            most = max(most, now)
    return most


def any_state(random: Random, depth: int) -> State:
    """A state or machine with some resource, policy, timeout and retry."""
    options: dict[str, Any] = {}
    if random.random() < 0.6:
        policy = random.choice(["wait", "wait", "preempt", "refuse"])
        options["resource"] = random.choice(["base", "arm"]), policy
        options["retry"] = (2, 0.5, ["refused"]) if policy == "refuse" else None
    if random.random() < 0.2:
        options["timeout"] = random.choice([0.5, 1.0, 2.0])
    if depth == 0 or random.random() < 0.3:
        return Step(random.choice([0.0, 0.5, 1.0, 2.0]), **options)
    if random.random() < 0.5:
        both = Concurrence(ENDS, "done", **options)
        both.add("L", any_state(random, depth - 1))
        both.add("R", any_state(random, depth - 1))
        return both
    machine = StateMachine(ENDS, **options)
    machine.add("FIRST", any_state(random, depth - 1), {"done": "NEXT"})
    machine.add("NEXT", any_state(random, depth - 1))
    return machine


@pytest.mark.parametrize("seed", range(40))
def test_random_missions_end_and_leave_all_resources_free(seed: int):
    random, clock, heard = Random(seed), VirtualClock(seed=seed), list[Event]()

    errors: list[str] = []

    def run(root: Concurrence) -> None:
        try:
            root.execute()
        except smachpy.SmachError as error:
            errors.append(_all_of(error))

    with use_clock(clock):
        roots = [together(A=any_state(random, 2), B=any_state(random, 2)) for _ in range(2)]
        for root in roots:
            root.subscribe(heard.append)
        clock.call_later(random.random() * 4.0, roots[0].request_preempt)
        tasks = [clock.spawn(partial(run, root), name="root") for root in roots]
        assert all(task.join(500.0) for task in tasks)
        began, last = clock.now(), inside(Step(1.0, resource="arm"), resource="base")
        assert clock.spawn(last.execute, name="last").join(500.0)
        assert clock.now() == pytest.approx(began + 1.0)  # both were free
    assert all("circle" in error for error in errors)
    told = [use[1] for use in uses(heard)]
    assert told.count("holds") == told.count("free")


def _all_of(error: BaseException | None) -> str:
    if error is None:
        return ""
    inner = "".join(map(_all_of, getattr(error, "exceptions", ())))
    return f"{error}{inner}{_all_of(error.__cause__)}"


class Sharing(KillingStore):
    """Keeps who holds resources, too."""

    def __init__(self) -> None:
        super().__init__()
        self.held: dict[str, ResourceRow] = {}

    def resources(self) -> list[Any]:
        return list(self.held.values())

    def hold(self, lease: Lease, resource: str, state: str, policy: str) -> None:
        del policy  # there is no other mission
        self.check()
        self.held[resource] = ResourceRow(resource, lease.mission, state, True, False, None)

    def let_go(self, lease: Lease, resource: str) -> None:
        del lease
        self.check()
        self.held.pop(resource, None)

    def check(self) -> None:
        if self.dead:
            raise Kill


class Killed(Step):
    """Works, and kills the process the first time."""

    def __init__(self, store: Sharing, **options: Any) -> None:
        super().__init__(10.0, **options)
        self.store = store

    def execute(self, userdata: Any) -> str:
        if self.store.kill_at:
            self.sleep(5.0)
            self.store.dead = True
            raise Kill
        return super().execute(userdata)


@pytest.mark.parametrize("again", [True, False])
@pytest.mark.parametrize("order", [1, -1])
def test_the_former_holder_takes_it_first_after_a_kill(again: bool, order: int) -> None:
    """Unless it is not executed again."""

    def live() -> list[str]:
        late = StateMachine(ENDS)
        late.add("PAUSE", Step(1.0), {"done": "WAITS"})
        late.add("WAITS", Step(2.0, resource="base"))
        options = {} if again else {"resume": "skip:done"}
        branches = [("LATE", late), ("HOLDS", Killed(store, resource="base", **options))]
        machine, heard = together(**dict(branches[::order])), list[Event]()
        machine.subscribe(heard.append)
        with VirtualClock() as clock, use_clock(clock), contextlib.suppress(Kill):
            assert smachpy.run_durable(machine, store, mission="m") == "done"
        return [path for path, status, *_ in uses(heard) if status == "holds"]

    store = Sharing()
    store.arm(10_000, written=True)
    assert live() == ["/C/HOLDS"]
    assert store.held["base"].state == "/C/HOLDS"
    store.arm(0, written=False)
    assert live() == [*(["/C/HOLDS"] if again else []), "/C/LATE/WAITS"]
    assert not store.held
