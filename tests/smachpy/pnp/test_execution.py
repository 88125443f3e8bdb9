"""What a plan does when it runs: PNP's rules of firing, and the contract of every container."""

import contextlib
import dataclasses

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, use_clock
from smachpy import State, StateMachine, events
from smachpy.exceptions import (
    InconsistentMachineError,
    InvalidStateError,
    InvalidUserCodeError,
    UserDataTypeError,
)
from smachpy.pnp import Expression, Function, PetriNetPlan, Polled, TopicCondition
from tests.smachpy.pnp.nets import net_of

SEQUENCE = """
init* -> A.exec : A.start
A.exec -> mid : A.end
mid -> B.exec : B.start
B.exec -> goal : B.end
"""


@contextlib.contextmanager
def virtual_time():
    with VirtualClock() as clock, use_clock(clock):
        yield clock


class Timed(State):
    """Takes some seconds; notes what happens."""

    def __init__(self, log, name, seconds=1.0, outcome="succeeded"):
        super().__init__(["succeeded", "aborted", "preempted", "seen"])
        self.log, self.name, self.seconds, self.outcome = log, name, seconds, outcome

    def execute(self, ud):
        self.log.append(f"{self.name}+")
        stopped = self.sleep(self.seconds)
        self.log.append(f"{self.name}{'!' if stopped else '-'}")
        return "preempted" if stopped else self.outcome


def plan_of(text, log=None, seconds=None, **options):
    """Return a plan whose actions are `Timed`, of 1 s unless `seconds` says else."""
    log = [] if log is None else log
    seconds = seconds or {}
    actions = options.pop("actions", {})
    net = net_of(text)
    names = {
        w.rpartition(".")[0] for p in net.places for w in p.name.split() if w.endswith(".exec")
    }
    made = {
        name: Timed(log, name, *seconds.get(name, (1.0,))) for name in names if name not in actions
    }
    return PetriNetPlan(net, {**made, **actions}, **options)


def test_a_sequence():
    log = []
    plan = plan_of(SEQUENCE, log)
    with virtual_time() as clock:
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(2.0)
    assert log == ["A+", "A-", "B+", "B-"]


def test_it_tells_what_fires():
    plan = plan_of(SEQUENCE)
    heard = []
    plan.subscribe(heard.append)
    with virtual_time():
        plan.execute()
    fired = [e for e in heard if isinstance(e, events.Fired)]
    assert [e.transition for e in fired] == ["t0", "t1", "t2", "t3"]
    assert [e.marking for e in fired] == [("p1",), ("p2",), ("p3",), ("p4",)]
    assert [e.path for e in heard if isinstance(e, events.Entered)] == ["/plan/A", "/plan/B"]


def test_fork_and_join_run_at_once():
    text = """
    init* -> i j : fork
    i -> A.exec : A.start
    j -> B.exec : B.start
    A.exec -> a : A.end
    B.exec -> b : B.end
    a b -> goal : join
    """
    with virtual_time() as clock:
        assert plan_of(text, seconds={"A": (3.0,)}).execute() == "goal"
        assert clock.now() == pytest.approx(3.0)


SENSING = """
init* -> A.exec : A.start
A.exec -> goal : A.end [c]
A.exec -> fail : A.end [not c]
"""


@pytest.mark.parametrize(("value", "outcome"), [(True, "goal"), (False, "fail")])
def test_a_guarded_end_fires_on_its_condition_alone(value, outcome):
    log = []
    plan = plan_of(SENSING, log, conditions={"c": value})
    with virtual_time() as clock:
        assert plan.execute() == outcome
        assert clock.now() == 0.0
    assert "A-" not in log


@pytest.mark.parametrize(("value", "outcome"), [(True, "goal"), (False, "fail")])
def test_strict_waits_for_the_action_too(value, outcome):
    plan = plan_of(SENSING, strict=True, conditions={"c": value})
    with virtual_time() as clock:
        assert plan.execute() == outcome
        assert clock.now() == pytest.approx(1.0)


def test_an_outcome_of_the_action_is_a_condition():
    text = """
    init* -> A.exec : A.start
    A.exec -> fail : A.end [aborted]
    A.exec -> goal : A.end [seen]
    """
    with virtual_time() as clock:
        assert plan_of(text, seconds={"A": (1.0, "seen")}).execute() == "goal"
        assert clock.now() == pytest.approx(1.0)


@pytest.mark.parametrize("label", ["A.fail", "A.interrupt [action_failed]", "A.end [A.failed]"])
def test_a_plan_sees_that_an_action_has_failed(label):
    text = f"""
    init* -> A.exec : A.start
    A.exec -> goal : A.end
    A.exec -> fail : {label}
    """
    with virtual_time():
        assert plan_of(text, seconds={"A": (1.0, "aborted")}).execute() == "fail"
        assert plan_of(text).execute() == "goal"


def test_where_nothing_can_fire_it_fails():
    with virtual_time():
        assert plan_of(SEQUENCE, seconds={"A": (1.0, "aborted")}).execute() == "fail"


INTERRUPT = """
init* -> A.exec : A.start
A.exec -> goal : A.end
A.exec -> r : A.interrupt [obstacle]
r -> B.exec : B.start
B.exec -> init : B.end
"""


def test_an_interrupt_with_recovery():
    log = []
    plan = plan_of(INTERRUPT, log, seconds={"A": (10.0,)})
    with virtual_time() as clock:
        clock.call_later(4.0, lambda: plan.post("obstacle"))
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(15.0)
    assert sorted(log[1:3]) == ["A!", "B+"]
    assert log[3:] == ["B-", "A+", "A-"]


def test_an_event_is_forgotten_after_its_life():
    text = """
    init* -> A.exec : A.start
    A.exec -> mid : A.end
    mid -> goal : [e]
    """
    for seconds, life, outcome in ((1.5, 2.0, "goal"), (2.5, 2.0, "preempted"), (2.5, 9.0, "goal")):
        plan = plan_of(text, seconds={"A": (seconds,)}, event_life=life)
        with virtual_time() as clock:
            clock.call_later(0.01, lambda plan=plan: plan.post("e"))
            clock.call_later(20.0, plan.request_preempt)
            assert plan.execute() == outcome


def test_an_event_is_used_up_once_unless_it_lasts():
    text = """
    init* -> mid : [e]
    mid -> goal : [e]
    """
    for kind, outcome in (("once", "preempted"), ("lasting", "goal")):
        plan = PetriNetPlan(net_of(text), events=kind)
        with virtual_time() as clock:
            clock.call_later(1.0, lambda plan=plan: plan.post("e"))
            clock.call_later(20.0, plan.request_preempt)
            assert plan.execute() == outcome


def test_guards_are_read_before_any_firing_and_a_loser_is_skipped():
    text = """
    init* -> a : [c]
    init -> b : [c]
    a -> goal : t
    b -> fail : u
    """
    asked = []
    plan = PetriNetPlan(net_of(text), conditions={"c": lambda ud: asked.append(1) or True})
    assert plan.execute() == "goal"
    assert len(asked) == 1  # once a step, for both guards


def test_parameters_in_the_name_of_a_polled_condition():
    """It was never asked, and no check noted it."""
    text = """
    init* -> A.exec : A.start
    A.exec -> goal : A.interrupt [near_hall_door]
    A.exec -> fail : A.end
    """
    asked = []
    near = Polled(lambda ud, *words: asked.append(words) or len(asked) > 2, 0.5)
    plan = plan_of(text, seconds={"A": (9.0,)}, conditions={"near": near})
    with virtual_time() as clock:
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(1.0)
    assert asked == [("hall", "door")] * 3


def test_an_expression_has_no_parameters_in_its_name():
    """`low_battery` asked `low` with a parameter, which ended the plan."""
    plan = plan_of("init* -> goal : t [not low_battery]", conditions={"low": Expression("x > 0")})
    assert [problem.rule for problem in plan.binding_problems()] == ["unknown-condition"]
    assert plan.execute() == "goal"


def test_all_goal_places_must_hold_exactly_their_tokens():
    text = """
    init* -> goal~g2 x : t
    x -> goal : [go]
    """
    plan = PetriNetPlan(net_of(text))
    with virtual_time() as clock:
        clock.call_later(1.0, lambda: plan.post("go"))
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(1.0)


@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize("how", ["post", "set_condition"])
def test_events_and_conditions_reach_all_plans_below(how, nested):
    """A plan in a machine in a plan heard no event, and no sub-plan of `set_condition`."""
    sub = PetriNetPlan(net_of("init* -> goal : t [go]"))
    job = sub
    if nested:
        job = StateMachine(["goal", "fail", "preempted"])
        with job:
            job.add("SUB", sub)
    plan = plan_of("init* -> job.exec : start\njob.exec -> goal : end", actions={"job": job})
    with virtual_time() as clock:
        act = {
            "post": lambda: plan.post("go"),
            "set_condition": lambda: plan.set_condition("go", True),
        }
        clock.call_later(1.0, act[how])
        clock.call_later(60.0, plan.request_preempt)
        assert plan.execute() == "goal"
        assert clock.now() == 1.0


def test_an_old_event_is_none_for_a_sub_plan_that_begins():
    """Its life began with the sub-plan: an event of an hour ago opened a door."""
    sub = PetriNetPlan(net_of("init* -> goal : t [go]"))
    text = """
    init* -> A.exec : A.start
    A.exec -> mid : A.end
    mid -> job.exec : job.start
    job.exec -> goal : job.end
    """
    plan = plan_of(text, seconds={"A": (3600.0,)}, actions={"job": sub})
    with virtual_time() as clock:
        clock.call_later(1.0, lambda: plan.post("go"))
        clock.call_later(3700.0, plan.request_preempt)
        assert plan.execute() == "preempted"


@pytest.mark.parametrize(("name", "value"), [("", True), (None, True), ("c", "False"), ("c", b"0")])
def test_set_condition_refuses_texts_for_truth_and_names_that_are_none(name, value):
    """A text was true, whatever it says."""
    plan = plan_of("init* -> goal : t [c]")
    with pytest.raises(InvalidStateError, match=r"set_condition: (name|value): got"):
        plan.set_condition(name, value)
    for event in ("", "!", "not_"):
        with pytest.raises(InvalidStateError, match="post: event: got"):
            plan.post(event)


def test_a_timeout_condition():
    text = """
    init* -> A_x.exec : A_x.start
    A_x.exec -> goal : A_x.end
    A_x.exec -> fail : A_x.interrupt [timeout_A_5]
    """
    for seconds, outcome, end in ((9.0, "fail", 5.0), (2.0, "goal", 2.0)):
        with virtual_time() as clock:
            assert plan_of(text, seconds={"A_x": (seconds,)}).execute() == outcome
            assert clock.now() == pytest.approx(end)


def test_a_timeout_that_passes_while_another_guard_is_evaluated_interrupts():
    """It waited for ever: the guard had been false before, and the time had passed after."""
    text = """
    init* -> A.exec : A.start
    A.exec -> goal : A.end
    A.exec -> fail : A.interrupt [timeout_A_5]
    A.exec -> fail : A.interrupt [door]
    """

    def door(ud):
        clock.sleep(0.5)
        return False

    plan = plan_of(text, seconds={"A": (99.0,)}, conditions={"door": door})
    with virtual_time() as clock:
        clock.call_later(4.75, lambda: plan.post("anything"))
        assert plan.execute() == "fail"
        assert clock.now() < 6.0


def test_conditions_on_userdata_are_looked_at_when_it_is_written():
    text = """
    init* -> A.exec B.exec : A.start B.start
    A.exec B.exec -> goal : A.interrupt B.end [low]
    """

    def drain(ud):
        for level in (50, 30, 10):
            smachpy.current_state().sleep(1.0)
            ud.battery = level
        smachpy.current_state().sleep(60.0)

    drain = Function(drain, output_keys=("battery",))
    plan = plan_of(text, seconds={"A": (99.0,)}, actions={"B": drain},
                   conditions={"low": Expression("battery < 20")})  # fmt: skip
    with virtual_time() as clock:
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(3.0)


@dataclasses.dataclass
class Robot:
    battery: float = 100.0


def test_conditions_on_typed_userdata_are_looked_at_when_it_is_written():
    conditions = {"low": Expression("battery < 20")}
    plan = PetriNetPlan(net_of("init* -> goal : [low]"), conditions=conditions, userdata_type=Robot)

    def write():
        with pytest.raises(UserDataTypeError):
            plan.userdata.battery = "empty"
        plan.userdata.battery = 10.0

    with virtual_time() as clock:
        clock.call_later(3.0, write)
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(3.0)


def test_a_key_that_is_deleted_is_seen():
    plan = PetriNetPlan(
        net_of("init* -> goal : [not there]"), conditions={"there": lambda ud: "x" in ud}
    )
    plan.userdata.x = 1
    with virtual_time() as clock:
        clock.call_later(3.0, lambda: plan.userdata.__delitem__("x"))
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(3.0)


@pytest.mark.parametrize("more", ["", "init* -> A.exec : A.start\n"], ids=["alone", "beside A"])
def test_a_condition_that_blocks_is_bounded_by_the_grace(more):
    asked = []

    def blocks(ud):
        asked.append(clock.now())
        clock.sleep(1000.0)

    text = more + "first* -> goal : [blocks]"
    plan = plan_of(
        text, seconds={"A": (500.0,)}, conditions={"blocks": blocks}, preempt_timeout=2.0
    )
    with virtual_time() as clock:
        clock.call_later(5.0, plan.request_preempt)
        assert plan.execute() == "preempted"
        assert clock.now() == pytest.approx(7.0)
        assert asked == [0.0]
    assert not plan.is_running()


def test_events_that_nobody_reads_are_bounded_and_said(caplog):
    plan = PetriNetPlan(net_of("init* -> goal : [last]"))
    for number in range(1000):
        plan.post(f"e{number}")
    assert plan.dropped_events == 0
    for _ in range(3):
        plan.post("last")
    assert plan.dropped_events == 3
    assert sum("'e0' first" in record.getMessage() for record in caplog.records) == 1
    with virtual_time():
        assert plan.execute() == "goal"


def test_a_polled_condition():
    with virtual_time() as clock:
        plan = PetriNetPlan(
            net_of("init* -> goal : [late]"),
            conditions={"late": Polled(lambda ud: clock.now() > 3, 1.0)},
        )
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(4.0)


def test_functions_get_parameters_and_variables():
    said = []
    text = """
    init* -> setvar_@who_Ann.exec : start
    setvar_@who_Ann.exec -> mid : end
    mid -> r1#say_hello_@who.exec : start
    r1#say_hello_@who.exec -> goal : end
    """

    def say(ud, *words, robot=""):
        said.append((*words, robot))

    assert PetriNetPlan(net_of(text), {"say": say}).execute() == "goal"
    assert said == [("hello", "Ann", "r1")]


def test_async_functions_are_cancelled():
    import asyncio

    ended = []

    async def hang(ud):
        try:
            await asyncio.sleep(3600)
        finally:
            ended.append(1)

    plan = PetriNetPlan(net_of("init* -> A.exec : start\nA.exec -> goal : end"), {"A": hang})
    with virtual_time() as clock:
        clock.call_later(2.0, plan.request_preempt)
        assert plan.execute() == "preempted"
    assert ended == [1]


def test_wait_and_waitfor():
    text = """
    init* -> wait_3.exec : start
    wait_3.exec -> mid : end
    mid -> waitfor_door.exec : start
    waitfor_door.exec -> goal : end
    """
    plan = PetriNetPlan(net_of(text))
    with virtual_time() as clock:
        clock.call_later(5.0, lambda: plan.set_condition("door", True))
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(5.0)


def test_a_plan_restarts_and_stops_itself():
    runs = []
    text = """
    init* -> count.exec : start
    count.exec -> mid : end
    mid -> restartcurrentplan.exec : start [more]
    mid -> stopcurrentplan.exec : start [not more]
    """
    plan = PetriNetPlan(
        net_of(text),
        {"count": lambda ud: runs.append(1)},
        {"more": lambda ud: len(runs) < 3},
    )
    assert plan.execute() == "fail"
    assert len(runs) == 3


FORK = """
init* -> A.exec B.exec : A.start B.start
A.exec B.exec -> goal : [never] A.end B.end
"""


def test_a_preempt_reaches_every_action():
    log = []
    plan = plan_of(FORK, log, seconds={"A": (60.0,), "B": (60.0,)})
    with virtual_time() as clock:
        clock.call_later(2.0, plan.request_preempt)
        assert plan.execute() == "preempted"
        assert clock.now() == pytest.approx(2.0)
    assert sorted(log) == ["A!", "A+", "B!", "B+"]
    assert not plan.preempt_requested()


def test_a_preempt_while_it_waits_for_a_condition():
    plan = PetriNetPlan(net_of("init* -> goal : [never]"))
    with virtual_time() as clock:
        clock.call_later(2.0, plan.request_preempt)
        assert plan.execute() == "preempted"
    plan.request_preempt()
    assert plan.execute() == "preempted"


def test_work_that_was_finished_when_the_preempt_came_stands():
    class Deaf(State):
        def __init__(self):
            super().__init__(["succeeded"])

        def execute(self, ud):
            self.clock().sleep(3.0)
            return "succeeded"

    plan = PetriNetPlan(net_of("init* -> A.exec : start\nA.exec -> goal : end"), {"A": Deaf()})
    with virtual_time() as clock:
        clock.call_later(2.0, plan.request_preempt)
        assert plan.execute() == "goal"


@pytest.mark.parametrize("more", ["", "A.exec -> goal : [e]"])
def test_a_deaf_action_is_left_behind(clock, more):
    class Deaf(State):
        def __init__(self):
            super().__init__(["succeeded"])

        def execute(self, ud):
            end = self.clock().now() + 60.0
            while self.clock().now() < end:
                with contextlib.suppress(BaseException):  # interrupted: it does not care
                    self.clock().sleep(end - self.clock().now())
            return "succeeded"

    plan = PetriNetPlan(
        net_of(f"init* -> A.exec : start\nA.exec -> goal : end\n{more}"),
        {"A": Deaf()},
        preempt_timeout=1.0,
    )
    ended = []
    task = clock.spawn(lambda: ended.append((plan.execute(), clock.now())), name="program")
    clock.call_later(2.0, plan.request_preempt)
    task.join()
    assert ended == [("preempted", pytest.approx(3.1, abs=0.2))]
    clock.sleep(100.0)  # the deaf one ends, and changes nothing


def test_what_still_runs_at_the_goal_is_stopped_first():
    log = []
    text = """
    init* -> A.exec B.exec : A.start B.start
    A.exec -> goal : A.end
    """
    plan = plan_of(text, log, seconds={"A": (1.0,), "B": (60.0,)})
    with virtual_time() as clock:
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(1.0)
    assert log[-1] == "B!"


def test_a_state_that_raises():
    def bad(ud):
        raise OSError("no arm")

    for text in ("init* -> A.exec : start\nA.exec -> goal : end",
                 "init* -> A.exec B.exec : A.start B.start\nA.exec -> goal : A.end"):  # fmt: skip
        plan = plan_of(text, actions={"A": bad}, seconds={"B": (60.0,)})
        with virtual_time() as clock:
            with pytest.raises(InvalidUserCodeError, match="no arm"):
                plan.execute()
            assert clock.now() == 0.0
        assert not plan.is_running()


def test_a_condition_that_raises_names_itself():
    def bad(ud):
        raise ValueError("broken")

    log = []
    plan = plan_of(INTERRUPT, log, conditions={"obstacle": bad})
    with virtual_time(), pytest.raises(InvalidUserCodeError, match="condition 'obstacle' raised"):
        plan.execute()
    assert not plan.is_running()


def test_options_of_states_hold():
    log = []
    slow = Timed(log, "A", 60.0)
    smachpy.set_options(slow, timeout=2.0)
    plan = PetriNetPlan(
        net_of("init* -> A.exec : start\nA.exec -> goal : end\nA.exec -> fail : fail"), {"A": slow}
    )
    with virtual_time() as clock:
        assert plan.execute() == "fail"
        assert clock.now() == pytest.approx(2.0)


def test_a_plan_in_a_machine_and_a_machine_in_a_plan():
    inner = StateMachine(["done", "preempted"])
    log = []
    with inner:
        inner.add("X", Timed(log, "X"), {"succeeded": "done", "seen": "done", "aborted": "done"})
    plan = PetriNetPlan(net_of("init* -> A.exec : start\nA.exec -> goal : end"), {"A": inner})
    outer = StateMachine(["done", "preempted"], name="OUTER")
    with outer:
        outer.add("PLAN", plan, {"goal": "done", "fail": "done"})
    heard = []
    outer.subscribe(heard.append)
    with virtual_time():
        assert outer.execute() == "done"
    assert "/OUTER/PLAN/A/X" in [e.path for e in heard if isinstance(e, events.Entered)]


def test_an_operator_fires_a_transition_and_forces_an_outcome():
    plan = plan_of(SEQUENCE, seconds={"A": (60.0,), "B": (60.0,)})
    control = plan.control
    with virtual_time() as clock:
        clock.call_later(1.0, lambda: plan.fire("t1"))
        clock.call_later(3.0, lambda: control.force_outcome("/plan/B", "succeeded"))
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(3.0)
    with pytest.raises(InvalidStateError, match="expected the id"):
        plan.fire("t99")


def test_pause_and_step():
    log = []
    plan = plan_of(SEQUENCE, log)
    control = plan.control
    control.pause()
    with virtual_time() as clock:
        clock.call_later(5.0, control.step)
        clock.call_later(20.0, control.resume)
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(21.0)


def test_an_unknown_action_keeps_a_plan_from_running():
    ran = []
    plan = PetriNetPlan(net_of(SEQUENCE), {"A": lambda ud: ran.append(1)})
    with pytest.raises(InconsistentMachineError) as caught:
        plan.execute()
    assert ran == []
    assert "no action is registered" in str(caught.value)
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize(
    "wrong",
    [
        {"actions": {"A": 5}},
        {"actions": ["A"]},
        {"conditions": {"c": "text"}},
        {"conditions": {"": True}},
        {"conditions": {"c": Polled(lambda ud: 1, float("nan"))}},
        {"events": "often"},
        {"event_life": -1},
        {"event_life": float("nan")},
        {"name": ""},
    ],
)
def test_bad_arguments(wrong):
    with pytest.raises(InvalidStateError):
        PetriNetPlan(net_of(SEQUENCE), **wrong)


@pytest.mark.parametrize(
    "text", ["f(x)", "x._y", "lambda: 1", "", "1 +", "__import__('os')", "(" * 500, "x := 1"]
)
def test_expressions_call_nothing(text):
    with pytest.raises(ValueError, match="expected"):
        Expression(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("x < 20 and not y", True), ("1 < x < 5", False), ("name in ('a', 'b')", True), ("gone > 1", False), ("x % 2 == 0 or y", True), ("-x < 0", True), ("max(x, 3) == 10", True), ("gone.x > 1", False)],
)  # fmt: skip
def test_expressions(text, expected):
    assert Expression(text)({"x": 10, "y": False, "name": "a"}) is expected


def test_topics_are_conditions():
    from actionlib_core.interfaces.std_msgs.msg import Bool
    from actionlib_core.node import Node, use_node
    from actionlib_core.pubsub.topic import Publisher
    from actionlib_core.transport.memory import MemoryNetwork

    plan = PetriNetPlan(
        net_of("init* -> goal : [open]"),
        conditions={"open": TopicCondition("door", Bool, lambda m: m.data)},
    )
    with virtual_time() as clock, contextlib.ExitStack() as stack:
        node = Node("mission", transport=MemoryNetwork(clock).session(), clock=clock)
        stack.callback(node.transport.close)
        stack.callback(node.close)
        stack.enter_context(use_node(node))
        publisher = Publisher("door", Bool, queue_size=1, node=node)
        clock.call_later(1.0, lambda: publisher.publish(Bool(data=False)))
        clock.call_later(2.0, lambda: publisher.publish(Bool(data=True)))
        assert plan.execute() == "goal"
        assert clock.now() == pytest.approx(2.0, abs=0.1)


def test_the_structure():
    record = smachpy.describe(plan_of(SEQUENCE))
    assert record.kind == "plan"
    assert [c.label for c in record.children] == ["A", "B"]
    assert record.net.places[1].child == "A"
    assert record.net.places[4].role == "goal"
    assert record.net.transitions[0].calls == (("A", "start"),)
    assert smachpy.StateRecord.from_json(record.to_json()) == record


def test_a_long_way_without_guards_is_gone():
    ways = "\n".join(f"p{n}{'*' * (n == 0)} -> p{n + 1}" for n in range(1500))
    with virtual_time():
        assert plan_of(f"{ways}\np1500 -> goal").execute() == "goal"
