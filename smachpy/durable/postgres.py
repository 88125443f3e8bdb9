"""Journals in a PostgreSQL database, for the missions of a fleet.

If the connection is lost, because the server restarts or a standby takes over, the store tries to
connect again for `patience` seconds. It then looks up whether the interrupted transaction was
committed, so that no entry is written twice.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

import psycopg
from psycopg import conninfo, errors

from actionlib_core.clock import RealClock
from smachpy.durable.sql import VERSION, Cursor, Dialect, SqlStore
from smachpy.durable.store import Reason, StoreError

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")

_DEFAULTS: Final = {
    "application_name": "smachpy",
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
_FIRST_PAUSE_S: Final = 0.05
_LONGEST_PAUSE_S: Final = 2.0
_AGAIN: Final = (
    errors.SerializationFailure,
    errors.DeadlockDetected,
    errors.ReadOnlySqlTransaction,  # this server has become a standby
)
_REASONS: Final[tuple[tuple[type[psycopg.Error], Reason, str], ...]] = (
    (errors.DiskFull, "full", "no space is left on the server"),
    (errors.DataCorrupted, "corrupt", "the database is damaged"),
    (errors.IndexCorrupted, "corrupt", "the database is damaged"),
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
        for_update=" FOR UPDATE",
        for_share=" FOR SHARE",
        # "smjl", the application id of files. Locked rows are not enough: two runners may claim
        # different missions of one robot, and neither sees the other's uncommitted claim.
        one_claimer="SELECT pg_advisory_xact_lock(1936550508)",
    )

    def __init__(self, url: str, *, patience: float = 8.0) -> None:
        super().__init__()
        self._patience = patience
        self._clock = RealClock()
        self._lock = threading.Lock()
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
        try:
            self._connection = self._connect()
        except psycopg.Error as error:
            raise self._error(error) from error
        try:
            self._transact(self._create_tables)
        except BaseException:
            self._connection.close()
            raise

    def close(self) -> None:
        """As `Store.close`."""
        with self._lock:
            self._connection.close()

    def _connect(self) -> psycopg.Connection[Any]:
        connection = psycopg.connect(**self._arguments, autocommit=True)
        milliseconds = max(1, round(self._patience * 1000))
        # With "off" a commit returns before it is durable; the other values are up to the server.
        connection.execute(
            "SELECT set_config('statement_timeout', %s, false), "
            "CASE WHEN current_setting('synchronous_commit') = 'off' "
            "THEN set_config('synchronous_commit', 'on', false) END",
            [str(milliseconds)],
        )
        return connection

    def _create_tables(self, cursor: Cursor, _: bool) -> None:
        if not self._one(cursor, _HAS_TABLES)[0]:
            # Two processes may open a new database at once: look again when holding the lock.
            self._do(cursor, self.dialect.one_claimer)
            if not self._one(cursor, _HAS_TABLES)[0]:
                for statement in self.dialect.tables():
                    self._do(cursor, statement)
                self._do(cursor, f"CREATE TABLE smachpy_version AS SELECT {VERSION} AS version")
        version = self._one(cursor, "SELECT version FROM smachpy_version")[0]
        if version > VERSION:
            raise StoreError(
                self.where,
                f"got journals of version {version}; expected {VERSION} at most. "
                "Try a newer smachpy.",
                reason="future",
            )

    def _transact(self, work: Callable[[Cursor, bool], T], *, reads: bool = False) -> T:  # noqa: ARG002
        with self._lock:
            deadline = self._clock.now() + self._patience
            pause = _FIRST_PAUSE_S
            again = False
            while True:
                try:
                    if again and self._connection.closed:
                        self._connection = self._connect()
                    with self._connection.transaction():
                        return work(cast("Cursor", self._connection.cursor()), again)
                except psycopg.Error as error:
                    # A wrong statement is wrong on a new connection, too.
                    lost = self._connection.closed and not isinstance(
                        error, psycopg.ProgrammingError
                    )
                    left = deadline - self._clock.now()
                    if not (lost or isinstance(error, _AGAIN)) or left <= 0:
                        raise self._error(error) from error
                    if isinstance(error, errors.ReadOnlySqlTransaction):
                        self._connection.close()  # connect again, to the host that accepts writes
                again = True
                self._clock.sleep(min(pause, left))
                pause = min(2 * pause, _LONGEST_PAUSE_S)

    def _verify(self, cursor: Cursor) -> None:
        """Do nothing: the server checks its own pages, with `initdb --data-checksums`."""

    def _now(self, cursor: Cursor) -> float:
        # The clocks of the runners' computers differ; the server's clock is the same for all.
        now = self._one(cursor, "SELECT EXTRACT(EPOCH FROM clock_timestamp())::DOUBLE PRECISION")
        return float(now[0])

    def _error(self, error: psycopg.Error) -> StoreError:
        for kind, reason, problem in _REASONS:
            if isinstance(error, kind):
                return self._store_error(reason, f"{problem} ({_line(error)})")
        if isinstance(error, (psycopg.OperationalError, psycopg.InterfaceError)):
            return self._store_error("unreachable", f"got no answer ({_line(error)})")
        return self._store_error("failed", f"PostgreSQL cannot use it ({_line(error)})")

    def _store_error(self, reason: Reason, problem: str) -> StoreError:
        expected = "expected a database that can be written"
        return StoreError(self.where, f"{problem}; {expected}.", reason=reason)


def _line(error: BaseException) -> str:
    """Return an error's text as one line."""
    return " ".join(str(error).split())


def _without_password(given: dict[str, Any]) -> str:
    host = given.get("host") or given.get("hostaddr") or "localhost"
    port = f":{given['port']}" if given.get("port") else ""
    return f"postgresql://{host}{port}/{given.get('dbname') or ''}"
