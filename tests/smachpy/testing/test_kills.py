"""Explored runs whose process is killed at the writes of its journal."""

from __future__ import annotations

from collections import Counter
from itertools import count

import pytest

from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from smachpy import CBState, Concurrence, Iterator, SimpleActionState, State, StateMachine
from smachpy.testing import explore, replay

ENDS = ["succeeded", "aborted", "preempted"]


def nothing(_ud):
    return "ok"


def leaf(**options):
    return CBState(nothing, outcomes=["ok", "bad"], **options)


def everything():
    """Each container, a retry and a timeout."""
    root = StateMachine(["ok", "bad", "preempted"], name="ALL")
    with root:
        root.add("FIRST", leaf(retry=(2, 0.5, ["bad"])), {"ok": "BOTH", "bad": "bad"})
        both = Concurrence(["ok", "bad"], "bad", outcome_map={"ok": {"A": "ok", "B": "ok"}})
        both.add("A", leaf(timeout=3.0, timeout_outcome="bad"))
        both.add("B", leaf())
        root.add("BOTH", both, {"ok": "EACH", "bad": "bad"})
        each = Iterator(["ok", "bad"], [], [], it=range(2), exhausted_outcome="ok")
        each.set_contained_state("ONE", leaf(), loop_outcomes=["ok"])
        root.add("EACH", each)
    return root


@pytest.mark.parametrize("machine", [everything, everything()], ids=["function", "machine"])
def test_a_machine_that_keeps_all_in_its_journal_goes_on_from_each_write(machine):
    found = explore(machine, faults=["kill"], max_runs=300)
    found.assert_ok()
    assert found.runs == 300 or found.exhaustive


def test_a_small_one_is_killed_at_each_write_twice():
    def one():
        root = StateMachine(["ok", "bad"], name="ONE")
        root.add("A", leaf())
        return root

    found = explore(one, faults=["kill"], preempts=0)
    found.assert_ok()
    assert found.exhaustive
    # Two outcomes; Started, Entered, Left and Finished, killed before and after each but the last;
    # what is the same in both runs once.
    assert found.runs > len(["ok", "bad"]) + 7


class Forgets(State):
    """Counts its executions where no journal looks."""

    def __init__(self):
        super().__init__(["ok", "again"])
        self.number = 0

    def execute(self, _userdata):
        self.number += 1
        return "ok" if self.number > 1 else "again"


def forgetful():
    root = StateMachine(["ok"], name="FORGETFUL")
    root.add("COUNT", Forgets(), {"ok": "ok", "again": "COUNT"})
    return root


def test_a_state_of_a_process_is_interrupted_as_one_of_the_test(capsys):
    """The thread that called the timer was interrupted in its stead."""
    root = StateMachine(["ok", "bad", "preempted"], name="ONE")
    root.add("A", leaf())
    deaf, both = explore(root, faults=["deaf"]), explore(root, faults=["deaf", "kill"])
    assert both.counterexample.reason == deaf.counterexample.reason
    assert "Exception in thread" not in capsys.readouterr().err


def test_what_a_state_keeps_in_attributes_is_found_missing_and_repeated():
    found = explore(forgetful, faults=["kill"], keep=["COUNT"], preempts=0)
    assert found.stopped_by == "counterexample"
    example = found.counterexample
    assert "COUNT: again" in example.reason
    assert example.choices[-1].startswith("killed after write")
    run = replay(forgetful, example.choices, faults=["kill"], keep=["COUNT"], preempts=0)
    assert run.outcome == "ok"


def test_userdata_that_differs_is_found():
    numbers = count()

    def draws():
        def draw(ud):
            ud.number = next(numbers)
            return "ok"

        root = StateMachine(["ok"], name="DRAWS")
        root.add("DRAW", CBState(draw, outcomes=["ok"], output_keys=["number"]))
        return root

    found = explore(draws, faults=["kill"], keep=["DRAW"], preempts=0)
    assert "userdata: /DRAWS" in found.counterexample.reason


def test_a_value_that_cannot_be_kept_is_found():
    def opens():
        def connect(ud):
            ud.socket = object()
            return "ok"

        root = StateMachine(["ok"], name="OPENS")
        root.add("OPEN", CBState(connect, outcomes=["ok"], output_keys=["socket"]))
        return root

    found = explore(opens, faults=["kill"], keep=["OPEN"], preempts=0)
    assert "socket" in found.counterexample.reason


def drives():
    root = StateMachine(ENDS, name="DRIVES")
    root.add("DRIVE", SimpleActionState("drive", Action, exec_timeout=60.0))
    return root


@pytest.mark.slow
def test_goals_are_followed_whatever_a_server_does_to_them():
    found = explore(drives, faults=["kill"], real_actions=True, max_runs=120)
    found.assert_ok()


def stopped_by_a_concurrence():
    """One branch ends and stops the other's goal."""
    root = StateMachine(ENDS, name="STOPPED")
    with root:
        both = Concurrence(ENDS, "aborted", child_termination_cb=lambda ends: ends["LOOK"] == "ok")
        with both:
            Concurrence.add("LOOK", leaf())
            Concurrence.add("DRIVE", SimpleActionState("drive", Action))
        root.add("BOTH", both)
    return root


def test_a_goal_that_a_concurrence_has_stopped_is_preempted_after_a_kill_too():
    found = explore(stopped_by_a_concurrence, faults=["kill"], real_actions=True, preempts=0)
    found.assert_ok()
    assert found.exhaustive


def test_doubles_of_the_test_go_on_with_their_script(mission):
    def twice():
        root = StateMachine(["ok", "bad"], name="TWICE")
        root.add("A", leaf(), {"ok": "B", "bad": "A"})
        root.add("B", leaf())
        return root

    mission.replace("A", ["bad", "bad", "ok"], duration=1.0)
    seen = Counter()
    found = mission.explore(
        twice,
        faults=["kill"],
        preempts=0,
        on_run=lambda run: seen.update([run.outcomes("A")]),
    )
    found.assert_ok()
    assert set(seen) == {("bad", "bad", "ok")}


# -- requests that were served ----------------------------------------------------------------

STOPPABLE = ["done", "preempted"]


class Drive(State):
    """Runs until it is asked to stop; with `ask`, it does that itself."""

    def __init__(self, ask=None):
        super().__init__(STOPPABLE)
        self.ask = ask

    def execute(self, _userdata):
        if self.ask is not None:
            self.ask()
        return "preempted" if self.sleep(100.0) else "done"


class Tidy(State):
    """Must not be stopped by a request that was served before it began."""

    def __init__(self):
        super().__init__(["done", "cut"])

    def execute(self, _userdata):
        return "cut" if self.sleep(1.0) else "done"


def served(where, how):
    """Return a mission in which `how` asks the machine at depth `where`; its child serves that."""

    def make():
        root = StateMachine([*STOPPABLE, "cut"], name="SERVED")
        options = {"timeout": 5.0, "timeout_outcome": "preempted"} if how == "timeout" else {}
        machines = [root]
        for depth in (1, 2):
            last = StateMachine([*STOPPABLE, "cut"], **(options if depth == where else {}))
            machines.append(last)
        paths = ["/SERVED", "/SERVED/IN", "/SERVED/IN/IN"]
        asks = {
            "program": lambda: root.request_preempt(by="the door"),
            "operator": lambda: root.control.preempt(paths[where]),
        }
        machines[2].add("DRIVE", Drive(asks.get(how)), {"preempted": "TIDY"})
        machines[2].add("TIDY", Tidy(), {"done": "AFTER"})
        machines[2].add("AFTER", Tidy())
        for machine, inner in ((machines[1], machines[2]), (root, machines[1])):
            if how == "sibling" and machine is machines[1]:
                both = Concurrence(
                    [*STOPPABLE, "cut"],
                    "preempted",
                    child_termination_cb=lambda ends: ends["LOOK"] == "ok",
                    outcome_map={"done": {"IN": "done"}},
                )
                both.add("IN", inner)
                both.add("LOOK", CBState(nothing, outcomes=["ok"]))
                inner = both
            machine.add("IN", inner, {"done": "LAST", "preempted": "LAST"})
            machine.add("LAST", Tidy())
        assert root.control is not None  # made before the run, as a viewer does
        return root

    return make


@pytest.mark.parametrize(
    ("where", "how"),
    [
        (0, "program"),
        (1, "operator"),
        (2, "operator"),
        (1, "timeout"),
        (2, "timeout"),
        (2, "sibling"),
    ],
)
def test_a_request_that_was_served_does_not_come_back(where, how):
    """It stopped the clean-up of the resumed mission, hours later."""
    found = explore(
        served(where, how), faults=["kill"], keep=["DRIVE", "TIDY", "AFTER", "LAST"], preempts=0
    )
    found.assert_ok()


def test_a_request_to_what_tidies_up_is_kept():
    """A second one, after the first was served, is for the child that runs then."""

    def make():
        root = StateMachine([*STOPPABLE, "cut"], name="TWICE")

        class Asked(Tidy):
            def execute(self, userdata):
                root.request_preempt(by="the door")
                return super().execute(userdata)

        root.add("DRIVE", Drive(lambda: root.request_preempt(by="the door")), {"preempted": "TIDY"})
        root.add("TIDY", Asked(), {"cut": "LAST"})
        root.add("LAST", Tidy())
        return root

    found = explore(make, faults=["kill"], keep=["DRIVE", "TIDY", "LAST"], preempts=0)
    found.assert_ok()
