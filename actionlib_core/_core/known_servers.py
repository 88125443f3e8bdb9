"""The servers of one action as a client knows them: who is there, away, or about to leave.

Pure: no threads, no time; whoever holds it calls one method at a time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from actionlib_core._core.client_goal import UNLISTED_S
from actionlib_core._core.recent import Recent
from actionlib_core.presence import token_key

if TYPE_CHECKING:
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.presence import Endpoint

REMEMBERED = 1024  # sessions of servers that were there


class Appearance(NamedTuple):
    """What the token of a server of our type means.

    Attributes:
        returned: The server was away and is here again, with its goals.
        replaced: Those that were away and will not come back: another has their place.
    """

    returned: bool
    replaced: list[Endpoint]


class KnownServers:
    """The servers of one action.

    Attributes:
        current: The action's server, None while there is none of our type.
        token: Its token, which goals name; "" when there is none, or more than one: of two one is
            about to give way, or is dead and its token outlasts it until a lease is over. Which
            one cannot be told.
        away: Server whose token vanished -> until when it may come back [s].
    """

    def __init__(self) -> None:
        self.current: Endpoint | None = None
        self.token = ""
        self.away: dict[Endpoint, float] = {}
        self._there: dict[Endpoint, TypeMismatchError | None] = {}
        self._leaving: set[Endpoint] = set()
        self._met = Recent(REMEMBERED)
        self._foreign_until = 0.0

    def appear(self, server: Endpoint, error: TypeMismatchError | None) -> Appearance:
        """Take the token of a server; `error` is what is wrong with its type."""
        self._there[server] = error
        self._meet(server)
        self._choose()
        if error is not None:
            return Appearance(returned=False, replaced=[])
        returned = self.away.pop(server, None) is not None
        replaced = list(self.away)
        self.away.clear()
        return Appearance(returned, replaced)

    def vanish(self, server: Endpoint) -> bool:
        """Take a token away; return whether it was that of a server of our type."""
        if server not in self._there or self._there.pop(server) is not None:
            return False
        self._choose()
        return True

    def say_farewell(self, server: Endpoint) -> None:
        """Note that a server is about to leave: goals go to another one from now on."""
        self._meet(server)
        if server in self._there:
            self._leaving.add(server)
            self._choose()

    def has_said_farewell(self, server: Endpoint) -> bool:
        """Tell whether a server has named the goals that are with it, before it leaves."""
        return server in self._leaving

    def expect_back(self, server: Endpoint, until: float) -> None:
        """Give a server whose token vanished some time: its link may be cut for a moment."""
        self.away[server] = until

    def take_overdue(self, now: float) -> list[Endpoint]:
        """Return, and expect no more, those that have been away too long."""
        overdue = [server for server, until in self.away.items() if until <= now]
        for server in overdue:
            del self.away[server]
        return overdue

    def forget(self, server: Endpoint) -> set[str]:
        """Forget a server that will not come back.

        Returns:
            The sessions whose goals are lost with it; "" is that of goals sent to nobody in
            particular. Those are not with a server that has said farewell, as it has named its
            goals, and need not be lost while another server is there.
        """
        elsewhere = server in self._leaving or self.current is not None
        self._leaving.discard(server)
        return {server.session} if elsewhere else {"", server.session}

    def hear_foreign(self, session: str, now: float) -> bool:
        """Take a status list of a session that shows no token: a bridge may stand for a server.

        The last words of a server that has left do not count.

        Returns:
            Whether somebody is there who was not there before.
        """
        if session in self._met or self.current is not None:
            return False
        new = self._foreign_until <= now
        self._foreign_until = now + UNLISTED_S
        return new

    def may_listen(self, now: float) -> bool:
        """Tell whether a goal may be sent: a server is there, or something that stands for one."""
        return self.current is not None or self._foreign_until > now

    def check_types(self) -> None:
        """Raise the error of a server that has another type, if there is one."""
        for error in self._there.values():
            if error is not None:
                raise error

    def _meet(self, server: Endpoint) -> None:
        """Note that a server is one of ours: it shows a token."""
        self._met.add(server.session)
        self._foreign_until = 0.0

    def _choose(self) -> None:
        """Find the server after a change."""
        fitting = [server for server, error in self._there.items() if error is None]
        there = [server for server in fitting if server not in self._leaving]
        self.current = there[0] if there else None
        self.token = token_key(there[0]) if len(there) == 1 else ""
