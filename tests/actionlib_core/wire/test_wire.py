"""Encodings: type and checksum of what is sent."""

from __future__ import annotations

import pytest

from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.interfaces.std_msgs.msg import Int32, String
from actionlib_core.wire.encoding import check_encoding, encoding_of, parse_encoding

STRING = "ros1/std_msgs/String;md5=992ce8a1687cec8c8bd883ec73ca41d1"


def test_encoding_is_the_documented_one():
    assert encoding_of(String) == STRING
    assert parse_encoding(STRING) == ("ros1", "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1")


@pytest.mark.parametrize("encoding", [STRING, ""])
def test_fitting_and_missing_encodings_pass(encoding):
    check_encoding(encoding, String, name="chatter")


@pytest.mark.parametrize(
    ("encoding", "found_type", "found_md5"),
    [
        (encoding_of(Int32), "std_msgs/Int32", Int32._md5sum),
        ("ros1/std_msgs/String;md5=00", "std_msgs/String", "00"),
        ("text/plain", "text/plain", ""),
        ("cdr/std_msgs/String;md5=1", "cdr/std_msgs/String;md5=1", "1"),
    ],
)
def test_other_encodings_are_told_with_both_types(encoding, found_type, found_md5):
    with pytest.raises(TypeMismatchError) as caught:
        check_encoding(encoding, String, name="chatter", sender="node 'x'")
    error = caught.value
    assert (error.found_type, error.found_md5) == (found_type, found_md5)
    assert str(error) == (
        f"chatter: types differ: got {found_type!r} (md5 {found_md5}) from node 'x'; expected "
        f"'std_msgs/String' (md5 {String._md5sum}). Try using one type on both ends, or another name."
    )
