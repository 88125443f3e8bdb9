"""Time and Duration behave as rospy's, and mix with float seconds."""

from __future__ import annotations

import copy
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.time import Duration, Time, to_seconds

times = st.integers(0, (2**32 - 1) * 10**9).map(Time.from_nsec)
durations = st.integers(-(2**31) * 10**9, (2**31 - 1) * 10**9).map(Duration.from_nsec)
short = st.integers(-(10**18), 10**18).map(Duration.from_nsec)


def test_construction_forms() -> None:
    assert (Time().secs, Time().nsecs) == (0, 0)
    assert Time(3, 7).to_nsec() == 3_000_000_007
    assert Time(1, 2_500_000_000) == Time(3, 500_000_000)
    assert Time(1.5) == Time.from_sec(1.5) == Time(1, 500_000_000)
    assert Duration(-0.25) == Duration(-1, 750_000_000)
    assert Duration.from_sec(0.1).nsecs == 100_000_000
    assert Time.from_seconds(2) == Time(2)
    assert Time(Duration(2, 1)) == Time(2, 1)


@pytest.mark.parametrize("bad", [("1",), (None,), (-1,), (2**32,), (0, -1)])
def test_time_refuses(bad: tuple[object, ...]) -> None:
    with pytest.raises(TypeError):
        Time(*bad)  # type: ignore[arg-type]


def test_duration_refuses() -> None:
    with pytest.raises(TypeError):
        Duration(2**31)
    with pytest.raises(ValueError, match="one or the other"):
        Duration(1.5, 3)


def test_values_out() -> None:
    stamp = Time(12, 250_000_000)
    assert stamp.to_sec() == stamp.to_time() == float(stamp) == 12.25
    assert repr(stamp) == "Time(12, 250000000)"
    assert str(stamp) == "12250000000"
    assert not Time()
    assert Duration(0, 1)
    assert Duration().is_zero()
    assert not Duration(1).is_zero()


@given(times, short)
def test_time_plus_duration_and_back(stamp: Time, span: Duration) -> None:
    if 0 <= stamp.to_nsec() + span.to_nsec() < 2**32 * 10**9:
        assert stamp + span == span + stamp
        assert (stamp + span) - span == stamp
        assert (stamp + span) - stamp == span


@given(durations, durations)
def test_order_is_that_of_nanoseconds(a: Duration, b: Duration) -> None:
    assert (a < b) == (a.to_nsec() < b.to_nsec())
    assert (a <= b) == (a.to_nsec() <= b.to_nsec())
    assert (a > b) == (a.to_nsec() > b.to_nsec())
    assert (a >= b) == (a.to_nsec() >= b.to_nsec())
    assert (a == b) == (a.to_nsec() == b.to_nsec())
    if a == b:
        assert hash(a) == hash(b)


@given(durations)
def test_nanoseconds_round_trip(span: Duration) -> None:
    assert Duration.from_nsec(span.to_nsec()) == span
    assert 0 <= span.nsecs < 10**9
    assert pickle.loads(pickle.dumps(span)) == span
    assert copy.deepcopy(span) == span


def test_duration_arithmetic() -> None:
    assert Duration(1, 5) + Duration(2, 6) == Duration(3, 11)
    assert Duration(3) - Duration(5) == Duration(-2)
    assert -Duration(1, 1) == Duration(-2, 999_999_999)
    assert abs(Duration(-2)) == Duration(2)
    assert Duration(2) * 3 == 3 * Duration(2) == Duration(6)
    assert Duration(2) * 0.25 == Duration(0.5)
    assert Duration(3) / 2 == Duration(1.5)
    assert Duration(3) / Duration(2) == 1.5
    assert Duration(7) // Duration(2) == 3
    assert Duration(7) // 2 == Duration(3)
    assert Duration(7) % Duration(2) == Duration(1)
    assert divmod(Duration(7), Duration(2)) == (3, Duration(1))


def test_plain_numbers_are_seconds() -> None:
    assert Duration(1) + 0.5 == 0.5 + Duration(1) == Duration(1.5)
    assert Duration(1) - 0.5 == Duration(0.5)
    assert 2 - Duration(0.5) == Duration(1.5)
    assert Time(10) + 0.5 == Time(10.5)
    assert Time(10) - 0.5 == Time(9.5)
    assert Duration(2) < 2.5 < Duration(3)
    assert Duration(2) >= 2
    assert Duration(2) <= 2
    assert Duration(2) > 1


def test_kinds_do_not_mix() -> None:
    assert Time(1) != Duration(1)
    assert Duration(1) != 1
    for wrong in (
        lambda: Time(1) + Time(1),
        lambda: Duration(1) - Time(1),
        lambda: Duration(1) * Duration(1),
        lambda: Time(1) < Duration(1),
        lambda: Duration(1) % 1,
        lambda: divmod(Duration(1), 1),
        lambda: Duration(1) / "a",
        lambda: Duration(1) // "a",
        lambda: Duration(1) + "a",
        lambda: "a" + Duration(1),
        lambda: Duration(1) - "a",
        lambda: "a" - Duration(1),
        lambda: Time(1) - "a",
        lambda: Time(1) >= "a",
        lambda: Time(1) <= "a",
        lambda: Time(1) > "a",
    ):
        with pytest.raises(TypeError):
            wrong()


def test_now_is_the_clocks() -> None:
    clock = VirtualClock()
    with use_clock(clock):
        assert Time.now().to_nsec() == clock.time_ns()


def test_to_seconds() -> None:
    class Foreign:
        def to_sec(self) -> float:
            return 2.5

    assert to_seconds(None) is None
    assert to_seconds(2) == 2.0
    assert to_seconds(Duration(1.5)) == 1.5
    assert to_seconds(Foreign()) == 2.5  # type: ignore[call-overload]
    for bad in ("1", Time(1), object()):
        with pytest.raises(TypeError, match="expected seconds as a number or a Duration"):
            to_seconds(bad)  # type: ignore[call-overload]
