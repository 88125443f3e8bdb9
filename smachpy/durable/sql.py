# ruff: noqa: S608  statements are built from our own column names; values are always bound
"""The common part of stores in SQL databases: the tables, and every method of `Store`.

Databases differ in how they are opened, in how transactions begin, and in their errors; a subclass
has `_transact`, `_now`, `_verify` and `close` for these, and a `Dialect`.
"""

from __future__ import annotations

import json
import zlib
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from smachpy.durable.processes import process_lives, process_mark, this_runner
from smachpy.durable.store import (
    CANCELLED,
    INTERRUPTED,
    OVER,
    QUEUED,
    RUNNING,
    FencedError,
    Lease,
    MissionInUseError,
    MissionOverError,
    MissionRow,
    StoreError,
    UnknownMissionError,
    check_lease_seconds,
    host_and_pid,
    may_take,
)
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

T = TypeVar("T")

VERSION: Final = 1
"""Version of the tables; a store with a higher one was written by a newer smachpy."""

_COLUMNS: Final = (
    "id, name, target, argv, status, outcome, robot, created, changed, owner, structure, version, "
    "due, every, schedule, cancel"
)


@dataclass(frozen=True)
class Dialect:
    """The parts of SQL statements that differ between databases.

    Attributes:
        placeholder: Stands for a value in a statement.
        blob, real: Types of columns.
        for_update, for_share: Ends of a SELECT that lock its rows.
        clustered: End of a CREATE TABLE that stores rows in the order of their primary key.
        one_claimer: A statement after which only this transaction can claim missions, or "".
    """

    placeholder: str
    blob: str
    real: str
    for_update: str = ""
    for_share: str = ""
    clustered: str = ""
    one_claimer: str = ""

    def tables(self) -> tuple[str, ...]:
        """Return the statements that create the tables."""
        missions = (
            "id TEXT PRIMARY KEY, name TEXT NOT NULL, target TEXT NOT NULL, argv TEXT NOT NULL, "
            f"status TEXT NOT NULL, outcome TEXT, robot TEXT, created {self.real} NOT NULL, "
            f"changed {self.real} NOT NULL, owner TEXT, structure {self.blob} NOT NULL, "
            f"version INTEGER NOT NULL, due {self.real}, every TEXT, schedule TEXT, "
            f"cancel INTEGER NOT NULL, fence INTEGER NOT NULL, mark TEXT, lease_end {self.real}"
        )
        entries = (
            "mission TEXT NOT NULL, n INTEGER NOT NULL, fence INTEGER NOT NULL, "
            f"crc BIGINT NOT NULL, data {self.blob} NOT NULL, PRIMARY KEY (mission, n)"
        )
        snapshots = (
            "mission TEXT PRIMARY KEY, n INTEGER NOT NULL, "
            f"crc BIGINT NOT NULL, data {self.blob} NOT NULL"
        )
        return (
            f"CREATE TABLE smachpy_missions ({missions})",
            f"CREATE TABLE smachpy_entries ({entries}){self.clustered}",
            f"CREATE TABLE smachpy_snapshots ({snapshots})",
        )


class Cursor(Protocol):
    """The methods of a database cursor that are used here; both drivers have them."""

    def execute(self, sql: str, values: Sequence[Any] = (), /) -> object:
        """Run a statement."""
        ...

    def executemany(self, sql: str, rows: Iterable[Sequence[Any]], /) -> object:
        """Run a statement once per row."""
        ...

    def fetchone(self) -> Any:
        """Return the next row of the result, None at its end."""
        ...

    def fetchall(self) -> list[Any]:
        """Return the rest of the result."""
        ...


class SqlStore(ABC):
    """A store in a SQL database."""

    where: str
    by_lease: bool
    dialect: Dialect

    def __init__(self) -> None:
        self._mark = process_mark()
        self._host = host_and_pid(this_runner())[0]
        # Number of the last entry that each lease has written. After a failover the server may have
        # fewer: the standby took over without the newest transactions.
        self._written: dict[Lease, int] = {}

    @abstractmethod
    def _transact(self, work: Callable[[Cursor, bool], T], *, reads: bool = False) -> T:
        """Run `work` in one transaction, which is committed and durable when this returns.

        If the connection is lost, `work` runs again. Its second argument is True then: the first
        transaction may have been committed although its answer was lost.

        Args:
            work: The function to run.
            reads: Whether it only reads.
        """

    @abstractmethod
    def _now(self, cursor: Cursor) -> float:
        """Return the time [s since the Unix epoch] of the one clock that all runners go by."""

    def create(self, row: MissionRow) -> None:
        """As `Store.create`."""

        def work(cursor: Cursor, again: bool) -> None:
            found = self._one(cursor, "SELECT created FROM smachpy_missions WHERE id = ?", row.id)
            if found is not None:
                if again and found[0] == row.created:  # by the first try, whose answer was lost
                    return
                raise MissionError(
                    f"{self.where}: mission {row.id!r}: got an id that is taken; "
                    f"expected a new one. Try 'smachpy missions forget {row.id}', if it is over."
                )
            self._insert(cursor, row)

        self._transact(work)

    def missions(self, *, open_only: bool = False) -> list[MissionRow]:
        """As `Store.missions`."""
        which = f" WHERE status NOT IN {OVER}" if open_only else ""

        def work(cursor: Cursor, _: bool) -> list[MissionRow]:
            self._do(
                cursor,
                f"SELECT {_COLUMNS}, mark, lease_end FROM smachpy_missions{which} "
                "ORDER BY created, id",
            )
            rows = cursor.fetchall()
            now = self._now(cursor)
            return [self._row(row, now) for row in rows]

        return self._transact(work, reads=True)

    def mission(self, id: str) -> MissionRow:  # noqa: A002
        """As `Store.mission`."""

        def work(cursor: Cursor, _: bool) -> MissionRow:
            row = self._known(cursor, id, f"{_COLUMNS}, mark, lease_end")
            return self._row(row, self._now(cursor))

        return self._transact(work, reads=True)

    def claim(self, id: str, runner: str, *, seconds: float) -> Lease:  # noqa: A002
        """As `Store.claim`."""
        check_lease_seconds(seconds)
        host_and_pid(runner)

        def work(cursor: Cursor, again: bool) -> Lease:
            if self.dialect.one_claimer:
                self._do(cursor, self.dialect.one_claimer)
            row = self._known(
                cursor,
                id,
                "status, robot, owner, mark, lease_end, fence, every" + self.dialect.for_update,
            )
            status, robot, owner, mark, lease_end, fence, every = row
            now = self._now(cursor)
            if status in OVER:
                raise MissionOverError(self.where, id, status)
            if every is not None:
                raise MissionError(
                    f"{self.where}: mission {id!r}: got a schedule, {every!r}; expected one of the "
                    "missions that it begins. Try: smachpy missions list"
                )
            if not (again and owner == runner and mark == self._mark):  # not by the first try
                self._refuse_held(id, owner, mark, lease_end, now)
            if robot is not None:
                self._take_robot(cursor, id, robot, now)
            self._do(
                cursor,
                "UPDATE smachpy_missions SET status = ?, owner = ?, mark = ?, lease_end = ?, "
                "fence = ? WHERE id = ?",
                *(RUNNING, runner, self._mark, now + seconds, fence + 1, id),
            )
            return Lease(id, fence + 1, runner)

        return self._transact(work)

    def renew(self, lease: Lease, *, seconds: float) -> bool:
        """As `Store.renew`."""
        check_lease_seconds(seconds)

        def work(cursor: Cursor, _: bool) -> bool:
            cancel = self._fenced(cursor, lease)[0]
            now = self._now(cursor)
            self._do(
                cursor,
                "UPDATE smachpy_missions SET lease_end = ?, changed = ? WHERE id = ?",
                *(now + seconds, now, lease.mission),
            )
            return cancel

        return self._transact(work)

    def append(
        self,
        lease: Lease,
        entries: Sequence[bytes],
        *,
        snapshot: bytes | None = None,
        status: str | None = None,
        outcome: str | None = None,
    ) -> None:
        """As `Store.append`."""
        mission = lease.mission

        def work(cursor: Cursor, again: bool) -> int:
            _, last = self._fenced(cursor, lease)
            if again and lease in self._written:
                before = self._written[lease]
                if entries and last == before + len(entries):
                    return last  # the first try was committed; only its answer was lost
                if last < before:
                    raise self._damaged(mission, f"the server has {last} entries of {before}")
            # Numbers without gaps, and a checksum each: `read` notices lost and damaged entries.
            if entries:
                rows = (
                    (mission, n, lease.fence, zlib.crc32(data), data)
                    for n, data in enumerate(entries, last + 1)
                )
                self._do_many(
                    cursor,
                    "INSERT INTO smachpy_entries (mission, n, fence, crc, data) "
                    "VALUES (?, ?, ?, ?, ?)",
                    rows,
                )
                last += len(entries)
            if snapshot is not None:
                self._compact(cursor, mission, last, snapshot)
            if status is not None or outcome is not None:
                self._do(
                    cursor,
                    "UPDATE smachpy_missions SET status = COALESCE(?, status), "
                    "outcome = COALESCE(?, outcome), changed = ? WHERE id = ?",
                    *(status, outcome, self._now(cursor), mission),
                )
            return last

        self._written[lease] = self._transact(work)

    def read(self, id: str) -> tuple[bytes | None, list[bytes]]:  # noqa: A002
        """As `Store.read`."""

        def work(cursor: Cursor, _: bool) -> tuple[Any, list[Any]]:
            self._verify(cursor)
            # In PostgreSQL each statement sees what is committed by then; the locked row keeps a
            # runner from compacting between the two below.
            self._known(cursor, id, "id" + self.dialect.for_share)
            snapshot = self._one(
                cursor, "SELECT n, crc, data FROM smachpy_snapshots WHERE mission = ?", id
            )
            self._do(
                cursor,
                "SELECT n, crc, data FROM smachpy_entries WHERE mission = ? ORDER BY n",
                id,
            )
            return snapshot, cursor.fetchall()

        snapshot, rows = self._transact(work, reads=True)
        expected = 0 if snapshot is None else snapshot[0]
        for n, crc, data in rows:
            expected += 1
            if n != expected or zlib.crc32(data) != crc:
                what = "is missing" if n != expected else "is damaged"
                raise self._damaged(id, f"entry {expected} {what}")
        if snapshot is not None and zlib.crc32(snapshot[2]) != snapshot[1]:
            raise self._damaged(id, "its snapshot is damaged")
        return None if snapshot is None else snapshot[2], [row[2] for row in rows]

    def release(self, lease: Lease, status: str) -> None:
        """As `Store.release`."""

        def work(cursor: Cursor, again: bool) -> None:
            try:
                self._fenced(cursor, lease)
            except FencedError as error:
                if again and error.runner is None:  # released by the first try
                    return
                raise
            self._do(
                cursor,
                "UPDATE smachpy_missions SET status = ?, owner = NULL, mark = NULL, "
                "lease_end = NULL WHERE id = ?",
                *(status, lease.mission),
            )

        self._transact(work)
        self._written.pop(lease, None)

    def forget(self, id: str) -> None:  # noqa: A002
        """As `Store.forget`."""

        def work(cursor: Cursor, again: bool) -> None:
            try:
                columns = "owner, mark, lease_end" + self.dialect.for_update
                owner, mark, lease_end = self._known(cursor, id, columns)
            except UnknownMissionError:
                if again:  # deleted by the first try
                    return
                raise
            self._refuse_held(id, owner, mark, lease_end, self._now(cursor))
            for table, key in (
                ("entries", "mission"),
                ("snapshots", "mission"),
                ("missions", "id"),
            ):
                self._do(cursor, f"DELETE FROM smachpy_{table} WHERE {key} = ?", id)

        self._transact(work)

    def begin_next(self, row: MissionRow, *, due: float | None, next_due: float) -> bool:
        """As `Store.begin_next`."""

        def work(cursor: Cursor, again: bool) -> bool:
            if again:
                found = self._one(cursor, "SELECT 1 FROM smachpy_missions WHERE id = ?", row.id)
                if found is not None:  # created by the first try
                    return True
            schedule = self._one(
                cursor,
                "SELECT status, due FROM smachpy_missions WHERE id = ?" + self.dialect.for_update,
                row.schedule,
            )
            # Another runner has seen the same schedule and was faster: it has moved `due`.
            if schedule is None or tuple(schedule) != (QUEUED, due):
                return False
            self._insert(cursor, row)
            self._do(
                cursor,
                "UPDATE smachpy_missions SET due = ?, changed = ? WHERE id = ?",
                *(next_due, self._now(cursor), row.schedule),
            )
            return True

        return self._transact(work)

    def request_cancel(self, id: str) -> None:  # noqa: A002
        """As `Store.request_cancel`."""

        def work(cursor: Cursor, again: bool) -> None:
            (status,) = self._known(cursor, id, "status" + self.dialect.for_update)
            if status in OVER and not again:
                raise MissionOverError(self.where, id, status)
            self._do(cursor, "UPDATE smachpy_missions SET cancel = 1 WHERE id = ?", id)
            if status == QUEUED:
                self._do(
                    cursor,
                    "UPDATE smachpy_missions SET status = ?, changed = ? WHERE id = ?",
                    *(CANCELLED, self._now(cursor), id),
                )

        self._transact(work)

    @abstractmethod
    def _verify(self, cursor: Cursor) -> None:
        """Check that the database file is not damaged, if the database does not check it itself."""

    @abstractmethod
    def close(self) -> None:
        """As `Store.close`."""

    def _do(self, cursor: Cursor, sql: str, *values: object) -> None:
        try:
            cursor.execute(sql.replace("?", self.dialect.placeholder), values)
        except UnicodeEncodeError as error:  # bytes of a command line that are no UTF-8
            problem = f"got {error.object!r}; expected text that can be written in UTF-8."
            raise StoreError(self.where, problem, reason="failed") from error

    def _do_many(self, cursor: Cursor, sql: str, rows: Iterable[Sequence[Any]]) -> None:
        cursor.executemany(sql.replace("?", self.dialect.placeholder), rows)

    def _one(self, cursor: Cursor, sql: str, *values: object) -> Any:
        self._do(cursor, sql, *values)
        return cursor.fetchone()

    def _insert(self, cursor: Cursor, row: MissionRow) -> None:
        columns = _COLUMNS.split(", ")
        values = {name: getattr(row, name) for name in columns}
        values.update(argv=json.dumps(list(row.argv)), owner=None, cancel=int(row.cancel))
        places = ", ".join("?" * len(columns))
        self._do(
            cursor,
            f"INSERT INTO smachpy_missions ({_COLUMNS}, fence) VALUES ({places}, 0)",
            *values.values(),
        )

    def _known(self, cursor: Cursor, id: str, columns: str) -> Any:  # noqa: A002
        """Return columns of a mission.

        Args:
            cursor: The cursor.
            id: The mission.
            columns: Their names; an end that locks the row, as in `Dialect`, may follow.

        Raises:
            UnknownMissionError: there is no such mission.
        """
        names, lock, how = columns.partition(" FOR ")
        row = self._one(cursor, f"SELECT {names} FROM smachpy_missions WHERE id = ?{lock}{how}", id)
        if row is None:
            self._do(cursor, "SELECT id FROM smachpy_missions ORDER BY created")
            raise UnknownMissionError(self.where, id, [each[0] for each in cursor.fetchall()])
        return row

    def _fenced(self, cursor: Cursor, lease: Lease) -> tuple[bool, int]:
        """Lock the mission's row; return whether a cancel was requested, and its last entry.

        Raises:
            FencedError: the lease is void.
        """
        # Check and write are one transaction, and the row is locked: a claim cannot come between.
        row = self._one(
            cursor,
            "SELECT fence, owner, cancel, COALESCE("
            "(SELECT MAX(n) FROM smachpy_entries WHERE mission = m.id), "
            "(SELECT n FROM smachpy_snapshots WHERE mission = m.id), 0) "
            "FROM smachpy_missions AS m WHERE id = ?" + self.dialect.for_update,
            lease.mission,
        )
        if row is None or row[0] != lease.fence or row[1] != lease.runner:
            raise FencedError(self.where, lease, row and row[1])
        return bool(row[2]), int(row[3])

    def _compact(self, cursor: Cursor, mission: str, last: int, snapshot: bytes) -> None:
        self._do(
            cursor,
            "INSERT INTO smachpy_snapshots (mission, n, crc, data) VALUES (?, ?, ?, ?) "
            "ON CONFLICT (mission) DO UPDATE SET n = excluded.n, crc = excluded.crc, "
            "data = excluded.data",
            *(mission, last, zlib.crc32(snapshot), snapshot),
        )
        self._do(cursor, "DELETE FROM smachpy_entries WHERE mission = ? AND n <= ?", mission, last)

    def _may_take(self, owner: str | None, mark: str | None, lease_end: Any, now: float) -> bool:
        if owner is None:
            return True
        host, pid = host_and_pid(owner)
        return may_take(
            process_lives(pid, mark or ""),
            (lease_end or 0.0) - now,
            by_lease=self.by_lease,
            same_host=host == self._host,
        )

    def _refuse_held(
        self, mission: str, owner: str | None, mark: str | None, lease_end: Any, now: float
    ) -> None:
        if owner is not None and not self._may_take(owner, mark, lease_end, now):
            raise MissionInUseError(self.where, mission, owner)

    def _take_robot(self, cursor: Cursor, mission: str, robot: str, now: float) -> None:
        """Take the robot of this mission away from missions whose runner is gone.

        Raises:
            MissionInUseError: a mission with a living runner uses it.
        """
        self._do(
            cursor,
            "SELECT id, owner, mark, lease_end FROM smachpy_missions "
            "WHERE robot = ? AND id <> ? AND owner IS NOT NULL",
            *(robot, mission),
        )
        for other, owner, mark, lease_end in cursor.fetchall():
            if not self._may_take(owner, mark, lease_end, now):
                raise MissionInUseError(self.where, other, owner, robot=robot)
            # A higher fence: if its runner was only suspended, its next write is refused.
            self._do(
                cursor,
                "UPDATE smachpy_missions SET owner = NULL, mark = NULL, fence = fence + 1 "
                "WHERE id = ?",
                other,
            )

    def _row(self, row: Sequence[Any], now: float) -> MissionRow:
        *columns, mark, lease_end = row
        fields = dict(zip(_COLUMNS.split(", "), columns, strict=True))
        if fields["status"] == RUNNING and self._may_take(fields["owner"], mark, lease_end, now):
            fields["status"] = INTERRUPTED
        try:
            fields["argv"] = tuple(json.loads(fields["argv"]))
        except (TypeError, ValueError) as error:
            raise self._damaged(str(fields["id"]), "its arguments are damaged") from error
        fields["cancel"] = bool(fields["cancel"])
        return MissionRow(**fields)

    def _damaged(self, mission: str, what: str) -> StoreError:
        return StoreError(
            self.where,
            f"mission {mission!r}: got a damaged journal: {what}; expected an undamaged one. "
            "Nothing was changed. Try a copy, or: smachpy missions forget " + mission,
            reason="corrupt",
        )
