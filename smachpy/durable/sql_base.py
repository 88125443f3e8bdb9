# ruff: noqa: S608  statements are built from our own column names; values are always bound
"""The ground of stores in SQL databases: transactions, statements and rows.

Databases differ in how they are opened, in how transactions begin, and in their errors; a subclass
has `_transact`, `_now`, `_now_text` and `_index_names` for these, and a `Dialect`.
"""

from __future__ import annotations

import json
import os
from abc import ABC, abstractmethod
from dataclasses import replace
from types import NoneType
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from actionlib_core.clock.forks import is_copy
from smachpy.durable.processes import is_of_other_boot, process_lives, process_mark, this_runner
from smachpy.durable.store import (
    INTERRUPTED,
    OVER,
    QUEUED,
    RUNNING,
    MissionRow,
    StoreError,
    host_and_pid,
    may_take,
)
from smachpy.durable.tables import FIELDS, Dialect

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

T = TypeVar("T")


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


class SqlBase(ABC):
    """Transactions, statements and rows of a SQL database."""

    where: str
    by_lease: bool
    dialect: Dialect

    def __init__(self) -> None:
        self._mark = process_mark()
        self._host = host_and_pid(this_runner())[0]
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

    def _one_mission(self, cursor: Cursor, id_: str, columns: str) -> Any:
        names, lock, how = columns.partition(" FOR ")
        return self._one(
            cursor, f"SELECT {names} FROM smachpy_missions WHERE id = ?{lock}{how}", id_
        )

    def _may_take(self, held: Sequence[Any], now: float) -> bool:
        """Return whether a mission may be taken, by its columns `HELD`."""
        owner, mark, lease_end, lease_clock = held
        try:
            host, pid = host_and_pid(owner if isinstance(owner, str) else "")
        except ValueError:
            return True  # nobody, or nobody can be it
        left = -self._since(lease_end, lease_clock, now) if is_time(lease_end) else 0.0
        mark = mark if isinstance(mark, str) else ""
        return may_take(
            process_lives(pid, mark),
            left,
            by_lease=self.by_lease,
            restarted=host == self._host and is_of_other_boot(mark),
        )

    def _row(self, row: Sequence[Any], now: float) -> MissionRow:
        """Return a row of `COLUMNS` and `HELD`; one of other types has only `problem`."""
        held = row[len(FIELDS) :]
        fields = dict(zip(FIELDS, row, strict=False))
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


def places(values: Collection[object]) -> str:
    """Return a placeholder for each of the values that are bound."""
    return ", ".join("?" * len(values))


_LATEST: Final = 1e11
"""[s since the Unix epoch]; later times, in the year 5138, cannot be shown."""

_TEXTS: Final = ("id", "name", "target", "argv", "status", "note")
_OPTIONAL_TEXTS: Final = ("outcome", "robot", "owner", "every", "schedule", "group", "drives")


def is_time(value: object) -> bool:
    """Return whether it is a time [s since the Unix epoch] that can be shown."""
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
        and all(is_time(fields[name]) for name in ("created", "changed"))
        and all(fields[name] is None or is_time(fields[name]) for name in ("due", "not_after"))
    )


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
