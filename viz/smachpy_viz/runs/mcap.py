"""Writes a recorded run as an MCAP file with ROS 1 messages, for Foxglove and other tools.

Topics of a machine MACHINE:
    /MACHINE/smach/container_structure  of every container
    /MACHINE/smach/container_status     whenever it changes
    /MACHINE/smach/events               std_msgs/String, every event as JSON
    /CONTAINER/state                    label of the running state, for state panels
    /MACHINE/userdata/KEY               numbers in the userdata, for plots
of its actions:
    /ACTION/goal, /feedback, /result    with actionlib's types, such as `MoveBaseActionGoal`
    /ACTION/status
and of its robots the messages from `scene`: /tf, /pose, /scan, /plan, /map and values.

A recording keeps at most 1,000 elements of a list, shortens long texts and has no cancels. Messages
that cannot be restored from it are left out and counted.
"""

from __future__ import annotations

import base64
import heapq
import json
import zlib
from collections import Counter
from dataclasses import asdict, replace
from datetime import UTC, datetime
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces import define_action, define_message, get_message
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.interfaces.smach_msgs.msg import SmachContainerStatus, SmachContainerStructure
from actionlib_core.interfaces.std_msgs.msg import Header, String
from actionlib_core.process.private_files import open_private
from actionlib_core.time import Time
from smachpy.base import log
from smachpy.events.introspection import StateRecord
from smachpy.events.reading import OBSERVED
from smachpy.events.recording import RecordingError
from smachpy.events.run_state import RunState
from smachpy.userdata.json_text import from_shown
from smachpy.userdata.shown import literal, shortened_part
from smachpy_viz.runs.scene import Scene

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from smachpy.events.recording import Recording

GOAL_PARTS = {"GoalSent": "goal", "GoalFeedback": "feedback", "GoalDone": "result"}
"""The part of an action that each kind of event carries."""
_MALFORMED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, zlib.error)
"""Raised while a message is made from a malformed record."""


def write_mcap(recording: Recording, path: Path) -> None:
    """Write the file; log how many messages are left out.

    Args:
        recording: The run; one whose records are `Streamed` is read while the file is written.
        path: The file. None is left behind an error.

    Raises:
        ModuleNotFoundError: the package `mcap` is not installed.
        OSError: the file cannot be written.
        RecordingError: a line of a streamed recording is not a record.
    """
    from mcap.writer import Writer

    try:
        with open_private(path, "wb") as file:
            writer = Writer(file)
            writer.start(profile="ros1", library="smachpy")
            export = _Export(recording, writer)
            export.run()
            writer.finish()  # type: ignore[no-untyped-call]
    except RecordingError:
        path.unlink()
        raise
    for (topic, why), number in export.left_out.items():
        log.logwarn(f"{str(path)!r}: {number} message(s) of {topic} are left out: {why}.")


class _Export:
    def __init__(self, recording: Recording, writer: Any) -> None:
        machine = StateRecord.from_json(json.dumps(_encodable(asdict(recording.record))))
        base, definitions = _encodable(recording.base), _encodable(recording.definitions)
        recording = replace(recording, record=machine, base=base, definitions=definitions)
        self._recording = recording
        self._writer = writer
        self._channels: dict[tuple[str, str], int] = {}
        self._state = RunState(recording.base)
        self._containers = {s.path: s for s in recording.record.walk() if s.is_container}
        self._server = f"/{recording.record.label}"
        self._scene = Scene(recording.record, self._server)
        self._ids: dict[str, Any] = {}  # goal id -> GoalID
        self._statuses: dict[str, dict[str, Any]] = {}  # action -> goal id -> GoalStatus
        self._ended: set[tuple[str, str]] = set()  # action and goal id
        self.left_out: Counter[tuple[str, str]] = Counter()  # by topic and reason

    def run(self) -> None:
        define_types(self._recording.definitions)
        # The date comes from the file's header: stamps of events may be of virtual time.
        began = datetime.fromtimestamp(self._recording.made_ns / 1e9, UTC)
        facts = {"machine": self._recording.record.label, "began": began.isoformat()}
        self._writer.add_metadata("run", facts)
        # As SMACH's introspection: the structure first, then a status for every change.
        for container in self._containers.values():
            message = _structure(container, self._recording.stamp_ns)
            topic = f"{self._server}/smach/container_structure"
            self._write(topic, message, self._recording.stamp_ns)
        recording = self._recording
        # Both are in order of time, and so are the merged messages.
        records = heapq.merge(recording.events, recording.observed, key=itemgetter("stamp_ns"))
        for event in map(_encodable, records):
            stamp = event["stamp_ns"]
            if event["kind"] == OBSERVED:
                self._write_observed(event)
                continue
            self._state.fold(event)
            text = json.dumps(event)
            self._write(f"{self._server}/smach/events", String(data=text), stamp)
            if event["kind"] in GOAL_PARTS:
                self._write_goal(event, GOAL_PARTS[event["kind"]])
            # An event changes the status of the container around its state; feedback never does,
            # and it is by far the most frequent event.
            parent = self._containers.get(event["path"].rpartition("/")[0])
            if parent is not None and event["kind"] != "GoalFeedback":
                message = self._status(parent, event)
                self._write(f"{self._server}/smach/container_status", message, stamp)
            for topic, message in self._scene.of_event(event, self._state):
                self._write(topic, message, stamp)

    def _write_observed(self, record: dict[str, Any]) -> None:
        try:
            messages = list(self._scene.of_observation(record))
        except (*_MALFORMED, ActionlibError) as error:
            self.left_out[f"a robot's {record.get('what')!r}", f"malformed ({error})"] += 1
            return
        for topic, message in messages:
            self._write(topic, message, record["stamp_ns"])

    def _write(self, topic: str, message: Any, stamp_ns: int) -> None:
        key = topic, message._type
        if key not in self._channels:  # a topic that is used with two types gets two channels
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
        # The messages of actionlib: goal, feedback or result, each with id and status, ...
        action, stamp = f"/{event['action'].strip('/')}", event["stamp_ns"]
        header = Header(stamp=Time(0, stamp))
        if part == "goal":
            self._ids[event["goal_id"]] = GoalID(stamp=Time(0, stamp), id=event["goal_id"])
        # A recording that began during the goal has no GoalSent, so the stamp is unknown: zero.
        goal_id = self._ids.get(event["goal_id"], GoalID(id=event["goal_id"]))
        status = GoalStatus(goal_id=goal_id, status=GoalStatus.ACTIVE)
        if part == "result":
            status.status = getattr(GoalStatus, event["status"], GoalStatus.LOST)
            status.text = event["text"]
        more = {"goal_id": goal_id} if part == "goal" else {"status": status}
        content = event.get(part)
        if isinstance(content, dict) and "$msg" in content:
            try:
                wrapper = _action_type(content["$msg"], part)
                if (short := shortened_part(content)) is not None:
                    text = f"a text of {short['length']}" if "$cut" in short else literal(short)
                    raise ValueError(f"too long to be recorded: {text:.60}")
                inside = get_message(content["$msg"]).from_dict(_restored(content))
                self._write(f"{action}/{part}", wrapper(header, **more, **{part: inside}), stamp)
            except (*_MALFORMED, ActionlibError) as error:
                self.left_out[f"{action}/{part}", str(error).partition("\n")[0]] += 1
        elif content is not None:
            self.left_out[f"{action}/{part}", "it was recorded as text"] += 1
        # ... and the status of all goals of the action, when it changes.
        known = self._statuses.setdefault(action, {})
        if part == "feedback" and (action, event["goal_id"]) in self._ended:
            return  # late feedback must not make an ended goal active again
        known[event["goal_id"]] = status
        if part != "feedback":
            statuses = list(known.values())
            self._write(f"{action}/status", GoalStatusArray(header, statuses), stamp)
        if part == "result":  # the status just written has shown the end once; drop the goal
            del known[event["goal_id"]]
            self._ended.add((action, event["goal_id"]))

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
            local_data=from_shown(userdata),
            info=event["kind"],
        )


def _encodable(value: Any) -> Any:
    """Return JSON data with "?" for lone UTF-16 surrogates, which no file in UTF-8 can contain."""
    return json.loads(json.dumps(value, ensure_ascii=False).encode("utf-8", "replace"))


def define_types(definitions: Mapping[str, str]) -> None:
    """Define the actions whose definitions are in a recording, unless they are already known."""
    for name, goal in definitions.items():
        action = name.removesuffix("Goal")
        parts = [goal, definitions.get(f"{action}Result"), definitions.get(f"{action}Feedback")]
        # Only complete actions; a definition of this program comes first, as it is already in use.
        if action == name or None in parts or _is_known(name):
            continue
        try:
            own = [_define_inner(text) for text in parts if text is not None]
            define_action(action, "\n---\n".join(own))
        except ActionlibError as error:
            log.logwarn(f"definition of {action!r} in the recording: {error}")


def _define_inner(full: str) -> str:
    """Define the types that follow a type's own definition in its full text; return its own."""
    own, *inner = full.split(f"{'=' * 80}\nMSG: ")  # the format of ROS's `gendeps --cat`
    for section in reversed(inner):  # a type comes before those that it uses
        name, _, text = section.partition("\n")
        if not _is_known(name.strip()):
            define_message(name.strip(), text)
    return own.rstrip("\n")


def _is_known(name: str) -> bool:
    try:
        get_message(name)
    except ActionlibError:
        return False
    return True


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


def _action_type(name: str, part: str) -> type[Any]:
    """The type in which actionlib sends a part of an action: a/BGoal -> a/BActionGoal."""
    word = part.capitalize()
    if not name.endswith(word):
        raise ValueError(f"got type {name!r}; expected one that ends with {word!r}")
    return get_message(f"{name.removesuffix(word)}Action{word}")


def _restored(value: Any) -> Any:
    """Convert a recorded value to the plain data that `from_dict` takes."""
    if isinstance(value, list):
        return [_restored(item) for item in value]
    if not isinstance(value, dict):
        return value
    for mark, restore in _RESTORED.items():
        if mark in value:
            return restore(value[mark])
    return {name: _restored(part) for name, part in value.get("fields", value).items()}


_RESTORED: dict[str, Callable[[Any], Any]] = {
    "$float": float,
    "$int": int,
    "$bytes": lambda text: list(base64.b64decode(text)),  # an array of octets
    "$tuple": _restored,
}
