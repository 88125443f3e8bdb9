"""`topic echo --filter`: what an expression may be."""

from __future__ import annotations

import pytest

from actionlib_core.cli._filter import Filter, FilterError

POSE = {
    "data": 5,
    "name": "dock",
    "ok": True,
    "pose": {"position": {"x": 3.0, "y": 4.0}},
    "ranges": [1.0, 2.0, 0.5],
}


@pytest.mark.parametrize(
    ("expression", "wanted"),
    [
        ("data > 3", True),
        ("3 < data < 5", False),
        ("m.data == 5", True),
        ("data % 2 == 1 and not ok", False),
        ("ok or missing", True),
        ("pose.position.x + pose.position.y >= 7", True),
        ("hypot(pose.position.x, pose.position.y) == 5.0", True),
        ("min(ranges) < 0.6 and len(ranges) == 3", True),
        ("ranges[-1] == 0.5", True),
        ("name in ['dock', 'lab']", True),
        ("name + 's' != 'docks'", False),
        ("'oc' in name", True),
        ("name not in ('dock',)", False),
        ("-data // 2 == -3", True),
        ("data / 2 * 2 - 5", False),
        ("  data", True),
    ],
)
def test_what_can_be_said(expression, wanted):
    assert Filter(expression)(POSE) is wanted


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        ("__import__('os').system('true')", "this call is not allowed; expected one of ['abs'"),
        ("data.__class__", "'__class__' is not allowed"),
        ("open('/etc/passwd')", "this call is not allowed"),
        ("len(x=1)", "this call is not allowed"),
        ("(lambda: 1)()", "this call is not allowed"),
        ("[x for x in ranges]", "ListComp is not allowed"),
        ("f'{data}'", "JoinedStr is not allowed"),
        ("(data := 3)", "NamedExpr is not allowed"),
        ("data ** 9", "operator Pow is not allowed"),
        ("1 << 100000", "operator LShift is not allowed"),
        ("data is None", "operator Is is not allowed"),
        ("b'x' == data", "Constant is not allowed"),
        ("ranges[0:1]", "Slice is not allowed"),
        ("*ranges", "--filter: "),
        ("data >", "invalid syntax; expected an expression such as 'data > 3'."),
        ("", "--filter: "),
        ("data = 3", "--filter: "),
        ("import os", "--filter: "),
        ("\0", "--filter: "),
        ("-" * 60 + "1", "nested deeper than 40"),
        ("(" * 500 + "1" + ")" * 500, "--filter: "),
        ("1+" * 600 + "1", "got 1201 characters; expected 1000 at most."),
    ],
)
def test_what_is_refused_before_the_first_message(expression, text):
    with pytest.raises(FilterError) as caught:
        Filter(expression)
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        ("pose.position.z > 1", "'z' is not there; there are ['x', 'y']."),
        ("dat > 1", "'dat' is not there; there are ['data', 'name', 'ok', 'pose', 'ranges']."),
        ("data.x", "'x' is not there; there are no fields."),
        ("ranges[7]", "IndexError"),
        ("name > 3", "TypeError"),
        ("data / 0", "ZeroDivisionError"),
        ("name * 1000000", "expected two numbers."),
        ("ranges + data", "expected two numbers."),
        ("1e200 * 1e200 > data", "the number is too large."),
        ("sqrt(0 - data)", "ValueError"),
    ],
)
def test_what_does_not_fit_a_message(expression, text):
    with pytest.raises(FilterError) as caught:
        Filter(expression)(POSE)
    assert text in str(caught.value)


def test_the_place_is_shown():
    with pytest.raises(FilterError) as caught:
        Filter("data > 3 and dat < 4")(POSE)
    assert str(caught.value).splitlines()[1:] == ["  data > 3 and dat < 4", "               ^"]


def test_a_field_called_like_the_whole_message_is_the_field():
    assert Filter("m == 3")({"m": 3})
