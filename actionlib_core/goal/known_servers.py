"""The servers of one action as a client knows them: who is there, away, or about to leave.

Pure: no threads, no time; whoever holds it calls one method at a time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.goal.recent import Recent

if TYPE_CHECKING:
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.goal.client import ClientGoal
    from actionlib_core.goal.ports import Server

REMEMBERED = 1024  # sessions of servers that were there
GIVES_WAY_S = 3.0  # of two servers the younger one has gone after this time
STATUS_LIST_TIMEOUT_S = 5.0  # a server without a token is gone when it says nothing for so long


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
        if self.is_there or self.away or self._leaving:
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
