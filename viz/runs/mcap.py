"""A recorded run as MCAP with ROS 1 messages, which Foxglove and other tools open.

Topics of the machine MACHINE: /MACHINE/smach/container_structure (of every container),
/MACHINE/smach/container_status (whenever it changes) and /MACHINE/smach/events (std_msgs/String,
every event as JSON); of its actions: /ACTION/goal, /feedback and /result, where their types are
known.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces import get_message
from actionlib_core.interfaces.smach_msgs.msg import SmachContainerStatus, SmachContainerStructure
from actionlib_core.interfaces.std_msgs.msg import Header, String
from actionlib_core.time import Time
from smachpy.run_state import RunState
from smachpy.userdata_json import dumps

if TYPE_CHECKING:
    from pathlib import Path

    from smachpy.introspection import StateRecord
    from viz.runs.recording import Recording

GOAL_PARTS = {"GoalSent": "goal", "GoalFeedback": "feedback", "GoalDone": "result"}


def write_mcap(recording: Recording, path: Path) -> None:
    """Write the file.

    Raises:
        ModuleNotFoundError: the package `mcap` is missing.
        OSError: the file cannot be written.
    """
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros1", library="smachpy")
        _Export(recording, writer).run()
        writer.finish()  # type: ignore[no-untyped-call]


class _Export:
    def __init__(self, recording: Recording, writer: Any) -> None:
        self._recording = recording
        self._writer = writer
        self._channels: dict[tuple[str, str], int] = {}
        self._state = RunState(recording.base)
        self._containers = {s.path: s for s in recording.record.walk() if s.is_container}
        self._server = f"/{recording.record.label}"

    def run(self) -> None:
        for container in self._containers.values():
            message = _structure(container, self._recording.stamp_ns)
            topic = f"{self._server}/smach/container_structure"
            self._write(topic, message, self._recording.stamp_ns)
        for event in self._recording.events:
            stamp = event["stamp_ns"]
            self._state.fold(event)
            text = json.dumps(event)
            self._write(f"{self._server}/smach/events", String(data=text), stamp)
            if event["kind"] in GOAL_PARTS:
                self._write_goal(event, GOAL_PARTS[event["kind"]])
            parent = self._containers.get(event["path"].rpartition("/")[0])
            if parent is not None and event["kind"] != "GoalFeedback":
                message = self._status(parent, event)
                self._write(f"{self._server}/smach/container_status", message, stamp)

    def _write(self, topic: str, message: Any, stamp_ns: int) -> None:
        key = topic, message._type
        if key not in self._channels:
            schema = self._writer.register_schema(
                name=message._type, encoding="ros1msg", data=message._full_text.encode()
            )
            self._channels[key] = self._writer.register_channel(
                topic=topic, message_encoding="ros1", schema_id=schema
            )
        self._writer.add_message(
            channel_id=self._channels[key],
            log_time=stamp_ns,
            publish_time=stamp_ns,
            data=message.to_bytes(),
        )

    def _write_goal(self, event: dict[str, Any], part: str) -> None:
        content = event.get(part)
        if not isinstance(content, dict) or "$msg" not in content:
            return
        try:
            message = get_message(content["$msg"]).from_dict(_plain(content))
        except (ActionlibError, TypeError, ValueError):
            return  # a type that this program does not know, or a value too long to be recorded
        self._write(f"/{event['action'].strip('/')}/{part}", message, event["stamp_ns"])

    def _status(self, container: StateRecord, event: dict[str, Any]) -> Any:
        active = set(self._state.active())
        userdata = {
            entry["key"]: entry["value"]
            for entry in self._state.data["userdata"].values()
            if entry["container"] == container.path
        }
        return SmachContainerStatus(
            header=Header(stamp=Time(0, event["stamp_ns"])),
            path=container.path,
            initial_states=list(container.initial),
            active_states=[c.label for c in container.children if c.path in active],
            local_data=dumps(userdata),
            info=event["kind"],
        )


def _structure(container: StateRecord, stamp_ns: int) -> Any:
    edges = container.transitions
    return SmachContainerStructure(
        header=Header(stamp=Time(0, stamp_ns)),
        path=container.path,
        children=[child.label for child in container.children],
        internal_outcomes=[edge.outcome for edge in edges],
        outcomes_from=[edge.source for edge in edges],
        outcomes_to=[edge.target for edge in edges],
        container_outcomes=list(container.outcomes),
    )


def _plain(value: Any) -> Any:
    """A recorded message as the plain data that `from_dict` takes."""
    if isinstance(value, dict):
        inside = value["fields"] if "$msg" in value else value
        return {name: _plain(item) for name, item in inside.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value
