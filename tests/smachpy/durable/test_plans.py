"""Plans that survive: marking, actions, events and sub-plans go on where they were."""

from __future__ import annotations

from typing import Any

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.config import Config
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from smachpy import SimpleActionState, State, StateMachine
from smachpy.durable.journal import read_position
from smachpy.durable.mission import MachineChangedError
from smachpy.durable.structure import missing_places, shape_of
from smachpy.pnp import PetriNetPlan
from tests.smachpy.durable.killing_store import Kill, KillingStore
from tests.smachpy.durable.test_goals_that_are_followed import Action, Goal, Result, World
from tests.smachpy.pnp.nets import net_of

PLANS = {
    "sequence": """
        init* -> A.exec : A.start
        A.exec -> mid : A.end
        mid -> B.exec : B.start
        B.exec -> goal : B.end
    """,
    "fork and join": """
        init* -> i j : fork
        i -> A.exec : A.start
        j -> B.exec : B.start
        A.exec -> a : A.end
        B.exec -> b : B.end
        a b -> C.exec : C.start
        C.exec -> goal : C.end
    """,
    "loop": """
        init* -> A.exec : A.start
        A.exec -> more : A.end
        more -> init : [not enough]
        more -> goal : [enough]
    """,
    "interrupt": """
        init* -> i j : fork
        i -> LONG.exec : LONG.start
        j -> A.exec : A.start
        A.exec -> a : A.end
        LONG.exec a -> again : LONG.interrupt
        again -> B.exec : B.start
        B.exec -> goal : B.end
    """,
    "sub-plan": """
        init* -> SUB.exec : SUB.start
        SUB.exec -> mid : SUB.end
        mid -> A.exec : A.start
        A.exec -> goal : A.end
    """,
    "restart": """
        init* -> A.exec : A.start
        A.exec -> more : A.end
        more -> restartcurrentplan.exec : restartcurrentplan.start [not enough]
        restartcurrentplan.exec -> lost : restartcurrentplan.end
        more -> goal : [enough]
    """,
}
SUB = """
    init* -> B.exec : B.start
    B.exec -> mid : B.end
    mid -> C.exec : C.start
    C.exec -> goal : C.end
"""


class Deeds(list[str]):
    """What was done in it, by processes that live as long as their store does."""

    def __init__(self, store: KillingStore) -> None:
        super().__init__()
        self.store = store

    def do(self, deed: str) -> None:
        if self.store.dead:
            raise Kill
        self.append(deed)


class Count(State):
    """Does one thing in the world, once in each visit, and counts."""

    def __init__(self, deeds: Deeds, name: str) -> None:
        super().__init__(["succeeded"], io_keys=[f"count_{name}"])
        self.deeds, self.key = deeds, f"count_{name}"

    def execute(self, userdata: Any) -> str:
        smachpy.once("deed", lambda: self.deeds.do(f"{self.key} {userdata[self.key]}"))
        userdata[self.key] += 1
        return "succeeded"


class Long(State):
    """Lasts until it is asked to stop."""

    def __init__(self) -> None:
        super().__init__(["succeeded", "preempted"])

    def execute(self, userdata: Any) -> str:
        del userdata
        return "preempted" if self.wait_preempt(1000.0) else "succeeded"


def plan_of(text: str, deeds: Deeds, name: str = "PLAN") -> PetriNetPlan:
    net = net_of(text, name)
    names = {place.name.removesuffix(".exec") for place in net.places if ".exec" in place.name}
    known: dict[str, Any] = {n: Count(deeds, n) for n in names & {"A", "B", "C"}}
    if "SUB" in names:
        known["SUB"] = plan_of(SUB, deeds, "SUB")
    known["LONG"] = Long()
    conditions = {"enough": lambda userdata: userdata.count_A >= 3}
    plan = PetriNetPlan(net, known, conditions, name=name)
    for each in "ABC":
        plan.userdata[f"count_{each}"] = 0
    return plan


def root_of(kind: str, deeds: Deeds, *, below: bool) -> Any:
    plan = plan_of(PLANS[kind], deeds)
    if not below:
        return plan
    root = StateMachine(["done"], name="ROOT")
    with root:
        StateMachine.add("PLAN", plan, dict.fromkeys(("goal", "fail", "preempted"), "done"))
    return root


def live(root: Any, store: KillingStore) -> str | None:
    """Run, or go on, in a process of its own; None: it was killed."""
    try:
        with VirtualClock() as clock, use_clock(clock):
            return smachpy.run_durable(root, store, mission="m")
    except Kill:
        return None


@pytest.mark.parametrize("below", [False, True], ids=["root", "below a machine"])
@pytest.mark.parametrize("kind", PLANS)
def test_a_plan_killed_at_any_write_ends_as_one_that_is_not(kind: str, below: bool) -> None:
    store = KillingStore()
    calm = Deeds(store)
    outcome = live(root_of(kind, calm, below=below), store)
    assert outcome == ("done" if below else "goal")
    values = read_position(store, "m").userdata
    for kill_at in range(1, store.writes):  # the last one says that it has ended
        for written in (False, True):
            hit = KillingStore()
            deeds = Deeds(hit)
            hit.arm(kill_at, written=written)
            assert live(root_of(kind, deeds, below=below), hit) is None
            hit.arm(0, written=False)
            assert live(root_of(kind, deeds, below=below), hit) == outcome, (kill_at, written)
            position = read_position(hit, "m")
            assert position.userdata == values, (kill_at, written)
            assert position.markings == position.visits == {}
            assert set(deeds) == set(calm)
            if written:
                assert sorted(deeds) == sorted(calm), (kill_at, written)


class Cut(KillingStore):
    """One whose process is off the network once it is killed."""

    on_kill: Any = None

    def append(self, *arguments: Any, **named: Any) -> None:
        try:
            super().append(*arguments, **named)
        except Kill:
            self.on_kill()
            raise


HALTED = """
    init* -> i j : fork
    i -> GO.exec : GO.start
    j -> A.exec : A.start
    A.exec -> a : A.end
    GO.exec a -> b : GO.interrupt [halt]
    b -> GO.exec : GO.start [again]
    GO.exec -> goal : GO.end
"""


class GoalWorld(World):
    """A robot that executes the goals of a plan."""

    def __init__(self) -> None:
        super().__init__(Config())
        self.store = Cut()
        self.done = Deeds(self.store)

    def plan(self) -> PetriNetPlan:
        """Return the plan in a new process."""
        self.machine()
        self.store.on_kill = self.mission.transport.close
        go = SimpleActionState("do", Action, goal=Goal(3), node=self.mission)
        net = net_of(HALTED, "PLAN")
        plan = PetriNetPlan(net, {"GO": go, "A": Count(self.done, "A")}, events="lasting")
        plan.userdata.count_A = 0
        return plan

    def live(self) -> str | None:
        plan = self.plan()
        self.clock.call_later(1.0, lambda: plan.post("halt"))
        self.clock.call_later(3.0, lambda: plan.post("again"))
        self.clock.call_later(5.0, self.end_last)
        try:
            return self.run(plan)
        except Kill:
            return None

    def end_last(self) -> None:
        goals = self.handles[1:]
        if goals and goals[-1].get_goal_status().status == GoalStatus.ACTIVE:
            self.handles[-1].set_succeeded(Result(7))


# What is left of a killed process fails, as its session is closed: nothing of it may get out.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_no_goal_of_a_plan_is_sent_twice_or_forgotten_at_any_kill() -> None:
    with GoalWorld() as world:
        world.serve()
        assert world.live() == "goal"
        writes = world.store.writes
    assert writes > 12
    for kill_at in range(1, writes):
        for written in (False, True):
            with GoalWorld() as world:
                world.serve()
                world.store.arm(kill_at, written=written)
                assert world.live() is None
                world.store.arm(0, written=False)
                assert world.live() == "goal", (kill_at, written)
                ends = [handle.get_goal_status().status for handle in world.handles]
                assert ends == [GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED], (kill_at, written)


class Waiting(State):
    """Notes how often it was executed, and lasts until it is asked to stop, or 10 s."""

    def __init__(self, begun: list[str]) -> None:
        super().__init__(["succeeded", "preempted"])
        self.begun = begun

    def execute(self, userdata: Any) -> str:
        del userdata
        self.begun.append("W")
        return "preempted" if self.wait_preempt(10.0) else "succeeded"


def killed_at(
    clock: VirtualClock, at: float, store: KillingStore, make: Any, **options: Any
) -> None:
    """Run a plan in a process that is killed at its first write after `at` [s]."""
    plan = make()
    clock.call_later(at, lambda: store.arm(1, written=False))
    clock.call_later(at, lambda: plan.post("wakes_it"))
    for event, seconds in options.items():
        clock.call_later(seconds, lambda event=event: plan.post(event))
    with pytest.raises(Kill):
        smachpy.run_durable(plan, store, mission="m")
    store.arm(0, written=False)


def reaches_its_goal_by(event: str, after: float, make: Any, **said: float) -> None:
    """Kill a plan after 5 s, and check that it ends `after` s later, when it hears `event`."""
    store = KillingStore()
    with VirtualClock() as clock, use_clock(clock):
        killed_at(clock, 5.0, store, make, **said)
        plan = make()
        clock.call_later(after, lambda: plan.post(event))
        assert smachpy.run_durable(plan, store, mission="m") == "goal"
        assert clock.now() == pytest.approx(5.0 + after)


EVENTS = """
init* -> W.exec : W.start
W.exec -> goal : W.interrupt [and heard seen]
W.exec -> fail : W.interrupt [timeout_W_8]
W.exec -> X : W.interrupt [wakes_it]
"""


@pytest.mark.parametrize("events", ["once", "lasting"])
def test_events_that_no_guard_has_read_are_kept(events: Any) -> None:
    text = """
    init* -> W.exec : W.start
    W.exec -> mid : W.interrupt [go]
    mid -> goal : [heard]
    """

    def make() -> PetriNetPlan:
        return PetriNetPlan(net_of(text, "PLAN"), {"W": Waiting([])}, events=events)

    reaches_its_goal_by("go", 0.5, make, heard=4.0)


def test_a_timeout_of_a_guard_goes_on() -> None:
    store = KillingStore()
    begun: list[str] = []

    def make() -> PetriNetPlan:
        return PetriNetPlan(net_of(EVENTS, "PLAN"), {"W": Waiting(begun)})

    with VirtualClock() as clock, use_clock(clock):
        killed_at(clock, 5.0, store, make)
        assert clock.now() == pytest.approx(5.0)
        assert smachpy.run_durable(make(), store, mission="m") == "fail"
        assert clock.now() == pytest.approx(8.0)
    assert begun == ["W", "W"]


def test_what_was_said_holds_on() -> None:
    def make() -> PetriNetPlan:
        plan = PetriNetPlan(net_of(EVENTS, "PLAN"), {"W": Waiting([])}, events="lasting")
        plan.set_condition("seen", value=False)
        return plan

    reaches_its_goal_by("heard", 1.0, make, seen=1.0)


def test_a_plan_whose_net_has_changed_is_refused_with_the_differences() -> None:
    store = KillingStore()
    with VirtualClock() as clock, use_clock(clock):
        killed_at(clock, 5.0, store, lambda: PetriNetPlan(net_of(EVENTS, "PLAN"), {"W": Long()}))
        changed = net_of(EVENTS.replace("heard", "noted"), "PLAN")
        with pytest.raises(MachineChangedError) as caught:
            smachpy.run_durable(PetriNetPlan(changed, {"W": Long()}), store, mission="m")
        assert len(caught.value.differences) == 1
        marking = read_position(store, "m").markings
        shape = shape_of(PetriNetPlan(net_of("init* -> goal : t", "PLAN")))
        assert missing_places(marking, shape_of(PetriNetPlan(changed))) == []
        assert missing_places({"/PLAN": ["p1", "p7"]}, shape) == ["/PLAN: place 'p7'"]
