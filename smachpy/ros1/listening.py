"""Coordinate frames on the network: receives and sends transforms on `/tf` and `/tf_static`."""

from __future__ import annotations

import copy
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import current_clock
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import NewsPublisher, Subscriber
from actionlib_core.shutdown import on_shutdown
from smachpy.ros1.session import session
from smachpy.states.frames import FrameError, Frames
from smachpy.states.localising import add_transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.interfaces.geometry_msgs.msg import TransformStamped


class FrameListener:
    """Keeps frames up to date with the transforms on the network.

    When the clock is set back, it forgets what moves: the frames would take all that comes for too
    old, and keep what they have for ever.

    Threads: messages arrive in the subscribers' threads; every method may be called from any.
    """

    def __init__(self, frames: Frames) -> None:
        self.frames = frames
        self._clock = current_clock()
        self._lock = threading.Lock()  # guards `_last_ns`
        self._last_ns = self._clock.time_ns()
        self._changed: list[Any] = []
        self._subscribers = [
            Subscriber("/tf", TFMessage, lambda message: self._take(message, static=False)),
            Subscriber("/tf_static", TFMessage, lambda message: self._take(message, static=True)),
        ]

    def close(self) -> None:
        """Stop listening."""
        for subscriber in self._subscribers:
            subscriber.unregister()

    def _take(self, message: TFMessage, *, static: bool) -> None:
        self._check_clock()
        for stamped in message.transforms:
            try:
                add_transform(self.frames, stamped, static=static)
            except FrameError as error:
                from smachpy.ros1.names.rospy.core import logwarn_throttle

                logwarn_throttle(10.0, "%s", error)
        self.changed()

    def _check_clock(self) -> None:
        with self._lock:
            now_ns = self._clock.time_ns()
            back_s, self._last_ns = (self._last_ns - now_ns) / 1e9, now_ns
            if back_s > 0:
                self.frames.forget_moving()
        if back_s > 0:
            from smachpy.ros1.names.rospy.core import logwarn

            logwarn("Detected jump back in time of %fs. Clearing TF buffer.", back_s)

    def changed(self) -> None:
        """Wake all calls of `wait`, to check their conditions again."""
        for event in tuple(self._changed):
            event.set()

    def wait(self, ready: Callable[[], bool], timeout: float) -> bool:
        """Wait until `ready` returns true; it is called again after each message.

        Blocks: `timeout` [s] at most, or until the program is to end.
        """
        deadline = self._clock.now() + timeout
        event = self._clock.event("a transform")
        self._changed.append(event)
        forget = on_shutdown(event.set)
        try:
            while not ready():
                left = deadline - self._clock.now()
                if left <= 0 or session().is_shutdown():
                    return False
                event.wait(left)
                event.clear()
            return True
        finally:
            forget()
            self._changed.remove(event)


class Broadcaster:
    """Sends transforms.

    Args:
        static: Use `/tf_static`, latched. Each message then contains all static transforms that
            the node has sent so far, since a latched topic keeps only the newest message.
    """

    def __init__(self, *, static: bool = False) -> None:
        self._static = static
        topic = "/tf_static" if static else "/tf"
        node = get_node()
        self._sent: dict[str, TransformStamped] = node.shared("static transforms", dict)
        self._publisher = node.shared(
            ("broadcaster", topic), lambda: NewsPublisher(topic, TFMessage, latch=static)
        )

    def send(self, transforms: Iterable[TransformStamped]) -> None:
        """Send them in one message."""
        given = list(transforms)
        if session().dry:
            return
        if self._static:
            # Copies: programs use one message for all their frames.
            self._sent |= {one.child_frame_id: copy.deepcopy(one) for one in given}
            given = list(self._sent.values())
        self._publisher.publish(TFMessage(given))
