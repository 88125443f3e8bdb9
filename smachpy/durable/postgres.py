"""Journals in a PostgreSQL database, for the missions of a fleet.

If the connection is lost, because the server restarts or a standby takes over, the store tries to
connect again for `patience` seconds. It then looks up whether the interrupted transaction was
committed, so that no entry is written twice.

A pooler may stand between (PgBouncer in transaction mode): nothing is kept in the server's session,
neither settings nor prepared statements, as the next transaction may run in another one.
"""

from __future__ import annotations

import contextlib
import re
import threading
from typing import TYPE_CHECKING, Any, Final, TypeVar

import psycopg
from psycopg import conninfo, errors

from actionlib_core.clock import RealClock
from actionlib_core.clock.forks import is_copy
from smachpy.durable.sql import SqlStore
from smachpy.durable.store import Reason, StoreError
from smachpy.durable.tables import TABLES, VERSION, Dialect

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from smachpy.durable.sql_base import Cursor

T = TypeVar("T")

_DEFAULTS: Final = {
    "application_name": "smachpy",
    "client_encoding": "UTF8",  # whatever the database has; the server converts
    "target_session_attrs": "read-write",  # of several hosts, the one that accepts writes
    # [s]: a server that is gone without a word is noticed after 2 + 2 * 1 s without traffic; the
    # system's default is hours.
    "keepalives_idle": "2",
    "keepalives_interval": "1",
    "keepalives_count": "2",
}
# Not `to_regclass`: it answers from a cache, which may be older than the lock that was waited for.
_HAS_TABLES: Final = (
    "SELECT COUNT(*) FROM pg_tables "
    "WHERE tablename = 'smachpy_version' AND schemaname = ANY (current_schemas(false))"
)
# "smjl", the application id of files: only one process changes the tables.
_ONE_MAKER: Final = "SELECT pg_advisory_xact_lock(1936550508)"
_FIRST_PAUSE_S: Final = 0.05
_MAX_PAUSE_S: Final = 2.0
_HEAR_S: Final = 1.0  # a thread that listens looks this often whether it is to end
_CHANNEL: Final = "smachpy_queue"
_ALONE_BYTES: Final = 1 << 20
"""Longer values are sent as they are, not as text of twice their length."""
_AGAIN: Final = (
    errors.SerializationFailure,
    errors.DeadlockDetected,
    errors.UniqueViolation,  # another process has claimed the same robot, group or id just now
    errors.ReadOnlySqlTransaction,  # this server has become a standby
)
_REFUSED: Final = re.compile(
    "authentication failed|no password supplied|no pg_hba.conf entry|not permitted to log in"
    '|(role|database|user) "[^"]*" does not exist'
)
_REASONS: Final[tuple[tuple[type[psycopg.Error], Reason, str], ...]] = (
    (errors.DiskFull, "full", "no space is left on the server"),
    (errors.DataCorrupted, "corrupt", "the database is damaged"),
    (errors.IndexCorrupted, "corrupt", "the database is damaged"),
    (errors.UntranslatableCharacter, "failed", "the database's encoding lacks a character"),
    (errors.InsufficientPrivilege, "failed", "this user may not do that"),
    (errors.QueryCanceled, "busy", "the server did not finish it in time"),
    (errors.LockNotAvailable, "busy", "the server did not finish it in time"),
)


class PostgresStore(SqlStore):
    """A store in a database; see `open_store` for the arguments.

    Its tables, named `smachpy_...`, are created at the first use.

    Raises:
        StoreError: the server cannot be reached, or the tables belong to a newer smachpy.
    """

    by_lease = True
    dialect = Dialect(
        placeholder="%s",
        blob="BYTEA",
        real="DOUBLE PRECISION",
        big="BIGINT",
        for_update=" FOR UPDATE",
        for_share=" FOR SHARE",
        skip_locked=" FOR UPDATE SKIP LOCKED",
        notify=f"SELECT pg_notify('{_CHANNEL}', '')",
        bytewise=' COLLATE "C"',
    )

    def __init__(self, url: str, *, patience: float = 8.0) -> None:
        super().__init__()
        self._patience = patience
        self._clock = RealClock()
        self._lock = threading.Lock()
        self._is_closed = False
        self.where = "postgresql://"
        try:
            given = conninfo.conninfo_to_dict(url)
        except psycopg.Error:  # not chained: its text may contain the password
            problem = "got a URL that cannot be read"
            raise self._store_error("unreachable", problem) from None
        self.where = _without_password(given)
        # A network that drops all packets must also be noticed within the patience.
        half = max(2, round(patience / 2))
        limits = {"connect_timeout": str(half), "tcp_user_timeout": str(1000 * half)}
        self._arguments: dict[str, Any] = {**_DEFAULTS, **limits, **given}
        milliseconds = max(1, round(patience * 1000))
        # With "off" a commit returns before it is durable; the other values are up to the server.
        self._begin = (
            f"BEGIN; SET LOCAL statement_timeout = {milliseconds}; "
            f"SET LOCAL idle_in_transaction_session_timeout = {2 * milliseconds}; "
            "SELECT CASE WHEN current_setting('synchronous_commit') = 'off' "
            "THEN set_config('synchronous_commit', 'on', true) END"
        )
        self._connection: psycopg.Connection[Any] | None = None
        try:
            self._transact(self._create_tables)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        if is_copy(self._pid):  # it is the parent's
            return
        with self._lock:
            self._is_closed = True
            if self._connection is not None:
                self._connection.close()

    def _connect(self) -> psycopg.Connection[Any]:
        return psycopg.connect(**self._arguments, autocommit=True, prepare_threshold=None)

    def _create_tables(self, cursor: Cursor, _: bool) -> None:
        if not self._one(cursor, _HAS_TABLES)[0]:
            # Two processes may open a new database at once: look again when holding the lock.
            self._do(cursor, _ONE_MAKER)
            if not self._one(cursor, _HAS_TABLES)[0]:
                for statement in self.dialect.tables():
                    self._do(cursor, statement)
                self._do(cursor, "CREATE TABLE smachpy_version AS SELECT 0 AS version")
        version = self._one(cursor, "SELECT version FROM smachpy_version")[0]
        if version < VERSION:
            self._do(cursor, _ONE_MAKER)
            for name, kind in self.dialect.columns().items():
                add = f"ALTER TABLE smachpy_missions ADD COLUMN IF NOT EXISTS {name} {kind}"
                self._do(cursor, add)
            for statement in self.dialect.additions():
                self._do(cursor, statement)
            self._do(cursor, "UPDATE smachpy_version SET version = ?", VERSION)
        elif version > VERSION:
            raise StoreError(
                self.where,
                f"got journals of version {version}; expected {VERSION} at most. "
                "Try a newer smachpy.",
                reason="future",
            )
        elif self._missing_indexes(cursor):
            self._do(cursor, _ONE_MAKER)
            self._add_indexes(cursor)

    def _index_names(self, cursor: Cursor) -> set[str]:
        self._do(
            cursor,
            "SELECT indexname FROM pg_indexes WHERE tablename = 'smachpy_missions' "
            "AND schemaname = ANY (current_schemas(false))",
        )
        return {row[0] for row in cursor.fetchall()}

    def _transact(self, work: Callable[[Cursor, bool], T], *, reads: bool = False) -> T:  # noqa: ARG002
        self._check_process()
        with self._lock:
            deadline = self._clock.now() + self._patience
            pause = _FIRST_PAUSE_S
            again = False
            while True:
                connection = self._connection
                is_new = connection is None or (connection.closed and not self._is_closed)
                try:
                    if connection is None or is_new:
                        connection = self._connection = self._connect()
                    return self._once(connection, work, again=again)
                except psycopg.Error as error:
                    # A wrong statement, or password, is wrong on a new connection, too.
                    lost = connection is None or connection.closed or is_new
                    lost = lost and not isinstance(error, psycopg.ProgrammingError)
                    lost = lost and not _is_refused(error) and not self._is_closed
                    left = deadline - self._clock.now()
                    if not (lost or isinstance(error, _AGAIN)) or left <= 0:
                        raise self._error(error) from error
                    if isinstance(error, errors.ReadOnlySqlTransaction) and connection is not None:
                        connection.close()  # connect again, to the host that accepts writes
                again = True
                self._clock.sleep(min(pause, left))
                pause = min(2 * pause, _MAX_PAUSE_S)

    def _once(
        self, connection: psycopg.Connection[Any], work: Callable[[Cursor, bool], T], *, again: bool
    ) -> T:
        cursor = _Cursor(connection, self._begin)
        try:
            result = work(cursor, again)
            cursor.commit()
        except BaseException:
            with contextlib.suppress(psycopg.Error):
                connection.execute("ROLLBACK")
            raise
        return result

    def listen(self, on_news: Callable[[], object]) -> Callable[[], object]:
        """On a connection of its own.

        Behind a pooler in transaction mode it hears nothing, without an error.
        """
        over = self._clock.event("the end of the queue's news")

        def hear() -> None:
            while not over.is_set():
                with contextlib.suppress(psycopg.Error), self._connect() as connection:
                    connection.execute(f"LISTEN {_CHANNEL}")
                    on_news()  # there may have been some before
                    while not over.is_set():
                        for _ in connection.notifies(timeout=_HEAR_S):
                            on_news()
                over.wait(_MAX_PAUSE_S)

        task = self._clock.spawn(hear, name="news of the queue")

        def end() -> None:
            over.set()
            task.join()

        return end

    def _verify(self, cursor: Cursor) -> None:
        """Do nothing: the server checks its own pages, with `initdb --data-checksums`."""

    def _now(self, cursor: Cursor) -> float:
        # The clocks of the runners' computers differ; the server's clock is the same for all.
        now = self._one(cursor, f"SELECT {self._now_text()}")
        return float(now[0])

    def _now_text(self) -> str:
        return "EXTRACT(EPOCH FROM clock_timestamp())::DOUBLE PRECISION"

    def _bytes(self, cursor: Cursor) -> int:
        tables = ", ".join(f"'{table}'" for table in sorted(TABLES))
        sizes = f"SUM(pg_total_relation_size(oid)) FROM pg_class WHERE relname IN ({tables})"
        return int(self._one(cursor, f"SELECT {sizes}")[0] or 0)

    def _error(self, error: psycopg.Error) -> StoreError:
        for kind, reason, problem in _REASONS:
            if isinstance(error, kind):
                return self._store_error(reason, f"{problem} ({_line(error)})")
        if _is_refused(error):
            return self._store_error("failed", f"the server refuses it ({_line(error)})")
        if isinstance(error, (psycopg.OperationalError, psycopg.InterfaceError)):
            return self._store_error("unreachable", f"got no answer ({_line(error)})")
        return self._store_error("failed", f"PostgreSQL cannot use it ({_line(error)})")

    def _store_error(self, reason: Reason, problem: str) -> StoreError:
        expected = "expected a database that can be written"
        return StoreError(self.where, f"{problem}; {expected}.", reason=reason)


class _Cursor:
    """Sends statements together: those until a result is read are one message to the server.

    A transaction then waits for the server two or three times, rather than once per statement.
    psycopg's pipeline mode does so, too, and takes more CPU time than it saves.

    Args:
        connection: The connection.
        begin: The statements with which the transaction begins.
    """

    def __init__(self, connection: psycopg.Connection[Any], begin: str) -> None:
        self._connection = connection
        self._cursor = psycopg.ClientCursor(connection)  # the server takes no values with several
        self._unsent = [begin]
        self._result: psycopg.Cursor[Any] = self._cursor

    def execute(self, sql: str, values: Sequence[Any] = (), /) -> None:
        if any(isinstance(value, bytes) and len(value) > _ALONE_BYTES for value in values):
            self._send()
            self._result = self._connection.execute(sql, values)
        else:
            self._unsent.append(self._cursor.mogrify(sql, values))

    def executemany(self, sql: str, rows: Iterable[Sequence[Any]], /) -> None:
        for row in rows:
            self.execute(sql, row)

    def fetchone(self) -> Any:
        self._send()
        return self._result.fetchone()

    def fetchall(self) -> list[Any]:
        self._send()
        return self._result.fetchall()

    def commit(self) -> None:
        self._unsent.append("COMMIT")
        self._send()

    def _send(self) -> None:
        if self._unsent:
            statements = "; ".join(self._unsent)
            self._unsent.clear()
            self._cursor.execute(statements)
            while self._cursor.nextset():  # the last one's is read
                pass
            self._result = self._cursor


def _is_refused(error: psycopg.Error) -> bool:
    """Return whether the server has answered that this user may not use this database.

    Errors of a connection have no code, only their text: in another language than English, which is
    up to the server, they count as an outage.
    """
    return isinstance(error, psycopg.OperationalError) and bool(_REFUSED.search(str(error)))


def _line(error: BaseException) -> str:
    """Return an error's text as one line."""
    return " ".join(str(error).split())


def _without_password(given: dict[str, Any]) -> str:
    host = given.get("host") or given.get("hostaddr") or "localhost"
    port = f":{given['port']}" if given.get("port") else ""
    return f"postgresql://{host}{port}/{given.get('dbname') or ''}"
