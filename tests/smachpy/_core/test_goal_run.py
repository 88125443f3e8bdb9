"""The decisions of an action state: no threads, no time, every order of events."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy.actions.goal_run import OUTCOMES, GoalRun, Step

FINAL = ["PREEMPTED", "SUCCEEDED", "ABORTED", "REJECTED", "RECALLED", "LOST"]


def run_of(exec_timeout=None, preempt_timeout=60.0):
    run = GoalRun(exec_timeout=exec_timeout, preempt_timeout=preempt_timeout)
    run.on_taken(10.0)
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
    assert run.step(11.0) is Step.FINISH
    assert (run.outcome, run.reason) == (alone, f"{status}: said so")
    run = run_of()
    run.on_preempt()
    assert run.step(11.0) is Step.CANCEL
    run.on_end(status, "")
    assert run.outcome == after_preempt


def test_a_preempt_cancels_once_and_gives_grace():
    run = run_of(preempt_timeout=2.0)
    assert run.deadline is None
    run.on_preempt()
    assert run.step(11.0) is Step.CANCEL
    run.on_preempt()
    assert run.step(12.9) is Step.WAIT
    assert run.deadline == 13.0
    assert run.step(13.0) is Step.ABANDON
    assert run.step(13.0) is Step.FINISH
    assert run.outcome == "preempted"
    assert run.abandoned
    assert "has not ended it 2 s after the cancel" in run.reason


def test_exec_timeout_cancels_then_aborts():
    run = run_of(exec_timeout=5.0)
    assert run.deadline == 15.0
    assert run.step(14.9) is Step.WAIT
    assert run.step(15.0) is Step.CANCEL
    run.on_end("PREEMPTED", "stopped")
    assert run.outcome == "aborted"
    assert run.reason == "PREEMPTED: cancelled after exec_timeout=5 s: stopped"


def test_a_preempt_after_exec_timeout_keeps_the_first_deadline_and_makes_preempted():
    run = run_of(exec_timeout=5.0, preempt_timeout=3.0)
    assert run.step(15.0) is Step.CANCEL
    run.on_preempt()
    assert run.step(17.0) is Step.WAIT
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
    assert run.step(11.0) is Step.CANCEL
    assert run.deadline is None
    assert run.step(1e9) is Step.WAIT


@given(
    st.lists(
        st.one_of(st.sampled_from(["preempt", "taken", "failure", *FINAL]), st.floats(0.0, 100.0)),
        max_size=20,
    ),
    st.none() | st.floats(0.0, 50.0),
    st.none() | st.floats(0.0, 50.0),
)
def test_every_story_cancels_at_most_once_and_ends_for_good(story, exec_timeout, preempt_timeout):
    now, run = 0.0, GoalRun(exec_timeout=exec_timeout, preempt_timeout=preempt_timeout)
    steps = []
    for event in story:
        if isinstance(event, float):
            now += event
        elif event == "preempt":
            run.on_preempt()
        elif event == "taken":
            run.on_taken(now)
        elif event == "failure":
            run.on_failure()
        else:
            run.on_end(event, "")
        steps.append(run.step(now))
    assert steps.count(Step.CANCEL) <= 1
    assert steps.count(Step.ABANDON) <= 1
    if Step.ABANDON in steps:
        assert steps.index(Step.CANCEL) < steps.index(Step.ABANDON)
    if Step.FINISH in steps:
        assert set(steps[steps.index(Step.FINISH) :]) == {Step.FINISH}
        assert run.outcome in OUTCOMES
    assert run.deadline is None or run.deadline >= 0.0


def test_exec_timeout_counts_from_when_a_server_took_the_goal():
    run = GoalRun(exec_timeout=5.0, preempt_timeout=60.0)
    assert run.deadline is None
    assert run.step(1000.0) is Step.WAIT
    run.on_taken(1000.0)
    run.on_taken(1003.0)
    assert run.deadline == 1005.0
    run.on_preempt()
    assert run.step(1001.0) is Step.CANCEL
    assert run.deadline == 1061.0


def test_a_server_that_takes_the_goal_after_the_cancel_does_not_extend_the_grace():
    run = GoalRun(exec_timeout=500.0, preempt_timeout=2.0)
    run.on_preempt()
    assert run.step(0.0) is Step.CANCEL
    run.on_taken(1.0)
    assert run.deadline == 2.0
    assert run.step(2.0) is Step.ABANDON
