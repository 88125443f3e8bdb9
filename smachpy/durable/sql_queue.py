# ruff: noqa: S608  statements are built from our own column names; values are always bound
"""The queue of stores in SQL databases: what waits, and which mission begins next.

Each step is one statement, or is repeated safely: a process may be killed, and in PostgreSQL
suspended, between any two. A look costs the same however many missions wait.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actionlib_core.names import clean_namespace
from smachpy.durable.sql_base import Cursor, SqlBase, places
from smachpy.durable.store import (
    INTERRUPTED,
    PAGE,
    QUEUED,
    Lease,
    MissionRow,
    QueueNews,
    check_lease_seconds,
    digest_of,
    host_and_pid,
)
from smachpy.durable.tables import AFTER_BREAK, BREAK, COLUMNS, FREE, HELD, LAST, LATER, ROBOT

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

MAX_LEFT_ROWS: Final = 500
MAX_LEFT_SHAPES: Final = 50
"""The most missions, and targets, that `reserve` passes over: they are bound to a statement."""

FRONT: Final = 16
"""Missions that `reserve` looks at one by one; behind them it looks at what they need."""

MAX_KINDS: Final = 10_000
"""The most different needs whose first missions it compares: they are bound to a statement."""

_FRONT: Final = (
    "WITH front AS (SELECT id FROM smachpy_missions WHERE status = '{}' AND "
    f"{FREE} ORDER BY priority DESC, ready, id LIMIT {FRONT}) "
    "SELECT m.id FROM front CROSS JOIN smachpy_missions AS m WHERE m.id = front.id "
    "AND m.status || '' = '{}' AND m.waits + 0 = 0 AND COALESCE(m.owner, '') = ''"
)
"""Those in front. Another runner may have taken them meanwhile, so what they are is asked again,
and in a form for which no index is of use: PostgreSQL is to find them by their ids.
"""


class SqlQueue(SqlBase):
    """The queue in a SQL database."""

    def look(self, *, robots: Collection[str] = ()) -> QueueNews:
        names = [robot_identity(robot) for robot in robots]
        given = _table([(name,) for name in names])
        mine_due = (
            "SELECT MIN(f.due) FROM (SELECT (SELECT MIN(due) FROM smachpy_missions "
            f"WHERE status = 'queued' AND {LATER} AND {ROBOT.format('')} = g.column1) AS due "
            f"FROM {given}) AS f"
        )
        needs = self.dialect.needs()
        sql = f"SELECT 1 FROM smachpy_missions WHERE {FREE} AND status = '{{}}'"
        if names:
            after, before = f"g.column1 || '{BREAK}'", f"g.column1 || '{AFTER_BREAK}'"
            sql += f" AND {needs} > {after} AND {needs} < {before}"
            sql = f"SELECT 1 FROM {given} WHERE EXISTS ({sql})"

        def read(cursor: Cursor, _: bool) -> tuple[Any, ...]:
            now = self._now(cursor)
            self._do(
                cursor,
                f"SELECT id, fence, {HELD} FROM smachpy_missions WHERE owner IS NOT NULL",
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
                    f"SELECT {COLUMNS}, {HELD} {waiting} AND every IS NOT NULL AND due <= ? "
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
            columns = f"fence, {HELD}{self.dialect.for_update}"
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
        shapes = {(target, shape_of(structure)): structure for target, structure in leave_shapes}
        single, singles = _passed_over(list(leave)[-MAX_LEFT_ROWS:], shapes)
        others = "".join(
            f"AND {column} {word} ({places(given)}) "
            for column, word, given in (
                (ROBOT.format("m."), "IN", names),
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
                    f"AND {_not_in_use(ROBOT, status)} AND {_not_in_use('{}grp', status)} "
                    f"ORDER BY m.priority DESC, m.ready, m.id LIMIT 1{self.dialect.skip_locked}) "
                    f"RETURNING {COLUMNS}, {HELD}, fence",
                    *(runner, self._mark, seconds, self._steady(seconds), *needs),
                    *(*singles, *names, *targets),
                )

            for status in (INTERRUPTED, QUEUED):
                late = f"AND (m.not_after IS NULL OR m.not_after > {now}) "
                here = single + (late if status == QUEUED else "")
                # Those of some robots may all be far behind.
                row = None if names else take(status, _FRONT.format(status, status), here)
                kinds = [] if row else self._kinds(cursor, status, names, targets, shapes)
                free = f"m.status = '{status}' AND m.waits = 0 AND m.owner IS NULL"
                for needs in self._by_first(cursor, kinds, f"{free} {here}", singles):
                    row = row or take(status, f"{one_kind} AND {free}", here, needs)
                if row is not None:
                    return self._row(row[:-1], 0.0), Lease(row[0], row[-1], runner)
            return None

        return self._transact(work)

    def _kinds(
        self,
        cursor: Cursor,
        status: str,
        robots: Sequence[str],
        leave_targets: Collection[str],
        leave_shapes: Collection[tuple[str, str]],
    ) -> list[str]:
        """Return the different needs of the missions with a status, if these are free.

        Args:
            cursor: The cursor.
            status: The missions' status.
            robots: Only missions of these robots; empty: all.
            leave_targets: Targets of missions that are passed over.
            leave_shapes: Targets and shapes of missions that are passed over.
        """
        needs, end = self.dialect.needs(), self.dialect.bytewise
        following = (
            f"SELECT {needs} FROM smachpy_missions WHERE status = '{status}' AND {FREE} "
            f"AND {needs} > kinds.needs AND {needs} < kinds.before ORDER BY {needs} LIMIT 1"
        )
        ranges = [(name + BREAK, name + AFTER_BREAK) for name in robots] or [("", LAST)]
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
        kinds = {one: words for one in found if len(words := one.split(BREAK, 3)) == 4}  # noqa: PLR2004
        if not kinds:
            return []
        self._do(cursor, _in_use(f"{ROBOT.format('')}, grp", status))
        used = cursor.fetchall()
        used_robots, used_groups = {row[0] for row in used}, {row[1] for row in used}
        return [
            one
            for one, (robot, group, shape, target) in kinds.items()
            if robot not in used_robots
            and group not in used_groups
            and target not in leave_targets
            and (target, shape) not in leave_shapes
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


def robot_identity(name: str) -> str:
    """Return the one name of a robot, however it is spelled: "r1" for "/r1" and "r1/".

    Raises:
        InvalidNameError: it is no name.
    """
    return clean_namespace(name) or "/"


def _passed_over(
    ids: Sequence[str], shapes: Mapping[tuple[str, str], bytes]
) -> tuple[str, list[str | bytes]]:
    """Return the condition that a mission `m` is none of those, and its values."""
    condition = f"AND m.id NOT IN ({places(ids)}) " if ids else ""
    values: list[str | bytes] = [*ids]
    for (target, shape), structure in list(shapes.items())[-MAX_LEFT_SHAPES:]:
        same = "m.shape = ? OR (m.shape = '' AND m.structure = ?)"
        condition += f"AND NOT (m.target = ? AND ({same})) "
        values += (target, shape, structure)
    return condition, values


def shape_of(structure: bytes) -> str:
    """Return the digest that stands for a structure in a row of the missions."""
    return digest_of(structure)[:16]


def _table(rows: Sequence[Collection[object]]) -> str:
    """Return a table `g` of values that are bound, with the columns `column1`, `column2`."""
    return f"(VALUES {', '.join(f'({places(row)})' for row in rows)}) AS g"


def _in_use(columns: str, status: str) -> str:
    """Return a query for the robots or groups that missions with a status cannot have now."""
    query = f"SELECT {columns} FROM smachpy_missions WHERE"
    used = f"{query} owner IS NOT NULL"
    # The goals of a mission that was interrupted may still drive its robot: until it goes on or is
    # cancelled, no other one begins there.
    begun = f" UNION ALL {query} status = 'interrupted' AND {FREE}"
    return used if status == INTERRUPTED else used + begun


def _not_in_use(column: str, status: str) -> str:
    """Return the condition that a mission `m` with a status can have its robot, or group."""
    mine, one = column.format("m."), column.format("")
    # Evaluated once, unlike `NOT EXISTS`.
    used = f"SELECT one FROM ({_in_use(f'{one} AS one', status)}) AS u WHERE one IS NOT NULL"
    return f"({mine} IS NULL OR {mine} NOT IN ({used}))"
