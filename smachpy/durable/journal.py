"""The journal of one run: each entry is folded into the position and written before its effect.

Branches of a concurrence that write at the same time share a transaction: the first one also writes
the entries that the others have queued meanwhile (group commit).
"""

from __future__ import annotations

import json
import threading
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actionlib_core.inputs.json_text import check_depth
from smachpy.durable.position import VERSION, Position
from smachpy.durable.store import ENDED, StoreError, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.durable.store import Lease, Store

SNAPSHOT_EVERY: Final = 1000
"""Entries between two snapshots, and so the most that are read when a run is resumed."""

SNAPSHOT_BYTES: Final = 32 * 2**20
"""Bytes of new large values after which a snapshot follows earlier: it deletes those that no key
has any more, so a value that changes in each state does not fill the disk [bytes].
"""

MAX_STATE_DEPTH: Final = 500
"""Levels of arrays and objects in an entry; each level of a value has up to three of them."""

LARGE: Final = 4096
"""Values of more characters are kept once, beside the entries that name them by a digest."""


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
        position = Position(None if snapshot is None else _load(snapshot))
        version = max(version, position.data["version"])
        if version > VERSION:
            problem = (
                f"journal: got version {version}; expected {VERSION} at most. Try a newer smachpy."
            )
            raise StoreError(where, problem, reason="future")
        for entry in entries:
            position.fold(_load(entry))
        position.check()
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError) as error:
        problem = (
            f"journal: got an entry that cannot be read ({type(error).__name__}: {error}); "
            "expected what smachpy wrote. Try 'smachpy missions forget' and a new run."
        )
        raise StoreError(where, problem, reason="corrupt") from error
    return position


def _load(data: bytes) -> Any:
    """Return the data of an entry or snapshot.

    Not with `load_json`, for which whole numbers of more than 300 digits are texts.

    Raises:
        ValueError: it is no JSON, or is nested too deeply.
    """
    try:
        found = json.loads(data)
    except RecursionError as error:
        raise ValueError(f"it is nested deeper than {MAX_STATE_DEPTH} levels") from error
    if data.count(b"[") + data.count(b"{") > MAX_STATE_DEPTH:
        check_depth(found, MAX_STATE_DEPTH)
    return found


class _Write(NamedTuple):
    """What one call of the store writes: entries up to number `upto`, and large values."""

    entries: list[bytes]
    blobs: dict[str, bytes]
    snapshot: bytes | None
    upto: int


class Journal:
    """Writes the entries of one run.

    Args:
        store: Keeps the entries.
        lease: The right to write them.
        position: The position at which the run begins or resumes.

        now_ns: Returns the mission's own time [ns], its sign of life in the store.

    Attributes:
        position: The position after the newest entry, written or not. Guarded by `lock`.
        lock: Guards the position and the order of entries; never held during I/O.

    Threads: every method may be called from any thread.
    """

    def __init__(
        self, store: Store, lease: Lease, position: Position, now_ns: Callable[[], int]
    ) -> None:
        self.position = position
        self.lock = threading.RLock()
        self._store = store
        self._lease = lease
        self._writing = threading.Lock()
        self._queue: list[bytes] = []
        self._put = 0
        self._written = 0
        self._begun: _Write | None = None  # not None later: it was interrupted, and may be stored
        self._failed: Exception | None = None  # that of the store: later entries need the lost ones
        self._since_snapshot = 0
        self._new_bytes = 0  # of large values since then
        self._now_ns = now_ns
        self._has_begun = False
        self._stored = position.digests()  # large values that the store has
        self._blobs: dict[str, bytes] = {}  # those that are queued with the entries

    def compact(self, encoded: Any, text: str) -> Any:
        """Return an encoded value for an entry; a large one as its digest.

        The caller holds the lock, and puts the entry before it releases it.

        Args:
            encoded: The value, from `smachpy.durable.codec.encode`.
            text: The same as JSON.
        """
        if len(text) <= LARGE:
            return encoded
        data = text.encode()
        digest = digest_of(data)
        if digest not in self._stored:
            self._stored.add(digest)
            self._blobs[digest] = data
        return {"$blob": digest}

    def value(self, kept: Any) -> Any:
        """Return the encoded value for what `compact` has returned.

        Raises:
            StoreError: the store has lost it.
        """
        if not isinstance(kept, dict) or "$blob" not in kept:
            return kept
        digest = kept["$blob"]
        data = self._blobs.get(digest) or self._store.blob(self._lease.mission, digest)
        return _load(data)

    def put(self, entry: dict[str, Any]) -> int:
        """Fold an entry and queue it; return its number. The caller holds the lock."""
        self.position.fold(entry)
        self._queue.append(json.dumps(entry, separators=(",", ":")).encode())
        self._put += 1
        return self._put

    def freeze(self) -> None:
        """Write nothing any more: a thread that comes to do so waits until the process ends.

        Blocks: until the entries that are being written are.
        """
        self._writing.acquire()

    def commit(self, number: int) -> None:
        """Write the queued entries, at least up to entry `number`.

        Raises:
            StoreError, FencedError: it cannot be written.

        Blocks: for the disk, or the database.
        """
        with self._writing:
            if self._written >= number:
                return  # another thread has written it with its own
            if self._failed is not None:  # perhaps one that had taken this entry with its own
                raise self._failed
            if self._begun is not None and self._is_stored(self._begun):
                self._note_written(self._begun)
                if self._written >= number:
                    return
            # All that is queued by now. `lock` is released before the store is called, so that
            # other threads can queue the next entries while this one waits for the disk. They stay
            # queued until they are written: a state may be interrupted anywhere in here.
            with self.lock:
                entries, blobs = self._queue.copy(), self._blobs.copy()
                upto = self._put
                finished = self.position.data["finished"]
                self._since_snapshot += len(entries)
                self._new_bytes += sum(map(len, blobs.values()))
                snapshot = None
                kept: set[str] = set()
                is_long = self._since_snapshot >= SNAPSHOT_EVERY
                if is_long or self._new_bytes >= SNAPSHOT_BYTES or finished:
                    snapshot = self.position.to_bytes()
                    self._since_snapshot = self._new_bytes = 0
                    kept = self._stored = self.position.digests()
            self._begun = begun = _Write(entries, blobs, snapshot, upto)
            try:
                self._store.append(
                    self._lease,
                    entries,
                    snapshot=snapshot,
                    status=ENDED if finished else None,
                    outcome=self.position.data["outcome"],
                    blobs=blobs,
                    kept=frozenset(kept),
                    # The lease is renewed every few seconds; before that, the first entry tells.
                    beat_ns=None if self._has_begun else self._now_ns(),
                )
            except Exception as error:
                self._failed = error
                raise
            self._has_begun = True
            self._note_written(begun)

    def _is_stored(self, write: _Write) -> bool:
        """Return whether a write that was interrupted had come to its end in the store."""
        snapshot, entries = self._store.read(self._lease.mission)
        if write.snapshot is not None:
            return snapshot == write.snapshot
        return entries[-len(write.entries) :] == write.entries

    def _note_written(self, write: _Write) -> None:
        with self.lock:
            queue = self._queue[len(write.entries) :]
            blobs = {name: data for name, data in self._blobs.items() if name not in write.blobs}
            # No call and no loop in between: so an interruption comes before all of it or after it.
            self._queue, self._blobs, self._written, self._begun = queue, blobs, write.upto, None
