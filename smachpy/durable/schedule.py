"""Chooses a runner's next mission from a queue, and computes when schedules are due; no I/O."""

from __future__ import annotations

import dataclasses
from datetime import UTC, datetime, timedelta, tzinfo
from typing import TYPE_CHECKING, Final
from zoneinfo import ZoneInfo

from smachpy.durable.store import INTERRUPTED, QUEUED, RUNNING, MissionRow
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

_FIELDS: Final = 5  # of a cron expression; a time zone may follow them


class ScheduleError(MissionError):
    """A time or a cron expression cannot be read.

    Attributes:
        text: The text that was given.
    """

    def __init__(self, option: str, text: str, expected: str) -> None:
        self.text = text
        super().__init__(f"{option}: got {text!r}; expected {expected}.")


def next_mission(
    rows: Sequence[MissionRow], now: float, robots: Collection[str], leave: Collection[str] = ()
) -> MissionRow | None:
    """Return the mission that a runner should take next; None if there is none.

    Interrupted missions come before queued ones, and of these the one that has been due longest
    comes first. Missions for a robot that another mission is using have to wait.

    Args:
        rows: Missions of the store.
        now: Seconds since the Unix epoch.
        robots: The robots that the runner serves; empty: all missions, with or without a robot.
        leave: Ids of missions that it must not take.
    """
    busy = {row.robot for row in rows if row.status == RUNNING and row.robot is not None}
    free = [
        row
        for row in rows
        if row.status in {QUEUED, INTERRUPTED}
        and row.every is None
        and row.id not in leave
        and (not robots or row.robot in robots)
        and row.robot not in busy
        and _due(row) <= now
    ]
    return min(free, key=lambda row: (row.status == QUEUED, _due(row), row.id), default=None)


def next_time(rows: Sequence[MissionRow], now: float) -> float | None:
    """Return when the next mission or schedule is due [s since the Unix epoch]; None for never."""
    later = [_due(row) for row in rows if row.status == QUEUED and _due(row) > now]
    return min(later, default=None)


def due_schedules(
    rows: Sequence[MissionRow], now: float
) -> list[tuple[MissionRow, MissionRow, float]]:
    """Return for each schedule that is due: its row, the new mission, and the next due time.

    A schedule that was due several times while no runner was alive adds one mission.

    Args:
        rows: Missions of the store.
        now: Seconds since the Unix epoch.
    """
    found = []
    for row in rows:
        if (
            row.every is not None
            and row.status == QUEUED
            and row.due is not None
            and row.due <= now
        ):
            # The id has the due time: if two runners see it, both choose the same id.
            stamp = datetime.fromtimestamp(row.due, UTC).strftime("%Y%m%dT%H%M%SZ")
            begun = dataclasses.replace(
                row,
                id=f"{row.id}-{stamp}",
                every=None,
                schedule=row.id,
                created=now,
                changed=now,
            )
            found.append((row, begun, next_due(row.every, now)))
    return found


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


def read_time(text: str, now: float) -> float:
    """Return the time of "08:30", "2026-03-28 08:30" or ISO 8601 [s since the Unix epoch].

    A time without an offset is in this computer's zone; a time without a date is its next
    occurrence.

    Args:
        text: The text that a person wrote.
        now: Seconds since the Unix epoch.

    Raises:
        ScheduleError: it cannot be read.
    """
    today = datetime.fromtimestamp(now, UTC).astimezone().date()
    for form in ("%H:%M", "%H:%M:%S"):
        try:
            clock = datetime.strptime(text, form).time()  # noqa: DTZ007  in this computer's zone
        except ValueError:
            continue
        due = datetime.combine(today, clock).timestamp()
        if due < now:
            # Not plus 24 hours: a day on which summer time begins or ends is shorter or longer.
            due = datetime.combine(today + timedelta(days=1), clock).timestamp()
        return due
    try:
        return datetime.fromisoformat(text).astimezone().timestamp()
    except (ValueError, OverflowError, OSError):
        expected = "a time such as 08:30, 2026-03-28T08:30 or 2026-03-28T08:30+01:00"
        raise ScheduleError("--at", text, expected) from None


def _due(row: MissionRow) -> float:
    return row.created if row.due is None else row.due


def _zone(every: str, name: str) -> tzinfo:
    try:
        return ZoneInfo(name)
    except (ValueError, OSError, KeyError):  # ZoneInfoNotFoundError is a KeyError
        expected = f"a time zone that this computer knows in place of {name!r}"
        raise ScheduleError("--every", every, expected) from None
