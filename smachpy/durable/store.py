"""The interface of stores, which keep journals of missions; their rows and errors.

A store keeps for each mission one row, its newest snapshot and the entries after that. Writing
needs a lease. Each lease of a mission has a higher fence than the one before, and every write
carries its fence, so a runner that was suspended and continues later can no longer change anything
(a fencing token; M. Kleppmann, "How to do distributed locking", 2016).

A runner reserves a mission before it starts a process for it, and hands that lease to the process,
which claims the mission with it. One mission at a time holds a robot or a group: the database has
an index that refuses a second one.

    store = open_store("journal.db")                      # SQLite
    store = open_store("postgresql://db.example/missions")  # pip install 'smachpy[postgres]'
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Literal, Protocol
from urllib.parse import unquote

from smachpy.exceptions import MissionError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from actionlib_core.resources import Policy

QUEUED: Final = "queued"
RUNNING: Final = "running"
INTERRUPTED: Final = "interrupted"
ENDED: Final = "ended"
CANCELLED: Final = "cancelled"
OVER: Final = (ENDED, CANCELLED)

_SECRETS: Final = frozenset({"password", "sslpassword"})
"""Parameters of a PostgreSQL URL that are shown nowhere."""

PAGE: Final = 1000
"""The most missions that a list has unless more are asked for."""

Reason = Literal["missing", "foreign", "future", "corrupt", "busy", "full", "unreachable", "failed"]
"""Reasons of a `StoreError`:

- `"missing"`: there is no store, and `create` is False
- `"foreign"`: the file is not a journal
- `"future"`: a newer smachpy has written it
- `"corrupt"`: its bytes are damaged, or entries are missing
- `"busy"`: another process keeps it locked
- `"full"`: no space is left
- `"unreachable"`: it cannot be opened, or the server does not answer
- `"failed"`: anything else; see the text
"""


@dataclass(frozen=True)
class Lease:
    """The right to write the journal of one mission.

    Attributes:
        mission: Its id.
        fence: The number of the lease among those of this mission, from 1; only the newest is
            valid.
        runner: The process that holds it, "host:pid".
        beat_ns: The mission's own time at its last sign of life before this lease, as given to
            `append` or `renew` [ns]; None if there was none, or an older smachpy gave it.
        silent: How long ago that was, by the store's clock [s].
    """

    mission: str
    fence: int
    runner: str
    beat_ns: int | None = None
    silent: float = 0.0


@dataclass(frozen=True)
class MissionRow:
    """The record of a mission in a store.

    Attributes:
        id: Its id.
        name: The name of its root.
        target: The file or function that `smachpy run` was given.
        argv: The mission's own arguments.
        status: "queued", "running", "interrupted" (its runner is gone), "ended" or "cancelled".
        outcome: The outcome with which it has ended, else None.
        robot: The robot that it uses, None for any.
        created: The time of its creation, by the store's clock [s since the Unix epoch].
        changed: Its last sign of life, an entry or a renewal of its lease [s since the Unix epoch].
        owner: The runner that holds it, "host:pid", or None.
        structure: The shape of its machine, see `smachpy.durable.structure`.
        version: Version of the entries.
        due: The time from which it may begin [s since the Unix epoch]; None: at once.
        every: For a schedule, its cron expression: each time it is `due`, a mission like it is put
            into the queue. The schedule itself is never run.
        schedule: The id of the schedule that created it, else None.
        cancel: Whether `request_cancel` was called.
        priority: Missions with a higher number begin first.
        not_after: The time from which it is not begun any more, but cancelled [s since the Unix
            epoch]; None: never.
        group: One mission of a group runs at a time; None: it has no group.
        drives: The robot that it moves according to its names, if that is not `robot`.
        note: Why a runner gave it back, else "".
        problem: Why the row cannot be read, a `Reason`, or ""; its other fields are placeholders
            then.
    """

    id: str
    name: str
    target: str
    argv: tuple[str, ...]
    status: str
    outcome: str | None
    robot: str | None
    created: float
    changed: float
    owner: str | None
    structure: bytes
    version: int
    due: float | None = None
    every: str | None = None
    schedule: str | None = None
    cancel: bool = False
    priority: int = 0
    not_after: float | None = None
    group: str | None = None
    drives: str | None = None
    note: str = ""
    problem: str = ""

    @property
    def held_robot(self) -> str | None:
        """The robot that no other mission uses while this one runs; None if it needs none."""
        return self.drives or self.robot

    @property
    def run(self) -> str:
        """A unique name of this run: when a mission has ended, its id may be used again."""
        return f"{self.id} {round(self.created * 1e6)}"


@dataclass(frozen=True)
class ResourceUse:
    """A mission that holds a resource, or waits for it.

    Attributes:
        resource: Its full name.
        mission: The mission's id.
        state: The path of the state that holds or waits.
        holds: Whether it holds the resource; otherwise it waits.
        urgent: Whether it asks the holder to stop, and waits in front of others.
        runner: The process that runs the mission, "host:pid"; None if it was interrupted.
    """

    resource: str
    mission: str
    state: str
    holds: bool
    urgent: bool
    runner: str | None

    def __str__(self) -> str:
        by = f"in process {self.runner}" if self.runner else "interrupted"
        return f"{self.state} of mission {self.mission}, {by}"


@dataclass(frozen=True)
class QueueNews:
    """What a runner learns from one look at a queue.

    Attributes:
        schedules: The schedules that are due.
        cancelled: Ids of missions that were cancelled because their `not_after` has passed.
        next_due: Time until the next mission is due [s]; None if none is.
        next_schedule: Time until the next schedule is due [s]; None if there is none.
        free: Whether a mission waits that may begin or be resumed now, if its robot and group are
            free.
        now: The time of the store's clock [s since the Unix epoch].
    """

    schedules: tuple[MissionRow, ...]
    cancelled: tuple[str, ...]
    next_due: float | None
    next_schedule: float | None
    free: bool
    now: float


class Store(Protocol):
    """Keeps the journals of missions; every method may be called from any thread.

    All methods raise `StoreError` if the store cannot be read or written, and `UnknownMissionError`
    for an unknown id. They block until the disk or the server has answered, at most for the store's
    `patience`.
    """

    def create(self, row: MissionRow) -> MissionRow:
        """Add a mission, and return its row with the store's time in `created` and `changed`.

        Its `owner` is ignored.

        Raises:
            MissionError: the id exists.
        """
        ...

    def start(
        self, row: MissionRow, runner: str, *, seconds: float
    ) -> tuple[MissionRow, Lease] | None:
        """Add a mission and take a lease of it, as `create` and `claim` do, in one transaction.

        Args:
            row: The mission; neither a schedule nor one that is due later.
            runner: This process, `this_runner()`.
            seconds: The duration of the lease without `renew` [s].

        Returns:
            The row, as it was before it was claimed, and the lease; None if the id exists.

        Raises:
            MissionInUseError: a living runner holds a mission that uses its robot or is of its
                group; nothing is added.
        """
        ...

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
        """Return the newest missions, the oldest of them first.

        Args:
            open_only: Omit missions that have ended or were cancelled.
            statuses: Only missions with one of these statuses; empty: any.
            robot: Only missions of this robot; None: any.
            target: Only missions with this target; None: any.
            limit: The most that are returned; None: all.
            skip: Omit this many of the newest ones.
        """
        ...

    def mission(self, id: str) -> MissionRow:  # noqa: A002  the word of the interface
        """Return the row of one mission."""
        ...

    def find(self, id: str) -> MissionRow | None:  # noqa: A002
        """Return the row of one mission; None if there is none of this id."""
        ...

    def holders(self) -> list[MissionRow]:
        """Return the missions that hold their robot and group.

        A process runs them or is about to, or they were interrupted: goals of theirs may still
        drive the robot.
        """
        ...

    def look(self, *, robots: Collection[str] = ()) -> QueueNews:
        """Look at the queue, and free missions, robots and groups of processes that have died.

        Args:
            robots: Only missions of these robots count for `next_due` and `free`; empty: all.
        """
        ...

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
        """Take the mission that comes next, for a process that will `claim` it with the lease.

        Interrupted missions come first, then those with the highest priority, then those that have
        waited longest. A mission whose robot or group another one holds is passed over. The status
        does not change.

        Args:
            runner: This process, `this_runner()`.
            seconds: The duration of the lease [s].
            robots: Only missions of these robots; empty: all missions, with or without a robot.
            leave: Ids of missions that are passed over.
            leave_targets: Targets of missions that are passed over.
            leave_shapes: Targets and structures of missions that are passed over.
        """
        ...

    def claim(
        self,
        id: str,  # noqa: A002
        runner: str,
        *,
        seconds: float,
        reserved: Lease | None = None,
    ) -> Lease:
        """Take a lease of a mission, to begin or resume it; its status becomes "running".

        Args:
            id: The mission.
            runner: This process, `this_runner()`.
            seconds: The duration of the lease without `renew` [s].
            reserved: The lease of the runner that reserved it for this process, if one did.

        Raises:
            MissionInUseError: a living runner holds it, or another mission that uses its robot or
                is of its group.
            MissionOverError: it has ended or was cancelled.
            FencedError: `reserved` is void.
            MissionError: it is a schedule.
        """
        ...

    def renew(self, lease: Lease, *, seconds: float, beat_ns: int | None = None) -> bool:
        """Extend a lease to `seconds` [s] from now.

        Args:
            lease: The lease.
            seconds: Its duration from now on [s].
            beat_ns: The mission's own time, for `Lease.beat_ns` of the next process [ns].

        Returns:
            Whether `request_cancel` was called for the mission.

        Raises:
            FencedError: another runner has taken the mission over.
        """
        ...

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
        """Add entries in one transaction, which is durable when this returns.

        Args:
            lease: The writer's lease.
            entries: The new entries, oldest first.
            snapshot: Replaces all entries including the new ones, which are deleted; None: nothing
                is replaced.
            status: The mission's new status; None: unchanged.
            outcome: The mission's outcome; None: unchanged.
            blobs: Large values that the entries name by their digests: digest -> bytes. One that
                the mission has already is not written again.
            kept: With a snapshot, the digests that it names: other blobs are deleted.
            beat_ns: The mission's own time, as for `renew`; None: unchanged.

        Raises:
            FencedError: another runner has taken the mission over; nothing is written.
        """
        ...

    def read(self, id: str) -> tuple[bytes | None, list[bytes]]:  # noqa: A002
        """Return the newest snapshot, or None, and the entries after it."""
        ...

    def blob(self, id: str, digest: str) -> bytes:  # noqa: A002
        """Return a large value of a mission by its digest."""
        ...

    def release(self, lease: Lease, status: str | None, *, note: str = "") -> None:
        """Give a lease back.

        Args:
            lease: The lease.
            status: The new status of the mission; None, or if it is over: unchanged.
            note: Why it is given back, for `MissionRow.note`; none if the mission is over.

        Raises:
            FencedError: another runner has taken the mission over.
        """
        ...

    def hold(self, lease: Lease, resource: str, state: str, policy: Policy) -> ResourceUse | None:
        """Let a mission hold a resource, or else wait for it, unless the policy is "refuse".

        Who waits calls it again. A mission that was interrupted keeps what it holds, as its goals
        may still use that, until it has ended or is deleted; one whose process has died waits no
        longer.

        Args:
            lease: The mission's lease.
            resource: Its full name.
            state: The path of the state that needs it.
            policy: What to do while another mission holds it.

        Returns:
            Who is in the way; None if the mission holds the resource now.

        Raises:
            FencedError: another runner has taken the mission over.
        """
        ...

    def let_go(self, lease: Lease, resource: str) -> None:
        """Hold a resource no longer, or wait no longer; it may be called again.

        Raises:
            FencedError: another runner has taken the mission over.
        """
        ...

    def resources(self) -> list[ResourceUse]:
        """Return who holds a resource and who waits, by resource, the holder and the next first."""
        ...

    def forget(self, id: str) -> None:  # noqa: A002
        """Delete a mission with its journal.

        Raises:
            MissionInUseError: a living runner holds it.
        """
        ...

    def prune(self, seconds: float, *, keep: Callable[[MissionRow], bool]) -> int:
        """Delete missions that have been over for some time, and return their number.

        Args:
            seconds: For how long [s].
            keep: Returns whether a mission is kept all the same.
        """
        ...

    def size(self) -> tuple[int, int]:
        """Return the number of missions, and the size of the store [bytes]."""
        ...

    def begin_next(self, row: MissionRow, *, due: float | None, next_due: float) -> bool:
        """Put one mission of a schedule into the queue, and set the next due time.

        Args:
            row: The mission to create.
            due: The due time of the schedule as read before [s since the Unix epoch].
            next_due: The next one [s since the Unix epoch].

        Returns:
            Whether this call created it; False if another runner did, the schedule was cancelled,
            or there is a mission of this id already: then only the due time moves.
        """
        ...

    def request_cancel(self, id: str) -> None:  # noqa: A002
        """Request the end of a mission; a queued one is cancelled at once.

        A runner that holds the mission gets the request from `renew`, one that resumes it from
        `MissionRow.cancel`.

        Raises:
            MissionOverError: it has ended or was cancelled before.
        """
        ...

    def listen(self, on_news: Callable[[], object]) -> Callable[[], object] | None:
        """Call `on_news`, in a thread, when something has changed in the queue.

        Returns:
            A function that ends this; None if the database cannot tell: look regularly then.
        """
        ...

    def close(self) -> None:
        """Close the file or the connection; leases are not released. May be called twice."""
        ...


class StoreError(MissionError):
    """A store cannot be opened, read or written.

    Try: see the reason: check the path, the rights, the space on the disk, or the server.

    Attributes:
        where: The file, or the server's URL without its password.
        reason: The reason in one word, see `Reason`.
    """

    def __init__(self, where: str, problem: str, *, reason: Reason) -> None:
        self.where = where
        self.reason = reason
        super().__init__(f"{where}: {problem}")


class UnknownMissionError(MissionError):
    """A store has no mission of this id.

    Try: `smachpy missions list` shows the ids.

    Attributes:
        mission: The id.
        known: The ids of its missions.
    """

    def __init__(self, where: str, mission: str, known: Iterable[str]) -> None:
        self.mission = mission
        self.known = tuple(known)
        hint = did_you_mean(mission, self.known)
        super().__init__(
            f"{where}: mission: got {mission!r}; expected one of its {len(self.known)} missions."
            f"{hint or ' Try: smachpy missions list'}"
        )


class MissionInUseError(MissionError):
    """A living process holds a mission, or another mission of the same robot or group.

    Try: wait for the other mission, or stop its process, which is named.

    Attributes:
        mission: The mission that is held; if the robot or group is in use, the mission that uses
            it.
        runner: The process, "host:pid".
        host, pid: Its two parts.
        robot: The robot, if another mission uses it, else None.
        group: The group, if another mission of it runs, else None.
    """

    def __init__(
        self,
        where: str,
        mission: str,
        runner: str,
        *,
        robot: str | None = None,
        group: str | None = None,
    ) -> None:
        self.mission = mission
        self.runner = runner
        self.host, self.pid = host_and_pid(runner)
        self.robot = robot
        self.group = group
        shared = f"robot {robot!r}" if robot is not None else f"group {group!r}"
        alone = robot is None and group is None
        what = f"mission {mission!r}" if alone else shared
        for_what = "" if alone else f" for mission {mission!r}"
        super().__init__(
            f"{where}: {what}: got one that process {self.pid} on {self.host!r} runs{for_what}; "
            "expected one that no process runs. Try again when that process has ended."
        )


class MissionOverError(MissionError):
    """A mission has ended already or was cancelled.

    Try: start a new mission; `smachpy missions show ID` tells how this one ended.

    Attributes:
        mission: Its id.
        status: "ended" or "cancelled".
    """

    def __init__(self, where: str, mission: str, status: str) -> None:
        self.mission = mission
        self.status = status
        super().__init__(
            f"{where}: mission {mission!r}: got one that is {status}; expected one that can be "
            "resumed. Try to start it anew."
        )


class FencedError(MissionError):
    """This process has lost its lease: another runner took the mission over, or it was deleted.

    Try: nothing: the other runner goes on with the mission. A longer `--lease` bears longer pauses.

    Attributes:
        lease: The lost lease.
        runner: The process that holds the mission now, "host:pid", or None.
    """

    def __init__(self, where: str, lease: Lease, runner: str | None) -> None:
        self.lease = lease
        self.runner = runner
        by = f"{runner} has taken it over" if runner else "it was taken over, released or deleted"
        super().__init__(
            f"{where}: mission {lease.mission!r}: got a write of {lease.runner}, but {by}; "
            "expected one of its holder. This process must not continue the mission."
        )


def store_name(where: str) -> str:
    """Return a store's name for people: its path, or its URL without user and passwords."""
    scheme, mark, rest = where.partition("://")
    if not mark:
        return where
    place, ask, query = rest.partition("?")
    words = [one for one in query.split("&") if unquote(one.partition("=")[0]) not in _SECRETS]
    # The last "@": a password that is not escaped may have others.
    shown = place + (ask + "&".join(words) if words else "")
    return f"{scheme}://{shown.rpartition('@')[2]}"


def for_child(where: str) -> tuple[str, dict[str, str]]:
    """Return a store's address for the command line of a process, which `ps` shows to all users.

    Returns:
        The address without its password, and environment variables with it.
    """
    scheme, mark, rest = where.partition("://")
    place, ask, query = rest.partition("?")
    login, at, host = place.rpartition("@")
    user, _, password = login.partition(":")
    words = []
    for one in query.split("&") if ask else ():
        key, _, value = one.partition("=")
        if unquote(key) == "password":
            password = value
        else:
            words.append(one)
    if not (mark and password):
        return where, {}
    address = f"{scheme}://{user}{at}{host}{'?' if words else ''}{'&'.join(words)}"
    return address, {"PGPASSWORD": unquote(password)}


def host_and_pid(runner: str) -> tuple[str, int]:
    """Split "host:pid".

    Raises:
        ValueError: the text has another form.
    """
    # From the right: the host may be an IPv6 address, with colons in it.
    host, colon, pid = runner.rpartition(":")
    if not colon or not host or not pid.isdecimal():
        raise ValueError(f"runner: got {runner!r}; expected 'host:pid'.")
    return host, int(pid)


def digest_of(data: bytes) -> str:
    """Return the digest by which entries name a large value."""
    return hashlib.blake2b(data, digest_size=20).hexdigest()


def check_lease_seconds(seconds: float) -> None:
    """Check the duration of a lease.

    Raises:
        ValueError: it is not a finite number above 0.
    """
    number = isinstance(seconds, (int, float)) and not isinstance(seconds, bool)
    if not number or not math.isfinite(seconds) or seconds <= 0:
        raise ValueError(f"lease: seconds: got {seconds!r}; expected a number of seconds above 0.")


def may_take(
    holder_lives: bool | None, lease_left: float, *, by_lease: bool, restarted: bool
) -> bool:
    """Return whether a mission may be taken from the process that holds it.

    Args:
        holder_lives: Whether that process is alive; None: unknown.
        lease_left: Time until its lease ends [s].
        by_lease: Whether computers share the store. Then a living process that has stopped renewing
            loses its mission; otherwise it keeps the mission until it ends.
        restarted: Whether its host has the name of this one, which has been restarted since.
    """
    if holder_lives is False:
        return True
    if not by_lease and holder_lives:
        return False
    # One in another container of this computer may be alive, and go on renewing its lease.
    if not by_lease and restarted:
        return True
    return lease_left <= 0
