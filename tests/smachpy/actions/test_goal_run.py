"""The decisions of an action state: no threads, no time, every order of events."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy.actions.goal_run import OUTCOMES, GoalDuty, GoalRun

FINAL = ["PREEMPTED", "SUCCEEDED", "ABORTED", "REJECTED", "RECALLED", "LOST"]


def new_run(**limits):
    kept = {"accept_timeout": None, "exec_timeout": None, "preempt_timeout": 60.0}
    return GoalRun(**kept | limits)


def run_of(**limits):
    run = new_run(**limits)
    run.on_begun(10.0)
    return run


@pytest.mark.parametrize(
    ("status", "alone", "after_preempt"),
    [
        ("SUCCEEDED", "succeeded", "succeeded"),
        ("ABORTED", "aborted", "aborted"),
        ("REJECTED", "aborted", "aborted"),
        ("PREEMPTED", "aborted", "preempted"),
        ("RECALLED", "aborted", "preempted"),
        ("LOST", "aborted", "preempted"),
    ],
)
def test_outcome_of_each_status(status, alone, after_preempt):
    run = run_of()
    run.on_end(status, "said so")
    assert run.step(11.0) is GoalDuty.FINISH
    assert (run.outcome, run.reason) == (alone, f"{status}: said so")
    run = run_of()
    run.on_preempt()
    assert run.step(11.0) is GoalDuty.CANCEL
    run.on_end(status, "")
    assert run.outcome == after_preempt


def test_a_preempt_cancels_once_and_gives_grace():
    run = run_of(preempt_timeout=2.0)
    assert run.deadline is None
    run.on_preempt()
    assert run.step(11.0) is GoalDuty.CANCEL
    run.on_preempt()
    assert run.step(12.9) is GoalDuty.WAIT
    assert run.deadline == 13.0
    assert run.step(13.0) is GoalDuty.ABANDON
    assert run.step(13.0) is GoalDuty.FINISH
    assert run.outcome == "preempted"
    assert run.abandoned
    assert "has not ended it 2 s after the cancel" in run.reason


def test_exec_timeout_cancels_then_aborts():
    run = run_of(exec_timeout=5.0)
    assert run.deadline == 15.0
    assert run.step(14.9) is GoalDuty.WAIT
    assert run.step(15.0) is GoalDuty.CANCEL
    run.on_end("PREEMPTED", "stopped")
    assert run.outcome == "aborted"
    assert run.reason == "PREEMPTED: cancelled after exec_timeout=5 s: stopped"


def test_a_preempt_after_exec_timeout_keeps_the_first_deadline_and_makes_preempted():
    run = run_of(exec_timeout=5.0, preempt_timeout=3.0)
    assert run.step(15.0) is GoalDuty.CANCEL
    run.on_preempt()
    assert run.step(17.0) is GoalDuty.WAIT
    assert run.deadline == 18.0
    run.on_end("PREEMPTED", "")
    assert run.outcome == "preempted"


def test_a_preempt_after_the_end_changes_nothing():
    run = run_of()
    run.on_end("ABORTED", "")
    run.on_preempt()
    assert run.outcome == "aborted"
    assert not run.preempted


def test_without_preempt_timeout_it_waits_for_ever():
    run = run_of(preempt_timeout=None)
    run.on_preempt()
    assert run.step(11.0) is GoalDuty.CANCEL
    assert run.deadline is None
    assert run.step(1e9) is GoalDuty.WAIT


@given(
    st.lists(
        st.one_of(
            st.sampled_from(["preempt", "acknowledged", "begun", "failure", *FINAL]),
            st.floats(0.0, 100.0),
        ),
        max_size=20,
    ),
    st.fixed_dictionaries(
        dict.fromkeys(
            ["accept_timeout", "exec_timeout", "preempt_timeout"], st.none() | st.floats(0.0, 50.0)
        )
    ),
)
def test_every_story_cancels_at_most_once_and_ends_for_good(story, limits):
    now, run = 0.0, new_run(**limits)
    steps = []
    for event in story:
        if isinstance(event, float):
            now += event
        elif event == "preempt":
            run.on_preempt()
        elif event == "acknowledged":
            run.on_acknowledged(0.0)
        elif event == "begun":
            run.on_begun(now)
        elif event == "failure":
            run.on_failure()
        else:
            run.on_end(event, "")
        steps.append(run.step(now))
    assert steps.count(GoalDuty.CANCEL) <= 1
    assert steps.count(GoalDuty.ABANDON) <= 1
    if GoalDuty.ABANDON in steps:
        assert steps.index(GoalDuty.CANCEL) < steps.index(GoalDuty.ABANDON)
    if GoalDuty.FINISH in steps:
        assert set(steps[steps.index(GoalDuty.FINISH) :]) == {GoalDuty.FINISH}
        assert run.outcome in OUTCOMES
    assert run.deadline is None or run.deadline >= 0.0


def test_exec_timeout_counts_from_when_a_server_accepted_the_goal():
    run = new_run(exec_timeout=5.0)
    assert run.deadline is None
    assert run.step(1000.0) is GoalDuty.WAIT
    run.on_begun(1000.0)
    run.on_begun(1003.0)
    assert run.deadline == 1005.0
    run.on_preempt()
    assert run.step(1001.0) is GoalDuty.CANCEL
    assert run.deadline == 1061.0


def test_a_server_that_takes_the_goal_after_the_cancel_does_not_extend_the_grace():
    run = new_run(exec_timeout=500.0, preempt_timeout=2.0)
    run.on_preempt()
    assert run.step(0.0) is GoalDuty.CANCEL
    run.on_begun(1.0)
    assert run.deadline == 2.0
    assert run.step(2.0) is GoalDuty.ABANDON


def test_goal_that_waits_at_the_server_for_too_long_is_cancelled():
    run = new_run(accept_timeout=30.0, exec_timeout=5.0)
    run.on_acknowledged(100.0)
    run.on_acknowledged(100.0)
    assert run.deadline == 130.0
    assert run.step(129.0) is GoalDuty.WAIT
    assert run.step(130.0) is GoalDuty.CANCEL
    run.on_end("RECALLED", "said so")
    assert run.outcome == "aborted"
    assert run.reason == "RECALLED: not accepted within server_wait_timeout=30 s: said so"


@pytest.mark.parametrize(("exec_timeout", "deadline"), [(5.0, 125.0), (None, None)])
def test_acceptance_ends_the_limit_of_the_wait(exec_timeout, deadline):
    run = new_run(accept_timeout=30.0, exec_timeout=exec_timeout)
    run.on_acknowledged(100.0)
    run.on_begun(120.0)
    assert run.deadline == deadline
    run.on_acknowledged(100.0)
    assert run.deadline == deadline


def test_goal_that_is_acknowledged_after_its_cancel_keeps_its_grace():
    run = new_run(accept_timeout=30.0, preempt_timeout=None)
    run.on_preempt()
    assert run.step(0.0) is GoalDuty.CANCEL
    run.on_acknowledged(0.0)
    assert run.deadline is None
