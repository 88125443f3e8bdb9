"""Which mission a runner takes, and when schedules are due."""

from __future__ import annotations

import time
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from smachpy.durable.opening import open_store
from smachpy.durable.processes import this_runner
from smachpy.durable.schedule import ScheduleError, next_due, next_of, read_time
from tests.smachpy.durable.test_stores import ROW

NOW = datetime(2026, 3, 27, 9, 0, tzinfo=UTC).timestamp()  # a Friday


def row(id, **changes):  # noqa: A002
    return replace(ROW, id=id, created=NOW - 100, changed=NOW - 100, **changes)


def test_a_schedule_begins_one_mission_however_long_nobody_looked(tmp_path):
    store = open_store(tmp_path / "journal.db")
    schedule = row("night", due=NOW - 3 * 86400, every="0 9 * * *", argv=("--x",), robot="r1")
    schedule = store.create(replace(schedule, priority=3, group="lift"))
    (found,) = store.look().schedules
    begun, due = next_of(found, NOW)
    assert (found, due) == (schedule, NOW + 86400)
    assert begun.id == "night-20260324T090000Z"
    assert (begun.every, begun.schedule, begun.argv, begun.robot) == (None, "night", ("--x",), "r1")
    assert (begun.priority, begun.group) == (3, "lift")
    # Two runners that saw the same begin it once.
    assert store.begin_next(begun, due=found.due, next_due=due) is True
    assert store.begin_next(begun, due=found.due, next_due=due) is False
    assert {each.id: each.due for each in store.missions()} == {"night": due, begun.id: found.due}
    store.request_cancel("night")
    assert store.begin_next(replace(begun, id="x"), due=due, next_due=due + 1) is False
    assert [each.id for each in store.missions(open_only=True)] == [begun.id]
    assert store.look().schedules == ()
    assert store.reserve(this_runner(), seconds=1)[0].id == begun.id
    store.close()


def test_a_due_time_that_has_had_its_mission_only_moves_the_schedule(store_place):
    """The clock was put back, or the schedule was forgotten and made again: the runner ended."""
    store = open_store(store_place)
    store.create(row("night", due=NOW - 86400, every="0 9 * * *"))
    (found,) = store.look().schedules
    begun, due = next_of(found, NOW)
    store.create(replace(begun, argv=("--first",)))
    assert store.begin_next(begun, due=found.due, next_due=due) is False
    assert store.mission("night").due == due
    assert store.mission(begun.id).argv == ("--first",)
    store.close()


@pytest.mark.parametrize(
    ("every", "expected"),
    [
        ("0 9 * * *", "2026-03-28T09:00:00+00:00"),
        ("*/10 * * * *", "2026-03-27T09:10:00+00:00"),
        ("0 8 * * 1-5", "2026-03-30T08:00:00+00:00"),
        ("0 8 * * 1-5 Europe/Berlin", "2026-03-30T06:00:00+00:00"),  # summer time by then
        ("0 8 28 3 * Europe/Berlin", "2026-03-28T07:00:00+00:00"),
    ],
)
def test_cron_expressions(every, expected):
    assert next_due(every, NOW) == datetime.fromisoformat(expected).timestamp()


@pytest.mark.parametrize(
    "every",
    [
        "",
        "daily",
        "* * * *",
        "61 * * * *",
        "* * * * * Nowhere",
        "* * * * * ../x",
        "* * * * * UTC x",
    ],
)
def test_what_is_no_cron_expression_is_refused(every):
    with pytest.raises(ScheduleError) as caught:
        next_due(every, NOW)
    assert caught.value.text == every


def test_times_of_a_person():
    at_nine = read_time("09:00", NOW)
    assert NOW <= at_nine < NOW + 86400
    assert datetime.fromtimestamp(at_nine).astimezone().strftime("%H:%M") == "09:00"
    assert (
        read_time("2026-03-28T08:30+01:00", NOW)
        == datetime(2026, 3, 28, 7, 30, tzinfo=UTC).timestamp()
    )
    local = datetime(2026, 3, 28, 8, 30).timestamp()  # noqa: DTZ001
    assert read_time("2026-03-28 08:30", NOW) == read_time("2026-03-28T08:30", NOW) == local


@pytest.fixture
def berlin(monkeypatch):
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    ("text", "now"),
    [
        ("2026-03-29T02:30", NOW),
        ("02:30", datetime(2026, 3, 28, 12, 0, tzinfo=UTC).timestamp()),
        ("02:30", datetime(2026, 3, 28, 23, 30, tzinfo=UTC).timestamp()),
    ],
)
def test_a_time_that_the_clocks_skip_is_refused(berlin, text, now):
    with pytest.raises(ScheduleError, match="put forward"):
        read_time(text, now)
    assert read_time("2026-03-29T02:30+01:00", NOW) == NOW + 40.5 * 3600


def test_a_time_that_has_passed_is_refused():
    with pytest.raises(ScheduleError, match=r"--not-after: got .*a time in the future"):
        read_time("2026-03-27T08:59:59Z", NOW, "--not-after")
    assert read_time("2026-03-27T09:00:00Z", NOW) == NOW


@pytest.mark.parametrize(
    "text", ["", "soon", "25:00", "2026-13-01", "nan", "-5", "9999-12-31T23:59-23:00"]
)
def test_what_is_no_time_is_refused(text):
    with pytest.raises(ScheduleError):
        read_time(text, NOW)
