"""Where the robot is in the map: its odometry, and the transforms on `tf`."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import NotingSubscriber, Subscriber
from smachpy.places.pose import Pose2D, yaw_of
from smachpy.states.frames import FrameError, Frames, Transform

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.interfaces.geometry_msgs.msg import Pose, TransformStamped
    from actionlib_core.node import Node

MAP_FRAME: Final = "map"


def pose_of(message: Pose) -> Pose2D:
    """Return position and heading [m, m, rad] of a pose message, in the message's frame."""
    turned = message.orientation
    yaw = yaw_of(turned.x, turned.y, turned.z, turned.w)
    return Pose2D(message.position.x, message.position.y, yaw)


def pose_problem(message: Pose) -> str:
    """Return why a pose message is no place: numbers that nobody has filled in; "" if it is one."""
    place, turned = message.position, message.orientation
    numbers = (place.x, place.y, turned.x, turned.y, turned.z, turned.w)
    if not all(map(math.isfinite, numbers)):
        return f"got x {place.x:g}, y {place.y:g}, yaw {pose_of(message).yaw:g}; expected numbers"
    if not any(numbers[2:]):
        return "got the orientation 0 0 0 0; expected a rotation"
    return ""


def add_transform(frames: Frames, stamped: TransformStamped, *, static: bool) -> None:
    """Add the transform of a message.

    Raises:
        FrameError: it is no transform.
    """
    move, turn = stamped.transform.translation, stamped.transform.rotation
    transform = Transform(move.x, move.y, move.z, turn.x, turn.y, turn.z, turn.w)
    parent, child = stamped.header.frame_id, stamped.child_frame_id
    frames.add(parent, child, stamped.header.stamp.to_nsec(), transform, static=static)


class Transforms:
    """Follows the transforms on a topic, on the one with `_static` behind its name, and on `/tf`.

    A robot has its own topics, or its transforms are on the one topic for all robots.

    Args:
        topic: The topic of `tf2_msgs/TFMessage`.
        node: The node in the robot's namespace.
        changed: Called after each message, on the network's thread: it must not block.

    Attributes:
        frames: What is known; only what has come since this was made.
    """

    def __init__(self, topic: str, node: Node, changed: Callable[[], object]) -> None:
        self.frames = Frames()
        self._changed = changed
        self._ends: list[Subscriber[Any]] = []
        own = f"/{node.resolve(topic, 'topic name')}"
        for name in dict.fromkeys(("/tf", own)):
            for full, static in ((name, False), (f"{name}_static", True)):
                take = partial(self._take, static=static)
                self._ends.append(NotingSubscriber(full, TFMessage, take, node=node))

    def close(self) -> None:
        """Stop following them."""
        for end in self._ends:
            end.unregister()

    def _take(self, message: TFMessage, *, static: bool) -> None:
        for stamped in message.transforms:
            try:
                add_transform(self.frames, stamped, static=static)
            except FrameError:
                continue  # the transforms that are good still say where the robot is
        self._changed()


class Localiser:
    """Follows the robot's pose in the map frame.

    Args:
        topic: A topic of `nav_msgs/Odometry`, in any frame that `tf` connects with the map.
        node: The node in the robot's namespace; None: the current node.
        changed: Called after each message.

    Threads: `changed` is called on the thread of the network, and must not block; `pose` may be
        called from any.
    """

    def __init__(
        self,
        topic: str = "odom",
        *,
        node: Node | None = None,
        changed: Callable[[], object] = lambda: None,
    ) -> None:
        node = get_node() if node is None else node
        self._odometry: Odometry | None = None
        self._changed = changed
        self._subscriber = NotingSubscriber(topic, Odometry, self._take, node=node)
        beside = node.resolve(topic, "topic name").rpartition("/")[0]
        self._transforms = Transforms(f"/{beside}/tf" if beside else "/tf", node, changed)

    def close(self) -> None:
        """Stop following it."""
        self._subscriber.unregister()
        self._transforms.close()

    @property
    def heard(self) -> bool:
        """Whether odometry has arrived."""
        return self._odometry is not None

    def pose(self) -> tuple[Pose2D | None, str]:
        """Return the pose [m, m, rad], and why there is none: "" if there is one."""
        odometry = self._odometry
        if odometry is None:
            return None, "no odometry has arrived yet"
        message, frame = odometry.pose.pose, odometry.header.frame_id.strip("/")
        problem = pose_problem(message)
        if problem:
            return None, f"the robot is not localised: {problem}"
        if frame in {"", MAP_FRAME}:
            return pose_of(message), ""
        try:
            there, _ = self._transforms.frames.look_up(MAP_FRAME, frame, 0)
        except FrameError:
            return None, (
                f"the odometry is in frame {frame!r}, and no transform from {MAP_FRAME!r} to it is "
                "known; expected one on /tf, by a localisation"
            )
        origin = Pose2D(there.x, there.y, yaw_of(there.qx, there.qy, there.qz, there.qw))
        return origin.then(pose_of(message)), ""

    def _take(self, message: Odometry) -> None:
        self._odometry = message
        self._changed()
