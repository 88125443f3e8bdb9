"""Files and servers that fail: one clear line, nothing overwritten, and never other data than was written."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

import smachpy
from smachpy.durable.opening import open_store
from smachpy.durable.processes import this_runner
from smachpy.durable.store import StoreError, digest_of
from smachpy.engine.interrupt import Interruption
from smachpy.exceptions import MissionError
from tests.free_port import free_port
from tests.smachpy.durable.test_stores import LONG_S, ROW


@pytest.fixture
def place(tmp_path):
    return tmp_path / "journal.db"


def fill(place, entries=30, **options):
    """Write a journal, and return its open store and what is in it."""
    store = open_store(place, **options)
    store.create(ROW)
    lease = store.claim("m1", this_runner(), seconds=LONG_S)
    written = [b"%d " % n * 20 for n in range(entries)]
    for entry in written:
        store.append(lease, [entry])
    return store, lease, written


def refused(place, reason, **options):
    with pytest.raises(StoreError) as caught:
        open_store(place, **options)
    error = caught.value
    assert (error.where, error.reason) == (str(place), reason)
    assert "\n" not in str(error)
    return error


def test_a_log_that_was_written_in_part_ends_with_a_whole_transaction(place, tmp_path):
    store, _, written = fill(place)
    wal = place.with_name("journal.db-wal")
    whole = wal.read_bytes()
    torn = tmp_path / "torn" / "journal.db"
    torn.parent.mkdir()
    counts = []
    for cut in range(len(whole) - 25 * 512, len(whole) + 1, 512):
        shutil.copy(place, torn)
        # What a disk leaves of a write that was cut: a part, and other bytes after it.
        torn.with_name("journal.db-wal").write_bytes(whole[:cut] + b"\xa5" * (len(whole) - cut))
        torn.with_name("journal.db-shm").unlink(missing_ok=True)
        copy = open_store(torn)
        entries = copy.read("m1")[1]
        assert entries == written[: len(entries)]
        counts.append(len(entries))
        copy.close()
    assert counts == sorted(counts)
    assert counts[0] < counts[-1] == len(written)
    store.close()


def left_behind(place, folder, *names):
    """Copy a journal's files of these names, and return the journal of the copy."""
    folder.mkdir()
    for name in names:
        shutil.copy(place.with_name(name), folder / name)
    return folder / place.name


@pytest.mark.slow
def test_a_file_without_its_log_is_refused(place, tmp_path):
    store, lease, _ = fill(place, 3, synchronous="NORMAL")
    for number in range(3):  # the last one after SQLite has taken the log into the file
        copy = left_behind(place, tmp_path / f"copy {number}", "journal.db")
        before = copy.read_bytes()
        assert "journal.db-wal" in str(refused(copy, "corrupt"))
        assert copy.read_bytes() == before
        assert [each.name for each in copy.parent.iterdir()] == ["journal.db"]
        open_store(place).close()  # the first one still writes
        for _ in range(number * 400):
            store.append(lease, [b"more"])
    store.close()
    copy = left_behind(place, tmp_path / "closed", "journal.db")
    with contextlib.closing(open_store(copy)) as whole:
        assert len(whole.read("m1")[1]) == 1203


def test_a_log_without_its_file_is_refused_and_stays(place, tmp_path):
    store, _, written = fill(place)
    copy = left_behind(place, tmp_path / "copy", "journal.db-wal")
    log = copy.with_name("journal.db-wal")
    before = log.read_bytes()
    for empty in (False, True):
        if empty:
            copy.touch()
        refused(copy, "corrupt")
        assert log.read_bytes() == before
    shutil.copy(place, copy)
    with contextlib.closing(open_store(copy)) as whole:
        assert whole.read("m1")[1] == written
    store.close()


def test_a_journal_that_is_deleted_or_replaced_takes_no_more_entries(place):
    store, lease, _ = fill(place)
    kept = place.rename(place.with_name("kept.db"))
    with pytest.raises(StoreError, match="expected the one that was opened"):
        store.append(lease, [b"x"])
    place.write_bytes(kept.read_bytes())
    with pytest.raises(StoreError, match="another file in its place"):
        store.append(lease, [b"x"])
    store.close()


def test_a_journal_whose_last_reader_took_the_log_in_is_whole(place, tmp_path):
    store, _, written = fill(place)
    copy = left_behind(place, tmp_path / "killed", "journal.db", "journal.db-wal")
    with contextlib.closing(sqlite3.connect(copy)) as other_program:
        other_program.execute("SELECT * FROM smachpy_missions")
    assert not copy.with_name("journal.db-wal").exists()
    with contextlib.closing(open_store(copy)) as whole:
        assert whole.read("m1")[1] == written
    store.close()


def test_a_damaged_file_gives_what_was_written_or_says_so(place, tmp_path):
    store, lease, written = fill(place, 60)
    store.append(lease, [], snapshot=b"s" * 500)
    for entry in written:
        store.append(lease, [entry])
    row = store.mission("m1")
    store.close()
    whole = place.read_bytes()
    damaged = tmp_path / "damaged.db"
    told = 0
    for at in range(0, len(whole), 101):
        damaged.unlink(missing_ok=True)  # a file that is cut to nothing waits for the disk
        damaged.write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1 :])
        try:
            copy = open_store(damaged)
            try:
                found = copy.read("m1")
                copy.missions()
            finally:
                copy.close()
        except MissionError:  # a StoreError, or one about a mission whose row is damaged
            told += 1
        else:
            assert found == (b"s" * 500, written)
    assert told > 5
    assert row.status == "running"


def test_a_damaged_entry_is_named_and_left_as_it_is(place):
    store, _, _ = fill(place)
    store.close()
    with sqlite3.connect(place) as raw:
        raw.execute("UPDATE smachpy_entries SET data = x'00' WHERE n = 5")
    raw.close()
    before = place.read_bytes()
    store = open_store(place)
    with pytest.raises(StoreError, match="entry 5") as caught:
        store.read("m1")
    assert caught.value.reason == "corrupt"
    store.close()
    assert place.read_bytes() == before


def test_an_entry_that_is_gone_is_noticed(place):
    store, _, _ = fill(place)
    store.close()
    with sqlite3.connect(place) as raw:
        raw.execute("DELETE FROM smachpy_entries WHERE n = 5")
    raw.close()
    store = open_store(place)
    with pytest.raises(StoreError, match="entry 5"):
        store.read("m1")
    store.close()


def test_a_journal_from_the_future_is_left_alone(place):
    fill(place)[0].close()
    with sqlite3.connect(place) as raw:
        raw.execute("PRAGMA user_version = 5")
    raw.close()
    before = place.read_bytes()
    refused(place, "future")
    assert place.read_bytes() == before


def test_a_file_of_another_program_is_left_alone(place):
    with sqlite3.connect(place) as raw:
        raw.execute("CREATE TABLE songs (title TEXT)")
    raw.close()
    before = place.read_bytes()
    refused(place, "foreign")
    assert place.read_bytes() == before
    place.write_text("pick up milk\n" * 100)
    refused(place, "foreign")
    assert place.read_text().startswith("pick up milk")


def test_a_missing_file_is_made_only_when_asked(place):
    refused(place, "missing", create=False)
    assert not place.exists()
    deep = place.parent / "a" / "b" / "journal.db"
    open_store(deep).close()
    open_store(deep, create=False).close()


def test_a_folder_is_no_journal(place):
    place.mkdir()
    refused(place, "unreachable")
    (place.parent / "file").write_text("x")
    refused(place.parent / "file" / "journal.db", "unreachable")


def test_the_top_folder_is_no_journal():
    refused("/", "unreachable")


def test_a_locked_file_is_waited_for_no_longer_than_allowed(place):
    store, lease, written = fill(place)
    store.close()
    store = open_store(place, patience=0.05)
    other = sqlite3.connect(place, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(StoreError) as caught:
        store.append(lease, [b"x"])
    assert caught.value.reason == "busy"
    assert store.read("m1") == (None, written)  # to read needs no lock
    other.execute("ROLLBACK")
    other.close()
    store.append(lease, [b"x"])
    assert store.read("m1")[1] == [*written, b"x"]
    store.close()


def test_a_full_disk_loses_nothing_that_was_written(place):
    store, lease, written = fill(place)
    pages = store._connection.execute("PRAGMA page_count").fetchone()[0]
    store._connection.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.raises(StoreError) as caught:
        store.append(lease, [b"x" * 100_000])
    assert caught.value.reason == "full"
    assert store.read("m1") == (None, written)
    store._connection.execute("PRAGMA max_page_count = 1000000")
    store.append(lease, [b"room again"])
    assert store.read("m1") == (None, [*written, b"room again"])
    store.close()


NO_ROOM = """
import resource, signal, sys
from smachpy.durable.processes import this_runner
from smachpy.durable.opening import open_store
from smachpy.durable.store import (StoreError)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
store = open_store(sys.argv[1])
lease = store.claim("m1", this_runner(), seconds=60)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
try:
    for n in range(1000):
        store.append(lease, [b"more" * 100])
except StoreError as error:
    print(error.reason)
    sys.exit(2)
"""


def test_a_disk_that_refuses_a_write_loses_nothing_that_was_written(place):
    store, lease, written = fill(place)
    store.release(lease, "interrupted")
    store.close()
    done = subprocess.run(
        [sys.executable, "-c", NO_ROOM, str(place)], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout) == (2, "failed\n"), done.stderr
    store = open_store(place)
    entries = store.read("m1")[1]
    assert entries[: len(written)] == written
    assert set(entries[len(written) :]) == {b"more" * 100}
    store.close()


@pytest.mark.parametrize("url", ["mysql://db/x", "http://db", "://"])
def test_another_kind_of_url_is_refused(url):
    with pytest.raises(StoreError) as caught:
        open_store(url, patience=0.1)
    assert caught.value.reason == "unreachable"


@pytest.mark.parametrize("synchronous", ["OFF", "", None])
def test_less_than_durable_is_not_offered(place, synchronous):
    with pytest.raises(ValueError, match="synchronous"):
        open_store(place, synchronous=synchronous)


class Interrupted:
    """A connection whose next BEGIN is interrupted, as Python does it: just after the call."""

    def __init__(self, connection):
        self.connection = connection
        self.over = False

    def execute(self, statement, *arguments):
        result = self.connection.execute(statement, *arguments)
        if statement.startswith("BEGIN") and not self.over:
            self.over = True
            raise Interruption
        return result

    def __getattr__(self, name):
        return getattr(self.connection, name)


def test_a_transaction_whose_begin_is_interrupted_does_not_stay_open(place):
    """All later writes failed, as SQLite begins no transaction within another."""
    store, lease, written = fill(place, 2)
    store._connection = Interrupted(store._connection)
    with pytest.raises(Interruption):
        store.append(lease, [b"lost"])
    store.append(lease, [b"next"])
    assert store.read("m1")[1] == [*written, b"next"]
    store.close()


def test_the_stores_of_a_process_see_one_another(place):
    first, lease, written = fill(place)
    second = open_store(place, synchronous="NORMAL")
    first.append(lease, [b"a"])
    second.append(lease, [b"b"])
    first.append(lease, [b"c"])
    assert second.read("m1")[1] == [*written, b"a", b"b", b"c"]
    first.close()
    first.close()
    second.close()
    with pytest.raises(StoreError):
        second.missions()


# PostgreSQL


@pytest.fixture
def server_store(postgres_url):
    store = open_store(postgres_url)
    store.create(ROW)
    yield store
    store.close()


@pytest.mark.postgres
@pytest.mark.parametrize("how", ["stop", "kill"])
def test_a_server_that_restarts_is_waited_for(server_store, postgres_server, how):
    lease = server_store.claim("m1", this_runner(), seconds=LONG_S)
    server_store.append(lease, [b"a"])
    getattr(postgres_server, how)()
    starting = threading.Thread(target=postgres_server.start)
    starting.start()
    server_store.append(lease, [b"b"])
    starting.join()
    server_store.append(lease, [b"c"], status="ended", outcome="done")
    assert server_store.read("m1") == (None, [b"a", b"b", b"c"])
    assert server_store.mission("m1").outcome == "done"


@pytest.mark.postgres
def test_a_server_that_keeps_away_is_told(postgres_server, postgres_url):
    store = open_store(postgres_url, patience=0.2)
    store.create(ROW)
    postgres_server.stop()
    try:
        with pytest.raises(StoreError) as caught:
            store.missions()
        assert caught.value.reason == "unreachable"
    finally:
        postgres_server.start()
    assert [row.id for row in store.missions()] == ["m1"]
    store.close()


@pytest.mark.postgres
def test_a_transaction_waits_two_or_three_times_for_the_server(postgres_url, monkeypatch):
    import psycopg

    store = open_store(postgres_url)
    machine = smachpy.StateMachine(["done"], name="ERRAND")
    machine.add("CARRY", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    smachpy.run_durable(machine, store, mission="m1")
    execute, sent = psycopg.Cursor.execute, []

    def counted(cursor, query, *arguments, **more):
        sent.append(query)
        return execute(cursor, query, *arguments, **more)

    monkeypatch.setattr(psycopg.Cursor, "execute", counted)
    smachpy.run_durable(machine, store, mission="m2")
    assert len(sent) <= 13
    assert sum(query.endswith("COMMIT") for query in sent) == 6
    store.close()


@pytest.mark.postgres
@pytest.mark.parametrize("length", [10, 1 << 21])
def test_long_values_are_kept_as_short_ones_are(postgres_url, length):
    with contextlib.closing(open_store(postgres_url)) as store:
        shape = b"s" * length
        row, lease = store.start(replace(ROW, structure=shape), this_runner(), seconds=LONG_S)
        assert store.mission(row.id).structure == shape
        entry, value = b"\x00'\\%s" * (length // 6), b"\xff" * length
        store.append(lease, [entry, b"b"], blobs={digest_of(value): value})
        assert store.read(row.id) == (None, [entry, b"b"])
        assert store.blob(row.id, digest_of(value)) == value
        store.append(lease, [b"c"], snapshot=entry, kept=[digest_of(value)])
        assert store.read(row.id) == (entry, [])
        assert store.blob(row.id, digest_of(value)) == value
        store.append(lease, [b"d"], snapshot=b"")
        with pytest.raises(StoreError, match="is missing"):
            store.blob(row.id, digest_of(value))


@pytest.mark.postgres
def test_an_answer_that_was_lost_is_no_second_entry(server_store, monkeypatch):
    import psycopg

    lease = server_store.claim("m1", this_runner(), seconds=LONG_S)
    server_store.append(lease, [b"a"])
    execute = psycopg.ClientCursor.execute
    lost = []

    def loses_answer(cursor, query, *arguments):
        """The server commits, but the connection is gone before its answer is here."""
        answer = execute(cursor, query, *arguments)
        if query.endswith("COMMIT") and not lost:
            lost.append(query)
            cursor.connection.close()
            raise psycopg.OperationalError("server closed the connection unexpectedly")
        return answer

    monkeypatch.setattr(psycopg.ClientCursor, "execute", loses_answer)
    server_store.append(lease, [b"b", b"c"])
    assert lost
    assert server_store.read("m1") == (None, [b"a", b"b", b"c"])
    lost.clear()
    server_store.create(replace(ROW, id="m2"))
    assert lost
    lost.clear()
    second = server_store.claim("m2", this_runner(), seconds=LONG_S)
    assert lost
    assert server_store.mission("m2").owner == this_runner()
    lost.clear()
    server_store.append(second, [], snapshot=b"s")
    lost.clear()
    server_store.release(second, "interrupted")
    lost.clear()
    server_store.forget("m2")
    assert [row.id for row in server_store.missions()] == ["m1"]


@pytest.mark.postgres
def test_entries_that_a_standby_never_got_are_noticed(server_store, postgres_url):
    import psycopg

    lease = server_store.claim("m1", this_runner(), seconds=LONG_S)
    server_store.append(lease, [b"a", b"b"])
    with psycopg.connect(postgres_url, autocommit=True) as raw:
        raw.execute("DELETE FROM smachpy_entries WHERE n = 2")
        raw.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
            "WHERE application_name = 'smachpy' AND datname = current_database()"
        )
    with pytest.raises(StoreError) as caught:
        server_store.append(lease, [b"c"])
    assert caught.value.reason == "corrupt"


@pytest.mark.postgres
def test_a_server_with_journals_from_the_future_is_left_alone(server_store, postgres_url):
    import psycopg

    with psycopg.connect(postgres_url, autocommit=True) as raw:
        raw.execute("UPDATE smachpy_version SET version = 5")
    with pytest.raises(StoreError) as caught:
        open_store(postgres_url)
    assert caught.value.reason == "future"


def test_a_server_that_is_not_there_is_told_without_the_password():
    url = f"postgresql://me:secret@127.0.0.1:{free_port()}/missions"
    with pytest.raises(StoreError) as caught:
        open_store(url, patience=0.1)
    assert caught.value.reason == "unreachable"
    assert "secret" not in str(caught.value)
    with pytest.raises(StoreError) as caught:
        open_store("postgresql://me:secret@[::1/missions")
    assert "secret" not in str(caught.value)
    assert "\n" not in str(caught.value)
