"""Finds running machines on the network and follows them, across restarts of either side."""

from __future__ import annotations

import json
import logging
import threading
from collections import deque
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import SerialExecutor
from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.presence import Kind, parse_token, token_pattern
from actionlib_core.service import ServiceProxy
from actionlib_core.topic import Subscriber
from smachpy.feed import DESCRIPTION_TOPIC, EVENTS_TOPIC, HISTORY_SERVICE
from smachpy.introspection import StateRecord
from smachpy.remote_control import CommandError, ControlClient

if TYPE_CHECKING:
    from actionlib_core.node import Node
    from actionlib_core.transport import Presence
    from viz.live.machines import Machine, Machines

logger = logging.getLogger("viz.live")

HISTORY_S = 3.0
RETRY_S = 0.5
GATHER_S = 0.014
"""Events are worked off together that come so close to each other."""

SETTLE_S = 0.3
"""An event may slip through until a server has seen its new listener: the history is read again."""


class Network:
    """Keeps `machines` up to date with what runs on the network.

    Args:
        node: Where to look.
        machines: What to keep.
        control: Whether commands may be sent.

    Threads: every method may be called from any thread.
    """

    def __init__(self, node: Node, machines: Machines, *, control: bool = False) -> None:
        self._node = node
        self._machines = machines
        self._control = control
        self._lock = threading.Lock()
        self._links: dict[str, Link] = {}
        pattern = token_pattern(Kind.PUBLISHER, f"**{EVENTS_TOPIC}")
        self._watch = node.transport.watch_alive(pattern, self._on_presence)

    def close(self) -> None:
        """Follow nothing any more; a second call does nothing."""
        self._watch.close()
        with self._lock:
            links = list(self._links.values())
            self._links.clear()
        for link in links:
            link.close()

    def send(self, name: str, command: dict[str, Any]) -> dict[str, Any]:
        """Send a command to a machine and return the answer.

        Raises:
            CommandError: no such machine, a wrong command, or no answer.

        Blocks: until the answer, some seconds at most.
        """
        link = self._links.get(name)
        if link is None:
            raise CommandError(f"{name}: no such machine; expected one of {sorted(self._links)}.")
        return link.send(command)

    def _on_presence(self, presence: Presence) -> None:
        endpoint = parse_token(presence.key)
        if endpoint is None or not endpoint.name.endswith(EVENTS_TOPIC):
            return
        name = endpoint.name.removesuffix(EVENTS_TOPIC)
        with self._lock:
            link = self._links.get(name)
            if link is None and presence.alive:
                machine = self._machines.obtain(name)
                link = self._links[name] = Link(name, machine, self._node, control=self._control)
        if link is not None:
            link.on_presence(presence.key, alive=presence.alive)


class Link:
    """Follows one server.

    What it hears is worked off in order, one at a time, so that nothing is between the history and
    the events after it.
    """

    def __init__(self, name: str, machine: Machine, node: Node, *, control: bool) -> None:
        self._name = name
        self._machine = machine
        self._node = node
        self._executor = SerialExecutor(node.clock, f"link to {name}")
        self._alive: set[str] = set()
        self._closed = False
        self._heard: deque[str] = deque()
        server = f"/{name}"
        self._client = ControlClient(server, node) if control else None
        self._history = ServiceProxy(
            server + HISTORY_SERVICE, Trigger, timeout=HISTORY_S, node=node
        )
        self._topics = (
            Subscriber(server + EVENTS_TOPIC, String, self._take, node=node),
            Subscriber(server + DESCRIPTION_TOPIC, String, self._take_description, node=node),
        )

    def close(self) -> None:
        """Stop following; a second call does nothing."""
        self._closed = True
        for topic in self._topics:
            topic.unregister()
        self._history.close()
        if self._client is not None:
            self._client.close()
        self._executor.join(HISTORY_S)

    def send(self, command: dict[str, Any]) -> dict[str, Any]:
        """Send a command and return the answer."""
        if self._client is None:
            raise CommandError(f"{self._name}: this viewer only looks. Try --control.")
        answer = self._client.send(command)
        self._machine.set_control(answer)
        return answer

    def on_presence(self, key: str, *, alive: bool) -> None:
        """A server of this name has come or gone."""
        self._executor.submit(lambda: self._come(key) if alive else self._go(key))

    def _come(self, key: str) -> None:
        self._alive.add(key)
        self._read_history()
        self._node.clock.sleep(SETTLE_S)
        self._read_history()

    def _go(self, key: str) -> None:
        self._alive.discard(key)
        if not self._alive:
            self._machine.set_stale(self._node.clock.time_ns())

    def _take(self, message: Any) -> None:
        self._heard.append(message.data)
        if len(self._heard) == 1:  # the others go with the first
            self._executor.submit(self._add)

    def _add(self) -> None:
        self._node.clock.sleep(GATHER_S)
        texts = list(self._heard)
        for _ in texts:
            self._heard.popleft()
        if not self._machine.add([json.loads(text) for text in texts]):
            self._read_history()
        if self._heard:
            self._executor.submit(self._add)

    def _take_description(self, message: Any) -> None:
        self._executor.submit(lambda: self._machine.describe(StateRecord.from_json(message.data)))

    def _read_history(self) -> None:
        if self._closed or not self._alive:
            return
        try:
            answer = self._history.call()
        except ActionlibError as error:
            logger.info("%s: no history yet: %s", self._name, error)
            self._node.clock.call_later(RETRY_S, lambda: self._executor.submit(self._read_history))
            return
        history = json.loads(answer.message)
        machine = self._machine
        known = machine.record is not None and machine.problems == history["problems"]
        if known and machine.epoch == history["epoch"]:
            machine.set_stale(None)
            if machine.add(history["events"]):
                return
        machine.reset(history)
