"""A state in which branches of a concurrence wait for each other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from smachpy.base import log
from smachpy.base.context import current_frame
from smachpy.base.problems import Problems
from smachpy.engine.preempt import on_preempt
from smachpy.exceptions import InvalidStateError
from smachpy.machines.state import State

if TYPE_CHECKING:
    from typing import Unpack

    from actionlib_core.clock import Event
    from smachpy.engine.frame import Frame
    from smachpy.engine.threads import ChildBranch, Group
    from smachpy.events.introspection import Kind
    from smachpy.machines.state import StateOptions
    from smachpy.userdata.user_data import UserData


@dataclass(slots=True, eq=False)
class _Meeting:
    """One meeting at a barrier; all of it needs the run's lock.

    Attributes:
        parties: How many branches it takes.
        waiting: Branch -> the frame of its barrier, and the event that wakes it.
        outcome: The outcome of the barriers; "" while they wait.
        is_told: The outcome is in the journal: whoever waits may end with it.
    """

    parties: int
    waiting: dict[ChildBranch, tuple[Frame, Event]] = field(default_factory=dict)
    outcome: str = ""
    is_told: bool = False

    def tell(self) -> None:
        self.is_told = True
        for _, wake in self.waiting.values():
            wake.set()


class _Meetings:
    """The meetings at which the branches of a group wait now; all of it needs the run's lock."""

    def __init__(self, group: Group) -> None:
        self._group = group
        self._open: dict[str, _Meeting] = {}
        self._last: dict[ChildBranch, _Meeting] = {}  # the branch that came last tells the others

    def join(
        self, name: str, parties: int, branch: ChildBranch, frame: Frame, wake: Event
    ) -> _Meeting:
        """Let a branch wait; if it is the last one, the meeting has its outcome."""
        meeting, most = self._open.get(name) or _Meeting(parties), len(self._group.branches)
        where = f"{frame.here()}: barrier {name!r}: parties: got {parties}"
        if meeting.parties != parties:
            raise InvalidStateError(f"{where}; expected {meeting.parties}, as in another branch.")
        if parties > most:
            raise InvalidStateError(f"{where}; expected at most {most}, as there are branches.")
        self._open[name] = meeting
        meeting.waiting[branch] = frame, wake
        if len(meeting.waiting) == parties:
            meeting.outcome = "done"
            self._last[branch] = meeting
            del self._open[name]
        else:
            self.branch_ended()
        return meeting

    def leave(self, branch: ChildBranch) -> None:
        """Let a branch no longer wait at a meeting that has no outcome."""
        last = self._last.pop(branch, None)
        if last is not None and not last.is_told:  # it was interrupted before it could tell
            last.tell()
        for name, meeting in list(self._open.items()):
            meeting.waiting.pop(branch, None)
            if not meeting.waiting:
                del self._open[name]

    def branch_ended(self) -> None:
        """End the meetings to which too few branches can still come.

        Those that wait at another barrier cannot: else two could wait for each other for ever.
        """
        waiting = {branch for meeting in self._open.values() for branch in meeting.waiting}
        free = sum(branch not in waiting for branch in self._group.running())
        for name, meeting in list(self._open.items()):
            if len(meeting.waiting) + free < meeting.parties:
                meeting.outcome = "aborted"
                del self._open[name]
                meeting.tell()


class Barrier(State):
    """Waits until `parties` branches of a concurrence are at the barrier of this name.

    Outcomes: 'done', 'aborted' (too few branches are left that can still come: one has ended, or
    waits at another barrier), 'preempted'.

    Each branch has an instance of its own. Those of one name belong together within the nearest
    concurrence above. It may be met again and again. In a durable run all of them have met, or
    none has, wherever the process was killed.

    Args:
        name: Name of the barrier.
        parties: How many branches must come, >= 2.
        **options: See `StateOptions`; with a `timeout` it waits that long at most.

    Raises:
        InvalidStateError: an argument is wrong; when it runs: there is no concurrence above, it has
            fewer branches than `parties`, or another number at the barrier of this name.
    """

    def __init__(self, name: str, parties: int = 2, **options: Unpack[StateOptions]) -> None:
        problems = Problems("Barrier")
        self.__name = problems.word("name", name)
        expected = "a whole number of branches >= 2"
        self.__parties = problems.whole("parties", parties, 2, expected)
        problems.raise_all()
        super().__init__(outcomes=["done", "aborted", "preempted"], **options)

    def execute(self, userdata: UserData) -> str:
        """Wait for the others.

        Blocks: until all have come, too few can come, or a preempt.
        """
        del userdata
        frame: Any = current_frame()
        branch = _branch_of(frame)
        if branch is None:
            where = "Barrier" if frame is None else frame.here()
            raise InvalidStateError(
                f"{where}: barrier {self.__name!r}: got no concurrence above it; expected it in a "
                "branch of one."
            )
        run, name, siblings = frame.run, self.__name, branch.siblings
        if run.journal.has_met(frame):
            return "done"
        wake = run.clock.event(f"barrier {name} of {siblings.frame.path}")
        forget = on_preempt(self, wake.set)
        try:
            with run.lock:
                meetings = siblings.meetings = siblings.meetings or _Meetings(siblings)
                meeting = meetings.join(name, self.__parties, branch, frame, wake)
                is_last = meeting.outcome == "done"
            if is_last:
                try:
                    run.journal.met([each for each, _ in meeting.waiting.values()])
                finally:
                    with run.lock:
                        meeting.tell()
            wake.wait()
        finally:
            forget()
            with run.lock:
                if siblings.meetings is not None:
                    siblings.meetings.leave(branch)
        while meeting.outcome and not meeting.is_told:  # asked to stop as the last one came
            wake.clear()
            if not meeting.is_told:
                wake.wait()
        if meeting.outcome != "done" and self.preempt_requested():
            return "preempted"  # the others, asked as well, may have ended before this one woke up
        if meeting.outcome == "aborted":
            log.logwarn(
                f"{frame.here()}: barrier {name!r}: got {len(meeting.waiting)} of "
                f"{self.__parties} branches; no other can still come."
            )
        return meeting.outcome or "preempted"  # a request that was withdrawn has woken it

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the name and the number of branches."""
        kind, details = super().describe_details()
        return kind, (("barrier", self.__name), ("parties", str(self.__parties)), *details)


def _branch_of(frame: Any) -> Any:
    """Return the branch of the nearest concurrence above; None if there is none."""
    while frame is not None:
        if frame.is_branch and frame.container._smachpy_kind == "concurrence":
            return frame
        frame = frame.parent
    return None
