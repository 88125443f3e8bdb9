from __future__ import annotations

import threading
from types import SimpleNamespace

from smachpy import events as ev
from smachpy.events.run_state import RAISED
from smachpy_viz.model.history import History


def told(*events):
    history = History()
    for event in events:
        history.on_event(event)
    return history


def test_visits_are_counted_and_timed():
    history = told(
        ev.Started("/M", 10.0, 0),
        ev.Entered("/M/A", 10.0, 0),
        ev.Left("/M/A", 12.5, 0, "aborted"),
        ev.Entered("/M/A", 13.0, 0),
        ev.Left("/M/A", 14.0, 0, "succeeded"),
        ev.Finished("/M", 15.0, 0, "succeeded"),
    )
    visits = history.visits()["/M/A"]
    assert visits.count == 2
    assert visits.seconds == 3.5
    assert visits.outcome == "succeeded"
    assert visits.outcomes == {"aborted": 1, "succeeded": 1}
    assert history.seconds == 5.0
    marks = history.marks()
    assert marks.visits == {"/M": 1, "/M/A": 2}
    assert marks.taken == {("/M", "succeeded"): 1, ("/M/A", "aborted"): 1, ("/M/A", "succeeded"): 1}
    assert marks.active == frozenset()


def test_running_states_are_active():
    history = told(ev.Started("/M", 0.0, 0), ev.Entered("/M/A", 1.0, 0))
    assert history.marks().active == {"/M", "/M/A"}
    assert history.active() == {"/M": 0.0, "/M/A": 1.0}
    assert history.since("/M/A") == 1.0
    assert history.since("/M/B") is None


def test_a_state_that_raised_ended_with_an_exception():
    history = told(
        ev.Started("/M", 0.0, 0),
        ev.Entered("/M/A", 0.0, 0),
        ev.Failed("/M/A", 1.0, 0, "ValueError: no"),
        ev.Finished("/M", 1.0, 0, None),
    )
    assert history.marks().last == {"/M/A": RAISED, "/M": RAISED}


def test_goals_live_from_sending_to_their_end():
    history = told(ev.GoalSent("/M/A", 0.0, 0, "move_base", "g1", "there"))
    history.on_event(ev.GoalFeedback("/M/A", 1.0, 0, "move_base", "g1", "far"))
    history.on_event(ev.GoalFeedback("/M/A", 2.0, 0, "move_base", "g1", "near"))
    (goal,) = history.goals()
    assert (goal.feedback, goal.first_feedback) == ("near", "far")
    assert history.goal("g1") == goal
    history.on_event(ev.GoalDone("/M/A", 3.0, 0, "move_base", "g1", "SUCCEEDED", ""))
    assert history.goals() == []
    assert history.goal("g1") is None


def test_a_goal_ends_with_its_state_at_the_latest():
    history = told(
        ev.Entered("/M/A", 0.0, 0),
        ev.GoalSent("/M/A", 0.0, 0, "a", "g1", None),
        ev.Left("/M/A", 1.0, 0, "preempted"),
    )
    assert history.goals() == []


def test_what_came_too_late_or_is_unknown_does_no_harm():
    history = told(
        ev.Left("/M/A", 1.0, 0, "succeeded"),
        ev.GoalFeedback("/M/A", 1.0, 0, "a", "gone", 1),
        ev.GoalDone("/M/A", 1.0, 0, "a", "gone", "LOST", ""),
        ev.Finished("/M", 1.0, 0, "succeeded"),
        SimpleNamespace(path="/M"),
    )
    assert history.visits()["/M/A"].count == 1
    assert history.seconds is None


def test_threads_may_tell_at_the_same_time():
    history = History()

    def visit():
        for _ in range(500):
            history.on_event(ev.Entered("/M/A", 0.0, 0))
            history.on_event(ev.Left("/M/A", 1.0, 0, "x"))
            history.marks()

    threads = [threading.Thread(target=visit) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert history.visits()["/M/A"].count == 2000
    assert history.visits()["/M/A"].outcomes == {"x": 2000}


def test_a_new_run_ends_what_the_last_one_left_open():
    """The first run was cut short: its process was killed, or its recording ends there."""
    history = History()
    for event in (
        ev.Started("/M", 0.0, 0, ("A",)),
        ev.Entered("/M/A", 0.0, 0),
        ev.GoalSent("/M/A", 0.0, 0, "move", "g-1", SimpleNamespace()),
        ev.Started("/MORE", 5.0, 5, ("A",)),
        ev.Started("/M", 10.0, 10, ("B",)),
        ev.Entered("/M/B", 10.0, 10),
    ):
        history.on_event(event)
    assert sorted(history.active()) == ["/M", "/M/B", "/MORE"]
    assert history.goals() == []
    assert history.visits()["/M/A"].seconds == 0.0
