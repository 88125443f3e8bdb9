"""What a client asks a ROS 2 server about a goal: once sent, doubt settled, cancels told truly."""

from __future__ import annotations

import hypothesis.strategies as st
import pytest
from hypothesis import given

from actionlib_core.goal.states import Status
from actionlib_core.wire.ros2.goal_exchange import SETTLED_S, Duty, ExchangePhase, GoalExchange


def sent(now=0.0):
    goal = GoalExchange()
    assert goal.want() == Duty.QUEUE
    goal.on_sent(now)
    return goal


def test_accepted_goal_is_told_and_its_result_asked_for_at_once():
    goal = sent()
    assert goal.on_answer(accepted=True) == Duty.NOTIFY | Duty.ASK
    assert (goal.phase, goal.status) == (ExchangePhase.TAKEN, Status.PENDING)
    assert goal.on_state(2) == Duty.NOTIFY
    assert goal.status is Status.ACTIVE
    assert goal.on_result(4, 1.0) == Duty.END
    assert goal.status is Status.SUCCEEDED


def test_refusal_of_the_only_sending_is_a_refusal():
    assert sent().on_answer(accepted=False) == Duty.REFUSED


def test_refusal_whose_state_came_first_is_a_refusal_too():
    goal = sent()
    assert goal.on_state(1) & Duty.NOTIFY
    assert goal.on_answer(accepted=False) == Duty.REFUSED


def test_wish_is_not_a_second_sending():
    goal = GoalExchange()
    assert goal.want() == Duty.QUEUE
    assert goal.want() == Duty.NOTHING
    goal.on_sent(0.0)
    assert goal.want() == Duty.NOTHING


def test_doubt_is_settled_by_the_result_of_the_same_id():
    goal = sent()
    assert goal.on_unanswered() == Duty.ASK
    assert goal.want() == Duty.NOTHING  # the question is open: the server has the goal, or is slow
    assert goal.on_state(2) == Duty.NOTIFY
    assert goal.on_result(6, 1.0) == Duty.END
    assert goal.status is Status.ABORTED


def test_goal_that_is_not_known_is_sent_again_and_then_a_refusal_is_settled():
    goal = sent()
    goal.on_unanswered()
    assert goal.on_result(0, 1.0) == Duty.QUEUE
    goal.on_sent(1.0)
    assert goal.on_answer(accepted=False) == Duty.ASK  # it may be known by the first sending
    assert goal.on_result(0, 1.1) == Duty.REFUSED


def test_refused_repetition_of_a_goal_that_runs_is_followed():
    goal = sent()
    goal.on_unanswered()
    goal.on_result(0, 1.0)
    goal.on_sent(1.0)
    goal.on_answer(accepted=False)
    assert goal.on_state(2) & Duty.NOTIFY
    assert goal.on_result(5, 3.0) == Duty.END


def test_doubt_of_long_ago_is_not_settled_by_sending_again():
    goal = sent()
    goal.on_unanswered()
    assert goal.on_no_result() == Duty.ASK_LATER
    assert goal.ask_again() == Duty.ASK
    assert goal.on_result(0, SETTLED_S + 0.1) == Duty.UNSETTLED


@pytest.mark.parametrize("unanswered", [False, True])
def test_doubt_over_a_lost_link_is_not_settled_by_sending_again(unanswered):
    goal = sent()
    if unanswered:
        goal.on_unanswered()
    goal.on_link_lost()  # while the computer slept, the server may have run and forgotten the goal
    assert goal.want() == Duty.ASK
    assert goal.on_result(0, 1.0) == Duty.UNSETTLED


def test_unanswered_question_for_the_result_is_asked_again_later():
    goal = sent()
    goal.on_answer(accepted=True)
    assert goal.ask_again() == Duty.NOTHING
    assert goal.on_no_result() == Duty.ASK_LATER
    assert goal.ask_again() == Duty.ASK


def test_accepted_goal_that_the_server_forgot_is_lost():
    goal = sent()
    goal.on_answer(accepted=True)
    assert goal.on_result(0, 1.0) == Duty.UNKNOWN


def test_feedback_before_the_answer_shows_that_the_goal_runs():
    goal = sent()
    assert goal.on_feedback() == Duty.NOTIFY | Duty.ASK
    assert goal.status is Status.ACTIVE
    assert goal.on_answer(accepted=True) == Duty.NOTHING
    assert goal.on_state(1) == Duty.NOTHING


def test_states_that_were_overtaken_say_nothing():
    goal = sent()
    goal.on_answer(accepted=True)
    assert goal.on_state(3) == Duty.NOTIFY
    assert goal.status is Status.PREEMPTING  # a list that was skipped may have shown that it ran
    assert goal.on_state(2) == Duty.NOTHING
    assert goal.on_state(99) == Duty.NOTHING


@pytest.mark.parametrize(
    ("lists", "status"),
    [
        ([(1, False), (3, True), (5, True)], Status.RECALLED),
        ([(1, False), (1, True), (5, True)], Status.RECALLED),
        ([(1, False), (3, True), (5, False)], Status.RECALLED),
        ([(1, False), (1, False), (3, True)], Status.RECALLED),
        ([(1, False), (2, True), (3, True)], Status.PREEMPTED),
        ([(1, False), (3, False)], Status.PREEMPTED),
        ([(3, True)], Status.PREEMPTED),
        ([], Status.PREEMPTED),
    ],
)
def test_cancelled_goal_was_recalled_if_no_list_is_missing_that_may_have_shown_it_executing(
    lists, status
):
    goal = sent()
    goal.on_answer(accepted=True)
    for code, unbroken in lists:
        goal.on_state(code, unbroken=unbroken)
    assert goal.on_result(5, 1.0) == Duty.END
    assert goal.status is status


def test_feedback_shows_that_a_goal_was_executing_whatever_lists_say():
    goal = sent()
    goal.on_answer(accepted=True)
    goal.on_state(1)
    goal.on_feedback()
    goal.on_state(1, unbroken=True)
    goal.on_state(3, unbroken=True)
    assert goal.status is Status.PREEMPTING


def test_cancel_of_what_no_server_has_recalls_it():
    goal = GoalExchange()
    assert goal.cancel() == Duty.RECALLED
    goal = GoalExchange()
    goal.want()
    assert goal.cancel() == Duty.RECALLED


def test_cancel_before_the_answer_goes_out_with_the_acceptance():
    goal = sent()
    assert goal.cancel() == Duty.NOTHING
    assert goal.on_answer(accepted=True) == Duty.NOTIFY | Duty.ASK | Duty.CANCEL
    assert goal.cancel(again=True) == Duty.NOTHING
    assert goal.on_cancel_answer(0, listed=True) == Duty.NOTIFY
    assert goal.status is Status.PREEMPTING
    assert goal.cancel() == Duty.NOTHING


def test_cancelled_goal_that_turns_out_not_to_be_there_is_recalled():
    goal = sent()
    goal.cancel()
    goal.on_unanswered()
    assert goal.on_result(0, 1.0) == Duty.RECALLED


@pytest.mark.parametrize("code", [0, 1])
def test_refused_cancel_is_told_and_repeated_only_when_it_is_wished_anew(code):
    goal = sent()
    goal.on_answer(accepted=True)
    assert goal.cancel() == Duty.CANCEL
    assert goal.on_cancel_answer(code, listed=False) == Duty.KEEPS_RUNNING
    assert goal.cancel(again=True) == Duty.NOTHING
    assert goal.cancel() == Duty.CANCEL


@pytest.mark.parametrize("code", [2, 3])
def test_cancel_of_what_has_ended_leaves_the_word_to_the_result(code):
    goal = sent()
    goal.on_answer(accepted=True)
    goal.cancel()
    assert goal.on_cancel_answer(code, listed=False) == Duty.NOTHING


def test_cancel_that_was_not_answered_is_repeated():
    goal = sent()
    goal.on_answer(accepted=True)
    goal.cancel()
    goal.on_no_cancel_answer()
    assert goal.cancel(again=True) == Duty.CANCEL


def test_attached_goal_is_asked_for_and_never_sent():
    goal = GoalExchange(attached=True)
    assert goal.want() == Duty.NOTHING
    assert goal.ask_again() == Duty.ASK
    assert goal.cancel() == Duty.CANCEL
    assert goal.on_result(0, 9.0) == Duty.UNKNOWN


def test_lost_link_leaves_doubt_about_what_was_sent_and_none_about_what_waits():
    goal = sent()
    goal.on_link_lost()
    assert goal.phase is ExchangePhase.UNSURE
    waiting = GoalExchange()
    waiting.want()
    waiting.on_link_lost()
    assert waiting.phase is ExchangePhase.HERE


EVENTS = {
    "want": lambda goal, _: goal.want(),
    "accepted": lambda goal, _: goal.on_answer(accepted=True),
    "refused": lambda goal, _: goal.on_answer(accepted=False),
    "unanswered": lambda goal, _: goal.on_unanswered(),
    "unknown": lambda goal, now: goal.on_result(0, now),
    "ended": lambda goal, now: goal.on_result(4, now),
    "no result": lambda goal, _: goal.on_no_result(),
    "again": lambda goal, _: goal.ask_again(),
    "active": lambda goal, _: goal.on_state(2),
    "feedback": lambda goal, _: goal.on_feedback(),
    "cancel": lambda goal, _: goal.cancel(),
    "canceling": lambda goal, _: goal.on_cancel_answer(0, listed=True),
    "link lost": lambda goal, _: goal.on_link_lost() or Duty.NOTHING,
}
DOUBTFUL = {ExchangePhase.SENT, ExchangePhase.UNSURE}
OVER = Duty.END | Duty.REFUSED | Duty.RECALLED | Duty.UNKNOWN | Duty.UNSETTLED


@given(st.lists(st.sampled_from(sorted(EVENTS)), max_size=40))
def test_goal_is_sent_again_only_if_its_server_does_not_know_it_and_was_never_lost(events):
    goal, asked, may_send, in_doubt = GoalExchange(), 0, True, False
    for now, event in enumerate(events):
        awaited = {
            "accepted": ExchangePhase.SENT,
            "refused": ExchangePhase.SENT,
            "unanswered": ExchangePhase.SENT,
        }
        if goal.phase is not awaited.get(event, goal.phase):
            continue
        if event in {"unknown", "ended", "no result"} and not goal.asking:
            continue
        if event == "unknown" and goal.phase is ExchangePhase.UNSURE:
            may_send = not in_doubt
        in_doubt |= event == "link lost" and goal.phase in DOUBTFUL
        step = EVENTS[event](goal, now / 10)
        asked += bool(step & Duty.ASK)
        if step & OVER:
            return
        if step & Duty.QUEUE:
            assert may_send
            may_send = False
            goal.on_sent(now / 10)
        assert goal.asking == (goal.asking and asked > 0)
        assert not (goal.phase in {ExchangePhase.HERE, ExchangePhase.QUEUED} and goal.asking)
