"""The bytes written and read by hand are those of the message classes."""

from __future__ import annotations

import hypothesis.strategies as st
import pytest
from hypothesis import given

from actionlib_core.goal.ports import StatusEntry
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.time import Time
from actionlib_core.wire import actions as wire

stamps = st.integers(0, (2**32 - 1) * 10**9)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
# Programs for ROS 1 also send Latin-1, and texts that are cut within a character.
texts |= st.binary(max_size=12).map(lambda raw: raw.decode("utf-8", "surrogateescape"))
entries = st.builds(StatusEntry, texts, stamps, st.integers(0, 9), texts)


def header(stamp_ns):
    return Header(stamp=Time(0, stamp_ns))


def status(entry):
    goal_id = GoalID(stamp=Time(0, entry.stamp_ns), id=entry.id)
    return GoalStatus(goal_id=goal_id, status=entry.status, text=entry.text)


@given(stamps, texts, stamps, st.integers(-(2**31), 2**31 - 1), texts)
def test_goal(sent, goal_id, stamp, number, server):
    goal = msg.TestGoal(number)
    payload = wire.pack_goal(sent, goal_id, stamp, goal.to_bytes(), server)
    message = msg.TestActionGoal(
        header=Header(stamp=Time(0, sent), frame_id=server),
        goal_id=GoalID(stamp=Time(0, stamp), id=goal_id),
        goal=goal,
    )
    assert payload == message.to_bytes()
    assert wire.unpack_goal(payload) == (goal_id, stamp, goal.to_bytes())
    assert wire.unpack_frame(payload) == server


@pytest.mark.parametrize(
    ("seq", "frame", "wanted"),
    [
        (1, "token", True),
        (0, "token", False),
        (2, "token", False),
        (1, "", False),
        (1, "map", False),
    ],
)
def test_a_goal_says_that_it_is_to_be_cancelled_with_its_client(seq, frame, wanted):
    """Programs for ROS 1 count their messages in `seq`, and may fill in a frame."""
    message = msg.TestActionGoal(header=Header(seq=seq, frame_id=frame))
    assert wire.unpack_cancel_if_lost(message.to_bytes(), "token") is wanted
    packed = wire.pack_goal(0, "", 0, msg.TestGoal().to_bytes(), frame, cancel_if_lost=seq == 1)
    assert wire.unpack_cancel_if_lost(packed, "token") is wanted


@given(stamps, texts, stamps)
def test_age_of_a_goal_is_what_its_client_says(sent, goal_id, stamp):
    payload = wire.pack_goal(sent, goal_id, stamp, b"")
    known = stamp > 0 and sent > stamp
    assert wire.unpack_age(payload, stamp) == ((sent - stamp) / 10**9 if known else 0.0)


@given(texts, stamps)
def test_goal_id(goal_id, stamp):
    payload = wire.pack_goal_id(goal_id, stamp)
    assert payload == GoalID(stamp=Time(0, stamp), id=goal_id).to_bytes()
    assert wire.unpack_goal_id(payload) == (goal_id, stamp)


@given(stamps, entries, st.integers(-9, 9))
def test_report(sent, entry, number):
    body = msg.TestResult(number).to_bytes()
    payload = wire.pack_report(sent, entry, body)
    message = msg.TestActionResult(
        header=header(sent), status=status(entry), result=msg.TestResult(number)
    )
    assert payload == message.to_bytes()
    found, start = wire.unpack_report(payload)
    assert (found, payload[start:]) == (entry, body)


@given(stamps, texts)
def test_farewell_is_a_status_list_with_a_frame(sent, frame):
    payload = wire.pack_statuses(sent, [], frame)
    filled = Header(stamp=Time(0, sent), frame_id=frame)
    assert payload == GoalStatusArray(header=filled).to_bytes()
    assert wire.unpack_frame(payload) == frame
    assert wire.unpack_statuses(payload) == []


@given(stamps, st.lists(entries, max_size=5))
def test_statuses(sent, found):
    payload = wire.pack_statuses(sent, found)
    message = GoalStatusArray(header=header(sent), status_list=[status(e) for e in found])
    assert payload == message.to_bytes()
    assert wire.unpack_statuses(payload) == found


@given(entries)
def test_single_status(entry):
    assert wire.unpack_status(wire.pack_status(entry)) == entry
    assert wire.pack_status(entry) == status(entry).to_bytes()


def test_a_frame_id_of_a_foreign_server_is_skipped():
    message = msg.TestActionResult(
        header=Header(frame_id="map", seq=7), status=status(StatusEntry("g", 1, 3, "fine"))
    )
    payload = message.to_bytes()
    entry, start = wire.unpack_report(payload)
    assert (entry.id, entry.status, payload[start:]) == ("g", 3, msg.TestResult().to_bytes())


@given(st.data(), entries)
def test_bytes_that_end_too_early_raise_value_error(data, entry):
    payload = wire.pack_statuses(1, [entry])
    cut = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(ValueError, match=f"got {cut} bytes"):
        wire.unpack_statuses(payload[:cut])


@given(st.binary(max_size=60))
def test_noise_never_raises_anything_else(payload):
    for read in (
        wire.unpack_goal,
        wire.unpack_goal_id,
        wire.unpack_report,
        wire.unpack_status,
        wire.unpack_statuses,
    ):
        try:
            read(payload)
        except ValueError:
            continue
