"""The journal of one run: entries are folded into the position, then written before anybody acts.

Branches of a concurrence that write at the same time share a transaction: whoever comes first
writes what the others have brought meanwhile (group commit).
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
"""Entries between two snapshots: as many at most are read when a run goes on."""


def read_position(store: Store, mission: str) -> Position:
    """Return where a mission's journal stands.

    Raises:
        StoreError: the journal cannot be read, or its entries are of a newer smachpy.
        UnknownMissionError: the store has none of this id.
    """
    version = store.mission(mission).version  # of entries that no snapshot has replaced
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
        store: Where to.
        lease: The right to do so.
        position: Where the run stands.

    Attributes:
        position: See above; what was put in is in it at once. Guarded by `lock`.
        lock: Guards the position and the order of entries; held for no I/O.

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
        """Fold an entry and queue it; return its number. Needs the lock."""
        self.position.fold(entry)
        self._queue.append(json.dumps(entry, separators=(",", ":")).encode())
        self._put += 1
        return self._put

    def commit(self, number: int) -> None:
        """Write what was put in, up to entry `number` at least.

        Raises:
            StoreError, FencedError: it cannot be written.

        Blocks: for the disk, or the database.
        """
        with self._writing:
            if self._written >= number:
                return  # somebody else has written it
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
