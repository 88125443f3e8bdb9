"""What a durable action server keeps in a file: its goals, how they stand, and their results.

Every change is in the file before anybody is told of it. A row stays after its client has
acknowledged the result, without goal and result: a copy of the goal that comes late is no new one.
"""

from __future__ import annotations

import logging
import sqlite3
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.exceptions import ActionlibError, DurableGoalsError
from actionlib_core.goal.server import MEMORY_S, ServerGoal
from actionlib_core.goal.states import Status

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib_core.wire.action_types import ActionTypes

log = logging.getLogger(__name__)

VERSION: Final = 1
_APPLICATION: Final = 0x736D6767  # marks the file ("smgg", `PRAGMA application_id`)
_PATIENCE_S: Final = 2.0
_TABLE: Final = """CREATE TABLE goals (
    action TEXT NOT NULL, id TEXT NOT NULL, type TEXT NOT NULL,
    stamp_ns INTEGER NOT NULL, client TEXT NOT NULL, status INTEGER NOT NULL, text TEXT NOT NULL,
    begun INTEGER NOT NULL, changed REAL NOT NULL, goal BLOB, result BLOB,
    PRIMARY KEY (action, id))"""


@dataclass(frozen=True)
class KeptGoal:
    """A goal as an earlier server left it.

    Attributes:
        record: Its place in the life cycle; ended ones have their result.
        content: The goal message.
        begun: It was accepted once.
    """

    record: ServerGoal
    content: Any
    begun: bool


class GoalFile:
    """The goals of one action server in a file of SQLite, which servers may share.

    A transaction is durable when it returns (`synchronous = FULL`).

    Args:
        path: The file; it is made when it is missing, also its folder.
        action: The action's full name.
        types: Its message classes.

    Raises:
        DurableGoalsError: the file cannot be opened, or is another program's or version's.

    Threads: every method may be called from any thread; each blocks for the disk.
    """

    def __init__(self, path: str | Path, action: str, types: ActionTypes) -> None:
        self._file = str(path)
        self._action = action
        self._types = types
        goal = types.goal
        self._type = f"{goal._type} {getattr(goal, '_rihs01', None) or goal._md5sum}"
        self._lock = threading.Lock()
        try:
            Path(path).parent.mkdir(parents=True, exist_ok=True)
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
        run("BEGIN IMMEDIATE")
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
            run(f"PRAGMA user_version = {VERSION}")
            run(f"PRAGMA application_id = {_APPLICATION}")
        run("COMMIT")
        run("PRAGMA journal_mode = WAL")
        run("PRAGMA synchronous = FULL")

    def load(self, now: float) -> tuple[list[KeptGoal], dict[str, int]]:
        """Return the goals that are not over for their clients, and the statuses of those that are.

        Args:
            now: Seconds since the Unix epoch; what ended long before it is forgotten.

        Raises:
            DurableGoalsError: a goal cannot be read, or is one of another definition.
        """
        goals: list[KeptGoal] = []
        past: dict[str, int] = {}
        try:
            with self._lock:
                self._connection.execute(
                    "DELETE FROM goals WHERE action = ? AND goal IS NULL AND changed < ?",
                    (self._action, now - MEMORY_S),
                )
                rows = self._connection.execute(
                    "SELECT id, type, stamp_ns, client, status, text, begun, goal, result "
                    "FROM goals WHERE action = ? ORDER BY rowid",
                    (self._action,),
                ).fetchall()
            for id_, type_, stamp_ns, client, status, text, begun, goal, result in rows:
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
                goals.append(KeptGoal(record, self._types.goal.from_bytes(goal), bool(begun)))
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise self._error(error) from error
        return goals, past

    def add(self, record: ServerGoal, content: Any) -> str | None:
        """Keep a new goal; return what went wrong, None when it is kept."""
        return self._write(
            "INSERT INTO goals VALUES (?, ?, ?, ?, ?, ?, ?, 0, ?, ?, ?)",
            lambda: (
                *(self._action, record.id, self._type, record.stamp_ns, record.client),
                *(int(record.status), record.text, record.stamp_ns / 1e9),
                *(type(content).to_bytes(content), record.result),
            ),
        )

    def update(self, record: ServerGoal, now: float) -> None:
        """Keep how a goal stands now; when that fails it is told in the log."""
        problem = self._write(
            "UPDATE goals SET status = ?, text = ?, result = ?, begun = MAX(begun, ?), changed = ? "
            "WHERE action = ? AND id = ?",
            lambda: (  # made under the lock: of two changes at once, the later one stays
                *(int(record.status), record.text, record.result),
                int(record.status is Status.ACTIVE),
                *(now, self._action, record.id),
            ),
        )
        if problem is not None:
            log.error(
                "goal %s on '%s': status %s cannot be kept: %s",
                *(record.id, self._action, record.status.name, problem),
            )

    def forget(self, goal_ids: Iterable[str], now: float) -> None:
        """Keep no more than the statuses of goals whose clients have their results."""
        for goal_id in goal_ids:
            self._write(
                "UPDATE goals SET goal = NULL, result = NULL, changed = ? "
                "WHERE action = ? AND id = ? AND result IS NOT NULL",
                lambda goal_id=goal_id: (now, self._action, goal_id),
            )

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
