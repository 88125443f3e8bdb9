"""The journal of one run: each entry is folded into the position and written before its effect.

Branches of a concurrence that write at the same time share a transaction: the first one also writes
the entries that the others have queued meanwhile (group commit).
"""

from __future__ import annotations

import json
import threading
from typing import TYPE_CHECKING, Any, Final

from smachpy.durable.position import VERSION, Position
from smachpy.durable.store import ENDED, StoreError

if TYPE_CHECKING:
    from smachpy.durable.store import Lease, Store

SNAPSHOT_EVERY: Final = 1000
"""Entries between two snapshots, and so the most that are read when a run is resumed."""


def read_position(store: Store, mission: str) -> Position:
    """Return the position that a mission's journal leads to.

    Raises:
        StoreError: the journal cannot be read, or a newer smachpy wrote it.
        UnknownMissionError: the store has no mission of this id.
    """
    # Entries carry no version. The row has that of the code that began the mission, the snapshot
    # that of the code that wrote it.
    version = store.mission(mission).version
    snapshot, entries = store.read(mission)
    where = f"mission {mission!r}"
    try:
        position = Position(None if snapshot is None else json.loads(snapshot))
        version = max(version, position.data["version"])
        if version > VERSION:
            problem = (
                f"journal: got version {version}; expected {VERSION} at most. Try a newer smachpy."
            )
            raise StoreError(where, problem, reason="future")
        for entry in entries:
            position.fold(json.loads(entry))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        problem = (
            f"journal: got an entry that cannot be read ({type(error).__name__}: {error}); "
            "expected what smachpy wrote. Try 'smachpy missions forget' and a new run."
        )
        raise StoreError(where, problem, reason="corrupt") from error
    return position


class Journal:
    """Writes the entries of one run.

    Args:
        store: Keeps the entries.
        lease: The right to write them.
        position: The position at which the run begins or resumes.

    Attributes:
        position: The position after the newest entry, written or not. Guarded by `lock`.
        lock: Guards the position and the order of entries; never held during I/O.

    Threads: every method may be called from any thread.
    """

    def __init__(self, store: Store, lease: Lease, position: Position) -> None:
        self.position = position
        self.lock = threading.RLock()
        self._store = store
        self._lease = lease
        self._writing = threading.Lock()
        self._queue: list[bytes] = []
        self._put = 0
        self._written = 0
        self._since_snapshot = 0

    def put(self, entry: dict[str, Any]) -> int:
        """Fold an entry and queue it; return its number. The caller holds the lock."""
        self.position.fold(entry)
        self._queue.append(json.dumps(entry, separators=(",", ":")).encode())
        self._put += 1
        return self._put

    def commit(self, number: int) -> None:
        """Write the queued entries, at least up to entry `number`.

        Raises:
            StoreError, FencedError: it cannot be written.

        Blocks: for the disk, or the database.
        """
        with self._writing:
            if self._written >= number:
                return  # another thread has written it with its own
            # All that is queued by now. `lock` is released before the store is called, so that
            # other threads can queue the next entries while this one waits for the disk.
            with self.lock:
                entries, self._queue = self._queue, []
                upto = self._put
                finished = self.position.data["finished"]
                self._since_snapshot += len(entries)
                snapshot = None
                if self._since_snapshot >= SNAPSHOT_EVERY or finished:
                    snapshot = self.position.to_bytes()
                    self._since_snapshot = 0
            self._store.append(
                self._lease,
                entries,
                snapshot=snapshot,
                status=ENDED if finished else None,
                outcome=self.position.data["outcome"],
            )
            self._written = upto
