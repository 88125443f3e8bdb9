from __future__ import annotations

import argparse

import pytest

from actionlib_core.command_line.numbers import between, count, finite, rate, seconds, size


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "one", ""])
@pytest.mark.parametrize("kind", [finite, seconds, rate])
def test_real_numbers_are_finite(kind, text):
    with pytest.raises(argparse.ArgumentTypeError, match=f"got '{text}'; expected"):
        kind(text)


@pytest.mark.parametrize("kind", [seconds, rate])
def test_times_and_rates_are_above_zero(kind):
    assert kind("0.5") == 0.5
    for text in ("0", "-1"):
        with pytest.raises(argparse.ArgumentTypeError, match="above 0"):
            kind(text)


@pytest.mark.parametrize(
    ("kind", "text", "expected"),
    [
        (count, "0", "a whole number above 0"),
        (size, "-1", "0 or more"),
        (size, "1.5", "0 or more"),
        (between(-5, 5), "6", "-5 to 5"),
        (between(0), "1_0", "0 or more"),
        (between(0), "9" * 5000, "0 or more"),
    ],
)
def test_whole_numbers_are_in_their_range(kind, text, expected):
    with pytest.raises(argparse.ArgumentTypeError, match=f"expected {expected}"):
        kind(text)


def test_the_ends_of_a_range_belong_to_it():
    assert [between(-5, 5)(text) for text in ("-5", "0", "5")] == [-5, 0, 5]
