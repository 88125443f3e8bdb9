"""Journals in an SQLite file: the default, for the missions of one computer.

The file is in WAL mode: others can read the journal while a mission writes it, and a transaction is
one append to the log beside the file, `FILE-wal`. SQLite keeps a checksum for each page of the log,
so a transaction that was written in part counts as not begun
(https://sqlite.org/fileformat2.html#walformat).

SQLite takes a file whose log is missing for a complete one, and shows an older state. To detect
that, the file itself has the bit `_NEEDS_LOG` of `PRAGMA user_version` set, and the log has it
cleared. Whenever the whole log is copied into the file and deleted (SQLite does so when the last
connection is closed, even that of another program), the bit is cleared with it.

A file may come from a stranger: what SQLite would execute while it is read, such as views and
triggers, is refused when it is opened (https://sqlite.org/security.html), and each transaction has
a deadline.
"""

from __future__ import annotations

import contextlib
import math
import os
import sqlite3
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypeVar

from actionlib_core.clock import RealClock, current_clock
from actionlib_core.clock.forks import is_copy
from actionlib_core.process.private_files import make_private_file, make_private_folder
from smachpy.durable.processes import boot_clock
from smachpy.durable.sql import SqlStore
from smachpy.durable.store import Reason, StoreError
from smachpy.durable.tables import TABLES, VERSION, Dialect

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from smachpy.durable.sql_base import Cursor

T = TypeVar("T")

_APPLICATION: Final = 0x736D6A6C  # in ASCII, "smjl"
"""The `PRAGMA application_id` of journals."""

_NEEDS_LOG: Final = 1 << 16

MAX_VALUE_BYTES: Final = 256 * 2**20
"""The longest value of a file that is read or written [bytes]."""

DEADLINE_S: Final = 20.0
"""Longest time of a transaction, without the wait for other processes [s]."""

CHECK_S: Final = 0.3
"""Longest time for the check of a file that is opened [s]; a gigabyte takes several seconds."""

# A file has one writer at a time, and a mission waits 5 s for it. So `prune` deletes and frees in
# parts, and lets others write in between.
PRUNED_BYTES: Final = 16 * 2**20
"""Data that is deleted in one transaction."""

PAGES_AT_ONCE: Final = 2_000
"""Pages that are given back to the system in one transaction."""

LONGEST_WAY_S: Final = 0.2
"""Longest pause after each [s], else as long as it took; who waits looks every 0.1 s."""

_SIZE: Final = (
    "SELECT (SELECT TOTAL(LENGTH(data)) FROM smachpy_entries WHERE mission = ?)"
    " + (SELECT TOTAL(LENGTH(data)) FROM smachpy_snapshots WHERE mission = ?)"
    " + (SELECT TOTAL(LENGTH(data)) FROM smachpy_blobs WHERE mission = ?)"
)

_STEPS: Final = 20_000
"""Steps of SQLite's machine between two looks at the deadline, about a millisecond."""

_REASONS: Final[dict[int, tuple[Reason, str]]] = {
    sqlite3.SQLITE_BUSY: (
        "busy",
        "another process keeps it locked; expected an unlocked file. Try again",
    ),
    sqlite3.SQLITE_LOCKED: ("busy", "it is locked; expected an unlocked file. Try again"),
    sqlite3.SQLITE_FULL: ("full", "no space is left; expected some. Try to free space"),
    sqlite3.SQLITE_INTERRUPT: (
        "failed",
        f"reading it takes more than {DEADLINE_S:g} s; expected a journal. Try another path",
    ),
    sqlite3.SQLITE_TOOBIG: (
        "failed",
        f"a value has more than {MAX_VALUE_BYTES} bytes; expected less. Try smaller userdata",
    ),
    sqlite3.SQLITE_CORRUPT: ("corrupt", "it is damaged; expected an undamaged file. Try a copy"),
    sqlite3.SQLITE_NOTADB: (
        "foreign",
        "it is not an SQLite file; expected a journal. Try another path",
    ),
    sqlite3.SQLITE_CANTOPEN: (
        "unreachable",
        "it cannot be opened; expected a file. Try another path",
    ),
    sqlite3.SQLITE_READONLY: ("unreachable", "it cannot be written. Try its permissions"),
    sqlite3.SQLITE_PERM: ("unreachable", "it cannot be opened. Try its permissions"),
    sqlite3.SQLITE_IOERR: ("failed", "reading or writing the disk failed. Try another disk"),
}


class SQLiteStore(SqlStore):
    """A store in one file; see `open_store` for the arguments.

    Raises:
        StoreError: the file cannot be opened; it was not changed.
    """

    by_lease = False
    dialect = Dialect(
        placeholder="?", blob="BLOB", real="REAL", big="INTEGER", clustered=" WITHOUT ROWID"
    )

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
        # Resolved: SQLite keeps the log beside the file itself, not beside a link to it.
        self._file = file = Path(path).resolve()
        self.where = str(path)
        # Inode and modification time of the file when it last had the bit `_NEEDS_LOG`.
        self._marked: tuple[int, int] | None = None
        self._lock = threading.Lock()
        self._deadline = math.inf
        if create:
            self._make_file(file)
        elif not file.exists():
            problem = (
                "got no such file; expected a journal. Try `smachpy run MISSION --durable`, which "
                "makes one, or name another with `--durable FILE`."
            )
            raise StoreError(self.where, problem, reason="missing")
        mode = "rwc" if create else "rw"
        try:
            self._check_log()
            self._connection = sqlite3.connect(
                f"{file.as_uri()}?mode={mode}",
                uri=True,
                timeout=patience,
                isolation_level=None,  # `_transact` begins and ends transactions itself
                check_same_thread=False,  # `_lock` lets one thread at a time use the connection
            )
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise self._error(error) from error
        try:
            self._distrust()
            version = self._transact(self._check, reads=True)  # before anything is written
            self._pragmas(synchronous)
            # A new or older file; or a process was killed inside `_mark_file`.
            if version != VERSION:
                self._transact(self._create_tables)
            elif self._transact(lambda cursor, _: self._missing_indexes(cursor), reads=True):
                self._transact(lambda cursor, _: self._add_indexes(cursor))
        except (sqlite3.Error, UnicodeDecodeError) as error:
            self._connection.close()
            raise self._error(error) from error
        except BaseException:
            self._connection.close()
            raise

    def close(self) -> None:
        if is_copy(self._pid):  # it is the parent's
            return
        with self._lock:
            self._connection.close()

    def _make_file(self, file: Path) -> None:
        """Make the file and its folder, for this user only: they hold arguments and userdata."""
        try:
            make_private_folder(file.parent)
            if not file.exists():
                # An empty file is an empty database for SQLite, which gives its log the same mode.
                make_private_file(file)
        except OSError as error:
            if isinstance(error, PermissionError) and file.parent.is_dir():
                return  # SQLite's own text names the file
            reason: Reason = "unreachable"
            problem = f"got no folder for it ({error.strerror}); expected one that can be made."
            raise StoreError(self.where, problem, reason=reason) from error

    def _check_log(self) -> None:
        """Refuse a file without the log that it needs, and a log without its file."""
        log = self._file.parent / f"{self._file.name}-wal"
        if log.exists():
            # SQLite creates the file first, and would delete the log of an empty file.
            if log.stat().st_size and not (self._file.exists() and self._file.stat().st_size):
                raise self._incomplete("the file itself", self._file.name)
        # `exists` a second time: another process may have begun to use the file meanwhile.
        elif self._file.is_file() and self._needs_log() and not log.exists():
            raise self._incomplete(f"the log {log.name!r}", log.name)

    def _incomplete(self, what: str, name: str) -> StoreError:
        return StoreError(
            self.where,
            f"{what} is missing, and the newest entries with it; expected both side by side. "
            f"Nothing was changed. Try a copy that has {name!r}, too.",
            reason="corrupt",
        )

    def _needs_log(self) -> bool:
        """Return whether the bit `_NEEDS_LOG` is set in the file itself."""
        # `immutable` reads the file without its log, and creates neither a lock nor a log.
        uri = f"{self._file.as_uri()}?mode=ro&immutable=1"
        with contextlib.closing(sqlite3.connect(uri, uri=True)) as raw:
            ours = raw.execute("PRAGMA application_id").fetchone()[0] == _APPLICATION
            return ours and bool(raw.execute("PRAGMA user_version").fetchone()[0] & _NEEDS_LOG)

    def _distrust(self) -> None:
        """Let nothing run that a file may bring, and set limits."""
        connection = self._connection
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_VALUE_BYTES)
        connection.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        connection.setlimit(sqlite3.SQLITE_LIMIT_TRIGGER_DEPTH, 1)
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA cell_size_check = ON")
        connection.set_progress_handler(lambda: self._clock_now() > self._deadline, _STEPS)

    def _clock_now(self) -> float:
        return RealClock().now()

    def _check(self, cursor: Cursor, _: bool) -> int:
        """Refuse a file that is not a journal, or is newer; return its `user_version`."""
        user_version: int = self._one(cursor, "PRAGMA user_version")[0]
        version = user_version & ~_NEEDS_LOG
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
        else:
            self._check_schema(cursor)
        return user_version

    def _check_schema(self, cursor: Cursor) -> None:
        """Refuse what SQLite would execute while it reads the file."""
        cursor.execute("SELECT type, name, tbl_name FROM sqlite_master LIMIT 1000")
        found = cursor.fetchall()
        foreign = [
            f"{kind} {name!s:.60}"
            for kind, name, table in found
            if not (
                (kind == "table" and name in {*TABLES, "sqlite_stat1"})
                or (kind == "index" and table in TABLES)
            )
        ]
        for table in TABLES & {name for _, name, _ in found}:
            cursor.execute("SELECT name FROM pragma_table_xinfo(?) WHERE hidden <> 0", (table,))
            foreign += [f"computed column {name!s:.60}" for (name,) in cursor.fetchall()]
        if foreign:
            raise StoreError(
                self.where,
                f"got a journal with {', '.join(sorted(foreign)[:3])}; expected the tables of "
                "smachpy alone: a stranger may have made it. Try another path.",
                reason="foreign",
            )

    def _pragmas(self, synchronous: str) -> None:
        execute = self._connection.execute
        if execute("PRAGMA page_count").fetchone()[0] == 0:
            execute("PRAGMA auto_vacuum = INCREMENTAL")  # see `_shrink`
        attempts_left = 10
        while execute("PRAGMA journal_mode").fetchone()[0] != "wal":
            attempts_left -= 1
            try:
                execute("PRAGMA journal_mode = WAL")
            except sqlite3.OperationalError:
                # SQLite does not wait here if two processes that have read a new file change its
                # mode at the same time. A write transaction waits until the other one has ended.
                if not attempts_left:
                    raise
                execute("BEGIN IMMEDIATE")
                execute("ROLLBACK")
        execute(f"PRAGMA synchronous = {synchronous}")

    def _create_tables(self, cursor: Cursor, _: bool) -> None:
        # Again, now that this is the only writer: another process may have created them.
        if self._one(cursor, "PRAGMA application_id")[0] != _APPLICATION:
            for statement in self.dialect.tables():
                cursor.execute(statement)
            cursor.execute(f"PRAGMA application_id = {_APPLICATION}")
        cursor.execute("SELECT name FROM pragma_table_info('smachpy_missions')")
        known = {name for (name,) in cursor.fetchall()}
        for name, kind in self.dialect.columns().items():
            if name not in known:
                cursor.execute(f"ALTER TABLE smachpy_missions ADD COLUMN {name} {kind}")
        for statement in self.dialect.additions():
            cursor.execute(statement)
        cursor.execute(f"PRAGMA user_version = {VERSION}")

    def _index_names(self, cursor: Cursor) -> set[str]:
        cursor.execute("SELECT name FROM sqlite_master WHERE type = 'index'")
        return {name for (name,) in cursor.fetchall()}

    def _transact(self, work: Callable[[Cursor, bool], T], *, reads: bool = False) -> T:
        self._check_process()
        with self._lock:
            self._deadline = self._clock_now() + DEADLINE_S
            try:
                try:
                    # IMMEDIATE waits for other writers now. A transaction that reads first and then
                    # writes would fail at once, without waiting, if another one wrote in between.
                    self._connection.execute("BEGIN" if reads else "BEGIN IMMEDIATE")
                    self._deadline = self._clock_now() + DEADLINE_S
                    result = work(self._connection.cursor(), False)  # noqa: FBT003
                    self._connection.execute("COMMIT")
                except BaseException:
                    if self._connection.in_transaction:
                        self._connection.execute("ROLLBACK")
                    raise
            except (sqlite3.Error, UnicodeDecodeError) as error:
                raise self._error(error) from error
            except OverflowError as error:  # a number of Python that SQLite cannot hold
                raise StoreError(
                    self.where, f"got a number that SQLite cannot hold ({error}).", reason="failed"
                ) from error
            finally:
                self._deadline = math.inf
            if not reads:
                self._mark_file()
            return result

    def _mark_file(self) -> None:
        """Set the bit `_NEEDS_LOG` in the file again after the log was copied into it.

        Raises:
            StoreError: the file was deleted or replaced.
        """
        # Only a copied log changes the file itself, so usually this is one `stat` per write.
        try:
            now = os.stat(self._file)  # noqa: PTH116  takes half the time of Path.stat
        except OSError as error:
            problem = (
                f"got no file after a write ({error.strerror}); expected the one that was opened."
            )
            raise StoreError(self.where, problem, reason="missing") from error
        if self._marked == (now.st_ino, now.st_mtime_ns):
            return
        if self._marked is not None and self._marked[0] != now.st_ino:
            problem = "got another file in its place; expected the one that was opened."
            raise StoreError(self.where, problem, reason="missing")
        execute = self._connection.execute
        # Errors can wait: the transaction is durable, and the next write tries again.
        with contextlib.suppress(sqlite3.Error):
            if not self._needs_log():
                # The checkpoint copies the set bit from the log into the file; then the log gets
                # the cleared one, for the time when it is copied and deleted.
                execute(f"PRAGMA user_version = {VERSION | _NEEDS_LOG}")
                try:
                    execute("PRAGMA wal_checkpoint")
                finally:
                    execute(f"PRAGMA user_version = {VERSION}")
            if self._needs_log():
                self._marked = now.st_ino, self._file.stat().st_mtime_ns

    def _verify(self, cursor: Cursor) -> None:
        # A page that is missing from the tree of a table would only look like fewer entries.
        self._deadline = self._clock_now() + CHECK_S
        problem = "ok"
        try:
            for check in ("quick_check", "integrity_check"):  # the second takes four times as long
                if problem == "ok":
                    problem = self._one(cursor, f"PRAGMA {check}(1)")[0]
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode == sqlite3.SQLITE_INTERRUPT:
                return  # a large file: what is read has its checksums
            raise
        if problem != "ok":
            reason, text = _REASONS[sqlite3.SQLITE_CORRUPT]
            raise StoreError(self.where, f"{text} ({problem}).", reason=reason)

    def _fitting(self, cursor: Cursor, ids: Sequence[str]) -> int:
        size = 0
        for number, one in enumerate(ids, 1):
            size += self._one(cursor, _SIZE, one, one, one)[0]
            if size >= PRUNED_BYTES:
                return number
        return len(ids)

    def _give_way(self, begun: float) -> None:
        clock = current_clock()
        clock.sleep(min(clock.now() - begun, LONGEST_WAY_S))

    def _shrink(self) -> None:
        left, goes_on = math.inf, True
        while goes_on:
            begun = current_clock().now()
            with self._lock:
                try:
                    free = self._give_back(is_first=left == math.inf)
                    goes_on, left = 0 < free < left, free
                    if not goes_on:
                        self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
                except sqlite3.Error as error:
                    raise self._error(error) from error
                self._mark_file()
            self._give_way(begun)

    def _give_back(self, *, is_first: bool) -> int:
        """Give the next free pages back to the system; return how many are left."""
        if is_first and self._connection.execute("PRAGMA auto_vacuum").fetchone()[0] == 0:
            # A file of an older smachpy: from now on as `_pragmas` sets it.
            self._connection.execute("PRAGMA auto_vacuum = INCREMENTAL")
            self._connection.execute("VACUUM")
        # `execute` would free one page and stop: the statement has no rows to fetch.
        self._connection.executescript(f"PRAGMA incremental_vacuum({PAGES_AT_ONCE})")
        return int(self._connection.execute("PRAGMA freelist_count").fetchone()[0])

    def _bytes(self, cursor: Cursor) -> int:
        pages = self._one(cursor, "PRAGMA page_count")[0]
        return int(pages * self._one(cursor, "PRAGMA page_size")[0])

    def _now(self, _: Cursor) -> float:
        return current_clock().time_ns() / 1e9

    def _now_text(self) -> str:
        return repr(current_clock().time_ns() / 1e9)

    def _steady(self, seconds: float = 0.0) -> str | None:
        # The monotonic clock is the same for all processes between two boots.
        clock, name = current_clock(), boot_clock()
        if not name or not isinstance(clock, RealClock):
            return None
        return f"{name} {clock.now() + seconds!r}"

    def _since(self, then: float, steady: str | None, now: float) -> float:
        name, _, reading = (steady or "").rpartition(" ")
        clock = current_clock()
        if name and name == boot_clock() and isinstance(clock, RealClock):
            with contextlib.suppress(ValueError):
                return clock.now() - float(reading)
        return now - then

    def _error(self, error: sqlite3.Error | UnicodeDecodeError) -> StoreError:
        if isinstance(error, UnicodeDecodeError):
            # SQLite quotes a name of the damaged schema, which Python cannot read.
            return StoreError(
                self.where, f"{_REASONS[sqlite3.SQLITE_CORRUPT][1]}.", reason="corrupt"
            )
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # the primary code of an extended one
        reason, problem = _REASONS.get(code, ("failed", "SQLite cannot use it"))
        return StoreError(self.where, f"{problem} ({error}).", reason=reason)
