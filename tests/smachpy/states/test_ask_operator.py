from __future__ import annotations

import logging
import math

import pytest

import smachpy
from actionlib_core.interfaces.std_msgs.msg import Bool, String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.node import Node
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import Subscriber
from smachpy.exceptions import MissionError
from smachpy.states.ask_operator import AskOperator


def asking(*answers, patience=30.0):
    state = AskOperator("Go on?", answers or ("yes", "no"), patience=patience)
    sm = smachpy.StateMachine(state.get_registered_outcomes(), name="ASK")
    with sm:
        sm.add("ASK", state)
    return sm


@pytest.fixture
def answer(mission):
    """`answer(seconds, text)`: say it on the topic that late."""
    topic = mission.topic("operator/answer", String)
    return lambda at, text: topic.publish_at(at, String(text))


def test_the_command_in_the_log_can_be_copied(mission, answer, caplog):
    answer(5.0, "go home")
    mission(asking("go home", "no")).assert_outcome("go home")
    assert "smachpy answer 'go home'" in caplog.text


@pytest.mark.parametrize("text", ["retry", " Retry\n", "skip"])
def test_the_answer_is_the_outcome(mission, answer, text):
    answer(5.0, text)
    run = mission(asking("retry", "skip"))
    run.assert_outcome(text.strip().lower())
    assert run.duration == 5.0


@pytest.mark.parametrize(
    ("answers", "text", "meant"),
    [
        (("Retry", "Go Home"), "retry", "Retry"),
        (("Retry", "Go Home"), " Go Home\n", "Go Home"),
        (("Yes", "yes"), "yes", "yes"),
        (("Yes", "yes"), "Yes", "Yes"),
        (("Yes", "yes"), "YES", "no_answer"),
        (("retry", "skip", "retry"), "retry", "retry"),
    ],
)
def test_answers_may_have_capitals(mission, answer, answers, text, meant):
    answer(5.0, text)
    mission(asking(*answers)).assert_outcome(meant)


@pytest.mark.parametrize("answers", [(), ("",), ("yes", "no_answer"), ("preempted",)])
def test_answers_that_say_something_else_are_refused(answers):
    with pytest.raises(MissionError, match="answers: got"):
        AskOperator("Go on?", answers, patience=5.0)


def test_the_question_is_there_while_it_waits_and_gone_after(mission, answer):
    question = mission.topic("operator/question", String)
    answer(5.0, "no")
    mission(asking()).assert_outcome("no")
    mission.clock.sleep(0.1)
    assert [message.data for message in question.received] == ["Go on? (yes, no)", ""]


def test_a_listener_of_another_type_does_not_end_the_mission(mission, answer):
    """The answer was lost, and the mission with it."""
    Subscriber("operator/question", Bool, lambda _: None, node=mission.node)
    answer(5.0, "yes")
    mission(asking()).assert_outcome("yes")


def test_nobody_answers(mission):
    run = mission(asking(patience=12.0))
    run.assert_outcome("no_answer")
    assert run.duration == 12.0


def test_words_that_are_no_answer_are_refused_and_it_goes_on_waiting(mission, answer, caplog):
    answer(2.0, "rety")
    answer(4.0, "retry")
    with caplog.at_level(logging.WARNING):
        run = mission(asking("retry", "skip"))
    assert (run.outcome, run.duration) == ("retry", 4.0)
    assert "got 'rety'; expected one of ['retry', 'skip']. Did you mean 'retry'?" in caplog.text


def test_the_first_answer_counts(mission):
    topic = mission.topic("operator/answer", String)
    mission.clock.call_later(3.0, lambda: [topic.publish(String(text)) for text in ("no", "yes")])
    mission(asking()).assert_outcome("no")


@pytest.mark.parametrize(("data", "outcome"), [(True, "yes"), (False, "no")])
def test_a_service_confirms_too(mission, data, outcome):
    said = []

    def operator():
        with Node("hand", transport=mission.network.session(), clock=mission.clock) as node:
            mission.clock.sleep(4.0)
            said.append(ServiceProxy("operator/confirm", SetBool, node=node)(data))

    task = mission.clock.spawn(operator, name="operator")
    mission(asking()).assert_outcome(outcome)
    task.join(5.0)
    assert (said[0].success, said[0].message) == (True, f"Go on? {outcome}")


def test_a_preempt_ends_it_at_once(mission):
    mission.preempt(at=3.0)
    run = mission(asking())
    assert (run.outcome, run.duration) == ("preempted", 3.0)


def test_the_next_question_does_not_take_the_last_ones_answer(mission, answer):
    answer(1.0, "yes")
    sm = smachpy.StateMachine(["yes", "no", "no_answer", "preempted"])
    with sm:
        sm.add("ONE", AskOperator("One?", patience=5), {"yes": "TWO"})
        sm.add("TWO", AskOperator("Two?", patience=5))
    run = mission(sm)
    assert (run.outcome, run.duration) == ("no_answer", 6.0)


def test_a_latched_answer_is_that_to_the_question_of_its_time(mission):
    """It answered every later question at once."""
    mission.topic("operator/answer", String).publish_at(2.0, String("yes"), latch=True)
    sm = smachpy.StateMachine(["yes", "no", "no_answer", "preempted"])
    with sm:
        sm.add("ONE", AskOperator("One?", patience=5), {"yes": "TWO"})
        sm.add("TWO", AskOperator("Two?", patience=5))
    run = mission(sm)
    run.assert_outcome("no_answer")
    assert run.duration == 7.0


def test_the_machines_picture_shows_the_question():
    (child,) = smachpy.describe(asking()).children
    assert ("question", "Go on?") in child.details


def test_an_operator_at_the_page_ends_it_with_any_outcome(mission):
    machine = asking("retry", "skip")
    mission.clock.call_later(6.0, lambda: machine.control.force_outcome("/ASK/ASK", "skip"))
    run = mission(machine)
    assert (run.outcome, run.duration) == ("skip", 6.0)


def test_two_questions_at_once_have_channels_of_their_own(mission, answer):
    answer(2.0, "yes")
    mission.topic("door/answer", String).publish_at(3.0, String("no"))
    seen = []
    both = smachpy.Concurrence(["done"], "done", outcome_cb=seen.append)
    with both:
        both.add("ONE", AskOperator("One?", patience=5))
        both.add("TWO", AskOperator("Two?", patience=5, channel="door"))
    assert mission(both).duration == 3.0
    assert {"ONE": "yes", "TWO": "no"} in seen


@pytest.mark.parametrize("patience", [0.0, -1.0, math.inf, math.nan])
def test_a_patience_that_is_no_time_is_refused(patience):
    with pytest.raises(MissionError, match=f"patience: got {patience:g}; expected more than 0"):
        AskOperator("Shall I?", patience=patience)


async def waits(userdata):
    return "Go on?"


def yields(userdata):
    yield "Go on?"


@pytest.mark.parametrize(
    ("question", "problem"),
    [
        ("", "question: got ''"),
        (None, "question: got None"),
        (waits, "not an async one"),
        (yields, "without `yield`"),
        (lambda: "Go on?", r"question\(userdata\)"),
    ],
)
def test_a_question_that_no_person_could_read_is_refused(question, problem):
    """A coroutine was shown as the question."""
    with pytest.raises(smachpy.InvalidStateError, match=problem):
        AskOperator(question, ["yes"], patience=1.0)
    if callable(question):
        with pytest.raises(smachpy.InvalidStateError, match="picture: got"):
            AskOperator("Go on?", ["yes"], patience=1.0, picture=question)
