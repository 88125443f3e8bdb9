"""The journal of one run: what is told to be written is, once, whatever ends a write."""

from __future__ import annotations

import pytest

from smachpy.durable.journal import Journal
from smachpy.durable.position import Position
from smachpy.durable.store import Lease, StoreError

LEASE = Lease("m", 1, "robot:1")


class Store:
    """Keeps entries.

    Attributes:
        fail: Called by the next write, before it (False) and after it (True).
    """

    def __init__(self):
        self.written = []
        self.fail = lambda written: None

    def append(self, lease, entries, **_):
        fail, self.fail = self.fail, lambda written: None
        fail(False)
        self.written += entries
        fail(True)


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
