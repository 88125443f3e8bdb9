"""Reading .msg text: what is accepted, and errors with file, line and caret."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces._definition import parse


def error_of(text: str) -> str:
    with pytest.raises(InterfaceError) as caught:
        parse("my_pkg/Thing", text, source="Thing.msg")
    return str(caught.value)


def test_fields_and_types() -> None:
    definition = parse(
        "my_pkg/Thing",
        "Header header\nfloat64[36] cov\nuint8[] data\nOther o\ngeometry_msgs/Pose[2] p\n  time  t \n",
    )
    assert [(f.name, str(f.type)) for f in definition.fields] == [
        ("header", "std_msgs/Header"),
        ("cov", "float64[36]"),
        ("data", "uint8[]"),
        ("o", "my_pkg/Other"),
        ("p", "geometry_msgs/Pose[2]"),
        ("t", "time"),
    ]
    assert (definition.package, definition.short_name) == ("my_pkg", "Thing")


def test_constants() -> None:
    definition = parse(
        "my_pkg/Thing",
        "int32 A=-5\nuint8 B = 0x1F # hex\nfloat32 C=1e-3\nbool D=True\nint8 G=007\n"
        "string E= a # b \nbyte F=-1 # minus\n",
    )
    values = {c.name: (c.value, c.text, c.comment) for c in definition.constants}
    assert values == {
        "A": (-5, "-5", ""),
        "B": (31, "0x1F", "hex"),
        "C": (0.001, "1e-3", ""),
        "D": (True, "True", ""),
        "G": (7, "007", ""),
        "E": ("a # b", "a # b", ""),
        "F": (-1, "-1", "minus"),
    }


def test_comments_go_where_they_belong() -> None:
    definition = parse(
        "my_pkg/Thing",
        "# Of the message,\n# two lines.\n\n# Above a.\nint32 a  # Beside a.\nint32 b\n\n# Stray.\n\nint32 c\n",
    )
    assert definition.comment == "Of the message, two lines."
    assert [f.comment for f in definition.fields] == ["Above a. Beside a.", "", ""]
    assert parse("p/T", "# only\n").comment == "only"
    assert parse("p/T", "# of a\nint32 a\n").comment == ""


def test_keywords_and_own_names_get_an_underscore() -> None:
    definition = parse("p/T", "string in\nint32 serialize\nint32 data\n")
    assert [f.attribute for f in definition.fields] == ["in_", "serialize_", "data"]


@pytest.mark.parametrize(
    ("text", "said", "line", "column"),
    [
        ("int32", "no field name", "int32", 5),
        ("int32 1a", "invalid field name: got '1a'; expected a letter", "int32 1a", 6),
        ("int32 a-b", "invalid field name: got 'a-b'", "int32 a-b", 6),
        ("int32 a\nint32 a", "duplicate name 'a'; line 1 has it already", "int32 a", 6),
        ("int32 A=1\nint32 A", "duplicate name 'A'", "int32 A", 6),
        ("int32 1A=1", "invalid constant name: got '1A'", "int32 1A=1", 6),
        ("int32 a 5", "unexpected '5' behind the field name", "int32 a 5", 8),
        ("float64[ a", "malformed array 'float64['", "float64[ a", 0),
        ("float64[<=3] a", "is ROS 2's", "float64[<=3] a", 0),
        ("string<=5 a", "is ROS 2's", "string<=5 a", 0),
        ("a/b/c d", "malformed type 'a/b/c'", "a/b/c d", 0),
        ("strin$ d", "Did you mean 'string'", "strin$ d", 0),
        ("uint8 A=256", "constant A: got 256; expected 0 to 255 (uint8)", "uint8 A=256", 8),
        ("uint8 A=x", "constant A: got 'x'; expected a whole number", "uint8 A=x", 8),
        ("float32 A=x", "constant A: got 'x'; expected a number", "float32 A=x", 10),
        ("bool A=2", "constant A: got '2'; expected True or False", "bool A=2", 7),
        ("time A=2", "a constant cannot be a time", "time A=2", 0),
        ("int32[] A=2", "a constant cannot be a int32[]", "int32[] A=2", 0),
        ("Pose A=2", "a constant cannot be a my_pkg/Pose", "Pose A=2", 0),
    ],
)
def test_malformed_lines(text: str, said: str, line: str, column: int) -> None:
    message = error_of(text)
    number = text.count("\n") + 1
    assert message.startswith(f"Thing.msg:{number}: ")
    assert said in message
    assert message.splitlines()[-2] == f"    {line}"
    assert message.splitlines()[-1] == " " * (4 + column) + "^"


def test_all_problems_at_once() -> None:
    with pytest.raises(InterfaceError) as caught:
        parse("p/T", "int32 1a\nint32 ok\nint32\nuint8 B=300\n")
    assert len(caught.value.problems) == 3


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        parse("my_pkg/Thing", text)
    except InterfaceError:
        return
