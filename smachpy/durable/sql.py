# ruff: noqa: S608  statements are built from our own column names; values are always bound
"""The common part of stores in SQL databases: every method of `Store`.

A subclass has what `SqlBase` names, and `_bytes`, `_verify` and `close`. The queue is in
`SqlQueue`.
"""

from __future__ import annotations

import json
import math
import zlib
from abc import abstractmethod
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import current_clock
from smachpy.durable.position import VERSION as FORMAT
from smachpy.durable.sql_base import Cursor, places
from smachpy.durable.sql_queue import SqlQueue, robot_identity, shape_of
from smachpy.durable.store import (
    INTERRUPTED,
    OVER,
    PAGE,
    QUEUED,
    RUNNING,
    FencedError,
    Lease,
    MissionInUseError,
    MissionOverError,
    MissionRow,
    ResourceUse,
    StoreError,
    UnknownMissionError,
    check_lease_seconds,
    digest_of,
    host_and_pid,
)
from smachpy.durable.tables import COLUMNS, FIELDS, HELD, OPEN, ROBOT
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from actionlib_core.resources import Policy

PRUNED_AT_ONCE: Final = 500
"""Missions that `prune` deletes in one transaction: others write in between."""


class SqlStore(SqlQueue):
    """A store in a SQL database."""

    def __init__(self) -> None:
        super().__init__()
        # Number of the last entry that each lease has written. After a failover the server may have
        # fewer: the standby took over without the newest transactions.
        self._written: dict[Lease, int] = {}
        self._verified = False

    # -- missions ------------------------------------------------------------------------------

    def create(self, row: MissionRow) -> MissionRow:
        first_try: list[float] = []

        def work(cursor: Cursor, again: bool) -> float:
            found = self._one(cursor, "SELECT created FROM smachpy_missions WHERE id = ?", row.id)
            if found is not None:
                if again and found[0] in first_try:  # made by it, but its answer was lost
                    return float(found[0])
                raise MissionError(
                    f"{self.where}: mission {row.id!r}: got an id that is taken; expected a new "
                    "one. Try another id, or 'smachpy missions list'."
                )
            now = self._now(cursor)
            first_try.append(now)
            self._insert(cursor, row, now)
            self._wake(cursor)
            return now

        now = self._transact(work)
        return self._stamped(row, now)

    def start(
        self, row: MissionRow, runner: str, *, seconds: float
    ) -> tuple[MissionRow, Lease] | None:
        check_lease_seconds(seconds)
        host_and_pid(runner)
        self._verify_once()
        first_try: list[float] = []

        def work(cursor: Cursor, again: bool) -> float | None:
            now = self._now(cursor)
            self._insert(cursor, row, now, " ON CONFLICT (id) DO NOTHING RETURNING id")
            if cursor.fetchone() is None:
                found = again and self._one(
                    cursor,
                    "SELECT created FROM smachpy_missions WHERE id = ? AND owner = ? AND mark = ?",
                    *(row.id, runner, self._mark),
                )
                # Made by the first try, but its answer was lost.
                return float(found[0]) if found and found[0] in first_try else None
            first_try.append(now)
            self._take_shared(cursor, row.id, row.held_robot, row.group, now)
            self._hold(cursor, row.id, runner, 1, now, seconds)
            return now

        now = self._transact(work)
        return None if now is None else (self._stamped(row, now), Lease(row.id, 1, runner))

    def missions(
        self,
        *,
        open_only: bool = False,
        statuses: Collection[str] = (),
        robot: str | None = None,
        target: str | None = None,
        limit: int | None = PAGE,
        skip: int = 0,
    ) -> list[MissionRow]:
        conditions: list[str] = []
        values: list[object] = []
        if open_only:
            conditions.append(OPEN)
        if robot is not None:
            conditions.append(f"{ROBOT.format('')} = ?")
            values.append(robot_identity(robot))
        if target is not None:
            conditions.append("target = ?")
            values.append(target)
        newest_first = "ORDER BY created DESC, id DESC"
        page = first = ""
        if limit is not None:
            page, first = f" LIMIT {int(limit)} OFFSET {int(skip)}", f" LIMIT {limit + skip}"
        if statuses:
            # The row of an interrupted mission may still say that its process runs it.
            wanted = sorted({*statuses, *({RUNNING} if INTERRUPTED in statuses else ())})
            # One by one: with `IN`, an index would not give them in order.
            of_one = " AND ".join(["status = ?", *conditions])
            listed = " UNION ALL ".join(
                f"SELECT * FROM (SELECT {COLUMNS}, {HELD} FROM smachpy_missions "
                f"WHERE {of_one} {newest_first}{first}) AS s{number}"
                for number, _ in enumerate(wanted)
            )
            values = [value for status in wanted for value in (status, *values)]
        else:
            where = f" WHERE {' AND '.join(conditions)}" if conditions else ""
            listed = f"SELECT {COLUMNS}, {HELD} FROM smachpy_missions{where}"

        def work(cursor: Cursor, _: bool) -> list[MissionRow]:
            self._do(cursor, f"{listed} {newest_first}{page}", *values)
            rows = cursor.fetchall()
            now = self._now(cursor)
            return [self._row(row, now) for row in rows]

        rows = self._transact(work, reads=True)
        if limit is None:
            rows = rows[skip:]
        return [row for row in reversed(rows) if not statuses or row.status in statuses]

    def find(self, id: str) -> MissionRow | None:  # noqa: A002

        def work(cursor: Cursor, _: bool) -> MissionRow | None:
            sql = f"SELECT {COLUMNS}, {HELD} FROM smachpy_missions WHERE id = ?"
            row = self._one(cursor, sql, id)
            return None if row is None else self._row(row, self._now(cursor))

        row = self._transact(work, reads=True)
        if row is not None and row.problem:
            raise self._damaged(id, "its row has values of wrong types")
        return row

    def mission(self, id: str) -> MissionRow:  # noqa: A002
        row = self.find(id)
        if row is None:
            raise self._transact(lambda cursor, _: self._unknown(cursor, id), reads=True)
        return row

    def holders(self) -> list[MissionRow]:

        def work(cursor: Cursor, _: bool) -> list[MissionRow]:
            select = f"SELECT {COLUMNS}, {HELD} FROM smachpy_missions WHERE"
            begun = "status = 'interrupted' AND waits = 0 AND owner IS NULL"
            self._do(cursor, f"{select} owner IS NOT NULL UNION ALL {select} {begun}")
            rows, now = cursor.fetchall(), self._now(cursor)
            return [
                mission
                for row in rows
                if (mission := self._row(row, now)).status == INTERRUPTED
                or not self._may_take(row[len(FIELDS) :], now)
            ]

        return self._transact(work, reads=True)

    def size(self) -> tuple[int, int]:

        def work(cursor: Cursor, _: bool) -> tuple[int, int]:
            count = self._one(cursor, "SELECT COUNT(*) FROM smachpy_missions")[0]
            return int(count), self._bytes(cursor)

        return self._transact(work, reads=True)

    @abstractmethod
    def _bytes(self, cursor: Cursor) -> int:
        """Return the size of the store [bytes]."""

    # -- the missions of this process ----------------------------------------------------------

    def claim(
        self,
        id: str,  # noqa: A002
        runner: str,
        *,
        seconds: float,
        reserved: Lease | None = None,
    ) -> Lease:
        check_lease_seconds(seconds)
        host_and_pid(runner)

        def work(cursor: Cursor, again: bool) -> Lease:
            row = self._known(
                cursor,
                id,
                f"status, {ROBOT.format('')}, grp, every, fence, changed, beat_clock, beat_ns, "
                f"{HELD}{self.dialect.for_update}",
            )
            status, robot, group, every, fence, changed, beat_clock, beat_ns, *held = row
            owner, mark = held[:2]
            now = self._now(cursor)
            if status in OVER:
                raise MissionOverError(self.where, id, status)
            if every is not None:
                raise MissionError(
                    f"{self.where}: mission {id!r}: got a schedule, {every!r}; expected one of the "
                    "missions that it begins. Try: smachpy missions list"
                )
            mine = (owner, mark) == (runner, self._mark)
            if again and mine and status == RUNNING:  # by the first try, whose answer was lost
                pass
            elif reserved is not None:
                if (owner, fence) != (reserved.runner, reserved.fence) or status == RUNNING:
                    raise FencedError(self.where, reserved, owner)
            elif not (mine and status != RUNNING):  # this process may have reserved it itself
                self._refuse_held(id, held, now)
            self._take_shared(cursor, id, robot, group, now)
            self._hold(cursor, id, runner, fence + 1, now, seconds)
            silent = max(0.0, self._since(changed, beat_clock, now))
            return Lease(id, fence + 1, runner, beat_ns, silent)

        return self._transact(work)

    def _hold(
        self, cursor: Cursor, id_: str, runner: str, fence: int, now: float, seconds: float
    ) -> None:
        """Let a mission be run by a process, for `seconds` [s] from `now`."""
        self._do(
            cursor,
            "UPDATE smachpy_missions SET status = 'running', owner = ?, mark = ?, "
            "lease_end = ?, lease_clock = ?, fence = ?, note = '', "
            "version = CASE WHEN version < ? THEN ? ELSE version END WHERE id = ?",
            *(runner, self._mark, now + seconds, self._steady(seconds), fence),
            *(FORMAT, FORMAT, id_),
        )

    def renew(self, lease: Lease, *, seconds: float, beat_ns: int | None = None) -> bool:
        check_lease_seconds(seconds)

        def work(cursor: Cursor, _: bool) -> bool:
            cancel = self._fenced(cursor, lease)[0]
            now = self._now(cursor)
            self._do(
                cursor,
                "UPDATE smachpy_missions SET lease_end = ?, lease_clock = ? WHERE id = ?",
                *(now + seconds, self._steady(seconds), lease.mission),
            )
            if beat_ns is not None:
                self._note_beat(cursor, lease.mission, beat_ns)
            return cancel

        return self._transact(work)

    def append(
        self,
        lease: Lease,
        entries: Sequence[bytes],
        *,
        snapshot: bytes | None = None,
        status: str | None = None,
        outcome: str | None = None,
        blobs: Mapping[str, bytes] = MappingProxyType({}),
        kept: Collection[str] = (),
        beat_ns: int | None = None,
    ) -> None:
        mission = lease.mission
        first_try: list[int] = []  # the number of the last entry that it found

        def work(cursor: Cursor, again: bool) -> int:
            _, last = self._fenced(cursor, lease)
            if again and (first_try or lease in self._written):
                before = first_try[0] if first_try else self._written[lease]
                if entries and last == before + len(entries):
                    return last  # the first try was committed; only its answer was lost
                if last < before:
                    raise self._damaged(mission, f"the server has {last} entries of {before}")
            first_try.append(last)
            if blobs:
                self._do_many(
                    cursor,
                    "INSERT INTO smachpy_blobs (mission, digest, data) VALUES (?, ?, ?) "
                    "ON CONFLICT (mission, digest) DO NOTHING",
                    ((mission, digest, data) for digest, data in blobs.items()),
                )
            # Numbers without gaps, and a checksum each: `read` notices lost and damaged entries.
            if snapshot is not None:  # it has the new entries, too
                self._compact(cursor, mission, last + len(entries), snapshot, kept)
            elif entries:
                rows = (
                    (mission, n, lease.fence, zlib.crc32(data), data)
                    for n, data in enumerate(entries, last + 1)
                )
                self._do_many(
                    cursor,
                    "INSERT INTO smachpy_entries (mission, n, fence, crc, data) "
                    "VALUES (?, ?, ?, ?, ?)",
                    rows,
                )
            if beat_ns is not None:
                self._note_beat(cursor, mission, beat_ns)
            if status is not None or outcome is not None:
                self._do(
                    cursor,
                    "UPDATE smachpy_missions SET status = COALESCE(?, status), "
                    f"outcome = COALESCE(?, outcome), changed = {self._now_text()} WHERE id = ?",
                    *(status, outcome, mission),
                )
            return last + len(entries)

        self._written[lease] = self._transact(work)

    def _note_beat(self, cursor: Cursor, mission: str, beat_ns: int) -> None:
        self._do(
            cursor,
            f"UPDATE smachpy_missions SET changed = {self._now_text()}, beat_clock = ?, "
            "beat_ns = ? WHERE id = ?",
            *(self._steady(), beat_ns, mission),
        )

    def read(self, id: str) -> tuple[bytes | None, list[bytes]]:  # noqa: A002

        def work(cursor: Cursor, _: bool) -> tuple[Any, list[Any]]:
            # In PostgreSQL each statement sees what is committed by then; the locked row keeps a
            # runner from compacting between the two below.
            self._known(cursor, id, "id" + self.dialect.for_share)
            snapshot = self._one(
                cursor, "SELECT n, crc, data FROM smachpy_snapshots WHERE mission = ?", id
            )
            self._do(
                cursor,
                "SELECT n, crc, data FROM smachpy_entries WHERE mission = ? ORDER BY n",
                id,
            )
            return snapshot, cursor.fetchall()

        self._verify_once()
        snapshot, rows = self._transact(work, reads=True)
        kinds = (int, int, bytes)
        expected = 0
        if snapshot is not None:
            if not _are(snapshot, kinds) or zlib.crc32(snapshot[2]) != snapshot[1]:
                raise self._damaged(id, "its snapshot is damaged")
            expected = snapshot[0]
        for row in rows:
            expected += 1
            whole = _are(row, kinds)
            if not whole or row[0] != expected or zlib.crc32(row[2]) != row[1]:
                what = "is missing" if whole and row[0] != expected else "is damaged"
                raise self._damaged(id, f"entry {expected} {what}")
        return None if snapshot is None else snapshot[2], [row[2] for row in rows]

    def blob(self, id: str, digest: str) -> bytes:  # noqa: A002
        sql = "SELECT data FROM smachpy_blobs WHERE mission = ? AND digest = ?"
        row = self._transact(lambda cursor, _: self._one(cursor, sql, id, digest), reads=True)
        if row is None or not _are(row, (bytes,)) or digest_of(row[0]) != digest:
            what = "is missing" if row is None else "is damaged"
            raise self._damaged(id, f"the value {digest:.12} {what}")
        return bytes(row[0])

    def release(self, lease: Lease, status: str | None, *, note: str = "") -> None:

        def work(cursor: Cursor, again: bool) -> None:
            # One statement: no claim can come between check and write.
            released = self._one(
                cursor,
                "UPDATE smachpy_missions SET owner = NULL, mark = NULL, lease_end = NULL, "
                f"status = CASE WHEN {OPEN} THEN COALESCE(?, status) ELSE status END, "
                f"note = CASE WHEN {OPEN} THEN ? ELSE '' END "
                "WHERE id = ? AND fence = ? AND owner = ? RETURNING id",
                *(status, note, lease.mission, lease.fence, lease.runner),
            )
            if released is None:
                try:
                    self._fenced(cursor, lease)
                except FencedError as error:
                    if again and error.runner is None:  # released by the first try
                        return
                    raise
            self._wake(cursor)

        self._transact(work)
        self._written.pop(lease, None)

    # -- resources -----------------------------------------------------------------------------

    def hold(self, lease: Lease, resource: str, state: str, policy: Policy) -> ResourceUse | None:
        mission, urgent = lease.mission, policy == "preempt"

        def work(cursor: Cursor, _: bool) -> ResourceUse | None:
            self._fenced(cursor, lease)
            is_open = f"SELECT 1 FROM smachpy_missions WHERE id = mission AND {OPEN}"
            delete = f"DELETE FROM smachpy_resources WHERE resource = ? AND NOT EXISTS ({is_open})"
            self._do(cursor, delete, resource)
            users = self._users(cursor, resource)
            known = [one.mission for one in users]
            if mission in known:
                ahead = users[: known.index(mission)]
            else:
                ahead = [one for one in users if one.holds or one.urgent or not urgent]
            if ahead and (policy == "refuse" or mission in known):
                return ahead[0]
            place = "(SELECT COALESCE(MAX(place), 0) + 1 FROM smachpy_resources WHERE resource = ?)"
            self._do(
                cursor,
                "INSERT INTO smachpy_resources (resource, mission, state, place, holds, urgent) "
                f"VALUES (?, ?, ?, {place}, ?, ?) ON CONFLICT (resource, mission) DO UPDATE "
                "SET state = excluded.state, holds = excluded.holds, urgent = excluded.urgent",
                *(resource, mission, state, resource, int(not ahead), int(urgent)),
            )
            return ahead[0] if ahead else None

        return self._transact(work)

    def _users(self, cursor: Cursor, resource: str | None = None) -> list[ResourceUse]:
        """Return who holds resources and who waits; of those without a process only holders."""
        self._do(
            cursor,
            f"SELECT r.resource, r.mission, r.state, r.holds, r.urgent, {HELD} "
            "FROM smachpy_resources AS r JOIN smachpy_missions AS m ON m.id = r.mission "
            f"WHERE {OPEN}{'' if resource is None else ' AND r.resource = ?'} "
            "ORDER BY r.resource, r.holds DESC, r.urgent DESC, r.place, r.mission",
            *(() if resource is None else (resource,)),
        )
        rows, now = cursor.fetchall(), self._now(cursor)
        users = []
        for name, mission, state, holds, urgent, *held in rows:
            runner = None if self._may_take(held, now) else held[0]
            if holds or runner is not None:
                use = ResourceUse(name, mission, state, bool(holds), bool(urgent), runner)
                users.append(use)
        return users

    def let_go(self, lease: Lease, resource: str) -> None:

        def work(cursor: Cursor, _: bool) -> None:
            self._fenced(cursor, lease)
            self._do(
                cursor,
                "DELETE FROM smachpy_resources WHERE resource = ? AND mission = ?",
                *(resource, lease.mission),
            )

        self._transact(work)

    def resources(self) -> list[ResourceUse]:
        return self._transact(lambda cursor, _: self._users(cursor), reads=True)

    # -- at the end ----------------------------------------------------------------------------

    def forget(self, id: str) -> None:  # noqa: A002

        def work(cursor: Cursor, again: bool) -> None:
            try:
                held = self._known(cursor, id, HELD + self.dialect.for_update)
            except UnknownMissionError:
                if again:  # deleted by the first try
                    return
                raise
            self._refuse_held(id, held, self._now(cursor))
            self._delete(cursor, [id])
            self._wake(cursor)

        self._transact(work)

    def prune(self, seconds: float, *, keep: Callable[[MissionRow], bool]) -> int:
        self.look()  # a process that was killed after the end of its mission still holds it
        deleted = 0
        after: tuple[float, str] | None = (-math.inf, "")
        while after is not None:
            start = after

            def work(cursor: Cursor, _: bool, start: tuple[float, str] = start) -> Any:
                now = self._now(cursor)
                self._do(
                    cursor,
                    f"SELECT {COLUMNS}, {HELD} FROM smachpy_missions "
                    "WHERE (status = 'ended' OR status = 'cancelled') AND owner IS NULL "
                    "AND changed <= ? AND (changed > ? OR (changed = ? AND id > ?)) "
                    f"ORDER BY changed, id LIMIT {PRUNED_AT_ONCE}",
                    *(now - seconds, start[0], start[0], start[1]),
                )
                rows = [self._row(row, now) for row in cursor.fetchall()]
                gone = [row for row in rows if not (row.problem or keep(row))]
                some = gone[: self._fitting(cursor, [row.id for row in gone])]
                self._delete(cursor, [row.id for row in some])
                last = rows[-1] if len(rows) == PRUNED_AT_ONCE else None
                last = last if len(some) == len(gone) else some[-1]
                return len(some), None if last is None else (last.changed, last.id)

            begun = current_clock().now()
            count, after = self._transact(work)
            deleted += count
            self._give_way(begun)
        if deleted:
            self._shrink()
        return deleted

    def _fitting(self, _: Cursor, ids: Sequence[str]) -> int:
        """Return how many of these missions, from the first, one transaction is to delete."""
        return len(ids)

    def _give_way(self, begun: float) -> None:  # noqa: ARG002
        """Let others write after a long transaction, which began at that time of the clock."""
        return

    def _shrink(self) -> None:
        """Give freed space back to the system, if the database does not do it itself."""
        return

    def _delete(self, cursor: Cursor, ids: Sequence[str]) -> None:
        for table, key in (
            ("entries", "mission"),
            ("snapshots", "mission"),
            ("blobs", "mission"),
            ("resources", "mission"),
            ("missions", "id"),
        ):
            self._do_many(
                cursor, f"DELETE FROM smachpy_{table} WHERE {key} = ?", ((one,) for one in ids)
            )

    def begin_next(self, row: MissionRow, *, due: float | None, next_due: float) -> bool:

        def work(cursor: Cursor, again: bool) -> bool:
            if again:
                found = self._one(cursor, "SELECT 1 FROM smachpy_missions WHERE id = ?", row.id)
                if found is not None:  # created by the first try
                    return True
            schedule = self._one(
                cursor,
                "SELECT status, due FROM smachpy_missions WHERE id = ?" + self.dialect.for_update,
                row.schedule,
            )
            # Another runner has seen the same schedule and was faster: it has moved `due`.
            if schedule is None or tuple(schedule) != (QUEUED, due):
                return False
            now = self._now(cursor)
            # The clock may have been put back, or the schedule forgotten and made again: then this
            # due time has had its mission, and only the next one counts.
            self._insert(cursor, row, now, " ON CONFLICT (id) DO NOTHING RETURNING id")
            begun = cursor.fetchone() is not None
            self._wake(cursor)
            self._do(
                cursor,
                "UPDATE smachpy_missions SET due = ?, changed = ? WHERE id = ?",
                *(next_due, now, row.schedule),
            )
            return begun

        return self._transact(work)

    def request_cancel(self, id: str) -> None:  # noqa: A002

        def work(cursor: Cursor, again: bool) -> None:
            (status,) = self._known(cursor, id, "status" + self.dialect.for_update)
            if status in OVER and not again:
                raise MissionOverError(self.where, id, status)
            self._do(cursor, "UPDATE smachpy_missions SET cancel = 1 WHERE id = ?", id)
            if status == QUEUED:  # perhaps reserved: the process that was started finds it over
                self._do(
                    cursor,
                    "UPDATE smachpy_missions SET status = 'cancelled', owner = NULL, mark = NULL, "
                    "changed = ? WHERE id = ?",
                    *(self._now(cursor), id),
                )
                self._wake(cursor)

        self._transact(work)

    def listen(self, on_news: Callable[[], object]) -> Callable[[], object] | None:
        del on_news
        return None

    def _verify_once(self) -> None:
        if not self._verified:
            self._transact(lambda cursor, _: self._verify(cursor), reads=True)
            self._verified = True

    @abstractmethod
    def _verify(self, cursor: Cursor) -> None:
        """Check that the database file is not damaged, if the database does not check it itself."""

    @abstractmethod
    def close(self) -> None: ...

    # -- their parts --------------------------------------------------------------------------

    def _stamped(self, row: MissionRow, now: float) -> MissionRow:
        """Return a row as it is stored at time `now`."""
        return replace(
            row,
            owner=None,
            robot=row.robot and robot_identity(row.robot),
            drives=row.drives and robot_identity(row.drives),
            created=now,
            changed=now,
        )

    def _insert(self, cursor: Cursor, row: MissionRow, now: float, end: str = "") -> None:
        row = self._stamped(row, now)
        values = {name: getattr(row, name) for name in FIELDS}
        values.update(argv=json.dumps(list(row.argv)), cancel=int(row.cancel))
        values["drives"] = row.held_robot
        waits = row.every is not None or (row.due is not None and row.due > now)
        ready = now if row.due is None else row.due
        self._do(
            cursor,
            f"INSERT INTO smachpy_missions ({COLUMNS}, waits, ready, shape, fence) "
            f"VALUES ({places(values)}, ?, ?, ?, 0){end}",
            *(*values.values(), int(waits), ready, shape_of(row.structure)),
        )

    def _known(self, cursor: Cursor, id_: str, columns: str) -> Any:
        """Return columns of a mission.

        Args:
            cursor: The cursor.
            id_: The mission.
            columns: Their names; an end that locks the row, as in `Dialect`, may follow.

        Raises:
            UnknownMissionError: there is no such mission.
        """
        row = self._one_mission(cursor, id_, columns)
        if row is None:
            raise self._unknown(cursor, id_)
        return row

    def _unknown(self, cursor: Cursor, id_: str) -> UnknownMissionError:
        self._do(cursor, f"SELECT id FROM smachpy_missions ORDER BY created DESC LIMIT {PAGE}")
        return UnknownMissionError(self.where, id_, [str(row[0]) for row in cursor.fetchall()])

    def _compact(
        self, cursor: Cursor, mission: str, last: int, snapshot: bytes, kept: Collection[str]
    ) -> None:
        self._do(
            cursor,
            "INSERT INTO smachpy_snapshots (mission, n, crc, data) VALUES (?, ?, ?, ?) "
            "ON CONFLICT (mission) DO UPDATE SET n = excluded.n, crc = excluded.crc, "
            "data = excluded.data",
            *(mission, last, zlib.crc32(snapshot), snapshot),
        )
        self._do(cursor, "DELETE FROM smachpy_entries WHERE mission = ? AND n <= ?", mission, last)
        named = kept or ("",)  # PostgreSQL refuses an empty list
        self._do(
            cursor,
            f"DELETE FROM smachpy_blobs WHERE mission = ? AND digest NOT IN ({places(named)})",
            *(mission, *named),
        )

    def _refuse_held(self, mission: str, held: Sequence[Any], now: float) -> None:
        if not self._may_take(held, now):
            raise MissionInUseError(self.where, mission, held[0])

    def _take_shared(
        self, cursor: Cursor, mission: str, robot: str | None, group: str | None, now: float
    ) -> None:
        """Take the robot and group of this mission from missions whose runner is gone.

        Raises:
            MissionInUseError: a mission with a living runner uses it.
        """
        for column, name, shared in (
            (ROBOT.format(""), "robot", robot),
            ("grp", "group", group),
        ):
            if shared is None:
                continue
            self._do(
                cursor,
                f"SELECT id, {HELD} FROM smachpy_missions "
                f"WHERE {column} = ? AND id <> ? AND owner IS NOT NULL",
                *(shared, mission),
            )
            for other, *held in cursor.fetchall():
                if not self._may_take(held, now):
                    raise MissionInUseError(self.where, other, held[0], **{name: shared})
                self._free(cursor, other)

    def _fenced(self, cursor: Cursor, lease: Lease) -> tuple[bool, int]:
        """Lock the mission's row; return whether a cancel was requested, and its last entry.

        Raises:
            FencedError: the lease is void.
        """
        # Check and write are one transaction, and the row is locked: a claim cannot come between.
        row = self._one(
            cursor,
            "SELECT fence, owner, cancel, COALESCE("
            "(SELECT MAX(n) FROM smachpy_entries WHERE mission = m.id), "
            "(SELECT n FROM smachpy_snapshots WHERE mission = m.id), 0) "
            "FROM smachpy_missions AS m WHERE id = ?" + self.dialect.for_update,
            lease.mission,
        )
        if row is None or row[0] != lease.fence or row[1] != lease.runner:
            raise FencedError(self.where, lease, row and row[1])
        return bool(row[2]), int(row[3])

    def _damaged(self, mission: str, what: str) -> StoreError:
        return StoreError(
            self.where,
            f"mission {mission!r}: got a damaged journal ({what}); expected an undamaged one. "
            "Nothing was changed. Try a copy, or: smachpy missions forget " + mission,
            reason="corrupt",
        )


def _are(row: Sequence[object], kinds: Sequence[type]) -> bool:
    return all(isinstance(value, kind) for value, kind in zip(row, kinds, strict=True))
