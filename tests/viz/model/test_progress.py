from __future__ import annotations

from types import SimpleNamespace as Message

import pytest

from smachpy_viz.model.progress import (
    GoalProgress,
    Written,
    progress_of,
    seconds_left,
    written_progress,
)


def pose(x, y):
    return Message(pose=Message(position=Message(x=x, y=y)))


def progress(goal, first, now):
    return progress_of(goal, now, first)


def test_without_feedback_there_is_nothing_to_tell():
    assert progress(None, None, None) == GoalProgress()


def test_the_way_left_of_move_base_is_measured_to_the_target():
    goal = Message(target_pose=pose(3.0, 4.0))
    found = progress(goal, Message(base_position=pose(0, 0)), Message(base_position=pose(3.0, 3.0)))
    assert found.distance == pytest.approx(1.0)
    assert found.fraction == pytest.approx(0.8)


def test_distances_between_two_frames_mean_nothing():
    goal = Message(target_pose=pose(3.0, 4.0))
    goal.target_pose.header = Message(frame_id="base_link")
    here = Message(base_position=pose(20.0, 0.0))
    here.base_position.header = Message(frame_id="map")
    assert progress(goal, here, here).distance is None
    goal.target_pose.header.frame_id = "/map"
    assert progress(goal, here, here).distance == pytest.approx(17.46, abs=0.01)


@pytest.mark.parametrize(
    ("first", "now", "fraction"),
    [
        (Message(percent=10.0), Message(percent=50), 0.5),
        (Message(progress=0.0), Message(progress=0.25), 0.25),
        (Message(distance_remaining=8.0), Message(distance_remaining=2.0), 0.75),
        (Message(remaining=10), Message(remaining=9), 0.1),
        (Message(distance_remaining=2.0), Message(distance_remaining=8.0), 0.0),
        (Message(distance_remaining=0.0), Message(distance_remaining=0.0), None),
        (Message(percent=float("nan")), Message(percent=float("inf")), None),
        (Message(progress=True), Message(progress="half"), None),
        (Message(), Message(), None),
        ("text", "text", None),
    ],
)
def test_progress_is_read_from_the_usual_fields(first, now, fraction):
    assert progress(None, first, now).fraction == (
        None if fraction is None else pytest.approx(fraction)
    )


def test_durations_count_in_seconds():
    def left(seconds):
        return Message(time_left=Message(to_sec=lambda: seconds))

    assert progress(None, left(4.0), left(1.0)).fraction == pytest.approx(0.75)


def test_texts_and_small_values_are_shown():
    assert progress(None, 1, Message(text="re-planning")).text == "re-planning"
    assert progress(None, 1, Message(cycle=3, speed=0.25, pose=object())).text == (
        "cycle 3, speed 0.25"
    )


def test_the_only_text_is_shown_alone_when_it_is_a_phrase():
    turning = Message(feedback="turned 10 deg, 80 deg left", left=80.0)
    assert progress(None, 1, turning).text == "turned 10 deg, 80 deg left"
    assert progress(None, 1, Message(doing="to the pickup", pose=object())).text == "to the pickup"
    assert progress(None, 1, Message(room="lab", left=2)).text == "room lab, left 2"
    assert progress(None, 1, Message(a="to the", b="lab 2")).text == "a to the, b lab 2"


def test_slots_are_read_too():
    class Slotted:
        __slots__ = ("_hidden", "count")

        def __init__(self):
            self.count = 7
            self._hidden = 1

    assert progress(None, None, Slotted()).text == "count 7"


def test_messages_that_raise_are_left_out():
    class Bad:
        @property
        def text(self):
            raise RuntimeError

        @property
        def distance(self):
            raise KeyError

        def __getattr__(self, name):
            raise ValueError(name)

    assert progress(Bad(), Bad(), Bad()) == GoalProgress()


@pytest.mark.parametrize(
    ("feedback", "fraction"),
    [
        ({"$msg": "x/F", "fields": {"left": 2}}, 0.5),
        ({"$msg": "x/F", "fields": {"time_left": {"secs": 0, "nsecs": 500_000_000}}}, 0.875),
        ({"left": 1}, 0.75),
        ({"$msg": "x/F", "fields": "too long to be recorded"}, None),
        ({"time_left": {"secs": "no", "nsecs": 0}, 3: "number"}, None),
        ("text of a value that JSON does not know", None),
    ],
)
def test_records_of_messages_are_read_as_messages(feedback, fraction):
    first = {"$msg": "x/F", "fields": {"left": 4}}
    assert progress({"$msg": "x/G", "fields": {}}, first, feedback).fraction == fraction


def test_control_characters_never_reach_the_terminal():
    assert "\x1b" not in progress(None, 1, Message(text="\x1b[2J cleared")).text


@pytest.mark.parametrize(
    ("feedback", "fraction", "now", "left"),
    [
        (Message(seconds_left=7.0), 0.5, 10.0, 7.0),  # the server knows best
        (Message(time_remaining=-1.0), None, 10.0, 0.0),
        (Message(), 0.25, 10.0, 30.0),
        (Message(), 1.0, 10.0, 0.0),
        (Message(), 0.01, 10.0, None),  # too little is done to tell
        (Message(), 0.5, 0.5, None),
        (Message(), None, 10.0, None),
        (None, None, 10.0, None),
    ],
)
def test_the_time_left_is_said_by_the_server_or_estimated(feedback, fraction, now, left):
    found = seconds_left(feedback, fraction, now)
    assert found == (None if left is None else pytest.approx(left))


def test_a_mission_s_own_word_about_its_progress():
    told = Message(fraction=1.5, seconds_left=41.0, text="2/4 kitchen")
    assert written_progress(told) == Written(1.0, 41.0, "2/4 kitchen")
    endless = Message(fraction=None, seconds_left=None, text="7 kitchen")
    assert written_progress(endless) == Written(None, None, "7 kitchen")


@pytest.mark.parametrize(
    "value", [None, 3, "text", Message(text="a"), Message(fraction=1, seconds_left=1, text=3)]
)
def test_other_values_are_no_progress(value):
    assert written_progress(value) is None
