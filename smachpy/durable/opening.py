"""Opening a store by its address: the databases that there are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from smachpy.durable.store import StoreError

if TYPE_CHECKING:
    from pathlib import Path

    from smachpy.durable.store import Store


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
