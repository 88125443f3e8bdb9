"""The client's rules: the life of one goal, and the servers of its action.

The network may lose messages. So the client repeats a goal until a server has acknowledged it,
repeats a cancel until the server has answered it, and queries the server when it has not heard of a
goal for some time. Repetitions do no harm, because a server runs a goal id only once.

Nothing here reads a clock, takes a lock or sends: the time is an argument and the return values say
what to send.
"""

from __future__ import annotations

import enum
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.life_cycle import client_life_cycle
from actionlib_core.goal.states import OVER, STARTED, TERMINAL, CommState, Status

if TYPE_CHECKING:
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.goal.ports import Server, StatusEntry

RESEND_FIRST_S = 0.5  # delay of the first repetition of a goal or cancel; doubled each time
ASK_FIRST_S = 0.2  # after a final status without a result, query for the result
SILENCE_S = 3.0  # after no message about a goal, query it (servers send a list once a second)
MAX_RESEND_DELAY_S = 2.0  # limit of the doubled delay
SET_NS = 100_000_000  # by a greater difference, the wall clock was set
UNLISTED_S = 5.0  # a goal missing in a tokenless server's lists for this time is LOST

REMEMBERED = 1024  # sessions of former servers
GIVES_WAY_S = 3.0  # of two servers with one name, the younger has stopped within this time
STATUS_LIST_TIMEOUT_S = 5.0  # a server without a token counts as gone after this silence


TEXT_NEVER_SENT = "This goal was canceled before any action server was there"
TEXT_NEVER_TAKEN = "This goal was canceled before any action server had taken it"

# Read for every status of every goal: a dict, a list and sets instead of calls, enum properties
# and chains of comparisons.
_STEPS = client_life_cycle().steps
_NAMES: Final = [status.name for status in Status]
STATUSES: Final = {int(status): status for status in Status}
_AWAITED: Final = frozenset({CommState.WAITING_FOR_RESULT, CommState.WAITING_FOR_CANCEL_ACK})
_UNCANCELLED: Final = frozenset({Status.PENDING, Status.ACTIVE})

Path = tuple[CommState, ...]


class Duty(enum.Flag):
    """The messages to send for a goal now."""

    NOTHING = 0
    GOAL = enum.auto()
    CANCEL = enum.auto()
    ASK = enum.auto()


@dataclass(slots=True, eq=False)
class ClientGoal:
    """One goal as its client sees it.

    Attributes:
        id: The goal's id.
        stamp_ns: When it was sent, by the wall clock [ns since the epoch]; 0 when unknown.
        made_at: The same [s, clock].
        attached: The goal was sent by an earlier process: it is never sent, only queried.
        ack_timeout: Time for the acknowledgement [s]; then the goal is LOST. None: no limit.
        comm: Its state.
        status: The last status from the server; LOST once the goal is lost.
        text: The text of that status, or why the goal is lost.
        result: The result message, None before it has arrived.
        server: Session id of the server that may have the goal; "" when unknown.
        address: The server that it was first sent to; None when it was not sent yet, or to a
            server without a token.
        offered: It was sent and may have reached a server.
        acknowledged: A server has named it in a status.
        begun: The server has accepted it at some time.
        over: It is DONE or LOST.

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    id: str
    stamp_ns: int = 0
    _: KW_ONLY
    made_at: float = 0.0
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

    # -- calls of the program ------------------------------------------------------------------

    def begin(self, now: float) -> Duty:
        """Start following the goal; return what to send."""
        self._due = now + RESEND_FIRST_S
        if self.ack_timeout is not None:
            self.limit_ack(self.ack_timeout, now)
        if not self.attached:
            return Duty.GOAL
        self.offered = True
        return Duty.ASK

    def is_before(self, stamp_ns: int, now: float, now_ns: int) -> bool:
        """Return whether it was sent at or before a time of the wall clock.

        If that clock was set in the meantime, the goal's stamp is read as if it had been right.

        Args:
            stamp_ns: That time [ns since the epoch].
            now: The present time [s, clock].
            now_ns: The same by the wall clock.
        """
        sent_ns = self.stamp_ns
        if not self.attached:
            seen_ns = now_ns - round((now - self.made_at) * 1e9)  # the stamp by the present clock
            sent_ns = seen_ns if abs(seen_ns - sent_ns) > SET_NS else sent_ns
        return 0 < sent_ns <= stamp_ns

    def limit_ack(self, ack_timeout: float | None, now: float) -> None:
        """Set the time for the acknowledgement [s], beginning now; None: no limit."""
        self.ack_timeout = ack_timeout
        self._ack_by = None
        if ack_timeout is not None and not self.acknowledged:
            self._ack_by = now + ack_timeout

    def wait_longer(self, until: float) -> None:
        """Give the acknowledgement time until then [s, clock]: it may not be read yet."""
        if self._ack_by is not None and self.offered:
            self._ack_by = max(until, self._ack_by)

    def on_offered(self, server: str, address: Server | None = None) -> None:
        """Note that the goal is being sent to a server, which may take it."""
        self.offered = True
        if not self.acknowledged:
            self.server, self.address = server, address

    def cancel(self, now: float) -> tuple[Path, Duty]:
        """Cancel the goal; return the states passed and what to send.

        A goal that cannot have reached any server is RECALLED at once.
        """
        path = self._go("cancel")
        if self.over or self.comm is CommState.WAITING_FOR_RESULT:
            return path, Duty.NOTHING
        if not (self.offered or self.attached):
            return path + self.on_result(Status.RECALLED, TEXT_NEVER_SENT, None, now), Duty.NOTHING
        # Until the server answers, `tick` repeats the cancel.
        self._cancelled = True
        self._pause = RESEND_FIRST_S
        self._due = now + self._pause
        return path, Duty.CANCEL

    # -- messages of servers -------------------------------------------------------------------

    def on_entry(self, entry: StatusEntry, session: str, now: float) -> Path | None:
        """Handle a status of the goal; return the states passed, None if there is no such status.

        Args:
            entry: The status.
            session: The server's; "" when unknown.
            now: The time [s, clock].
        """
        status = STATUSES.get(entry.status)
        if status is None:
            return None
        if not self.stamp_ns:  # of an attached goal only the server knows the stamp
            self.stamp_ns = entry.stamp_ns
        path = self.on_status(status, entry.text, now)
        if session and self.acknowledged:  # not a server that has only received the cancel
            self.server = session
        return path

    def on_status(self, status: Status, text: str, now: float) -> Path:
        """Handle a status; return the states passed. An out-of-date status is ignored."""
        if self.over:
            return ()
        if status is Status.LOST:
            return self.lose(text)
        # The server also lists a cancel that arrived before its goal, as RECALLING: that does not
        # show that it has the goal, which must still be sent.
        if status is not Status.RECALLING or self.attached:
            self.acknowledged = True
        self._unlisted_since = self._ack_by = None
        # While a result or the answer to a cancel is awaited, `_due` is the next repetition: the
        # status lists of every second must not put it off. A server without the goal may have
        # listed the cancel, while another has the goal and not the cancel.
        uncancelled = self._cancelled and status in _UNCANCELLED
        if self.acknowledged and self.comm not in _AWAITED and not uncancelled:
            self._due = now + SILENCE_S
        if (self.comm, _NAMES[status]) not in _STEPS:
            return ()
        path = self._go(_NAMES[status])
        # Once a final status is here, repeated or older ones must not replace it.
        if self.comm is not CommState.WAITING_FOR_RESULT or path:
            self.status, self.text = status, text
        if path and self.comm is CommState.WAITING_FOR_RESULT:
            self._pause = ASK_FIRST_S
            self._due = now + ASK_FIRST_S
        return path

    def on_sign_of_life(self, now: float) -> None:
        """Handle an unchanged status of an acknowledged goal: the short way of `on_status`."""
        self._unlisted_since = None
        if self.comm is CommState.ACTIVE:
            self._due = now + SILENCE_S

    def on_result(self, status: Status, text: str, result: object, now: float) -> Path:
        """Handle the result with its final status; return the states passed."""
        if self.over:
            return ()
        # LOST also stands for a number that is not a status.
        if status not in TERMINAL:
            return self.lose(f"the server sent a result with status {status.name}: {text}")
        path = self.on_status(status, text, now)
        # A final status that the table does not allow here comes from a server that breaks ROS's
        # rules. The result is here all the same, and ends the goal.
        if self.comm is not CommState.WAITING_FOR_RESULT:
            self.comm = CommState.WAITING_FOR_RESULT
            path += (self.comm,)
        self.status, self.text, self.result = status, text, result
        return path + self._go("result")

    def on_unlisted(self, now: float, *, answers: bool) -> Path:
        """Handle a status list without this goal.

        Args:
            now: The time [s, clock].
            answers: Whether the server can be queried. One that cannot (it has no token) and does
                not list the goal for `UNLISTED_S` has forgotten it.
        """
        if not self.acknowledged or self.over:
            return ()
        # Not LOST at once: the list may have been made before the server received the goal, or the
        # goal has ended and its result is on the way.
        if self._unlisted_since is None:
            self._unlisted_since = now
            self._due = min(self._due, now + ASK_FIRST_S)
        elif not answers and now - self._unlisted_since > UNLISTED_S:
            return self.lose("the action server no longer lists this goal")
        return ()

    def on_untaken(self, now: float) -> Path:
        """Handle a farewell without this goal: the server has not taken it and never will.

        It will be sent to the next server; a goal that was cancelled is RECALLED at once.
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
        """Handle the reply that the server does not know this goal.

        A goal that was not acknowledged has just not arrived yet: it is sent again.
        """
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
        """When `tick` is to be called next [s, clock]."""
        return self._due if self._ack_by is None else min(self._due, self._ack_by)

    def hurry(self, now: float) -> None:
        """Make repetitions due now: a server has appeared or come back."""
        self._pause = RESEND_FIRST_S
        self._due = now

    def tick(self, now: float, lost_link: str = "") -> tuple[Path, Duty]:
        """Return the states passed and what to send, as time has passed without a message.

        Args:
            now: The time [s, clock].
            lost_link: What connects the client with all servers, if that is lost.
        """
        if self.over:
            return (), Duty.NOTHING
        if self._ack_by is not None and now >= self._ack_by and not self.acknowledged:
            # A copy of the goal may still reach a server, which must not run what is LOST here.
            why = f"no action server took this goal within {self.ack_timeout:g} s"
            why += f", as the link to {lost_link} is lost" if lost_link else ""
            return self.lose(why), Duty.CANCEL if self.offered else Duty.NOTHING
        if now < self._due:
            return (), Duty.NOTHING
        duty = self._missing()
        self._pause = min(self._pause * 2, MAX_RESEND_DELAY_S)
        self._due = now + self._pause
        return (), duty

    def _missing(self) -> Duty:
        if self.attached and not self.acknowledged:
            return Duty.ASK
        if not self.acknowledged:
            # The cancel is sent first, so that the server recalls the goal instead of starting it.
            return Duty.CANCEL | Duty.GOAL if self._cancelled else Duty.GOAL
        waits = self.comm is CommState.WAITING_FOR_CANCEL_ACK or self.status in _UNCANCELLED
        return Duty.CANCEL | Duty.ASK if self._cancelled and waits else Duty.ASK

    def _go(self, event: str) -> Path:
        path = _STEPS[self.comm, event]
        if path:
            self.comm = path[-1]
            self.over = self.comm in OVER
            if not self.begun and not STARTED.isdisjoint(path):
                self.begun = True
        return path


# -- the servers of an action ------------------------------------------------------------------


def _age(server: Server) -> tuple[int, str]:
    return server.age


class Appearance(NamedTuple):
    """The meaning of a server's token that has appeared.

    Attributes:
        returned: The server was away and is back, with its goals.
        replaced: Servers that were away and will not come back, as another has taken their name.
    """

    returned: bool
    replaced: list[Server]


class Receiver(NamedTuple):
    """The server that a goal is sent to.

    Attributes:
        session: Its session.
        server: The server, which the goal message names; None for a server without a token.
    """

    session: str
    server: Server | None


class KnownServers:
    """The servers of one action.

    Attributes:
        current: The action's server, None while there is none of our type; of two the older.
        away: Server whose token vanished -> until when it may come back [s].
        foreign: Session that sends status lists but has no token, such as a bridge -> until when
            it counts as a server unless it sends another list [s].

    Args:
        status_list_timeout: How long one status list lets such a session count as a server [s].

    `_choose` derives `current`, `_fitting` and `_staying` from `_there` and `_leaving`; it runs
    after each change of these two, so that lookups, which are more frequent, only read.
    """

    def __init__(self, status_list_timeout: float = STATUS_LIST_TIMEOUT_S) -> None:
        self.current: Server | None = None
        self.away: dict[Server, float] = {}
        self.foreign: dict[str, float] = {}
        self._status_list_timeout = status_list_timeout
        self._there: dict[Server, TypeMismatchError | None] = {}  # those with a token now
        self._fitting: list[Server] = []  # of those, the servers of our type
        self._staying: list[Server] = []  # of those, the servers that have not said farewell
        self._leaving: set[Server] = set()  # servers that have said farewell
        self._met = Recent(REMEMBERED)  # sessions that have had a token
        self._trusted = Recent(REMEMBERED)  # of those, the sessions with a server of our type
        self._latest = 0.0  # when the newest server of our type appeared [s, clock]

    def appear(
        self, server: Server, error: TypeMismatchError | None, now: float = 0.0
    ) -> Appearance:
        """Handle the token of a server; `error` when it is of another type."""
        self._there[server] = error
        self._meet(server)
        if error is None:
            self._trusted.add(server.session)
            self._latest = now
        self._choose()
        if error is not None:
            return Appearance(returned=False, replaced=[])
        # Only one server can have the name, so the others that were away do not come back.
        returned = self.away.pop(server, None) is not None
        replaced = list(self.away)
        self.away.clear()
        return Appearance(returned, replaced)

    def vanish(self, server: Server) -> bool:
        """Handle a token's end; return whether it was that of a server of our type."""
        if server not in self._there or self._there.pop(server) is not None:
            return False
        self._choose()
        return True

    def say_farewell(self, server: Server) -> None:
        """Note that a server is about to leave: new goals are sent to another one."""
        self._meet(server)
        if server in self._there:
            self._leaving.add(server)
            self._choose()

    def has_said_farewell(self, server: Server) -> bool:
        """Return whether a server has announced its end, and with it the goals it has taken."""
        return server in self._leaving

    def expect_back(self, server: Server, until: float) -> None:
        """Let a server whose token vanished come back: perhaps only its link is interrupted."""
        self.away[server] = until

    def take_overdue(self, now: float) -> list[Server]:
        """Remove and return the servers that have been away too long."""
        overdue = [server for server, until in self.away.items() if until <= now]
        for server in overdue:
            del self.away[server]
        return overdue

    def forget(self, server: Server) -> set[str]:
        """Forget a server that will not come back.

        Returns:
            The sessions whose goals are lost with it. "" stands for goals of which no server is
            known. Those are spared after a farewell, which has named the server's own goals, and
            while there is another server, which may have them.
        """
        elsewhere = server in self._leaving or self.current is not None
        self._leaving.discard(server)
        self._choose()
        return {server.session} if elsewhere else {"", server.session}

    def may_speak(self, session: str) -> bool:
        """Return whether a session's messages about goals are to be accepted.

        While a server of our type has a token, only sessions of servers are accepted, former ones
        included, as their last messages may arrive after the end of their token.
        """
        return session in self._trusted or not self._fitting

    def on_foreign_list(self, session: str, now: float) -> bool:
        """Handle a status list of a session without a token, which may be a bridge to a server.

        Late lists of a server that has left do not count.

        Returns:
            Whether this makes the session a server that was not known before.
        """
        known = session in self.foreign
        if not known and (session in self._met or self._fitting):
            return False
        self.foreign[session] = now + self._status_list_timeout
        return not known

    def take_silent(self, now: float) -> list[str]:
        """Remove and return the sessions without a token that were silent too long."""
        silent = [session for session, until in self.foreign.items() if until <= now]
        for session in silent:
            del self.foreign[session]
        return silent

    def wait_longer(self, until: float) -> None:
        """Give servers time to be heard until then: what they have sent is not read yet."""
        self.away = {server: max(until, end) for server, end in self.away.items()}
        self.foreign = {session: max(until, end) for session, end in self.foreign.items()}

    @property
    def is_there(self) -> bool:
        """Whether the action has a server, with or without a token."""
        return self.current is not None or bool(self.foreign)

    @property
    def conflict(self) -> bool:
        """Whether several servers have a token; all but one of them will stop."""
        return len(self._fitting) > 1

    def find_receiver(self, goal: ClientGoal, now: float) -> Receiver | None:
        """Return the server that a goal is to be sent to now; None: there is none.

        A goal that was sent before is sent to the same server again: another might run it as well.
        Of two servers the younger stops, so the older is chosen. If both are still there after
        `GIVES_WAY_S`, the older one has died: its token stays until Zenoh's lease is over.
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
        """Return the error of a server of another type, unless there is one of our type too.

        A server of our type that is away or about to leave counts as well.
        """
        if self.current is not None or self.foreign or self.away or self._leaving:
            return None
        return next((error for error in self._there.values() if error is not None), None)

    def _meet(self, server: Server) -> None:
        """Note that a session has a token, so that it is none of the `foreign` ones."""
        self._met.add(server.session)
        self.foreign.pop(server.session, None)

    def _choose(self) -> None:
        """Derive the other attributes from `_there` and `_leaving`, which have changed."""
        self._fitting = [server for server, error in self._there.items() if error is None]
        self._staying = [server for server in self._fitting if server not in self._leaving]
        self.current = min(self._staying, key=_age, default=None)
