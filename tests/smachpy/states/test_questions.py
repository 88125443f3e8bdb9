"""Questions on the network: found, answered once, recorded with who answered, with a picture."""

from __future__ import annotations

import logging
import threading

import pytest

import smachpy
from actionlib_core.interfaces.sensor_msgs.msg import CompressedImage
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.node import Node
from smachpy.events import QuestionAnswered, QuestionAsked
from smachpy.exceptions import MissionError
from smachpy.states.ask_operator import AskOperator
from smachpy.states.questions import (
    MAX_PICTURE_BYTES,
    AnswerRefusedError,
    Inbox,
    fetch_picture,
    find_questions,
    give_answer,
    read_picture,
)

PNG = b"\x89PNG\r\n\x1a\n and so on"
ANSWERS = {"yes": "Yes, hand over", "no": ""}


def asking(**options):
    state = AskOperator("Go on?", options.pop("answers", ANSWERS), patience=30.0, **options)
    sm = smachpy.StateMachine(state.get_registered_outcomes(), name="JOB")
    with sm:
        sm.add("ASK", state)
    return sm


@pytest.fixture
def heard():
    return []


@pytest.fixture
def ask(mission, heard):
    """`ask(machine, at, operator)`: run it; `operator(node)` is somebody else, that late."""

    def ask(machine, at, operator):
        machine.subscribe(lambda e: heard.append(e) if e.path == "/JOB/ASK" else None)
        failed = []

        def act():
            with Node("hand", transport=mission.network.session(), clock=mission.clock) as node:
                mission.clock.sleep(at)
                try:
                    operator(node)
                except Exception as error:
                    failed.append(error)

        task = mission.clock.spawn(act, name="operator")
        run = mission(machine)
        task.join(5.0)
        assert not failed, failed
        return run

    return ask


def only(heard, kind):
    (event,) = (event for event in heard if isinstance(event, kind))
    return event


def test_a_question_is_found_answered_and_recorded_with_who_answered(ask, heard):
    seen = []

    def operator(node):
        seen.extend(find_questions(node))
        give_answer(seen[0].service, "YES", "ann", node=node)
        assert find_questions(node) == []

    run = ask(asking(default="no"), 4.0, operator)
    assert (run.outcome, run.duration) == ("yes", 4.0)
    (question,) = seen
    assert (question.path, question.text, question.left) == ("/JOB/ASK", "Go on?", 26.0)
    assert (question.answers, question.words) == (("yes", "no"), ("Yes, hand over", ""))
    asked = only(heard, QuestionAsked)
    assert (asked.service, asked.default, asked.patience) == (question.service, "no", 30.0)
    answered = only(heard, QuestionAnswered)
    assert (answered.answer, answered.by) == ("yes", "ann")


@pytest.mark.parametrize("answer", ["yse", "", " ", "no_answer"])
def test_an_answer_that_is_none_is_refused_and_the_question_stays(ask, answer):
    def operator(node):
        (question,) = find_questions(node)
        with pytest.raises(AnswerRefusedError) as refused:
            give_answer(question.service, answer, "ann", node=node)
        assert refused.value.answer == answer
        give_answer(question.service, "no", "ann", node=node)

    assert ask(asking(), 1.0, operator).outcome == "no"


def test_nobody_answers_and_the_default_counts(mission, heard):
    machine = asking(default="no")
    machine.subscribe(heard.append)
    run = mission(machine)
    assert (run.outcome, run.duration) == ("no", 30.0)
    answered = only(heard, QuestionAnswered)
    assert (answered.answer, answered.by) == ("no", "")
    assert machine["ASK"].get_registered_outcomes() == ("yes", "no", "preempted")


def test_a_preempt_is_no_answer(mission, heard):
    machine = asking()
    machine.subscribe(heard.append)
    mission.preempt(at=2.0)
    assert mission(machine).outcome == "preempted"
    assert not [event for event in heard if isinstance(event, QuestionAnswered)]


def test_an_answer_on_the_topic_says_that_it_came_from_there(mission, heard):
    mission.topic("operator/answer", String).publish_at(2.0, String("yes"))
    machine = asking()
    machine.subscribe(heard.append)
    mission(machine)
    assert only(heard, QuestionAnswered).by == "the topic operator/answer"


def test_an_answer_to_a_question_that_is_over_is_refused(ask):
    def operator(node):
        (question,) = find_questions(node)
        give_answer(question.service, "no", "ann", node=node)
        node.clock.sleep(1.0)
        with pytest.raises(AnswerRefusedError, match="nobody asks that any more"):
            give_answer(question.service, "yes", "bob", node=node)
        assert fetch_picture(question.service, node=node) is None

    assert ask(asking(), 1.0, operator).outcome == "no"


def test_of_many_answers_at_once_one_wins():
    """With real threads: each of them answers, one is told that it counts."""
    together = threading.Barrier(8)
    inbox = Inbox("/JOB/ASK", ["yes", "no"], lambda: None)
    won, lost = [], []

    def answer(number):
        together.wait(60.0)
        try:
            won.append((inbox.take("yes" if number % 2 else "no", str(number)), str(number)))
        except AnswerRefusedError as error:
            lost.append(error.reason)

    threads = [threading.Thread(target=answer, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert won == [inbox.answer]
    assert len(lost) == 7
    assert all(f"answered {won[0][0]!r} by {won[0][1]}" in reason for reason in lost)
    assert inbox.close("no_answer") == won[0]


def test_after_its_time_a_question_takes_no_answer():
    inbox = Inbox("/JOB/ASK", ["yes", "no"], lambda: None)
    assert inbox.close("no") == ("no", "")
    with pytest.raises(AnswerRefusedError, match="it is over: 'no'"):
        inbox.take("yes", "ann")


def test_the_question_may_be_made_of_userdata_and_have_a_picture(ask, heard):
    pictures = []

    def operator(node):
        (question,) = find_questions(node)
        assert question.text == "Hand over at lab?"
        pictures.append(fetch_picture(question.service, node=node))
        give_answer(question.service, "yes", "ann", node=node)

    state = AskOperator(
        lambda userdata: f"Hand over at {userdata.place}?",
        patience=30.0,
        picture="seen",
        input_keys=["place"],
    )
    sm = smachpy.StateMachine(state.get_registered_outcomes(), name="JOB")
    sm.userdata.place, sm.userdata.seen = "lab", CompressedImage(format="png", data=PNG)
    with sm:
        sm.add("ASK", state)
    assert ask(sm, 1.0, operator).outcome == "yes"
    assert pictures == [("image/png", PNG)]
    assert only(heard, QuestionAsked).has_picture


@pytest.mark.parametrize(
    "picture",
    [
        lambda _: 1 / 0,
        lambda _: b"<svg onload=alert(1)>",
        lambda _: PNG + bytes(MAX_PICTURE_BYTES),
        lambda _: 7,
        lambda _: "/nowhere/picture.png",
    ],
)
def test_a_picture_that_cannot_be_read_keeps_no_question_back(ask, heard, picture, caplog):
    def operator(node):
        (question,) = find_questions(node)
        assert fetch_picture(question.service, node=node) is None
        give_answer(question.service, "yes", "ann", node=node)

    with caplog.at_level(logging.WARNING):
        assert ask(asking(picture=picture), 1.0, operator).outcome == "yes"
    assert "The question is asked without it." in caplog.text
    assert not only(heard, QuestionAsked).has_picture


def test_pictures_are_told_by_their_bytes(tmp_path):
    file = tmp_path / "seen.txt"
    file.write_bytes(b"\xff\xd8\xff\xe0")
    assert read_picture(file) == ("image/jpeg", b"\xff\xd8\xff\xe0")
    assert read_picture(bytearray(b"GIF89a"))[0] == "image/gif"


@pytest.mark.parametrize(
    "arguments",
    [
        {"answers": [1, 2], "patience": 5.0},
        {"answers": {"yes": 7}, "patience": 5.0},
        {"patience": "5"},
        {"patience": None},
    ],
)
def test_arguments_of_other_kinds_are_refused(arguments):
    with pytest.raises(MissionError, match=r"got .*; expected"):
        AskOperator("Go on?", **arguments)


@pytest.mark.parametrize("default", ["maybe", "preempted", "", None])
def test_a_default_that_is_no_answer_is_refused(default):
    with pytest.raises(MissionError, match="default: got"):
        AskOperator("Go on?", patience=5.0, default=default)
