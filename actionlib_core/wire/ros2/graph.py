"""The graph of ROS 2: our node and its endpoints as others see them, and those of others.

Each node declares a token, and another one for each of its publishers, subscriptions, services and
service clients (`names.Token`). `RosNode` declares ours and watches the others; `ActionServers`
derives from them which servers of an action are present.
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

LIST_TIMEOUT_S = 1.0  # longest wait for the network to list tokens


class RosType(NamedTuple):
    """The name and hash of a type, as tokens and keys contain them.

    Attributes:
        name: "pkg/kind/Type": for a service the service's own name, for a part of an action that of
            the part.
        hash: RIHS01 hash, or `names.HASH_NOT_SUPPORTED`.
    """

    name: str
    hash: str


class RosEnd:
    """An endpoint of this program on a ROS 2 network, made by `RosNode.end`.

    Attributes:
        key: The key that all endpoints of its name and type use.
        token: The content of its token.
        gid: Identifies it in messages and requests, 16 bytes.

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
        """Return the attachment for the next message or request; each call returns another one."""
        return self._numbering.take(self._node.clock.time_ns())[1]

    def show(self) -> None:
        """Declare the token: from now on others may send messages and requests.

        Raises:
            TransportError: the session is closed.
        """
        if self._shown is None:
            self._shown = self._node.transport.declare_alive(self._token_key)

    def close(self) -> None:
        """Undeclare the token; a second call does nothing."""
        shown, self._shown = self._shown, None
        if shown is not None:
            shown.close()


class RosNode:
    """A node of this program on a ROS 2 network; it makes endpoints and watches tokens.

    Args:
        transport: The session; the caller closes it.
        clock: Gives the time of sending.
        domain: ROS_DOMAIN_ID.
        full_name: The node's name with its namespace, without a slash in front.
        ids: Numbers the nodes and endpoints of the session, from 0; None when this is its only
            node.

    Raises:
        ValueError: the domain or the name is invalid.
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
        number = next(self._ids)  # in a node's own token both ids are the same
        self.token = Token(
            domain, transport.session_id, number, number, Kind.NODE, "", namespace, base
        )
        self._key = token_key(self.token)
        self._shown: Closable | None = None

    @property
    def full_name(self) -> str:
        """The node's name with its namespace, without a slash in front."""
        return self.token.full_node

    def show(self) -> None:
        """Declare the node's own token; endpoints declare theirs."""
        if self._shown is None:
            self._shown = self.transport.declare_alive(self._key)

    def close(self) -> None:
        """Undeclare the node's own token; a second call does nothing."""
        shown, self._shown = self._shown, None
        if shown is not None:
            shown.close()

    def end(self, kind: Kind, name: str, ros_type: RosType, qos: Qos = DEFAULT) -> RosEnd:
        """Return a new endpoint with the full name `name`; its token is not declared yet.

        Raises:
            ValueError: a name, type or hash is invalid.
        """
        token = self.token._replace(
            entity_id=next(self._ids),
            kind=kind,
            name=name,
            type=ros_type.name,
            type_hash=ros_type.hash,
            qos=qos,
        )
        return RosEnd(self, token)

    def watch(
        self,
        callback: Callable[[Token, str, bool], None],
        *,
        kind: Kind | None = None,
        name: str | None = None,
    ) -> Closable:
        """Call a function for each token of this domain that is present, then for every change.

        Args:
            callback: Gets the content of a token, its key, and whether it is present. It is called
                on the network's threads and must not wait.
            kind: None: every kind.
            name: Full name of a topic or service; None: all of them, and nodes.
        """

        def on_presence(presence: Presence) -> None:
            token = parse_token(presence.key)
            if token is not None:
                callback(token, presence.key, presence.alive)

        pattern = token_pattern(self.domain, kind, name=name)
        return self.transport.watch_alive(pattern, on_presence)

    def watch_action(self, name: str, callback: Callable[[Token, str, bool], None]) -> Closable:
        """Watch the endpoints of an action's servers and clients; see `watch`."""
        watches = contextlib.ExitStack()
        try:
            for part in action_names(name):
                watches.callback(self.watch(callback, name=part).close)
        except BaseException:
            watches.close()
            raise
        return watches

    def list_others(self) -> list[Token]:
        """Return the tokens of other sessions, of all domains; blocks as `list`."""
        keys = self.transport.list_alive(f"{ROOT}/**", LIST_TIMEOUT_S)
        found = (parse_token(key) for key in keys)
        own = self.token.session
        return [token for token in found if token is not None and token.session != own]

    def list(
        self,
        *,
        kind: Kind | None = None,
        name: str | None = None,
        timeout: float = LIST_TIMEOUT_S,
    ) -> list[Token]:
        """Return the tokens that are present, sorted by key.

        Blocks: until the network has answered, `timeout` [s] at most.
        """
        keys = self.transport.list_alive(token_pattern(self.domain, kind, name=name), timeout)
        found = (parse_token(key) for key in sorted(keys))
        return [token for token in found if token is not None]


class RosServer(NamedTuple):
    """A server of an action: a node whose five tokens are present.

    Attributes:
        session: Id of its network session.
        node: Full name of its node.
        node_id: Number of the node in its session.
        number: How many servers this program has seen before it; tokens contain no time.
    """

    session: str
    node: str
    node_id: int
    number: int

    @property
    def age(self) -> tuple[int, str]:
        """Sorts servers by their appearance: the later, the greater."""
        return self.number, self.session


class Mismatch(NamedTuple):
    """A part of an action for which a server has another type or another definition."""

    name: str
    own: RosType
    found: RosType


class ServerChange(NamedTuple):
    """A server that appeared or disappeared, and the parts whose types do not fit."""

    server: RosServer
    alive: bool
    mismatches: tuple[Mismatch, ...] = ()


class ActionServers:
    """Derives from tokens which servers of one action are present.

    As in ROS 2, a server is present when it shows the three services and two topics of the action.
    ROS 2 compares their types but not the hashes; where only the hashes differ, the keys differ and
    goals never arrive. So both are compared here, and the differences are reported.

    Args:
        name: The action's full name on the ROS 2 network.
        parts: The types of the five parts, in the order of `names.ActionNames`.

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
        """Handle a token that appeared or disappeared; return the change of a server, if any."""
        if self._kinds.get(token.name) is not token.kind:
            return None
        which = token.session, token.node_id  # one session may hold several nodes
        seen = self._seen.setdefault(which, set())
        if alive:
            seen.add(token)
        else:
            seen.discard(token)
            if not seen:
                del self._seen[which]
        # By name alone: a server with other types is present, too, and is reported.
        complete = {other.name for other in seen} == set(self._types)
        if complete == (which in self._servers):
            return None
        if not complete:
            return ServerChange(self._servers.pop(which), alive=False)
        # A server that comes back, after its link was down, keeps its number: equal to the old one.
        number = self._numbers.setdefault(which, len(self._numbers))
        server = RosServer(token.session, token.full_node, token.node_id, number)
        self._servers[which] = server
        return ServerChange(server, alive=True, mismatches=self._mismatches(seen))

    def _mismatches(self, tokens: Iterable[Token]) -> tuple[Mismatch, ...]:
        """Return the parts for which no endpoint has our type and hash."""
        found = {(token.name, RosType(token.type, token.type_hash)) for token in tokens}
        fitting = {name for name, other in found if other == self._types[name]}
        return tuple(
            Mismatch(name, self._types[name], other)
            for name, other in sorted(found)
            if name not in fitting
        )
