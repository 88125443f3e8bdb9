"""One durable mission: starts it or resumes it, renews its lease, and releases it at the end."""

from __future__ import annotations

import contextlib
import math
import os
import uuid
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal

from actionlib_core.clock import current_clock
from actionlib_core.shutdown import AT_EXIT
from smachpy.base.problems import Problems
from smachpy.durable import structure
from smachpy.durable.held import Held
from smachpy.durable.journal import Journal, read_position
from smachpy.durable.opening import open_store
from smachpy.durable.position import VERSION, Position
from smachpy.durable.processes import this_runner
from smachpy.durable.recorder import Recorder, SteadyTime
from smachpy.durable.store import INTERRUPTED, OVER, QUEUED, MissionRow, StoreError
from smachpy.engine.journal import NO_JOURNAL
from smachpy.engine.preempt import asking, request_soon
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from smachpy.durable.store import FencedError, Lease, Store
    from smachpy.machines.container import Container

Outage = Literal["counts", "pauses"]


CANCEL_BY: Final = "smachpy missions"
"""Who asks the machine to stop when the cancel of its mission is requested."""

MAX_NOTE_LENGTH: Final = 300
"""Characters of the reason why a mission was given back that are kept in its row."""

LEASE_S: Final = 15.0
"""Time after the last renewal for which a runner holds its mission [s]."""


class MachineChangedError(MissionError):
    """The machine differs from the one in the journal.

    Try: resume with the former version, or say where it goes on with `migrations=`.

    Attributes:
        mission: The mission's id.
        differences: One text for each difference.
    """

    def __init__(self, mission: str, differences: list[str], way_out: str) -> None:
        self.mission = mission
        self.differences = tuple(differences)
        lines = "".join(f"\n  - {difference}" for difference in differences)
        super().__init__(
            f"mission {mission!r}: machine: got one that differs from the one with which it was "
            f"begun or submitted; expected the same.{lines}\n{way_out}"
        )


class OutageError(MissionError):
    """A journal is older than the mission allows.

    Try: begin anew, or allow a longer `max_outage`.

    Attributes:
        mission: The mission's id.
        outage: Its age [s].
        max_outage: The greatest age allowed [s].
    """

    def __init__(self, mission: str, outage: float, max_outage: float) -> None:
        self.mission = mission
        self.outage = outage
        self.max_outage = max_outage
        super().__init__(
            f"mission {mission!r}: outage: got {outage:.0f} s since the last entry of the journal; "
            f"expected {max_outage:g} at most: a person must check the robot first. Try 'smachpy "
            f"missions resume {mission}', or 'smachpy missions forget {mission}'."
        )


def new_mission(
    machine: Container,
    *,
    mission: str | None = None,
    target: str = "",
    argv: tuple[str, ...] = (),
    robot: str | None = None,
) -> MissionRow:
    """Return the row of a new mission, for `Store.create`."""
    name = machine.name or "SM_ROOT"
    now = current_clock().time_ns() / 1e9
    return MissionRow(
        id=mission or f"{name.lower()}-{uuid.uuid4().hex[:6]}",
        name=name,
        target=target,
        argv=argv,
        status=QUEUED,
        outcome=None,
        robot=robot,
        created=now,
        changed=now,
        owner=None,
        structure=structure.to_bytes(structure.shape_of(machine)),
        version=VERSION,
    )


def run_durable(
    machine: Container,
    journal: str | Path | Store,
    *,
    mission: str | None = None,
    outage: Outage = "counts",
    max_outage: float | None = None,
    migrate: Any = None,
) -> str:
    """Run a machine so that another process can resume it, and return its outcome.

    A mission of this id that has begun and not ended is resumed; otherwise a new one begins.

    Args:
        machine: The root, built by the same code each time.
        journal: A path, a URL of PostgreSQL, or a store.
        mission: The mission's id; None: the machine's name.
        outage: Whether timeouts and pauses between attempts continue while no process runs the
            mission ("counts"), or stop ("pauses").
        max_outage: The greatest age of the journal [s]; None: any age.
        migrate: New paths of states that were renamed or moved: old path -> new path; or a function
            that gets the differences as texts and returns such a mapping, or None to refuse.

    Raises:
        InvalidStateError: `mission` is empty or no text.
        MissionInUseError: a living process runs it.
        MachineChangedError: the machine differs from the journal's, and `migrate` does not map it.
        OutageError: the journal is older than `max_outage`.
        NotDurableError: a value of the userdata cannot be kept.
        StoreError, FencedError: the journal could not be written: the machine was preempted.
        SmachError: as `execute` does.

    Blocks: as `execute` does. SIGTERM, SIGHUP and SIGQUIT end the process as usual (exit code 128
        and the signal's number), but not the mission, which the next call resumes; Ctrl-C preempts
        it.
    """
    problems = Problems("run_durable")
    if mission is not None:
        problems.word("mission", mission)
    problems.raise_all()
    with contextlib.ExitStack() as stack:
        if isinstance(journal, (str, os.PathLike)):
            store = open_store(journal)
            stack.callback(store.close)
        else:
            store = journal
        name = mission or machine.name or "SM_ROOT"
        started = _start(machine, store, name)
        if started is None:
            row = store.find(name)
            if row is not None and row.status in OVER:
                store.forget(name)
                started = _start(machine, store, name)
        with kept_mission(
            machine,
            store,
            name,
            outage=outage,
            max_outage=max_outage,
            migrate=migrate,
            started=started,
        ):
            return machine.execute()


def _start(machine: Container, store: Store, name: str) -> tuple[MissionRow, Lease] | None:
    """Begin a new mission; return None if the store has one of this name."""
    return store.start(new_mission(machine, mission=name), this_runner(), seconds=LEASE_S)


@contextlib.contextmanager
def kept_mission(
    machine: Container,
    store: Store,
    mission: str,
    *,
    outage: Outage = "counts",
    max_outage: float | None = None,
    migrate: Any = None,
    lease_s: float = LEASE_S,
    reserved: Lease | None = None,
    started: tuple[MissionRow, Lease] | None = None,
    on_fenced: Callable[[FencedError], object] | None = None,
    on_suspended: Callable[[str], object] | None = None,
) -> Iterator[Recorder]:
    """Journal the run of `machine` within the block as `mission`, which the store already has.

    The other arguments and the errors are those of `run_durable`. A runner that does not renew its
    lease for `lease_s` [s] loses the mission; if that is infinite, the lease is never renewed and
    requests to cancel are not noticed. `reserved` is the lease of a runner that reserved it for
    this process; `started` is what `Store.start` returned, with a lease of `lease_s`. If another
    runner has taken the mission over, `on_fenced` is called, in any thread, before the machine is
    preempted: the goals belong to that runner now, and must not be cancelled here.

    If a signal suspends the mission, `on_suspended` is called with its name, in any thread, after
    the lease was released. It must return soon: then the process ends.
    """
    if started is not None:
        row, lease = started
    else:
        row = store.mission(mission)
        lease = store.claim(mission, this_runner(), seconds=lease_s, reserved=reserved)
    status, note = QUEUED if row.status == QUEUED else INTERRUPTED, ""
    try:
        # Read only now that the lease is held: before, another runner could still write entries.
        position = read_position(store, mission) if started is None else Position()
        resumed = bool(position.visits)
        time = SteadyTime(current_clock())
        gone_ns = 0
        if resumed:
            since_ns, now_ns = _outage(row, lease, position.data["last_ns"])
            gone_ns, time = now_ns - since_ns, SteadyTime(current_clock(), now_ns)
            if max_outage is not None and gone_ns > max_outage * 1e9:
                raise OutageError(mission, gone_ns / 1e9, max_outage)  # noqa: TRY301
        fitted = _fitted(machine, row, position, migrate)
        if fitted is not position:  # a snapshot, as the entries so far have the old paths
            store.append(lease, [], snapshot=fitted.to_bytes(), kept=fitted.digests())
            position = fitted
        recorder = Recorder(
            machine,
            Journal(store, lease, position, time.now_ns),
            Held(store, lease, row.held_robot),
            row=row,
            resumed=resumed,
            time=time,
            shift_ns=gone_ns if outage == "pauses" else 0,
            gone_ns=gone_ns,
        )
        recorder.on_fenced = on_fenced
        recorder.on_suspend = partial(_suspend, store, lease, on_suspended)
        if resumed:
            recorder.restore()
        data = machine._smachpy
        data.live.journal = recorder
        try:
            # One that an earlier process has passed on is in the journal.
            known = any(one["by"] == CANCEL_BY for one in position.data["preempts"])
            cancel = (row.cancel, known)
            with _renewing(store, lease, lease_s, machine, recorder, cancel):
                yield recorder
        finally:
            data.live.journal = NO_JOURNAL
            if position.data["started_ns"]:  # it has begun; a store keeps the status of an end
                status = INTERRUPTED
        if recorder.broken is not None:
            raise recorder.broken  # noqa: TRY301
    except Exception as error:
        note = note_of(lease.runner, error)
        raise
    finally:
        _release(store, lease, status, note)


def _suspend(
    store: Store, lease: Lease, told: Callable[[str], object] | None, by: str, top: Any
) -> None:
    """Release the lease of a mission that waits for the end of the process; then end that."""
    _release(store, lease, INTERRUPTED)
    if told is not None:
        told(by)
    top.ending.forget(top)
    if by != AT_EXIT and not any(map(_is_durable, top.ending.runs)):
        top.ending.exit_by(by)


def note_of(runner: str, error: Exception) -> str:
    """Return the note of a mission that a process gives back because of an error."""
    reason = str(error).split("\n", 1)[0]
    return f"{runner}: {reason:.{MAX_NOTE_LENGTH}}"


def _release(store: Store, lease: Lease, status: str, note: str = "") -> None:
    """Give the lease back, and set the status and note, which the store does not if it is over."""
    # Fails if the lease is lost or the store is unreachable. The recorder has raised that already;
    # here it would hide the exception of the block, and the next process finds this one gone.
    with contextlib.suppress(MissionError):
        store.release(lease, status, note=note)


def _is_durable(top: Any) -> bool:
    return bool(top.run.journal.is_durable)


def _outage(row: MissionRow, lease: Lease, last_ns: int) -> tuple[int, int]:
    """Return when the outage of a mission began, and the present time, in its own time [ns].

    The outage begins with the last sign of life: an entry (at `last_ns`), or a renewal of the
    lease, as a state may run for hours without an entry. The store's clock tells its length.
    """
    if lease.beat_ns is None:  # an older smachpy wrote it, with times of day
        since_ns, now_ns = max(last_ns, round(row.changed * 1e9)), current_clock().time_ns()
        return (since_ns, now_ns) if now_ns >= since_ns else (last_ns, last_ns)
    since_ns = max(last_ns, lease.beat_ns)
    return since_ns, max(since_ns, lease.beat_ns + round(lease.silent * 1e9))


def _fitted(machine: Container, row: MissionRow, position: Position, migrate: Any) -> Position:
    """Return the position with the paths of `machine`.

    Raises:
        MachineChangedError: the machines differ, and `migrate` does not map all active states.
    """
    if not position.visits and row.schedule is not None:
        return position  # a schedule may be older than the code: it begins with what is here
    new = structure.shape_of(machine)
    try:
        old = position.data.get("structure") or structure.from_bytes(row.structure)
    except ValueError as error:
        raise StoreError(f"mission {row.id!r}", f"{error}", reason="corrupt") from error
    found = structure.differences(old, new)
    if not found:
        return position
    if not position.visits:
        way_out = "Try the code with which it was submitted, or submit it anew."
        raise MachineChangedError(row.id, found, way_out)
    names = migrate(found) if callable(migrate) else migrate
    if not names:
        raise MachineChangedError(
            row.id,
            found,
            "Try the code with which the mission began, '--migrate OLD_PATH=NEW_PATH' for a state "
            f"that has another path now, or 'smachpy missions forget {row.id}'.",
        )
    unknown = sorted(path for path in names.values() if path not in new)
    if unknown:
        raise MissionError(
            f"mission {row.id!r}: migrate: got the paths {unknown}; expected paths of the machine, "
            f"of {sorted(new)}."
        )
    # Other differences are accepted once paths are mapped, but what was active must still exist.
    moved = position.renamed(names)
    missing = structure.missing_paths(moved.visits, new)
    missing += structure.missing_places(moved.markings, new)
    if missing:
        raise MachineChangedError(
            row.id,
            [f"{each}: was active and is missing" for each in missing],
            "Try '--migrate OLD_PATH=NEW_PATH' for each of them.",
        )
    moved.data["structure"] = new
    return moved


@contextlib.contextmanager
def _renewing(
    store: Store,
    lease: Lease,
    lease_s: float,
    machine: Container,
    recorder: Recorder,
    cancel: tuple[bool, bool],
) -> Iterator[None]:
    """Renew the lease while the block runs, and preempt the machine if a cancel is requested.

    `cancel` says whether it is requested already, and whether the machine has got the request.
    """
    clock = current_clock()
    over = clock.event(f"the end of mission {lease.mission}")

    asked, cancelled = cancel

    def preempt() -> None:
        with asking("operator", CANCEL_BY, "cancel"):
            request_soon(machine)

    def renew() -> None:
        nonlocal cancelled
        # Three renewals per lease: one or two may be late before another runner takes over.
        while not over.wait(lease_s / 3):
            try:
                wanted = store.renew(lease, seconds=lease_s, beat_ns=recorder.time.now_ns())
                recorder.held.pass_on()
                if wanted and not cancelled:
                    cancelled = True
                    preempt()
            except Exception as error:  # noqa: BLE001  of any kind: without a lease nothing may run
                recorder.stop(error)
                return

    if asked and not cancelled:  # while no process ran the mission
        cancelled = True
        preempt()
    if math.isinf(lease_s):
        yield
        return
    task = None
    try:  # also around the start: what interrupts that must not leave a thread that renews
        task = clock.spawn(renew, name=f"lease of {lease.mission}")
        yield
    finally:
        over.set()
        if task is not None:
            task.join()
