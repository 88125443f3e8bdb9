# ruff: noqa: S608  statements are built from our own column names; values are always bound
"""The common part of stores in SQL databases: the tables, and every method of `Store`.

Databases differ in how they are opened, in how transactions begin, and in their errors; a subclass
has `_transact`, `_now`, `_verify` and `close` for these, and a `Dialect`.

Each step of the queue is one statement, or is repeated safely: a process may be killed, and in
PostgreSQL suspended, between any two.
"""

from __future__ import annotations

import json
import math
import os
import zlib
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from types import MappingProxyType, NoneType
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from actionlib_core.clock import current_clock
from actionlib_core.clock.forks import is_copy
from actionlib_core.names import clean_namespace
from smachpy.durable.position import VERSION as FORMAT
from smachpy.durable.processes import (
    is_of_other_boot,
    process_lives,
    process_mark,
    this_runner,
)
from smachpy.durable.store import (
    INTERRUPTED,
    OVER,
    PAGE,
    QUEUED,
    RUNNING,
    FencedError,
    Lease,
    MissionInUseError,
    MissionOverError,
    MissionRow,
    QueueNews,
    ResourceUse,
    StoreError,
    UnknownMissionError,
    check_lease_seconds,
    digest_of,
    host_and_pid,
    may_take,
)
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from actionlib_core.resources import Policy

T = TypeVar("T")

VERSION: Final = 3
"""Version of the tables; a store with a higher one was written by a newer smachpy.

Versions 2 and 3 only add columns, tables and indexes, and each new column has a default: a process
of an older version that has the store open goes on, and one that opens it is refused.
"""

_COLUMNS: Final = (
    "id, name, target, argv, status, outcome, robot, created, changed, owner, structure, version, "
    "due, every, schedule, cancel, priority, not_after, grp, drives, note"
)
_FIELDS: Final = _COLUMNS.replace("grp", "group").split(", ")
_HELD: Final = "owner, mark, lease_end, lease_clock"
"""The columns from which `_may_take` decides."""

_ROBOT: Final = "COALESCE({0}drives, {0}robot)"
"""The robot that a mission holds, as an expression; `drives` is null in rows of version 1."""

_FREE: Final = "waits = 0 AND owner IS NULL"
"""The condition of missions that may be taken, with a status."""

_LATER: Final = "waits = 1 AND every IS NULL"
"""The condition of missions that are due later."""

_BREAK: Final = "\n"
"""Stands between the parts of `Dialect.needs`: no robot and no group has one."""

_LAST: Final = "\U0010ffff"
"""No text comes after it, byte by byte."""

_AFTER_BREAK: Final = "\v"
"""The next character: what begins with a robot and `_BREAK` is before the robot and this."""

MAX_LEFT_ROWS: Final = 500
MAX_LEFT_SHAPES: Final = 50
"""The most missions, and targets, that `reserve` passes over: they are bound to a statement."""

FRONT: Final = 16
"""Missions that `reserve` looks at one by one; behind them it looks at what they need."""

MAX_KINDS: Final = 10_000
"""The most different needs whose first missions it compares: they are bound to a statement."""

_FRONT: Final = (
    "WITH front AS (SELECT id FROM smachpy_missions WHERE status = '{}' AND "
    f"{_FREE} ORDER BY priority DESC, ready, id LIMIT {FRONT}) "
    "SELECT m.id FROM front CROSS JOIN smachpy_missions AS m WHERE m.id = front.id "
    "AND m.status || '' = '{}' AND m.waits + 0 = 0 AND COALESCE(m.owner, '') = ''"
)
"""Those in front. Another runner may have taken them meanwhile, so what they are is asked again,
and in a form for which no index is of use: PostgreSQL is to find them by their ids.
"""

PRUNED_AT_ONCE: Final = 500
"""Missions that `prune` deletes in one transaction: others write in between."""


@dataclass(frozen=True)
class Dialect:
    """The parts of SQL statements that differ between databases.

    Attributes:
        placeholder: Stands for a value in a statement.
        blob, real, big: Types of columns.
        for_update, for_share: Ends of a SELECT that lock its rows.
        skip_locked: End of a SELECT that locks its row, and passes over rows that others lock.
        clustered: End of a CREATE TABLE that stores rows in the order of their primary key.
        notify: A statement that wakes runners when its transaction is committed, or "".
        bytewise: End of an expression that is compared byte by byte, whatever the language.
    """

    placeholder: str
    blob: str
    real: str
    big: str
    for_update: str = ""
    for_share: str = ""
    skip_locked: str = ""
    clustered: str = ""
    notify: str = ""
    bytewise: str = ""

    def needs(self, table: str = "") -> str:
        """Return what a mission needs as one text of SQL: its robot, group and target.

        If a mission cannot begin as these are in use or not allowed, no other one with the same
        needs can.

        Args:
            table: The name of the missions' table in the statement, with a dot.
        """
        robot = f"COALESCE({table}drives, {table}robot, '')"
        words = (robot, f"COALESCE({table}grp, '')", f"{table}target")
        text = f" || '{_BREAK}' || ".join(words)
        return f"({text}){self.bytewise}"

    def tables(self) -> tuple[str, ...]:
        """Return the statements that create the tables of version 1."""
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

    def columns(self) -> dict[str, str]:
        """Return the columns that version 2 adds to the missions: name -> type and default."""
        return {
            "priority": "INTEGER NOT NULL DEFAULT 0",
            "not_after": self.real,
            "grp": "TEXT",
            "drives": "TEXT",
            "note": "TEXT NOT NULL DEFAULT ''",
            # 1: it is due later, or is a schedule. `look` sets 0 when it is due, so that no claim
            # depends on a clock.
            "waits": "INTEGER NOT NULL DEFAULT 0",
            # Since when it waits, by the store's clock: missions of one priority begin in this
            # order.
            "ready": f"{self.real} NOT NULL DEFAULT 0",
            # The end of the lease, and the time of `changed`, on a clock that nobody sets; see
            # `SqlStore._steady`.
            "lease_clock": "TEXT",
            "beat_clock": "TEXT",
            "beat_ns": self.big,
        }

    def additions(self) -> tuple[str, ...]:
        """Return the statements of newer versions that follow the columns; they may be repeated."""
        blobs = (
            f"mission TEXT NOT NULL, digest TEXT NOT NULL, data {self.blob} NOT NULL, "
            "PRIMARY KEY (mission, digest)"
        )
        table = f"CREATE TABLE IF NOT EXISTS smachpy_blobs ({blobs}){self.clustered}"
        resources = (
            "resource TEXT NOT NULL, mission TEXT NOT NULL, state TEXT NOT NULL, "
            "place INTEGER NOT NULL, holds INTEGER NOT NULL, urgent INTEGER NOT NULL, "
            "PRIMARY KEY (resource, mission)"
        )
        # This is what keeps a resource from two missions.
        one_holder = (
            "CREATE UNIQUE INDEX IF NOT EXISTS smachpy_holders "
            "ON smachpy_resources (resource) WHERE holds = 1"
        )
        held = (
            f"CREATE TABLE IF NOT EXISTS smachpy_resources ({resources}){self.clustered}",
            one_holder,
        )
        changes = (f"UPDATE smachpy_missions {change}" for change in _CHANGES)
        return (table, *changes, *self.indexes().values(), *held)

    def indexes(self) -> dict[str, str]:
        """Return the statements that create the indexes of the missions, by the indexes' names.

        One that is new here needs no new version: a store without it gets it when it is opened.
        """
        columns = f"(status, ({self.needs()}), priority DESC, ready, id)"
        needs = ("needs", "INDEX", columns, f" WHERE {_FREE}")
        return {
            f"smachpy_{name}": f"CREATE {kind} IF NOT EXISTS smachpy_{name} "
            f"ON smachpy_missions {columns}{where}"
            for name, kind, columns, where in (*_INDEXES, needs)
        }


_OPEN: Final = "status <> 'ended' AND status <> 'cancelled'"
_CHANGES: Final = (
    "SET drives = TRIM(robot, '/') WHERE robot IS NOT NULL AND drives IS NULL",
    "SET waits = 1 WHERE due IS NOT NULL AND status = 'queued'",
    "SET ready = COALESCE(due, created) WHERE ready = 0",
    # A process that was killed after the end of its mission still holds its robot.
    f"SET owner = NULL, mark = NULL WHERE NOT ({_OPEN})",
)
"""What rows of version 1 need; each may be repeated."""

_INDEXES: Final = (
    ("free", "INDEX", "(status, priority DESC, ready, id)", f" WHERE {_FREE}"),
    ("once", "INDEX", "(status, due)", f" WHERE {_LATER}"),
    ("robots_once", "INDEX", f"(status, ({_ROBOT.format('')}), due)", f" WHERE {_LATER}"),
    ("often", "INDEX", "(status, due)", " WHERE waits = 1 AND every IS NOT NULL"),
    ("late", "INDEX", "(status, not_after)", " WHERE not_after IS NOT NULL"),
    ("held", "INDEX", "(owner)", " WHERE owner IS NOT NULL"),
    ("robots", "UNIQUE INDEX", f"(({_ROBOT.format('')}))", " WHERE owner IS NOT NULL"),
    ("groups", "UNIQUE INDEX", "(grp)", " WHERE owner IS NOT NULL AND grp IS NOT NULL"),
    ("open", "INDEX", "(created, id)", f" WHERE {_OPEN}"),
    ("targets", "INDEX", "(target)", f" WHERE {_OPEN}"),
    ("newest", "INDEX", "(created, id)", ""),
    ("changed", "INDEX", "(status, changed)", ""),
)
"""Name, kind, columns and condition; the two unique ones are what keeps a robot from two missions.
"""

TABLES: Final = frozenset(
    f"smachpy_{name}" for name in ("missions", "entries", "snapshots", "blobs", "resources")
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
        self._verified = False
        self._pid = os.getpid()

    def _check_process(self) -> None:
        """Refuse to use the connection of another process.

        Raises:
            StoreError: this process was forked from the one that has opened the store.
        """
        if is_copy(self._pid):
            problem = (
                "this process was forked from the one that has opened it, and must not use its "
                "connection. Try opening another store here."
            )
            raise StoreError(self.where, problem, reason="failed")

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

    @abstractmethod
    def _now_text(self) -> str:
        """Return that time as an expression of SQL."""

    @abstractmethod
    def _index_names(self, cursor: Cursor) -> set[str]:
        """Return the names of the indexes that the database has."""

    def _missing_indexes(self, cursor: Cursor) -> list[str]:
        """Return the statements that create the indexes of the missions which are not there."""
        known = self._index_names(cursor)
        return [sql for name, sql in self.dialect.indexes().items() if name not in known]

    def _add_indexes(self, cursor: Cursor) -> None:
        for statement in self._missing_indexes(cursor):
            self._do(cursor, statement)

    def _steady(self, seconds: float = 0.0) -> str | None:
        """Return the time in `seconds` [s] on a clock that is never set; None: there is none."""
        del seconds
        return None

    def _since(self, then: float, steady: str | None, now: float) -> float:
        """Return the time since a moment [s].

        Args:
            then: When it was [s since the Unix epoch].
            steady: The same as text of `_steady`, or None.
            now: The present time [s since the Unix epoch].
        """
        del steady
        return now - then

    # -- missions ------------------------------------------------------------------------------

    def create(self, row: MissionRow) -> MissionRow:
        first_try: list[float] = []

        def work(cursor: Cursor, again: bool) -> float:
            found = self._one(cursor, "SELECT created FROM smachpy_missions WHERE id = ?", row.id)
            if found is not None:
                if again and found[0] in first_try:  # made by it, but its answer was lost
                    return float(found[0])
                raise MissionError(
                    f"{self.where}: mission {row.id!r}: got an id that is taken; expected a new "
                    "one. Try another id, or 'smachpy missions list'."
                )
            now = self._now(cursor)
            first_try.append(now)
            self._insert(cursor, row, now)
            self._wake(cursor)
            return now

        now = self._transact(work)
        return self._stamped(row, now)

    def start(
        self, row: MissionRow, runner: str, *, seconds: float
    ) -> tuple[MissionRow, Lease] | None:
        check_lease_seconds(seconds)
        host_and_pid(runner)
        self._verify_once()
        first_try: list[float] = []

        def work(cursor: Cursor, again: bool) -> float | None:
            now = self._now(cursor)
            self._insert(cursor, row, now, " ON CONFLICT (id) DO NOTHING RETURNING id")
            if cursor.fetchone() is None:
                found = again and self._one(
                    cursor,
                    "SELECT created FROM smachpy_missions WHERE id = ? AND owner = ? AND mark = ?",
                    *(row.id, runner, self._mark),
                )
                # Made by the first try, but its answer was lost.
                return float(found[0]) if found and found[0] in first_try else None
            first_try.append(now)
            self._take_shared(cursor, row.id, row.held_robot, row.group, now)
            self._hold(cursor, row.id, runner, 1, now, seconds)
            return now

        now = self._transact(work)
        return None if now is None else (self._stamped(row, now), Lease(row.id, 1, runner))

    def missions(
        self,
        *,
        open_only: bool = False,
        statuses: Collection[str] = (),
        robot: str | None = None,
        target: str | None = None,
        limit: int | None = PAGE,
        skip: int = 0,
    ) -> list[MissionRow]:
        conditions: list[str] = []
        values: list[object] = []
        if open_only:
            conditions.append(_OPEN)
        if statuses:
            # The row of an interrupted mission may still say that its process runs it.
            wanted = {*statuses, *({RUNNING} if INTERRUPTED in statuses else ())}
            conditions.append(f"status IN ({_places(wanted)})")
            values += sorted(wanted)
        if robot is not None:
            conditions.append(f"{_ROBOT.format('')} = ?")
            values.append(robot_identity(robot))
        if target is not None:
            conditions.append("target = ?")
            values.append(target)
        where = f" WHERE {' AND '.join(conditions)}" if conditions else ""
        page = "" if limit is None else f" LIMIT {int(limit)} OFFSET {int(skip)}"

        def work(cursor: Cursor, _: bool) -> list[MissionRow]:
            self._do(
                cursor,
                f"SELECT {_COLUMNS}, {_HELD} FROM smachpy_missions{where} "
                f"ORDER BY created DESC, id DESC{page}",
                *values,
            )
            rows = cursor.fetchall()
            now = self._now(cursor)
            return [self._row(row, now) for row in rows]

        rows = self._transact(work, reads=True)
        if limit is None:
            rows = rows[skip:]
        return [row for row in reversed(rows) if not statuses or row.status in statuses]

    def find(self, id: str) -> MissionRow | None:  # noqa: A002

        def work(cursor: Cursor, _: bool) -> MissionRow | None:
            sql = f"SELECT {_COLUMNS}, {_HELD} FROM smachpy_missions WHERE id = ?"
            row = self._one(cursor, sql, id)
            return None if row is None else self._row(row, self._now(cursor))

        row = self._transact(work, reads=True)
        if row is not None and row.problem:
            raise self._damaged(id, "its row has values of wrong types")
        return row

    def mission(self, id: str) -> MissionRow:  # noqa: A002
        row = self.find(id)
        if row is None:
            raise self._transact(lambda cursor, _: self._unknown(cursor, id), reads=True)
        return row

    def holders(self) -> list[MissionRow]:

        def work(cursor: Cursor, _: bool) -> list[MissionRow]:
            select = f"SELECT {_COLUMNS}, {_HELD} FROM smachpy_missions WHERE"
            begun = "status = 'interrupted' AND waits = 0 AND owner IS NULL"
            self._do(cursor, f"{select} owner IS NOT NULL UNION ALL {select} {begun}")
            rows, now = cursor.fetchall(), self._now(cursor)
            return [
                mission
                for row in rows
                if (mission := self._row(row, now)).status == INTERRUPTED
                or not self._may_take(row[len(_FIELDS) :], now)
            ]

        return self._transact(work, reads=True)

    def size(self) -> tuple[int, int]:

        def work(cursor: Cursor, _: bool) -> tuple[int, int]:
            count = self._one(cursor, "SELECT COUNT(*) FROM smachpy_missions")[0]
            return int(count), self._bytes(cursor)

        return self._transact(work, reads=True)

    @abstractmethod
    def _bytes(self, cursor: Cursor) -> int:
        """Return the size of the store [bytes]."""

    # -- the queue -----------------------------------------------------------------------------

    def look(self, *, robots: Collection[str] = ()) -> QueueNews:
        names = [robot_identity(robot) for robot in robots]
        given = _table([(name,) for name in names])
        mine_due = (
            "SELECT MIN(f.due) FROM (SELECT (SELECT MIN(due) FROM smachpy_missions "
            f"WHERE status = 'queued' AND {_LATER} AND {_ROBOT.format('')} = g.column1) AS due "
            f"FROM {given}) AS f"
        )
        needs = self.dialect.needs()
        sql = f"SELECT 1 FROM smachpy_missions WHERE {_FREE} AND status = '{{}}'"
        if names:
            after, before = f"g.column1 || '{_BREAK}'", f"g.column1 || '{_AFTER_BREAK}'"
            sql += f" AND {needs} > {after} AND {needs} < {before}"
            sql = f"SELECT 1 FROM {given} WHERE EXISTS ({sql})"

        def read(cursor: Cursor, _: bool) -> tuple[Any, ...]:
            now = self._now(cursor)
            self._do(
                cursor,
                f"SELECT id, fence, {_HELD} FROM smachpy_missions WHERE owner IS NOT NULL",
            )
            dead = [row[:2] for row in cursor.fetchall() if self._may_take(row[2:], now)]
            waiting = "FROM smachpy_missions WHERE status = 'queued' AND waits = 1"
            due = self._one(cursor, f"SELECT MIN(due) {waiting} AND every IS NULL")[0]
            mine = due
            if names and due is not None:
                mine = self._one(cursor, mine_due, *names)[0]
            often = self._one(cursor, f"SELECT MIN(due) {waiting} AND every IS NOT NULL")[0]
            late = self._one(
                cursor,
                "SELECT MIN(not_after) FROM smachpy_missions "
                "WHERE status = 'queued' AND not_after IS NOT NULL",
            )[0]
            is_free = any(
                self._one(cursor, f"{sql.format(status)} LIMIT 1", *names)
                for status in (INTERRUPTED, QUEUED)
            )
            schedules: list[MissionRow] = []
            if often is not None and often <= now:
                self._do(
                    cursor,
                    f"SELECT {_COLUMNS}, {_HELD} {waiting} AND every IS NOT NULL AND due <= ? "
                    f"ORDER BY due LIMIT {PAGE}",
                    now,
                )
                schedules = [self._row(row, now) for row in cursor.fetchall()]
            return now, dead, due, mine, often, late, is_free, schedules

        now, dead, due, mine, often, late, is_free, schedules = self._transact(read, reads=True)
        cancelled: list[str] = []
        is_late = late is not None and late <= now
        if dead or is_late or (due is not None and due <= now):
            cancelled = self._transact(lambda cursor, _: self._tidy(cursor, dead))
            is_free = True
        return QueueNews(
            schedules=tuple(row for row in schedules if not row.problem),
            cancelled=tuple(cancelled),
            next_due=None if mine is None or mine <= now else mine - now,
            next_schedule=None if often is None else max(0.0, often - now),
            free=is_free,
            now=now,
        )

    def _tidy(self, cursor: Cursor, dead: Iterable[tuple[str, int]]) -> list[str]:
        """Free what dead processes held, let begin what is due, and cancel what is late.

        Returns:
            The ids of those that are late.
        """
        now = self._now(cursor)
        for id_, fence in dead:
            columns = f"fence, {_HELD}{self.dialect.for_update}"
            row = self._one_mission(cursor, id_, columns)
            # Looked at again: it may have been claimed, or its lease renewed, meanwhile.
            if row is not None and row[0] == fence and self._may_take(row[1:], now):
                self._free(cursor, id_)
        self._do(
            cursor,
            "UPDATE smachpy_missions SET waits = 0 "
            "WHERE status = 'queued' AND waits = 1 AND every IS NULL AND due <= ?",
            now,
        )
        late = "WHERE status = 'queued' AND owner IS NULL AND not_after <= ?"
        self._do(cursor, f"SELECT id FROM smachpy_missions {late}", now)
        cancelled = [row[0] for row in cursor.fetchall()]
        if cancelled:
            self._do(
                cursor,
                "UPDATE smachpy_missions SET status = 'cancelled', changed = ?, "
                f"note = 'it was not begun in time' {late}",
                *(now, now),
            )
        self._wake(cursor)
        return cancelled

    def _free(self, cursor: Cursor, id_: str) -> None:
        """Take a mission, its robot and its group from its process."""
        # A higher fence: if that process was only suspended, its next write is refused.
        self._do(
            cursor,
            "UPDATE smachpy_missions SET owner = NULL, mark = NULL, lease_end = NULL, "
            "fence = fence + 1, "
            "status = CASE WHEN status = 'running' THEN 'interrupted' ELSE status END "
            "WHERE id = ?",
            id_,
        )

    def reserve(
        self,
        runner: str,
        *,
        seconds: float,
        robots: Collection[str] = (),
        leave: Collection[str] = (),
        leave_targets: Collection[str] = (),
        leave_shapes: Collection[tuple[str, bytes]] = (),
    ) -> tuple[MissionRow, Lease] | None:
        check_lease_seconds(seconds)
        host_and_pid(runner)
        names = [robot_identity(robot) for robot in robots]
        targets = list(leave_targets)[-MAX_LEFT_ROWS:]
        # The conditions that differ between missions with the same needs, and the others.
        single, singles = _passed_over(list(leave)[-MAX_LEFT_ROWS:], leave_shapes)
        others = "".join(
            f"AND {column} {word} ({_places(given)}) "
            for column, word, given in (
                (_ROBOT.format("m."), "IN", names),
                ("m.target", "NOT IN", targets),
            )
            if given
        )
        one_kind = f"SELECT m.id FROM smachpy_missions AS m WHERE {self.dialect.needs('m.')} = ?"

        # If the answer is lost, nobody uses the reservation; `look` frees it when it has expired.
        def work(cursor: Cursor, _: bool) -> tuple[MissionRow, Lease] | None:
            now = self._now_text()

            def take(status: str, among: str, single: str, *needs: str) -> Any:
                return self._one(
                    cursor,
                    "UPDATE smachpy_missions SET owner = ?, mark = ?, fence = fence + 1, "
                    f"lease_end = {now} + ?, lease_clock = ? "
                    f"WHERE id = ({among} {single}{others}"
                    f"AND {_not_in_use(_ROBOT, status)} AND {_not_in_use('{}grp', status)} "
                    f"ORDER BY m.priority DESC, m.ready, m.id LIMIT 1{self.dialect.skip_locked}) "
                    f"RETURNING {_COLUMNS}, {_HELD}, fence",
                    *(runner, self._mark, seconds, self._steady(seconds), *needs),
                    *(*singles, *names, *targets),
                )

            for status in (INTERRUPTED, QUEUED):
                late = f"AND (m.not_after IS NULL OR m.not_after > {now}) "
                here = single + (late if status == QUEUED else "")
                # Those of some robots may all be far behind.
                row = None if names else take(status, _FRONT.format(status, status), here)
                kinds = [] if row else self._kinds(cursor, status, names, targets)
                free = f"m.status = '{status}' AND m.waits = 0 AND m.owner IS NULL"
                for needs in self._by_first(cursor, kinds, f"{free} {here}", singles):
                    row = row or take(status, f"{one_kind} AND {free}", here, needs)
                if row is not None:
                    return self._row(row[:-1], 0.0), Lease(row[0], row[-1], runner)
            return None

        return self._transact(work)

    def _kinds(
        self, cursor: Cursor, status: str, robots: Sequence[str], leave_targets: Collection[str]
    ) -> list[str]:
        """Return the different needs of the missions with a status, if these are free.

        Args:
            cursor: The cursor.
            status: The missions' status.
            robots: Only missions of these robots; empty: all.
            leave_targets: Targets of missions that are passed over.
        """
        needs, end = self.dialect.needs(), self.dialect.bytewise
        following = (
            f"SELECT {needs} FROM smachpy_missions WHERE status = '{status}' AND {_FREE} "
            f"AND {needs} > kinds.needs AND {needs} < kinds.before ORDER BY {needs} LIMIT 1"
        )
        ranges = [(name + _BREAK, name + _AFTER_BREAK) for name in robots] or [("", _LAST)]
        # One step in the index for each kind, however many missions are of it.
        self._do(
            cursor,
            "WITH RECURSIVE kinds(needs, before) AS ("
            f"SELECT g.column1{end}, g.column2{end} FROM {_table(ranges)} "
            f"UNION ALL SELECT ({following}), kinds.before FROM kinds "
            "WHERE kinds.needs IS NOT NULL) SELECT needs FROM kinds WHERE needs IS NOT NULL",
            *(value for pair in ranges for value in pair),
        )
        found = [row[0] for row in cursor.fetchall()]
        kinds = {one: words for one in found if len(words := one.split(_BREAK, 2)) == 3}  # noqa: PLR2004
        if not kinds:
            return []
        self._do(cursor, _in_use(f"{_ROBOT.format('')}, grp", status))
        used = cursor.fetchall()
        used_robots, used_groups = {row[0] for row in used}, {row[1] for row in used}
        return [
            one
            for one, (robot, group, target) in kinds.items()
            if robot not in used_robots and group not in used_groups and target not in leave_targets
        ]

    def _by_first(
        self, cursor: Cursor, kinds: Sequence[str], free: str, values: Sequence[object]
    ) -> list[str]:
        """Return kinds in the order in which their first missions begin.

        Args:
            cursor: The cursor.
            kinds: What missions need; kinds without a mission that may be taken are left out.
            free: The condition of missions that may be taken.
            values: Its values.
        """
        kinds = kinds[:MAX_KINDS]
        if not kinds:
            return []
        order = "priority DESC, {0}ready, {0}id"
        first = (
            f"SELECT m.id FROM smachpy_missions AS m WHERE {self.dialect.needs('m.')} = g.column1 "
            f"AND {free} ORDER BY m.{order.format('m.')} LIMIT 1"
        )
        self._do(
            cursor,
            f"SELECT g.column1 FROM {_table([(one,) for one in kinds])} "
            "CROSS JOIN smachpy_missions AS b "
            f"WHERE b.id = ({first}) ORDER BY b.{order.format('b.')}",
            *(*kinds, *values),
        )
        return [str(row[0]) for row in cursor.fetchall()]

    # -- the missions of this process ----------------------------------------------------------

    def claim(
        self,
        id: str,  # noqa: A002
        runner: str,
        *,
        seconds: float,
        reserved: Lease | None = None,
    ) -> Lease:
        check_lease_seconds(seconds)
        host_and_pid(runner)

        def work(cursor: Cursor, again: bool) -> Lease:
            row = self._known(
                cursor,
                id,
                f"status, {_ROBOT.format('')}, grp, every, fence, changed, beat_clock, beat_ns, "
                f"{_HELD}{self.dialect.for_update}",
            )
            status, robot, group, every, fence, changed, beat_clock, beat_ns, *held = row
            owner, mark = held[:2]
            now = self._now(cursor)
            if status in OVER:
                raise MissionOverError(self.where, id, status)
            if every is not None:
                raise MissionError(
                    f"{self.where}: mission {id!r}: got a schedule, {every!r}; expected one of the "
                    "missions that it begins. Try: smachpy missions list"
                )
            mine = (owner, mark) == (runner, self._mark)
            if again and mine and status == RUNNING:  # by the first try, whose answer was lost
                pass
            elif reserved is not None:
                if (owner, fence) != (reserved.runner, reserved.fence) or status == RUNNING:
                    raise FencedError(self.where, reserved, owner)
            elif not (mine and status != RUNNING):  # this process may have reserved it itself
                self._refuse_held(id, held, now)
            self._take_shared(cursor, id, robot, group, now)
            self._hold(cursor, id, runner, fence + 1, now, seconds)
            silent = max(0.0, self._since(changed, beat_clock, now))
            return Lease(id, fence + 1, runner, beat_ns, silent)

        return self._transact(work)

    def _hold(
        self, cursor: Cursor, id_: str, runner: str, fence: int, now: float, seconds: float
    ) -> None:
        """Let a mission be run by a process, for `seconds` [s] from `now`."""
        self._do(
            cursor,
            "UPDATE smachpy_missions SET status = 'running', owner = ?, mark = ?, "
            "lease_end = ?, lease_clock = ?, fence = ?, note = '', "
            "version = CASE WHEN version < ? THEN ? ELSE version END WHERE id = ?",
            *(runner, self._mark, now + seconds, self._steady(seconds), fence),
            *(FORMAT, FORMAT, id_),
        )

    def renew(self, lease: Lease, *, seconds: float, beat_ns: int | None = None) -> bool:
        check_lease_seconds(seconds)

        def work(cursor: Cursor, _: bool) -> bool:
            cancel = self._fenced(cursor, lease)[0]
            now = self._now(cursor)
            self._do(
                cursor,
                "UPDATE smachpy_missions SET lease_end = ?, lease_clock = ? WHERE id = ?",
                *(now + seconds, self._steady(seconds), lease.mission),
            )
            if beat_ns is not None:
                self._note_beat(cursor, lease.mission, beat_ns)
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
        blobs: Mapping[str, bytes] = MappingProxyType({}),
        kept: Collection[str] = (),
        beat_ns: int | None = None,
    ) -> None:
        mission = lease.mission
        first_try: list[int] = []  # the number of the last entry that it found

        def work(cursor: Cursor, again: bool) -> int:
            _, last = self._fenced(cursor, lease)
            if again and (first_try or lease in self._written):
                before = first_try[0] if first_try else self._written[lease]
                if entries and last == before + len(entries):
                    return last  # the first try was committed; only its answer was lost
                if last < before:
                    raise self._damaged(mission, f"the server has {last} entries of {before}")
            first_try.append(last)
            if blobs:
                self._do_many(
                    cursor,
                    "INSERT INTO smachpy_blobs (mission, digest, data) VALUES (?, ?, ?) "
                    "ON CONFLICT (mission, digest) DO NOTHING",
                    ((mission, digest, data) for digest, data in blobs.items()),
                )
            # Numbers without gaps, and a checksum each: `read` notices lost and damaged entries.
            if snapshot is not None:  # it has the new entries, too
                self._compact(cursor, mission, last + len(entries), snapshot, kept)
            elif entries:
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
            if beat_ns is not None:
                self._note_beat(cursor, mission, beat_ns)
            if status is not None or outcome is not None:
                self._do(
                    cursor,
                    "UPDATE smachpy_missions SET status = COALESCE(?, status), "
                    f"outcome = COALESCE(?, outcome), changed = {self._now_text()} WHERE id = ?",
                    *(status, outcome, mission),
                )
            return last + len(entries)

        self._written[lease] = self._transact(work)

    def _note_beat(self, cursor: Cursor, mission: str, beat_ns: int) -> None:
        self._do(
            cursor,
            f"UPDATE smachpy_missions SET changed = {self._now_text()}, beat_clock = ?, "
            "beat_ns = ? WHERE id = ?",
            *(self._steady(), beat_ns, mission),
        )

    def read(self, id: str) -> tuple[bytes | None, list[bytes]]:  # noqa: A002

        def work(cursor: Cursor, _: bool) -> tuple[Any, list[Any]]:
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

        self._verify_once()
        snapshot, rows = self._transact(work, reads=True)
        kinds = (int, int, bytes)
        expected = 0
        if snapshot is not None:
            if not _are(snapshot, kinds) or zlib.crc32(snapshot[2]) != snapshot[1]:
                raise self._damaged(id, "its snapshot is damaged")
            expected = snapshot[0]
        for row in rows:
            expected += 1
            whole = _are(row, kinds)
            if not whole or row[0] != expected or zlib.crc32(row[2]) != row[1]:
                what = "is missing" if whole and row[0] != expected else "is damaged"
                raise self._damaged(id, f"entry {expected} {what}")
        return None if snapshot is None else snapshot[2], [row[2] for row in rows]

    def blob(self, id: str, digest: str) -> bytes:  # noqa: A002
        sql = "SELECT data FROM smachpy_blobs WHERE mission = ? AND digest = ?"
        row = self._transact(lambda cursor, _: self._one(cursor, sql, id, digest), reads=True)
        if row is None or not _are(row, (bytes,)) or digest_of(row[0]) != digest:
            what = "is missing" if row is None else "is damaged"
            raise self._damaged(id, f"the value {digest:.12} {what}")
        return bytes(row[0])

    def release(self, lease: Lease, status: str | None, *, note: str = "") -> None:

        def work(cursor: Cursor, again: bool) -> None:
            # One statement: no claim can come between check and write.
            released = self._one(
                cursor,
                "UPDATE smachpy_missions SET owner = NULL, mark = NULL, lease_end = NULL, "
                f"status = CASE WHEN {_OPEN} THEN COALESCE(?, status) ELSE status END, "
                f"note = CASE WHEN {_OPEN} THEN ? ELSE '' END "
                "WHERE id = ? AND fence = ? AND owner = ? RETURNING id",
                *(status, note, lease.mission, lease.fence, lease.runner),
            )
            if released is None:
                try:
                    self._fenced(cursor, lease)
                except FencedError as error:
                    if again and error.runner is None:  # released by the first try
                        return
                    raise
            self._wake(cursor)

        self._transact(work)
        self._written.pop(lease, None)

    # -- resources -----------------------------------------------------------------------------

    def hold(self, lease: Lease, resource: str, state: str, policy: Policy) -> ResourceUse | None:
        mission, urgent = lease.mission, policy == "preempt"

        def work(cursor: Cursor, _: bool) -> ResourceUse | None:
            self._fenced(cursor, lease)
            is_open = f"SELECT 1 FROM smachpy_missions WHERE id = mission AND {_OPEN}"
            delete = f"DELETE FROM smachpy_resources WHERE resource = ? AND NOT EXISTS ({is_open})"
            self._do(cursor, delete, resource)
            users = self._users(cursor, resource)
            known = [one.mission for one in users]
            if mission in known:
                ahead = users[: known.index(mission)]
            else:
                ahead = [one for one in users if one.holds or one.urgent or not urgent]
            if ahead and (policy == "refuse" or mission in known):
                return ahead[0]
            place = "(SELECT COALESCE(MAX(place), 0) + 1 FROM smachpy_resources WHERE resource = ?)"
            self._do(
                cursor,
                "INSERT INTO smachpy_resources (resource, mission, state, place, holds, urgent) "
                f"VALUES (?, ?, ?, {place}, ?, ?) ON CONFLICT (resource, mission) DO UPDATE "
                "SET state = excluded.state, holds = excluded.holds, urgent = excluded.urgent",
                *(resource, mission, state, resource, int(not ahead), int(urgent)),
            )
            return ahead[0] if ahead else None

        return self._transact(work)

    def _users(self, cursor: Cursor, resource: str | None = None) -> list[ResourceUse]:
        """Return who holds resources and who waits; of those without a process only holders."""
        self._do(
            cursor,
            f"SELECT r.resource, r.mission, r.state, r.holds, r.urgent, {_HELD} "
            "FROM smachpy_resources AS r JOIN smachpy_missions AS m ON m.id = r.mission "
            f"WHERE {_OPEN}{'' if resource is None else ' AND r.resource = ?'} "
            "ORDER BY r.resource, r.holds DESC, r.urgent DESC, r.place, r.mission",
            *(() if resource is None else (resource,)),
        )
        rows, now = cursor.fetchall(), self._now(cursor)
        users = []
        for name, mission, state, holds, urgent, *held in rows:
            runner = None if self._may_take(held, now) else held[0]
            if holds or runner is not None:
                use = ResourceUse(name, mission, state, bool(holds), bool(urgent), runner)
                users.append(use)
        return users

    def let_go(self, lease: Lease, resource: str) -> None:

        def work(cursor: Cursor, _: bool) -> None:
            self._fenced(cursor, lease)
            self._do(
                cursor,
                "DELETE FROM smachpy_resources WHERE resource = ? AND mission = ?",
                *(resource, lease.mission),
            )

        self._transact(work)

    def resources(self) -> list[ResourceUse]:
        return self._transact(lambda cursor, _: self._users(cursor), reads=True)

    # -- at the end ----------------------------------------------------------------------------

    def forget(self, id: str) -> None:  # noqa: A002

        def work(cursor: Cursor, again: bool) -> None:
            try:
                held = self._known(cursor, id, _HELD + self.dialect.for_update)
            except UnknownMissionError:
                if again:  # deleted by the first try
                    return
                raise
            self._refuse_held(id, held, self._now(cursor))
            self._delete(cursor, [id])
            self._wake(cursor)

        self._transact(work)

    def prune(self, seconds: float, *, keep: Callable[[MissionRow], bool]) -> int:
        self.look()  # a process that was killed after the end of its mission still holds it
        deleted = 0
        after: tuple[float, str] | None = (-math.inf, "")
        while after is not None:
            start = after

            def work(cursor: Cursor, _: bool, start: tuple[float, str] = start) -> Any:
                now = self._now(cursor)
                self._do(
                    cursor,
                    f"SELECT {_COLUMNS}, {_HELD} FROM smachpy_missions "
                    "WHERE (status = 'ended' OR status = 'cancelled') AND owner IS NULL "
                    "AND changed <= ? AND (changed > ? OR (changed = ? AND id > ?)) "
                    f"ORDER BY changed, id LIMIT {PRUNED_AT_ONCE}",
                    *(now - seconds, start[0], start[0], start[1]),
                )
                rows = [self._row(row, now) for row in cursor.fetchall()]
                gone = [row for row in rows if not (row.problem or keep(row))]
                some = gone[: self._fitting(cursor, [row.id for row in gone])]
                self._delete(cursor, [row.id for row in some])
                last = rows[-1] if len(rows) == PRUNED_AT_ONCE else None
                last = last if len(some) == len(gone) else some[-1]
                return len(some), None if last is None else (last.changed, last.id)

            begun = current_clock().now()
            count, after = self._transact(work)
            deleted += count
            self._give_way(begun)
        if deleted:
            self._shrink()
        return deleted

    def _fitting(self, _: Cursor, ids: Sequence[str]) -> int:
        """Return how many of these missions, from the first, one transaction is to delete."""
        return len(ids)

    def _give_way(self, begun: float) -> None:  # noqa: ARG002
        """Let others write after a long transaction, which began at that time of the clock."""
        return

    def _shrink(self) -> None:
        """Give freed space back to the system, if the database does not do it itself."""
        return

    def _delete(self, cursor: Cursor, ids: Sequence[str]) -> None:
        for table, key in (
            ("entries", "mission"),
            ("snapshots", "mission"),
            ("blobs", "mission"),
            ("resources", "mission"),
            ("missions", "id"),
        ):
            self._do_many(
                cursor, f"DELETE FROM smachpy_{table} WHERE {key} = ?", ((one,) for one in ids)
            )

    def begin_next(self, row: MissionRow, *, due: float | None, next_due: float) -> bool:

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
            now = self._now(cursor)
            # The clock may have been put back, or the schedule forgotten and made again: then this
            # due time has had its mission, and only the next one counts.
            self._insert(cursor, row, now, " ON CONFLICT (id) DO NOTHING RETURNING id")
            begun = cursor.fetchone() is not None
            self._wake(cursor)
            self._do(
                cursor,
                "UPDATE smachpy_missions SET due = ?, changed = ? WHERE id = ?",
                *(next_due, now, row.schedule),
            )
            return begun

        return self._transact(work)

    def request_cancel(self, id: str) -> None:  # noqa: A002

        def work(cursor: Cursor, again: bool) -> None:
            (status,) = self._known(cursor, id, "status" + self.dialect.for_update)
            if status in OVER and not again:
                raise MissionOverError(self.where, id, status)
            self._do(cursor, "UPDATE smachpy_missions SET cancel = 1 WHERE id = ?", id)
            if status == QUEUED:  # perhaps reserved: the process that was started finds it over
                self._do(
                    cursor,
                    "UPDATE smachpy_missions SET status = 'cancelled', owner = NULL, mark = NULL, "
                    "changed = ? WHERE id = ?",
                    *(self._now(cursor), id),
                )
                self._wake(cursor)

        self._transact(work)

    def listen(self, on_news: Callable[[], object]) -> Callable[[], object] | None:
        del on_news
        return None

    def _verify_once(self) -> None:
        if not self._verified:
            self._transact(lambda cursor, _: self._verify(cursor), reads=True)
            self._verified = True

    @abstractmethod
    def _verify(self, cursor: Cursor) -> None:
        """Check that the database file is not damaged, if the database does not check it itself."""

    @abstractmethod
    def close(self) -> None: ...

    # -- statements ----------------------------------------------------------------------------

    def _do(self, cursor: Cursor, sql: str, *values: object) -> None:
        try:
            cursor.execute(sql.replace("?", self.dialect.placeholder), values)
        except UnicodeEncodeError as error:  # bytes of a command line that are no UTF-8
            problem = f"got {error.object!r}; expected text that can be written in UTF-8."
            raise StoreError(self.where, problem, reason="failed") from error

    def _do_many(self, cursor: Cursor, sql: str, rows: Iterable[Sequence[Any]]) -> None:
        rows = list(rows)
        if len(rows) == 1:  # psycopg's `executemany` costs more
            self._do(cursor, sql, *rows[0])
        else:
            cursor.executemany(sql.replace("?", self.dialect.placeholder), rows)

    def _one(self, cursor: Cursor, sql: str, *values: object) -> Any:
        self._do(cursor, sql, *values)
        return cursor.fetchone()

    def _wake(self, cursor: Cursor) -> None:
        """Wake the runners that listen, when the transaction is committed."""
        if self.dialect.notify:
            self._do(cursor, self.dialect.notify)

    def _stamped(self, row: MissionRow, now: float) -> MissionRow:
        """Return a row as it is stored at time `now`."""
        return replace(
            row,
            owner=None,
            robot=row.robot and robot_identity(row.robot),
            drives=row.drives and robot_identity(row.drives),
            created=now,
            changed=now,
        )

    def _insert(self, cursor: Cursor, row: MissionRow, now: float, end: str = "") -> None:
        row = self._stamped(row, now)
        values = {name: getattr(row, name) for name in _FIELDS}
        values.update(argv=json.dumps(list(row.argv)), cancel=int(row.cancel))
        values["drives"] = row.held_robot
        waits = row.every is not None or (row.due is not None and row.due > now)
        ready = now if row.due is None else row.due
        self._do(
            cursor,
            f"INSERT INTO smachpy_missions ({_COLUMNS}, waits, ready, fence) "
            f"VALUES ({_places(values)}, ?, ?, 0){end}",
            *(*values.values(), int(waits), ready),
        )

    def _one_mission(self, cursor: Cursor, id_: str, columns: str) -> Any:
        names, lock, how = columns.partition(" FOR ")
        return self._one(
            cursor, f"SELECT {names} FROM smachpy_missions WHERE id = ?{lock}{how}", id_
        )

    def _known(self, cursor: Cursor, id_: str, columns: str) -> Any:
        """Return columns of a mission.

        Args:
            cursor: The cursor.
            id_: The mission.
            columns: Their names; an end that locks the row, as in `Dialect`, may follow.

        Raises:
            UnknownMissionError: there is no such mission.
        """
        row = self._one_mission(cursor, id_, columns)
        if row is None:
            raise self._unknown(cursor, id_)
        return row

    def _unknown(self, cursor: Cursor, id_: str) -> UnknownMissionError:
        self._do(cursor, f"SELECT id FROM smachpy_missions ORDER BY created DESC LIMIT {PAGE}")
        return UnknownMissionError(self.where, id_, [str(row[0]) for row in cursor.fetchall()])

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

    def _compact(
        self, cursor: Cursor, mission: str, last: int, snapshot: bytes, kept: Collection[str]
    ) -> None:
        self._do(
            cursor,
            "INSERT INTO smachpy_snapshots (mission, n, crc, data) VALUES (?, ?, ?, ?) "
            "ON CONFLICT (mission) DO UPDATE SET n = excluded.n, crc = excluded.crc, "
            "data = excluded.data",
            *(mission, last, zlib.crc32(snapshot), snapshot),
        )
        self._do(cursor, "DELETE FROM smachpy_entries WHERE mission = ? AND n <= ?", mission, last)
        named = kept or ("",)  # PostgreSQL refuses an empty list
        self._do(
            cursor,
            f"DELETE FROM smachpy_blobs WHERE mission = ? AND digest NOT IN ({_places(named)})",
            *(mission, *named),
        )

    def _may_take(self, held: Sequence[Any], now: float) -> bool:
        """Return whether a mission may be taken, by its columns `_HELD`."""
        owner, mark, lease_end, lease_clock = held
        try:
            host, pid = host_and_pid(owner if isinstance(owner, str) else "")
        except ValueError:
            return True  # nobody, or nobody can be it
        left = -self._since(lease_end, lease_clock, now) if _is_time(lease_end) else 0.0
        mark = mark if isinstance(mark, str) else ""
        return may_take(
            process_lives(pid, mark),
            left,
            by_lease=self.by_lease,
            restarted=host == self._host and is_of_other_boot(mark),
        )

    def _refuse_held(self, mission: str, held: Sequence[Any], now: float) -> None:
        if not self._may_take(held, now):
            raise MissionInUseError(self.where, mission, held[0])

    def _take_shared(
        self, cursor: Cursor, mission: str, robot: str | None, group: str | None, now: float
    ) -> None:
        """Take the robot and group of this mission from missions whose runner is gone.

        Raises:
            MissionInUseError: a mission with a living runner uses it.
        """
        for column, name, shared in (
            (_ROBOT.format(""), "robot", robot),
            ("grp", "group", group),
        ):
            if shared is None:
                continue
            self._do(
                cursor,
                f"SELECT id, {_HELD} FROM smachpy_missions "
                f"WHERE {column} = ? AND id <> ? AND owner IS NOT NULL",
                *(shared, mission),
            )
            for other, *held in cursor.fetchall():
                if not self._may_take(held, now):
                    raise MissionInUseError(self.where, other, held[0], **{name: shared})
                self._free(cursor, other)

    def _row(self, row: Sequence[Any], now: float) -> MissionRow:
        """Return a row of `_COLUMNS` and `_HELD`; one of other types has only `problem`."""
        held = row[len(_FIELDS) :]
        fields = dict(zip(_FIELDS, row, strict=False))
        if not _is_sound(fields):
            id_ = fields["id"] if isinstance(fields["id"], str) else repr(fields["id"])
            return replace(_DAMAGED, id=id_[:200])
        if fields["status"] == RUNNING and self._may_take(held, now):
            fields["status"] = INTERRUPTED
        fields["argv"] = tuple(json.loads(fields["argv"]))
        fields["cancel"] = bool(fields["cancel"])
        if fields["drives"] == fields["robot"]:
            fields["drives"] = None
        return MissionRow(**fields)

    def _damaged(self, mission: str, what: str) -> StoreError:
        return StoreError(
            self.where,
            f"mission {mission!r}: got a damaged journal ({what}); expected an undamaged one. "
            "Nothing was changed. Try a copy, or: smachpy missions forget " + mission,
            reason="corrupt",
        )


def robot_identity(name: str) -> str:
    """Return the one name of a robot, however it is spelled: "r1" for "/r1" and "r1/".

    Raises:
        InvalidNameError: it is no name.
    """
    return clean_namespace(name) or "/"


def _places(values: Collection[object]) -> str:
    return ", ".join("?" * len(values))


def _passed_over(
    ids: Sequence[str], shapes: Iterable[tuple[str, bytes]]
) -> tuple[str, list[str | bytes]]:
    """Return the condition that a mission `m` is none of those, and its values."""
    condition = f"AND m.id NOT IN ({_places(ids)}) " if ids else ""
    values: list[str | bytes] = [*ids]
    for shape in list(shapes)[-MAX_LEFT_SHAPES:]:
        condition += "AND NOT (m.target = ? AND m.structure = ?) "
        values += shape
    return condition, values


def _table(rows: Sequence[Collection[object]]) -> str:
    """Return a table `g` of values that are bound, with the columns `column1`, `column2`."""
    return f"(VALUES {', '.join(f'({_places(row)})' for row in rows)}) AS g"


def _in_use(columns: str, status: str) -> str:
    """Return a query for the robots or groups that missions with a status cannot have now."""
    query = f"SELECT {columns} FROM smachpy_missions WHERE"
    used = f"{query} owner IS NOT NULL"
    # The goals of a mission that was interrupted may still drive its robot: until it goes on or is
    # cancelled, no other one begins there.
    begun = f" UNION ALL {query} status = 'interrupted' AND {_FREE}"
    return used if status == INTERRUPTED else used + begun


def _not_in_use(column: str, status: str) -> str:
    """Return the condition that a mission `m` with a status can have its robot, or group."""
    mine, one = column.format("m."), column.format("")
    # Evaluated once, unlike `NOT EXISTS`.
    used = f"SELECT one FROM ({_in_use(f'{one} AS one', status)}) AS u WHERE one IS NOT NULL"
    return f"({mine} IS NULL OR {mine} NOT IN ({used}))"


_LATEST: Final = 1e11
"""[s since the Unix epoch]; later times, in the year 5138, cannot be shown."""

_TEXTS: Final = ("id", "name", "target", "argv", "status", "note")
_OPTIONAL_TEXTS: Final = ("outcome", "robot", "owner", "every", "schedule", "group", "drives")


def _is_time(value: object) -> bool:
    return isinstance(value, (int, float)) and 0 <= value < _LATEST


def _is_sound(fields: Mapping[str, Any]) -> bool:
    """Return whether the columns of a row have the types with which they are written."""
    try:
        argv = json.loads(fields["argv"])
    except (TypeError, ValueError, RecursionError):
        return False
    return (
        all(isinstance(fields[name], str) for name in _TEXTS)
        and all(isinstance(fields[name], (str, NoneType)) for name in _OPTIONAL_TEXTS)
        and isinstance(argv, list)
        and all(isinstance(word, str) for word in argv)
        and fields["status"] in {QUEUED, RUNNING, INTERRUPTED, *OVER}
        and isinstance(fields["structure"], bytes)
        and all(isinstance(fields[name], int) for name in ("version", "cancel", "priority"))
        and all(_is_time(fields[name]) for name in ("created", "changed"))
        and all(fields[name] is None or _is_time(fields[name]) for name in ("due", "not_after"))
    )


def _are(row: Sequence[object], kinds: Sequence[type]) -> bool:
    return all(isinstance(value, kind) for value, kind in zip(row, kinds, strict=True))


_DAMAGED: Final = MissionRow(
    id="",
    name="",
    target="",
    argv=(),
    status=INTERRUPTED,
    outcome=None,
    robot=None,
    created=0.0,
    changed=0.0,
    owner=None,
    structure=b"{}",
    version=0,
    problem="corrupt",
)
