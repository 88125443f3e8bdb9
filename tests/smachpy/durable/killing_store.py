# ruff: noqa: A002  the words of the interface
"""A store in memory that kills who writes to it: what SIGKILL does, in one process."""

from __future__ import annotations

import dataclasses

from smachpy.durable.store import OVER, RUNNING, Lease, MissionRow


class Kill(BaseException):
    """The process is killed here."""


class KillingStore:
    """Keeps journals in memory.

    Args:
        kill_at: The number of the write that kills, from 1; 0: none.
        written: Whether that one is written first.
    """

    def __init__(self) -> None:
        self.rows: dict[str, MissionRow] = {}
        self.snapshots: dict[str, bytes] = {}
        self.entries: dict[str, list[bytes]] = {}
        self.blobs: dict[str, bytes] = {}
        self.writes = 0
        self.kill_at = 0
        self.written = False
        self.dead = False
        self.fence = 0

    def arm(self, kill_at: int, *, written: bool) -> None:
        """Begin a new life, that ends at write number `kill_at`; 0: it does not."""
        self.writes, self.kill_at, self.written, self.dead = 0, kill_at, written, False
        self.fence += 1

    def create(self, row: MissionRow) -> None:
        self.rows[row.id] = row
        self.entries[row.id] = []

    def start(
        self, row: MissionRow, runner: str, *, seconds: float
    ) -> tuple[MissionRow, Lease] | None:
        if row.id in self.rows:
            return None
        self.create(row)
        return row, self.claim(row.id, runner, seconds=seconds, reserved=None)

    def find(self, id: str) -> MissionRow | None:
        return self.rows.get(id)

    def mission(self, id: str) -> MissionRow:
        return self.rows[id]

    def claim(self, id: str, runner: str, *, seconds: float, reserved: Lease | None) -> Lease:
        del seconds, reserved
        self._set(id, status=RUNNING)
        self.fence += 1
        return Lease(id, self.fence, runner)

    def renew(self, lease: Lease, *, seconds: float, beat_ns: int | None = None) -> bool:
        del lease, seconds, beat_ns
        return False

    def resources(self) -> list[object]:
        return []  # it has no other missions

    def append(
        self, lease, entries, *, snapshot=None, status=None, outcome=None, blobs=(), **_
    ) -> None:
        # The threads of an earlier life may still run: of a killed process nothing more comes.
        if self.dead or lease.fence != self.fence:
            raise Kill
        self.writes += 1
        self.dead = self.writes == self.kill_at
        if self.dead and not self.written:
            raise Kill
        self.entries[lease.mission] += entries
        self.blobs.update(blobs)
        if snapshot is not None:
            self.snapshots[lease.mission] = snapshot
            self.entries[lease.mission] = []
        if status is not None:
            self._set(lease.mission, status=status, outcome=outcome)
        if self.dead:
            raise Kill

    def read(self, id: str) -> tuple[bytes | None, list[bytes]]:
        return self.snapshots.get(id), list(self.entries[id])

    def blob(self, _: str, digest: str) -> bytes:
        return self.blobs[digest]

    def release(self, lease: Lease, status: str, *, note: str = "") -> None:
        if self.rows[lease.mission].status not in OVER:
            self._set(lease.mission, status=status)

    def forget(self, id: str) -> None:
        del self.rows[id], self.entries[id]
        self.snapshots.pop(id, None)

    def request_cancel(self, id: str) -> None:
        self._set(id, cancel=True)

    def close(self) -> None:
        pass

    def _set(self, id: str, **facts: object) -> None:
        self.rows[id] = dataclasses.replace(self.rows[id], **facts)
