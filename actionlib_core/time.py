"""ROS time: `Time` is a point in time, `Duration` a span, both in whole nanoseconds.

They behave like `rospy.Time` and `rospy.Duration`, and can also be combined with plain numbers,
which are seconds: ``Time.now() + 0.5``, ``Duration(2) < 2.5``,
``float(Duration(1, 500_000_000)) == 1.5``.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Self, SupportsFloat, SupportsInt, TypeAlias, overload

from actionlib_core.clock import current_clock

__all__ = ["Duration", "Time", "TimeValue", "to_seconds"]

_NS = 1_000_000_000
_UINT32 = 0xFFFF_FFFF
_INT32 = 0x7FFF_FFFF


class TimeValue:
    """Base class of `Time` and `Duration`: whole seconds and the nanoseconds past them.

    Args:
        secs: Seconds. A float has its own fraction and excludes `nsecs`.
        nsecs: Nanoseconds of any size; they are carried over to `secs` so that 0 <= nsecs < 1e9.

    Attributes:
        secs: Whole seconds, rounded towards minus infinity.
        nsecs: Nanoseconds past `secs`, 0 to 999 999 999.

    Raises:
        TypeError: An argument is not a number, or the value does not fit ROS's 32 bits.
        ValueError: Float `secs` together with `nsecs`.
    """

    __slots__ = ("nsecs", "secs")
    _range: ClassVar[tuple[int, int]]

    secs: int
    nsecs: int

    def __init__(self, secs: SupportsInt | SupportsFloat = 0, nsecs: int = 0) -> None:
        if not isinstance(secs, int):
            if nsecs:
                raise ValueError(
                    f"{type(self).__name__}: got float secs {secs!r} with nsecs {nsecs!r}; "
                    "expected one or the other"
                )
            secs, nsecs = _split(_number(secs, type(self).__name__))
        self.set(secs, nsecs)

    def set(self, secs: int, nsecs: int) -> None:
        """Change the value in place; arguments as those of the class, but whole numbers."""
        carry, rest = divmod(nsecs, _NS)
        whole = secs + carry
        lowest, highest = self._range
        if not lowest <= whole <= highest:
            raise TypeError(
                f"{type(self).__name__}: got {whole} s; expected {lowest} to {highest} s, "
                "which is what ROS can hold"
            )
        self.secs = whole
        self.nsecs = rest

    @classmethod
    def from_sec(cls, float_secs: SupportsFloat) -> Self:
        """Make one from float seconds, to the nearest nanosecond."""
        return cls(*_split(_number(float_secs, cls.__name__)))

    from_seconds = from_sec

    @classmethod
    def from_nsec(cls, nanoseconds: int) -> Self:
        """Make one from whole nanoseconds."""
        return cls(0, nanoseconds)

    def to_sec(self) -> float:
        """Return float seconds (for present dates, a double is accurate to about 0.2 us)."""
        return self.secs + self.nsecs / 1e9

    def to_nsec(self) -> int:
        """Return whole nanoseconds, exact."""
        return self.secs * _NS + self.nsecs

    def is_zero(self) -> bool:
        """Return whether this is 0 s."""
        return not self

    def __float__(self) -> float:
        return self.to_sec()

    def __bool__(self) -> bool:
        return bool(self.secs or self.nsecs)

    def __hash__(self) -> int:
        return hash((self.secs, self.nsecs))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)):
            return NotImplemented
        return self.secs == other.secs and self.nsecs == other.nsecs

    def __lt__(self, other: object) -> bool:
        nanoseconds = _nanoseconds(other, type(self))
        return NotImplemented if nanoseconds is None else self.to_nsec() < nanoseconds

    def __gt__(self, other: object) -> bool:
        nanoseconds = _nanoseconds(other, type(self))
        return NotImplemented if nanoseconds is None else self.to_nsec() > nanoseconds

    def __le__(self, other: object) -> bool:
        nanoseconds = _nanoseconds(other, type(self))
        return NotImplemented if nanoseconds is None else self.to_nsec() <= nanoseconds

    def __ge__(self, other: object) -> bool:
        nanoseconds = _nanoseconds(other, type(self))
        return NotImplemented if nanoseconds is None else self.to_nsec() >= nanoseconds

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.secs}, {self.nsecs})"

    def __str__(self) -> str:
        return str(self.to_nsec())

    def __reduce__(self) -> tuple[type[Self], tuple[int, int]]:
        return type(self), (self.secs, self.nsecs)


class Duration(TimeValue):
    """A span of time, possibly negative, up to 68 years.

    A negative one has negative `secs` and `nsecs` counting forward: -0.25 s is
    ``Duration(-1, 750_000_000)``, as in ROS.
    """

    __slots__ = ()
    _range = (-_INT32 - 1, _INT32)

    def __neg__(self) -> Duration:
        return Duration(0, -self.to_nsec())

    def __abs__(self) -> Duration:
        return Duration(0, abs(self.to_nsec()))

    @overload
    def __add__(self, other: Time) -> Time: ...
    @overload
    def __add__(self, other: Duration | float) -> Duration: ...
    def __add__(self, other: Time | Duration | float) -> Time | Duration:
        if isinstance(other, Time):
            return Time(0, self.to_nsec() + other.to_nsec())
        nanoseconds = _nanoseconds(other, Duration)
        return NotImplemented if nanoseconds is None else Duration(0, self.to_nsec() + nanoseconds)

    def __radd__(self, other: float) -> Duration:
        nanoseconds = _nanoseconds(other, Duration)
        return NotImplemented if nanoseconds is None else Duration(0, self.to_nsec() + nanoseconds)

    def __sub__(self, other: Duration | float) -> Duration:
        nanoseconds = _nanoseconds(other, Duration)
        return NotImplemented if nanoseconds is None else Duration(0, self.to_nsec() - nanoseconds)

    def __rsub__(self, other: float) -> Duration:
        nanoseconds = _nanoseconds(other, Duration)
        return NotImplemented if nanoseconds is None else Duration(0, nanoseconds - self.to_nsec())

    def __mul__(self, factor: float) -> Duration:
        if isinstance(factor, int):
            return Duration(0, self.to_nsec() * factor)
        if isinstance(factor, float):
            return Duration.from_sec(self.to_sec() * factor)
        return NotImplemented

    __rmul__ = __mul__

    @overload
    def __truediv__(self, other: Duration) -> float: ...
    @overload
    def __truediv__(self, other: float) -> Duration: ...
    def __truediv__(self, other: Duration | float) -> Duration | float:
        if isinstance(other, Duration):
            return self.to_nsec() / other.to_nsec()
        if isinstance(other, (int, float)):
            return Duration.from_sec(self.to_sec() / other)
        return NotImplemented

    @overload
    def __floordiv__(self, other: Duration) -> int: ...
    @overload
    def __floordiv__(self, other: float) -> Duration: ...
    def __floordiv__(self, other: Duration | float) -> Duration | int:
        if isinstance(other, Duration):
            return self.to_nsec() // other.to_nsec()
        if isinstance(other, (int, float)):
            return Duration.from_sec(self.to_sec() // other)
        return NotImplemented

    def __mod__(self, other: Duration) -> Duration:
        if not isinstance(other, Duration):
            return NotImplemented
        return Duration(0, self.to_nsec() % other.to_nsec())

    def __divmod__(self, other: Duration) -> tuple[int, Duration]:
        if not isinstance(other, Duration):
            return NotImplemented
        return self // other, self % other


class Time(TimeValue):
    """A point in time since the Unix epoch, 1970 to 2106; 0 means "not set"."""

    __slots__ = ()
    _range = (0, _UINT32)

    @classmethod
    def now(cls) -> Self:
        """Return the time of the current clock (`actionlib_core.clock.current_clock`)."""
        return cls(0, current_clock().time_ns())

    def to_time(self) -> float:
        """Return float seconds since the epoch, the same as `to_sec`."""
        return self.to_sec()

    def __add__(self, other: Duration | float) -> Time:
        nanoseconds = _nanoseconds(other, Duration)
        return NotImplemented if nanoseconds is None else Time(0, self.to_nsec() + nanoseconds)

    __radd__ = __add__

    @overload
    def __sub__(self, other: Time) -> Duration: ...
    @overload
    def __sub__(self, other: Duration | float) -> Time: ...
    def __sub__(self, other: Time | Duration | float) -> Time | Duration:
        if isinstance(other, Time):
            return Duration(0, self.to_nsec() - other.to_nsec())
        nanoseconds = _nanoseconds(other, Duration)
        return NotImplemented if nanoseconds is None else Time(0, self.to_nsec() - nanoseconds)


_Seconds: TypeAlias = "float | Duration"


@overload
def to_seconds(duration: None) -> None: ...
@overload
def to_seconds(duration: _Seconds) -> float: ...
@overload
def to_seconds(duration: _Seconds | None) -> float | None: ...
def to_seconds(duration: _Seconds | None) -> float | None:
    """Return the float seconds of a duration given as a number or a `Duration`.

    Args:
        duration: Seconds, a `Duration` or another object with `to_sec()`, or None.

    Raises:
        TypeError: `duration` is none of these.
    """
    if duration is None:
        return None
    if isinstance(duration, (float, int)):
        return float(duration)
    return _number(duration, "duration")


def _number(value: Any, where: str) -> float:
    if hasattr(value, "to_sec") and not isinstance(value, Time):
        return float(value.to_sec())
    if isinstance(value, (str, Time)) or not hasattr(value, "__float__"):
        raise TypeError(f"{where}: got {value!r}; expected seconds as a number or a Duration")
    return float(value)


def _split(seconds: float) -> tuple[int, int]:
    """Split float seconds into whole seconds and nanoseconds."""
    if not math.isfinite(seconds):
        raise ValueError(f"seconds: got {seconds}; expected a finite number")
    whole = int(seconds // 1)
    return whole, round((seconds - whole) * 1e9)


def _nanoseconds(value: object, kind: type[TimeValue]) -> int | None:
    """Return the nanoseconds of a value of `kind` or of a number of seconds, None for others."""
    if isinstance(value, kind):
        return value.to_nsec()
    if isinstance(value, int):
        return value * _NS
    if isinstance(value, float):  # not `round(value * 1e9)`, which loses digits of large times
        seconds, rest = _split(value)
        return seconds * _NS + rest
    return None
