"""The journal of one run: what is told to be written is, once, whatever ends a write."""

from __future__ import annotations

import contextlib
import json

import pytest

import smachpy
from smachpy.durable.journal import Journal
from smachpy.durable.opening import open_store
from smachpy.durable.overview import overview
from smachpy.durable.position import Position
from smachpy.durable.store import Lease, StoreError
from smachpy.engine.interrupt import Interruption

LEASE = Lease("m", 1, "robot:1")


class Store:
    """Keeps entries.

    Attributes:
        fail: Called by the next write, before it (False) and after it (True).
    """

    def __init__(self):
        self.written = []
        self.blobs = []
        self.writes = []
        self.snapshot = None
        self.fail = lambda written: None

    def append(self, lease, entries, *, snapshot=None, blobs=(), **_):
        fail, self.fail = self.fail, lambda written: None
        fail(False)
        self.writes.append(entries)
        self.written += entries
        self.blobs += blobs
        if snapshot is not None:
            self.snapshot, self.written = snapshot, []
        fail(True)

    def read(self, mission):
        return self.snapshot, list(self.written)


def begun():
    """A journal, its store, and a function that puts an entry into it."""
    store = Store()
    journal = Journal(store, LEASE, Position(), lambda: 0)

    def put(kind, path, **facts):
        with journal.lock:
            return journal.put({"kind": kind, "path": path, "stamp_ns": 0, "in": "", **facts})

    journal.commit(put("Started", "/M"))
    return journal, store, put


def test_an_entry_that_was_lost_with_that_of_another_thread_is_not_told_to_be_written():
    """One thread takes the entries of others with its own. They waited, and wrote nothing then."""
    journal, store, put = begun()

    def fail(_written):
        raise StoreError("the store", "the disk is full", reason="full")

    first, second = put("Stopped", "/M"), put("Released", "/M")
    store.fail = fail
    for number in (first, second, put("Stopped", "/M")):
        with pytest.raises(StoreError, match="the disk is full"):
            journal.commit(number)
    assert len(store.written) == 1
    journal.commit(1)  # written long before


@pytest.mark.parametrize("was_written", [False, True])
@pytest.mark.parametrize("last", ["Stopped", "Finished"])
def test_an_entry_whose_write_is_interrupted_is_written_once(was_written, last):
    """It was lost. SQLite is interrupted after its COMMIT, as a rule: then it is written."""
    journal, store, put = begun()

    def fail(written):
        if written is was_written:
            raise Interruption

    with journal.lock:
        journal.compact("a" * 5000, "a" * 5000)
        interrupted = put(last, "/M", outcome="done")
    store.fail = fail
    with pytest.raises(Interruption):
        journal.commit(interrupted)
    journal.commit(interrupted)
    kinds = [json.loads(entry)["kind"] for entry in store.written]
    if last == "Stopped":
        assert kinds == ["Started", "Stopped"]
    else:  # a snapshot takes the place of all entries
        assert (kinds, json.loads(store.snapshot)["finished"]) == ([], True)
    journal.commit(put("Noted", "/M"))
    assert len(store.writes) == 3
    assert len(store.blobs) == 1


def test_the_state_that_runs_is_listed_for_a_machine_with_a_slash_in_its_name(tmp_path):
    """None was: the slashes of its path were counted."""
    found = []
    with contextlib.closing(open_store(tmp_path / "journal.db")) as store:

        def look(_):
            found.extend(overview(store, store.mission("one"))["current"])
            return "done"

        inner = smachpy.StateMachine(["done"])
        inner.add("LOOK", smachpy.CBState(look, outcomes=["done"]))
        machine = smachpy.StateMachine(["done"], name="r1/M")
        machine.add("A", inner)
        assert smachpy.run_durable(machine, store, mission="one") == "done"
    assert [path for path, _ in found] == ["/r1/M/A"]
