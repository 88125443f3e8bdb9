"""The graph of ROS 2: our node and its ends as others see them, and who else is there.

Every node shows a token, and every publisher, subscription, service and service client of it
another (`names.Token`). `RosNode` shows ours and watches those of others; `ActionServers` tells
from them which servers of an action are there.
"""

from __future__ import annotations

import contextlib
import itertools
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.wire.ros2.attachment import Numbering
from actionlib_core.wire.ros2.names import (
    DEFAULT,
    ROOT,
    Kind,
    Token,
    action_names,
    data_key,
    gid_of,
    parse_token,
    token_key,
    token_pattern,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.transport import Closable, Presence, Transport
    from actionlib_core.wire.ros2.names import Qos

LIST_TIMEOUT_S = 1.0  # longest wait for the network to say who is there


class RosType(NamedTuple):
    """A type as ROS 2 names it on the wire.

    Attributes:
        name: "pkg/kind/Type"; of a service its own name, of an action's part that of the part.
        hash: RIHS01 hash, or `names.HASH_NOT_SUPPORTED`.
    """

    name: str
    hash: str


class End:
    """One end of ours on a ROS 2 network; `RosNode.end` makes it.

    Attributes:
        key: The key on which it meets the others of its name and type.
        token: What it shows.
        gid: What names it in messages and requests, 16 bytes.

    Threads: any.
    """

    def __init__(self, node: RosNode, token: Token) -> None:
        self.token = token
        self.key = data_key(token.domain, token.name, token.type, token.type_hash)
        self._token_key = token_key(token)
        self.gid = gid_of(self._token_key)
        self._numbering = Numbering(self.gid)
        self._node = node
        self._shown: Closable | None = None

    def attachment(self) -> bytes:
        """Return the attachment of the next message or request: no two of them are equal."""
        return self._numbering.take(self._node.clock.time_ns())[1]

    def show(self) -> None:
        """Show the token: what others send may come from now on.

        Raises:
            TransportError: the session is closed.
        """
        if self._shown is None:
            self._shown = self._node.transport.declare_alive(self._token_key)

    def close(self) -> None:
        """Take the token back; a second call does nothing."""
        shown, self._shown = self._shown, None
        if shown is not None:
            shown.close()


class RosNode:
    """A node of ours on a ROS 2 network, with what its ends need.

    Args:
        transport: Its session there, which stays the caller's.
        clock: Gives the times of sending.
        domain: ROS_DOMAIN_ID.
        full_name: The node's name with its namespace, no slash in front.
        ids: Numbers the nodes and ends of the session, from 0; None when no other node uses it.

    Raises:
        ValueError: the domain or the name is none.
        TransportError: the session is closed (from `show`).

    Threads: every method may be called from any thread.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        *,
        domain: int,
        full_name: str,
        ids: Iterator[int] | None = None,
    ) -> None:
        self.transport = transport
        self.clock = clock
        self.domain = domain
        self._ids = ids if ids is not None else itertools.count()
        namespace, _, base = full_name.rpartition("/")
        number = next(self._ids)
        self.token = Token(
            domain, transport.session_id, number, number, Kind.NODE, "", namespace, base
        )
        self._key = token_key(self.token)
        self._shown: Closable | None = None

    @property
    def full_name(self) -> str:
        """The node's name with its namespace, no slash in front."""
        return self.token.full_node

    def show(self) -> None:
        """Show the node itself; its ends show themselves."""
        if self._shown is None:
            self._shown = self.transport.declare_alive(self._key)

    def close(self) -> None:
        """Take the node's own token back; a second call does nothing."""
        shown, self._shown = self._shown, None
        if shown is not None:
            shown.close()

    def end(self, kind: Kind, name: str, ros_type: RosType, qos: Qos = DEFAULT) -> End:
        """Return a new end of the full name `name`, not yet shown to anybody.

        Raises:
            ValueError: a name, type or hash is none.
        """
        token = self.token._replace(
            entity_id=next(self._ids),
            kind=kind,
            name=name,
            type=ros_type.name,
            type_hash=ros_type.hash,
            qos=qos,
        )
        return End(self, token)

    def watch(
        self,
        callback: Callable[[Token, str, bool], None],
        *,
        kind: Kind | None = None,
        name: str | None = None,
    ) -> Closable:
        """Hear of the tokens of this domain: those that are there first, then every change.

        Args:
            callback: Gets what a token says, its key, and whether it is there. It is called on the
                network's threads and must not wait.
            kind: None for every kind.
            name: Full name of a topic or service; None for every one, nodes included.
        """

        def on_presence(presence: Presence) -> None:
            token = parse_token(presence.key)
            if token is not None:
                callback(token, presence.key, presence.alive)

        pattern = token_pattern(self.domain, kind, name=name)
        return self.transport.watch_alive(pattern, on_presence)

    def watch_action(self, name: str, callback: Callable[[Token, str, bool], None]) -> Closable:
        """Hear of the ends of an action, of its servers and of its clients; see `watch`."""
        watches = contextlib.ExitStack()
        try:
            for part in action_names(name):
                watches.callback(self.watch(callback, name=part).close)
        except BaseException:
            watches.close()
            raise
        return watches

    def list_others(self, timeout: float = LIST_TIMEOUT_S) -> list[Token]:
        """Return the tokens of other sessions, in every domain; blocks as `list`."""
        found = (parse_token(key) for key in self.transport.list_alive(f"{ROOT}/**", timeout))
        own = self.token.session
        return [token for token in found if token is not None and token.session != own]

    def list(
        self,
        *,
        kind: Kind | None = None,
        name: str | None = None,
        timeout: float = LIST_TIMEOUT_S,
    ) -> list[Token]:
        """Return what the tokens say that are there now, sorted by key.

        Blocks: until the network has answered, `timeout` [s] at most.
        """
        keys = self.transport.list_alive(token_pattern(self.domain, kind, name=name), timeout)
        found = (parse_token(key) for key in sorted(keys))
        return [token for token in found if token is not None]


class RosServer(NamedTuple):
    """A server of an action: the node whose five tokens are there.

    Attributes:
        session: Id of its network session.
        node: Full name of its node.
        node_id: Number of the node in its session.
        number: How many came before it, as this program saw them; tokens tell no age.
    """

    session: str
    node: str
    node_id: int
    number: int

    @property
    def age(self) -> tuple[int, str]:
        """The greater, the later it came."""
        return self.number, self.session


class Mismatch(NamedTuple):
    """A part of an action of which a server has another type or another definition of it."""

    name: str
    own: RosType
    found: RosType


class ServerChange(NamedTuple):
    """A server that appeared or left, and what does not fit."""

    server: RosServer
    alive: bool
    mismatches: tuple[Mismatch, ...] = ()


class ActionServers:
    """Which servers of one action are there: decides, and does nothing.

    ROS 2 counts a server as there when it shows the three services and two topics of the action. It
    compares their types but not the hashes; where only those differ, nobody ever hears a goal. So
    a server whose tokens differ from ours in either is reported with what differs.

    Args:
        name: The action's full name there.
        parts: The types of the five ends, in the order of `names.ActionNames`.

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    def __init__(
        self, name: str, parts: tuple[RosType, RosType, RosType, RosType, RosType]
    ) -> None:
        self.name = name
        names = action_names(name)
        self._types = dict(zip(names, parts, strict=True))
        services = (names.send_goal, names.cancel_goal, names.get_result)
        self._kinds = {part: Kind.SERVICE if part in services else Kind.PUBLISHER for part in names}
        self._seen: dict[tuple[str, int], set[Token]] = {}
        self._servers: dict[tuple[str, int], RosServer] = {}
        self._numbers: dict[tuple[str, int], int] = {}

    def __len__(self) -> int:
        return len(self._servers)

    def on_token(self, token: Token, *, alive: bool) -> ServerChange | None:
        """Take in a token that appeared or vanished; return what that changes, None for nothing."""
        if self._kinds.get(token.name) is not token.kind:
            return None
        which = token.session, token.node_id
        seen = self._seen.setdefault(which, set())
        if alive:
            seen.add(token)
        else:
            seen.discard(token)
            if not seen:
                del self._seen[which]
        complete = {other.name for other in seen} == set(self._types)
        if complete == (which in self._servers):
            return None
        if not complete:
            return ServerChange(self._servers.pop(which), alive=False)
        number = self._numbers.setdefault(which, len(self._numbers))  # one that returns is the same
        server = RosServer(token.session, token.full_node, token.node_id, number)
        self._servers[which] = server
        return ServerChange(server, alive=True, mismatches=self._mismatches(seen))

    def _mismatches(self, tokens: Iterable[Token]) -> tuple[Mismatch, ...]:
        """Return the parts that have no end of our type and hash."""
        found = {(token.name, RosType(token.type, token.type_hash)) for token in tokens}
        fitting = {name for name, other in found if other == self._types[name]}
        return tuple(
            Mismatch(name, self._types[name], other)
            for name, other in sorted(found)
            if name not in fitting
        )
