"""The queue of a store: who gets which mission, whoever is killed meanwhile and wherever."""

from __future__ import annotations

import contextlib
import itertools
import os
import random
import signal
import sqlite3
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

from smachpy.durable import sql, sql_queue, sqlite
from smachpy.durable.opening import open_store
from smachpy.durable.processes import this_runner
from smachpy.durable.store import FencedError, MissionInUseError, MissionOverError, StoreError
from tests.smachpy.durable.test_stores import LONG_S, ROW

ELSEWHERE = "elsewhere:7"


@pytest.fixture
def store(store_place):
    opened = open_store(store_place)
    yield opened
    opened.close()


@pytest.fixture
def other(store_place):
    """The store as a runner on another computer has it."""
    opened = open_store(store_place)
    opened._mark = "another boot 1"
    yield opened
    opened.close()


def put(store, id, **facts):  # noqa: A002
    return store.create(replace(ROW, id=id, **facts))


def put_many(store, rows):
    """Add missions in one transaction."""

    def work(cursor, _):
        for number, row in enumerate(rows):
            store._insert(cursor, row, 1_000.0 + number)

    store._transact(work)


def taken(store, **options):
    """Reserve all that can be, and return the ids in their order."""
    found = []
    while (one := store.reserve(this_runner(), seconds=LONG_S, **options)) is not None:
        found.append(one[0].id)
    return found


def end(store, mission):
    lease = store.claim(mission, this_runner(), seconds=LONG_S)
    store.append(lease, [], status="ended", outcome="done")
    store.release(lease, "ended")


def test_missions_are_taken_by_what_was_begun_then_priority_then_age(store):
    put(store, "a")
    put(store, "b")
    put(store, "high", priority=5)
    put(store, "low", priority=-1)
    put(store, "later", due=9e9)
    put(store, "schedule", every="0 8 * * *", due=1.0)
    put(store, "begun", priority=-9)
    store.release(store.claim("begun", this_runner(), seconds=LONG_S), "interrupted")
    assert taken(store) == ["begun", "high", "a", "b", "low"]


def test_a_robot_and_a_group_have_one_mission_at_a_time(store):
    put(store, "a", robot="r1")
    put(store, "b", robot="/r1")
    put(store, "c", robot="r2", group="lift")
    put(store, "d", group="lift")
    put(store, "e", drives="r1/")
    assert taken(store) == ["a", "c"]
    for mission, shared in (("b", "robot"), ("d", "group"), ("e", "robot")):
        with pytest.raises(MissionInUseError) as caught:
            store.claim(mission, ELSEWHERE, seconds=LONG_S)
        assert getattr(caught.value, shared) is not None
    end(store, "a")
    assert taken(store) == ["b"]
    end(store, "c")
    assert taken(store) == ["d"]
    end(store, "b")
    assert taken(store) == ["e"]


def test_what_was_interrupted_keeps_its_robot_and_group_until_it_is_over(store):
    """A runner that could not go on with it began another mission while the robot still drove."""
    put(store, "begun", robot="/r1", group="lift")
    store.release(store.claim("begun", this_runner(), seconds=LONG_S), "interrupted")
    put(store, "robot", robot="r1")
    put(store, "group", group="lift")
    put(store, "other", robot="r2")
    assert taken(store, leave=["begun"]) == ["other"]
    assert "begun" in {row.id for row in store.holders()}
    store.forget("begun")
    assert sorted(taken(store)) == ["group", "robot"]


def test_what_a_runner_leaves_stays_for_others(store):
    for name in "abc":
        put(store, name, robot=f"r{name}", target=f"{name}.py")
    assert taken(store, leave=["a"], leave_targets=["b.py"], robots=["ra", "rb", "rc"]) == ["c"]
    assert taken(store, robots=["/rb"]) == ["b"]
    assert taken(store) == ["a"]


def test_what_a_runner_leaves_of_one_version_hides_no_other(store):
    for name, target, shape in [("a", "m.py", b"{}"), ("b", "m.py", b"[]"), ("c", "n.py", b"{}")]:
        put(store, name, target=target, structure=shape)
    assert taken(store, leave_shapes=[("m.py", b"{}"), ("o.py", b"[]")]) == ["b", "c"]
    assert taken(store) == ["a"]


def test_a_row_of_an_older_version_is_left_by_its_structure(store):
    def forget(cursor, _):
        cursor.execute("UPDATE smachpy_missions SET shape = ''")

    for name, shape in [("a", b"{}"), ("b", b"[]")]:
        put(store, name, target="m.py", structure=shape)
    store._transact(forget)
    assert taken(store, leave_shapes=[("m.py", b"{}")]) == ["b"]
    assert taken(store) == ["a"]


def test_what_can_begin_is_found_behind_a_long_queue_that_cannot(store):
    put(store, "busy", robot="r1", group="lift")
    store.claim("busy", this_runner(), seconds=LONG_S)
    facts = [{"robot": "r1"}, {"group": "lift"}, {"target": "left.py"}, {"robot": "r2"}]
    put_many(store, [replace(ROW, id=f"m{n:03}", priority=5, **facts[n % 3]) for n in range(90)])
    for n, (name, which) in enumerate(
        [("b", 3), ("low", 3), ("a", 3), ("group", 1), ("left", 2), ("robot", 0)]
    ):
        put(store, name, priority=-n if name != "a" else 1, **facts[which])
    assert store.look().free
    assert store.look(robots=["r2"]).free
    assert not store.look(robots=["r3"]).free
    assert taken(store, leave_targets=["left.py"]) == ["a"]  # one at a time has the robot r2
    for mission, following in (("a", "b"), ("b", "low")):
        end(store, mission)
        assert taken(store, leave_targets=["left.py"], robots=["r2"]) == [following]
    end(store, "low")
    assert len(taken(store)) == 31  # nothing is left: all of that target


@pytest.mark.parametrize("seed", range(12))
def test_a_mission_is_taken_as_if_all_were_looked_at_in_order(store, seed, monkeypatch):
    monkeypatch.setattr(
        sql_queue, "_FRONT", sql_queue._FRONT.replace(f"LIMIT {sql_queue.FRONT}", "LIMIT 2")
    )
    chance = random.Random(seed)
    some = {
        "robot": [None, "r1", "r2", "r3", "r10"],
        "group": [None, None, "lift", "door"],
        "target": ["a.py", "b.py", "a.py b"],
        "priority": [0, 0, 1, 2],
        "structure": [b"{}", b"[]"],
        "not_after": [None, None, None, 5.0],
    }

    def any_row(name):
        return replace(ROW, id=name, **{key: chance.choice(of) for key, of in some.items()})

    rows = [any_row(f"m{n:02}") for n in range(40)]
    put_many(store, rows)
    wanted = {
        "leave": chance.sample([row.id for row in rows], 5),
        "leave_targets": chance.sample(["a.py", "a.py b"], chance.randrange(2)),
        "leave_shapes": [("b.py", b"[]")],
        "robots": chance.choice([[], ["r1", "r10"], ["r2"]]),
    }
    robots, groups, expected = set(), set(), []
    for row in sorted(rows, key=lambda row: -row.priority):  # stable: the oldest first
        fits = (
            row.id not in wanted["leave"]
            and row.target not in wanted["leave_targets"]
            and (row.target, row.structure) not in wanted["leave_shapes"]
            and (not wanted["robots"] or row.robot in wanted["robots"])
            and row.not_after is None
        )
        if fits and row.robot not in robots and row.group not in groups:
            robots |= {row.robot} - {None}
            groups |= {row.group} - {None}
            expected.append(row.id)
    assert taken(store, **wanted) == expected


class Steps:
    """The steps of SQLite's machine within a block: what its queries cost on any computer."""

    def __init__(self, store):
        self.store, self.count = store, 0

    def __enter__(self):
        self.store._connection.set_progress_handler(self._step, 1)
        return self

    def _step(self):
        self.count += 1
        return 0

    def __exit__(self, *_):
        self.store._connection.set_progress_handler(None, 0)


@pytest.mark.parametrize(
    ("facts", "options"),
    [
        ({"robot": "r1"}, {}),
        ({"group": "lift"}, {}),
        ({"target": "left.py"}, {"leave_targets": ["left.py"]}),
        ({"structure": b"old"}, {"leave_shapes": [(ROW.target, b"old")]}),
        ({"robot": "r2"}, {"robots": ["r3"]}),
        ({"robot": "r2", "due": 9e9}, {"robots": ["r3"]}),
        ({"robot": "r3", "due": 9e9}, {"robots": ["r3"]}),
        ({"every": "0 8 * * *", "due": 9e9}, {}),
        ({"due": 9e9}, {}),
    ],
    ids=str,
)
def test_a_look_at_missions_that_cannot_begin_costs_the_same_however_many_wait(
    tmp_path, facts, options
):
    store = open_store(tmp_path / "queue.db")
    put(store, "busy", robot="r1", group="lift")
    lease = store.claim("busy", this_runner(), seconds=LONG_S)
    robots = options.get("robots", [])
    costs = []
    for count in (100, 2_000):
        put_many(store, [replace(ROW, id=f"{count} {n}", **facts) for n in range(count)])
        with Steps(store) as steps:
            store.look(robots=robots)
            assert store.reserve(this_runner(), seconds=LONG_S, **options) is None
            assert store.hold(lease, "door", "A", "wait") is None
        costs.append(steps.count)
    assert costs[1] < 1.2 * costs[0]
    store.close()


@pytest.mark.parametrize(
    "filters",
    [
        {"statuses": ["queued"]},
        {"statuses": ["queued", "interrupted"]},
        {"statuses": ["queued"], "skip": 20},
        {"robot": "r1"},
        {"robot": "r2"},
        {"open_only": True, "target": ROW.target},
    ],
    ids=str,
)
def test_a_page_of_a_list_costs_the_same_however_many_missions_fit(tmp_path, filters):
    store = open_store(tmp_path / "queue.db")
    costs = []
    for count in (100, 2_000):
        put_many(store, [replace(ROW, id=f"{count} {n}", robot="r1") for n in range(count)])
        with Steps(store) as steps:
            rows = store.missions(limit=20, **filters)
        costs.append(steps.count)
    last = 0 if filters.get("robot") == "r2" else 20
    skip = filters.get("skip", 0)
    assert [row.id for row in rows] == [f"2000 {n}" for n in range(2_000)][-last - skip :][:last]
    assert costs[1] < 1.2 * costs[0]
    store.close()


def test_a_store_without_an_index_gets_it_when_it_is_opened(store_place):
    """A newer smachpy has more indexes of the same version; an older one does not need them."""

    def delete(cursor, _):
        assert set(store.dialect.indexes()) <= store._index_names(cursor)
        for name in ("smachpy_kinds", "smachpy_once"):
            cursor.execute(f"DROP INDEX {name}")

    for _ in range(2):
        store = open_store(store_place)
        store._transact(delete)
        store.close()


def test_a_journal_of_version_3_gets_what_is_new_when_it_is_opened(tmp_path):
    place = tmp_path / "queue.db"
    store = open_store(place)
    put(store, "a")
    store.close()
    with contextlib.closing(sqlite3.connect(place)) as raw:
        raw.execute("DROP INDEX smachpy_kinds")
        raw.execute("ALTER TABLE smachpy_missions DROP COLUMN shape")
        raw.execute("CREATE INDEX smachpy_needs ON smachpy_missions (target)")
        raw.execute("PRAGMA user_version = 3")
        raw.commit()
    store = open_store(place)
    names = store._transact(lambda cursor, _: store._index_names(cursor))
    assert set(store.dialect.indexes()) <= names
    assert "smachpy_needs" not in names
    assert taken(store, leave_shapes=[(ROW.target, ROW.structure)]) == []
    put(store, "b", structure=b"new")
    assert taken(store, leave_shapes=[(ROW.target, ROW.structure)]) == ["b"]
    store.close()


def test_more_left_missions_than_a_statement_binds(store):
    put(store, "a")
    assert taken(store, leave=[str(n) for n in range(40_000)]) == ["a"]


def test_what_was_not_begun_in_time_is_cancelled(store):
    put(store, "late", not_after=5.0)
    put(store, "in_time", not_after=9e9)
    assert store.reserve(this_runner(), seconds=LONG_S)[0].id == "in_time"
    news = store.look()
    assert news.cancelled == ("late",)
    row = store.mission("late")
    assert (row.status, row.note) == ("cancelled", "it was not begun in time")
    assert store.look().cancelled == ()


def test_what_is_due_begins_by_the_stores_clock(store):
    now = store.look().now
    put(store, "anybody's", due=now + 250)
    put(store, "mine", due=now + 500, robot="r1")
    assert taken(store) == []
    assert 300 < store.look(robots=["r1"]).next_due <= 500
    assert not store.look(robots=["r1"]).free
    put(store, "soon", due=now + 0.3)
    found = None
    while found is None:  # for 0.3 s
        store.look()
        found = store.reserve(this_runner(), seconds=LONG_S)
    assert found[0].id == "soon"


def test_a_reservation_is_handed_to_a_process_once(store, other):
    put(store, "a", robot="r1")
    row, reserved = other.reserve(ELSEWHERE, seconds=LONG_S)
    assert row.status == store.mission("a").status == "queued"
    with pytest.raises(MissionInUseError):  # a process that nobody has sent
        store.claim("a", this_runner(), seconds=LONG_S)
    lease = store.claim("a", this_runner(), seconds=LONG_S, reserved=reserved)
    assert lease.fence == reserved.fence + 1
    with pytest.raises(FencedError):
        store.claim("a", this_runner(), seconds=LONG_S, reserved=reserved)
    with pytest.raises(FencedError):  # the runner has nothing to give back any more
        store.release(reserved, None, note="exit code 2")
    assert store.mission("a").status == "running"


def test_a_reservation_that_is_given_back_says_why(store):
    put(store, "a")
    _, reserved = store.reserve(this_runner(), seconds=LONG_S)
    store.release(reserved, None, note="exit code 2")
    row = store.mission("a")
    assert (row.status, row.note, row.owner) == ("queued", "exit code 2", None)
    store.claim("a", this_runner(), seconds=LONG_S)
    assert store.mission("a").note == ""


def test_a_reserved_mission_that_is_cancelled_does_not_begin(store, other):
    put(store, "a")
    _, reserved = other.reserve(ELSEWHERE, seconds=LONG_S)
    store.request_cancel("a")
    with pytest.raises(MissionOverError):
        store.claim("a", this_runner(), seconds=LONG_S, reserved=reserved)


def test_runners_that_come_at_once_get_different_missions(store, store_place):
    for n in range(40):
        put(store, f"m{n:02}", robot=f"r{n // 4}" if n < 16 else None)
    got, failed = [], []

    def take():
        other = open_store(store_place)
        try:
            while (one := other.reserve(this_runner(), seconds=LONG_S)) is not None:
                got.append(one[0].id)
        except StoreError as error:
            failed.append(error)
        finally:
            other.close()

    threads = [threading.Thread(target=take) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failed == []
    # One of each of the four robots, and all that need none.
    assert sorted(got) == sorted(set(got))
    assert len(got) == 4 + 24


def test_who_listens_is_woken_by_what_comes_into_the_queue(store):
    news = threading.Event()
    stop = store.listen(news.set)
    if stop is None:
        return  # a file: runners look regularly
    try:
        for change in (
            lambda: put(store, "a", robot="r1"),
            lambda: end(store, "a"),
            lambda: put(store, "b"),
            lambda: store.request_cancel("b"),
        ):
            assert news.wait(60)
            news.clear()
            change()
        assert news.wait(60)
    finally:
        stop()


# -- killed -----------------------------------------------------------------------------------

KILLED = """
import os, signal, sys
from smachpy.durable.processes import this_runner
from smachpy.durable.opening import open_store

place, act, kill_at = sys.argv[1], sys.argv[2], int(sys.argv[3])
store = open_store(place)
if act in {"claim", "release"}:
    _, lease = store.reserve(this_runner(), seconds=0.05)
if act == "release":
    lease = store.claim("a", this_runner(), seconds=0.05, reserved=lease)
number, do = 0, store._do
def counted(cursor, sql, *values):
    global number
    number += 1
    if number == kill_at:
        os.kill(os.getpid(), signal.SIGKILL)
    do(cursor, sql, *values)
store._do = counted
if act == "reserve":
    store.reserve(this_runner(), seconds=0.05)
elif act == "reserve for a robot":
    store.reserve(this_runner(), seconds=0.05, robots=["r1"])
elif act == "claim":
    store.claim("a", this_runner(), seconds=0.05, reserved=lease)
elif act == "release":
    store.release(lease, "interrupted")
elif act == "look":
    store.look()
print("done", flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
@pytest.mark.parametrize("act", ["reserve", "reserve for a robot", "claim", "release", "look"])
def test_a_runner_killed_at_any_statement_leaves_the_mission_to_one_other(store, store_place, act):
    put(store, "a", robot="r1", group="lift", due=1.0)
    put(store, "b", robot="r1")
    fence = 0
    for kill_at in itertools.count(1):
        done = subprocess.run(
            [sys.executable, "-c", KILLED, store_place, act, str(kill_at)],
            capture_output=True,
            text=True,
            timeout=250,
        )
        assert done.returncode == -signal.SIGKILL, done.stderr
        found = None
        while found is None:  # at once, or when its lease of 0.05 s has expired
            store.look()
            found = store.reserve(this_runner(), seconds=LONG_S)
        row, reserved = found
        assert row.id == "a"
        assert store.reserve(ELSEWHERE, seconds=LONG_S) is None  # the robot has its mission
        lease = store.claim("a", this_runner(), seconds=LONG_S, reserved=reserved)
        assert lease.fence > fence
        fence = lease.fence
        store.append(lease, [b"x"])
        store.release(lease, "queued")
        if done.stdout:
            break
    assert kill_at > 1  # it was killed at least once
    assert len(store.read("a")[1]) == kill_at


# -- kept and forgotten -----------------------------------------------------------------------


def test_prune_deletes_what_has_been_over_for_long_and_keeps_the_rest(store, monkeypatch):
    monkeypatch.setattr(sql, "PRUNED_AT_ONCE", 3)
    for n in range(7):
        put(store, f"m{n}")
        store.request_cancel(f"m{n}")
    put(store, "ended")
    end(store, "ended")
    put(store, "queued")
    put(store, "running")
    lease = store.claim("running", this_runner(), seconds=LONG_S)
    store.append(lease, [b"x" * 10_000])
    assert store.prune(3600.0, keep=lambda _: False) == 0
    before = store.size()
    assert before[0] == 10
    pruned = store.prune(0.0, keep=lambda row: row.outcome is not None or row.id == "m1")
    assert pruned == 6
    assert sorted(row.id for row in store.missions()) == ["ended", "m1", "queued", "running"]
    assert store.read("running")[1] == [b"x" * 10_000]
    assert store.size()[1] <= before[1]
    assert store.prune(0.0, keep=lambda _: False) == 2
    assert store.missions(statuses=["ended", "cancelled"]) == []


def test_prune_gives_the_disk_back(tmp_path):
    place = tmp_path / "queue.db"
    store = open_store(place)
    for n in range(20):
        put(store, f"m{n}", structure=os.urandom(100_000))
        store.request_cancel(f"m{n}")
    before = store.size()[1]
    store.prune(0.0, keep=lambda _: False)
    assert store.size()[1] < before / 10
    assert place.stat().st_size < before / 10
    store.close()


def test_prune_lets_others_write_between_parts_of_bounded_size(tmp_path, monkeypatch):
    monkeypatch.setattr(sqlite, "PRUNED_BYTES", 100_000)
    monkeypatch.setattr(sqlite, "PAGES_AT_ONCE", 20)
    store, other = (open_store(tmp_path / "queue.db") for _ in range(2))
    for n in range(10):
        put(store, f"m{n}")
        lease = store.claim(f"m{n}", this_runner(), seconds=LONG_S)
        store.append(lease, [os.urandom(25_000)], blobs={"digest": os.urandom(25_000)})
        store.append(lease, [], status="ended", outcome="done")
        store.release(lease, "ended")
    put(other, "running")
    lease = other.claim("running", this_runner(), seconds=LONG_S)
    left = []

    def give_way(_):
        other.append(lease, [b"x"])  # raises if the file is still locked
        left.append((len(other.missions()), other.size()[1]))

    monkeypatch.setattr(store, "_give_way", give_way)
    assert store.prune(0.0, keep=lambda _: False) == 10
    counts, sizes = zip(*left, strict=True)
    assert counts[:5] == (9, 7, 5, 3, 1)
    assert sum(later < earlier for earlier, later in itertools.pairwise(sizes)) >= 5
    assert len(other.read("running")[1]) == len(left)
    store.close()
    other.close()


NO_ROOM = """
import resource, signal, sys
from smachpy.durable.opening import open_store
from smachpy.durable.store import (StoreError)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
store = open_store(sys.argv[1])
size = int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
try:
    store.prune(0.0, keep=lambda row: False)
except StoreError as error:
    print(error.reason)
"""


def test_a_full_disk_while_pruning_loses_nothing_that_is_kept(tmp_path):
    place = tmp_path / "queue.db"
    store = open_store(place)
    for n in range(50):
        put(store, f"m{n}", structure=b"x" * 20_000)
        store.request_cancel(f"m{n}")
    put(store, "kept")
    lease = store.claim("kept", this_runner(), seconds=LONG_S)
    store.append(lease, [b"kept"])
    store.close()
    told = set()
    for room in (1000, 40_000, 400_000):
        done = subprocess.run(
            [sys.executable, "-c", NO_ROOM, str(place), str(room)],
            capture_output=True,
            text=True,
            timeout=250,
        )
        assert done.returncode == 0, done.stderr
        told.add(done.stdout.strip())
        store = open_store(place)
        assert store.read("kept")[1] == [b"kept"]
        with contextlib.closing(sqlite3.connect(place)) as raw:
            assert raw.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        store.close()
    assert told <= {"", "failed", "full"}
    assert told != {""}
    store = open_store(place)
    store.prune(0.0, keep=lambda _: False)
    assert [row.id for row in store.missions()] == ["kept"]
    store.close()


# -- two versions at once ---------------------------------------------------------------------


def test_an_old_runner_that_has_a_new_store_open_takes_no_robot_twice(tmp_path):
    """Before version 2 a runner's claim was this statement; the index refuses it."""
    place = tmp_path / "queue.db"
    store = open_store(place)
    put(store, "a", robot="r1")
    put(store, "b", robot="r1")
    lease = store.claim("a", this_runner(), seconds=LONG_S)
    old = sqlite3.connect(place)
    claim = (
        "UPDATE smachpy_missions SET status = 'running', owner = 'old:1', mark = 'x', "
        "lease_end = 9e9, fence = fence + 1 WHERE id = 'b'"
    )
    with pytest.raises(sqlite3.IntegrityError):
        old.execute(claim)
    old.rollback()
    store.append(lease, [], status="ended", outcome="done")
    store.release(lease, "ended")
    old.execute(claim)
    old.commit()
    # And a mission of the old one is not taken by the new one.
    assert store.reserve(this_runner(), seconds=LONG_S) is None
    with pytest.raises(MissionInUseError):
        store.claim("b", this_runner(), seconds=LONG_S)
    old.close()
    store.close()
