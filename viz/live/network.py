"""Finds running machines on the network and follows them, across restarts of either side.

Two machines of one name are two machines: what they send is told apart by their network sessions.
The first is shown under its name, the others as "name (2)" and so on.
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
VALUE_S = 10.0
"""A whole value may have megabytes; of a server that has gone one hears at once."""

RETRY_S = 0.5
GATHER_S = 0.014
"""Events are worked off together that come so close to each other."""

SETTLE_S = 0.3
"""An event may slip through until a server has seen its new listener: the history is read again."""


class Network:
    """Keeps `machines` up to date with what runs on the network, or on several.

    Args:
        node: Where to look; `join` adds others.
        machines: What to keep.
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
        """Look where `node` is too."""
        pattern = token_pattern(Kind.PUBLISHER, f"**{EVENTS_TOPIC}")
        on_presence = partial(self._on_presence, node)
        self._watches[node] = node.transport.watch_alive(pattern, on_presence)

    def leave(self, node: Node) -> None:
        """Look where `node` is no more: its machines have gone."""
        self._watches.pop(node).close()
        with self._lock:
            subscriptions = [
                self._subscriptions.pop(key) for key in list(self._subscriptions) if key[0] is node
            ]
            links = {name: link for name, link in self._links.items() if link.on(node)}
            for name in links:
                del self._links[name]
        for link in links.values():
            link.lose()
        parts: list[Link | _Subscription] = [*subscriptions, *links.values()]
        for part in parts:
            part.close()

    def close(self) -> None:
        """Follow nothing any more; a second call does nothing."""
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
            CommandError: no such machine, two of one name, a wrong command, or no answer.

        Blocks: until the answer, some seconds at most.
        """
        link = self._link(name)
        if command.get("command") == "answer":  # a service of the question: it reaches no twin
            return link.answer(command)
        with self._lock:
            links = list(self._links.values())
        twins = [one for one in links if one.alive and one.is_twin(link)]
        if len(twins) > 1:
            raise CommandError(
                f"{name}: {len(twins)} machines are called {link.server!r}, and a command would "
                "reach all; expected one. Give each a name or a namespace of its own."
            )
        return link.send(command)

    def value(self, name: str, container: str, key: str) -> str:
        """Return a value of a machine's userdata as it is now, whole.

        Raises:
            CommandError: no such machine or value, or no answer.

        Blocks: until the answer, some seconds at most.
        """
        return self._link(name).value(container, key)

    def picture(self, name: str, path: str) -> tuple[str, bytes] | None:
        """Return media type and bytes of the picture of a question; None when there is none.

        Raises:
            CommandError: no such machine.

        Blocks: until it has come, some seconds at most.
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
            link = self._of(server, endpoint.session)
            if link is None and presence.alive:
                link = self._take_in(server, endpoint, node)
        if link is not None:
            link.on_presence(presence.key, alive=presence.alive)

    def _of(self, server: str, session: str) -> Link | None:
        """The link to the server of that name in that session."""
        links = self._links.values()
        return next((o for o in links if (o.server, o.session) == (server, session)), None)

    def _take_in(self, server: str, endpoint: Endpoint, node: Node) -> Link:
        """The link for a server that is new: that of one that has gone, else another one."""
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
        raise AssertionError  # numbers do not end

    def _on_sample(self, server: str, sample: Sample) -> None:
        with self._lock:
            link = self._of(server, sample.source)
        if link is not None:
            link.on_sample(sample)


class _Subscription:
    """Receives from all servers of one name, and from which of them; a `Subscriber` does not."""

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
        """Receive nothing any more."""
        for part in self._parts:
            part.close()


class Link:
    """Follows one server at a time: when it has gone, the next one of its name.

    What it receives is worked off in order, one at a time, so that nothing is between the history
    and the events after it.
    """

    def __init__(self, server: str, machine: Machine, node: Node, *, control: bool) -> None:
        self.server = server
        self.session = ""
        self._machine = machine
        self._node = node
        self._executor = SerialExecutor(node.clock, f"link to {server}")
        self._alive: set[str] = set()
        self._closed = False
        self._received: deque[str] = deque()
        self._client = ControlClient(f"/{server}", node) if control else None
        self._values = ServiceProxy(
            f"/{server}{VALUE_SERVICE}", ReadValue, timeout=VALUE_S, node=node
        )

    @property
    def alive(self) -> bool:
        """Whether its server is there."""
        return bool(self._alive)

    def on(self, node: Node) -> bool:
        """Tell whether its servers are where `node` is."""
        return self._node is node

    def is_twin(self, other: Link) -> bool:
        """Tell whether a command to one of the two would reach both."""
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
        """Send a command and return the answer; the machine tells what has become of it."""
        if self._client is None:
            raise CommandError(f"{self.server}: this viewer only looks. Try --control.")
        return self._client.send(command)

    def answer(self, command: dict[str, Any]) -> dict[str, Any]:
        """Answer a question of the machine, whether it takes other commands or not."""
        words = [command.get(name) for name in ("path", "answer", "by")]
        if not all(isinstance(word, str) for word in words):
            raise CommandError(
                f"command 'answer': got {command}; expected path, answer, by as texts."
            )
        path, answer, by = map(str, words)
        question = self._machine.questions().get(path)
        if question is None:
            raise CommandError(f"{path}: answer: got {answer!r}; nobody asks that any more.")
        give_answer(question["service"], answer, by, node=self._node)
        return {"ok": True, "text": ""}

    def picture(self, path: str) -> tuple[str, bytes] | None:
        """Return media type and bytes of the picture of a question; None when there is none."""
        question = self._machine.questions().get(path)
        return None if question is None else fetch_picture(question["service"], node=self._node)

    def value(self, container: str, key: str) -> str:
        """Return a value of the machine's userdata, whole."""
        try:
            answer = self._values(container, key)
        except ActionlibError as error:
            raise CommandError(str(error)) from error
        if not answer.success:
            raise CommandError(answer.text)
        text: str = answer.text
        return text

    def on_presence(self, key: str, *, alive: bool) -> None:
        """A server of this name has come or gone."""
        if alive:
            self._alive.add(key)
            self._executor.submit(self._come)
        else:
            self._alive.discard(key)
            self._executor.submit(self._go)

    def on_sample(self, sample: Sample) -> None:
        """Take what the server has sent."""
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
        if len(self._received) == 1:  # the others go with the first
            self._executor.submit(self._add)

    def lose(self) -> None:
        """Its network has gone."""
        self._alive.clear()
        self._executor.submit(self._go)

    def _come(self) -> None:
        self._read_history()
        self._node.clock.sleep(SETTLE_S)
        self._read_history()

    def _go(self) -> None:
        if not self._alive:
            self._machine.set_stale(self._node.clock.time_ns())

    def _add(self) -> None:
        self._node.clock.sleep(GATHER_S)
        texts = list(self._received)
        for _ in texts:
            self._received.popleft()
        events = [_record(text) for text in texts]
        begins = any(event["kind"] in {"Started", "Recovered"} for event in events)
        if not self._machine.add(events) or begins:  # of which mission the run is, is there
            self._read_history()
        if self._received:
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
        """The answer of this link's own server, should there be several of the name."""
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
    """What a mission tells; NaN and infinite numbers as texts, for browsers do not know them."""
    record: dict[str, Any] = json.loads(text, parse_constant=str)
    return record
