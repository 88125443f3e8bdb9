"""Journals in a file of SQLite: the default, for the missions of one computer.

The file is in WAL mode, so that readers see the journal while a mission writes it, and a
transaction is one append to the log beside it, `FILE-wal`. SQLite keeps a checksum for each page of
that log: a transaction that was written in part is as if it had not been begun
(https://sqlite.org/fileformat2.html#walformat).
"""

from __future__ import annotations

import sqlite3
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypeVar

from actionlib_core.clock import current_clock
from smachpy.durable.sql import VERSION, Cursor, Dialect, SqlStore
from smachpy.durable.store import Reason, StoreError

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")

_APPLICATION: Final = 0x736D6A6C
"""Marks the file as a journal of smachpy ("smjl", `PRAGMA application_id`)."""

_REASONS: Final[dict[int, tuple[Reason, str]]] = {
    sqlite3.SQLITE_BUSY: (
        "busy",
        "another process keeps it locked; expected a free one. Try again",
    ),
    sqlite3.SQLITE_LOCKED: ("busy", "it is locked; expected a free one. Try again"),
    sqlite3.SQLITE_FULL: ("full", "no space is left; expected some. Try making room"),
    sqlite3.SQLITE_CORRUPT: ("corrupt", "it is damaged; expected it as it was written. Try a copy"),
    sqlite3.SQLITE_NOTADB: (
        "foreign",
        "it is no SQLite file; expected a journal. Try another path",
    ),
    sqlite3.SQLITE_CANTOPEN: (
        "unreachable",
        "it cannot be opened; expected a file. Try another path",
    ),
    sqlite3.SQLITE_READONLY: ("unreachable", "it cannot be written. Try its permissions"),
    sqlite3.SQLITE_PERM: ("unreachable", "it cannot be opened. Try its permissions"),
    sqlite3.SQLITE_IOERR: ("failed", "the disk does not work. Try another one"),
}


class SQLiteStore(SqlStore):
    """A store in one file; see `open_store` for the arguments.

    Raises:
        StoreError: it cannot be opened; nothing in the file was changed.
    """

    by_lease = False
    dialect = Dialect(placeholder="?", blob="BLOB", real="REAL", clustered=" WITHOUT ROWID")

    def __init__(
        self,
        path: str | Path,
        *,
        synchronous: Literal["FULL", "NORMAL"] = "FULL",
        create: bool = True,
        patience: float = 5.0,
    ) -> None:
        super().__init__()
        if synchronous not in {"FULL", "NORMAL"}:
            raise ValueError(f"synchronous: got {synchronous!r}; expected 'FULL' or 'NORMAL'.")
        file = Path(path)
        self.where = str(path)
        self._lock = threading.Lock()
        if create:
            self._make_folder(file.parent)
        elif not file.exists():
            raise StoreError(self.where, "got no such file; expected a journal.", reason="missing")
        mode = "rwc" if create else "rw"
        try:
            self._connection = sqlite3.connect(
                f"{file.absolute().as_uri()}?mode={mode}",
                uri=True,
                timeout=patience,
                isolation_level=None,  # transactions are begun and ended here, by name
                check_same_thread=False,
            )
        except sqlite3.Error as error:
            raise self._error(error) from error
        try:
            self._transact(self._check, reads=True)  # before anything is written
            self._pragmas(synchronous)
            self._transact(self._make_tables)
        except sqlite3.Error as error:
            self._connection.close()
            raise self._error(error) from error
        except BaseException:
            self._connection.close()
            raise

    def close(self) -> None:
        """As `Store.close`."""
        with self._lock:
            self._connection.close()

    def _make_folder(self, folder: Path) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason: Reason = "unreachable"
            problem = f"got {error.strerror} for its folder; expected one that can be made."
            raise StoreError(self.where, problem, reason=reason) from error

    def _check(self, cursor: Cursor, _: bool) -> None:
        """Refuse a file that is no journal, or one of a newer version."""
        version = self._one(cursor, "PRAGMA user_version")[0]
        if self._one(cursor, "PRAGMA application_id")[0] != _APPLICATION:
            if self._one(cursor, "SELECT COUNT(*) FROM sqlite_master")[0] or version:
                raise StoreError(
                    self.where,
                    "got an SQLite file of another program; expected a journal. Try another path.",
                    reason="foreign",
                )
        elif version > VERSION:
            raise StoreError(
                self.where,
                f"got a journal of version {version}; expected {VERSION} at most. "
                "Try a newer smachpy.",
                reason="future",
            )

    def _pragmas(self, synchronous: str) -> None:
        execute = self._connection.execute
        if execute("PRAGMA journal_mode").fetchone()[0] != "wal":
            execute("PRAGMA journal_mode = WAL")
        execute(f"PRAGMA synchronous = {synchronous}")

    def _make_tables(self, cursor: Cursor, _: bool) -> None:
        if self._one(cursor, "PRAGMA application_id")[0] == _APPLICATION:
            return
        for statement in self.dialect.tables():
            cursor.execute(statement)
        cursor.execute(f"PRAGMA user_version = {VERSION}")
        cursor.execute(f"PRAGMA application_id = {_APPLICATION}")

    def _transact(self, work: Callable[[Cursor, bool], T], *, reads: bool = False) -> T:
        with self._lock:
            try:
                self._connection.execute("BEGIN" if reads else "BEGIN IMMEDIATE")
                try:
                    result = work(self._connection.cursor(), False)  # noqa: FBT003
                    self._connection.execute("COMMIT")
                except BaseException:
                    if self._connection.in_transaction:
                        self._connection.execute("ROLLBACK")
                    raise
            except sqlite3.Error as error:
                raise self._error(error) from error
            return result

    def _verify(self, cursor: Cursor) -> None:
        # A page that lost its parent would only look like fewer entries.
        problem = self._one(cursor, "PRAGMA integrity_check(1)")[0]
        if problem != "ok":
            reason, text = _REASONS[sqlite3.SQLITE_CORRUPT]
            raise StoreError(self.where, f"{text} ({problem}).", reason=reason)

    def _now(self, _: Cursor) -> float:
        return current_clock().time_ns() / 1e9

    def _error(self, error: sqlite3.Error) -> StoreError:
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # without its extension
        reason, problem = _REASONS.get(code, ("failed", "SQLite cannot use it"))
        return StoreError(self.where, f"{problem} ({error}).", reason=reason)
