"""What a client knows: about one goal, and about the servers of its action.

The client sends a goal again until the server has spoken of it, sends a cancel again until the
server has taken it, and asks for what it has not heard. Being asked twice does no harm: the server
runs a goal id once. Time is an argument everywhere.
"""

from __future__ import annotations

import enum
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.life_cycle import client_life_cycle
from actionlib_core.goal.states import TERMINAL, CommState, Status

if TYPE_CHECKING:
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.goal.ports import Server, StatusEntry

RESEND_FIRST_S = 0.5  # first repetition of a goal or cancel; then twice as long each time
ASK_FIRST_S = 0.2  # a final status is here and the result is not: ask for it
SILENCE_S = 3.0  # nothing heard of a goal for so long: ask (the server speaks once a second)
LONGEST_S = 2.0  # repetitions are never further apart
UNLISTED_S = 5.0  # the server lists other goals but not this one for so long: it is lost

REMEMBERED = 1024  # sessions of servers that were there
GIVES_WAY_S = 3.0  # of two servers the younger one has gone after this time
STATUS_LIST_TIMEOUT_S = 5.0  # a server without a token is gone when it says nothing for so long


TEXT_NEVER_SENT = "This goal was canceled before any action server was there"
TEXT_NEVER_TAKEN = "This goal was canceled before any action server had taken it"

_STEPS = client_life_cycle().steps
_NAMES: Final = [status.name for status in Status]
STATUSES: Final = {int(status): status for status in Status}
_OVER: Final = frozenset({CommState.DONE, CommState.LOST})
_AWAITED: Final = frozenset({CommState.WAITING_FOR_RESULT, CommState.WAITING_FOR_CANCEL_ACK})
_BEGUN: Final = frozenset({CommState.ACTIVE, CommState.PREEMPTING})

Path = tuple[CommState, ...]


class Duty(enum.Flag):
    """What the client has to send for a goal now."""

    NOTHING = 0
    GOAL = enum.auto()
    CANCEL = enum.auto()
    ASK = enum.auto()


@dataclass(slots=True, eq=False)
class ClientGoal:
    """One goal as its client sees it.

    Attributes:
        id: The goal's id.
        stamp_ns: When it was sent [ns since the epoch]; 0 when unknown.
        attached: The goal was sent in an earlier life: it is never sent, only asked for.
        ack_timeout: Without a word from a server for so long [s] the goal is LOST; None: no limit.
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

    id: str
    stamp_ns: int = 0
    _: KW_ONLY
    attached: bool = False
    ack_timeout: float | None = None
    comm: CommState = CommState.WAITING_FOR_GOAL_ACK
    status: Status = Status.PENDING
    text: str = ""
    result: object = None
    server: str = ""
    address: Server | None = None
    offered: bool = False
    acknowledged: bool = False
    begun: bool = False
    over: bool = False
    _cancelled: bool = False
    _pause: float = RESEND_FIRST_S
    _due: float = 0.0
    _ack_by: float | None = None
    _unlisted_since: float | None = None

    # -- what the user does --------------------------------------------------------------------

    def begin(self, now: float) -> Duty:
        """Start; return what to send."""
        self._due = now + RESEND_FIRST_S
        if self.ack_timeout is not None:
            self.limit_ack(self.ack_timeout, now)
        if not self.attached:
            return Duty.GOAL
        self.offered = True
        return Duty.ASK

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
        if not (self.offered or self.attached):
            return path + self.on_result(Status.RECALLED, TEXT_NEVER_SENT, None, now), Duty.NOTHING
        self._cancelled = True
        self._pause = RESEND_FIRST_S
        self._due = now + self._pause
        return path, Duty.CANCEL

    # -- what arrives --------------------------------------------------------------------------

    def hear(self, entry: StatusEntry, session: str, now: float) -> Path | None:
        """Take what a server says of the goal; return the states passed, None if it is no status.

        Args:
            entry: What it says.
            session: The server's; "" when unknown.
            now: The time [s, clock].
        """
        status = STATUSES.get(entry.status)
        if status is None:
            return None
        if not self.stamp_ns:  # it was attached to
            self.stamp_ns = entry.stamp_ns
        path = self.on_status(status, entry.text, now)
        if session and self.acknowledged:  # not a server that knows of the cancel only
            self.server = session
        return path

    def on_status(self, status: Status, text: str, now: float) -> Path:
        """Take a status; return the states passed. One that was overtaken on the way is dropped."""
        if self.over:
            return ()
        if status is Status.LOST:
            return self.lose(text)
        # RECALLING may stand for a cancel that overtook its goal: the goal must still be sent.
        if status is not Status.RECALLING or self.attached:
            self.acknowledged = True
        self._unlisted_since = self._ack_by = None
        if self.acknowledged and self.comm not in _AWAITED:
            self._due = now + SILENCE_S
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

    def _go(self, event: str) -> Path:
        path = _STEPS[self.comm, event]
        if path:
            self.comm = path[-1]
            self.over = self.comm in _OVER
            if not self.begun and not _BEGUN.isdisjoint(path):
                self.begun = True
        return path


# -- the servers of an action ------------------------------------------------------------------


def _age(server: Server) -> tuple[int, str]:
    return server.age


class Appearance(NamedTuple):
    """What the token of a server of our type means.

    Attributes:
        returned: The server was away and is here again, with its goals.
        replaced: Those that were away and will not come back: another has their place.
    """

    returned: bool
    replaced: list[Server]


class Receiver(NamedTuple):
    """Whom a goal is sent to.

    Attributes:
        session: Its session.
        server: The server, which the goal names; None for one that does not show itself.
    """

    session: str
    server: Server | None


class KnownServers:
    """The servers of one action.

    Attributes:
        current: The action's server, None while there is none of our type; of two the elder.
        away: Server whose token vanished -> until when it may come back [s].
        foreign: Session that sends status lists and shows no token, a bridge for one -> until when
            it counts as a server without another list [s].

    Args:
        status_list_timeout: That long after its last status list [s].
    """

    def __init__(self, status_list_timeout: float = STATUS_LIST_TIMEOUT_S) -> None:
        self.current: Server | None = None
        self.away: dict[Server, float] = {}
        self.foreign: dict[str, float] = {}
        self._status_list_timeout = status_list_timeout
        self._there: dict[Server, TypeMismatchError | None] = {}
        self._fitting: list[Server] = []  # those there whose type is ours
        self._staying: list[Server] = []  # of them, those that have not said farewell
        self._leaving: set[Server] = set()
        self._met = Recent(REMEMBERED)
        self._trusted = Recent(REMEMBERED)
        self._latest = 0.0  # when the latest server appeared

    def appear(
        self, server: Server, error: TypeMismatchError | None, now: float = 0.0
    ) -> Appearance:
        """Take the token of a server; `error` is what is wrong with its type."""
        self._there[server] = error
        self._meet(server)
        if error is None:
            self._trusted.add(server.session)
            self._latest = now
        self._choose()
        if error is not None:
            return Appearance(returned=False, replaced=[])
        returned = self.away.pop(server, None) is not None
        replaced = list(self.away)
        self.away.clear()
        return Appearance(returned, replaced)

    def vanish(self, server: Server) -> bool:
        """Take a token away; return whether it was that of a server of our type."""
        if server not in self._there or self._there.pop(server) is not None:
            return False
        self._choose()
        return True

    def say_farewell(self, server: Server) -> None:
        """Note that a server is about to leave: goals go to another one from now on."""
        self._meet(server)
        if server in self._there:
            self._leaving.add(server)
            self._choose()

    def has_said_farewell(self, server: Server) -> bool:
        """Return whether a server has named the goals that are with it, before it leaves."""
        return server in self._leaving

    def expect_back(self, server: Server, until: float) -> None:
        """Give a server whose token vanished some time: its link may be cut for a moment."""
        self.away[server] = until

    def take_overdue(self, now: float) -> list[Server]:
        """Return, and expect no more, those that have been away too long."""
        overdue = [server for server, until in self.away.items() if until <= now]
        for server in overdue:
            del self.away[server]
        return overdue

    def forget(self, server: Server) -> set[str]:
        """Forget a server that will not come back.

        Returns:
            The sessions whose goals are lost with it; "" is that of goals sent to nobody in
            particular. Those are not with a server that has said farewell, as it has named its
            goals, and need not be lost while another server is there.
        """
        elsewhere = server in self._leaving or self.current is not None
        self._leaving.discard(server)
        self._choose()
        return {server.session} if elsewhere else {"", server.session}

    def may_speak(self, session: str) -> bool:
        """Return whether to believe what a session says of goals.

        While a server shows its token, only servers are believed: those that are there, and the
        last words of those that were.
        """
        return session in self._trusted or not self._fitting

    def hear_foreign(self, session: str, now: float) -> bool:
        """Take a status list of a session that shows no token: a bridge may stand for a server.

        The last words of a server that has left do not count.

        Returns:
            Whether somebody is there who was not there before.
        """
        known = session in self.foreign
        if not known and (session in self._met or self._fitting):
            return False
        self.foreign[session] = now + self._status_list_timeout
        return not known

    def take_silent(self, now: float) -> list[str]:
        """Return, and count as servers no more, the foreign ones that were silent too long."""
        silent = [session for session, until in self.foreign.items() if until <= now]
        for session in silent:
            del self.foreign[session]
        return silent

    @property
    def is_there(self) -> bool:
        """Whether the action has a server, or something that stands for one."""
        return self.current is not None or bool(self.foreign)

    @property
    def conflict(self) -> bool:
        """Whether several servers show a token, of which one is to stay."""
        return len(self._fitting) > 1

    def find_receiver(self, goal: ClientGoal, now: float) -> Receiver | None:
        """Return to whom a goal is sent now; None: to nobody.

        A goal that was sent before goes to the same server again: another one might run it, too.
        Of two servers the younger gives way; if it does not, the elder has died, and its token
        outlasts it until a lease is over.
        """
        if goal.address:
            return Receiver(goal.server, goal.address)
        sent_to = goal.server if goal.offered else None
        there = self._staying
        if sent_to is not None:
            there = [server for server in there if server.session == sent_to]
        if there:
            server = there[0]
            if len(there) > 1:
                server = (max if now >= self._latest + GIVES_WAY_S else min)(there, key=_age)
            return Receiver(server.session, server)
        if sent_to is not None:
            return Receiver(sent_to, None) if sent_to in self.foreign else None
        return next((Receiver(session, None) for session in self.foreign), None)

    def find_wrong_type(self) -> TypeMismatchError | None:
        """Return the error of a server that has another type, unless there is a right one too.

        One that is away or about to leave is right as well.
        """
        if self.current is not None or self.foreign or self.away or self._leaving:
            return None
        return next((error for error in self._there.values() if error is not None), None)

    def _meet(self, server: Server) -> None:
        """Note that a server is one of ours: it shows a token."""
        self._met.add(server.session)
        self.foreign.pop(server.session, None)

    def _choose(self) -> None:
        """Find the server after a change."""
        self._fitting = [server for server, error in self._there.items() if error is None]
        self._staying = [server for server in self._fitting if server not in self._leaving]
        self.current = min(self._staying, key=_age, default=None)
