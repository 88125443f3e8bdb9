"""What a client knows about one goal, and how it makes sure that the goal and its result arrive.

The client sends a goal again until the server has spoken of it, sends a cancel again until the
server has taken it, and asks for what it has not heard. Being asked twice does no harm: the server
runs a goal id once. Time is an argument everywhere.
"""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Final

from actionlib_core.goal.life_cycle import client_life_cycle
from actionlib_core.goal.states import TERMINAL, CommState, Status

if TYPE_CHECKING:
    from actionlib_core.goal.ports import Server

RESEND_FIRST_S = 0.5  # first repetition of a goal or cancel; then twice as long each time
ASK_FIRST_S = 0.2  # a final status is here and the result is not: ask for it
SILENCE_S = 3.0  # nothing heard of a goal for so long: ask (the server speaks once a second)
LONGEST_S = 2.0  # repetitions are never further apart
UNLISTED_S = 5.0  # the server lists other goals but not this one for so long: it is lost

TEXT_NEVER_SENT = "This goal was canceled before any action server was there"
TEXT_NEVER_TAKEN = "This goal was canceled before any action server had taken it"

_STEPS = client_life_cycle().steps
_NAMES: Final = [status.name for status in Status]
_OVER: Final = frozenset({CommState.DONE, CommState.LOST})
_BEGUN: Final = frozenset({CommState.ACTIVE, CommState.PREEMPTING})

Path = tuple[CommState, ...]


class Duty(enum.Flag):
    """What the client has to send for a goal now."""

    NOTHING = 0
    GOAL = enum.auto()
    CANCEL = enum.auto()
    ASK = enum.auto()


class ClientGoal:
    """One goal as its client sees it.

    Args:
        goal_id: The goal's id.
        stamp_ns: When it was sent [ns since the epoch]; 0 when unknown.
        attached: The goal was sent in an earlier life: it is never sent, only asked for.
        ack_timeout: Without a word from a server for so long [s] the goal is LOST; None: no limit.

    Attributes:
        id: The goal's id.
        stamp_ns: See above.
        comm: Where it stands.
        status: The last thing the server said; LOST once the goal is lost.
        text: What the server said about that, or why the goal is lost.
        result: The result message, once it is here.
        server: Session id of the server that may have the goal; "" when unknown.
        address: The server that it was sent to first; None when it was sent to nobody, or to one
            that does not show itself.
        offered: It may have reached a server.
        acknowledged: A server has spoken of it.
        begun: The server has accepted it, now or before.
        over: It is DONE or LOST.

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    __slots__ = (
        "_ack_by",
        "_cancelled",
        "_due",
        "_pause",
        "_unlisted_since",
        "ack_timeout",
        "acknowledged",
        "address",
        "attached",
        "begun",
        "comm",
        "id",
        "offered",
        "over",
        "result",
        "server",
        "stamp_ns",
        "status",
        "text",
    )

    def __init__(
        self,
        goal_id: str,
        stamp_ns: int = 0,
        *,
        attached: bool = False,
        ack_timeout: float | None = None,
    ) -> None:
        self.id = goal_id
        self.stamp_ns = stamp_ns
        self.attached = attached
        self.ack_timeout = ack_timeout
        self.comm = CommState.WAITING_FOR_GOAL_ACK
        self.status = Status.PENDING
        self.text = ""
        self.result: object = None
        self.server = ""
        self.address: Server | None = None
        self.offered = attached
        self.acknowledged = False
        self.begun = False
        self.over = False
        self._cancelled = False
        self._pause = RESEND_FIRST_S
        self._due = 0.0
        self._ack_by: float | None = None
        self._unlisted_since: float | None = None

    # -- what the user does --------------------------------------------------------------------

    def begin(self, now: float) -> Duty:
        """Start; return what to send."""
        self._due = now + RESEND_FIRST_S
        self.limit_ack(self.ack_timeout, now)
        return Duty.ASK if self.attached else Duty.GOAL

    def limit_ack(self, ack_timeout: float | None, now: float) -> None:
        """Be LOST without a word from a server for so long from now [s]; None: no limit."""
        self.ack_timeout = ack_timeout
        self._ack_by = None
        if ack_timeout is not None and not self.acknowledged:
            self._ack_by = now + ack_timeout

    def on_offered(self, server: str, address: Server | None = None) -> None:
        """Note that the goal was put on the network where a server could take it."""
        self.offered = True
        if not self.acknowledged:
            self.server, self.address = server, address

    def cancel(self, now: float) -> tuple[Path, Duty]:
        """Ask for its end; return the states passed and what to send.

        A goal that cannot have reached any server is recalled on the spot.
        """
        path = self._go("cancel")
        if self.over or self.comm is CommState.WAITING_FOR_RESULT:
            return path, Duty.NOTHING
        if not self.offered:
            return path + self.on_result(Status.RECALLED, TEXT_NEVER_SENT, None, now), Duty.NOTHING
        self._cancelled = True
        self._pause = RESEND_FIRST_S
        self._due = now + self._pause
        return path, Duty.CANCEL

    # -- what arrives --------------------------------------------------------------------------

    def on_status(self, status: Status, text: str, now: float) -> Path:
        """Take a status; return the states passed. One that was overtaken on the way is dropped."""
        if self.over:
            return ()
        if status is Status.LOST:
            return self.lose(text)
        # RECALLING may stand for a cancel that overtook its goal: the goal must still be sent.
        if status is not Status.RECALLING or self.attached:
            self.acknowledged = True
        self._heard(now)
        if (self.comm, _NAMES[status]) not in _STEPS:
            return ()
        path = self._go(_NAMES[status])
        if self.comm is not CommState.WAITING_FOR_RESULT or path:
            self.status, self.text = status, text
        if path and self.comm is CommState.WAITING_FOR_RESULT:
            self._pause = ASK_FIRST_S
            self._due = now + ASK_FIRST_S
        return path

    def on_sign_of_life(self, now: float) -> None:
        """Take a status that says nothing new, of a goal that is acknowledged."""
        self._unlisted_since = None
        if self.comm is CommState.ACTIVE:
            self._due = now + SILENCE_S

    def on_result(self, status: Status, text: str, result: object, now: float) -> Path:
        """Take the result with the final status; return the states passed."""
        if self.over:
            return ()
        if status not in TERMINAL:
            return self.lose(f"the server sent a result with status {status.name}: {text}")
        path = self.on_status(status, text, now)
        if self.comm is not CommState.WAITING_FOR_RESULT:  # a foreign server left states out
            self.comm = CommState.WAITING_FOR_RESULT
            path += (self.comm,)
        self.status, self.text, self.result = status, text, result
        return path + self._go("result")

    def on_unlisted(self, now: float, *, answers: bool) -> Path:
        """Take a status list without this goal.

        Args:
            now: The time [s, clock].
            answers: The server is one that can be asked; a foreign one, that cannot, has forgotten
                the goal.
        """
        if not self.acknowledged or self.over:
            return ()
        if self._unlisted_since is None:
            self._unlisted_since = now
            self._due = min(self._due, now + ASK_FIRST_S)
        elif not answers and now - self._unlisted_since > UNLISTED_S:
            return self.lose("the action server no longer lists this goal")
        return ()

    def on_untaken(self, now: float) -> Path:
        """Take the proof that the server it was offered to never took it and never will.

        The next server gets it; a goal whose cancel was on the way is recalled on the spot.
        """
        if self.acknowledged or self.attached or self.over:
            return ()
        self.offered = False
        self.server, self.address = "", None
        if self._cancelled:
            return self.on_result(Status.RECALLED, TEXT_NEVER_TAKEN, None, now)
        self._pause = RESEND_FIRST_S
        return ()

    def on_unknown(self, text: str) -> Path:
        """Take the server's answer that it has never heard of this goal."""
        return self.lose(text) if self.acknowledged or self.attached else ()

    def lose(self, reason: str) -> Path:
        """Give the goal up; `reason` becomes its text."""
        if self.over:
            return ()
        self.status, self.text = Status.LOST, reason
        return self._go("lose")

    # -- time ----------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        """When `tick` has something to do [s, clock]."""
        return self._due if self._ack_by is None else min(self._due, self._ack_by)

    def hurry(self, now: float) -> None:
        """Make everything due at once: the link is back, or a server has appeared."""
        self._pause = RESEND_FIRST_S
        self._due = now

    def tick(self, now: float) -> tuple[Path, Duty]:
        """Return the states passed and what is to be sent because nothing was heard."""
        if self.over:
            return (), Duty.NOTHING
        if self._ack_by is not None and now >= self._ack_by and not self.acknowledged:
            return self.lose(f"no action server took this goal within {self.ack_timeout:g} s"), (
                Duty.CANCEL if self.offered else Duty.NOTHING
            )
        if now < self._due:
            return (), Duty.NOTHING
        duty = self._missing()
        self._pause = min(self._pause * 2, LONGEST_S)
        self._due = now + self._pause
        return (), duty

    def _missing(self) -> Duty:
        if self.attached and not self.acknowledged:
            return Duty.ASK
        if not self.acknowledged:
            # The cancel goes first, so that the server recalls the goal instead of starting it.
            return Duty.CANCEL | Duty.GOAL if self._cancelled else Duty.GOAL
        if self._cancelled and self.comm is CommState.WAITING_FOR_CANCEL_ACK:
            return Duty.CANCEL | Duty.ASK
        return Duty.ASK

    def _heard(self, now: float) -> None:
        self._unlisted_since = None
        self._ack_by = None
        if self.comm is CommState.WAITING_FOR_RESULT:
            return
        if self.acknowledged and self.comm is not CommState.WAITING_FOR_CANCEL_ACK:
            self._due = now + SILENCE_S

    def _go(self, event: str) -> Path:
        path = _STEPS[self.comm, event]
        if path:
            self.comm = path[-1]
            self.over = self.comm in _OVER
            if not self.begun and not _BEGUN.isdisjoint(path):
                self.begun = True
        return path
