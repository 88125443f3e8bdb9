"""What every bridged name uses: the nodes on both networks, and the mapping of names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.exceptions import Ros1Error, TypeMismatchError
from actionlib_core.ros1.node import ANY
from actionlib_core.transport.tokens import token_key
from actionlib_core.wire.encoding import make_encoding, parse_encoding
from actionlib_core.wire.presence import with_age

if TYPE_CHECKING:
    from actionlib_core.node import Node
    from actionlib_core.ros1.frames import Header
    from actionlib_core.ros1.node import Ros1Node
    from actionlib_core.transport import Closable, Sample
    from actionlib_core.transport.tokens import Kind

BRIDGE = "/smachpy_bridge_"
"""Prefix of the names of bridges in ROS 1, by which they ignore each other."""


class Typed(NamedTuple):
    """A type as in a connection header.

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
    """The two networks of a bridge.

    Attributes:
        node: The node on our network.
        ros: The node in ROS 1.
        namespace: Prefix of the robot's names on our network, "robot_1"; "" for none.
    """

    node: Node
    ros: Ros1Node
    namespace: str

    def key(self, ros_name: str) -> str:
        """Return the name on our network of a name in ROS 1."""
        plain = ros_name.lstrip("/")
        return f"{self.namespace}/{plain}" if self.namespace else plain

    def ros_name(self, key: str) -> str | None:
        """Return the name in ROS 1 of a name on our network; None: it is another robot's."""
        front = f"{self.namespace}/" if self.namespace else ""
        return f"/{key.removeprefix(front)}" if key.startswith(front) else None

    def show(self, kind: Kind, key: str, typed: Typed, ros_node: str) -> Closable:
        """Declare the token of an endpoint in ROS 1, with the name of its node there."""
        end = self.node.endpoint(kind, key, typed.type, typed.md5)
        end = end._replace(node=self.key(ros_node) or "-")
        return self.node.transport.declare_alive(token_key(with_age(end, self.node)))

    def is_own(self, sample: Sample) -> bool:
        """Return whether this bridge has sent a message."""
        return sample.source == self.node.transport.session_id

    def fits(self, sample: Sample, typed: Typed) -> bool:
        """Return whether a message has the type `typed`; if not, report it."""
        if sample.encoding in {"", typed.encoding}:
            return True
        found = parse_encoding(sample.encoding)
        by = f"session {sample.source or 'unknown'}"
        error = TypeMismatchError(sample.key, typed, (found.type, found.md5), by=by)
        self.ros.report(f"{sample.key} {sample.source}", error)
        return False


def type_of(header: Header, about: str) -> Typed:
    """Return the type in a connection header.

    Raises:
        Ros1Error: it has none, or comes from another bridge.
    """
    node = header.get("callerid", "")
    if node.startswith(BRIDGE):
        raise Ros1Error(about, f"{node} is a bridge too; expected a node of the robot.")
    typed = Typed(header.get("type", ANY), header.get("md5sum", ANY))
    if ANY in typed or not all(typed):
        raise Ros1Error(f"{about} of {node}", f"type: got {typed}; expected one with its checksum.")
    if any(set(part) & set("%;$*?# ") for part in typed):  # reserved in keys and encodings
        raise Ros1Error(f"{about} of {node}", f"type: got {typed!r:.200}; expected 'pkg/Type'.")
    return typed
