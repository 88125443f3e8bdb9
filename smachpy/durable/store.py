"""The interface of stores, which keep journals of missions; their rows and errors.

A store keeps for each mission one row, its newest snapshot and the entries after that. Writing
needs a lease. Each lease of a mission has a higher fence than the one before, and every write
carries its fence, so a runner that was suspended and continues later can no longer change anything
(a fencing token; M. Kleppmann, "How to do distributed locking", 2016).

    store = open_store("journal.db")                      # SQLite
    store = open_store("postgresql://db.example/missions")  # pip install 'smachpy[postgres]'
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, Protocol

from smachpy.exceptions import MissionError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

QUEUED: Final = "queued"
RUNNING: Final = "running"
INTERRUPTED: Final = "interrupted"
ENDED: Final = "ended"
CANCELLED: Final = "cancelled"
OVER: Final = (ENDED, CANCELLED)

Reason = Literal["missing", "foreign", "future", "corrupt", "busy", "full", "unreachable", "failed"]
"""Reasons of a `StoreError`:

- `"missing"`: there is no store, and `create` is False
- `"foreign"`: the file is not a journal
- `"future"`: a newer smachpy has written it
- `"corrupt"`: its bytes are damaged, or entries are missing
- `"busy"`: another process keeps it locked
- `"full"`: no space is left
- `"unreachable"`: it cannot be opened, or the server does not answer
- `"failed"`: anything else; see the text
"""


@dataclass(frozen=True)
class Lease:
    """The right to write the journal of one mission.

    Attributes:
        mission: Its id.
        fence: The number of the lease among those of this mission, from 1; only the newest is
            valid.
        runner: The process that holds it, "host:pid".
    """

    mission: str
    fence: int
    runner: str


@dataclass(frozen=True)
class MissionRow:
    """The record of a mission in a store.

    Attributes:
        id: Its id.
        name: The name of its root.
        target: The file or function that `smachpy run` was given.
        argv: The mission's own arguments.
        status: "queued", "running", "interrupted" (its runner is gone), "ended" or "cancelled".
        outcome: The outcome with which it has ended, else None.
        robot: The robot that it uses, None for any.
        created: The time of its creation [s since the Unix epoch].
        changed: Its last sign of life, an entry or a renewal of its lease [s since the Unix epoch].
        owner: The runner that holds it, "host:pid", or None.
        structure: The shape of its machine, see `smachpy.durable.structure`.
        version: Version of the entries.
        due: The time from which it may begin [s since the Unix epoch]; None: at once.
        every: For a schedule, its cron expression: each time it is `due`, a mission like it is put
            into the queue. The schedule itself is never run.
        schedule: The id of the schedule that created it, else None.
        cancel: Whether `request_cancel` was called.
    """

    id: str
    name: str
    target: str
    argv: tuple[str, ...]
    status: str
    outcome: str | None
    robot: str | None
    created: float
    changed: float
    owner: str | None
    structure: bytes
    version: int
    due: float | None = None
    every: str | None = None
    schedule: str | None = None
    cancel: bool = False

    @property
    def run(self) -> str:
        """A unique name of this run: when a mission has ended, its id may be used again."""
        return f"{self.id} {round(self.created * 1e6)}"


class Store(Protocol):
    """Keeps the journals of missions; every method may be called from any thread.

    All methods raise `StoreError` if the store cannot be read or written, and `UnknownMissionError`
    for an unknown id. They block until the disk or the server has answered, at most for the store's
    `patience`.
    """

    def create(self, row: MissionRow) -> None:
        """Add a mission; its `owner` is ignored.

        Raises:
            MissionError: the id exists.
        """
        ...

    def missions(self, *, open_only: bool = False) -> list[MissionRow]:
        """Return all missions, the oldest first.

        Args:
            open_only: Omit missions that have ended or were cancelled.
        """
        ...

    def mission(self, id: str) -> MissionRow:  # noqa: A002  the word of the interface
        """Return the row of one mission."""
        ...

    def claim(self, id: str, runner: str, *, seconds: float) -> Lease:  # noqa: A002
        """Take a lease of a mission, to begin or resume it; its status becomes "running".

        Args:
            id: The mission.
            runner: This process, `this_runner()`.
            seconds: The duration of the lease without `renew` [s].

        Raises:
            MissionInUseError: a living runner holds it, or another mission that uses its robot.
            MissionOverError: it has ended or was cancelled.
            MissionError: it is a schedule.
        """
        ...

    def renew(self, lease: Lease, *, seconds: float) -> bool:
        """Extend a lease to `seconds` [s] from now.

        Returns:
            Whether `request_cancel` was called for the mission.

        Raises:
            FencedError: another runner has taken the mission over.
        """
        ...

    def append(
        self,
        lease: Lease,
        entries: Sequence[bytes],
        *,
        snapshot: bytes | None = None,
        status: str | None = None,
        outcome: str | None = None,
    ) -> None:
        """Add entries in one transaction, which is durable when this returns.

        Args:
            lease: The writer's lease.
            entries: The new entries, oldest first.
            snapshot: Replaces all entries including the new ones, which are deleted; None: nothing
                is replaced.
            status: The mission's new status; None: unchanged.
            outcome: The mission's outcome; None: unchanged.

        Raises:
            FencedError: another runner has taken the mission over; nothing is written.
        """
        ...

    def read(self, id: str) -> tuple[bytes | None, list[bytes]]:  # noqa: A002
        """Return the newest snapshot, or None, and the entries after it."""
        ...

    def release(self, lease: Lease, status: str) -> None:
        """Give a lease back, and set the status of the mission.

        Raises:
            FencedError: another runner has taken the mission over.
        """
        ...

    def forget(self, id: str) -> None:  # noqa: A002
        """Delete a mission with its journal.

        Raises:
            MissionInUseError: a living runner holds it.
        """
        ...

    def begin_next(self, row: MissionRow, *, due: float | None, next_due: float) -> bool:
        """Put one mission of a schedule into the queue, and set the next due time.

        Args:
            row: The mission to create.
            due: The due time of the schedule as read before [s since the Unix epoch].
            next_due: The next one [s since the Unix epoch].

        Returns:
            Whether this call did it; False if another runner did, or the schedule was cancelled.
        """
        ...

    def request_cancel(self, id: str) -> None:  # noqa: A002
        """Request the end of a mission; a queued one is cancelled at once.

        A runner that holds the mission gets the request from `renew`, one that resumes it from
        `MissionRow.cancel`.

        Raises:
            MissionOverError: it has ended or was cancelled before.
        """
        ...

    def close(self) -> None:
        """Close the file or the connection; leases are not released. May be called twice."""
        ...


class StoreError(MissionError):
    """A store cannot be opened, read or written.

    Attributes:
        where: The file, or the server's URL without its password.
        reason: The reason in one word, see `Reason`.
    """

    def __init__(self, where: str, problem: str, *, reason: Reason) -> None:
        self.where = where
        self.reason = reason
        super().__init__(f"{where}: {problem}")


class UnknownMissionError(MissionError):
    """A store has no mission of this id.

    Attributes:
        mission: The id.
        known: The ids of its missions.
    """

    def __init__(self, where: str, mission: str, known: Iterable[str]) -> None:
        self.mission = mission
        self.known = tuple(known)
        hint = did_you_mean(mission, self.known)
        super().__init__(
            f"{where}: mission: got {mission!r}; expected one of its {len(self.known)} missions."
            f"{hint or ' Try: smachpy missions list'}"
        )


class MissionInUseError(MissionError):
    """A living process holds a mission, or another mission that uses the same robot.

    Attributes:
        mission: The mission that is held; if the robot is in use, the mission that uses it.
        runner: The process, "host:pid".
        host, pid: Its two parts.
        robot: The robot, if another mission uses it, else None.
    """

    def __init__(self, where: str, mission: str, runner: str, *, robot: str | None = None) -> None:
        self.mission = mission
        self.runner = runner
        self.host, self.pid = host_and_pid(runner)
        self.robot = robot
        what = f"mission {mission!r}" if robot is None else f"robot {robot!r}"
        for_what = "" if robot is None else f" for mission {mission!r}"
        super().__init__(
            f"{where}: {what}: got one that process {self.pid} on {self.host!r} runs{for_what}; "
            "expected one that no process runs. Try again when that process has ended."
        )


class MissionOverError(MissionError):
    """A mission has ended already or was cancelled.

    Attributes:
        mission: Its id.
        status: "ended" or "cancelled".
    """

    def __init__(self, where: str, mission: str, status: str) -> None:
        self.mission = mission
        self.status = status
        super().__init__(
            f"{where}: mission {mission!r}: got one that is {status}; expected one that can be "
            "resumed. Try to start it anew."
        )


class FencedError(MissionError):
    """This process has lost its lease: another runner took the mission over, or it was deleted.

    Attributes:
        lease: The lost lease.
        runner: The process that holds the mission now, "host:pid", or None.
    """

    def __init__(self, where: str, lease: Lease, runner: str | None) -> None:
        self.lease = lease
        self.runner = runner
        by = f"{runner} has taken it over" if runner else "it was taken over, released or deleted"
        super().__init__(
            f"{where}: mission {lease.mission!r}: got a write of {lease.runner}, but {by}; "
            "expected one of its holder. This process must not continue the mission."
        )


def open_store(
    where: str | Path,
    *,
    synchronous: Literal["FULL", "NORMAL"] = "FULL",
    create: bool = True,
    patience: float | None = None,
) -> Store:
    """Open an SQLite file or a PostgreSQL database.

    Args:
        where: A path, or "postgresql://[user[:password]@]host[:port]/database".
        synchronous: For SQLite. "FULL": a transaction is on the disk when it returns. "NORMAL": it
            survives the end of the process, but a power loss may undo the newest ones. PostgreSQL
            uses the server's setting, except `synchronous_commit = off`.
        create: Whether to create a missing file, and its folder.
        patience: Longest wait for a lock or an unreachable server [s]; None: 5 for SQLite, 8 for
            PostgreSQL. It must be less than a lease minus the time between two renewals, so that a
            runner that cannot reach the store stops before another one takes over.

    Raises:
        StoreError: it cannot be opened; see `reason`.
        ModuleNotFoundError: the package psycopg of the extra `postgres` is missing.
    """
    text = str(where)
    if "://" in text:
        scheme = text.partition("://")[0]
        if scheme not in {"postgresql", "postgres"}:
            raise StoreError(
                f"{scheme}://",
                f"store: got a URL of {scheme!r}; expected a path, or postgresql://HOST/DATABASE.",
                reason="unreachable",
            )
        from smachpy.durable.postgres import PostgresStore  # needs psycopg, an optional extra

        return PostgresStore(text, patience=8.0 if patience is None else patience)
    from smachpy.durable.sqlite import SQLiteStore

    patience = 5.0 if patience is None else patience
    return SQLiteStore(where, synchronous=synchronous, create=create, patience=patience)


def host_and_pid(runner: str) -> tuple[str, int]:
    """Split "host:pid".

    Raises:
        ValueError: the text has another form.
    """
    # From the right: the host may be an IPv6 address, with colons in it.
    host, colon, pid = runner.rpartition(":")
    if not colon or not host or not pid.isdecimal():
        raise ValueError(f"runner: got {runner!r}; expected 'host:pid'.")
    return host, int(pid)


def check_lease_seconds(seconds: float) -> None:
    """Check the duration of a lease.

    Raises:
        ValueError: it is not a finite number above 0.
    """
    number = isinstance(seconds, (int, float)) and not isinstance(seconds, bool)
    if not number or not math.isfinite(seconds) or seconds <= 0:
        raise ValueError(f"lease: seconds: got {seconds!r}; expected a number of seconds above 0.")


def may_take(
    holder_lives: bool | None, lease_left: float, *, by_lease: bool, same_host: bool
) -> bool:
    """Return whether a mission may be taken from the process that holds it.

    Args:
        holder_lives: Whether that process is alive; None: unknown.
        lease_left: Time until its lease ends [s].
        by_lease: Whether computers share the store. Then a living process that has stopped renewing
            loses its mission; otherwise it keeps the mission until it ends.
        same_host: Whether its host has the name of this one.
    """
    if holder_lives is False:
        return True
    if not by_lease and holder_lives:
        return False
    # Unknown on a computer of the same name: it has been restarted since, see `process_lives`.
    if not by_lease and same_host:
        return True
    return lease_left <= 0
