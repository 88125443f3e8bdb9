"""What an expression may be, and what it takes."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import NamedTuple

import pytest

from actionlib_core.inputs.expression import Expression, ExpressionError, MissingNameError
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID

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
    assert bool(Expression(expression)(POSE)) is wanted


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
        ("*ranges", "expected"),
        ("data >", "invalid syntax; expected an expression such as 'data > 3'."),
        ("", "expected"),
        ("data = 3", "expected"),
        ("import os", "expected"),
        ("\0", "expected"),
        ("-" * 60 + "1", "nested deeper than 40"),
        ("(" * 500 + "1" + ")" * 500, "expected"),
        ("1+" * 600 + "1", "got 1201 characters; expected 1000 at most."),
    ],
)
def test_what_is_refused_when_it_is_parsed(expression, text):
    with pytest.raises(ExpressionError) as caught:
        Expression(expression)
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
def test_what_does_not_fit_the_values(expression, text):
    with pytest.raises(ExpressionError) as caught:
        Expression(expression)(POSE)
    assert text in str(caught.value)


def test_the_place_is_shown():
    with pytest.raises(ExpressionError) as caught:
        Expression("data > 3 and dat < 4")(POSE)
    assert str(caught.value).splitlines()[1:] == ["  data > 3 and dat < 4", "               ^"]


def test_a_field_called_like_the_whole_message_is_the_field():
    assert Expression("m == 3")({"m": 3})


@dataclass
class Arm:
    length: float
    joints: list[float]

    @property
    def secret(self):
        raise AssertionError("code ran")


class Link(NamedTuple):
    name: str
    length: float


class Odd:
    def __getattr__(self, name):
        raise AssertionError("code ran")

    def __getitem__(self, name):
        raise AssertionError("code ran")


VALUES = {
    "arm": Arm(0.5, [1.0, 2.0]),
    "link": Link("hand", 0.1),
    "goal": GoalID(id="g1"),
    "odd": Odd(),
    "n": 3,
}


@pytest.mark.parametrize(
    "text",
    ["arm.length < 1", "arm.joints[1] == 2", "link.name == 'hand'", "goal.id == 'g1'", "m.n == 3"],
)
def test_fields_of_plain_data_are_read(text):
    assert Expression(text)(VALUES)


@pytest.mark.parametrize(
    "text", ["arm.secret", "odd.x", "odd[0]", "link.count", "goal.to_dict", "n.real"]
)
def test_no_other_attribute_is_read_as_it_might_be_code(text):
    with pytest.raises(ExpressionError):
        Expression(text)(VALUES)


@pytest.mark.parametrize(
    "text",
    [
        "'a' * 30000000000 == 'b'",
        "'%030000000000d' % n == ''",
        "[0] * 10000000000 == [1]",
        "n * [0] == [1]",
        "'a' % n",
        " + ".join(["'" + "a" * 90 + "'"] * 10) + " + m.text",
        "9999999999 * " * 60 + "1",
        "1e308 * 10",
        "[[1], [2]] + [3] * 9",
    ],
)
def test_no_expression_takes_much_memory(text):
    with pytest.raises(ExpressionError):
        Expression(text)({"n": 3, "text": "a" * 100_000})


def test_a_name_that_is_not_there_is_told_apart():
    with pytest.raises(MissingNameError, match="'gone' is not there"):
        Expression("n > 1 and gone > 1")({"n": 3})
    assert Expression("len(gone) + m.n > max(n, 2)").names == {"gone", "m", "n"}


def test_an_expression_may_be_evaluated_inside_another_and_in_threads():
    inner = Expression("x + 1")

    class Asks(dict):
        def __getitem__(self, key):
            return inner({"x": 1}) if key == "asked" else super().__getitem__(key)

    outer = Expression("asked + y == 5 and y == 3")
    assert outer(Asks(asked=0, y=3))
    results = []
    threads = [
        threading.Thread(target=lambda n=n: results.append(Expression("x")({"x": n}) == n))
        for n in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == [True] * 8
