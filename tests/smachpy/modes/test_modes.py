"""Modes: events move a robot from mode to mode, one mission at a time, and a stop is never lost."""

from __future__ import annotations

import copy
import signal
import threading
import warnings
from functools import partial
from itertools import accumulate
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import smachpy
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.interfaces.std_srvs.srv import Trigger
from smachpy import Concurrence, Iterator, State, StateMachine
from smachpy.checks import check
from smachpy.modes import Modes, ModesError, Table, on_service, on_signal, on_topic
from smachpy.testing import explore, mission_kit, replay


class Step(State):
    def __init__(self, seconds: float = 1.0) -> None:
        super().__init__(["done", "preempted"])
        self.seconds = seconds

    def execute(self, userdata: Any) -> str:
        return "preempted" if self.sleep(self.seconds) else "done"


class Counting(Step):
    def __init__(self, seconds: float) -> None:
        super().__init__(seconds)
        self.register_io_keys(["index"])

    def execute(self, userdata: Any) -> str:
        outcome = super().execute(userdata)
        if outcome == "done":
            userdata.index += 1
        return outcome


def mission(cleanup: float = 2.0) -> StateMachine:
    sm = StateMachine(["done", "preempted"], userdata={"index": 0})
    sm.add("A", Counting(10.0), {"done": "B"})
    sm.add("B", Counting(10.0))
    sm.add_cleanup("DOCK", Step(cleanup))
    return sm


WAYS = [
    ["start", "idle", "auto"],
    ["joy", "auto", "teleop"],
    ["free", "teleop", "auto"],
    ["low", "*", "charging"],
    ["done", "auto", "idle"],
    ["full", "charging", "idle"],
    ["reset", "estop", "idle"],
]


def robot(resume: bool = False, **options: Any) -> Modes:
    states = [
        "idle",
        {"name": "auto", "mission": mission, "resume": resume},
        "teleop",
        {"name": "charging", "mission": mission},
        "estop",
    ]
    return Modes(states, WAYS, emergency="estop", name="ROBOT", **options)


def run_of(modes: Modes, *events: tuple[float, Any], end: float) -> Any:
    with mission_kit() as kit:
        for at, event in events:
            kit.trigger(event, at=at)
        kit.preempt(at=end)
        return kit(modes)


def leaves(run: Any) -> list[str]:
    return [path.removeprefix("/ROBOT/") for path in run.path]


def test_an_event_starts_a_mission_and_its_end_leads_on():
    run = run_of(robot(), (5.0, "start"), end=40.0)
    assert leaves(run) == ["idle", "auto/A", "auto/B", "auto/DOCK", "idle"]
    assert run.outcome == "preempted"


def test_leaving_a_mode_waits_for_the_clean_up_of_its_mission():
    run = run_of(robot(), (5.0, "start"), (8.0, "joy"), end=40.0)
    assert leaves(run) == ["idle", "auto/A", "auto/DOCK", "teleop"]
    begins = {event.path: event.t for event in run.events if type(event).__name__ == "Entered"}
    start = run.events[0].t
    assert begins["/ROBOT/teleop"] - start == 10.0


def test_a_mission_without_resume_begins_anew():
    run = run_of(robot(), (0.5, "start"), (12.0, "joy"), (20.0, "free"), end=25.0)
    assert leaves(run)[-2:] == ["auto/A", "auto/DOCK"]


def test_a_mission_with_resume_goes_on_where_it_was_with_its_userdata():
    modes = robot(resume=True)
    run = run_of(modes, (0.5, "start"), (12.0, "joy"), (20.0, "free"), end=60.0)
    assert leaves(run) == [
        *("idle", "auto/A", "auto/B", "auto/DOCK", "teleop"),
        *("auto/B", "auto/DOCK", "idle"),
    ]
    assert modes["auto"].userdata["index"] == 2


def test_after_its_end_a_resumed_mission_begins_anew():
    modes = robot(resume=True)
    events = [(0.5, "start"), (12.0, "joy"), (20.0, "free"), (40.0, "start")]
    run = run_of(modes, *events, end=80.0)
    assert leaves(run)[-4:] == ["auto/A", "auto/B", "auto/DOCK", "idle"]
    assert modes["auto"].userdata["index"] == 2


def test_an_event_that_means_nothing_changes_nothing():
    heard = []
    modes = robot()
    run = run_of(modes, (1.0, lambda m: heard.append(m.trigger("joy"))), end=5.0)
    assert heard == [False]
    assert leaves(run) == ["idle"]
    assert not modes.trigger("start")


def test_an_event_that_no_way_has_is_an_error():
    """It said nothing, and a test with a misspelt event passed."""
    expected = "trigger: event: got 'strat'.*Did you mean 'start'"
    with pytest.raises(ModesError, match=expected):
        robot().trigger("strat")
    with pytest.raises(AssertionError, match=expected):
        run_of(robot(), (1.0, "strat"), end=5.0)


def test_the_last_of_several_events_counts():
    run = run_of(robot(), (1.0, "start"), (2.0, "joy"), (2.5, "free"), (3.0, "low"), end=60.0)
    assert leaves(run)[:4] == ["idle", "auto/A", "auto/DOCK", "charging/A"]


def test_the_mode_is_that_of_the_last_event():
    modes = robot()
    seen = []
    note = lambda m: seen.append(m.mode)  # noqa: E731
    run_of(modes, (1.0, "start"), (1.1, note), (2.0, "joy"), (2.1, note), end=9.0)
    assert seen == ["auto", "teleop"]


def test_an_exception_of_a_mission_does_not_end_the_modes():
    @smachpy.state(["done"])
    def broken(userdata):
        raise OSError("no motor")

    def made():
        sm = StateMachine(["done"])
        sm.add("A", broken)
        return sm

    modes = Modes(
        ["idle", {"name": "auto", "mission": made}, "fault"],
        [["start", "idle", "auto"], ["error", "auto", "fault"]],
        name="ROBOT",
    )
    assert leaves(run_of(modes, (1.0, "start"), end=5.0)) == ["idle", "auto/A", "fault"]


@pytest.mark.parametrize("own", [ValueError, Exception])
def test_on_exception_of_a_mission_counts_before_the_event_error(own):
    """A mission that had `on_exception` for other errors ended all modes."""

    def raising(error):
        @smachpy.state(["done"])
        def broken(userdata):
            raise error("no motor")

        sm = StateMachine(["done", "handled"], on_exception={own: "handled"})
        sm.add("A", broken)
        return sm

    for error in (ValueError, KeyError):
        modes = Modes(
            ["idle", {"name": "auto", "mission": partial(raising, error)}, "fault", "calm"],
            [["start", "idle", "auto"], ["error", "auto", "fault"], ["handled", "auto", "calm"]],
            name="ROBOT",
        )
        expected = "calm" if issubclass(error, own) else "fault"
        assert leaves(run_of(modes, (1.0, "start"), end=5.0)) == ["idle", "auto/A", expected]


@pytest.mark.parametrize("level", ["high", None])
def test_a_condition_that_cannot_be_evaluated_does_not_hold(level):
    """It ended all modes."""
    ways = [
        {"trigger": "go", "source": "a", "dest": "b", "when": "level > 3"},
        ["next", "a", "m"],
        {"trigger": "done", "source": "m", "dest": "b", "when": "level > 3"},
        ["done", "m", "c"],
    ]
    states = ["a", "b", "c", {"name": "m", "mission": mission}]
    modes = Modes(states, ways, userdata={"level": level}, name="ROBOT")
    run = run_of(modes, (1.0, "go"), (2.0, "go"), (3.0, "next"), end=60.0)
    assert leaves(run) == ["a", "m/A", "m/B", "m/DOCK", "c"]


def test_conditions_of_ways_read_the_userdata():
    ways = [
        {"trigger": "go", "source": "a", "dest": "b", "when": "level > 3"},
        {"trigger": "go", "source": "a", "dest": "c"},
    ]
    for level, expected in [(5, "b"), (1, "c")]:
        modes = Modes(["a", "b", "c"], ways, userdata={"level": level}, name="ROBOT")
        assert leaves(run_of(modes, (1.0, "go"), end=2.0)) == ["a", expected]


def test_conditions_count_for_the_end_of_a_mission_too():
    ways = [
        ["start", "idle", "auto"],
        ["done", "auto", "charging", "battery < 0.3"],
        ["done", "auto", "teleop"],
    ]
    states = ["idle", {"name": "auto", "mission": mission}, "charging", "teleop"]
    for battery, after in ((0.2, "charging"), (0.9, "teleop"), (None, "teleop")):
        userdata = {} if battery is None else {"battery": battery}
        modes = Modes(states, ways, userdata=userdata, name="ROBOT")
        assert leaves(run_of(modes, (1.0, "start"), end=60.0))[-1] == after


def test_modes_in_modes_share_the_ways_of_those_around_them():
    states = ["idle", {"name": "manual", "children": ["slow", "fast"], "initial": "slow"}]
    ways = [
        ["take", "idle", "manual"],
        ["faster", "manual_slow", "manual_fast"],
        ["leave", "manual", "idle"],
        ["leave", "manual_fast", "manual_slow"],
    ]
    modes = Modes(states, ways, name="ROBOT")
    events = [(1.0, "take"), (2.0, "faster"), (3.0, "leave"), (4.0, "leave")]
    run = run_of(modes, *events, end=5.0)
    assert leaves(run) == ["idle", "manual_slow", "manual_fast", "manual_slow", "idle"]


# -- the emergency stop ------------------------------------------------------------------------


def stop(modes: Modes) -> None:
    modes.emergency_stop("button")


def entered_after(run: Any, seconds: float, until: float) -> list[str]:
    start = run.events[0].t
    return [
        event.path
        for event in run.events
        if type(event).__name__ == "Entered" and seconds < event.t - start < until
    ]


def test_an_emergency_stop_stops_at_once_and_holds_everything_until_its_release():
    modes = robot()
    seen = []
    events = [
        (1.0, "start"),
        (4.0, stop),
        (5.0, "joy"),
        (6.0, lambda m: seen.append(m.mode)),
        (30.0, "reset"),
    ]
    run = run_of(modes, *events, end=60.0)
    assert seen == ["estop"]
    assert entered_after(run, 4.0, 30.0) == []
    assert leaves(run) == ["idle", "auto/A", "auto/DOCK", "idle"]
    left = [e.t - run.events[0].t for e in run.events if type(e).__name__ == "Left"]
    assert 4.0 in left


def test_it_stops_a_clean_up_too_which_begins_again_after_the_release():
    events = [(1.0, "start"), (4.0, "joy"), (5.0, stop), (30.0, "reset")]
    run = run_of(robot(), *events, end=60.0)
    assert entered_after(run, 5.0, 30.0) == []
    assert leaves(run) == ["idle", "auto/A", "auto/DOCK", "auto/DOCK", "idle"]


def test_what_was_stopped_can_go_on():
    events = [(1.0, "start"), (4.0, stop), (30.0, lambda m: m.release())]
    run = run_of(robot(), *events, end=90.0)
    assert leaves(run) == ["idle", "auto/A", "auto/A", "auto/B", "auto/DOCK", "idle"]


def test_it_holds_also_before_the_run():
    modes = robot()
    modes.emergency_stop()
    run = run_of(modes, (5.0, "start"), (10.0, "reset"), (11.0, "start"), end=20.0)
    assert entered_after(run, -1.0, 9.9) == []
    assert "auto/A" in leaves(run)


def test_it_ends_with_the_run_and_with_the_pause_that_it_is():
    modes = robot()
    run_of(modes, (1.0, "start"), (4.0, stop), end=10.0)
    assert modes.mode == "idle"
    run = run_of(
        modes,
        *[(1.0, "start"), (4.0, stop), (5.0, lambda m: m.control.resume()), (6.0, "joy")],
        *[
            (10.0, lambda m: m.control.pause()),
            (11.0, "free"),
            (12.0, lambda m: m.control.resume()),
        ],
        end=20.0,
    )
    assert leaves(run) == ["idle", "auto/A", "auto/A", "auto/DOCK", "teleop", "auto/A", "auto/DOCK"]


def test_a_second_stop_is_not_released_with_the_first():
    modes = robot()
    first = []

    def between(m: Modes) -> None:
        held = m.control.emergency()
        m.emergency_stop("second")
        m.control.end_emergency(held)
        first.append(m.mode)

    run = run_of(modes, (1.0, "start"), (4.0, stop), (5.0, between), (20.0, "reset"), end=60.0)
    assert first == ["estop"]
    assert entered_after(run, 4.0, 20.0) == []
    assert leaves(run)[-1] == "idle"


def test_what_one_run_wanted_does_not_reach_the_next():
    modes = robot(resume=True)
    run_of(modes, (1.0, "start"), (13.0, "joy"), (14.0, "low"), end=14.5)
    run = run_of(modes, (1.0, "start"), end=5.0)
    assert leaves(run)[:2] == ["idle", "auto/A"]


def test_it_is_told_to_all_leaves_before_it_returns():
    both = Concurrence(["done", "preempted"], "done")
    told = []

    class Deaf(State):
        def __init__(self, name: str) -> None:
            super().__init__(["done", "preempted"])
            self.name = name

        def execute(self, userdata: Any) -> str:
            self.on_preempt(lambda: None)
            self.wait_preempt()
            return "preempted"

    both.add("A", Deaf("a"))
    both.add("B", Deaf("b"))
    modes = Modes([{"name": "auto", "mission": both}, "estop"], [], emergency="estop")

    def act(m: Modes) -> None:
        m.emergency_stop()
        told.extend(state.preempt_requested() for state in both.get_children().values())

    run_of(modes, (1.0, act), end=30.0)
    assert told == [True, True]


# -- sources -----------------------------------------------------------------------------------


def test_a_topic_triggers_when_its_condition_begins_to_hold():
    listen = [on_topic("battery", BatteryState, "low", "percentage < 0.2")]
    modes = robot(listen=listen)
    with mission_kit() as kit:
        battery = kit.topic("battery", BatteryState)
        for at, level in [(1.0, 0.5), (2.0, 0.1), (3.0, 0.1)]:
            battery.publish_at(at, BatteryState(percentage=level))
        kit.preempt(at=6.0)
        run = kit(modes)
    assert leaves(run)[:2] == ["idle", "charging/A"]
    assert run.visits("charging") == 1


@pytest.mark.parametrize("begins", [0.5, 9.0], ids=["in another mode", "where it is taken"])
def test_a_condition_triggers_once_where_its_event_means_something(begins):
    """One that began to hold in a mode without the event was used up."""
    ways = [["take", "idle", "manual"], ["low", "idle", "charging"], ["back", "*", "idle"]]
    listen = [on_topic("battery", BatteryState, "low", "percentage < 0.2")]
    modes = Modes(["idle", "manual", "charging"], ways, listen=listen, name="ROBOT")
    with mission_kit() as kit:
        battery = kit.topic("battery", BatteryState)
        for at in range(1, 30):
            battery.publish_at(at, BatteryState(percentage=0.1 if at > begins else 0.5))
        for at, event in [(0.5, "take"), (5.5, "back"), (15.5, "back")]:
            kit.trigger(event, at=at)
        kit.preempt(at=30.0)
        run = kit(modes)
    assert leaves(run) == ["idle", "manual", "idle", "charging", "idle"]


def test_a_condition_of_a_topic_that_cannot_be_evaluated_is_told_once(caplog):
    """Each message wrote an error with its whole stack."""
    listen = [on_topic("battery", BatteryState, "low", "percentage < location")]
    with mission_kit() as kit:
        battery = kit.topic("battery", BatteryState)
        for at in range(1, 9):
            battery.publish_at(at, BatteryState(percentage=0.1, location="hall"))
        kit.preempt(at=9.0)
        run = kit(robot(listen=listen))
    assert leaves(run) == ["idle"]
    (text,) = [text for text in caplog.messages if "the condition of topic 'battery'" in text]
    assert "not supported between instances of 'float' and 'str'" in text


def test_a_service_triggers_and_says_whether_it_meant_something():
    modes = robot(listen=[on_service("start", "start"), on_service("joy", "joy")])
    answers = []

    def call(_modes: Modes) -> None:
        def ask() -> None:
            from actionlib_core.pubsub.service_proxy import ServiceProxy

            for name in ("joy", "start"):
                proxy = ServiceProxy(name, Trigger, node=kit.node)
                proxy.wait_for_service(2.0)
                answers.append(proxy().success)

        kit.clock.spawn(ask, name="caller")

    with mission_kit() as kit:
        kit.trigger(call, at=1.0)
        kit.preempt(at=8.0)
        run = kit(modes)
    assert answers == [False, True]
    assert "auto/A" in leaves(run)


def test_a_signal_triggers():
    modes = robot(listen=[on_signal(signal.SIGUSR1, "start")])
    handler = signal.getsignal(signal.SIGUSR1)

    def act(event: Any) -> None:
        if type(event).__name__ == "Entered":
            if event.path == "/ROBOT/idle":
                signal.raise_signal(signal.SIGUSR1)
            elif event.path == "/ROBOT/auto/A":
                threading.Thread(target=modes.request_preempt).start()

    modes.subscribe(act)
    assert modes.execute() == "preempted"
    assert signal.getsignal(signal.SIGUSR1) is handler


# -- structure ---------------------------------------------------------------------------------


def test_it_is_described_drawn_and_checked():
    modes = robot()
    edges = {
        (edge.source, edge.outcome, edge.target) for edge in smachpy.describe(modes).transitions
    }
    assert {
        ("idle", "start", "auto"),
        ("auto", "joy", "teleop"),
        ("auto", "low", "charging"),
    } <= edges
    assert "teleop" in modes._repr_svg_()
    assert [p.rule for p in check(modes).problems if p.severity == "error"] == []


def test_a_mode_that_no_event_reaches_is_found():
    modes = Modes(["a", "b", "c"], [["go", "a", "b"], ["go", "b", "a"]], name="ROBOT")
    assert [
        p.rule for p in check(modes).problems if p.path == "/ROBOT/c" and p.severity == "error"
    ] == ["unreachable-state"]


def test_exploration_tries_orders_of_events():
    paths = set()

    def note(run: Any) -> None:
        paths.update(run.path)

    modes = [["go", "a", "b"], ["back", "b", "a"], ["on", "b", "c"]]
    explore(
        lambda: Modes(["a", "b", "c"], modes, name="R"), invariants=[note], max_runs=50, max_depth=6
    )
    assert paths == {"/R/a", "/R/b", "/R/c"}


def small(resume=True):
    return Modes(
        ["idle", {"name": "auto", "mission": mission, "resume": resume}, "teleop", "estop"],
        [
            ["start", "idle", "auto"],
            ["joy", ["idle", "auto"], "teleop"],
            ["free", "teleop", "auto"],
            ["reset", "estop", "idle"],
            ["done", "auto", "idle"],
        ],
        emergency="estop",
        name="ROBOT",
    )


@pytest.mark.slow
def test_exploration_tries_orders_of_events_while_missions_run():
    orders = set()

    def note(run: Any) -> None:
        orders.add(tuple(leaves(run)))

    found = explore(small, on_run=note, jobs=1, max_runs=5000, events=2)
    assert found.exhaustive, str(found)
    found.assert_ok()
    assert ("idle", "auto/A", "auto/DOCK", "teleop") in orders  # as it drives
    assert ("idle", "auto/A", "auto/B", "auto/DOCK", "teleop") in orders  # as it cleans up
    stopped = ("idle", "auto/A", "auto/DOCK", "idle")  # by an emergency stop, and its release
    assert stopped in orders


@pytest.mark.slow
def test_exploration_finds_an_order_of_events_that_breaks_an_invariant():
    def never_left_in_b(run: Any) -> bool:
        return not any(
            type(e).__name__ == "Left" and e.path == "/ROBOT/auto/B" and e.outcome == "preempted"
            for e in run.events
        )

    found = explore(small, invariants=[never_left_in_b], jobs=1, preempts=0, max_runs=2000)
    assert found.counterexample is not None
    at_b = [one for one in found.counterexample.choices if one.startswith("/ROBOT/auto/B: ")]
    assert set(at_b) & {"/ROBOT/auto/B: event joy", "/ROBOT/auto/B: emergency stop, then reset"}
    run = replay(small, found.counterexample.choices, preempts=0)
    assert not never_left_in_b(run)


def test_exploration_tries_each_way_of_an_event_and_ends_without_events():
    ways = [["go", "a", "b", "level > 3"], ["go", "a", "c"]]
    ends = set()

    def note(run: Any) -> None:
        ends.add(tuple(leaves(run)))

    modes = partial(Modes, ["a", "b", "c"], ways, userdata={"level": 1}, name="ROBOT")
    found = explore(modes, on_run=note, jobs=1)
    assert found.exhaustive, str(found)
    assert found.ok, str(found)
    assert ends == {("a",), ("a", "b"), ("a", "c")}


def test_all_problems_of_a_table_come_at_once():
    with pytest.raises(ModesError) as caught:
        Table(
            ["idle", "idle", {"name": "x", "misson": 1}, 3],
            [
                ["go", "idle", "auot"],
                ["a"],
                {"trigger": "b", "source": "idle", "dest": "x", "when": "("},
            ],
            "none",
        )
    assert len(caught.value.problems) == 7
    assert "Did you mean 'mission'?" in str(caught.value)


def test_a_machine_of_transitions_can_be_given():
    from transitions import Machine

    machine = Machine(
        states=["idle", "auto"], transitions=[["start", "idle", "auto"]], initial="idle"
    )
    modes = Modes.from_machine(machine, {"auto": mission}, name="ROBOT")
    assert leaves(run_of(modes, (1.0, "start"), end=5.0))[:2] == ["idle", "auto/A"]
    with pytest.raises(ModesError, match="missions"):
        Modes.from_machine(machine, {"aut": mission})


def test_an_internal_transition_of_transitions_begins_no_mission_anew():
    from transitions import Machine

    rows = [["start", "idle", "auto"], ["tick", "idle", "auto"], ["tick", "auto", None]]
    machine = Machine(states=["idle", "auto"], transitions=rows, initial="idle")
    modes = Modes.from_machine(machine, {"auto": mission}, name="ROBOT")
    run = run_of(modes, (1.0, "start"), (2.0, "tick"), end=5.0)
    assert leaves(run).count("auto/A") == 1


@pytest.mark.parametrize("separator", ["_", "."])
def test_a_nested_machine_of_transitions_can_be_given(separator):
    from transitions.extensions import HierarchicalMachine
    from transitions.extensions.nesting import NestedState

    class Separated(NestedState):
        pass

    class Nested(HierarchicalMachine):
        state_cls = Separated

    Separated.separator = separator
    states = ["idle", {"name": "manual", "children": ["slow", "fast"], "initial": "slow"}]
    ways = [
        ["take", "idle", "manual"],
        ["faster", f"manual{separator}slow", f"manual{separator}fast"],
        ["leave", "manual", "idle"],
    ]
    machine = Nested(states=states, transitions=ways, initial="idle")
    modes = Modes.from_machine(machine, {"manual_fast": mission}, name="ROBOT")
    run = run_of(modes, (1.0, "take"), (2.0, "faster"), (5.0, "leave"), end=20.0)
    assert leaves(run) == ["idle", "manual_slow", "manual_fast/A", "manual_fast/DOCK", "idle"]
    assert {event for _, event in modes._Modes__table.ways} == {"take", "faster", "leave"}
    with pytest.raises(ModesError, match="'manual_slow', 'manual_fast'"):
        Modes.from_machine(machine, {"manual_quick": mission})


def test_a_way_after_one_without_a_condition_is_refused():
    """It could never be taken."""
    states = ["a", "b", {"name": "m", "children": ["x", "y"]}]
    with pytest.raises(ModesError, match="'go': got ways from 'a' to 'b' and to 'm_x'; expected"):
        Table(states, [["go", "a", "b"], ["go", ["b", "a"], "m"]])
    with pytest.raises(ModesError, match="a condition for the first"):
        Table(states, [["go", "a", "b"], ["go", "a", "m", "ready"]])
    Table(
        states,
        [
            ["go", "a", "b", "ready"],
            ["go", "a", "m"],
            ["go", "*", "b"],  # for all others
            ["go", "a", "m_x"],  # says the same again
            ["back", "m", "a"],
            ["back", "m_x", "b"],  # of the inner mode, which comes first
        ],
    )


def test_a_way_is_not_for_a_mode_whose_name_only_begins_with_that_of_its_source():
    ways = [["stop", "auto", "idle"]]
    table = Table(["auto", "auto_return", {"name": "manual", "children": ["slow"]}, "idle"], ways)
    assert set(table.ways) == {("auto", "stop")}


@pytest.mark.parametrize(
    ("states", "rows", "problem"),
    [
        (["a"], [["x", "a", "*"]], "got mode '\\*'"),
        (["a"], [["x", 3, "a"]], "transition 'x': source: got 3"),
        (["a"], [["x", ["a", 3], "a"]], "transition 'x': source: got"),
        ([{"name": "a", "children": [3]}], [], "states: got 3"),
        ([{"name": "a", "children": "bc"}], [], "a: children: got 'bc'"),
        ("idle", [], "states: got 'idle'; expected a list"),
        (None, 5, "states: got None; expected a list. transitions: got 5"),
        (["a"], [["", "a", "a"]], "transitions: got {'trigger': ''"),
        (["a"], [["preempted", "a", "a"]], "got what a request to stop gives; expected another"),
        (["a"], [["x", "a", "a", 5]], "transition 'x': when: got 5; expected an expression"),
        ([{"name": "a", "resume": "yes"}], [], "a: resume: got 'yes'; expected True or False"),
        ([{"name": "a", "mission": lambda: 1 // 0}], [], "a: mission: got .* which raised"),
    ],
)
def test_what_no_table_can_hold_is_refused(states, rows, problem):
    with pytest.raises(ModesError, match=problem):
        Modes(states, rows)


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: 5, "listen: got 5"),
        (lambda: on_service("s", "strat"), "listen: event: got 'strat'; .* Did you mean 'start'"),
        (lambda: on_signal(signal.SIGKILL, "start"), "on_signal: got <Signals.SIGKILL: 9>"),
        (lambda: on_signal("USR1", "start"), "on_signal: got 'USR1'; expected a signal"),
        (lambda: on_topic("t", "std_msgs/Bool", "start"), "msg_type: got 'std_msgs/Bool'"),
    ],
)
def test_what_is_no_source_of_an_event_is_refused(make, problem):
    with pytest.raises(ModesError, match=problem):
        Modes(["a", "b"], [["start", "a", "b"]], listen=[make()])


def test_a_signal_of_two_events_is_refused():
    """The first one was never triggered."""
    listen = [on_signal(signal.SIGUSR1, "start"), on_signal(signal.SIGUSR1, "stop")]
    with pytest.raises(ModesError, match=r"listen: got SIGUSR1 for 'start' and for 'stop'; expect"):
        Modes(["a", "b"], [["start", "a", "b"], ["stop", "b", "a"]], listen=listen)


def test_a_misspelt_field_in_the_condition_of_a_topic_is_refused():
    """It was an error in each message's callback."""
    with pytest.raises(ModesError, match=r"on_topic: when: field: got 'percentge'.*'percentage'"):
        on_topic("battery", BatteryState, "low", "percentge < 0.2")
    on_topic("battery", BatteryState, "low", "m.percentage < 0.2")


def test_what_is_no_machine_of_transitions_is_refused():
    with pytest.raises(ModesError, match="machine: got 5; expected one of the package"):
        Modes.from_machine(5)


# -- random modes, random missions -------------------------------------------------------------

EVENTS = st.sampled_from(["start", "joy", "free", "low", "full", "reset", "stop", "go on"])
TIMES = st.lists(st.tuples(st.floats(0.01, 60.0), EVENTS), max_size=12)


# The same mode again, and another event as that one's clean-up ends.
@example([(1.0, "start"), (2.0, "low"), (22.0, "low"), (25.0, "full")], False, 3.0)
@example([(1.0, "stop"), (1.0, "low")], False, 0.5)
@example([(1.0, "start"), (22.0, "joy")], False, 20.0)
@settings(max_examples=60, deadline=None)
@given(TIMES, st.booleans(), st.sampled_from([0.5, 3.0, 20.0]))
def test_one_mission_at_a_time_one_clean_up_each_and_no_stop_is_lost(events, resume, cleanup):
    modes = Modes(
        [
            "idle",
            {"name": "auto", "mission": lambda: mission(cleanup), "resume": resume},
            "teleop",
            {"name": "charging", "mission": lambda: mission(cleanup)},
            "estop",
        ],
        WAYS,
        emergency="estop",
        name="ROBOT",
    )
    special = {"stop": stop, "go on": lambda m: m.release()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        acts = [(at, special.get(event, event)) for at, event in events]
        run = run_of(modes, *acts, end=200.0)
    active: list[str] = []  # modes with a mission that run
    cleaned = 0
    for event in run.events:
        kind, parts = type(event).__name__, event.path.split("/")
        mode = parts[2] if len(parts) > 2 else ""
        if mode not in {"auto", "charging"}:
            continue
        if kind == "Entered" and len(parts) == 3:
            assert active == []
            active, cleaned = [mode], 0
        elif kind == "Entered":
            assert active == [mode]
        elif kind == "Left" and parts[3:] == ["DOCK"] and event.outcome == "done":
            cleaned += 1
        elif kind == "Left" and len(parts) == 3:
            assert cleaned == 1 or run.events[-1].t - event.t < 60.0
            active = []
    start = run.events[0].t
    stops = [at for at, event in events if event == "stop"]
    for at in stops:
        releases = [t for t, event in events if event in {"reset", "go on"} and t >= at]
        assert entered_after(run, at, min([*releases, 200.0])) == []
    assert start <= run.events[-1].t


GAPS = st.lists(st.tuples(st.sampled_from([0.0, 0.5, 1.0, 7.0]), EVENTS), max_size=10)
MODES = st.sampled_from(["idle", "auto", "teleop", "charging", "estop"])
MORE_WAYS = st.dictionaries(
    st.tuples(st.sampled_from(["start", "joy", "free", "full", "reset", "done", "error"]), MODES),
    MODES,
    max_size=6,
)
LEAVES = st.one_of(st.sampled_from([0.0, 1.0, 7.0]), st.just("raises"))
MISSIONS = st.recursive(
    LEAVES,
    lambda parts: st.tuples(
        st.sampled_from(["machine", "concurrence", "iterator"]),
        st.lists(parts, min_size=1, max_size=2),
        st.booleans(),
    ),
    max_leaves=5,
)


@smachpy.state(["done", "preempted"])
def raises(userdata: Any) -> str:
    raise OSError("no motor")


def made(part: Any) -> State:
    """Build a random mission: a leaf, or a container of parts, maybe with a clean-up."""
    if not isinstance(part, tuple):
        return copy.copy(raises) if part == "raises" else Step(part)
    kind, parts, cleans = part
    container: Any
    if kind == "iterator":
        container = Iterator(
            ["done", "preempted"], [], [], [1, 2][: len(parts)], exhausted_outcome="done"
        )
        container.set_contained_state("EACH", made(parts[0]), loop_outcomes=["done"])
    elif kind == "concurrence":
        container = Concurrence(["done", "preempted"], "done")
    else:
        container = StateMachine(["done", "preempted"])
    for number, inner in enumerate(parts if kind != "iterator" else ()):
        after = {"done": f"P{number + 1}"} if number + 1 < len(parts) else {}
        words = (after,) if kind == "machine" else ()
        container.add(f"P{number}", made(inner), *words)
    if cleans:
        container.add_cleanup("CLEAN", Step(1.0))
    return container


@pytest.mark.slow
@example([(1.0, "stop"), (1.0, "low"), (1.0, "joy")], 7.0, 1.0, False, {})  # a stop is left by none
@example(  # a stop of the clean-ups, which begin again
    [(1.0, "joy"), (0.5, "stop"), (1.0, "go on"), (0.5, "low")],
    ("machine", [("concurrence", [7.0, ("machine", [7.0], True)], True)], True),
    1.0,
    True,
    {},
)
@example(  # a stop of a clean-up that had been asked to hurry, for longer than its grace
    [(0.5, "stop")],
    ("concurrence", ["raises", ("machine", [0.0], True)], False),
    0.0,
    False,
    {},
)
@settings(max_examples=60, deadline=None)
@given(GAPS, MISSIONS, MISSIONS, st.booleans(), MORE_WAYS)
def test_random_modes_run_one_mission_at_a_time_clean_up_once_and_stop(
    gaps, auto, charge, resume, more
):
    times = accumulate([1.0, *(gap for gap, _ in gaps)])
    events = [*zip(times, ["start", *(event for _, event in gaps)], strict=True)]

    known = {(event, source) for event, source, _ in WAYS}
    ways = [*WAYS, *([*way, target] for way, target in more.items() if way not in known)]
    free = {"go on", *(event for event, source, _ in ways if source == "estop")}

    def mission_of(part: Any) -> Any:
        return lambda: made(("machine", [part], True))

    modes = Modes(
        [
            "idle",
            {"name": "auto", "mission": mission_of(auto), "resume": resume},
            "teleop",
            {"name": "charging", "mission": mission_of(charge)},
            "estop",
        ],
        ways,
        emergency="estop",
        name="ROBOT",
    )
    special = {"stop": stop, "go on": lambda m: m.release()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = run_of(modes, *[(at, special.get(event, event)) for at, event in events], end=300.0)
    assert run.outcome == "preempted"
    cleans = {path.rpartition("/")[0] for path in _cleanups(modes)}
    active: list[str] = []
    begun: dict[str, list[int]] = {}  # containers that run: children that began, clean-ups done
    for event in run.events:
        kind, path = type(event).__name__, event.path
        around = path.rpartition("/")[0]
        if kind == "Entered":
            if path.count("/") == 2:
                assert active == [], f"{path} begins beside {active}"
                active = [path]
            begun[path] = [0, 0]
            if around in begun:
                begun[around][0] += 1
        elif kind in {"Left", "Failed"} and path != "/ROBOT":
            if path.count("/") == 2:
                active = []
            if path.endswith("/CLEAN") and event.outcome == "done":
                begun[around][1] += 1
            children, cleaned = begun.pop(path)
            if path in cleans:
                assert cleaned == bool(children), f"{path}: cleaned up {cleaned} times"
    for at in [at for at, event in events if event == "stop"]:
        releases = [t for t, event in events if event in free and t >= at]
        assert entered_after(run, at, min([*releases, 300.0])) == []


def _cleanups(modes: Modes) -> list[str]:
    paths = [state.path for state in smachpy.describe(modes).walk()]
    return [path for path in paths if path.endswith("/CLEAN")]


# -- what the page says, one by one ------------------------------------------------------------


def test_an_event_that_leads_to_the_present_mode_begins_its_mission_anew():
    states = ["idle", {"name": "auto", "mission": mission, "resume": True}]
    ways = [["start", "idle", "auto"], ["again", "auto", "auto"]]
    modes = Modes(states, ways, name="ROBOT")
    run = run_of(modes, (1.0, "start"), (13.0, "again"), end=16.0)
    assert leaves(run) == ["idle", "auto/A", "auto/B", "auto/DOCK", "auto/A", "auto/DOCK"]


@pytest.mark.parametrize("how", ["operator", "itself"])
def test_the_first_mode_follows_a_mission_that_ends_preempted_alone(how):
    class Gives(State):
        def execute(self, userdata: Any) -> str:
            return "preempted"

    def made() -> StateMachine:
        sm = StateMachine(["done", "preempted"])
        sm.add("A", Step(60.0) if how == "operator" else Gives(["preempted"]))
        return sm

    states = ["idle", {"name": "auto", "mission": made}]
    modes = Modes(states, [["start", "idle", "auto"]], name="ROBOT")
    events: list[tuple[float, Any]] = [(1.0, "start")]
    if how == "operator":
        events.append((5.0, lambda m: m.control.preempt("/ROBOT/auto")))
    assert leaves(run_of(modes, *events, end=20.0)) == ["idle", "auto/A", "idle"]


def test_callbacks_are_called_as_those_of_any_machine():
    modes, heard = robot(), list[Any]()
    modes.register_start_cb(lambda userdata, labels: heard.append(("start", labels)))
    modes.register_transition_cb(lambda userdata, labels: heard.append("transition"))
    modes.register_termination_cb(lambda userdata, labels, outcome: heard.append(outcome))
    run_of(modes, (1.0, "start"), (5.0, "joy"), end=10.0)
    assert heard == [("start", ["idle"]), "transition", "transition", "preempted"]


def test_of_two_events_while_a_mission_cleans_up_the_last_one_is_seen():
    run = run_of(robot(), (1.0, "start"), (5.0, "joy"), (6.0, "low"), end=8.0)
    assert leaves(run)[-3:] == ["auto/DOCK", "charging/A", "charging/DOCK"]
    jumps = [event for event in run.events if type(event).__name__ == "Jumped"]
    assert [jump.label for jump in jumps] == ["auto", "charging"]


def test_what_one_run_has_left_deep_inside_does_not_reach_the_next():
    def made() -> StateMachine:
        sm = StateMachine(["done", "preempted"])
        sm.add("IN", mission())
        return sm

    states = ["idle", {"name": "auto", "mission": made, "resume": True}, "teleop"]
    modes = Modes(states, WAYS[:3], name="ROBOT")
    run = run_of(modes, (1.0, "start"), (13.0, "joy"), end=20.0)
    assert leaves(run)[-3:] == ["auto/IN/B", "auto/IN/DOCK", "teleop"]
    run = run_of(modes, (1.0, "start"), end=5.0)
    assert leaves(run)[:2] == ["idle", "auto/IN/A"]
