"""Computes when schedules are due, and reads times that people write; no I/O."""

from __future__ import annotations

import dataclasses
from datetime import UTC, datetime, timedelta, tzinfo
from typing import TYPE_CHECKING, Final
from zoneinfo import ZoneInfo

from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from smachpy.durable.store import MissionRow

_FIELDS: Final = 5  # of a cron expression; a time zone may follow them


class ScheduleError(MissionError):
    """A time or a cron expression cannot be read.

    Try: write what the text expects; cron expressions have five fields.

    Attributes:
        text: The text that was given.
    """

    def __init__(self, option: str, text: str, expected: str) -> None:
        self.text = text
        super().__init__(f"{option}: got {text!r}; expected {expected}.")


def next_of(schedule: MissionRow, now: float) -> tuple[MissionRow, float]:
    """Return the mission that a due schedule begins, and the schedule's next due time.

    A schedule that was due several times while no runner was alive begins one mission.

    Args:
        schedule: The schedule.
        now: Seconds since the Unix epoch.

    Raises:
        ScheduleError: its cron expression cannot be read here, or is never due.
        ModuleNotFoundError: the package cronsim of the extra `cron` is missing.
    """
    assert schedule.every is not None
    assert schedule.due is not None
    # The id has the due time: if two runners see it, both choose the same id.
    stamp = datetime.fromtimestamp(schedule.due, UTC).strftime("%Y%m%dT%H%M%SZ")
    begun = dataclasses.replace(
        schedule,
        id=f"{schedule.id}-{stamp}",
        every=None,
        schedule=schedule.id,
        created=now,
        changed=now,
    )
    return begun, next_due(schedule.every, now)


def next_due(every: str, now: float) -> float:
    """Return the first time after `now` at which a cron expression is due [s since the Unix epoch].

    Args:
        every: "MINUTE HOUR DAY MONTH WEEKDAY [ZONE]", as in cron; the default zone is UTC.
        now: Seconds since the Unix epoch.

    Raises:
        ScheduleError: it cannot be read, or is never due.
        ModuleNotFoundError: the package cronsim of the extra `cron` is missing.
    """
    from cronsim import CronSim, CronSimError

    words = every.split()
    expected = "five fields of cron and perhaps a time zone, '0 8 * * 1-5 Europe/Berlin'"
    if len(words) not in {_FIELDS, _FIELDS + 1}:
        raise ScheduleError("--every", every, expected)
    zone = _zone(every, words[_FIELDS]) if len(words) > _FIELDS else UTC
    try:
        due: datetime = next(CronSim(" ".join(words[:_FIELDS]), datetime.fromtimestamp(now, zone)))
    except CronSimError as error:
        raise ScheduleError("--every", every, f"{expected}: {str(error).lower()}") from error
    except StopIteration:
        raise ScheduleError("--every", every, "a time within the next 50 years") from None
    return due.timestamp()


def read_time(text: str, now: float, option: str = "--at") -> float:
    """Return the time of "08:30", "2026-03-28 08:30" or ISO 8601 [s since the Unix epoch].

    A time without an offset is in this computer's zone; a time without a date is its next
    occurrence.

    Args:
        text: The text that a person wrote.
        now: Seconds since the Unix epoch.
        option: The option that it was given to.

    Raises:
        ScheduleError: it cannot be read, is in the past, or does not exist in this computer's zone.
    """
    today = datetime.fromtimestamp(now, UTC).astimezone().date()
    for form in ("%H:%M", "%H:%M:%S"):
        try:
            clock = datetime.strptime(text, form).time()  # noqa: DTZ007  in this computer's zone
        except ValueError:
            continue
        due = _timestamp(option, text, datetime.combine(today, clock))
        if due < now:
            # Not plus 24 hours: a day on which summer time begins or ends is shorter or longer.
            tomorrow = datetime.combine(today + timedelta(days=1), clock)
            due = _timestamp(option, text, tomorrow)
        return due
    try:
        due = _timestamp(option, text, datetime.fromisoformat(text))
    except (ValueError, OverflowError, OSError):
        expected = "a time such as 08:30, 2026-03-28T08:30 or 2026-03-28T08:30+01:00"
        raise ScheduleError(option, text, expected) from None
    if due < now:
        raise ScheduleError(option, text, "a time in the future")
    return due


def _timestamp(option: str, text: str, at: datetime) -> float:
    """Return a time [s since the Unix epoch]; one without an offset is in this computer's zone."""
    seconds = at.astimezone().timestamp()
    if at.tzinfo is None and datetime.fromtimestamp(seconds) != at:  # noqa: DTZ006
        expected = "a time that exists: the clocks of this zone are put forward over it"
        raise ScheduleError(option, text, expected)
    return seconds


def _zone(every: str, name: str) -> tzinfo:
    try:
        return ZoneInfo(name)
    except (ValueError, OSError, KeyError):  # ZoneInfoNotFoundError is a KeyError
        expected = f"a time zone that this computer knows in place of {name!r}"
        raise ScheduleError("--every", every, expected) from None
