"""A machine on the network as a whole: its structure, its events and their history.

    <server>/smach/description   `smachpy.introspection.StateRecord`, latched      std_msgs/String
    <server>/smach/events        `smachpy.events` with sequence numbers `seq`      std_msgs/String
    <server>/smach/observed      data of the robot's topics (`observations`)       std_msgs/String
    <server>/smach/history       the run so far, for viewers that join late     std_srvs/Trigger
    <server>/smach/value         a userdata value in full (`smachpy.network.values`)

The history is a JSON object: `epoch` (an id that changes when the machine's server restarts),
`session` (id of the network session, which distinguishes two servers of one name), `run` (name of a
durable run, which another process may have begun; else ""), `description`, `problems` (found by
`smachpy.checks`), `base` (a `RunState` of the events that are no longer kept), `events` (the newest
ones, as they were sent), `observed` (the newest records of <server>/smach/observed), `control`
(paused and breakpoints; null if the server takes no commands), `now` (the server's time,
nanoseconds since the Unix epoch).
"""

from __future__ import annotations

import json
import threading
import uuid
from collections import deque
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import SerialExecutor, current_clock
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import NewsPublisher
from actionlib_core.transport.tokens import Kind, token_pattern
from smachpy.events import Recovered, Started, record_text
from smachpy.events.introspection import describe
from smachpy.events.run_state import RunState
from smachpy.network.robot_topics import RobotTopics
from smachpy.network.values import serve_values

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.node import Node
    from actionlib_core.transport import Presence
    from smachpy.machines.container import Container
    from smachpy.network.remote_control import ControlServer

EVENTS_TOPIC = "/smach/events"
DESCRIPTION_TOPIC = "/smach/description"
OBSERVED_TOPIC = "/smach/observed"
HISTORY_SERVICE = "/smach/history"

QUEUED_EVENTS = 20_000
"""Limit of the buffer; beyond it events are thinned out, which leaves gaps in `seq`."""

MAX_KEPT_EVENTS = 5_000
"""Number of events kept for viewers that join late, and number that may wait to be sent."""

MAX_KEPT_BYTES = 8_000_000
"""Limit of both in bytes of text."""

STOP_S = 1.0

_BEGINS = frozenset({Started.__name__, Recovered.__name__})


class Feed:
    """Sends the description and the events of a machine, and keeps the newest events.

    The machine only appends its events to a buffer. Another thread encodes and sends them, so that
    the machine never waits for the network.

    Args:
        server_name: First part of the topics' names.
        machine: The machine to show.
        path: Its path for viewers.
        node: Node that sends.
        control: The server of commands; None if the machine takes none.
        robot: Provides the data of the robot's topics; None for those in `node`'s namespace.
        earlier: Records of earlier processes of the durable run that this one resumes.
        on_paths: Called with path -> kind of its newest event, for the events that were just sent.
    """

    def __init__(
        self,
        server_name: str,
        machine: Container,
        path: str,
        node: Node,
        *,
        control: ControlServer | None = None,
        robot: RobotTopics | None = None,
        earlier: Sequence[dict[str, Any]] = (),
        on_paths: Callable[[dict[str, str]], object] = lambda _kinds: None,
    ) -> None:
        self._machine = machine
        self._path = path
        self._control = control
        self._on_paths = on_paths
        self._epoch = uuid.uuid4().hex
        self._lock = threading.Lock()
        self._kept: deque[tuple[dict[str, Any], str]] = deque()
        self._kept_bytes = 0
        self._base = RunState()
        self._run = machine._smachpy.live.journal.run
        self._before = earlier[-1]["seq"] if earlier else 0
        for record in earlier:
            self._keep(record, record_text(record))
        self._queue: deque[str] = deque()
        self._queued_bytes = 0
        self._executor = SerialExecutor(node.clock, f"events of {server_name}")
        self._description = ""
        self._problems: list[dict[str, str]] = []
        self._descriptions = NewsPublisher(
            server_name + DESCRIPTION_TOPIC, String, latch=True, node=node
        )
        self._describe()
        self._session = node.transport.session_id
        self._node = node
        self._clock = current_clock()  # the machine's, by which its events are stamped
        self._values = serve_values(server_name, machine, path, node)
        # A viewer may ask for the history as soon as its service exists, before all is set up.
        self._is_open = False
        self._buffer = machine.event_buffer(self._on_news, limit=QUEUED_EVENTS, name=path)
        self._robot = RobotTopics(node) if robot is None else robot
        self._stop_listening: Callable[[], None] | None = None  # to the robot's topics
        self._watchers: set[str] = set()
        self._observed = NewsPublisher(server_name + OBSERVED_TOPIC, String, node=node)
        self._presence = node.transport.watch_alive(
            token_pattern(Kind.SUBSCRIBER, self._observed.resolved_name), self._on_watcher
        )
        self._history = Service(
            server_name + HISTORY_SERVICE, Trigger, self._answer, node=node, alone=False
        )
        # Last, because viewers find machines by this topic.
        self._events = NewsPublisher(server_name + EVENTS_TOPIC, String, node=node)
        self._is_open = True

    def close(self) -> None:
        """Send the waiting events, then leave the topics.

        Blocks: at most 2 s.
        """
        # First stop what submits work, then let the executor do the rest, then leave the topics.
        self._presence.close()
        self._watchers.clear()
        self._executor.submit(self._listen)
        self._buffer.close()
        self._on_news()
        if not self._executor.join(STOP_S):
            with self._lock:
                self._queue.clear()  # the network does not take them
            self._executor.join(STOP_S)
        self._descriptions.unregister()
        self._history.close()
        self._values.close()
        self._events.unregister()
        self._observed.unregister()

    def _on_watcher(self, presence: Presence) -> None:
        """Listen to the robot's topics only while a viewer subscribes to them here."""
        if presence.alive:
            self._watchers.add(presence.key)
        else:
            self._watchers.discard(presence.key)
        self._executor.submit(self._listen)

    def _listen(self) -> None:
        if self._watchers and self._stop_listening is None:
            self._stop_listening = self._robot.listen(
                lambda record: self._observed.publish(record_text(self._buffer.steady(record)))
            )
        elif not self._watchers and self._stop_listening is not None:
            self._stop_listening()
            self._stop_listening = None

    def _on_news(self) -> None:
        self._executor.submit(self._work)

    def _work(self) -> None:
        """Send new events; submit itself again until there are none."""
        kinds = self._collect()
        self._on_paths(kinds)
        self._send()
        if kinds:
            self._on_news()

    def _collect(self) -> dict[str, str]:
        """Encode new events; return path -> kind of its newest event."""
        # Called by the executor and by the history service; the lock keeps the events in order.
        # Without a viewer nothing is sent: the next one gets these events with the history.
        kinds: dict[str, str] = {}
        with self._lock:
            wanted = self._is_open and self._events.get_num_connections() > 0
            for record in self._buffer.read():
                kinds[record["path"]] = record["kind"]
                if record["kind"] in _BEGINS:
                    self._executor.submit(self._describe)
                    self._run = self._machine._smachpy.live.journal.run
                record["seq"] += self._before  # continues the numbers of the earlier process
                text = record_text(record)
                self._keep(record, text)
                if wanted:
                    self._enqueue(text)
        return kinds

    def _keep(self, record: dict[str, Any], text: str) -> None:
        self._kept.append((record, text))
        self._kept_bytes += len(text)
        # Events that are dropped here go into `base`, so that the history is still complete.
        while len(self._kept) > MAX_KEPT_EVENTS or self._kept_bytes > MAX_KEPT_BYTES:
            old, text = self._kept.popleft()
            self._kept_bytes -= len(text)
            self._base.fold(old)

    def _enqueue(self, text: str) -> None:
        """Queue an event for sending; drop the oldest ones if too many wait.

        A viewer that notices the gap asks for the history.
        """
        self._queue.append(text)
        self._queued_bytes += len(text)
        while len(self._queue) > MAX_KEPT_EVENTS or self._queued_bytes > MAX_KEPT_BYTES:
            self._queued_bytes -= len(self._queue.popleft())

    def _answer(self, _request: object) -> tuple[bool, str]:
        """Return the history, for the service."""
        kinds = self._collect()
        if kinds:
            self._executor.submit(lambda: self._on_paths(kinds))
            self._on_news()
        head = {
            "epoch": self._epoch,
            "session": self._session,
            "run": self._run,
            "description": json.loads(self._description),
            "problems": self._problems,
            "control": None if self._control is None else self._control.state(),
            "now": self._buffer.now_ns() or self._clock.time_ns(),
        }
        with self._lock:
            base = json.dumps(self._base.data)
            kept = [text for _, text in self._kept]
        head["observed"] = [self._buffer.steady(record) for record in self._robot.kept()]
        text = json.dumps(head)[:-1]
        return True, f'{text}, "base": {base}, "events": [{", ".join(kept)}]}}'

    def _send(self) -> None:
        while True:
            with self._lock:
                if not self._queue:
                    return
                text = self._queue.popleft()
                self._queued_bytes -= len(text)
            self._events.publish(text)

    def _describe(self) -> None:
        text = describe(self._machine, name=self._path.strip("/")).to_json()
        if text != self._description:
            self._description = text
            self._descriptions.publish(text)
            self._executor.submit(self._look_for_problems)

    def _look_for_problems(self) -> None:
        self._problems = _problems(self._machine, self._path)


def _problems(machine: Container, path: str) -> list[dict[str, str]]:
    from smachpy.checks import check

    found = check(machine, name=path.strip("/")).problems
    return [
        {
            "rule": one.rule,
            "severity": one.severity,
            "path": one.path,
            "text": f"{one.message} {one.hint}".strip(),
        }
        for one in found
    ]
