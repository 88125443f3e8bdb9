"""The fronts of ROS 2's action messages: bytes of real nodes, and every one of ours."""

from __future__ import annotations

import contextlib
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.wire.ros2.action_messages import (
    CDR_HEADER,
    CancelRequest,
    CancelResponse,
    GoalState,
    find_states,
    pack_accepted,
    pack_cancel,
    pack_cancel_response,
    pack_id,
    pack_statuses,
    pack_with_id,
    status_in,
    unpack_accepted,
    unpack_cancel,
    unpack_cancel_response,
    unpack_id,
    unpack_statuses,
    unpack_with_id,
    with_status,
)
from tests.places import DATA

GOLDEN = [json.loads(line) for line in (DATA / "ros2_golden.jsonl").read_text().splitlines()]
STATUSES = [
    line for line in GOLDEN if line.get("values", {}).get("status_list") and "payload" in line
]
CALLS = [line for line in GOLDEN if line["kind"] == "call" and "_action" in line["key"]]

uuids = st.binary(min_size=16, max_size=16)
stamps = st.integers(0, (2**31 - 1) * 10**9)
readers = [unpack_with_id, unpack_id, unpack_accepted, unpack_cancel, unpack_cancel_response]
readers += [unpack_statuses, status_in]


def stamp_of(time: dict[str, int]) -> int:
    return time["sec"] * 10**9 + time["nanosec"]


def cleared(raw: str, garbage_at: list[int]) -> bytes:
    """Return captured bytes with zeros where a real node left anything."""
    payload = bytearray.fromhex(raw)
    for place in garbage_at:
        payload[place] = 0
    return bytes(payload)


@pytest.mark.parametrize("line", STATUSES, ids=[str(n) for n in range(len(STATUSES))])
def test_status_lists_of_real_nodes(line: dict[str, Any]) -> None:
    payload = bytes.fromhex(line["payload"])
    goals = unpack_statuses(payload)
    assert goals == [
        GoalState(
            bytes.fromhex(entry["goal_info"]["goal_id"]),
            stamp_of(entry["goal_info"]["stamp"]),
            entry["status"],
        )
        for entry in line["values"]["status_list"]
    ]
    assert unpack_statuses(pack_statuses(goals)) == goals
    if "garbage_in_padding_at" in line:
        assert pack_statuses(goals) == cleared(line["payload"], line["garbage_in_padding_at"])


def answers(line: dict[str, Any]) -> tuple[Any, bytes, Any]:
    """Return what the reply of a call reads as, its bytes written again, and what is expected."""
    raw, values = bytes.fromhex(line["reply"]), line["reply_values"]
    if "send_goal" in line["key"]:
        stamp = unpack_accepted(raw)
        return (
            stamp,
            pack_accepted(stamp),
            stamp_of(values["stamp"]) if values["accepted"] else None,
        )
    if "cancel_goal" in line["key"]:
        answer = unpack_cancel_response(raw)
        goals = tuple(
            (bytes.fromhex(info["goal_id"]), stamp_of(info["stamp"]))
            for info in values["goals_canceling"]
        )
        return answer, pack_cancel_response(answer), CancelResponse(values["return_code"], goals)
    return status_in(raw), with_status(raw, status_in(raw)), values["status"]


@pytest.mark.parametrize("line", CALLS, ids=[line["what"] for line in CALLS])
def test_calls_of_real_nodes(line: dict[str, Any]) -> None:
    request, values = bytes.fromhex(line["request"]), line["request_values"]
    if "cancel_goal" in line["key"]:
        asked = unpack_cancel(request)
        info = values["goal_info"]
        assert asked == (bytes.fromhex(info["goal_id"]), stamp_of(info["stamp"]))
        assert pack_cancel(asked) == request
    else:
        uuid, body = unpack_with_id(request)
        assert uuid.hex() == values["goal_id"]
        assert pack_with_id(uuid, body) == request
        assert unpack_id(request) == uuid
    read, written, expected = answers(line)
    assert read == expected
    garbage = line["garbage_in_padding_at"]
    assert cleared(written.hex(), garbage) == cleared(line["reply"], garbage)


def test_there_are_calls_of_every_kind() -> None:
    assert len(CALLS) > 20
    assert len(STATUSES) > 8


@given(st.lists(st.builds(GoalState, uuids, stamps, st.integers(0, 6)), max_size=20))
def test_status_lists_survive(goals: list[GoalState]) -> None:
    assert unpack_statuses(pack_statuses(goals)) == goals


@given(uuids, stamps, st.binary(max_size=40))
def test_requests_survive(uuid: bytes, stamp_ns: int, body: bytes) -> None:
    assert unpack_with_id(pack_with_id(uuid, CDR_HEADER + body)) == (uuid, CDR_HEADER + body)
    assert unpack_id(pack_id(uuid)) == uuid
    assert unpack_cancel(pack_cancel(CancelRequest(uuid, stamp_ns))) == (uuid, stamp_ns)


@given(
    st.none() | stamps, st.integers(0, 3), st.lists(st.tuples(uuids, stamps), max_size=5).map(tuple)
)
def test_answers_survive(
    stamp: int | None, code: int, goals: tuple[tuple[bytes, int], ...]
) -> None:
    assert unpack_accepted(pack_accepted(stamp)) == stamp
    assert unpack_cancel_response(pack_cancel_response(CancelResponse(code, goals))) == (
        code,
        goals,
    )


@given(st.integers(-(2**80), 2**80))
def test_a_time_that_the_wire_cannot_say_is_the_nearest_that_it_can(stamp_ns: int) -> None:
    latest = 2**31 * 10**9 - 1
    assert unpack_accepted(pack_accepted(stamp_ns)) == max(0, min(stamp_ns, latest))


@pytest.mark.parametrize("read", readers)
@given(raw=st.binary(max_size=70) | st.binary(max_size=70).map(b"\0\1\0\0".__add__))
def test_hostile_bytes_are_a_value_error_or_read(read: Any, raw: bytes) -> None:
    with contextlib.suppress(ValueError):
        read(raw)


def test_big_endian_is_read() -> None:
    uuid = bytes(range(16))
    assert unpack_cancel(b"\0\0\0\0" + uuid + b"\0\0\0\x05\0\0\0\x07") == (uuid, 5_000_000_007)
    one = b"\0\0\0\0" + b"\0\0\0\x01" + uuid + b"\0\0\0\x05\0\0\0\x07\x04"
    assert unpack_statuses(one) == [GoalState(uuid, 5_000_000_007, 4)]
    assert unpack_accepted(b"\0\0\0\0\1\0\0\0\0\0\0\x05\0\0\0\x07") == 5_000_000_007


@pytest.mark.parametrize("uuid", [b"", bytes(15), bytes(17)])
def test_an_id_of_another_length_is_not_written(uuid: bytes) -> None:
    for write in (
        lambda: pack_id(uuid),
        lambda: pack_with_id(uuid, CDR_HEADER),
        lambda: pack_cancel(CancelRequest(uuid, 0)),
        lambda: pack_cancel_response(CancelResponse(0, ((uuid, 0),))),
        lambda: pack_statuses([GoalState(uuid, 0, 1)]),
    ):
        with pytest.raises(ValueError, match="goal id"):
            write()


def test_a_body_that_is_no_cdr_is_not_sent() -> None:
    with pytest.raises(ValueError, match="body"):
        pack_with_id(bytes(16), b"")
    with pytest.raises(ValueError, match="body"):
        pack_with_id(bytes(16), b"\0\0\0\0")


@given(
    st.lists(st.tuples(st.binary(min_size=16, max_size=16), st.integers(0, 6)), max_size=40),
    st.sets(st.integers(0, 45), max_size=25),
    st.booleans(),
)
def test_goals_are_found_in_a_list_as_by_reading_all_of_it(goals, chosen, big_endian) -> None:
    states = dict(goals)
    listed = [GoalState(uuid, 1_500_000_000, code) for uuid, code in states.items()]
    payload = pack_statuses(listed)
    if big_endian:
        payload = b"\x00\x00\x00\x00" + len(listed).to_bytes(4, "big") + payload[8:]
    names = list(states)
    wanted = {names[number] if number < len(names) else bytes([number]) * 16 for number in chosen}
    found = dict(find_states(payload, wanted))
    assert found == {uuid: code for uuid, code in states.items() if uuid in wanted}
    if payload[8:]:
        with pytest.raises(ValueError, match="payload"):
            find_states(payload[:-1], wanted)
