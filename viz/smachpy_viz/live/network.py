"""Finds running machines on the network and follows them, across restarts on both sides.

Machines of the same name are distinguished by their network sessions. The first one is shown under
its name, further ones as "name (2)" and so on.
"""

from __future__ import annotations

import itertools
import logging
import re
import threading
from collections import deque
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import SerialExecutor
from actionlib_core.exceptions import ActionlibError
from actionlib_core.inputs import json_text
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.transport.tokens import Kind, parse_token, token_key, token_pattern
from actionlib_core.wire.encoding import encoding_of
from smachpy.network.feed import DESCRIPTION_TOPIC, EVENTS_TOPIC, HISTORY_SERVICE, OBSERVED_TOPIC
from smachpy.network.reading import (
    MAX_COMMAND_LENGTH,
    MAX_EVENT_LENGTH,
    MAX_OBSERVED_LENGTH,
    read_control_state,
    read_description,
    read_history,
    read_numbered_event,
    read_observation,
)
from smachpy.network.remote_control import STATE_TOPIC, CommandError, ControlClient
from smachpy.network.values import VALUE_SERVICE, ReadValue
from smachpy.states.questions import fetch_picture, give_answer
from smachpy_viz.live.machines import MAX_MACHINES

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence, Reply, Sample
    from actionlib_core.transport.tokens import Endpoint
    from smachpy_viz.live.machines import Machine, Machines

logger = logging.getLogger("smachpy_viz.live")

HISTORY_S = 3.0
"""Longest wait for a machine's history [s]."""

VALUE_S = 10.0
"""Longest wait for a value, which may have megabytes [s]; if the server goes, it ends at once."""

RETRY_S = 0.5
"""Time until a history that did not come is requested again [s]; doubled each time."""

MAX_RETRY_S = 30.0

GATHER_S = 0.014
"""Time in which received messages are gathered and then handled together [s]."""

SETTLE_S = 0.3
"""Time after which a new server's history is read again, and one that has gone is left [s].

Until the server knows its new subscriber, events can be lost between the first reading and the
first event that is received. At the end, its last events arrive after the end of its token."""

MAX_RECEIVED_ITEMS = 20_000
"""Messages of a machine that wait to be handled; with more, its history is read instead."""

MAX_REPLIES = 8
"""Answers to one request for a history: several servers may have the machine's name."""

MAX_NAME_LENGTH = 300
"""Longest name of a machine that is followed [characters]."""

ASK_S = 5.0
"""Longest wait for the token of a question, on a busy computer [s]."""


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
        self._is_full = False  # whether there were too many machines at the last look
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
            CommandError: there is no such machine, it is gone, or there are two; the command is
                wrong; or there is no answer.

        Blocks: until the answer, a few seconds at most.
        """
        # Each question has a service of its own.
        if command.get("command") == "answer":
            return self._link(name).answer(command)
        return self._alone(name).send(command)

    def value(self, name: str, container: str, key: str) -> str:
        """Return the present value of a userdata key, unabridged.

        Raises:
            CommandError: there is no such machine, it is gone, or there are two; there is no such
                value, or no answer.

        Blocks: until the answer, a few seconds at most.
        """
        return self._alone(name).value(container, key)

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

    def _alone(self, name: str) -> Link:
        """The link to a machine that has its services' names, which have no session, to itself."""
        link = self._link(name)
        with self._lock:
            links = list(self._links.values())
        if not link.alive:  # a namesake would answer
            raise CommandError(f"{name}: the machine is gone; expected one that is there.")
        twins = [one for one in links if one.alive and one.is_twin(link)]
        if len(twins) > 1:
            raise CommandError(
                f"{name}: got {len(twins)} machines with the name {link.server!r}, which would all "
                "be asked; expected one. Give each its own name or namespace."
            )
        return link

    def _on_presence(self, node: Node, presence: Presence) -> None:
        endpoint = parse_token(presence.key)
        if endpoint is None or not endpoint.name.endswith(EVENTS_TOPIC):
            return
        server = endpoint.name.removesuffix(EVENTS_TOPIC)
        with self._lock:
            link = self._find(server, endpoint.session)
            if link is None and presence.alive and self._has_room(server):
                link = self._assign(server, endpoint, node)
            if link is not None and presence.alive and (node, server) not in self._subscriptions:
                self._subscriptions[node, server] = _Subscription(server, node, self._on_sample)
        if link is not None:
            link.on_presence(presence.key, alive=presence.alive)

    def _has_room(self, server: str) -> bool:
        if len(server) > MAX_NAME_LENGTH:
            return False
        alive = sum(link.alive for link in self._links.values())
        if alive >= MAX_MACHINES and not self._is_full:
            logger.error("more than %d machines: others are not followed", MAX_MACHINES)
        self._is_full = alive >= MAX_MACHINES
        return not self._is_full

    def _on_gone(self, link: Link) -> None:
        """Leave the topics of a server that has gone; forget it if it was never shown.

        Anybody can invent tokens: without a machine behind them, nothing of them is left.
        """
        with self._lock:
            if link.alive:  # it came back meanwhile
                return
            others = (one for one in self._links.values() if one.is_twin(link) and one.alive)
            key = link.node, link.server
            unused = None if any(others) else self._subscriptions.pop(key, None)
            forgotten = [link] if link.machine.record is None else []
            stale = [one for one in self._links.values() if not one.alive]
            forgotten += stale[: max(0, len(stale) - MAX_MACHINES)]  # the oldest ones
            for one in forgotten:
                if self._links.get(one.machine.name) is one:
                    del self._links[one.machine.name]
                    self._machines.forget(one.machine.name)
        if unused is not None:
            unused.close()
        for one in forgotten:
            one.end()

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
                link = Link(server, machine, node, self._on_gone, control=self._control)
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
    the history is being replaced. What is wrong in a message is counted, and left out.

    Args:
        server: Name of the server.
        machine: The machine that shows it.
        node: The node on its network.
        on_gone: Called when the server has gone.
        control: Whether commands may be sent.

    Attributes:
        session: Session of the server.
    """

    def __init__(
        self,
        server: str,
        machine: Machine,
        node: Node,
        on_gone: Callable[[Link], object],
        *,
        control: bool,
    ) -> None:
        self.server = server
        self.session = ""
        self._shown = ""  # session of the newest history, to which the machine's events belong
        self.machine = machine
        self.node = node
        self._on_gone = on_gone
        self._control = control
        self._executor = SerialExecutor(node.clock, f"link to {server}")
        self._alive: set[str] = set()  # keys of the server's tokens
        self._closed = False
        self._received: deque[Sample] = deque()
        self._missed = False  # whether messages were dropped, so that the history is needed
        self._query: Closable | None = None  # for the history, while it is asked for
        self._again = False  # whether to ask for it once more
        self._pause = RETRY_S

    @cached_property
    def client(self) -> ControlClient:
        """Sends commands to the server; made when it is needed, as it leaves data in the node."""
        return ControlClient(f"/{self.server}", self.node)

    @cached_property
    def values(self) -> ServiceProxy:
        """Reads whole values; as `client`."""
        name = f"/{self.server}{VALUE_SERVICE}"
        return ServiceProxy(name, ReadValue, timeout=VALUE_S, node=self.node)

    @property
    def alive(self) -> bool:
        """Whether its server is connected."""
        return bool(self._alive)

    def on(self, node: Node) -> bool:
        """Return whether it follows servers on the network of `node`."""
        return self.node is node

    def is_twin(self, other: Link) -> bool:
        """Return whether a command to one of the two would reach both."""
        return self.server == other.server and self.node is other.node

    def adopt(self, endpoint: Endpoint) -> None:
        """Follow another server from now on."""
        self.session = endpoint.session
        self.machine.node = endpoint.node

    def end(self) -> None:
        """Stop following, without waiting; a second call does nothing."""
        self._closed = True
        for part in ("values", "client"):
            if part in self.__dict__:
                self.__dict__[part].close()
        query = self._query
        if query is not None:
            query.close()

    def close(self) -> None:
        """Stop following; a second call does nothing."""
        self.end()
        self._executor.join(HISTORY_S)

    def send(self, command: dict[str, Any]) -> dict[str, Any]:
        """Send a command and return the machine's answer."""
        if not self._control:
            raise CommandError(f"{self.server}: this viewer sends no commands. Try --control.")
        return self.client.send(command)

    def answer(self, command: dict[str, Any]) -> dict[str, Any]:
        """Answer a question of the machine; this works without remote control."""
        words = [command.get(name) for name in ("path", "answer", "by")]
        if not all(isinstance(word, str) for word in words):
            raise CommandError(
                f"command 'answer': got {command}; expected the texts path, answer and by."
            )
        path, answer, by = map(str, words)
        service = self._service_of(path)
        if service is None:
            raise CommandError(f"{path}: answer: got {answer!r}; nobody asks that any more.")
        give_answer(service, answer, by, node=self.node)
        return {"ok": True, "text": ""}

    def picture(self, path: str) -> tuple[str, bytes] | None:
        """Return media type and bytes of a question's picture; None if it has none."""
        service = self._service_of(path)
        return None if service is None else fetch_picture(service, node=self.node)

    def _service_of(self, path: str) -> str | None:
        """Return the service that takes the answer to an open question; None for none.

        It must be the machine's own: with the name of another one's, an operator would answer a
        question that was not shown.
        """
        question = self.machine.questions().get(path)
        if question is None:
            return None
        service: str = question["service"]
        pattern = token_pattern(Kind.SERVICE, service.removeprefix("/"), session=self.session)
        if not WORDS.fullmatch(service) or not self.node.transport.list_alive(pattern, ASK_S):
            return None
        return service

    def value(self, container: str, key: str) -> str:
        """Return the present value of a userdata key, unabridged."""
        try:
            answer = self.values(container, key)
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
            # Its last messages may be overtaken by the end of its token.
            gone = partial(self._on_disappeared, self.node.clock.time_ns())
            self.node.clock.call_later(SETTLE_S, lambda: self._executor.submit(gone))

    def on_sample(self, sample: Sample) -> None:
        """Handle a message of the server."""
        self._received.append(sample)
        waiting = len(self._received)
        if waiting > MAX_RECEIVED_ITEMS:
            self._received.clear()
            self._missed = True
        if waiting == 1:  # otherwise a call of `_take` is pending and handles it too
            self.node.clock.call_later(GATHER_S, lambda: self._executor.submit(self._take))

    def lose(self) -> None:
        """Handle the end of its network."""
        self._alive.clear()
        self._executor.submit(partial(self._on_disappeared, self.node.clock.time_ns()))

    def _on_appeared(self) -> None:
        self._pause = RETRY_S
        self._read_history()
        self.node.clock.call_later(SETTLE_S, lambda: self._executor.submit(self._read_history))

    def _on_disappeared(self, when: int) -> None:
        if not self._alive:
            self.machine.set_stale(when)
            self._on_gone(self)

    def _take(self) -> None:
        """Handle the messages that were received until now."""
        # Not `clear`: the receiving thread may have appended since the copy.
        samples = list(self._received)
        for _ in samples:
            self._received.popleft()
        if self._received:  # `on_sample` calls only for the first message of an empty queue
            self.node.clock.call_later(GATHER_S, lambda: self._executor.submit(self._take))
        events: list[dict[str, Any]] = []
        observed: list[dict[str, Any]] = []
        wrong: list[str] = []
        for sample in self._of_shown(samples):
            topic = "/smach/" + sample.key.rpartition("/")[2]
            try:
                text = _text(sample.payload, MAX_LENGTHS[topic])
                if topic == EVENTS_TOPIC:
                    events.append(read_numbered_event(text))
                elif topic == OBSERVED_TOPIC:
                    observed.append(read_observation(text))
                elif topic == DESCRIPTION_TOPIC:
                    self.machine.describe(read_description(text))
                else:
                    self.machine.set_control(read_control_state(text))
            except (ValueError, ActionlibError) as error:
                wrong.append(f"{topic}: {error}")
        self.machine.refuse(self._sender(), wrong)
        if observed:
            self.machine.observe(observed)
        # Only the history says to which durable mission a new run belongs.
        begins = any(event["kind"] in {"Started", "Recovered"} for event in events)
        missed, self._missed = self._missed, False
        if not self.machine.add(events) or begins or missed:
            self._read_history()

    def _of_shown(self, samples: list[Sample]) -> list[Sample]:
        """Leave out what a new program says before its history, which has that, too.

        Its events do not belong to the run that is shown.
        """
        found = [sample for sample in samples if self._shown in {"", sample.source}]
        if len(found) < len(samples) and self._query is not None:
            self._again = True  # that history was perhaps asked for before these events
        return found

    def _sender(self) -> str:
        return f"node {self.machine.node!r} in session {self.session}"

    def _read_history(self) -> None:
        """Ask for the history, unless that is being done: then once more afterwards."""
        if self._closed or not self._alive:
            return
        if self._query is not None:
            self._again = True
            return
        replies: list[Reply] = []
        asked = self.node.clock.time_ns()

        def take(reply: Reply) -> None:
            if len(replies) < MAX_REPLIES:
                replies.append(reply)

        self._query = self.node.transport.query(
            self.server + HISTORY_SERVICE,
            Trigger._request_class().to_bytes(),
            encoding=encoding_of(Trigger),
            timeout=HISTORY_S,
            on_reply=take,
            on_done=lambda: self._executor.submit(
                partial(self._take_replies, replies, (asked, self.node.clock.time_ns()))
            ),
        )

    def _take_replies(self, replies: list[Reply], times: tuple[int, int]) -> None:
        query, self._query = self._query, None
        if query is not None:
            query.close()
        again, self._again = self._again, False
        if self._closed or not self._alive:
            return
        if self._take_history(replies, times):
            self._pause = RETRY_S
        else:
            logger.info("%s: no history yet", self.server)
            pause, self._pause = self._pause, min(2 * self._pause, MAX_RETRY_S)
            again = False
            self.node.clock.call_later(pause, lambda: self._executor.submit(self._read_history))
        if again:
            self._read_history()

    def _take_history(self, replies: list[Reply], times: tuple[int, int]) -> bool:
        """Handle the history in the replies; return whether there is one.

        Of several servers of the name, only this link's answer counts.
        """
        wrong: list[str] = []
        session = self.session
        for reply in replies:
            if reply.error:
                continue
            try:
                text = _response_text(reply.payload)
                history, record, problems = read_history(text)
            except (ValueError, ActionlibError) as error:
                wrong.append(f"history: {error}")
                continue
            if history.get("session", session) == session:
                self.machine.refuse(self._sender(), [f"history: {one}" for one in problems])
                if "now" in history:
                    # It is taken for that in the middle between request and answer, as in NTP.
                    self.machine.behind = sum(times) // 2 - history["now"]
                self._show({**history, "description": record})
                self._shown = session
                return True
        self.machine.refuse(self._sender(), wrong)
        return False

    def _show(self, history: dict[str, Any]) -> None:
        # The same program as before: add what is missing, so that the page need not begin anew.
        machine = self.machine
        known = machine.record is not None and machine.problems == (history.get("problems") or [])
        if known and machine.epoch == history["epoch"]:
            machine.set_stale(None)
            if history.get("control") is not None:
                machine.set_control(history["control"])
            machine.observe(history["observed"])
            machine.run = history.get("run") or ""
            if machine.add(history["events"]):
                return
        machine.reset(history)


MAX_LENGTHS: Final = {
    EVENTS_TOPIC: MAX_EVENT_LENGTH,
    OBSERVED_TOPIC: MAX_OBSERVED_LENGTH,
    DESCRIPTION_TOPIC: json_text.MAX_JSON_LENGTH,
    STATE_TOPIC: MAX_COMMAND_LENGTH,
}
"""Longest text on each topic [bytes]."""

WORDS: Final = re.compile(r"/?\w[\w./-]*")
"""A name without wildcards, which in a pattern would match others."""


def _text(payload: bytes, longest: int) -> str:
    if len(payload) > longest:
        raise ValueError(f"got {len(payload):,} bytes; expected at most {longest:,}")
    text: str = String.from_bytes(payload).data
    return text


def _response_text(payload: bytes) -> str:
    if len(payload) > json_text.MAX_JSON_LENGTH:
        raise ValueError(
            f"got {len(payload):,} bytes; expected at most {json_text.MAX_JSON_LENGTH:,}"
        )
    text: str = Trigger._response_class.from_bytes(payload).message
    return text
