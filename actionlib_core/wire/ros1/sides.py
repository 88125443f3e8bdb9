"""What every bridged name needs of the two sides: their nodes, and how names correspond."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.exceptions import Ros1Error, TypeMismatchError
from actionlib_core.wire.encoding import make_encoding, parse_encoding
from actionlib_core.wire.presence import token_key, with_age
from actionlib_core.wire.ros1.node import ANY

if TYPE_CHECKING:
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Sample
    from actionlib_core.wire.presence import Kind
    from actionlib_core.wire.ros1.frames import Header
    from actionlib_core.wire.ros1.node import Ros1Node

BRIDGE = "/smachpy_bridge_"
"""How the names of bridges in ROS 1 begin: they do not listen to each other."""


class Typed(NamedTuple):
    """A type as a connection header tells it.

    Attributes:
        type: "pkg/Type".
        md5: Its checksum.
    """

    type: str
    md5: str

    @property
    def encoding(self) -> str:
        """The encoding of its messages."""
        return make_encoding(self.type, self.md5)


@dataclass(frozen=True)
class Sides:
    """The two networks, for all that is bridged between them.

    Attributes:
        node: On ours.
        ros: In ROS 1.
        namespace: What the robot's names live under on our side, "robot_1"; "" is nothing.
    """

    node: Node
    ros: Ros1Node
    namespace: str

    def key(self, ros_name: str) -> str:
        """Return our name of a name in ROS 1."""
        plain = ros_name.lstrip("/")
        return f"{self.namespace}/{plain}" if self.namespace else plain

    def ros_name(self, key: str) -> str | None:
        """Return the name in ROS 1 of one of ours; None: it belongs to another robot."""
        front = f"{self.namespace}/" if self.namespace else ""
        return f"/{key.removeprefix(front)}" if key.startswith(front) else None

    def show(self, kind: Kind, key: str, typed: Typed, ros_node: str) -> Closable:
        """Show the token of an end in ROS 1, under the name of its node there."""
        end = self.node.endpoint(kind, key, typed.type, typed.md5)
        end = end._replace(node=self.key(ros_node) or "-")
        return self.node.transport.declare_alive(
            token_key(with_age(end, self.node.clock.time_ns()))
        )

    def is_own(self, sample: Sample) -> bool:
        """Tell whether a message came from this bridge."""
        return sample.source == self.node.transport.session_id

    def fits(self, sample: Sample, typed: Typed) -> bool:
        """Tell whether a message has a type; one that has not is reported."""
        if sample.encoding in {"", typed.encoding}:
            return True
        found = parse_encoding(sample.encoding)
        by = f"session {sample.source or 'unknown'}"
        error = TypeMismatchError(sample.key, typed, (found.type, found.md5), by=by)
        self.ros.report(f"{sample.key} {sample.source}", error)
        return False


def type_of(header: Header, about: str) -> Typed:
    """Return the type that a connection header tells.

    Raises:
        Ros1Error: it tells none, or comes from another bridge.
    """
    node = header.get("callerid", "")
    if node.startswith(BRIDGE):
        raise Ros1Error(about, f"{node} is a bridge too; expected a node of the robot.")
    typed = Typed(header.get("type", ANY), header.get("md5sum", ANY))
    if ANY in typed or not all(typed):
        raise Ros1Error(f"{about} of {node}", f"type: got {typed}; expected one with its checksum.")
    if any(set(part) & set("%;$*?# ") for part in typed):
        raise Ros1Error(f"{about} of {node}", f"type: got {typed!r:.200}; expected 'pkg/Type'.")
    return typed
