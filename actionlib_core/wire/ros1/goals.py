"""The goals of one action on their way through the bridge. No threads, no network; time is given.

Two sides: goals for a server in ROS 1, which forgets a goal 5 s after its end and would run one
that is delivered late a second time, and goals of clients in ROS 1, which are sent again until our
server has spoken of them.
"""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.client import ASK_FIRST_S, LONGEST_S, RESEND_FIRST_S
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.states import TERMINAL, Status

if TYPE_CHECKING:
    from collections.abc import Iterable

REMEMBERED = 100_000  # ids, as our own servers remember them
KEPT_S = 60.0  # results, until they are acknowledged
RESULT_LOST = "the result message itself was lost"
UNKNOWN = "the server in ROS 1 does not list this goal"


class Verdict(enum.Enum):
    """What to do with a goal."""

    PASS = enum.auto()
    DROP = enum.auto()
    """The server has it."""
    REPEAT_RESULT = enum.auto()
    """It has ended: its result is sent again."""


class GoalsOfServer:
    """The goals of a server in ROS 1, as it speaks of them."""

    def __init__(self) -> None:
        self._known = Recent(REMEMBERED)
        self._listed: dict[str, StatusEntry] = {}
        self._results: dict[str, tuple[float, bytes]] = {}
        self._came_directly = Recent(REMEMBERED)  # and not yet over the network
        self._came_by_network = Recent(REMEMBERED)

    def on_goal(self, goal_id: str) -> Verdict:
        """Take a goal from a client over the network, which may be a repetition."""
        self._came_by_network.add(goal_id)
        if goal_id in self._came_directly:
            del self._came_directly[goal_id]
            return Verdict.DROP
        if goal_id in self._results:
            return Verdict.REPEAT_RESULT
        return Verdict.DROP if goal_id and goal_id in self._known else Verdict.PASS

    def on_direct_goal(self, goal_id: str) -> Verdict:
        """Take a goal from a client in this process, which comes over the network too."""
        if goal_id in self._came_by_network:
            return Verdict.DROP
        self._came_directly.add(goal_id)
        return Verdict.PASS

    def on_statuses(self, entries: Iterable[StatusEntry]) -> bool:
        """Take a status list; return whether it says anything new, or anything at all."""
        listed = {entry.id: entry for entry in entries}
        for entry in listed.values():
            self._hear(entry)
        news = bool(listed) or bool(self._listed)
        self._listed = listed
        return news

    def on_result(self, entry: StatusEntry, payload: bytes, now: float) -> None:
        """Take a result; `payload` is the whole message."""
        self._hear(entry)
        while self._results and next(iter(self._results.values()))[0] <= now:
            del self._results[next(iter(self._results))]
        self._results[entry.id] = now + KEPT_S, payload

    def on_acknowledged(self, goal_ids: Iterable[str]) -> None:
        """Let go of results that their clients have."""
        for goal_id in goal_ids:
            self._results.pop(goal_id, None)

    def result(self, goal_id: str) -> bytes | None:
        """Return the result message of a goal, None when there is none."""
        kept = self._results.get(goal_id)
        return None if kept is None else kept[1]

    def status(self, goal_id: str) -> StatusEntry:
        """Return what to say of a goal without a result."""
        entry = self._listed.get(goal_id)
        if entry is None:
            return StatusEntry(goal_id, 0, Status.LOST, UNKNOWN)
        if entry.status in TERMINAL:
            text = f"{entry.text} ({RESULT_LOST})" if entry.text else RESULT_LOST
            return entry._replace(text=text)
        return entry

    def list(self) -> list[StatusEntry]:
        """Return the latest status list."""
        return list(self._listed.values())

    def _hear(self, entry: StatusEntry) -> None:
        # RECALLING may stand for a cancel that overtook its goal: the goal must still be passed.
        if entry.status != Status.RECALLING:
            self._known.add(entry.id)


class Due(NamedTuple):
    """What is to be sent now for the goals of clients in ROS 1.

    Attributes:
        again: Goals that our server has not spoken of.
        ask: Ids of goals that have ended and whose results are missing.
    """

    again: list[bytes]
    ask: list[str]


class _Sent:
    """One goal of a client in ROS 1 of which something is waited for."""

    __slots__ = ("_pause", "due", "message")

    def __init__(self, message: bytes, now: float, pause: float) -> None:
        self.message = message
        self.due = now + pause
        self._pause = pause

    def is_due(self, now: float) -> bool:
        """Return whether to send now; then it is due again later, each time twice as late."""
        if now < self.due:
            return False
        self._pause = min(2 * self._pause, LONGEST_S)
        self.due = now + self._pause
        return True


class GoalsOfClients:
    """The goals of clients in ROS 1, sent to a server of ours."""

    def __init__(self) -> None:
        self._ours = Recent(REMEMBERED)
        self._over = Recent(REMEMBERED)
        self._unheard: dict[str, _Sent] = {}
        self._without_result: dict[str, _Sent] = {}

    def on_goal(self, goal_id: str, message: bytes, now: float) -> None:
        """Take a goal that was sent to the server."""
        if goal_id and goal_id not in self._ours:  # the server makes an id for one that has none
            self._ours.add(goal_id)
            self._unheard[goal_id] = _Sent(message, now, RESEND_FIRST_S)

    def on_status(self, entry: StatusEntry, now: float) -> None:
        """Take a word of the server about a goal, but for its result."""
        # RECALLING may stand for a cancel that overtook its goal: the goal must still be sent.
        if entry.id not in self._ours or entry.status == Status.RECALLING:
            return
        self._unheard.pop(entry.id, None)
        if entry.status in TERMINAL and entry.id not in self._over:
            self._without_result.setdefault(entry.id, _Sent(b"", now, ASK_FIRST_S))

    def on_result(self, goal_id: str) -> bool:
        """Take a result; return whether a client in ROS 1 is to get it: it may come twice."""
        self._unheard.pop(goal_id, None)
        self._without_result.pop(goal_id, None)
        if goal_id in self._over:
            return False
        if goal_id in self._ours:
            self._over.add(goal_id)
        return True

    def lose_unheard(self) -> None:
        """Give up the goals that a server may have taken before it died without a word."""
        self._unheard.clear()

    def is_ours(self, goal_id: str) -> bool:
        """Return whether a goal came from a client in ROS 1."""
        return goal_id in self._ours

    def next_due(self) -> float | None:
        """Return when `take_due` has something to say [s]; None: not until more comes."""
        groups = self._unheard, self._without_result
        return min((sent.due for group in groups for sent in group.values()), default=None)

    def take_due(self, now: float) -> Due:
        """Return what is to be sent because nothing was heard, and note that it is."""
        return Due(
            [sent.message for sent in self._unheard.values() if sent.is_due(now)],
            [goal_id for goal_id, sent in self._without_result.items() if sent.is_due(now)],
        )
