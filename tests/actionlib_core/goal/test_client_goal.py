"""How a client makes sure that a goal and its result arrive."""

from __future__ import annotations

import hypothesis.strategies as st
import pytest
from hypothesis import given

from actionlib_core.goal.client import (
    RESEND_FIRST_S,
    SILENCE_S,
    UNLISTED_S,
    ClientGoal,
    Duty,
)
from actionlib_core.goal.states import TERMINAL, CommState, Status

C = CommState


def started(**kwargs):
    goal = ClientGoal("g", **kwargs)
    goal.begin(0.0)
    goal.on_offered("s")
    return goal


def duties(goal, until):
    """Return when the goal sends what, if nobody answers."""
    found = []
    while goal.due <= until and not goal.over:
        now = goal.due
        _, duty = goal.tick(now)
        found.append((now, duty))
    return found


def test_goal_is_sent_again_until_acknowledged():
    goal = started()
    assert [when for when, duty in duties(goal, 8.0) if duty is Duty.GOAL] == [
        0.5,
        1.5,
        3.5,
        5.5,
        7.5,
    ]
    goal.on_status(Status.PENDING, "", 8.0)
    assert Duty.GOAL not in goal.tick(goal.due)[1]


def test_silence_of_the_server_is_asked_about():
    goal = started()
    goal.on_status(Status.ACTIVE, "", 1.0)
    assert goal.due == 1.0 + SILENCE_S
    assert goal.tick(goal.due)[1] is Duty.ASK


def test_final_status_without_result_is_asked_about():
    goal = started()
    assert goal.on_status(Status.SUCCEEDED, "fine", 1.0) == (C.ACTIVE, C.WAITING_FOR_RESULT)
    assert goal.due < 1.0 + RESEND_FIRST_S
    assert goal.tick(goal.due)[1] is Duty.ASK


def test_cancel_is_sent_again_until_the_server_takes_it():
    goal = started()
    goal.on_status(Status.ACTIVE, "", 0.1)
    path, duty = goal.cancel(1.0)
    assert (path, duty) == ((C.WAITING_FOR_CANCEL_ACK,), Duty.CANCEL)
    goal.on_status(Status.ACTIVE, "", 1.2)
    assert Duty.CANCEL in goal.tick(1.5)[1]
    assert goal.on_status(Status.PREEMPTING, "", 1.6) == (C.PREEMPTING,)
    assert Duty.CANCEL not in goal.tick(goal.due)[1]


def test_cancel_of_a_goal_no_server_took_goes_before_the_goal():
    goal = started()
    goal.cancel(0.1)
    assert goal.tick(0.6)[1] == Duty.CANCEL | Duty.GOAL
    # The server knows the cancel only: the goal is still needed.
    goal.on_status(Status.RECALLING, "", 0.7)
    assert Duty.GOAL in goal.tick(goal.due)[1]


@pytest.mark.parametrize("status", [Status.PENDING, Status.ACTIVE])
def test_cancel_that_was_listed_but_has_not_reached_the_goal_is_sent_again(status):
    """The server that has listed the cancel may have left, and the next one have got the goal."""
    goal = started()
    goal.cancel(0.1)
    goal.on_status(Status.RECALLING, "", 0.2)
    again = []
    for now in range(1, 9):  # a list every second
        goal.on_status(status, "", now)
        again += [duty for _, duty in duties(goal, now + 0.9)]
    assert set(again) == {Duty.CANCEL | Duty.ASK}
    assert len(again) >= 4
    goal.on_status(Status.PREEMPTING, "", 9.0)
    assert Duty.CANCEL not in goal.tick(goal.due)[1]


def test_cancel_of_a_goal_that_reached_nobody_recalls_it():
    goal = ClientGoal("g")
    goal.begin(0.0)
    path, duty = goal.cancel(1.0)
    assert path[-1] is C.DONE
    assert (goal.status, duty) == (Status.RECALLED, Duty.NOTHING)


def test_result_passes_the_states_it_skipped():
    goal = started()
    assert goal.on_result(Status.SUCCEEDED, "fine", "r", 1.0) == (
        C.ACTIVE,
        C.WAITING_FOR_RESULT,
        C.DONE,
    )
    assert (goal.status, goal.text, goal.result) == (Status.SUCCEEDED, "fine", "r")
    assert goal.on_result(Status.ABORTED, "", "x", 2.0) == ()


def test_status_that_was_overtaken_changes_nothing():
    goal = started()
    goal.on_status(Status.ACTIVE, "running", 1.0)
    assert goal.on_status(Status.PENDING, "old", 1.1) == ()
    assert (goal.comm, goal.status, goal.text) == (C.ACTIVE, Status.ACTIVE, "running")


def test_unlisted_goal_is_asked_about_then_lost():
    goal = started()
    goal.on_status(Status.ACTIVE, "", 1.0)
    assert goal.on_unlisted(2.0, answers=False) == ()
    assert goal.due < 3.0
    assert goal.on_unlisted(2.0 + UNLISTED_S, answers=False) == ()
    assert goal.on_unlisted(2.1 + UNLISTED_S, answers=True) == ()
    assert goal.on_unlisted(2.1 + UNLISTED_S, answers=False) == (C.LOST,)
    assert "no longer lists" in goal.text


def test_ack_timeout_loses_the_goal():
    goal = started(ack_timeout=3.0)
    while not goal.over:
        now = goal.due
        _, duty = goal.tick(now)
    assert now == 3.0
    assert duty is Duty.CANCEL  # it may be on its way
    assert goal.text == "no action server took this goal within 3 s"


def test_attached_goal_cancelled_before_it_is_asked_for_is_cancelled_at_its_server():
    goal = ClientGoal("g", attached=True)
    path, duty = goal.cancel(0.0)
    assert (path, duty) == ((C.WAITING_FOR_CANCEL_ACK,), Duty.CANCEL)
    assert not goal.over


def test_attached_goal_is_asked_for_and_never_sent():
    goal = ClientGoal("g", attached=True)
    assert goal.begin(0.0) is Duty.ASK
    assert {duty for _, duty in duties(goal, 10.0)} == {Duty.ASK}
    assert goal.on_unknown("never heard of it") == (C.LOST,)


def test_unknown_to_the_server_is_no_news_before_it_took_the_goal():
    goal = started()
    assert goal.on_unknown("?") == ()
    goal.on_status(Status.ACTIVE, "", 0.0)
    assert goal.on_unknown("restarted") == (C.LOST,)


@pytest.mark.parametrize("status", sorted(set(Status) - TERMINAL))
def test_result_with_a_status_that_is_no_end_loses_the_goal(status):
    goal = started()
    assert goal.on_result(status, "", None, 1.0) == (C.LOST,)


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("status"), st.sampled_from(Status)),
            st.tuples(st.just("result"), st.sampled_from(Status)),
            st.tuples(st.sampled_from(["cancel", "unlisted", "unknown", "tick"]), st.none()),
        ),
        max_size=30,
    )
)
def test_whatever_arrives_the_goal_stays_sound(events):
    goal = started()
    now = 0.0
    ended = 0
    for kind, status in events:
        now += 0.4
        if kind == "status":
            path = goal.on_status(status, "", now)
        elif kind == "result":
            path = goal.on_result(status, "", None, now)
        elif kind == "cancel":
            path, _ = goal.cancel(now)
        elif kind == "unlisted":
            path = goal.on_unlisted(now, answers=False)
        elif kind == "unknown":
            path = goal.on_unknown("")
        else:
            path, _ = goal.tick(now)
        assert not path or path[-1] is goal.comm
        ended += sum(state in {C.DONE, C.LOST} for state in path)
        assert ended == goal.over  # it ends once, and nothing follows
        if goal.comm is C.DONE:
            assert goal.status in TERMINAL
        if not goal.over:
            assert goal.due > now - 1e-9 or goal.tick(now)[1]  # never forgotten


def test_goal_that_no_server_took_is_offered_again():
    goal = started()
    assert goal.on_untaken(0.1) == ()
    assert (goal.offered, goal.server, goal.comm) == (False, "", C.WAITING_FOR_GOAL_ACK)
    goal.hurry(3.0)
    assert goal.tick(3.0)[1] is Duty.GOAL


def test_cancelled_goal_that_no_server_took_is_recalled():
    goal = started()
    goal.cancel(0.05)
    assert goal.on_untaken(0.1)[-1] is C.DONE
    assert goal.status is Status.RECALLED


@pytest.mark.parametrize("attached", [False, True])
def test_goal_that_a_server_has_or_had_is_not_offered_again(attached):
    goal = started(attached=attached)
    if not attached:
        goal.on_status(Status.ACTIVE, "", 0.1)
    assert goal.on_untaken(0.2) == ()
    assert goal.offered
