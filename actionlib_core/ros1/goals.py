"""The goals of one bridged action. No threads, no network; time is given.

`GoalsOfServer` is for a server in ROS 1: that forgets a goal 5 s after its end, and would run it
again when a repetition is delivered late. `GoalsOfClients` is for clients in ROS 1: they send a
goal only once, so the bridge repeats it until our server has acknowledged it.
"""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.client import ASK_FIRST_S, MAX_RESEND_DELAY_S, RESEND_FIRST_S
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.states import TERMINAL, Status
from actionlib_core.ros1.backoff import Backoff

if TYPE_CHECKING:
    from collections.abc import Iterable

REMEMBERED = 100_000  # ids, as many as our own servers remember
RESULT_KEPT_S = 60.0  # results are kept for this time, or until they are acknowledged
# A server lists a goal as ended just before it sends the result, on another connection: a busy
# computer may be late with that.
RESULT_COMES_S = 5.0
LISTED_S = 1.0  # a server lists a goal that was passed to it within this time
RESULT_LOST = "the result message itself was lost"
UNKNOWN = "the server in ROS 1 does not list this goal"


class Admission(enum.Enum):
    """What to do with a goal that has arrived."""

    PASS = enum.auto()
    DROP = enum.auto()
    """The server already has it."""
    REPEAT_RESULT = enum.auto()
    """It has ended: send its result again."""


class GoalsOfServer:
    """The goals of a server in ROS 1, from its status lists and results."""

    def __init__(self) -> None:
        self._known = Recent(REMEMBERED)
        self._listed: dict[str, StatusEntry] = {}
        self._results: dict[str, tuple[float, bytes]] = {}
        self._had_result = Recent(REMEMBERED)
        # Goals that were listed as ended and whose result is not here: id -> when, and the status.
        self._ended: dict[str, tuple[float, StatusEntry]] = {}
        self._passed: dict[str, float] = {}  # id -> until when the server may not list it yet
        # A client in this process sends each goal both ways; the copies may arrive in any order.
        self._came_directly = Recent(REMEMBERED)  # and not yet over the network
        self._came_by_network = Recent(REMEMBERED)

    def on_goal(self, goal_id: str) -> Admission:
        """Handle a goal that arrived over the network; it may be a repetition."""
        self._came_by_network.add(goal_id)
        if goal_id in self._came_directly:
            del self._came_directly[goal_id]
            return Admission.DROP
        if goal_id in self._results:
            return Admission.REPEAT_RESULT
        return Admission.DROP if goal_id and goal_id in self._known else Admission.PASS

    def on_direct_goal(self, goal_id: str) -> Admission:
        """Handle a goal from a client in this process; it arrives over the network as well."""
        if goal_id in self._came_by_network:
            return Admission.DROP
        self._came_directly.add(goal_id)
        return Admission.PASS

    def on_passed(self, goal_id: str, now: float) -> None:
        """Note that a goal is being passed to the server."""
        while self._passed and next(iter(self._passed.values())) <= now:
            del self._passed[next(iter(self._passed))]
        self._passed.pop(goal_id, None)  # repeated: the newest is the last
        self._passed[goal_id] = now + LISTED_S

    def on_statuses(self, entries: Iterable[StatusEntry], now: float) -> bool:
        """Handle a status list; return whether it or the list before contains a goal."""
        listed = {entry.id: entry for entry in entries}
        while self._ended and next(iter(self._ended.values()))[0] + RESULT_KEPT_S <= now:
            del self._ended[next(iter(self._ended))]
        for entry in listed.values():
            self._note_known(entry)
            if entry.status in TERMINAL and entry.id not in self._had_result:
                self._ended.setdefault(entry.id, (now, entry))
        news = bool(listed) or bool(self._listed)
        self._listed = listed
        return news

    def on_result(self, entry: StatusEntry, payload: bytes, now: float) -> None:
        """Keep a result; `payload` is the whole message."""
        self._note_known(entry)
        self._had_result.add(entry.id)
        self._ended.pop(entry.id, None)
        while self._results and next(iter(self._results.values()))[0] <= now:
            del self._results[next(iter(self._results))]
        self._results[entry.id] = now + RESULT_KEPT_S, payload

    def on_acknowledged(self, goal_ids: Iterable[str]) -> None:
        """Drop results that their clients have received."""
        for goal_id in goal_ids:
            self._results.pop(goal_id, None)

    def result(self, goal_id: str) -> bytes | None:
        """Return the result message of a goal; None when there is none."""
        kept = self._results.get(goal_id)
        return None if kept is None else kept[1]

    def status(self, goal_id: str, now: float) -> StatusEntry:
        """Return the status of a goal whose result is not here."""
        entry = self._listed.get(goal_id)
        if goal_id in self._ended:
            since, entry = self._ended[goal_id]
            if now < since + RESULT_COMES_S:
                return entry._replace(status=Status.PENDING)  # until it is sure how it ends
        if entry is None:
            if now < self._passed.get(goal_id, now) and goal_id not in self._known:
                return StatusEntry(goal_id, 0, Status.PENDING, "")
            return StatusEntry(goal_id, 0, Status.LOST, UNKNOWN)
        if entry.status in TERMINAL:
            text = f"{entry.text} ({RESULT_LOST})" if entry.text else RESULT_LOST
            return entry._replace(text=text)
        return entry

    def list(self) -> list[StatusEntry]:
        """Return the latest status list."""
        return list(self._listed.values())

    def _note_known(self, entry: StatusEntry) -> None:
        # RECALLING may come from a cancel that overtook its goal: the goal must still be passed.
        if entry.status != Status.RECALLING:
            self._known.add(entry.id)


class Due(NamedTuple):
    """What is to be sent now for the goals of clients in ROS 1.

    Attributes:
        cancel: Ids of goals in `again` that were cancelled. To be sent first, so that the server
            recalls these goals instead of starting them.
        again: Messages of goals that our server has not acknowledged.
        ask: Ids of goals that have ended and whose results have not arrived.
    """

    cancel: list[str]
    again: list[bytes]
    ask: list[str]


class _Sent(Backoff):
    """A goal of a client in ROS 1 that waits for its acknowledgement or result."""

    __slots__ = ("cancelled", "message", "stamp_ns")

    def __init__(self, message: bytes, now: float, first: float, stamp_ns: int = 0) -> None:
        super().__init__(now, first, MAX_RESEND_DELAY_S)
        self.message = message
        self.stamp_ns = stamp_ns
        self.cancelled = False


class GoalsOfClients:
    """The goals of clients in ROS 1, sent to a server of ours."""

    def __init__(self) -> None:
        self._ours = Recent(REMEMBERED)
        self._over = Recent(REMEMBERED)
        self._unacknowledged: dict[str, _Sent] = {}
        self._without_result: dict[str, _Sent] = {}

    def on_goal(self, goal_id: str, message: bytes, stamp_ns: int, now: float) -> None:
        """Note a goal that is being sent to the server."""
        if goal_id and goal_id not in self._ours:  # the server makes an id for one that has none
            self._ours.add(goal_id)
            self._unacknowledged[goal_id] = _Sent(message, now, RESEND_FIRST_S, stamp_ns)

    def on_cancel(self, goal_id: str, stamp_ns: int) -> None:
        """Note a cancel that is being sent: it may be lost like the goals that it is about."""
        everything = not goal_id and not stamp_ns
        for each, sent in self._unacknowledged.items():
            if everything or each == goal_id or 0 < sent.stamp_ns <= stamp_ns:
                sent.cancelled = True

    def on_status(self, entry: StatusEntry, now: float) -> None:
        """Handle the status of a goal in a list of the server."""
        # RECALLING may come from a cancel that overtook its goal: the goal must still be sent.
        if entry.id not in self._ours or entry.status == Status.RECALLING:
            return
        self._unacknowledged.pop(entry.id, None)
        if entry.status in TERMINAL and entry.id not in self._over:
            self._without_result.setdefault(entry.id, _Sent(b"", now, ASK_FIRST_S))

    def on_result(self, goal_id: str) -> bool:
        """Handle a result; return whether to send it to ROS 1, which is done only once.

        The results of other clients' goals are always sent.
        """
        self._unacknowledged.pop(goal_id, None)
        self._without_result.pop(goal_id, None)
        if goal_id in self._over:
            return False
        if goal_id in self._ours:
            self._over.add(goal_id)
        return True

    def drop_unacknowledged(self) -> None:
        """Stop repeating the goals of a server that died: it may have started them."""
        self._unacknowledged.clear()

    def is_ours(self, goal_id: str) -> bool:
        """Return whether a goal came from a client in ROS 1."""
        return goal_id in self._ours

    def next_due(self) -> float | None:
        """Return when `take_due` is to be called next [s]; None: not before another change."""
        groups = self._unacknowledged, self._without_result
        return min((sent.due for group in groups for sent in group.values()), default=None)

    def take_due(self, now: float) -> Due:
        """Return what is to be sent now, and begin the next pauses."""
        again = [each for each in self._unacknowledged.items() if each[1].is_due(now)]
        return Due(
            [goal_id for goal_id, sent in again if sent.cancelled],
            [sent.message for _, sent in again],
            [goal_id for goal_id, sent in self._without_result.items() if sent.is_due(now)],
        )
