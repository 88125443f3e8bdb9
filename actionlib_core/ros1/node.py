"""A ROS 1 node made from parts of the standard library; it sends and receives bytes.

`advertise`, `subscribe` and `provide` only note what is wanted. `register` then registers at the
master what is missing there; after a restart of the master that is everything.
"""

from __future__ import annotations

import contextlib
import functools
import ipaddress
import logging
import os
import re
import socket
import threading
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.exceptions import ActionlibError, Ros1Error
from actionlib_core.ros1.answers import (
    Names,
    SystemState,
    read_tcpros,
    read_texts,
    read_types,
    registered,
    split_address,
)
from actionlib_core.ros1.backoff import Backoff
from actionlib_core.ros1.frames import Header, pack_fields, pack_service_answer
from actionlib_core.ros1.links import Budget, Connection, TcpListener
from actionlib_core.ros1.publishers import MAX_PUBLISHERS, Publishers
from actionlib_core.ros1.rpc import RpcServer, call

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.clock import Clock, Task
    from actionlib_core.ros1.publishers import Change

log = logging.getLogger("actionlib_core")

RETRY_FIRST_S = 0.2  # pause before a publisher is tried again; doubled each time
RETRY_LONGEST_S = 10.0
UNREGISTER_S = 1.0  # longest silence of the master while a node leaves
CLOSE_S = 1.0
PROBE_S = 0.5
REMIND_FIRST_S = 3.0  # pause before a subscriber that has not connected is notified; doubled
REMIND_LONGEST_S = 60.0
MAX_REPORTED = 1000  # remembered reports; limited, since a sender can invent names without end
MAX_LINKS = 2000  # to publishers of all topics; each has a thread
LARGEST_OF_SUBSCRIBER = 1 << 16  # subscribers send nothing after the header
LARGEST_REQUEST = 64 << 20  # of a service
AT_ONCE = 1 << 30  # bytes of all messages that are being received
ANY = "*"
PORT = 11311  # the usual port of a master


class TopicReceiver(Protocol):
    """Gets the messages of one publisher.

    Attributes:
        coalesce_s: Of the messages that arrive within this time [s] only the last is delivered;
            0.0: all of them.
    """

    coalesce_s: float

    def take(self, payload: bytes) -> None:
        """Handle a message."""

    def gone(self) -> None:
        """Handle the end of the connection."""


class Subscription:
    """A topic to which the node subscribes.

    Args:
        node: The node.
        topic: Its name, with a slash in front.
        accept: Gets the connection header of each publisher, and whether that was there before
            this subscription or connection, and returns the receiver of its messages; may refuse
            with a `Ros1Error`. It runs in the connection's thread.
    """

    def __init__(
        self, node: Ros1Node, topic: str, accept: Callable[[Header, bool], TopicReceiver]
    ) -> None:
        self.topic = topic
        self.accept = accept
        self.publishers = Publishers(node.uri)
        self.nodes: frozenset[str] = frozenset()  # publishers when the master was last asked
        self._node = node
        self._lock = threading.Lock()
        self._links: dict[str, _Link] = {}
        self._has_begun = False  # the first list of publishers was applied
        self._closed = False

    def apply(self, change: Change) -> None:
        """Connect to new publishers; stop trying those that have left."""
        if change.left_out:
            text = f"publishers: got {change.left_out} more; expected at most {MAX_PUBLISHERS}."
            self._node.report(f"{self.topic}: publishers", Ros1Error(self.topic, text))
        with self._lock:
            for uri in change.give_up & self._links.keys():
                self._links[uri].wake.set()
            if self._closed:
                return
            was_there, self._has_begun = not self._has_begun, True
            # With those for which there was no room or thread when they came.
            for uri in change.connect | (self.publishers.there - self._links.keys()):
                if uri in self._links:
                    self._links[uri].wake.set()
                elif not self._node.has_room():
                    break
                else:
                    link = _Link(self._node, self, uri, was_there=was_there)
                    try:
                        link.start()
                    except RuntimeError as error:  # no thread can be started, the system's limit
                        self._node.report("links", Ros1Error(self.topic, f"{uri}: {error}"))
                        break
                    self._links[uri] = link  # its thread waits for the lock

    def update(self, uris: Iterable[str]) -> None:
        """Handle a list of publishers from the master."""
        with self._lock:
            change = self.publishers.update(uris)
        self.apply(change)

    def leave(self, link: _Link) -> bool:
        """Return whether a link's publisher has left; if so, forget the link."""
        with self._lock:
            if link.uri in self.publishers.there and not self._closed:
                return False
            self._links.pop(link.uri, None)
            return True

    def wait_idle(self, timeout: float) -> None:
        """Wait until all messages that have arrived are handled.

        Blocks: `timeout` [s] at most for each publisher.
        """
        with self._lock:
            connections = [link.connection for link in self._links.values()]
        for connection in connections:
            if connection is not None:
                connection.wait_idle(timeout)

    @property
    def closed(self) -> bool:
        """Whether the subscription has ended."""
        return self._closed

    def close(self) -> None:
        """End the subscription; does not wait."""
        with self._lock:
            self._closed = True
            links = list(self._links.values())
        for link in links:
            link.close()
        self._node.forget(self)


class _Link:
    """A subscription's link to one publisher: a thread that connects, reads, and tries again."""

    def __init__(
        self, node: Ros1Node, subscription: Subscription, uri: str, *, was_there: bool
    ) -> None:
        self.uri = uri
        self._was_there = was_there
        self.wake = node.clock.event(f"publisher {uri} of {subscription.topic}")
        self._node = node
        self._subscription = subscription
        self.connection: Connection | None = None

    def start(self) -> None:
        self._node.spawn(self._run, f"ros1{self._subscription.topic}")

    def close(self) -> None:
        self.wake.set()
        if self.connection is not None:
            self.connection.close()

    def _run(self) -> None:
        about = f"{self._subscription.topic} of {self.uri}"
        pause = RETRY_FIRST_S
        while not self._subscription.leave(self):
            self.wake.clear()
            try:
                self._read(about)
                pause = RETRY_FIRST_S
            except ActionlibError as error:
                if not self._subscription.closed:  # else the error comes from our own `close`
                    # An unreachable node is reported once, not for each of its topics.
                    whole = isinstance(error, Ros1Error) and error.peer == self.uri
                    self._node.report(self.uri if whole else about, error)
            except Exception:  # noqa: BLE001  an error of a receiver: report it and try again
                report_thread_exception()
            # Checked again before the pause, so that a publisher that has left ends this thread at
            # once; `wake` is set when it leaves during the pause, or comes back.
            if self._subscription.leave(self):
                break
            self.wake.wait(pause)
            pause = min(2 * pause, RETRY_LONGEST_S)
        self._node.forget_report(about)

    def _read(self, about: str) -> None:
        """Connect, and read messages until the connection ends."""
        node, subscription = self._node, self._subscription
        topic = subscription.topic
        where = read_tcpros(
            self.uri, call(self.uri, "requestTopic", node.name, topic, [["TCPROS"]])
        )
        node.forget_report(self.uri)
        about = f"{topic} at {self.uri}"
        with Connection.open(*where, about, node.clock, node.budget) as connection:
            self.connection = connection
            if subscription.closed:  # `close` did not find the connection, which was not set yet
                return
            # "*" accepts every type: the bridge passes on bytes.
            fields = {"topic": topic, "type": ANY, "md5sum": ANY, "message_definition": ""}
            connection.send_header({"callerid": node.name, **fields, "tcp_nodelay": "1"})
            header = connection.read_header()
            self._wait_until_accepted(where, header)
            receiver = subscription.accept(header, self._was_there)
            self._was_there = True  # when it is connected again
            node.forget_report(about)
            read = connection.read_frame
            if receiver.coalesce_s:
                read = partial(connection.read_latest, receiver.coalesce_s)
            try:
                while (payload := read()) is not None:
                    receiver.take(payload)
            finally:
                self.connection = None
                receiver.gone()

    def _wait_until_accepted(self, where: tuple[str, int], header: Header) -> None:
        """Wait until the publisher has added us to its subscribers.

        A node of rospy does so only after it has sent its header, and messages that it publishes in
        between are lost for us. It handles one new connection after the other, so an answer on a
        second connection shows that the first one is done. The second one asks for a service that
        every node has, as a probe, which calls nothing.

        Blocks: for one exchange of headers, as `Connection.read_header`.
        """
        node = header.get("callerid", "")
        fields = {"callerid": self._node.name, "service": f"{node}/get_loggers"}
        with (
            contextlib.suppress(Ros1Error),  # an error ("no such service") is an answer as well
            Connection.open(*where, node, self._node.clock, self._node.budget) as probe,
        ):
            probe.send_header({**fields, "md5sum": ANY, "probe": "1"})
            probe.read_header()


class Publication:
    """A topic on which the node publishes.

    Args:
        node: The node.
        topic: Its name, with a slash in front.
        type_name: "pkg/Type"; "": the type that each subscriber expects.
        md5: Its checksum; "": the one that each subscriber expects.
        definition: The text of the type, with those of all nested types.
        latching: Whether subscribers are told that it latches.
        guess: Type and checksum for a subscriber of any type while the type is unknown.
        accept: Gets the connection header of each subscriber and returns a function that is called
            when the connection has ended; may refuse with a `Ros1Error`. It runs in the
            connection's thread.

    Attributes:
        kept: Sender -> its last message, which later subscribers get first. Guarded by `lock`.
    """

    def __init__(
        self,
        node: Ros1Node,
        topic: str,
        type_name: str,
        md5: str,
        definition: str,
        *,
        latching: bool,
        accept: Callable[[Header], Callable[[], object]],
        guess: tuple[str, str] = (ANY, ANY),
    ) -> None:
        self.topic = topic
        self.type = type_name
        self.md5 = md5
        self.latching = latching
        self.lock = threading.Lock()
        self.kept: dict[str, bytes] = {}
        self._definition = definition
        self._accept = accept
        self._node = node
        self._connections: set[Connection] = set()
        self._seen = guess
        self._closed = False

    def subscribers(self) -> set[str]:
        """Return the names of the nodes that are connected."""
        with self.lock:
            return {connection.peer for connection in self._connections}

    def put(self, payload: bytes, *, keep: str | None = None) -> None:
        """Send a message to all subscribers; never waits.

        Args:
            payload: The message.
            keep: The sender, to keep the message for later subscribers; None: do not keep it.
        """
        with self.lock:
            if keep is not None:
                self.kept[keep] = payload
            for connection in self._connections:
                connection.put(payload)

    def serve(self, connection: Connection, header: Header) -> None:
        """Serve a subscriber until it leaves; runs in the connection's thread."""
        # "*" is a subscriber of any type, such as rostopic or rosbag. It has to be told a real one:
        # ours, else the one that another subscriber has given.
        theirs = header.get("type", ANY), header.get("md5sum", ANY)
        known = self._seen if ANY in theirs else theirs
        ours = self.type or known[0], self.md5 or known[1]
        if any(their not in {ANY, our} for their, our in zip(theirs, ours, strict=True)):
            text = f"got {theirs[0]} ({theirs[1]}); expected {ours[0]} ({ours[1]})."
            connection.send_header({"error": f"{self.topic}: type: {text}"})
            raise Ros1Error(f"{self.topic}: subscriber {connection.peer}", f"type: {text}")
        if ANY in ours:
            connection.send_header({"error": f"{self.topic}: its type is not known yet"})
            return
        self._seen = ours
        fields = {"callerid": self._node.name, "topic": self.topic, "type": ours[0]}
        fields |= {"md5sum": ours[1], "message_definition": self._definition}
        fields["latching"] = str(int(self.latching))
        try:
            # In one step: once the subscriber has the header it gets each message, and gets it
            # once, as kept or from `put`.
            with self.lock:
                if self._closed:
                    return
                connection.put(pack_fields(fields))
                for payload in self.kept.values():
                    connection.put(payload)
                self._connections.add(connection)
            gone = self._accept(header)  # last: it shows the subscriber, and messages may come
            try:
                while connection.read_frame(LARGEST_OF_SUBSCRIBER) is not None:
                    pass  # subscribers send nothing; this waits for the end of the connection
            finally:
                gone()
        finally:
            with self.lock:
                self._connections.discard(connection)

    def close(self) -> None:
        """Stop publishing; does not wait."""
        with self.lock:
            self._closed = True
            connections = list(self._connections)
        for connection in connections:
            connection.close()
        self._node.forget(self)


class ServiceServer:
    """A service that the node offers.

    Args:
        node: The node.
        name: Its name, with a slash in front.
        type_name: "pkg/Type".
        md5: Its checksum.
        answer: Gets a request and the caller's name, returns the response; the text of an exception
            goes to the caller. It runs in the connection's thread.
    """

    def __init__(
        self,
        node: Ros1Node,
        name: str,
        type_name: str,
        md5: str,
        answer: Callable[[bytes, str], bytes],
    ) -> None:
        self.name = name
        self.type = type_name
        self.md5 = md5
        self._answer = answer
        self._node = node

    def serve(self, connection: Connection, header: Header) -> None:
        """Serve a caller until it leaves; runs in the connection's thread."""
        if header.get("md5sum") not in {ANY, self.md5}:
            text = f"got {header.get('md5sum')!r:.80}; expected {self.md5} ({self.type})."
            connection.send_header({"error": f"{self.name}: md5sum: {text}"})
            raise Ros1Error(f"{self.name}: caller {connection.peer}", f"md5sum: {text}")
        fields = {"callerid": self._node.name, "type": self.type, "md5sum": self.md5}
        parts = {f"{part}_type": f"{self.type}{part.title()}" for part in ("request", "response")}
        connection.send_header({**fields, **parts})
        if header.get("probe") == "1":  # rospy's wait_for_service only looks whether we answer
            return
        while (request := connection.read_frame(LARGEST_REQUEST)) is not None:
            try:
                answer = pack_service_answer(self._answer(request, connection.peer), good=True)
            except Exception as error:  # noqa: BLE001  every error is sent to the caller
                answer = pack_service_answer(str(error).encode(), good=False)
            connection.send(answer)
            if header.get("persistent") != "1":
                return

    def close(self) -> None:
        """Accept no more calls; does not wait for running ones."""
        self._node.forget(self)


class Ros1Node:
    """A node in a ROS 1 system.

    Args:
        name: Its full name, with a slash in front. It must be unique: the master shuts down an
            older node of the same name.
        master: Address of the master, "http://robot:11311".
        clock: A real clock; it starts the threads.
        host: Name or address under which the robot finds this computer; "": `ROS_HOSTNAME`, else
            `ROS_IP`, else the address from which the master is reached.

    Attributes:
        uri: Address of the node's XML-RPC interface.
        ended: Why the master has shut the node down; "" while it has not.

    Raises:
        Ros1Error: the master's address is malformed, or its host is not known here.
    """

    def __init__(self, name: str, master: str, *, clock: Clock, host: str = "") -> None:
        self.name = name
        self.master = master
        self.clock = clock
        self.ended = ""
        self.on_ended: Callable[[], object] = lambda: None
        self._lock = threading.Lock()
        self._published: dict[str, Publication] = {}
        self._subscribed: dict[str, Subscription] = {}
        self._served: dict[str, ServiceServer] = {}
        self._tasks: set[Task] = set()
        self.budget = Budget(AT_ONCE)
        self._reported: dict[str, str] = {}
        self._unconnected: dict[tuple[str, str], Backoff] = {}  # (topic, subscribing node)
        # With the master on this computer no other one needs to reach the node. Else it listens on
        # all addresses: the robot may know this computer under another one.
        own = find_host(master, host)
        bind = "127.0.0.1" if is_loopback(own) else ""
        self._rpc = RpcServer(bind, clock, self._methods())
        self._data = TcpListener(bind, clock, "ros1-data", self._handle)
        self._address = own, self._data.port
        self.uri = f"http://{own}:{self._rpc.port}/"

    # -- its topics and services ---------------------------------------------------------------

    def subscribe(
        self, topic: str, accept: Callable[[Header, bool], TopicReceiver]
    ) -> Subscription:
        """Subscribe to a topic of any type; see `Subscription`."""
        made = Subscription(self, topic, accept)
        with self._lock:
            self._subscribed[topic] = made
        return made

    def advertise(self, topic: str, *args: Any, **kwargs: Any) -> Publication:
        """Publish on a topic; see `Publication`."""
        made = Publication(self, topic, *args, **kwargs)
        with self._lock:
            self._published[topic] = made
        return made

    def provide(self, name: str, *args: Any) -> ServiceServer:
        """Offer a service; see `ServiceServer`."""
        made = ServiceServer(self, name, *args)
        with self._lock:
            self._served[name] = made
        return made

    def forget(self, made: Subscription | Publication | ServiceServer) -> None:
        """Drop a topic or service; `register` unregisters it at the master."""
        kinds: tuple[dict[str, Any], ...] = self._published, self._subscribed, self._served
        with self._lock:
            for kind in kinds:
                for name in [name for name, other in kind.items() if other is made]:
                    del kind[name]

    # -- the master ----------------------------------------------------------------------------

    def ask(self, method: str, *args: Any, timeout: float | None = None) -> Any:
        """Call a method of the master; raises and blocks as `rpc.call`."""
        more = {} if timeout is None else {"timeout": timeout}
        return call(self.master, method, self.name, *args, **more)

    def state(self) -> SystemState:
        """Return the master's registrations; raises and blocks as `ask`."""
        return SystemState.read(self.master, self.ask("getSystemState"))

    def types(self) -> dict[str, str]:
        """Return the types of all topics that the master has ever known; raises as `ask`."""
        return read_types(self.master, self.ask("getTopicTypes"))

    def register(self, state: SystemState, ignored: str = "") -> None:
        """Register at the master what is missing there, and unregister what is no longer wanted.

        A subscription is registered again when the topic has other publishers than before, as an
        update of the master may have been lost.

        Args:
            state: The master's registrations.
            ignored: Prefix of the names of nodes that are not notified of our topics; "": only this
                node.

        Raises:
            Ros1Error: the master does not answer, or with nonsense; the next call continues.
        """
        with self._lock:
            published, subscribed = dict(self._published), dict(self._subscribed)
            served = dict(self._served)
        wanted = Names(frozenset(published), frozenset(subscribed), frozenset(served))
        there = registered(state, self.name)
        missing = wanted - there
        for topic in sorted(missing.published):
            type_name = published[topic].type or ANY
            self._ask_about(topic, "registerPublisher", type_name, self.uri)
        for name in sorted(missing.served):
            self._ask_about(name, "registerService", self._rosrpc, self.uri)
        for topic, subscription in subscribed.items():
            nodes = frozenset(state.publishers.get(topic, ())) - {self.name}
            if topic in missing.subscribed or nodes != subscription.nodes:
                asked = subscription.publishers.ask()  # before the call: see `Publishers`
                uris = self._ask_about(topic, "registerSubscriber", ANY, self.uri)
                if uris is None:
                    continue
                uris = read_texts(self.master, "registerSubscriber", uris)
                subscription.apply(subscription.publishers.answer(asked, uris))
                subscription.nodes = nodes
        # Also what the master still has from before it was dropped here.
        self._unregister(there - wanted)
        self._remind(state, published, ignored or self.name)

    def _remind(self, state: SystemState, published: dict[str, Publication], ignored: str) -> None:
        """Notify subscribers that are registered at the master but have not connected to us.

        rospy never connects again to a publisher whose connection was reset, and the master's
        update about a new publisher may be lost.
        """
        missing = {
            (topic, node)
            for topic, made in published.items()
            for node in set(state.subscribers.get(topic, ())) - made.subscribers()
            if not node.startswith(ignored)
        }
        for there in self._unconnected.keys() - missing:
            del self._unconnected[there]
        now = self.clock.now()
        for topic, node in sorted(missing):
            first = Backoff(now, REMIND_FIRST_S, REMIND_LONGEST_S)
            if not self._unconnected.setdefault((topic, node), first).is_due(now):
                continue
            try:
                uri = str(self.ask("lookupNode", node))
                others = sorted(set(state.publishers.get(topic, ())) - {self.name})
                uris = [str(self.ask("lookupNode", other)) for other in others]
                # A node connects only to publishers that its last list did not contain: so first a
                # list without us, then one with us.
                for known in (uris, [*uris, self.uri]):
                    call(uri, "publisherUpdate", "/master", topic, known, timeout=PROBE_S)
            except Ros1Error as error:  # the node has died, or it is tried again later
                log.debug("ROS 1 bridge %s: %s of %s: %s", self.name, topic, node, error)

    def _ask_about(self, name: str, method: str, *args: Any, timeout: float | None = None) -> Any:
        """Ask about one name. A refusal says nothing of others: it is reported and gives None."""
        try:
            return self.ask(method, name, *args, timeout=timeout)
        except Ros1Error as error:
            if not error.refused:
                raise
            self.report(f"{method} {name}", Ros1Error(name, str(error)))
            return None

    def _unregister(self, names: Names, timeout: float | None = None) -> None:
        for topic in sorted(names.published):
            self._ask_about(topic, "unregisterPublisher", self.uri, timeout=timeout)
        for topic in sorted(names.subscribed):
            self._ask_about(topic, "unregisterSubscriber", self.uri, timeout=timeout)
        for name in sorted(names.served):
            self._ask_about(name, "unregisterService", self._rosrpc, timeout=timeout)

    def clean(self, state: SystemState, prefix: str) -> None:
        """Unregister bridges that were killed: subscribers would try to reach them for ever.

        Args:
            state: The master's registrations.
            prefix: Prefix of the names of bridges.

        Source:
            `rosnode cleanup`, which does this for all nodes.
        """
        parts = state.publishers, state.subscribers, state.services
        nodes = {node for part in parts for there in part.values() for node in there}
        for node in sorted(nodes - {self.name}):
            if node.startswith(prefix):
                try:
                    uri = str(self.ask("lookupNode", node))
                    if not _is_dead(uri):
                        continue
                    names = registered(state, node)
                    for topic in names.published:
                        call(self.master, "unregisterPublisher", node, topic, uri)
                    for topic in names.subscribed:
                        call(self.master, "unregisterSubscriber", node, topic, uri)
                    for name in names.served:
                        where = self.ask("lookupService", name)
                        call(self.master, "unregisterService", node, name, where)
                except Ros1Error as error:
                    self.report(f"cleaning {node}", error)

    @property
    def _rosrpc(self) -> str:
        host, port = self._address
        return f"rosrpc://{host}:{port}"

    # -- services of other nodes ---------------------------------------------------------------

    def open_service(self, name: str, **fields: str) -> tuple[Connection, Header]:
        """Connect to a service of any type.

        Args:
            name: Its name, with a slash in front.
            fields: More fields of the connection header, such as `persistent="1"`.

        Returns:
            The connection, which the caller releases, and the header with type and node.

        Raises:
            Ros1Error: there is no such service, or it does not answer.

        Blocks: as `rpc.call`, and for the exchange of headers.
        """
        where = split_address(name, self.ask("lookupService", name), "rosrpc")
        connection = Connection.open(*where, name, self.clock, self.budget)
        try:
            wanted = {"callerid": self.name, "service": name, "md5sum": ANY, **fields}
            connection.send_header(wanted)
            # The caller must not send a request before this answer: rospy drops bytes that arrive
            # in the same segment as the header.
            return connection, connection.read_header()
        except BaseException:
            connection.release()
            raise

    def call_service(self, name: str, request: bytes, md5: str, timeout: float) -> bytes:
        """Call a service and return the bytes of its response.

        Raises:
            Ros1Error: there is no such service, it has another type, its handler raised, or its
                node left before it answered. `reason` is the handler's error text.

        Blocks: `timeout` [s] at most for the answer, and as `open_service`.
        """
        connection, _ = self.open_service(name, md5sum=md5)
        with connection:
            connection.limit(timeout)
            connection.send(len(request).to_bytes(4, "little") + request)
            good = connection.read(1)
            payload = None if good is None else connection.read_frame()
        if payload is None:
            raise Ros1Error(name, "the service's node died or left before it answered.")
        if good != b"\x01":
            raise Ros1Error(name, payload.decode(errors="replace"))
        return payload

    # -- calls of other nodes and the master ---------------------------------------------------

    def _methods(self) -> dict[str, Callable[..., Any]]:
        return {
            "getPid": lambda _caller: os.getpid(),
            "getMasterUri": lambda _caller: self.master,
            "getBusStats": lambda _caller: [[], [], []],
            "getBusInfo": lambda _caller: [],
            "getSubscriptions": lambda _caller: [[name, ANY] for name in list(self._subscribed)],
            "getPublications": lambda _caller: [
                [name, made.type or ANY] for name, made in list(self._published.items())
            ],
            "paramUpdate": lambda _caller, _key, _value: 0,
            "publisherUpdate": self._on_publishers,
            "requestTopic": self._on_request,
            "shutdown": self._on_shutdown,
        }

    def _on_publishers(self, _caller: str, topic: str, uris: object) -> int:
        subscription = self._subscribed.get(topic)
        if subscription is not None:
            subscription.update(read_texts(self.master, "publisherUpdate", uris))
        return 0

    def _on_request(self, _caller: str, topic: str, _protocols: object) -> list[object]:
        if topic not in self._published:
            raise Ros1Error(self.name, f"requestTopic: {topic:.200}: it is not published here")
        return ["TCPROS", *self._address]

    def _on_shutdown(self, _caller: str, reason: object = "") -> int:
        self.ended = f"the master has ended it: {reason!s:.200}"
        self.on_ended()
        return 0

    def _handle(self, sock: socket.socket, peer: str) -> None:
        """Serve a node that has connected to us."""
        with Connection(sock, peer, self.clock, self.budget) as connection:
            try:
                header = connection.read_header()
                connection.peer = header.get("callerid", peer)
                topic, service = header.get("topic", ""), header.get("service", "")
                made = self._served.get(service) if service else self._published.get(topic)
                if made is None:
                    name = service or topic
                    connection.send_header({"error": f"{name!r:.200}: not offered by {self.name}"})
                    return
                made.serve(connection, header)
            except ActionlibError as error:
                self.report(str(error), error)

    # -- shared --------------------------------------------------------------------------------

    def spawn(self, target: Callable[[], object], name: str) -> None:
        """Run `target` in a thread that `close` waits for."""

        def run() -> None:
            try:
                target()
            finally:
                with self._lock:
                    self._tasks.discard(task)

        with self._lock:
            task = self.clock.spawn(run, name=name)
            self._tasks.add(task)

    def has_room(self) -> bool:
        """Return whether another link to a publisher may be made; if not, it is reported."""
        if len(self._tasks) < MAX_LINKS:
            return True
        text = f"links to publishers: got {MAX_LINKS}; expected fewer. Bridge fewer topics."
        self.report("links", Ros1Error(self.name, text))
        return False

    def report(self, about: str, error: ActionlibError) -> None:
        """Log an error, unless the last one with the same `about` had the same text."""
        text = str(error)
        with self._lock:
            known = self._reported.get(about) == text
            self._reported[about] = text
            while len(self._reported) > MAX_REPORTED:
                del self._reported[next(iter(self._reported))]
        if not known:
            log.error("ROS 1 bridge %s: %s", self.name, text)

    def forget_report(self, about: str) -> None:
        """Log the next error with this `about`, even if it is the same."""
        with self._lock:
            self._reported.pop(about, None)

    def close(self) -> None:
        """Leave the ROS 1 system: unregister everything, end all connections.

        Blocks: under a second with a master that answers; `UNREGISTER_S` and `CLOSE_S` at most for
            one that does not.
        """
        with self._lock:
            made: list[Subscription | Publication | ServiceServer] = [
                *self._subscribed.values(),
                *self._published.values(),
                *self._served.values(),
            ]
        for wanted in made:
            wanted.close()
        with contextlib.suppress(Ros1Error):  # a master that does not run has no registrations
            state = SystemState.read(self.master, self.ask("getSystemState", timeout=UNREGISTER_S))
            self._unregister(registered(state, self.name), UNREGISTER_S)
        self._data.close(CLOSE_S)
        self._rpc.close(CLOSE_S)
        with self._lock:
            tasks = list(self._tasks)
        deadline = self.clock.now() + CLOSE_S
        for task in tasks:
            task.join(max(0.0, deadline - self.clock.now()))


def _is_dead(uri: str) -> bool:
    """Return whether a node has died: its computer answers, but nothing listens at its port."""
    try:
        socket.create_connection(split_address(uri, uri, "http"), PROBE_S).close()
    except ConnectionRefusedError:
        return True
    except OSError:
        return False
    return False


def find_host(master: str, host: str = "") -> str:
    """Return the name or address under which the robot finds this computer.

    Source:
        https://wiki.ros.org/ROS/NetworkSetup for the order of the variables. Without them ROS uses
        the computer's name, which few robots can look up; here it is the local address of the route
        to the master, which the robot can reach.

    Raises:
        Ros1Error: the master's host is not known here.
    """
    chosen = host or os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP")
    if chosen:
        return chosen
    there, port = split_address(master, master, "http")
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((there, port))  # only chooses a route: UDP sends nothing yet
            address: str = probe.getsockname()[0]
            return address
    except OSError as error:
        raise Ros1Error(
            master,
            f"host: got {there!r}, which cannot be reached ({error.strerror or error}). Try its "
            "address, or a line for it in /etc/hosts.",
        ) from error


@functools.lru_cache(maxsize=64)
def is_loopback(host: str) -> bool:
    """Return whether `host` can be reached only from this computer."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check_master(uri: str) -> str:
    """Return the full address of a master: "http://robot:11311" for `robot`.

    Raises:
        Ros1Error: it is malformed.
    """
    full = uri if "//" in uri else f"http://{uri}"
    if not re.search(r":\d+/?\Z", full):
        full = f"{full.rstrip('/')}:{PORT}"
    split_address(uri, full, "http")
    return full.rstrip("/")
