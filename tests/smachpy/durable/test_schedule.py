"""Which mission a runner takes, and when schedules are due."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from smachpy.durable.schedule import (
    ScheduleError,
    due_schedules,
    next_due,
    next_mission,
    next_time,
    read_time,
)
from smachpy.durable.store import open_store
from tests.smachpy.durable.test_stores import ROW

NOW = datetime(2026, 3, 27, 9, 0, tzinfo=UTC).timestamp()  # a Friday


def row(id, **changes):  # noqa: A002
    return replace(ROW, id=id, created=NOW - 100, changed=NOW - 100, **changes)


@pytest.mark.parametrize(
    ("rows", "robots", "expected"),
    [
        ([], (), None),
        ([row("a"), row("b", due=NOW - 200)], (), "b"),
        ([row("a", due=NOW + 1)], (), None),
        ([row("a"), row("b", status="interrupted")], (), "b"),
        ([row("a", status="running"), row("b", status="ended")], (), None),
        ([row("a", every="* * * * *", due=NOW - 1)], (), None),
        ([row("a"), row("b", robot="r1"), row("c", robot="r2")], ("r2",), "c"),
        ([row("a", robot="r1")], (), "a"),
        ([row("a", robot="r1", status="running"), row("b", robot="r1")], (), None),
        ([row("a", robot="r1", status="interrupted"), row("b", robot="r1")], ("r1",), "a"),
    ],
)
def test_what_was_begun_comes_first_then_what_is_due_longest(rows, robots, expected):
    found = next_mission(rows, NOW, robots)
    assert (found and found.id) == expected


def test_a_runner_leaves_what_it_could_not_run():
    assert next_mission([row("a"), row("b")], NOW, (), {"a"}).id == "b"


def test_the_next_time_to_look_is_when_something_is_due():
    rows = [row("a", due=NOW + 50), row("b", due=NOW + 5, status="ended"), row("c", due=NOW - 1)]
    assert next_time(rows, NOW) == NOW + 50
    assert next_time(rows[1:], NOW) is None


def test_a_schedule_begins_one_mission_however_long_nobody_looked(tmp_path):
    store = open_store(tmp_path / "journal.db")
    schedule = row("night", due=NOW - 3 * 86400, every="0 9 * * *", argv=("--x",), robot="r1")
    store.create(schedule)
    ((found, begun, due),) = due_schedules(store.missions(), NOW)
    assert (found, due) == (schedule, NOW + 86400)
    assert begun.id == "night-20260324T090000Z"
    assert (begun.every, begun.schedule, begun.argv, begun.robot) == (None, "night", ("--x",), "r1")
    # Two runners that saw the same begin it once.
    assert store.begin_next(begun, due=found.due, next_due=due) is True
    assert store.begin_next(begun, due=found.due, next_due=due) is False
    assert {each.id: each.due for each in store.missions()} == {"night": due, begun.id: found.due}
    assert due_schedules(store.missions(), NOW) == []
    assert next_mission(store.missions(), NOW, ()).id == begun.id
    store.request_cancel("night")
    assert store.begin_next(replace(begun, id="x"), due=due, next_due=due + 1) is False
    assert [each.id for each in store.missions(open_only=True)] == [begun.id]
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


@pytest.mark.parametrize(
    "text", ["", "soon", "25:00", "2026-13-01", "nan", "-5", "9999-12-31T23:59-23:00"]
)
def test_what_is_no_time_is_refused(text):
    with pytest.raises(ScheduleError):
        read_time(text, NOW)
