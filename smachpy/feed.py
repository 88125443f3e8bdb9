"""What the machine as a whole shows of itself on the network: description, events, history.

    <server>/smach/description   `smachpy.introspection.StateRecord`, latched      std_msgs/String
    <server>/smach/events        `smachpy.events` with sequence numbers `seq`      std_msgs/String
    <server>/smach/history       what a viewer that comes late needs              std_srvs/Trigger

The history is JSON: `epoch` (which machine this is: another one after a restart), `description`,
`problems` (what a check found), `base` (a `smachpy.run_state.RunState` of what is too long ago),
`events` (the newest, as they were sent), `control` (paused and breakpoints, null where
no commands are obeyed).
"""

from __future__ import annotations

import itertools
import json
import threading
import uuid
from collections import deque
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import SerialExecutor
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.service import Service
from actionlib_core.topic import Publisher
from smachpy.events import Started, to_record
from smachpy.introspection import describe
from smachpy.run_state import RunState

if TYPE_CHECKING:
    from actionlib_core.node import Node
    from smachpy.container import Container
    from smachpy.events import Event
    from smachpy.remote_control import ControlServer

EVENTS_TOPIC = "/smach/events"
DESCRIPTION_TOPIC = "/smach/description"
HISTORY_SERVICE = "/smach/history"

QUEUED_EVENTS = 20_000
"""More than these wait for the network: the newest are dropped, which shows in `seq`."""

KEPT_EVENTS = 5_000
"""So many events are kept for viewers that come late."""

STOP_S = 1.0


class Feed:
    """Sends description and events of a machine, and remembers the newest events.

    The listener turns events into text at once, as their values may change later; another thread
    sends them, so that the machine never waits for the network.
    """

    def __init__(
        self,
        server_name: str,
        machine: Container,
        path: str,
        node: Node,
        *,
        control: ControlServer | None = None,
    ) -> None:
        self._machine = machine
        self._path = path
        self._root = path
        self._control = control
        self._epoch = uuid.uuid4().hex
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._kept: deque[tuple[dict[str, Any], str]] = deque()
        self._base = RunState()
        self._queue: deque[str] = deque()
        self._executor = SerialExecutor(node.clock, f"events of {server_name}")
        self._description = ""
        self._problems: list[dict[str, str]] = []
        self._descriptions = Publisher(
            server_name + DESCRIPTION_TOPIC, String, latch=True, node=node
        )
        self._describe()
        self._history = Service(server_name + HISTORY_SERVICE, Trigger, self._tell, node=node)
        self._events = Publisher(server_name + EVENTS_TOPIC, String, node=node)  # what viewers seek
        self._unsubscribe = machine.subscribe(self._on_event)

    def close(self) -> None:
        """Send what waits, leave the topics.

        Blocks: 1 s at most.
        """
        self._unsubscribe()
        self._executor.join(STOP_S)
        self._descriptions.unregister()
        self._history.close()
        self._events.unregister()

    def _on_event(self, event: Event) -> None:
        record = to_record(event)
        if isinstance(event, Started):
            self._root = event.path
            self._executor.submit(self._describe)
        record["path"] = self._rename(event.path)
        with self._lock:
            record["seq"] = next(self._numbers)
            text = json.dumps(record)
            self._kept.append((record, text))
            if len(self._kept) > KEPT_EVENTS:
                self._base.fold(self._kept.popleft()[0])
            if not self._events.get_num_connections() or len(self._queue) >= QUEUED_EVENTS:
                return
            self._queue.append(text)
        self._executor.submit(self._send)

    def _tell(self, _request: object) -> tuple[bool, str]:
        """Answer with the history."""
        head = {
            "epoch": self._epoch,
            "description": json.loads(self._description),
            "problems": self._problems,
            "control": None if self._control is None else self._control.state(),
        }
        with self._lock:
            base = json.dumps(self._base.data)
            kept = [text for _, text in self._kept]
        text = json.dumps(head)[:-1]
        return True, f'{text}, "base": {base}, "events": [{", ".join(kept)}]}}'

    def _rename(self, path: str) -> str:
        """Return a path of this run under the name that the machine has here."""
        frame = self._machine._frame  # noqa: SLF001  the machine's own path, which a parent decides
        if frame is not None:
            self._root = frame.path
        return self._path + path.removeprefix(self._root)

    def _send(self) -> None:
        self._events.publish(self._queue.popleft())

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
