"""What a client has to ask a ROS 2 server about one goal, and what the answers mean: decides only.

A goal is sent in one request, never blindly repeated. When that ends without an answer, the result
of the same id is asked for: a server that has the goal keeps that question until the goal ends, one
that has not says so at once, and only then the goal may be sent again. A server that knows an id
refuses it, so that a second sending that is refused has to be settled in the same way.
"""

from __future__ import annotations

import enum

from actionlib_core.goal.states import Status
from actionlib_core.wire.ros2.goal_states import ENDED, CancelCode, GoalCode, to_status

# A server may forget a goal some time after its end, 10 s by default. Doubt that is settled later
# than this after the goal was sent is settled no more: it may have run and been forgotten.
SETTLED_S = 5.0


TEXT_REFUSED = "the server refused the goal"
TEXT_RECALLED = "This goal was canceled before any action server could have it"
TEXT_UNKNOWN = "the action server does not know this goal: it has restarted or forgotten it"
TEXT_UNSETTLED = (
    "the answer to this goal was lost, and the action server does not know it now: it may or may "
    "not have run"
)


class Phase(enum.Enum):
    """What is known about where a goal is."""

    HERE = "no server can have it"
    QUEUED = "it waits for its turn to be sent"
    SENT = "the answer is awaited"
    UNSURE = "there was no answer: it may or may not be at the server"
    TAKEN = "the server has it, or had it"


class Step:
    """What is to be done next: bits, as an `enum.Flag` takes ten times as long for each goal."""

    NOTHING = 0
    QUEUE = 0x1
    """Send the goal when it is its turn, and call `on_sent` then."""
    ASK = 0x2
    """Ask for the result; the answer comes when the goal ends."""
    ASK_LATER = 0x4
    """Call `ask_again` after a pause."""
    CANCEL = 0x8
    """Ask for its end."""
    TELL = 0x10
    """Tell the client's goal its `status`."""
    END = 0x20
    """Hand the result on; it is over."""
    REFUSED = 0x40
    """It is over: the server has refused it."""
    RECALLED = 0x80
    """It is over: it was cancelled before any server could have it."""
    UNKNOWN = 0x100
    """It is over: the server has forgotten it, or is another one."""
    UNSETTLED = 0x200
    """It is over: nobody can say whether the server has run it."""
    KEEPS_RUNNING = 0x400
    """The server has refused to cancel it."""


ENDS = (
    (Step.REFUSED, Status.REJECTED, TEXT_REFUSED),
    (Step.RECALLED, Status.RECALLED, TEXT_RECALLED),
    (Step.UNKNOWN, Status.LOST, TEXT_UNKNOWN),
    (Step.UNSETTLED, Status.LOST, TEXT_UNSETTLED),
)
"""The steps with which a goal is over, and its status and text then."""


class GoalExchange:
    """One goal between its client and a ROS 2 server.

    Args:
        attached: It was sent in an earlier life of the program: it is asked for and never sent.

    Attributes:
        phase: See `Phase`.
        code: The last state the server has told, see `GoalCode`.
        asking: The question for its result is open.
        sent_at: When it was last sent [s, clock].

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    __slots__ = (
        "_attached",
        "_cancel_refused",
        "_cancel_wanted",
        "_cancelling",
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
        self.phase = Phase.TAKEN if attached else Phase.HERE
        self.code = GoalCode.UNKNOWN
        self.asking = False
        self.sent_at = 0.0
        self._attached = attached
        self._sendings = 0
        self._refused = False
        self._waits = False  # the last list seen shows it as accepted
        self._never_active = False
        self._cancel_wanted = False
        self._cancelling = False
        self._cancel_refused = False

    @property
    def status(self) -> Status:
        """What a ROS 1 client would be told."""
        return to_status(self.code, was_active=not self._never_active)

    # -- sending -------------------------------------------------------------------------------

    def want(self) -> int:
        """Take the wish that the goal reaches the server, made again while nothing is known."""
        if self.phase is Phase.HERE:
            self.phase = Phase.QUEUED
            return Step.QUEUE
        if self.phase is Phase.TAKEN:
            return Step.TELL if self.code else Step.NOTHING  # it was told while nobody was there
        return self.ask_again()

    def on_sent(self, now: float) -> None:
        """Note that the request goes out."""
        self.phase = Phase.SENT
        self.sent_at = now
        self._sendings += 1

    def on_answer(self, *, accepted: bool) -> int:
        """Take the answer to the request."""
        if accepted:
            return self._take(GoalCode.ACCEPTED)
        if self._sendings == 1 and self.code <= GoalCode.ACCEPTED:
            return Step.REFUSED
        if self.phase is Phase.TAKEN:  # the refusal of a repetition
            return Step.NOTHING
        self._refused = True
        self.phase = Phase.UNSURE
        return self.ask_again()

    def on_unanswered(self) -> int:
        """Take the end of the request without an answer."""
        if self.phase is not Phase.SENT:
            return Step.NOTHING
        self.phase = Phase.UNSURE
        return self.ask_again()

    # -- what the server says of it --------------------------------------------------------------

    def on_state(self, code: int, *, unbroken: bool = False) -> int:
        """Take its state from the list that the server publishes.

        A server publishes one at each change, but late lists may be skipped. So a goal that is
        cancelled was never executing only if lists without a gap say so.

        Args:
            code: See `GoalCode`.
            unbroken: The list before this one was seen, too.
        """
        if code not in _STATES:
            return Step.NOTHING
        if code >= GoalCode.CANCELING > self.code:
            self._never_active = self._waits and unbroken
        self._waits = code == GoalCode.ACCEPTED >= self.code
        return self._take(code)

    def on_feedback(self) -> int:
        """Take feedback, which shows that it runs."""
        return self._take(max(self.code, GoalCode.EXECUTING))

    def _take(self, code: int) -> int:
        step = Step.NOTHING
        if self.phase is not Phase.TAKEN:
            self.phase = Phase.TAKEN
            step |= self.ask_again()
            if self._cancel_wanted and not self._cancelling:
                self._cancelling = True
                step |= Step.CANCEL
        if code > self.code:  # one that was overtaken says nothing new
            self.code = GoalCode(code)
            step |= Step.TELL
        return step

    # -- the result ------------------------------------------------------------------------------

    def ask_again(self) -> int:
        """Return whether to ask for the result now."""
        if self.asking or self.phase not in {Phase.UNSURE, Phase.TAKEN}:
            return Step.NOTHING
        self.asking = True
        return Step.ASK

    def on_result(self, code: int, now: float) -> int:
        """Take the answer to the question for the result."""
        self.asking = False
        if code in ENDED:
            self.code = GoalCode(code)
            return Step.END
        if code != GoalCode.UNKNOWN:
            return self.on_state(code) | Step.ASK_LATER
        return self._on_unknown(now)

    def _on_unknown(self, now: float) -> int:
        """Take the word that the server does not know the goal."""
        if self.phase is Phase.TAKEN:
            return Step.UNKNOWN
        if now > self.sent_at + SETTLED_S:
            return Step.UNSETTLED
        if self._refused:
            return Step.REFUSED
        self.phase = Phase.HERE
        if self._cancel_wanted:
            return Step.RECALLED
        return self.want()

    def on_no_result(self) -> int:
        """Take the end of that question without an answer."""
        self.asking = False
        return Step.ASK_LATER

    # -- its cancel ------------------------------------------------------------------------------

    def cancel(self, *, again: bool = False) -> int:
        """Take the wish that it ends; `again`: nobody wished it anew, it is only repeated."""
        if self.phase in {Phase.HERE, Phase.QUEUED} and not self._attached:
            return Step.RECALLED
        self._cancel_wanted = True
        if self.phase is not Phase.TAKEN or self._cancelling or self.code >= GoalCode.CANCELING:
            return Step.NOTHING
        if again and self._cancel_refused:
            return Step.NOTHING
        self._cancelling = True
        return Step.CANCEL

    def on_cancel_answer(self, code: int, *, listed: bool) -> int:
        """Take the answer to a cancel.

        Args:
            code: See `CancelCode`. It is 0 also where a server has refused and listed nothing.
            listed: The goal is among those that the server says are canceling.
        """
        self._cancelling = False
        if listed:
            return self._take(GoalCode.CANCELING)
        if code in {CancelCode.UNKNOWN_GOAL, CancelCode.GOAL_TERMINATED}:
            return Step.NOTHING  # the answer to the question for the result says what it is
        self._cancel_refused = True
        return Step.KEEPS_RUNNING

    def on_no_cancel_answer(self) -> None:
        """Take the end of a cancel without an answer: it may be repeated."""
        self._cancelling = False

    def on_link_lost(self) -> None:
        """Take the loss of the server: what was asked is answered no more."""
        self.asking = self._cancelling = False
        if self.phase is Phase.SENT:
            self.phase = Phase.UNSURE
        elif self.phase is Phase.QUEUED:
            self.phase = Phase.HERE


_STATES = frozenset(code.value for code in GoalCode if code is not GoalCode.UNKNOWN)
