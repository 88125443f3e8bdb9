"""One bridged action, whose server is on either network."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import threading
from functools import partial
from typing import TYPE_CHECKING

from actionlib_core.exceptions import ActionlibError, InterfaceError, Ros1Error, TransportError
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.ros1.answers import ACTION_WORDS
from actionlib_core.ros1.goals import REMEMBERED, Admission, GoalsOfClients, GoalsOfServer
from actionlib_core.ros1.node import ANY
from actionlib_core.ros1.sides import Typed, type_of
from actionlib_core.transport import Sample
from actionlib_core.transport.tokens import Kind, parse_token, token_key, token_pattern
from actionlib_core.wire import in_process
from actionlib_core.wire.actions import (
    ACK,
    AGAIN,
    ASK_TIMEOUT_S,
    FEEDBACK,
    GOAL,
    RESULT,
    STATUS,
    action_keys,
    pack_goal_id,
    pack_status,
    pack_statuses,
    unpack_cancel_if_lost,
    unpack_frame,
    unpack_goal,
    unpack_goal_id,
    unpack_report,
    unpack_statuses,
)
from actionlib_core.wire.encoding import encoding_of
from actionlib_core.wire.presence import with_age

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from actionlib_core.clock import Timer
    from actionlib_core.ros1.answers import SystemState
    from actionlib_core.ros1.definitions import Definitions
    from actionlib_core.ros1.frames import Header
    from actionlib_core.ros1.node import Publication
    from actionlib_core.ros1.sides import Sides
    from actionlib_core.transport import (
        Closable,
        Presence,
        PublisherPort,
        Quality,
        Query,
        Reply,
    )
    from actionlib_core.transport.tokens import Endpoint

log = logging.getLogger("actionlib_core")

OVERTAKEN_S = 0.05  # longest wait for feedback that was sent before a result
STATUS_S = 0.005  # of the status lists within this time only the last is passed on
# A bridge that looks so long after the last time stood still, or its master did. What servers have
# sent meanwhile is read within the second time.
STOPPED_S = 3.0
UNREAD_S = 1.0
NEXT_S = 2.0  # a server here that has left may be replaced by another within this time
# Results are acknowledged after this time, since our servers then stop listing the goal, and a
# client in ROS 1 counts a goal that is not listed as lost.
ACKNOWLEDGE_S = 5.0
GOAL_ID = Typed(GoalID._type, GoalID._md5sum)
STATUS_ARRAY = Typed(GoalStatusArray._type, GoalStatusArray._md5sum)
_PARTS = {"action_goal": "goal", "action_result": "result", "action_feedback": "feedback"}


def action_type(parts: dict[str, Typed]) -> Typed:
    """Return the type of an action from the types of its topics.

    The checksum follows from ROS 1's rule: the fields of XAction are messages, and in the text that
    is hashed the checksum of a message stands in place of its type.

    Args:
        parts: Last word of the topic -> its type.

    Raises:
        Ros1Error: the goal's type is not "pkg/XActionGoal".
    """
    goal = parts["goal"]
    if not goal.type.endswith("ActionGoal"):
        raise Ros1Error("goal", f"type: got {goal.type!r}; expected 'pkg/XActionGoal'.")
    text = "\n".join(f"{parts[word].md5} {field}" for field, word in _PARTS.items())
    md5 = hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()
    return Typed(goal.type.removesuffix("Goal"), md5)


class ActionBridge:
    """An action on both networks. Its server is expected in ROS 1 unless there is one here.

    Args:
        sides: The two networks.
        name: Its name in ROS 1.
        type_name: "pkg/XAction"; "" if it is unknown.
        definitions: The definitions of types.
        status_timeout: A server in ROS 1 without a status list for this time counts as gone [s].

    Threads: `look` and `close` from one thread.
    """

    def __init__(
        self,
        sides: Sides,
        name: str,
        type_name: str,
        definitions: Definitions,
        status_timeout: float,
    ) -> None:
        self._sides = sides
        self._name = name
        self._definitions = definitions
        self._type = type_name
        self._status_timeout = status_timeout
        self._side: ServerInRos | ServerHere | None = None

    def look(self, ends: Collection[Endpoint], state: SystemState) -> None:
        """Update what is bridged.

        Args:
            ends: The endpoints of that name on our network, without those of bridges.
            state: The master's registrations.
        """
        ends = [end for end in ends if end.kind in {Kind.ACTION_CLIENT, Kind.ACTION_SERVER}]
        servers = [end for end in ends if end.kind is Kind.ACTION_SERVER]
        rivals = set(state.publishers.get(f"{self._name}/status", ())) - {self._sides.ros.name}
        side = self._side
        if servers and rivals:
            text = f"got {sorted(rivals)} in ROS 1 and one of node '{servers[0].node}' here"
            error = Ros1Error(f"action {self._name}", f"two servers: {text}; expected one.")
            self._sides.ros.report(f"two servers of {self._name}", error)
        # With a server on both networks, the one that is bridged already stays.
        here = bool(servers) and not (rivals and isinstance(side, ServerInRos))
        stays = side.look(servers) if isinstance(side, ServerHere) else not here
        if side is not None and not stays:
            side.close()
            side = None
        if side is None and here:
            side = ServerHere(self._sides, self._name, _eldest(servers), self._definitions)
        elif side is None:
            type_name = self._type or next((end.type for end in ends), "")
            side = ServerInRos(
                self._sides, self._name, self._definitions, self._status_timeout, type_name
            )
        self._side = side
        if isinstance(side, ServerInRos):
            side.check_silence()

    def close(self) -> None:
        """End the bridge; does not wait."""
        if self._side is not None:
            self._side.close()


def _eldest(servers: Collection[Endpoint]) -> Endpoint:
    return min(servers, key=lambda end: end.age)


class ServerInRos:
    """An action whose server is in ROS 1: shown here while all five connections to it are open.

    The five are its topics: `goal` and `cancel`, to which it subscribes, and `status`, `feedback`
    and `result`, which it publishes.

    Args:
        sides: The two networks.
        name: The action's name in ROS 1.
        definitions: Gets the definitions of its types.
        status_timeout: See `ActionBridge`.
        type_name: "pkg/XAction"; "" if it is unknown.
    """

    def __init__(
        self,
        sides: Sides,
        name: str,
        definitions: Definitions,
        status_timeout: float,
        type_name: str,
    ) -> None:
        self._sides = sides
        self._clock = sides.node.clock
        self._name = name
        self._definitions = definitions
        self._status_timeout = status_timeout
        self._lock = threading.Lock()
        # Node in ROS 1 -> last word of the topic -> links with their types, the newest last. There
        # may be several: those to a process that hangs, and those to its successor.
        self._links: dict[str, dict[str, dict[object, Typed]]] = {}
        self._shown: _ShownServer | None = None
        self._silent = ""  # the node that was hidden because it sends no status lists
        self._last_status = 0.0
        self._looked_at = self._clock.now()
        self._spared = False  # since the last status
        self._closed = False
        goal_type = f"{type_name}Goal" if type_name else ""
        self._goals = self._advertise("goal", goal_type, "")
        self._cancels = self._advertise("cancel", *GOAL_ID)
        self._subscriptions = {
            word: sides.ros.subscribe(f"{name}/{word}", partial(_ServerTopic, self, word))
            for word in ("status", "feedback", "result")
        }

    def _advertise(self, word: str, type_name: str, md5: str) -> Publication:
        known = _known(type_name)
        return self._sides.ros.advertise(
            f"{self._name}/{word}",
            *(type_name, md5),
            "" if known is None else self._definitions.text(known),
            latching=False,
            accept=partial(self._accept, word),
            guess=known or (ANY, ANY),
        )

    def close(self) -> None:
        """End the bridge; does not wait."""
        with self._lock:
            self._closed = True
            self._hide()
        self._goals.close()
        self._cancels.close()
        for subscription in self._subscriptions.values():
            subscription.close()

    # -- the server in ROS 1 -------------------------------------------------------------------

    def _accept(self, word: str, header: Header) -> Callable[[], object]:
        """Handle a new subscriber of goals or cancels."""
        if ANY in {header.get("type"), header.get("md5sum")}:
            return lambda: None  # it accepts any type, as rosbag does to record: it is no server
        node, link = header.get("callerid", ""), object()
        self.connect(node, word, link, type_of(header, f"{self._name}/{word}"))
        return partial(self.disconnect, node, word, link)

    def connect(self, node: str, word: str, link: object, typed: Typed) -> None:
        """Note a link to a node for one of the five topics; a node with all five is the server.

        A new process under the name of the server takes its place even if the old links have not
        ended: the old process may hang, or its computer may have lost power.
        """
        with self._lock:
            self._links.setdefault(node, {}).setdefault(word, {})[link] = typed
            newest = self._newest(node)
            shown = self._shown
            if len(newest) < len(ACTION_WORDS) or self._closed:
                return
            if shown is not None and shown.ros_node != node:
                text = f"two servers in ROS 1: got {node} beside {shown.ros_node}"
                error = Ros1Error(f"action {self._name}", f"{text}; expected one.")
                self._sides.ros.report(f"servers of {self._name}", error)
            elif shown is None or shown.links.isdisjoint(newest.values()):
                self._hide()
                self._show(node)

    def disconnect(self, node: str, word: str, link: object) -> None:
        """Note that a link has ended: without all five, a node is no server."""
        with self._lock:
            words = self._links[node]
            del words[word][link]
            if not words[word]:
                del words[word]
            if not words:
                del self._links[node]
            # Another node, or a successor of the same name, may be complete already.
            if self._shown is not None and link in self._shown.links:
                self._hide()
                whole = (n for n in self._links if len(self._newest(n)) == len(ACTION_WORDS))
                other = next(whole, None)
                if other is not None and not self._closed:
                    self._show(other)

    def _newest(self, node: str) -> dict[str, object]:
        """Return the newest link to a node for each topic that has one. Needs the lock."""
        return {word: next(reversed(links)) for word, links in self._links.get(node, {}).items()}

    def _show(self, node: str) -> None:
        """Show the server on our network. Needs the lock."""
        newest = self._newest(node)
        types = {word: self._links[node][word][link] for word, link in newest.items()}
        try:
            typed = action_type(types)
        except Ros1Error as error:
            self._sides.ros.report(f"type of {self._name}", error)
            return
        self._last_status, self._silent = self._clock.now(), ""
        links = frozenset(newest.values())
        to_server = self._goals, self._cancels
        self._shown = _ShownServer(self._sides, self._name, typed, types, node, links, to_server)

    def _hide(self) -> None:
        shown, self._shown = self._shown, None
        if shown is not None:
            shown.close()

    def check_silence(self) -> None:
        """Hide a server that sends no status lists: it hangs, and its clients would wait for it."""
        with self._lock:
            shown, now = self._shown, self._clock.now()
            stopped = now > self._looked_at + STOPPED_S
            self._looked_at = now
            if shown is None or now < self._last_status + self._status_timeout:
                return
            if stopped and not self._spared:  # but not for ever while the master is slow
                self._last_status, self._spared = now + UNREAD_S - self._status_timeout, True
                return
            self._silent = shown.ros_node
            self._hide()
        log.error(
            "ROS 1 bridge: action %s: no status of %s for %g s: it counts as gone until it speaks",
            *(self._name, self._silent, self._status_timeout),
        )

    # -- its messages --------------------------------------------------------------------------

    def take(self, node: str, word: str, link: object, payload: bytes) -> None:
        """Pass on a message of a node on `status`, `feedback` or `result`."""
        with self._lock:
            if word == "status" and node == self._silent and self._shown is None:
                newest = self._newest(node)
                if len(newest) == len(ACTION_WORDS) and newest[word] is link:
                    self._show(node)
            shown = self._shown
            if shown is None or link not in shown.links:
                return
            if word == "status":
                self._last_status, self._spared = self._clock.now(), False
        # Each topic has its own connection and thread: let feedback that was sent before the result
        # go first.
        if word == "result":
            self._subscriptions["feedback"].wait_idle(OVERTAKEN_S)
        try:
            with contextlib.suppress(TransportError):  # withdrawn meanwhile
                getattr(shown, f"on_{word}")(payload)
        except ValueError as error:
            about = f"{self._name}/{word} of {node}"
            self._sides.ros.report(about, Ros1Error(about, str(error)))

    def learn(self, header: Header, typed: Typed) -> None:
        """Keep the definition of a type from a publisher's header."""
        self._definitions.learn(typed, header.get("message_definition", ""))


class _ServerTopic:
    """A server's connection for one of the three topics that it publishes."""

    def __init__(self, server: ServerInRos, word: str, header: Header, _was_there: bool) -> None:
        typed = type_of(header, word)
        # A server in ROS 1 sends a status list right before each result. Reading long lists is
        # slow, so the list waits here and the result is passed on first.
        self.coalesce_s = STATUS_S if word == "status" else 0.0
        self._server = server
        self._word = word
        self._node = header.get("callerid", "")
        server.learn(header, typed)
        server.connect(self._node, word, self, typed)

    def take(self, payload: bytes) -> None:
        self._server.take(self._node, self._word, self, payload)

    def gone(self) -> None:
        self._server.disconnect(self._node, self._word, self)


class _ShownServer:
    """A server in ROS 1, shown on our network: token, topics, and answers about its goals."""

    def __init__(
        self,
        sides: Sides,
        name: str,
        typed: Typed,
        types: dict[str, Typed],
        ros_node: str,
        links: frozenset[object],
        to_server: tuple[Publication, Publication],
    ) -> None:
        self.ros_node = ros_node
        self.links = links
        self._sides = sides
        self._clock = sides.node.clock
        self._name = sides.key(name)
        self._types = types
        self._to_server = to_server
        self._lock = threading.Lock()
        self._goals = GoalsOfServer()
        self._clients: dict[in_process.ClientInProcess, None] = {}  # those in this process
        self._sessions: dict[str, str] = {}  # token of a client on our network -> its session
        # Ids of goals that are to be cancelled with their clients -> the client's session.
        self._cancel_if_lost: dict[str, str] = {}
        self._keys = keys = action_keys(self._name)
        transport = sides.node.transport
        self.session = transport.session_id
        end = sides.node.endpoint(Kind.ACTION_SERVER, self._name, *typed)
        end = end._replace(node=sides.key(ros_node))
        self._own_key = token_key(with_age(end, sides.node))
        self._status = transport.publisher(keys.status, STATUS_ARRAY.encoding, STATUS)
        self._feedback = transport.publisher(keys.feedback, types["feedback"].encoding, FEEDBACK)
        self._result = transport.publisher(keys.result, types["result"].encoding, RESULT)
        self._declared: list[Closable] = [
            *(self._status, self._feedback, self._result),
            transport.subscribe(keys.goal, self._on_goal, history=False),
            transport.subscribe(keys.cancel, self._on_cancel, history=False),
            transport.subscribe(keys.ack, self._on_ack, history=False),
            transport.queryable(keys.result, self._on_query),
            transport.watch_alive(token_pattern(Kind.ACTION_CLIENT, self._name), self._on_client),
        ]
        # Last, and in this order: clients that see the token may send at once, and look here first.
        in_process.servers[self._own_key] = self
        self._declared.append(transport.declare_alive(self._own_key))

    def close(self) -> None:
        """Withdraw it: its clients' goals are LOST at once."""
        in_process.servers.pop(self._own_key, None)
        for each in reversed(self._declared):
            each.close()

    # -- from ROS 1 ----------------------------------------------------------------------------

    def on_status(self, payload: bytes) -> None:
        """Pass on a status list, except the empty lists that an idle server keeps sending."""
        entries = unpack_statuses(payload)
        with self._lock:
            news = self._goals.on_statuses(entries, self._clock.now())
        if news:
            self._status.put(payload)

    def on_feedback(self, payload: bytes) -> None:
        """Pass on feedback."""
        if self._clients:
            sample = self._sample("feedback", payload)
            for client in list(self._clients):
                client.take_feedback(sample)
        self._feedback.put(payload)

    def on_result(self, payload: bytes) -> None:
        """Keep a result and pass it on."""
        entry, _ = unpack_report(payload)
        with self._lock:
            self._goals.on_result(entry, payload, self._clock.now())
            self._cancel_if_lost.pop(entry.id, None)
        self._send_result(payload)

    def _send_result(self, payload: bytes) -> None:
        if self._clients:
            sample = self._sample("result", payload)
            for client in list(self._clients):
                client.take_result(sample, direct=True)
        self._result.put(payload)

    def _sample(self, word: str, payload: bytes) -> Sample:
        return Sample(getattr(self._keys, word), payload, self._types[word].encoding, self.session)

    # -- from clients in this process ----------------------------------------------------------

    def join(self, client: in_process.ClientInProcess) -> None:
        """See `in_process.ServerInProcess`."""
        self._clients[client] = None

    def leave(self, client: in_process.ClientInProcess) -> None:
        """See `in_process.ServerInProcess`."""
        self._clients.pop(client, None)

    def take_goal(self, sample: Sample) -> None:
        """See `in_process.ServerInProcess`."""
        self._pass_on(sample, self._goals.on_direct_goal)

    # -- from clients on our network -----------------------------------------------------------

    def _on_goal(self, sample: Sample) -> None:
        if not self._sides.is_own(sample):
            self._pass_on(sample, self._goals.on_goal)

    def _pass_on(self, sample: Sample, decide: Callable[[str], Admission]) -> None:
        if not self._sides.fits(sample, self._types["goal"]):
            return
        try:
            frame, goal_id = unpack_frame(sample.payload), unpack_goal(sample.payload)[0]
        except ValueError as error:
            self._report("a goal", sample, error)
            return
        other = parse_token(frame) if frame and frame != self._own_key else None
        if other is not None and other.kind is Kind.ACTION_SERVER and other.name == self._name:
            return  # a late repetition of a goal for the server before this one
        with self._lock:
            verdict = decide(goal_id)
            result = self._goals.result(goal_id)
            if verdict is Admission.PASS:
                self._goals.on_passed(goal_id, self._clock.now())
            wanted = unpack_cancel_if_lost(sample.payload, self._own_key)
            if verdict is Admission.PASS and wanted:
                self._cancel_if_lost[goal_id] = sample.source
                if len(self._cancel_if_lost) > REMEMBERED:
                    del self._cancel_if_lost[next(iter(self._cancel_if_lost))]
        if verdict is Admission.PASS:
            self._to_server[0].put(sample.payload)
        elif verdict is Admission.REPEAT_RESULT and result is not None:
            self._send_result(result)

    def _on_client(self, presence: Presence) -> None:
        """Cancel the goals that a client wants to be cancelled when it dies: ROS 1 cannot."""
        client = parse_token(presence.key)
        if client is None:
            return
        with self._lock:
            if presence.alive:
                self._sessions[presence.key] = client.session
                return
            self._sessions.pop(presence.key, None)
            if client.session in self._sessions.values():
                return
            wanted = self._cancel_if_lost
            lost = [each for each, session in wanted.items() if session == client.session]
            for goal_id in lost:
                del wanted[goal_id]
        for goal_id in lost:
            self._to_server[1].put(pack_goal_id(goal_id, 0))

    def _on_cancel(self, sample: Sample) -> None:
        if not self._sides.is_own(sample) and self._sides.fits(sample, GOAL_ID):
            self._to_server[1].put(sample.payload)

    def _on_ack(self, sample: Sample) -> None:
        try:
            entries = unpack_statuses(sample.payload)
        except ValueError as error:
            self._report("an acknowledgement", sample, error)
            return
        with self._lock:
            self._goals.on_acknowledged(entry.id for entry in entries)

    def _on_query(self, query: Query) -> None:
        """Answer with the result or status of a goal; without an id, with the status list."""
        try:
            goal_id = unpack_goal_id(query.payload)[0]
        except ValueError as error:
            query.reply_error(f"action '{self._name}': {error}; expected an actionlib_msgs/GoalID")
            query.finish()
            return
        with self._lock:
            result = self._goals.result(goal_id)
            entry = self._goals.status(goal_id, self._clock.now())
            listed = self._goals.list()
        if not goal_id:
            statuses = pack_statuses(self._clock.time_ns(), listed)
            query.reply(statuses, STATUS_ARRAY.encoding)
        elif result is not None:
            query.reply(result, self._types["result"].encoding)
        else:
            query.reply(pack_status(entry), encoding_of(GoalStatus))
        query.finish()

    def _report(self, what: str, sample: Sample, error: ValueError) -> None:
        about = f"action '{self._name}': {what} of session {sample.source}"
        self._sides.ros.report(about, ActionlibError(f"{about} cannot be read: {error}"))


class ServerHere:
    """An action whose server is on our network, for clients in ROS 1.

    Args:
        sides: The two networks.
        name: The action's name in ROS 1.
        server: The server's endpoint.
        definitions: The definitions of types.
    """

    def __init__(self, sides: Sides, name: str, server: Endpoint, definitions: Definitions) -> None:
        self.server = server
        self._sides = sides
        self._clock = sides.node.clock
        self._name = name
        self._keys = action_keys(sides.key(name))
        self._lock = threading.Lock()
        self._goals = GoalsOfClients()
        self._clients: dict[str, Closable] = {}  # key of the token -> token, of clients in ROS 1
        self._publishers: dict[tuple[str, Quality], PublisherPort] = {}
        self._goal_encoding = ""
        self._timer: Timer | None = None
        self._acks: list[str] = []
        self._farewell_received = False
        self._next_server_seen = False  # after the farewell, its successor has sent a status list
        self._gone_since: float | None = None
        self._closed = False
        self._publications: dict[str, Publication] = {}
        parts = _types_of(server)
        for word in ("status", "feedback", "result"):
            typed = parts[word]
            self._publications[word] = sides.ros.advertise(
                f"{name}/{word}",
                *typed,
                definitions.text(typed) if all(typed) else "",
                latching=word == "status",
                accept=lambda _header: lambda: None,
            )
        # Clients in ROS 1 find a server by its status list, and an idle server here sends none.
        self._publish_empty_status()
        transport, keys = sides.node.transport, self._keys
        self._subscribed: list[Closable] = [
            transport.subscribe(keys.status, self._on_status, history=False),
            transport.subscribe(keys.feedback, self._on_feedback, history=False),
            transport.subscribe(keys.result, self._on_result, history=False),
        ]
        self._subscriptions = [
            sides.ros.subscribe(f"{name}/{word}", partial(_Client, self, word))
            for word in ("goal", "cancel")
        ]

    def look(self, servers: Collection[Endpoint]) -> bool:
        """Follow the server or its successor; return whether to go on bridging.

        Goals are LOST with their server. The goals that it had not accepted when it sent its
        farewell, and goals that arrive now, are for a successor that appears within `NEXT_S`.

        Args:
            servers: The servers of the action on our network.
        """
        now = self._clock.now()
        if self.server in servers:
            return True
        if self._gone_since is None:
            self._gone_since = now
            with self._lock:
                # A farewell lists all goals that the server has accepted; without one, it may have
                # started any of them.
                if not self._farewell_received:
                    self._goals.drop_unacknowledged()
                # Clients in ROS 1 count goals that are not listed as lost. Not when the successor
                # has already listed its goals.
                if not self._next_server_seen:
                    self._publish_empty_status()
        typed = self.server.type, self.server.md5
        fitting = [end for end in servers if (end.type, end.md5) == typed]
        if fitting:
            self.server, self._gone_since = _eldest(fitting), None
            self._farewell_received = self._next_server_seen = False
            return True
        return not servers and now < self._gone_since + NEXT_S

    def close(self) -> None:
        """End the bridge: clients in ROS 1 get an empty status list; does not wait."""
        with self._lock:
            self._closed = True
            if self._timer is not None:
                self._timer.cancel()
            publishers = list(self._publishers.values())
        self._publish_empty_status()
        for part in (*self._subscribed, *publishers):
            part.close()
        for subscription in self._subscriptions:
            subscription.close()
        for publication in self._publications.values():
            publication.close()

    def _publish_empty_status(self) -> None:
        empty = pack_statuses(self._clock.time_ns(), ())
        self._publications["status"].put(empty, keep="")

    # -- from clients in ROS 1 -----------------------------------------------------------------

    def join(self, ros_node: str) -> tuple[str, Closable]:
        """Show a client in ROS 1 on our network; return its token's key, and the token."""
        node = self._sides.node
        typed = self.server.type, self.server.md5
        end = node.endpoint(Kind.ACTION_CLIENT, self.server.name, *typed)
        key = token_key(end._replace(node=self._sides.key(ros_node)))
        token = node.transport.declare_alive(key)
        with self._lock:
            self._clients[key] = token
        return key, token

    def leave(self, key: str) -> None:
        """Withdraw a client."""
        with self._lock:
            token = self._clients.pop(key, None)
        if token is not None:
            token.close()

    def on_goal(self, typed: Typed, payload: bytes) -> None:
        """Pass on a goal; blocks while a link of our network is full."""
        goal_id, stamp_ns, _ = unpack_goal(payload)
        with self._lock:
            self._goal_encoding = typed.encoding
            self._goals.on_goal(goal_id, payload, stamp_ns, self._clock.now())
            self._arm()
        self._publisher(self._keys.goal, typed.encoding, GOAL).put(payload)

    def on_cancel(self, typed: Typed, payload: bytes) -> None:
        """Pass on a cancel; blocks as `on_goal`."""
        with self._lock:
            self._goals.on_cancel(*unpack_goal_id(payload))
        self._publisher(self._keys.cancel, typed.encoding, GOAL).put(payload)

    def report(self, about: str, error: ValueError) -> None:
        """Report a message that cannot be read."""
        self._sides.ros.report(about, Ros1Error(about, str(error)))

    def _publisher(self, key: str, encoding: str, quality: Quality) -> PublisherPort:
        with self._lock:
            if self._closed:
                raise TransportError(f"{key}: its server has left; expected it to be there.")
            which = f"{key} {encoding}", quality
            made = self._publishers.get(which)
            if made is None:
                made = self._sides.node.transport.publisher(key, encoding, quality)
                self._publishers[which] = made
        return made

    # -- from the server -----------------------------------------------------------------------

    def _is_of_server(self, sample: Sample) -> bool:
        return sample.source in {"", self.server.session}

    def _on_status(self, sample: Sample) -> None:
        if not self._is_of_server(sample) or not self._sides.fits(sample, STATUS_ARRAY):
            return
        try:
            entries, frame = unpack_statuses(sample.payload), unpack_frame(sample.payload)
        except ValueError as error:
            self.report(f"{self._name}/status", error)
            return
        with self._lock:
            for entry in entries:
                self._goals.on_status(entry, self._clock.now())
            self._arm()
            is_farewell = parse_token(frame) is not None
            if self._farewell_received and not is_farewell:
                self._next_server_seen = True
            self._farewell_received |= is_farewell
            clients = list(self._clients) if is_farewell else []
        self._publications["status"].put(sample.payload, keep="")
        with contextlib.suppress(TransportError):  # closed meanwhile
            for client in clients:
                self._acknowledge([], client)

    def _on_feedback(self, sample: Sample) -> None:
        if self._is_of_server(sample):
            self._publications["feedback"].put(sample.payload)

    def _on_result(self, sample: Sample) -> None:
        if self._is_of_server(sample):
            self._take_result(sample.payload)

    def _take_result(self, payload: bytes) -> None:
        try:
            entry, _ = unpack_report(payload)
        except ValueError as error:
            self.report(f"{self._name}/result", error)
            return
        with self._lock:
            first = self._goals.on_result(entry.id)
            # Goals of clients on our network are acknowledged by these themselves.
            if self._goals.is_ours(entry.id):
                self._acks.append(entry.id)
                if len(self._acks) == 1:
                    self._clock.call_later(ACKNOWLEDGE_S, self._send_acks)
        if first:
            self._publications["result"].put(payload)

    # -- acknowledgements and repetitions ------------------------------------------------------

    def _send_acks(self) -> None:
        with self._lock:
            acks, self._acks = self._acks, []
        with contextlib.suppress(TransportError):  # closed meanwhile
            self._acknowledge(acks, "")

    def _acknowledge(self, goal_ids: list[str], frame: str) -> None:
        entries = [StatusEntry(goal_id, 0, 0, "") for goal_id in goal_ids]
        message = pack_statuses(self._clock.time_ns(), entries, frame)
        self._publisher(self._keys.ack, STATUS_ARRAY.encoding, ACK).put(message)

    def _arm(self) -> None:
        """Start the timer for the next repetition, if it does not run. Needs the lock."""
        due = self._goals.next_due()
        if due is None or self._timer is not None or self._closed:
            return
        self._timer = self._clock.call_later(max(0.0, due - self._clock.now()), self._send_due)

    def _send_due(self) -> None:
        with self._lock:
            self._timer = None
            if self._closed:
                return
            due = self._goals.take_due(self._clock.now())
            encoding = self._goal_encoding
            self._arm()
        with contextlib.suppress(TransportError):  # closed meanwhile
            for goal_id in due.cancel:
                cancels = self._publisher(self._keys.cancel, GOAL_ID.encoding, AGAIN)
                cancels.put(pack_goal_id(goal_id, 0))
            for message in due.again:
                self._publisher(self._keys.goal, encoding, AGAIN).put(message)
            for goal_id in due.ask:
                self._sides.node.transport.query(
                    self._keys.result,
                    pack_goal_id(goal_id, 0),
                    encoding=GOAL_ID.encoding,
                    timeout=ASK_TIMEOUT_S,
                    on_reply=self._on_reply,
                    on_done=lambda: None,
                )

    def _on_reply(self, reply: Reply) -> None:
        if not reply.error and reply.encoding != encoding_of(GoalStatus):
            self._take_result(reply.payload)


class _Client:
    """A publisher of goals or cancels in ROS 1."""

    coalesce_s = 0.0

    def __init__(self, server: ServerHere, word: str, header: Header, _was_there: bool) -> None:
        self._typed = type_of(header, word)
        self._server = server
        self._word = word
        self._about = f"{word} of {header.get('callerid', '')}"
        self._token = server.join(header.get("callerid", ""))[0] if word == "goal" else ""

    def take(self, payload: bytes) -> None:
        """Pass on a goal or cancel."""
        # Called in the connection's thread: while it waits for our network, ROS 1 buffers.
        try:
            if self._word == "goal":
                self._server.on_goal(self._typed, payload)
            else:
                self._server.on_cancel(self._typed, payload)
        except ValueError as error:
            self._server.report(self._about, error)

    def gone(self) -> None:
        """Withdraw the client."""
        if self._token:
            self._server.leave(self._token)


def _types_of(server: Endpoint) -> dict[str, Typed]:
    """Return the types of the topics of an action on our network; checksum "" if it is unknown."""
    types = {"status": STATUS_ARRAY}
    fits = _known(server.type) == (server.type, server.md5)
    for word in ("feedback", "result"):
        name = f"{server.type}{word.title()}"
        types[word] = (_known(name) if fits else None) or Typed(name, "")
    return types


def _known(type_name: str) -> Typed | None:
    """Return a type with its checksum in this program; None if this program does not have it."""
    from actionlib_core.interfaces import get_message

    try:
        return Typed(type_name, get_message(type_name)._md5sum)
    except InterfaceError:
        return None
