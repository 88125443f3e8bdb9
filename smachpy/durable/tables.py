"""The tables of stores in SQL databases, and what differs between the databases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

VERSION: Final = 4
"""Version of the tables; a store with a higher one was written by a newer smachpy.

Versions 2 to 4 only add columns, tables and indexes, and each new column has a default: a process
of an older version that has the store open goes on, and one that opens it is refused.
"""

COLUMNS: Final = (
    "id, name, target, argv, status, outcome, robot, created, changed, owner, structure, version, "
    "due, every, schedule, cancel, priority, not_after, grp, drives, note"
)
FIELDS: Final = COLUMNS.replace("grp", "group").split(", ")
HELD: Final = "owner, mark, lease_end, lease_clock"
"""The columns from which `SqlBase._may_take` decides."""

ROBOT: Final = "COALESCE({0}drives, {0}robot)"
"""The robot that a mission holds, as an expression; `drives` is null in rows of version 1."""

FREE: Final = "waits = 0 AND owner IS NULL"
"""The condition of missions that may be taken, with a status."""

LATER: Final = "waits = 1 AND every IS NULL"
"""The condition of missions that are due later."""

BREAK: Final = "\n"
"""Stands between the parts of `Dialect.needs`: no robot and no group has one."""

LAST: Final = "\U0010ffff"
"""No text comes after it, byte by byte."""

AFTER_BREAK: Final = "\v"
"""The next character: what begins with a robot and `BREAK` is before the robot and this."""


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
        """Return what a mission needs as one text of SQL: its robot, group, shape and target.

        If a mission cannot begin as these are in use or not allowed, no other one with the same
        needs can.

        Args:
            table: The name of the missions' table in the statement, with a dot.
        """
        robot = f"COALESCE({table}drives, {table}robot, '')"
        words = (robot, f"COALESCE({table}grp, '')", f"{table}shape", f"{table}target")
        text = f" || '{BREAK}' || ".join(words)
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
        """Return the columns that newer versions add to the missions: name -> type and default."""
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
            # `SqlBase._steady`.
            "lease_clock": "TEXT",
            "beat_clock": "TEXT",
            "beat_ns": self.big,
            # A digest of `structure`; '' in rows of version 3 and before.
            "shape": "TEXT NOT NULL DEFAULT ''",
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
        old = (f"DROP INDEX IF EXISTS smachpy_{name}" for name in _OLD_INDEXES)
        return (table, *changes, *old, *self.indexes().values(), *held)

    def indexes(self) -> dict[str, str]:
        """Return the statements that create the indexes of the missions, by the indexes' names.

        One that is new here needs no new version: a store without it gets it when it is opened.
        """
        columns = f"(status, ({self.needs()}), priority DESC, ready, id)"
        needs = ("kinds", "INDEX", columns, f" WHERE {FREE}")
        return {
            f"smachpy_{name}": f"CREATE {kind} IF NOT EXISTS smachpy_{name} "
            f"ON smachpy_missions {columns}{where}"
            for name, kind, columns, where in (*_INDEXES, needs)
        }


OPEN: Final = "status <> 'ended' AND status <> 'cancelled'"
_CHANGES: Final = (
    "SET drives = TRIM(robot, '/') WHERE robot IS NOT NULL AND drives IS NULL",
    "SET waits = 1 WHERE due IS NOT NULL AND status = 'queued'",
    "SET ready = COALESCE(due, created) WHERE ready = 0",
    # A process that was killed after the end of its mission still holds its robot.
    f"SET owner = NULL, mark = NULL WHERE NOT ({OPEN})",
)
"""What rows of version 1 need; each may be repeated."""

_INDEXES: Final = (
    ("free", "INDEX", "(status, priority DESC, ready, id)", f" WHERE {FREE}"),
    ("once", "INDEX", "(status, due)", f" WHERE {LATER}"),
    ("robots_once", "INDEX", f"(status, ({ROBOT.format('')}), due)", f" WHERE {LATER}"),
    ("often", "INDEX", "(status, due)", " WHERE waits = 1 AND every IS NOT NULL"),
    ("late", "INDEX", "(status, not_after)", " WHERE not_after IS NOT NULL"),
    ("held", "INDEX", "(owner)", " WHERE owner IS NOT NULL"),
    ("robots", "UNIQUE INDEX", f"(({ROBOT.format('')}))", " WHERE owner IS NOT NULL"),
    ("groups", "UNIQUE INDEX", "(grp)", " WHERE owner IS NOT NULL AND grp IS NOT NULL"),
    ("open", "INDEX", "(created, id)", f" WHERE {OPEN}"),
    ("newest", "INDEX", "(created, id)", ""),
    ("newest_of_status", "INDEX", "(status, created, id)", ""),
    ("newest_of_robot", "INDEX", f"(({ROBOT.format('')}), created, id)", ""),
    ("newest_of_target", "INDEX", "(target, created, id)", f" WHERE {OPEN}"),
    ("changed", "INDEX", "(status, changed)", ""),
)
"""Name, kind, columns and condition; the two unique ones are what keeps a robot from two missions.
"""

_OLD_INDEXES: Final = ("needs", "targets")
"""Those of version 3 that others have replaced."""

TABLES: Final = frozenset(
    f"smachpy_{name}" for name in ("missions", "entries", "snapshots", "blobs", "resources")
)
