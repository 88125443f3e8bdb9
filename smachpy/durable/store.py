"""Where journals of missions are kept: the interface of a store, its rows and its errors.

A store keeps for each mission one row, its newest snapshot and the entries after it. Who writes
holds a lease. Each lease of a mission has a higher fence than the one before, and every write names
its fence, so that a runner that was suspended and comes back can change nothing any more (a fencing
token; M. Kleppmann, "How to do distributed locking", 2016).

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
"""What is wrong with a store:

- `"missing"`: there is none, and none was to be made
- `"foreign"`: it is something else than a journal
- `"future"`: a newer smachpy has written it
- `"corrupt"`: its bytes are damaged, or entries are gone
- `"busy"`: another process keeps it locked
- `"full"`: no space is left
- `"unreachable"`: it cannot be opened, or the server does not answer
- `"failed"`: the rest; the text says what
"""


@dataclass(frozen=True)
class Lease:
    """The right to write the journal of one mission.

    Attributes:
        mission: Its id.
        fence: Counts the leases of this mission, from 1; a later one makes the earlier ones void.
        runner: Who holds it, "host:pid".
    """

    mission: str
    fence: int
    runner: str


@dataclass(frozen=True)
class MissionRow:
    """What a store knows of a mission.

    Attributes:
        id: Its id.
        name: The name of its root.
        target: What `smachpy run` was given.
        argv: The arguments that belong to it.
        status: "queued", "running", "interrupted" (its runner is gone), "ended" or "cancelled".
        outcome: How it ended, else None.
        robot: The robot that it needs, None for any.
        created: When, in seconds since the Unix epoch.
        changed: Its last sign of life: when an entry was written or its lease renewed.
        owner: The runner that holds it, "host:pid", or None.
        structure: Its machine, as the journal's code writes it.
        version: Version of the entries.
        due: When it may begin, in seconds since the Unix epoch; None: at once.
        every: Of a schedule, its cron expression: each time it is `due`, a mission like it is
            put into the queue. It is never run itself.
        schedule: The id of the schedule that it belongs to, else None.
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
        """What names this mission and no other: an id may be used again when one has ended."""
        return f"{self.id} {round(self.created * 1e6)}"


class Store(Protocol):
    """Keeps the journals of missions; every method may be called from any thread.

    All methods raise `StoreError` when the store cannot be read or written, and
    `UnknownMissionError` for an id that it does not have. They block for the disk or the server, at
    most for the store's `patience`.
    """

    def create(self, row: MissionRow) -> None:
        """Add a mission; its `owner` is ignored.

        Raises:
            MissionError: there is one of this id.
        """
        ...

    def missions(self, *, open_only: bool = False) -> list[MissionRow]:
        """Return all missions, the oldest first.

        Args:
            open_only: Leave out those that have ended or were cancelled.
        """
        ...

    def mission(self, id: str) -> MissionRow:  # noqa: A002  the word of the interface
        """Return one mission."""
        ...

    def claim(self, id: str, runner: str, *, seconds: float) -> Lease:  # noqa: A002
        """Take a mission over, or begin it; its status becomes "running".

        Args:
            id: The mission.
            runner: This process, `this_runner()`.
            seconds: How long the lease lasts without `renew` [s].

        Raises:
            MissionInUseError: another one that lives holds it, or another mission of its robot.
            MissionOverError: it has ended or was cancelled.
            MissionError: it is a schedule.
        """
        ...

    def renew(self, lease: Lease, *, seconds: float) -> bool:
        """Let a lease last `seconds` [s] from now.

        Returns:
            Whether `request_cancel` was called for the mission.

        Raises:
            FencedError: another one has taken the mission over.
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
            lease: The right to do so.
            entries: In order.
            snapshot: Replaces all entries so far, with these: they are deleted.
            status: The mission's new one.
            outcome: How it ended.

        Raises:
            FencedError: another one has taken the mission over; nothing is written.
        """
        ...

    def read(self, id: str) -> tuple[bytes | None, list[bytes]]:  # noqa: A002
        """Return the newest snapshot, None when there is none, and the entries after it."""
        ...

    def release(self, lease: Lease, status: str) -> None:
        """Give a lease back; the mission has `status` from now on.

        Raises:
            FencedError: another one has taken the mission over.
        """
        ...

    def forget(self, id: str) -> None:  # noqa: A002
        """Delete a mission with its journal.

        Raises:
            MissionInUseError: one that lives holds it.
        """
        ...

    def begin_next(self, row: MissionRow, *, due: float | None, next_due: float) -> bool:
        """Put one mission of a schedule into the queue, and set when the next one is due.

        Args:
            row: The mission; it is created.
            due: When the schedule was due, as read; in seconds since the Unix epoch.
            next_due: When it is due again.

        Returns:
            Whether that was done: False when another runner has, or the schedule is over.
        """
        ...

    def request_cancel(self, id: str) -> None:  # noqa: A002
        """Ask for the end of a mission: one that is queued is "cancelled", the others are marked.

        The runner that holds it learns of it from `renew`, the next one from `MissionRow.cancel`.

        Raises:
            MissionOverError: it has ended or was cancelled before.
        """
        ...

    def close(self) -> None:
        """Close the file or the connection; again has no effect. Leases stay as they are."""
        ...


class StoreError(MissionError):
    """A store cannot be opened, read or written.

    Attributes:
        where: The file, or the server's URL without its password.
        reason: What is wrong in one word, see `Reason`.
    """

    def __init__(self, where: str, problem: str, *, reason: Reason) -> None:
        self.where = where
        self.reason = reason
        super().__init__(f"{where}: {problem}")


class UnknownMissionError(MissionError):
    """A store has no mission of this id.

    Attributes:
        mission: The id.
        known: Those that it has.
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
    """A mission, or its robot, is held by a process that lives.

    Attributes:
        mission: The mission that is held: another one when it is the robot that is in use.
        runner: Who holds it, "host:pid".
        host, pid: The same in parts.
        robot: The robot, when that is in use by another mission, else None.
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
            "expected one that nobody runs. Try again when that process has ended."
        )


class MissionOverError(MissionError):
    """A mission has ended already.

    Attributes:
        mission: Its id.
        status: "ended" or "cancelled".
    """

    def __init__(self, where: str, mission: str, status: str) -> None:
        self.mission = mission
        self.status = status
        super().__init__(
            f"{where}: mission {mission!r}: got one that is {status}; expected one that can go on. "
            "Try running it anew."
        )


class FencedError(MissionError):
    """Another runner has taken the mission over, or it was deleted: this one may not go on.

    Attributes:
        lease: The lease that is void.
        runner: Who holds the mission now, "host:pid", or None.
    """

    def __init__(self, where: str, lease: Lease, runner: str | None) -> None:
        self.lease = lease
        self.runner = runner
        by = f"{runner} has taken it over" if runner else "it was taken over, released or deleted"
        super().__init__(
            f"{where}: mission {lease.mission!r}: got a write of {lease.runner}, but {by}; "
            "expected one of who holds it. This process may not go on with the mission."
        )


def open_store(
    where: str | Path,
    *,
    synchronous: Literal["FULL", "NORMAL"] = "FULL",
    create: bool = True,
    patience: float | None = None,
) -> Store:
    """Open a file of SQLite, or a database of PostgreSQL.

    Args:
        where: A path, or "postgresql://[user[:password]@]host[:port]/database".
        synchronous: Of SQLite, when a transaction is durable: "FULL", when it returns; "NORMAL", it
            survives the end of the process, but the newest ones not a power loss. PostgreSQL: as
            the server is set up, but never with `synchronous_commit = off`.
        create: Whether to make a file that is missing. A folder is made, too.
        patience: How long a lock, and a server that is gone, are waited for [s]; None: 5 for
            SQLite, 8 for PostgreSQL. It must be less than a lease minus the time between two
            renewals: who cannot reach the store stops before another one takes over.

    Raises:
        StoreError: it cannot be opened; `reason` says why.
        ModuleNotFoundError: psycopg is missing, the extra `postgres`.
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
        from smachpy.durable.postgres import PostgresStore

        return PostgresStore(text, patience=8.0 if patience is None else patience)
    from smachpy.durable.sqlite import SQLiteStore

    patience = 5.0 if patience is None else patience
    return SQLiteStore(where, synchronous=synchronous, create=create, patience=patience)


def host_and_pid(runner: str) -> tuple[str, int]:
    """Split "host:pid".

    Raises:
        ValueError: it is none.
    """
    host, colon, pid = runner.rpartition(":")
    if not colon or not host or not pid.isdecimal():
        raise ValueError(f"runner: got {runner!r}; expected 'host:pid'.")
    return host, int(pid)


def check_lease_seconds(seconds: float) -> None:
    """Check how long a lease is to last.

    Raises:
        ValueError: it is no finite number above 0.
    """
    number = isinstance(seconds, (int, float)) and not isinstance(seconds, bool)
    if not number or not math.isfinite(seconds) or seconds <= 0:
        raise ValueError(f"lease: seconds: got {seconds!r}; expected a number of seconds above 0.")


def may_take(
    holder_lives: bool | None, lease_left: float, *, by_lease: bool, same_host: bool
) -> bool:
    """Tell whether a mission may be taken from its holder.

    Args:
        holder_lives: Whether its process does; None: cannot be told from here.
        lease_left: How long its lease still lasts [s].
        by_lease: The store is shared by computers: a process that lives but has stopped renewing
            loses its mission. Else it keeps it until it ends.
        same_host: The holder's host is called as this one.
    """
    if holder_lives is False:
        return True
    if not by_lease and holder_lives:
        return False
    if not by_lease and same_host:  # a file of this computer, and it has been restarted since
        return True
    return lease_left <= 0
