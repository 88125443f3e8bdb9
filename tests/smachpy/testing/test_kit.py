"""Running machines in tests: virtual time, doubles, preempts, assertions."""

from __future__ import annotations

import asyncio
import signal
import threading
import time
import warnings

import pytest

from actionlib_core import shutdown
from actionlib_core.clock import Deadlock, RealClock, current_clock
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy import (
    CBState,
    Concurrence,
    InvalidStateError,
    InvalidUserCodeError,
    MonitorState,
    ServiceState,
    SimpleActionState,
    State,
    StateMachine,
    set_options,
    when,
)
from smachpy.testing import (
    DoubleError,
    MissionTestCase,
    TimeLimitError,
    UnfiredWarning,
    UnknownStateError,
    explore,
    mission_kit,
)
from smachpy.testing.coverage import Coverage


class Wait(State):
    def __init__(self, seconds=10.0):
        super().__init__(["done", "preempted"], output_keys=["waited"])
        self.seconds = seconds

    def execute(self, ud):
        if self.sleep(self.seconds):
            return "preempted"
        ud.waited = self.seconds
        return "done"


def two_waits():
    sm = StateMachine(["done", "failed", "preempted"], name="M")
    with sm:
        sm.add("A", Wait(), {"done": "B"})
        sm.add("B", Wait(20.0))
    return sm


def test_a_kit_whose_block_has_ended_runs_nothing():
    """It ran in real time."""
    with mission_kit() as mission:
        mission(two_waits())
    with pytest.raises(RuntimeError, match="not open; expected a call in `with mission_kit"):
        mission(two_waits())


def test_a_run_says_what_happened(mission):
    run = mission(two_waits())
    assert run.outcome == "done"
    assert run.path == run.states == ("/M/A", "/M/B")
    assert run.duration == 30
    assert run.userdata == {"waited": 20}
    assert run.visits("A") == 1
    assert run.outcomes("/M/B") == ("done",)
    assert [type(event).__name__ for event in run.events][:: len(run.events) - 1] == [
        "Started",
        "Finished",
    ]
    assert run.active == run.goals_left == run.abandoned() == ()
    assert not run.timed_out("A")


def test_assertions_that_hold(mission):
    run = mission(two_waits())
    run.assert_outcome("done", "failed")
    run.assert_path(["A", "/M/B"])
    run.assert_path(["A", ...])
    run.assert_path([..., "B"])
    run.assert_path([..., "A", ..., "B", ...])
    run.assert_visited("A", "B")
    run.assert_userdata(waited=20)
    run.assert_duration(at_least=30, at_most=30)


@pytest.mark.parametrize(
    ("check", "said"),
    [
        (lambda run: run.assert_outcome("failed"), "outcome: got 'done'; expected 'failed'"),
        (lambda run: run.assert_path(["A"]), "+ /M/B"),
        (lambda run: run.assert_path([..., "A"]), "+ /M/B"),
        (lambda run: run.assert_path(["B", "A"]), "- /M/A"),
        (lambda run: run.assert_not_visited("A"), "['A'] ran; expected not"),
        (lambda run: run.assert_userdata(waited=1, x=2), "x: got no value; expected 2"),
        (lambda run: run.assert_duration(at_most=1), "got 30 s; expected 0 to 1 s"),
    ],
)
def test_a_failed_assertion_tells_the_run_and_names_a_picture(mission, check, said):
    run = mission(two_waits())
    with pytest.raises(AssertionError) as caught:
        check(run)
    text = str(caught.value)
    assert said in text
    assert "10.000  /M/A -done->" in text
    picture = text[text.index("picture: ") + 9 :]
    with open(picture, encoding="utf-8") as file:
        assert "<svg" in file.read()


def test_a_wrong_name_is_no_failed_assertion(mission):
    run = mission(two_waits())
    with pytest.raises(UnknownStateError, match="Did you mean"):
        run.assert_visited("AA")


def test_userdata_is_put_in_before(mission):
    sm = StateMachine(["done"])
    with sm:
        sm.add("A", CBState(lambda ud: ud.x, outcomes=["done"], input_keys=["x"]))
    assert mission(sm, userdata={"x": "done"}).outcome == "done"


def test_user_code_that_waits_by_itself_is_in_virtual_time(mission):
    def wait(ud):
        time.sleep(3600)
        threading.Event().wait(3600)
        return "done"

    sm = StateMachine(["done"])
    with sm:
        sm.add("A", CBState(wait, outcomes=["done"]))
    assert mission(sm).duration == 7200
    assert isinstance(RealClock().now(), float)


# -- doubles ---------------------------------------------------------------------------------------


def test_a_double_takes_a_state_s_place_for_the_test():
    sm = two_waits()
    original = sm["A"]
    with mission_kit() as mission:
        made = mission.replace("/M/A", outcomes=["done", "preempted"], writes={"waited": 1})
        mission.replace("B", outcomes=["done"], duration=5)
        assert mission(sm).duration == 5
        run = mission(sm)
        assert run.outcome == "preempted"
        assert run.outcomes("A") == ("preempted",)
        assert made[0].runs == 2
        assert sm["A"] is made[0]
    assert sm["A"] is original


def test_a_double_in_a_machine_with_a_slash_in_its_name(mission):
    """`replace` looked for a state "M" in it."""
    inner = StateMachine(["done", "preempted"])
    inner.add("IN", Wait())
    sm = two_waits()
    sm.name = "r1/M"
    sm.add("C", inner)
    sm.set_initial_state(["C"])
    mission.replace("C/IN", outcomes=["done"], duration=1)
    mission.replace("/r1/M/A", outcomes=["preempted"])
    run = mission(sm)
    assert (run.outcome, run.duration) == ("done", 1)
    sm.set_initial_state(["A"])
    assert mission(sm).outcome == "preempted"


def test_a_double_with_a_function(mission):
    mission.replace("A", execute=lambda ud: "preempted")
    assert mission(two_waits()).outcome == "preempted"


def test_a_double_with_an_async_function(mission):
    async def work(ud):
        await asyncio.sleep(3)
        ud.waited = 3
        return "done"

    mission.replace("A", execute=work)
    run = mission(two_waits())
    assert (run.outcomes("A"), run.duration) == (("done",), 23)
    mission.replace("B", execute=lambda ud: work(ud))
    with pytest.raises(
        DoubleError, match=r"coroutine .*; expected an outcome. Try a function made"
    ):
        mission(two_waits())


def test_a_double_keeps_options_and_details_of_its_state(mission):
    sm = StateMachine(["done", "late"], name="M")
    with sm:
        sm.add("A", Wait(1), {"preempted": "done"})
        set_options(sm["A"], timeout=5.0, timeout_outcome="late")
    mission.replace("A", outcomes=["done"], duration=60)
    run = mission(sm)
    assert run.outcome == "late"
    assert run.duration == 5
    assert run.timed_out("A")


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        ({"path": "X", "outcomes": ["done"]}, UnknownStateError, "'X'"),
        ({"path": "A", "outcomes": ["odd"]}, DoubleError, "odd"),
        ({"path": "A"}, DoubleError, "at least one"),
        ({"path": "A", "outcomes": ["done"], "writes": {"x": 1}}, DoubleError, "output keys"),
        ({"path": "/M", "outcomes": ["done"]}, DoubleError, "the root"),
    ],
)
def test_doubles_that_do_not_fit(mission, arguments, error, said):
    mission.replace(**arguments)
    with pytest.raises(error, match=said):
        mission(two_waits())


NAN = float("nan")


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda m: m.preempt(at=NAN), "preempt: at: got nan; expected seconds >= 0"),
        (lambda m: m.preempt(at="3"), "preempt: at: got '3'; .* Try 3."),
        (lambda m: m.preempt(on="A", after=NAN), "preempt: after: got nan"),
        (lambda m: m.interrupt(on="A", after=-1), "interrupt: after: got -1"),
        (lambda m: m.preempt(on="A", visit=0), "preempt: visit: got 0; expected a whole number"),
        (lambda m: m.trigger("stop", on="A", visit=1.5), "trigger: visit: got 1.5"),
        (lambda m: m.replace("A", ["done"], duration=NAN), "replace: duration: got nan"),
        (lambda m: m.replace("A", "done"), r"outcomes: got 'done'; .* Try \['done'\]."),
        (lambda m: m(two_waits(), limit=NAN), "mission: limit: got nan"),
        (lambda m: m(two_waits(), steps=0), "mission: steps: got 0"),
        (lambda m: m.explore(two_waits(), limit=NAN), "explore: limit: got nan"),
        (lambda m: m.explore(two_waits(), keep="A"), r"explore: keep: got 'A'; .* Try \['A'\]."),
        (lambda m: m.explore(two_waits(), faults="hang"), "explore: faults: got 'hang'"),
        (lambda m: m.replay(two_waits(), [], steps="x"), "replay: steps: got 'x'"),
        (lambda m: m.topic("a", Bool).publish_at(-1, data=True), "a: publish_at: at: got -1"),
        (lambda m: m.topic("a", Bool).delay("x"), "a: delay: seconds: got 'x'"),
    ],
)
def test_times_counts_and_lists_that_are_none_are_refused(mission, call, said):
    """NaN was no limit, no time, or a preempt that never came; the run itself refused a text."""
    with pytest.raises(InvalidStateError, match=said):
        call(mission)


def test_a_run_without_a_limit(mission):
    week_s = 7 * 24 * 3600
    sm = StateMachine(["done", "preempted"], name="M")
    sm.add("A", Wait(week_s))
    assert mission(sm, limit=float("inf")).duration == week_s


# -- preempts --------------------------------------------------------------------------------------


def test_preempt_at_a_time(mission):
    mission.preempt(at=15)
    run = mission(two_waits())
    assert (run.outcome, run.duration) == ("preempted", 15)
    assert mission(two_waits()).outcome == "done"  # it was for one run


def test_preempt_on_a_state(mission):
    mission.preempt(on="/M/B", after=3)
    assert mission(two_waits()).duration == 13
    mission.preempt(on="B")
    assert mission(two_waits()).duration == 10


def test_preempt_on_a_later_visit(mission):
    sm = StateMachine(["preempted"])
    with sm:
        sm.add("A", Wait(), {"done": "A"})
    mission.preempt(on="A", visit=4, after=1)
    assert mission(sm).duration == 31


def test_what_the_function_of_a_trigger_raises_fails_the_test(mission):
    """It was printed, and the test passed."""
    mission.trigger(lambda machine: machine.no_such_method(), at=1.0)
    with pytest.raises(AssertionError, match=r"trigger\(at=1\): AttributeError: .*no_such_method"):
        mission(two_waits())


def test_a_trigger_changes_nothing_before_it_acts(mission):
    """A run without triggers is only taken down; one with them has a listener until the last."""
    hearing = []

    class Look(Wait):
        def execute(self, ud):
            hearing.append(len(sm._smachpy.live.listeners))
            return super().execute(ud)

    def machine():
        sm = StateMachine(["done", "preempted"], name="M")
        with sm:
            sm.add("A", Look(), {"done": "B"})
            sm.add("B", Look(), {"done": "C"})
            sm.add("C", Look())
        return sm

    sm = machine()
    plain = mission(sm)
    assert hearing == [0, 0, 0]
    mission.preempt(on="A", after=100)
    mission.preempt(on="B", after=15)
    sm = machine()
    with pytest.warns(UnfiredWarning):
        preempted = mission(sm)
    assert hearing[3:] == [1, 0, 0]
    assert preempted.path == plain.path
    assert preempted.duration == 25

    def until_c(run):
        begun = run.events[0]
        events = [event._replace(t=event.t - begun.t, stamp_ns=0) for event in run.events]
        return events[: next(i for i, e in enumerate(events) if e.path == "/M/C") + 1]

    assert until_c(preempted) == until_c(plain)


def test_a_preempt_is_for_one_run_even_when_its_time_comes_later(mission):
    sm = two_waits()
    mission.preempt(on="B", after=25)
    with pytest.warns(UnfiredWarning):
        assert mission(sm).outcome == "done"
    other = mission(two_waits())  # lets the time pass
    assert (other.outcome, mission(sm).outcome) == ("done", "done")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"at": 500}, r"preempt\(at=500\): the run ended after 30 s"),
        ({"on": "A", "visit": 2}, r"preempt\(on='A', visit=2\): /M/A began 1 times, and the run"),
        ({"on": "B", "after": 50.0}, r"preempt\(on='B', after=50\): the run ended after 30 s"),
    ],
)
def test_a_preempt_that_never_came_is_told(mission, arguments, said):
    mission.preempt(**arguments)
    with pytest.warns(UnfiredWarning, match=said):
        run = mission(two_waits())
    assert run.outcome == "done"
    assert f"never came: {run.unfired[0]}" in run.explain()


def test_a_preempt_that_came_is_no_warning(mission):
    mission.preempt(on="B", after=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = mission(two_waits())
    assert run.unfired == ()


def test_the_root_is_a_state_like_the_others(mission):
    mission.preempt(on="/M", after=3)
    run = mission(two_waits())
    assert (run.outcome, run.duration) == ("preempted", 3)
    assert (run.visits("M"), run.outcomes("M")) == (1, ("preempted",))
    run.assert_visited("/M")


def test_interrupt_is_a_shutdown_and_a_preempt(mission):
    mission.interrupt(on="A", after=2)
    run = mission(two_waits())
    assert (run.outcome, run.duration) == ("preempted", 2)
    assert shutdown.requested()


@pytest.mark.parametrize("more", [{"after": 3.0}, {"visit": 7}])
def test_arguments_of_a_state_without_one_are_refused(mission, more):
    """They had no effect."""
    for ask in (mission.preempt, mission.interrupt, lambda **given: mission.trigger("x", **given)):
        with pytest.raises(ValueError, match="without on; expected a state"):
            ask(at=2.0, **more)


def test_neither_at_nor_on(mission):
    with pytest.raises(ValueError, match="one of them"):
        mission.preempt()


# -- runs that go wrong ----------------------------------------------------------------------------


def test_a_deadlock_names_the_active_states(mission):
    def stuck(ud):
        current_clock().event("a call").wait()

    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("A", CBState(stuck, outcomes=["done"]))
    with pytest.raises(Deadlock, match="a call") as caught:
        mission(sm)
    assert "active: /M/A" in caught.value.__notes__


def test_a_deadlock_in_a_concurrence(mission):
    both = Concurrence(["done"], "done", name="C")
    with both:
        both.add("A", CBState(lambda ud: current_clock().event("never").wait(), outcomes=["done"]))
        both.add("B", Wait())
    with pytest.raises(Deadlock) as caught:
        mission(both)
    assert caught.value.waits["/C/A"] == "never"


def test_a_run_that_never_ends_is_told_from_a_long_one(mission):
    sm = StateMachine(["preempted"], name="M")
    with sm:
        sm.add("A", Wait(), {"done": "A"})
    with pytest.raises(TimeLimitError, match="still ran after 95 s, in /M/A") as caught:
        mission(sm, limit=95)
    assert caught.value.run.visits("A") == 10


def loop(name="M", **options):
    sm = StateMachine(["done"], name=name, **options)
    with sm:
        sm.add("A", CBState(lambda ud: "again", outcomes=["again", "done"]), {"again": "A"})
    return sm


def test_a_run_in_which_no_time_passes_is_no_endless_test(mission):
    with pytest.raises(TimeLimitError, match="took 1000 steps at 0 s, in /M/A; expected") as caught:
        mission(loop(), steps=1000)
    assert 1000 <= caught.value.run.visits("A") < 2000
    mission.preempt(on="A", visit=10**6)  # with a listener
    with pytest.raises(TimeLimitError, match="took 1000 steps"):
        mission(loop(), steps=1000)


def test_time_that_passes_now_and_then_is_enough(mission):
    count = [0]

    def step(ud):
        count[0] += 1
        if count[0] % 300 == 0:
            time.sleep(1)
        return "again" if count[0] < 3000 else "done"

    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("A", CBState(step, outcomes=["again", "done"]), {"again": "A"})
    assert mission(sm, steps=1000).duration == 10


def test_no_handler_of_the_mission_keeps_a_run_without_time_going(mission):
    sm = StateMachine(["done"], name="M")
    with sm:
        inner = loop(on_exception={Exception: "done"}, retry=(3, 0.0, Exception))
        sm.add("INNER", inner, {"done": "INNER"})
    with pytest.raises(TimeLimitError, match="/M/INNER/A"):
        mission(sm, steps=1000)


def test_a_child_of_a_concurrence_in_which_no_time_passes(mission):
    both = Concurrence(["done"], "done", name="C")
    with both:
        both.add("LOOP", loop())
        both.add("B", Wait())
    with pytest.raises(TimeLimitError, match="took 1000 steps at 0 s"):
        mission(both, steps=1000)


def test_a_state_that_raises(mission):
    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("A", CBState(lambda ud: 1 / 0, outcomes=["done"]))
    with pytest.raises(InvalidUserCodeError) as caught:
        mission(sm)
    assert any("picture: " in note for note in caught.value.__notes__)


# -- elsewhere than in a plain pytest function -----------------------------------------------------


def test_inside_an_event_loop(mission):
    class Sleeper(State):
        async def execute(self, ud):
            await asyncio.sleep(60)
            return "done"

    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("A", Sleeper(["done"]), {"done": "B"})
        sm.add("B", Wait())

    async def test():
        return mission(sm)

    assert asyncio.run(test()).duration == 70


def test_a_deadlock_inside_an_event_loop(mission):
    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("A", CBState(lambda ud: current_clock().event("x").wait(), outcomes=["done"]))

    async def test():
        with pytest.raises(Deadlock):
            mission(sm)

    asyncio.run(test())


class TestWithUnittest(MissionTestCase):
    def test_mission(self):
        self.mission.preempt(at=1)
        assert self.mission(two_waits()).duration == 1


def test_seeds_give_the_same_events_twice():
    def events(seed):
        both = Concurrence(["done"], "done", name="C")
        with both:
            for label in "ABC":
                both.add(label, Wait())
        with mission_kit(seed=seed) as mission:
            return [(type(e).__name__, e.path, e.t) for e in mission(both).events]

    first = [events(seed) for seed in range(100)]
    assert first == [events(seed) for seed in range(100)]
    assert len({tuple(run) for run in first}) > 3


def timed():
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="TIMED")
    with sm:
        sm.add(
            "ASK",
            ServiceState("ask", SetBool, timeout=5.0),
            {"succeeded": "aborted", "aborted": "WATCH"},
        )
        sm.add(
            "WATCH",
            MonitorState("smoke", Bool, lambda _ud, m: not m.data, timeout=7.0),
            {"valid": "DRIVE", "invalid": "DRIVE", "aborted": "DRIVE"},
        )
        sm.add("DRIVE", SimpleActionState("move_base", MoveBaseAction, exec_timeout=60.0))
    return sm


def test_the_timeouts_of_calls_waits_and_goals_are_told_and_covered(mission):
    coverage = Coverage()
    mission.on_run = coverage.add
    service = mission.service_server("ask", SetBool)
    robot = mission.action_server("move_base", MoveBaseAction)
    service.fail()
    mission.topic("smoke", Bool).publish_at(1.0, {"data": True})
    robot.reply(status="aborted", duration=3)
    assert mission(timed()).timeouts() == ()
    assert coverage.machines[0].counts("timeouts") == (0, 3)
    service.never_answer()
    robot.never_finish()
    run = mission(timed())
    assert run.timeouts() == ("/TIMED/ASK", "/TIMED/WATCH", "/TIMED/DRIVE")
    assert run.timed_out("DRIVE")
    assert coverage.machines[0].counts("timeouts") == (3, 3)


def test_the_timeout_of_each_attempt_is_told_by_itself(mission):
    """Some quick failures counted as one timeout, and that of an attempt before the last as none."""
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    sm.add("DRIVE", SimpleActionState("move_base", MoveBaseAction, exec_timeout=60.0))
    set_options(sm["DRIVE"], retry=(3, 50.0))
    robot = mission.action_server("move_base", MoveBaseAction)
    for _ in range(3):
        robot.reply(status="aborted", duration=25.0)
    run = mission(sm)
    assert run.duration == 25 + 50 + 25 + 100 + 25
    assert run.timeouts() == ()
    robot.never_finish()
    robot.reply()
    run = mission(sm)
    assert (run.outcome, run.timeouts()) == ("succeeded", ("/M/DRIVE",))


def test_a_backoff_is_no_part_of_an_attempt(mission):
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    sm.add("ASK", ServiceState("ask", SetBool, timeout=5.0))
    set_options(sm["ASK"], retry=(4, 3.0))
    service = mission.service_server("ask", SetBool)
    for _ in range(3):
        service.fail(duration=1.0)
    service.never_answer()
    run = mission(sm)
    assert run.duration == 1 + 3 + 1 + 6 + 1 + 12 + 5
    assert run.timeouts() == ("/M/ASK",)


def test_a_double_of_a_sub_machine_is_no_machine_of_its_own_in_the_coverage():
    sm = StateMachine(["done", "failed", "preempted"], name="TWO")
    with sm:
        sm.add("IN", two_waits())
    coverage = Coverage()
    with mission_kit() as mission:
        mission.on_run = coverage.add
        mission(sm)
        mission.replace("IN", outcomes=["failed"])
        mission(sm)
        mission.replace("IN", outcomes=["preempted"])
        mission(sm)
    (machine,) = coverage.machines
    assert machine.runs == 3
    with mission_kit() as mission:
        explored = Coverage()
        mission.on_run = explored.add
        mission.replace("IN", outcomes=["failed"])
        mission.explore(sm).assert_ok()
    assert [m.record for m in explored.machines] == [machine.record]
    assert machine.taken["states"] == {"/TWO": 3, "/TWO/IN": 3, "/TWO/IN/A": 1, "/TWO/IN/B": 1}
    assert machine.missed("states") == []
    assert "/TWO/IN -failed->" in machine.taken["outcomes"]


def test_each_case_of_a_transition_is_covered_by_itself():
    """All of them counted as taken with the first."""

    def quick():
        return CBState(lambda _: "done", outcomes=["done"])

    inner = StateMachine(["done", "low"], name="IN", input_keys=["x"])
    inner.add("A", quick(), {"done": [when("x > 1", "B"), when("x < 0", "low"), "done"]})
    inner.add("B", quick())
    inner.add_cleanup("TIDY", quick())
    sm = StateMachine(["done", "low"], name="M")
    sm.add("IN", inner)
    coverage = Coverage()
    with mission_kit() as mission:
        mission.on_run = coverage.add
        for x, left in (
            (0, ["/M/IN/A -done-> B", "/M/IN/A -done-> low"]),
            (2, ["/M/IN/A -done-> low"]),
            (-1, []),
        ):
            mission(sm, {"x": x})
            (machine,) = coverage.machines
            assert [item for item in machine.missed("edges") if "/A " in item] == left
    assert machine.counts("edges") == (6, 6)
    other = Coverage.from_json(coverage.to_json())
    assert other.machines[0].missed("edges") == []


def test_the_same_seed_gives_the_same_run_to_the_last_event():
    def events(seed):
        with mission_kit(seed=seed) as mission:
            mission.service_server("ask", SetBool).fail()
            mission.action_server("move_base", MoveBaseAction).reply(duration=3, feedback=[{}, {}])
            return [repr(event) for event in mission(timed()).events]

    assert events(5) == events(5)
    assert any("GoalSent" in event for event in events(5))


def test_ctrl_c_during_a_run_is_meant_for_the_test_and_not_only_for_the_run():
    runs = []

    def interrupted(_userdata):
        runs.append(1)
        signal.raise_signal(signal.SIGINT)
        return "done"

    def machine():
        sm = StateMachine(["done", "preempted"], name="M")
        sm.add("WORK", CBState(interrupted, outcomes=["done"]), {"done": "WAIT"})
        sm.add("WAIT", Wait(5.0))
        return sm

    with pytest.raises(KeyboardInterrupt), mission_kit() as mission:
        mission(machine())
    with pytest.raises(KeyboardInterrupt):
        explore(machine, keep=["WORK"], jobs=1)
    assert len(runs) == 2
