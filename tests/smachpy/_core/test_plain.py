"""`only_compares`: which functions may run anywhere, and more than once."""

from __future__ import annotations

from functools import partial

import pytest

from smachpy._core.plain import only_compares

LIMIT = 3
seen = []


def in_words(userdata, message):
    low = userdata.low + 1.0
    if message.percentage is None:
        return True
    return low <= message.percentage < LIMIT and not message.failed


def enclosed(limit):
    return lambda _, message: message.level[0] >= limit or message.name in {"a", "b"}


@pytest.mark.parametrize(
    "function",
    [
        in_words,
        enclosed(3),
        lambda _, m: True,
        lambda _, m: m.x * m.x + m.y**2 < 4.0,
        lambda _, m: -m.x if m.flag else ~m.y,
        lambda _, m: (m.x, m.y) != (0, 0),
        lambda _, m: m.x is not None,
    ],
)
def test_reading_and_comparing_is_plain(function):
    assert only_compares(function)


def writes_a_global(_, message):
    global LIMIT
    LIMIT = message.x
    return True


def writes_an_attribute(userdata, message):
    userdata.x = message.x
    return True


def writes_an_item(userdata, message):
    seen[0] = message.x
    return True


def deletes(userdata, message):
    del userdata.x
    return True


def changes_in_place(userdata, message):
    kept = seen
    kept += [message]
    return True


def counts():
    count = 0

    def function(_, message):
        nonlocal count
        count += 1
        return count < 3

    return function


def loops(_, message):
    while message.x:
        pass
    return True


def goes_through(_, message):
    for x in message.xs:
        seen.append(x)
    return True


def raises(_, message):
    if message.x:
        raise ValueError
    return True


def imports(_, message):
    import math

    return message.x < math.pi


def enters(userdata, message):
    with userdata.lock:
        return True


def yields(_, message):
    yield message.x


async def awaits(_, message):
    return await message.x


@pytest.mark.parametrize(
    "function",
    [
        lambda _, m: abs(m.x) < 3,
        lambda _, m: m.is_ok(),
        lambda _, m: f"{m.x}" == "a",
        lambda _, m: [x + 1 for x in m.xs] == [],
        lambda _, m: (m.x, *m.xs) == (1, 2),
        writes_a_global,
        writes_an_attribute,
        writes_an_item,
        deletes,
        changes_in_place,
        counts(),
        loops,
        goes_through,
        raises,
        imports,
        enters,
        yields,
        awaits,
    ],
)
def test_what_does_more_is_not(function):
    assert not only_compares(function)


class Monitor:
    def check(self, userdata, message):
        return True


@pytest.mark.parametrize("thing", [Monitor().check, Monitor, partial(in_words, 1), len, None, 3])
def test_other_things_are_not(thing):
    assert not only_compares(thing)
