"""What every store keeps to, in a file and on a server."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

from smachpy.durable.opening import open_store
from smachpy.durable.processes import process_lives, process_mark, this_runner
from smachpy.durable.store import (
    FencedError,
    Lease,
    MissionInUseError,
    MissionOverError,
    MissionRow,
    StoreError,
    UnknownMissionError,
    host_and_pid,
    may_take,
)
from smachpy.exceptions import MissionError

ROW = MissionRow(
    id="m1",
    name="PATROL",
    target="patrol.py",
    argv=("--input", "x=1", "ünï\0"),
    status="queued",
    outcome=None,
    robot=None,
    created=1_700_000_000.25,
    changed=1_700_000_000.25,
    owner=None,
    structure=b"\x00\xff{}",
    version=1,
)
LONG_S = 3600.0

# A process that takes a mission, says so, and lives until its input ends.
HOLDER = """
import sys
from smachpy.durable.processes import this_runner
from smachpy.durable.opening import open_store
store = open_store(sys.argv[1])
store.claim(sys.argv[2], this_runner(), seconds=float(sys.argv[3]))
print("taken", flush=True)
sys.stdin.read()
"""


class Holder:
    """A mission in the hands of another process."""

    def __init__(self, place: str, mission: str = "m1", seconds: float = LONG_S) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", HOLDER, place, mission, str(seconds)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout.readline() == "taken\n"

    def __enter__(self) -> Holder:
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()
        self.process.stdin.close()
        self.process.stdout.close()

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()


@pytest.fixture
def store(store_place):
    opened = open_store(store_place)
    yield opened
    opened.close()


def test_a_mission_is_read_as_it_was_created(store):
    facts = {"due": 5.5, "every": "0 8 * * *", "priority": 3, "not_after": 7.0, "group": "lift"}
    row = replace(ROW, robot="robot_3", drives="robot_4", **facts)
    made = store.create(row)
    assert made == replace(row, created=made.created, changed=made.created)
    assert store.mission("m1") == store.find("m1") == made
    assert store.missions() == [made]
    assert store.read("m1") == (None, [])
    assert store.find("m2") is None


def test_a_mission_is_created_at_the_time_of_the_stores_clock(store):
    """A submitter whose clock is an hour ahead delayed its mission by an hour."""
    for number, created in (("1", 4e9), ("2", 2.0), ("3", 3.0)):
        store.create(replace(ROW, id=f"m{number}", created=created, changed=created))
    rows = store.missions()
    assert [row.id for row in rows] == ["m1", "m2", "m3"]
    assert rows[0].created < 3e9
    assert store.reserve(this_runner(), seconds=LONG_S)[0].id == "m1"


def test_a_list_has_the_newest_missions_and_filters(store):
    for number in range(5):
        robot = "r1" if number % 2 else None
        store.create(replace(ROW, id=f"m{number}", target=f"{number // 2}.py", robot=robot))
    store.request_cancel("m3")

    def ids(**options):
        return [row.id for row in store.missions(**options)]

    assert ids(limit=2) == ["m3", "m4"]
    assert ids(limit=2, skip=2) == ["m1", "m2"]
    assert ids(limit=None) == ["m0", "m1", "m2", "m3", "m4"]
    assert ids(open_only=True, limit=2) == ["m2", "m4"]
    assert ids(robot="/r1") == ["m1", "m3"]
    assert ids(target="1.py") == ["m2", "m3"]
    assert ids(statuses=["cancelled"]) == ["m3"]
    assert ids(statuses=["ended"]) == []


def test_an_id_is_taken_once(store):
    made = store.create(ROW)
    with pytest.raises(MissionError, match="m1"):
        store.create(replace(ROW, created=2.0))
    assert store.mission("m1") == made


@pytest.mark.parametrize(
    "call",
    [
        lambda store: store.mission("m\udcff"),
        lambda store: store.create(replace(ROW, id="m\udcff")),
        lambda store: store.create(replace(ROW, target="/home/m\udcff.py")),
    ],
    ids=["mission", "create", "target"],
)
def test_text_that_utf_8_cannot_write_is_refused(store, call):
    """A name with other bytes on the command line ended in a traceback."""
    store.create(replace(ROW, id="m2"))
    with pytest.raises(StoreError, match=r"got '.*m\\udcff.*'; expected text that can be written"):
        call(store)
    assert [row.id for row in store.missions()] == ["m2"]


def test_entries_are_there_for_who_opens_the_store_next(store, store_place):
    store.create(ROW)
    lease = store.claim("m1", this_runner(), seconds=LONG_S)
    store.append(lease, [b"a", b"b"])
    store.append(lease, [b"\x00\xff"])
    other = open_store(store_place)
    assert other.read("m1") == (None, [b"a", b"b", b"\x00\xff"])
    row = other.mission("m1")
    assert (row.status, row.owner) == ("running", this_runner())
    other.close()


def test_a_snapshot_takes_the_place_of_all_entries_so_far(store):
    store.create(ROW)
    lease = store.claim("m1", this_runner(), seconds=LONG_S)
    store.append(lease, [b"a", b"b"])
    store.append(lease, [b"c"], snapshot=b"abc")
    assert store.read("m1") == (b"abc", [])
    store.append(lease, [b"d"])
    assert store.read("m1") == (b"abc", [b"d"])
    store.append(lease, [], snapshot=b"abcd")
    store.append(lease, [b"e", b"f"])
    assert store.read("m1") == (b"abcd", [b"e", b"f"])


def test_the_end_of_a_mission_is_written_with_its_last_entry(store):
    store.create(ROW)
    lease = store.claim("m1", this_runner(), seconds=LONG_S)
    store.append(lease, [b"end"], status="ended", outcome="succeeded")
    row = store.mission("m1")
    assert (row.status, row.outcome) == ("ended", "succeeded")
    assert row.changed > ROW.changed
    store.release(lease, "ended")
    with pytest.raises(MissionOverError) as caught:
        store.claim("m1", this_runner(), seconds=LONG_S)
    assert (caught.value.mission, caught.value.status) == ("m1", "ended")
    with pytest.raises(MissionOverError):
        store.request_cancel("m1")


def test_a_mission_that_is_given_back_can_be_taken_again(store):
    store.create(ROW)
    first = store.claim("m1", this_runner(), seconds=LONG_S)
    store.append(first, [b"a"])
    store.release(first, "interrupted")
    row = store.mission("m1")
    assert (row.status, row.owner) == ("interrupted", None)
    second = store.claim("m1", this_runner(), seconds=LONG_S)
    assert (first.fence, second.fence) == (1, 2)
    store.append(second, [b"b"])
    assert store.read("m1") == (None, [b"a", b"b"])


def test_a_mission_begins_in_one_step_unless_its_id_is_taken(store):
    row, lease = store.start(ROW, this_runner(), seconds=LONG_S)
    assert (row.status, row.owner, lease.fence) == ("queued", None, 1)
    begun = store.mission("m1")
    assert (begun.status, begun.owner) == ("running", this_runner())
    assert begun.created == row.created > ROW.created
    store.append(lease, [b"a"])
    assert store.start(ROW, this_runner(), seconds=LONG_S) is None
    assert store.mission("m1").status == "running"
    assert store.read("m1") == (None, [b"a"])


def test_a_mission_whose_robot_is_in_use_does_not_begin_and_is_not_added(store, store_place):
    store.create(replace(ROW, robot="r1"))
    with Holder(store_place), pytest.raises(MissionInUseError):
        store.start(replace(ROW, id="m2", robot="r1"), this_runner(), seconds=LONG_S)
    assert store.find("m2") is None


def test_a_mission_that_is_over_stays_so_when_it_is_given_back(store):
    _, lease = store.start(ROW, this_runner(), seconds=LONG_S)
    store.append(lease, [b"a"], status="ended", outcome="done")
    store.release(lease, "interrupted", note="why")
    row = store.mission("m1")
    assert (row.status, row.outcome, row.owner, row.note) == ("ended", "done", None, "")


def test_a_mission_begins_once_although_the_answer_was_lost(store, monkeypatch):
    transact = store._transact

    def twice(work, **options):
        transact(work, **options)
        return transact(lambda cursor, _: work(cursor, True), **options)

    with monkeypatch.context() as patched:
        patched.setattr(store, "_transact", twice)
        row, lease = store.start(ROW, this_runner(), seconds=LONG_S)
    assert (row.created, lease.fence) == (store.mission("m1").created, 1)
    store.append(lease, [b"a"])


def test_the_first_entries_of_a_lease_are_written_once_although_the_answer_was_lost(
    store, monkeypatch
):
    """Only after its first entries did a store know how many a lease had written."""
    store.create(ROW)
    lease = store.claim("m1", this_runner(), seconds=LONG_S)
    transact = store._transact

    def twice(work, **options):
        transact(work, **options)
        return transact(lambda cursor, _: work(cursor, True), **options)

    with monkeypatch.context() as patched:
        patched.setattr(store, "_transact", twice)
        store.append(lease, [b"a", b"b"])
        store.append(lease, [b"c"])
    assert store.read("m1") == (None, [b"a", b"b", b"c"])


def test_a_schedule_is_not_run_itself(store):
    store.create(replace(ROW, every="* * * * *", due=1.0))
    with pytest.raises(MissionError, match="schedule"):
        store.claim("m1", this_runner(), seconds=1)
    assert store.mission("m1").status == "queued"


@pytest.mark.parametrize(
    "write",
    [
        lambda store, lease: store.append(lease, [b"late"], status="ended"),
        lambda store, lease: store.append(lease, [], snapshot=b"late"),
        lambda store, lease: store.renew(lease, seconds=1),
        lambda store, lease: store.release(lease, "ended"),
    ],
    ids=["append", "snapshot", "renew", "release"],
)
def test_who_has_lost_a_mission_changes_nothing(store, write):
    store.create(ROW)
    lease = store.claim("m1", this_runner(), seconds=LONG_S)
    store.append(lease, [b"a"])
    store.release(lease, "interrupted")
    newer = store.claim("m1", "elsewhere:7", seconds=LONG_S)
    before = store.mission("m1")
    with pytest.raises(FencedError) as caught:
        write(store, lease)
    assert (caught.value.lease, caught.value.runner) == (lease, "elsewhere:7")
    assert store.mission("m1") == before
    assert store.read("m1") == (None, [b"a"])
    store.append(newer, [b"b"])


def test_writes_after_a_mission_was_forgotten_are_refused(store):
    store.create(ROW)
    lease = store.claim("m1", this_runner(), seconds=LONG_S)
    store.append(lease, [b"a"], snapshot=b"s")
    store.release(lease, "interrupted")
    store.forget("m1")
    assert store.missions() == []
    with pytest.raises(FencedError):
        store.append(lease, [b"b"])
    store.create(ROW)
    assert store.read("m1") == (None, [])


@pytest.mark.parametrize(
    "call",
    [
        lambda store: store.mission("m2"),
        lambda store: store.read("m2"),
        lambda store: store.claim("m2", this_runner(), seconds=1),
        lambda store: store.forget("m2"),
        lambda store: store.request_cancel("m2"),
    ],
    ids=["mission", "read", "claim", "forget", "request_cancel"],
)
def test_an_unknown_mission_is_named_beside_those_that_are_there(store, call):
    store.create(ROW)
    with pytest.raises(UnknownMissionError) as caught:
        call(store)
    assert (caught.value.mission, caught.value.known) == ("m2", ("m1",))


def test_cancel_ends_what_is_queued_and_is_told_to_who_runs_the_rest(store):
    store.create(ROW)
    store.create(replace(ROW, id="m2"))
    store.request_cancel("m1")
    assert store.mission("m1").status == "cancelled"
    lease = store.claim("m2", this_runner(), seconds=LONG_S)
    assert store.renew(lease, seconds=LONG_S) is False
    store.request_cancel("m2")
    assert store.renew(lease, seconds=LONG_S) is True
    row = store.mission("m2")
    assert (row.status, row.cancel) == ("running", True)


def test_a_mission_that_another_process_runs_is_refused_until_that_is_gone(store, store_place):
    store.create(ROW)
    with Holder(store_place) as holder:
        for refused in (
            lambda: store.claim("m1", this_runner(), seconds=1),
            lambda: store.forget("m1"),
        ):
            with pytest.raises(MissionInUseError) as caught:
                refused()
            assert caught.value.pid == holder.process.pid
            assert f"{caught.value.host}:{os.getpid()}" == this_runner()
            assert caught.value.robot is None
        assert store.mission("m1").status == "running"
        holder.kill()
        assert store.mission("m1").status == "interrupted"
        assert store.claim("m1", this_runner(), seconds=LONG_S).fence == 2


def test_a_robot_is_moved_by_one_mission_at_a_time(store, store_place):
    store.create(replace(ROW, robot="robot_3"))
    store.create(replace(ROW, id="m2", robot="robot_3"))
    store.create(replace(ROW, id="m3", robot="robot_4"))
    with Holder(store_place) as holder:
        store.claim("m3", this_runner(), seconds=LONG_S)
        with pytest.raises(MissionInUseError) as caught:
            store.claim("m2", this_runner(), seconds=LONG_S)
        assert (caught.value.mission, caught.value.robot) == ("m1", "robot_3")
        holder.kill()
        store.claim("m2", this_runner(), seconds=LONG_S)
        # The first one, should it have been suspended only, is refused.
        with pytest.raises(FencedError):
            store.append(Lease("m1", 1, f"{caught.value.runner}"), [b"late"])
        assert store.mission("m1").status == "interrupted"


def test_threads_append_through_one_store(store):
    store.create(ROW)
    lease = store.claim("m1", this_runner(), seconds=LONG_S)
    errors = []

    def write(name):
        try:
            for n in range(20):
                store.append(lease, [b"%d %d" % (name, n)])
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=write, args=(name,)) for name in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    entries = store.read("m1")[1]
    assert sorted(entries) == sorted(b"%d %d" % (name, n) for name in range(4) for n in range(20))
    for name in range(4):  # the order of each thread is kept
        mine = [entry for entry in entries if entry.startswith(b"%d " % name)]
        assert mine == [b"%d %d" % (name, n) for n in range(20)]


def test_two_that_open_a_new_store_at_once_both_get_it(store_place):
    opened, errors = [], []
    ready = threading.Barrier(4)

    def work():
        ready.wait()
        try:
            opened.append(open_store(store_place))
        except StoreError as error:
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    try:
        assert errors == []
        made = opened[0].create(ROW)
        assert all(store.mission("m1") == made for store in opened)
    finally:
        for store in opened:
            store.close()


@pytest.mark.parametrize("seconds", [0, -1, float("nan"), float("inf"), "5", None, True])
def test_a_lease_lasts_a_number_of_seconds(store, seconds):
    store.create(ROW)
    with pytest.raises(ValueError, match="seconds"):
        store.claim("m1", this_runner(), seconds=seconds)
    lease = store.claim("m1", this_runner(), seconds=1)
    with pytest.raises(ValueError, match="seconds"):
        store.renew(lease, seconds=seconds)


@pytest.mark.parametrize("runner", ["", "host", "host:", ":5", "host:x", "host:-5"])
def test_a_runner_is_a_host_and_a_pid(runner):
    with pytest.raises(ValueError, match="runner"):
        host_and_pid(runner)


def test_a_host_may_have_colons():
    assert host_and_pid("fe80::1:77") == ("fe80::1", 77)


@pytest.mark.postgres
def test_on_a_server_a_suspended_process_loses_its_mission(postgres_url):
    store = open_store(postgres_url)
    store.create(ROW)
    with Holder(postgres_url, seconds=0.2) as holder:
        holder.process.send_signal(signal.SIGSTOP)
        lease = None
        while lease is None:  # its lease runs out within 0.2 s, by the server's clock
            with contextlib.suppress(MissionInUseError):
                lease = store.claim("m1", this_runner(), seconds=LONG_S)
        assert lease.fence == 2
    store.close()


def test_in_a_file_a_suspended_process_keeps_its_mission(tmp_path):
    place = str(tmp_path / "journal.db")
    store = open_store(place)
    store.create(ROW)
    with Holder(place, seconds=0.001) as holder:
        holder.process.send_signal(signal.SIGSTOP)
        with pytest.raises(MissionInUseError):
            store.claim("m1", this_runner(), seconds=LONG_S)
    store.close()


@pytest.mark.parametrize(
    ("lives", "left", "by_lease", "restarted", "expected"),
    [
        (False, 100.0, True, True, True),
        (False, 100.0, False, True, True),
        (True, -1.0, False, True, False),
        (True, -1.0, True, True, True),
        (True, 1.0, True, True, False),
        (None, 1.0, True, True, False),
        (None, -1.0, True, False, True),
        (None, 1.0, False, True, True),  # a file whose computer was restarted
        (None, 1.0, False, False, False),
        (None, -1.0, False, False, True),
    ],
)
def test_who_may_take_a_mission(lives, left, by_lease, restarted, expected):
    assert may_take(lives, left, by_lease=by_lease, restarted=restarted) is expected


def test_a_pid_that_is_used_again_is_another_process():
    mark = process_mark()
    assert process_lives(os.getpid(), mark) is True
    boot_and_namespace = mark.rpartition(" ")[0]
    assert process_lives(os.getpid(), f"{boot_and_namespace} 1") is False
    assert process_lives(os.getpid(), "other boot 1") is None
    assert process_lives(os.getpid(), "") is None


@pytest.mark.parametrize("restarted", [False, True])
def test_a_mission_in_another_container_of_this_computer_is_not_taken_before_its_lease_ends(
    store_place, restarted
):
    """Two containers with one host name and one file: both ran the mission at once."""
    boot = "0-1-2" if restarted else process_mark().partition(" ")[0]
    store, other = open_store(store_place), open_store(store_place)
    store._mark = f"{boot} pid:[1] 123"
    store.create(ROW)
    store.claim("m1", this_runner(), seconds=LONG_S)
    if restarted and not store.by_lease:
        other.claim("m1", this_runner(), seconds=LONG_S)
    else:
        with pytest.raises(MissionInUseError):
            other.claim("m1", this_runner(), seconds=LONG_S)
    store.close()
    other.close()


def test_one_mission_at_a_time_holds_a_resource(store, store_place):
    leases = {}
    for id_ in ("m1", "m2", "m3"):
        store.create(replace(ROW, id=id_))
        leases[id_] = store.claim(id_, this_runner(), seconds=LONG_S)

    def take(id_, policy="wait"):
        found = store.hold(leases[id_], "base", f"/{id_}", policy)
        return found and (found.mission, found.state, found.holds, found.runner)

    def uses():
        return [(one.mission, one.holds) for one in store.resources()]

    assert take("m1") is None
    assert take("m1") is None  # the answer was lost
    assert take("m2", "refuse") == ("m1", "/m1", True, this_runner())
    assert take("m2") == ("m1", "/m1", True, this_runner())
    assert take("m3", "preempt") == ("m1", "/m1", True, this_runner())
    assert uses() == [("m1", True), ("m3", False), ("m2", False)]
    assert store.hold(leases["m2"], "arm", "/m2", "wait") is None
    store.let_go(leases["m1"], "base")
    store.let_go(leases["m1"], "base")
    assert take("m1") == ("m3", "/m3", False, this_runner())  # behind those that wait
    assert take("m2") == ("m3", "/m3", False, this_runner())
    assert take("m3") is None
    store.append(leases["m3"], [], status="ended")
    assert uses() == [("m2", True), ("m2", False), ("m1", False)]
    assert take("m1") == ("m2", "/m2", False, this_runner())
    assert take("m2") is None
    with contextlib.closing(open_store(store_place)) as other:
        assert other.resources() == store.resources()
    for id_ in ("m1", "m2"):
        store.release(leases[id_], "interrupted")
    assert uses() == [("m2", True), ("m2", True)]  # its goals may run on; who waits is gone
    with pytest.raises(FencedError):
        take("m1")
    with pytest.raises(FencedError):
        store.let_go(leases["m2"], "base")
    leases["m1"] = store.claim("m1", this_runner(), seconds=LONG_S)
    assert take("m1") == ("m2", "/m2", True, None)
    store.forget("m2")
    assert take("m1") is None


def test_missions_that_take_a_resource_at_once_have_one_holder(store, store_place):
    for number in range(6):
        store.create(replace(ROW, id=f"m{number}"))
    got = []

    def take(id_):
        with contextlib.closing(open_store(store_place)) as own:
            lease = own.claim(id_, this_runner(), seconds=LONG_S)
            got.append(own.hold(lease, "base", "/M", "wait") is None)

    threads = [threading.Thread(target=take, args=(f"m{number}",)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(got) == [False] * 5 + [True]
    assert [one.holds for one in store.resources()] == [True] + [False] * 5
