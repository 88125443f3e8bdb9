"""Decides what a client requests from a ROS 2 server for one goal, and what the answers mean.

A goal is sent in one request and never blindly repeated, because it may move a robot. When that
request ends without an answer, the result of the same id is requested: a server that has the goal
holds this request until the goal ends, and a server that does not have it says so at once. Only
then may the goal be sent again. A server refuses an id that it already knows, so a refusal of the
second request does not mean that the goal was refused; it is settled in the same way.
"""

from __future__ import annotations

import enum

from actionlib_core.goal.states import Status
from actionlib_core.wire.ros2.goal_states import ENDED, CancelCode, GoalCode, to_status

# A server forgets a goal some time after its end (10 s by default). When it answers "unknown" later
# than this after the goal was sent, the goal may have run and been forgotten, so it is not sent
# again. The same holds once the link was lost: this computer's clock stands still while it sleeps,
# and a server may keep results for a shorter time.
SETTLED_S = 5.0

TEXT_REFUSED = "the server refused the goal"
TEXT_RECALLED = "This goal was canceled before any action server could have it"
TEXT_UNKNOWN = "the action server does not know this goal: it has restarted or forgotten it"
TEXT_UNSETTLED = (
    "the answer to this goal was lost, and the action server does not know it now: it may or may "
    "not have run"
)


class ExchangePhase(enum.Enum):
    """What is known about the whereabouts of a goal."""

    HERE = "no server can have it"
    QUEUED = "it waits for its turn to be sent"
    SENT = "the answer is awaited"
    UNSURE = "there was no answer: it may or may not be at the server"
    TAKEN = "the server has it, or had it"


class Duty:
    """What the owner has to do next, as bits.

    They are plain integers: an `enum.Flag` takes ten times as long for each goal.
    """

    NOTHING = 0
    QUEUE = 0x1
    """Put the goal into the queue, and call `on_sent` when it is sent."""
    ASK = 0x2
    """Request the result; the answer comes when the goal ends."""
    ASK_LATER = 0x4
    """Call `ask_again` after a pause."""
    CANCEL = 0x8
    """Send a cancel request."""
    NOTIFY = 0x10
    """Report its `status` to the client."""
    END = 0x20
    """The goal has ended: deliver its result."""
    REFUSED = 0x40
    """The goal has ended: the server has refused it."""
    RECALLED = 0x80
    """The goal has ended: it was cancelled before any server could have it."""
    UNKNOWN = 0x100
    """The goal has ended: the server has forgotten it, or is another one."""
    UNSETTLED = 0x200
    """The goal has ended: it is unknown whether the server has run it."""
    KEEPS_RUNNING = 0x400
    """The server has refused to cancel the goal."""


ENDS = (
    (Duty.REFUSED, Status.REJECTED, TEXT_REFUSED),
    (Duty.RECALLED, Status.RECALLED, TEXT_RECALLED),
    (Duty.UNKNOWN, Status.LOST, TEXT_UNKNOWN),
    (Duty.UNSETTLED, Status.LOST, TEXT_UNSETTLED),
)
"""The steps that end a goal without a result, with its final status and text."""


class GoalExchange:
    """One goal between its client and a ROS 2 server.

    Args:
        attached: An earlier process has sent it: its result is requested, and it is never sent.

    Attributes:
        phase: See `ExchangePhase`.
        code: The last state that the server has reported, see `GoalCode`. It never decreases.
        asking: A request for its result is open.
        sent_at: When it was last sent [s, clock].

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    __slots__ = (
        "_attached",
        "_cancel_refused",
        "_cancel_wanted",
        "_cancelling",
        "_link_lost",
        "_never_active",
        "_refused",
        "_sendings",
        "_waits",
        "asking",
        "code",
        "phase",
        "sent_at",
    )

    def __init__(self, *, attached: bool = False) -> None:
        self.phase = ExchangePhase.TAKEN if attached else ExchangePhase.HERE
        self.code = GoalCode.UNKNOWN
        self.asking = False
        self.sent_at = 0.0
        self._attached = attached
        self._sendings = 0
        self._link_lost = False  # while the goal may have been at the server
        self._refused = False  # a repeated request was refused, which is not settled yet
        self._waits = False  # the last list seen shows it as accepted
        self._never_active = False
        self._cancel_wanted = False
        self._cancelling = False
        self._cancel_refused = False

    @property
    def status(self) -> Status:
        """The goal's status in the terms of ROS 1."""
        return to_status(self.code, was_active=not self._never_active)

    # -- sending -------------------------------------------------------------------------------

    def want(self) -> int:
        """Start or continue to deliver the goal; called repeatedly until its status is known."""
        if self.phase is ExchangePhase.HERE:
            self.phase = ExchangePhase.QUEUED
            return Duty.QUEUE
        # A cancel that came before the goal has made this object, as if for an attached goal.
        if self._attached and self._cancel_wanted and not self.code:
            return Duty.RECALLED
        if self.phase is ExchangePhase.TAKEN:
            # The state may have arrived before the server's tokens, when it could not be reported.
            return Duty.NOTIFY if self.code else Duty.NOTHING
        return self.ask_again()

    def on_sent(self, now: float) -> None:
        """Note that the request is being sent."""
        self.phase = ExchangePhase.SENT
        self.sent_at = now
        self._sendings += 1

    def on_answer(self, *, accepted: bool) -> int:
        """Handle the answer to the request."""
        if accepted:
            return self._take(GoalCode.ACCEPTED)
        # The first request is not a repetition, and a goal that was executing was not refused.
        if self._sendings == 1 and self.code <= GoalCode.ACCEPTED:
            return Duty.REFUSED
        if self.phase is ExchangePhase.TAKEN:  # the server has it from the first request
            return Duty.NOTHING
        # Either a real refusal, or the first request has arrived after all and this was refused as
        # a repetition. The request for the result tells which.
        self._refused = True
        self.phase = ExchangePhase.UNSURE
        return self.ask_again()

    def on_unanswered(self) -> int:
        """Handle the end of the request without an answer."""
        if self.phase is not ExchangePhase.SENT:
            return Duty.NOTHING
        self.phase = ExchangePhase.UNSURE
        return self.ask_again()

    # -- its state at the server -----------------------------------------------------------------

    def on_state(self, code: int, *, unbroken: bool = False) -> int:
        """Handle its state in a status list of the server.

        A server publishes a list at each change, but lists may be lost. So a cancelled goal counts
        as never executed only if consecutive lists show it first as accepted, then as canceling.

        Args:
            code: See `GoalCode`.
            unbroken: The list before this one was received as well.
        """
        if code not in _STATES:
            return Duty.NOTHING
        if code >= GoalCode.CANCELING > self.code:
            self._never_active = self._waits and unbroken
        self._waits = code == GoalCode.ACCEPTED >= self.code
        return self._take(code)

    def on_feedback(self) -> int:
        """Handle feedback, which shows that it is executing."""
        return self._take(max(self.code, GoalCode.EXECUTING))

    def _take(self, code: int) -> int:
        step = Duty.NOTHING
        # The first sign that the server has the goal: request its result at once, since the server
        # keeps it only for a short time after the end, and send a cancel that had to wait.
        if self.phase is not ExchangePhase.TAKEN:
            self.phase = ExchangePhase.TAKEN
            step |= self.ask_again()
            if self._cancel_wanted and not self._cancelling:
                self._cancelling = True
                step |= Duty.CANCEL
        if code > self.code:  # else the message was overtaken by a newer one
            self.code = GoalCode(code)
            step |= Duty.NOTIFY
        return step

    # -- the result ------------------------------------------------------------------------------

    def ask_again(self) -> int:
        """Request the result, unless a request is open or the server cannot have the goal."""
        if self.asking or self.phase not in {ExchangePhase.UNSURE, ExchangePhase.TAKEN}:
            return Duty.NOTHING
        self.asking = True
        return Duty.ASK

    def on_result(self, code: int, now: float) -> int:
        """Handle the answer to the request for the result."""
        self.asking = False
        if code in ENDED:
            self.code = GoalCode(code)
            return Duty.END
        if code != GoalCode.UNKNOWN:
            return self.on_state(code) | Duty.ASK_LATER
        return self._on_unknown(now)

    def _on_unknown(self, now: float) -> int:
        """Handle the answer that the server does not know the goal."""
        if self.phase is ExchangePhase.TAKEN:  # it knew the goal before
            return Duty.UNKNOWN
        if self._link_lost or now > self.sent_at + SETTLED_S:
            return Duty.UNSETTLED
        if self._refused:
            return Duty.REFUSED
        self.phase = ExchangePhase.HERE
        if self._cancel_wanted:
            return Duty.RECALLED
        return self.want()

    def on_no_result(self) -> int:
        """Handle the end of that request without an answer."""
        self.asking = False
        return Duty.ASK_LATER

    # -- its cancel ------------------------------------------------------------------------------

    def cancel(self, *, again: bool = False) -> int:
        """Cancel the goal; `again`: the client repeats an earlier cancel by itself."""
        if self.phase in {ExchangePhase.HERE, ExchangePhase.QUEUED} and not self._attached:
            return Duty.RECALLED
        self._cancel_wanted = True
        # A goal that may be on its way is cancelled when the server has it, see `_take`.
        if (
            self.phase is not ExchangePhase.TAKEN
            or self._cancelling
            or self.code >= GoalCode.CANCELING
        ):
            return Duty.NOTHING
        if again and self._cancel_refused:
            return Duty.NOTHING
        self._cancelling = True
        return Duty.CANCEL

    def on_cancel_answer(self, code: int, *, listed: bool) -> int:
        """Handle the answer to a cancel request.

        Args:
            code: See `CancelCode`. It is 0 also when a server refuses and lists no goal.
            listed: The goal is in the answer's list of goals that are canceling.
        """
        self._cancelling = False
        if listed:
            return self._take(GoalCode.CANCELING)
        if code in {CancelCode.UNKNOWN_GOAL, CancelCode.GOAL_TERMINATED}:
            return Duty.NOTHING  # the answer to the request for the result will tell how it ended
        self._cancel_refused = True
        return Duty.KEEPS_RUNNING

    def on_no_cancel_answer(self) -> None:
        """Handle the end of a cancel request without an answer: it may be repeated."""
        self._cancelling = False

    def on_link_lost(self) -> None:
        """Handle the loss of the server: open requests will not be answered."""
        self.asking = self._cancelling = False
        if self.phase in {ExchangePhase.SENT, ExchangePhase.UNSURE}:
            self.phase = ExchangePhase.UNSURE
            self._link_lost = True
        elif self.phase is ExchangePhase.QUEUED:
            self.phase = ExchangePhase.HERE


_STATES = frozenset(code.value for code in GoalCode if code is not GoalCode.UNKNOWN)
