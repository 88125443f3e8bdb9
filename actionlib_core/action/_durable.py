"""The file of a durable action server: its goals with their statuses and results.

Every change is written before it is sent to clients. When a result is no longer kept, because it
was acknowledged or nobody came for it, its row stays for a while without goal and result, so that a
late copy of the goal is not run as a new one.
"""

from __future__ import annotations

import contextlib
import logging
import sqlite3
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.exceptions import ActionlibError, DurableGoalsError
from actionlib_core.goal.server import MEMORY_GOALS, ServerGoal
from actionlib_core.goal.states import Status
from actionlib_core.process.private_files import make_private_file, make_private_folder

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib_core.wire.action_types import ActionTypes

log = logging.getLogger(__name__)

VERSION: Final = 2
_APPLICATION: Final = 0x736D6767  # marks the file ("smgg", `PRAGMA application_id`)
_PATIENCE_S: Final = 2.0  # how long SQLite waits for other servers that write to the file
_DELETE: Final = "DELETE FROM goals WHERE action = ? AND id = ?"
_FORGET: Final = (
    "UPDATE goals SET goal = NULL, result = NULL, status = ?, changed = ? "
    "WHERE action = ? AND id = ?"
)
_TABLE: Final = """CREATE TABLE goals (
    action TEXT NOT NULL, id TEXT NOT NULL, type TEXT NOT NULL,
    stamp_ns INTEGER NOT NULL, client TEXT NOT NULL, status INTEGER NOT NULL, text TEXT NOT NULL,
    begun INTEGER NOT NULL, changed REAL NOT NULL, goal BLOB, result BLOB,
    PRIMARY KEY (action, id))"""
# Columns that version 2 added; see `ServerGoal`.
_ADDED: Final = ("cancel_if_lost", "superseded")


@dataclass(frozen=True)
class KeptGoal:
    """A goal read from the file.

    Attributes:
        record: Its status and, when it has ended, its result.
        content: The goal message.
        begun: Whether it was ever accepted.
    """

    record: ServerGoal
    content: Any
    begun: bool


class GoalFile:
    """The goals of one action server in an SQLite file, which servers may share.

    A change is on the disk when the call returns (`synchronous = FULL`).

    Args:
        path: The file; it is created when it is missing, and so is its folder.
        action: The action's full name.
        types: Its message classes.

    Raises:
        DurableGoalsError: the file cannot be opened, or was made by another program or a newer
            version.

    Threads: every method may be called from any thread; each waits for the disk.
    """

    def __init__(self, path: str | Path, action: str, types: ActionTypes) -> None:
        self._file = str(path)
        self._action = action
        self._types = types
        # Packed goals of another definition would be read wrongly, so each row has its type's hash.
        goal = types.goal
        self._type = f"{goal._type} {getattr(goal, '_rihs01', None) or goal._md5sum}"
        self._lock = threading.Lock()
        try:
            make_private_folder(Path(path).parent)
            # An empty file is an empty database for SQLite, which gives its log the same mode.
            make_private_file(Path(path))
            self._connection = sqlite3.connect(
                path, timeout=_PATIENCE_S, isolation_level=None, check_same_thread=False
            )
        except (OSError, sqlite3.Error) as error:
            raise self._error(error) from error
        try:
            self._prepare()
        except sqlite3.Error as error:
            self._connection.close()
            raise self._error(error) from error
        except BaseException:
            self._connection.close()
            raise

    def _prepare(self) -> None:
        run = self._connection.execute
        run("BEGIN IMMEDIATE")  # of two servers that start, one creates the table
        version = run("PRAGMA user_version").fetchone()[0]
        ours = run("PRAGMA application_id").fetchone()[0] == _APPLICATION
        if ours and version > VERSION:
            problem = f"got version {version}; expected {VERSION} at most. Try a newer smachpy."
            raise DurableGoalsError(self._file, problem)
        if not ours:
            if version or run("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]:
                problem = "got a file of another program; expected one of action servers."
                raise DurableGoalsError(self._file, problem)
            run(_TABLE)
            run(f"PRAGMA application_id = {_APPLICATION}")
        if version < VERSION:
            for column in _ADDED:
                run(f"ALTER TABLE goals ADD COLUMN {column} INTEGER NOT NULL DEFAULT 0")
            run(f"PRAGMA user_version = {VERSION}")
        run("COMMIT")
        # Not within a transaction, where SQLite does not change these two.
        run("PRAGMA journal_mode = WAL")
        run("PRAGMA synchronous = FULL")

    def load(self) -> tuple[list[KeptGoal], dict[str, int]]:
        """Return the goals with their results, and the statuses of those without, by id.

        Of the second, only the newest `MEMORY_GOALS` stay in the file. Their ages do not count:
        between two processes only the wall clock could tell them, which may be set.

        Raises:
            DurableGoalsError: a goal cannot be read, or has another definition.
        """
        goals: list[KeptGoal] = []
        past: dict[str, int] = {}
        try:
            with self._lock:
                self._connection.execute(
                    "DELETE FROM goals WHERE action = ? AND goal IS NULL AND rowid NOT IN "
                    "(SELECT rowid FROM goals WHERE action = ? AND goal IS NULL "
                    "ORDER BY rowid DESC LIMIT ?)",
                    (self._action, self._action, MEMORY_GOALS),
                )
                # By rowid: in the order in which the goals arrived.
                rows = self._connection.execute(
                    "SELECT id, type, stamp_ns, client, status, text, begun, goal, result, "
                    "cancel_if_lost, superseded FROM goals WHERE action = ? ORDER BY rowid",
                    (self._action,),
                ).fetchall()
            for id_, type_, stamp_ns, client, status, text, begun, goal, result, *flags in rows:
                if goal is None:
                    past[id_] = status
                    continue
                if type_ != self._type:
                    raise DurableGoalsError(
                        self._file,
                        f"goal {id_} on '{self._action}': got one of type {type_}; expected "
                        f"{self._type}. Try the old definition, or another file.",
                    )
                record = ServerGoal(id_, stamp_ns, Status(status), text, client, result=result)
                record.cancel_if_lost, record.superseded = map(bool, flags)
                goals.append(KeptGoal(record, self._types.goal.from_bytes(goal), bool(begun)))
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise self._error(error) from error
        return goals, past

    def add(self, record: ServerGoal, content: Any) -> str | None:
        """Write a new goal; return the error's text, None when it was written."""
        return self._write(
            "INSERT INTO goals VALUES (?, ?, ?, ?, ?, ?, ?, 0, ?, ?, ?, ?, 0)",
            lambda: (
                *(self._action, record.id, self._type, record.stamp_ns, record.client),
                *(int(record.status), record.text, record.stamp_ns / 1e9),
                *(type(content).to_bytes(content), record.result, record.cancel_if_lost),
            ),
        )

    def update(self, record: ServerGoal, now: float) -> None:
        """Write a goal's present status and result; a failure is logged."""
        problem = self._write(
            "UPDATE goals SET status = ?, text = ?, result = ?, begun = MAX(begun, ?), "
            "superseded = ?, changed = ? WHERE action = ? AND id = ?",
            # Read under the lock: of two threads that change the goal, the last writes its final
            # state. `begun` stays set once the goal was ACTIVE.
            lambda: (
                *(int(record.status), record.text, record.result),
                *(int(record.status is Status.ACTIVE), record.superseded),
                *(now, self._action, record.id),
            ),
        )
        if problem is not None:
            log.error(
                "goal %s on '%s': status %s cannot be written: %s",
                *(record.id, self._action, record.status.name, problem),
            )

    def forget(self, goals: Iterable[tuple[str, Status | None]], now: float) -> None:
        """Delete goals and results, but not the statuses; a failure is logged.

        Args:
            goals: Id and status of each; None instead of a status: the row is deleted too.
            now: Seconds since the Unix epoch.
        """
        execute = self._connection.execute
        try:
            with self._lock:
                execute("BEGIN IMMEDIATE")
                for goal_id, status in goals:
                    if status is None:
                        execute(_DELETE, (self._action, goal_id))
                    else:
                        execute(_FORGET, (int(status), now, self._action, goal_id))
                execute("COMMIT")
        except sqlite3.Error as error:
            with contextlib.suppress(sqlite3.Error):
                self._connection.rollback()
            log.error("goals on '%s' cannot be removed: %s", self._action, self._error(error))  # noqa: TRY400

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._connection.close()

    def _write(self, statement: str, values: Any) -> str | None:
        try:
            with self._lock:
                self._connection.execute(statement, values())
        except (sqlite3.Error, ActionlibError) as error:
            return str(self._error(error))
        return None

    def _error(self, error: BaseException) -> DurableGoalsError:
        problem = f"got {type(error).__name__} ({error}); expected a file of goals that works."
        return DurableGoalsError(self._file, f"{problem} Try another file.")
