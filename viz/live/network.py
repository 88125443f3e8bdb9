"""Finds running machines on the network and follows them, across restarts on both sides.

Machines of the same name are distinguished by their network sessions. The first one is shown under
its name, further ones as "name (2)" and so on.
"""

from __future__ import annotations

import itertools
import json
import logging
import threading
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import SerialExecutor
from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.wire.encoding import encoding_of
from actionlib_core.wire.presence import Kind, parse_token, token_key, token_pattern
from smachpy.introspection import StateRecord
from smachpy.network.feed import DESCRIPTION_TOPIC, EVENTS_TOPIC, HISTORY_SERVICE, OBSERVED_TOPIC
from smachpy.network.remote_control import STATE_TOPIC, CommandError, ControlClient
from smachpy.network.values import VALUE_SERVICE, ReadValue
from smachpy.states.questions import fetch_picture, give_answer

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence, Reply, Sample
    from actionlib_core.wire.presence import Endpoint
    from viz.live.machines import Machine, Machines

logger = logging.getLogger("viz.live")

HISTORY_S = 3.0
"""Longest wait for a machine's history [s]."""

VALUE_S = 10.0
"""Longest wait for a value, which may have megabytes [s]; if the server goes, it ends at once."""

RETRY_S = 0.5
"""Time until a history that did not come is requested again [s]."""

GATHER_S = 0.014
"""Time in which received events are gathered and then added together [s]."""

SETTLE_S = 0.3
"""Time after which the history is read a second time [s].

Until the server knows its new subscriber, events can be lost between the first reading and the
first event that is received."""


class Network:
    """Keeps `machines` up to date with the machines on one or several networks.

    Args:
        node: The node on the first network; `join` adds others.
        machines: The machines to update.
        control: Whether commands may be sent.

    Threads: every method may be called from any thread.
    """

    def __init__(self, node: Node, machines: Machines, *, control: bool = False) -> None:
        self._machines = machines
        self._control = control
        self._lock = threading.Lock()
        self._links: dict[str, Link] = {}
        self._subscriptions: dict[tuple[Node, str], _Subscription] = {}
        self._watches: dict[Node, Closable] = {}
        self.join(node)

    def join(self, node: Node) -> None:
        """Also follow the machines on a node's network."""
        pattern = token_pattern(Kind.PUBLISHER, f"**{EVENTS_TOPIC}")
        on_presence = partial(self._on_presence, node)
        self._watches[node] = node.transport.watch_alive(pattern, on_presence)

    def leave(self, node: Node) -> None:
        """Stop following the machines on a node's network, which become stale."""
        self._watches.pop(node).close()
        with self._lock:
            subscriptions = [
                self._subscriptions.pop(key) for key in list(self._subscriptions) if key[0] is node
            ]
            links = {name: link for name, link in self._links.items() if link.on(node)}
            for name in links:
                del self._links[name]
        # Outside the lock, which every received sample needs: closing waits for the links' threads.
        for link in links.values():
            link.lose()
        parts: list[Link | _Subscription] = [*subscriptions, *links.values()]
        for part in parts:
            part.close()

    def close(self) -> None:
        """Stop following all machines; a second call does nothing."""
        for watch in self._watches.values():
            watch.close()
        with self._lock:
            parts: list[Link | _Subscription] = [
                *self._subscriptions.values(),
                *self._links.values(),
            ]
            self._links.clear()
            self._subscriptions.clear()
        for part in parts:
            part.close()

    def send(self, name: str, command: dict[str, Any]) -> dict[str, Any]:
        """Send a command to a machine and return the answer.

        Raises:
            CommandError: there is no such machine, or there are two; the command is wrong; or there
                is no answer.

        Blocks: until the answer, a few seconds at most.
        """
        link = self._link(name)
        if command.get("command") == "answer":  # each question has a service of its own
            return link.answer(command)
        # Commands go to a service named after the machine, which its namesake has too.
        with self._lock:
            links = list(self._links.values())
        twins = [one for one in links if one.alive and one.is_twin(link)]
        if len(twins) > 1:
            raise CommandError(
                f"{name}: got {len(twins)} machines with the name {link.server!r}, which would all "
                "get the command; expected one. Give each its own name or namespace."
            )
        return link.send(command)

    def value(self, name: str, container: str, key: str) -> str:
        """Return the present value of a userdata key, unabridged.

        Raises:
            CommandError: there is no such machine or value, or no answer.

        Blocks: until the answer, a few seconds at most.
        """
        return self._link(name).value(container, key)

    def picture(self, name: str, path: str) -> tuple[str, bytes] | None:
        """Return media type and bytes of a question's picture; None if it has none.

        Raises:
            CommandError: there is no such machine.

        Blocks: until the picture has arrived, a few seconds at most.
        """
        return self._link(name).picture(path)

    def _link(self, name: str) -> Link:
        with self._lock:
            link, known = self._links.get(name), sorted(self._links)
        if link is None:
            raise CommandError(f"{name}: no such machine; expected one of {known}.")
        return link

    def _on_presence(self, node: Node, presence: Presence) -> None:
        endpoint = parse_token(presence.key)
        if endpoint is None or not endpoint.name.endswith(EVENTS_TOPIC):
            return
        server = endpoint.name.removesuffix(EVENTS_TOPIC)
        with self._lock:
            if presence.alive and (node, server) not in self._subscriptions:
                self._subscriptions[node, server] = _Subscription(server, node, self._on_sample)
            link = self._find(server, endpoint.session)
            if link is None and presence.alive:
                link = self._assign(server, endpoint, node)
        if link is not None:
            link.on_presence(presence.key, alive=presence.alive)

    def _find(self, server: str, session: str) -> Link | None:
        """The link to the server of that name in that session."""
        links = self._links.values()
        return next((o for o in links if (o.server, o.session) == (server, session)), None)

    def _assign(self, server: str, endpoint: Endpoint, node: Node) -> Link:
        """Give a new server the link of one of its name that has gone, otherwise a new link."""
        for number in itertools.count(1):
            name = server if number == 1 else f"{server} ({number})"
            link = self._links.get(name)
            if link is None:
                machine = self._machines.obtain(name)
                link = Link(server, machine, node, control=self._control)
                self._links[name] = link
            if not link.alive and link.on(node):
                link.adopt(endpoint)
                return link
        raise AssertionError  # unreachable: `count` is endless

    def _on_sample(self, server: str, sample: Sample) -> None:
        with self._lock:
            link = self._find(server, sample.source)
        if link is not None:
            link.on_sample(sample)


class _Subscription:
    """Receives from all servers of one name, with the session of each sample.

    `Subscriber` passes on only messages, not their source, so this subscribes to the transport.
    """

    def __init__(self, server: str, node: Node, on_sample: Callable[[str, Sample], None]) -> None:
        transport = node.transport
        self._parts: list[Closable] = []
        for topic in (EVENTS_TOPIC, DESCRIPTION_TOPIC, STATE_TOPIC, OBSERVED_TOPIC):
            name = server + topic
            end = node.endpoint(Kind.SUBSCRIBER, name, String._type, String._md5sum)
            self._parts += [
                transport.subscribe(name, lambda sample: on_sample(server, sample)),
                transport.declare_alive(token_key(end)),
            ]

    def close(self) -> None:
        """Stop receiving."""
        for part in self._parts:
            part.close()


class Link:
    """Follows one server at a time; when it has gone, the next one of its name.

    A single thread handles everything that is received, in order: an event cannot be added while
    the history is being replaced.
    """

    def __init__(self, server: str, machine: Machine, node: Node, *, control: bool) -> None:
        self.server = server
        self.session = ""
        self._machine = machine
        self._node = node
        self._executor = SerialExecutor(node.clock, f"link to {server}")
        self._alive: set[str] = set()  # keys of the server's tokens
        self._closed = False
        self._received: deque[str] = deque()
        self._client = ControlClient(f"/{server}", node) if control else None
        self._values = ServiceProxy(
            f"/{server}{VALUE_SERVICE}", ReadValue, timeout=VALUE_S, node=node
        )

    @property
    def alive(self) -> bool:
        """Whether its server is connected."""
        return bool(self._alive)

    def on(self, node: Node) -> bool:
        """Return whether it follows servers on the network of `node`."""
        return self._node is node

    def is_twin(self, other: Link) -> bool:
        """Return whether a command to one of the two would reach both."""
        return self.server == other.server and self._node is other._node

    def adopt(self, endpoint: Endpoint) -> None:
        """Follow another server from now on."""
        self.session = endpoint.session
        self._machine.node = endpoint.node

    def close(self) -> None:
        """Stop following; a second call does nothing."""
        self._closed = True
        self._values.close()
        if self._client is not None:
            self._client.close()
        self._executor.join(HISTORY_S)

    def send(self, command: dict[str, Any]) -> dict[str, Any]:
        """Send a command and return the machine's answer."""
        if self._client is None:
            raise CommandError(f"{self.server}: this viewer sends no commands. Try --control.")
        return self._client.send(command)

    def answer(self, command: dict[str, Any]) -> dict[str, Any]:
        """Answer a question of the machine; this works without remote control."""
        words = [command.get(name) for name in ("path", "answer", "by")]
        if not all(isinstance(word, str) for word in words):
            raise CommandError(
                f"command 'answer': got {command}; expected the texts path, answer and by."
            )
        path, answer, by = map(str, words)
        question = self._machine.questions().get(path)
        if question is None:
            raise CommandError(f"{path}: answer: got {answer!r}; nobody asks that any more.")
        give_answer(question["service"], answer, by, node=self._node)
        return {"ok": True, "text": ""}

    def picture(self, path: str) -> tuple[str, bytes] | None:
        """Return media type and bytes of a question's picture; None if it has none."""
        question = self._machine.questions().get(path)
        return None if question is None else fetch_picture(question["service"], node=self._node)

    def value(self, container: str, key: str) -> str:
        """Return the present value of a userdata key, unabridged."""
        try:
            answer = self._values(container, key)
        except ActionlibError as error:
            raise CommandError(str(error)) from error
        if not answer.success:
            raise CommandError(answer.text)
        text: str = answer.text
        return text

    def on_presence(self, key: str, *, alive: bool) -> None:
        """Handle the appearance or disappearance of the server."""
        if alive:
            self._alive.add(key)
            self._executor.submit(self._on_appeared)
        else:
            self._alive.discard(key)
            self._executor.submit(self._on_gone)

    def on_sample(self, sample: Sample) -> None:
        """Handle a message of the server."""
        if sample.key.endswith(DESCRIPTION_TOPIC):
            self._executor.submit(lambda: self._describe(_text(sample)))
            return
        if sample.key.endswith(STATE_TOPIC):
            self._executor.submit(lambda: self._machine.set_control(json.loads(_text(sample))))
            return
        if sample.key.endswith(OBSERVED_TOPIC):
            self._executor.submit(lambda: self._machine.observe([_record(_text(sample))]))
            return
        self._received.append(_text(sample))
        if len(self._received) == 1:  # otherwise a call of `_add` is pending and takes it too
            self._executor.submit(self._add)

    def lose(self) -> None:
        """Handle the end of its network."""
        self._alive.clear()
        self._executor.submit(self._on_gone)

    def _on_appeared(self) -> None:
        self._read_history()
        self._node.clock.sleep(SETTLE_S)
        self._read_history()

    def _on_gone(self) -> None:
        if not self._alive:
            self._machine.set_stale(self._node.clock.time_ns())

    def _add(self) -> None:
        self._node.clock.sleep(GATHER_S)
        # Not `clear`: the receiving thread may have appended since the copy.
        texts = list(self._received)
        for _ in texts:
            self._received.popleft()
        events = [_record(text) for text in texts]
        # Only the history says to which durable mission a new run belongs.
        begins = any(event["kind"] in {"Started", "Recovered"} for event in events)
        if not self._machine.add(events) or begins:
            self._read_history()
        if self._received:  # `on_sample` submits only for the first one of an empty queue
            self._executor.submit(self._add)

    def _describe(self, text: str) -> None:
        self._machine.describe(StateRecord.from_json(text))

    def _read_history(self) -> None:
        if self._closed or not self._alive:
            return
        history = self._ask_history()
        if history is None:
            logger.info("%s: no history yet", self.server)
            self._node.clock.call_later(RETRY_S, lambda: self._executor.submit(self._read_history))
            return
        # The same program as before: add what is missing, so that the page need not begin anew.
        machine = self._machine
        known = machine.record is not None and machine.problems == history["problems"]
        if known and machine.epoch == history["epoch"]:
            machine.set_stale(None)
            if history.get("control") is not None:
                machine.set_control(history["control"])
            machine.observe(history.get("observed") or ())
            machine.run = str(history.get("run") or "")
            if machine.add(history["events"]):
                return
        machine.reset(history)

    def _ask_history(self) -> dict[str, Any] | None:
        """Request the history; of several servers of the name, only this link's answer counts."""
        replies: list[Reply] = []
        done = self._node.clock.event(f"history of {self.server}")
        asked = self._node.clock.time_ns()
        query = self._node.transport.query(
            self.server + HISTORY_SERVICE,
            Trigger._request_class().to_bytes(),
            encoding=encoding_of(Trigger),
            timeout=HISTORY_S,
            on_reply=replies.append,
            on_done=done.set,
        )
        done.wait(HISTORY_S + 1.0)
        # The server's time is taken for that in the middle between request and answer, as in NTP.
        middle = (asked + self._node.clock.time_ns()) // 2
        query.close()
        answers = [Trigger._response_class.from_bytes(r.payload) for r in replies if not r.error]
        for answer in answers:
            history = _record(answer.message)
            if history.get("session", self.session) == self.session:
                if "now" in history:
                    self._machine.behind = middle - history["now"]
                return history
        return None


def _text(sample: Sample) -> str:
    text: str = String.from_bytes(sample.payload).data
    return text


def _record(text: str) -> dict[str, Any]:
    """Parse a machine's message; NaN and infinities become text, as browsers' JSON has none."""
    record: dict[str, Any] = json.loads(text, parse_constant=str)
    return record
