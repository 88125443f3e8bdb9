"""Attachments: those of real nodes, and that nothing leaves here of which one would die."""

from __future__ import annotations

import json
import struct
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.wire.ros2.attachment import (
    Attachment,
    Numbering,
    answer_to,
    pack_attachment,
    unpack_attachment,
)
from tests.places import DATA

GOLDEN = [json.loads(line) for line in (DATA / "ros2_golden.jsonl").read_text().splitlines()]
CAPTURED = [
    (line[front + "attachment"], line[front + "attachment_values"])
    for line in GOLDEN
    for front in ("", "request_", "reply_")
    if line.get(front + "attachment")
]
INT64 = st.integers(0, 2**63 - 1)
GID = st.binary(min_size=16, max_size=16)


def test_real_ones_read_and_write_back() -> None:
    assert len(CAPTURED) > 60
    for raw, values in CAPTURED:
        attachment = unpack_attachment(bytes.fromhex(raw))
        assert attachment == (
            values["sequence"],
            values["timestamp_ns"],
            bytes.fromhex(values["gid"]),
        )
        assert pack_attachment(attachment).hex() == raw


@given(INT64, INT64, GID, st.binary(max_size=8))
def test_every_one_survives(sequence: int, time_ns: int, gid: bytes, more: bytes) -> None:
    attachment = Attachment(sequence, time_ns, gid)
    raw = pack_attachment(attachment)
    assert len(raw) == 33
    assert raw[16] == 16
    assert unpack_attachment(raw + more) == attachment


@given(st.integers(), st.integers(), st.binary(max_size=40))
def test_what_kills_a_node_is_not_packed(sequence: int, time_ns: int, gid: bytes) -> None:
    fits = 0 <= sequence < 2**63 and 0 <= time_ns < 2**63 and len(gid) == 16
    try:
        raw = pack_attachment(Attachment(sequence, time_ns, gid))
    except ValueError:
        assert not fits
    else:
        assert fits
        unpack_attachment(raw)


@given(st.binary(max_size=60))
def test_any_bytes_are_an_attachment_or_a_value_error(raw: bytes) -> None:
    try:
        attachment = unpack_attachment(raw)
    except ValueError:
        return
    assert raw.startswith(pack_attachment(attachment))


@pytest.mark.parametrize("raw", [
    None, b"", bytes(32), bytes(33), struct.pack("<qqB16s", -1, 0, 16, bytes(16)),
    struct.pack("<qqB16s", 1, -1, 16, bytes(16)), struct.pack("<qqB16s", 1, 1, 15, bytes(16)),
])  # fmt: skip
def test_what_is_none(raw: bytes | None) -> None:
    with pytest.raises(ValueError, match=r"attachment: .*expected"):
        unpack_attachment(raw)


@given(INT64, INT64, GID, st.integers())
def test_an_answer_has_the_number_and_gid_of_its_request(
    sequence: int, sent: int, gid: bytes, now: int
) -> None:
    now = min(now, 2**63 - 1)
    answer = unpack_attachment(answer_to(Attachment(sequence, sent, gid), now))
    assert answer == (sequence, max(0, now), gid)


def test_numbers_are_never_given_twice() -> None:
    numbering = Numbering(bytes(range(16)))
    taken: list[bytes] = []

    def take() -> None:
        taken.extend(numbering.take(-5)[1] for _ in range(500))

    threads = [threading.Thread(target=take) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    attachments = [unpack_attachment(raw) for raw in taken]
    assert sorted(attachment.sequence for attachment in attachments) == list(range(1, 2001))
    assert {(attachment.time_ns, attachment.gid) for attachment in attachments} == {
        (0, bytes(range(16)))
    }


@pytest.mark.parametrize("gid", [b"", bytes(15), bytes(17)])
def test_a_gid_of_another_length_is_refused_at_once(gid: bytes) -> None:
    with pytest.raises(ValueError, match="gid"):
        Numbering(gid)
