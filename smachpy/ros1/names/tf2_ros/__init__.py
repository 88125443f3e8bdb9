"""tf2_ros: a buffer of transforms, its listener, and broadcasters.

In a dry program every transform is known and is the identity.

Source:
    http://docs.ros.org/en/noetic/api/tf2_ros/html/python/ for names, arguments and exceptions.
"""

from __future__ import annotations

from typing import Any, ClassVar

from actionlib_core.interfaces.geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from actionlib_core.interfaces.geometry_msgs.msg import Transform as TransformMessage
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from actionlib_core.time import Duration, Time
from smachpy.ros1 import listening
from smachpy.ros1.session import session
from smachpy.states.frames import (
    IDENTITY,
    FrameError,
    Frames,
    OutOfTimeError,
    Transform,
    UnconnectedFramesError,
    UnknownFrameError,
)
from smachpy.states.localising import add_transform


class TransformException(Exception):  # noqa: N818  tf2's names, all of them
    """A transform cannot be looked up."""


class LookupException(TransformException):
    """A frame is not known."""


class ConnectivityException(TransformException):
    """Two frames are not in the same tree."""


class ExtrapolationException(TransformException):
    """The time is before the first or after the last known transform."""


class InvalidArgumentException(TransformException):
    """An argument is invalid."""


class TimeoutException(TransformException):
    """A transform was not known in time."""


class TypeException(Exception):  # noqa: N818
    """No function is registered for a type."""


class NotImplementedException(Exception):  # noqa: N818
    """A buffer does not support an operation."""


_KINDS = {
    UnknownFrameError: LookupException,
    UnconnectedFramesError: ConnectivityException,
    OutOfTimeError: ExtrapolationException,
    FrameError: InvalidArgumentException,
}


class Buffer:
    """Transforms of the last seconds.

    Args:
        cache_time: Length of the history, seconds or `Duration`; None: ten seconds.
        debug: Ignored.
    """

    def __init__(self, cache_time: Any = None, debug: bool = True) -> None:
        del debug
        self._frames = Frames(float(cache_time)) if cache_time is not None else Frames()
        self._listener: listening.FrameListener | None = None

    def listen(self) -> listening.FrameListener:
        """Begin to receive the transforms on the network, if it does not yet."""
        if self._listener is None:
            self._listener = listening.FrameListener(self._frames)
        return self._listener

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0.0
    ) -> TransformStamped:
        """Return the transform of coordinates from `source_frame` to `target_frame`.

        Args:
            target_frame: Frame of the result.
            source_frame: Frame of the coordinates.
            time: The time; `Time(0)`: the latest.
            timeout: Longest wait for it, `Duration` or seconds.

        Raises:
            LookupException, ConnectivityException, ExtrapolationException: it is not known.

        Blocks: `timeout` at most.
        """
        self._wait(target_frame, source_frame, time, timeout)
        transform, stamp_ns = self._look_up(target_frame, source_frame, time)
        header = Header(frame_id=target_frame, stamp=Time.from_nsec(stamp_ns))
        return TransformStamped(header, source_frame, _message(transform))

    lookupTransform = lookup_transform  # noqa: N815

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = 0.0,
        return_debug_tuple: bool = False,
    ) -> Any:
        """Return whether a transform is known, within `timeout`.

        Blocks: `timeout` at most.
        """
        there = self._wait(target_frame, source_frame, time, timeout)
        problem = "" if there else self._problem(target_frame, source_frame, time)
        return (there, problem) if return_debug_tuple else there

    def set_transform(self, transform: TransformStamped, authority: str = "") -> None:
        """Add a transform."""
        del authority
        self._add(transform, static=False)

    def set_transform_static(self, transform: TransformStamped, authority: str = "") -> None:
        """Add a transform that never changes."""
        del authority
        self._add(transform, static=True)

    def transform(
        self, object_stamped: Any, target_frame: str, timeout: Any = 0.0, new_type: Any = None
    ) -> Any:
        """Return a stamped pose, point, vector or the like in another frame.

        Raises:
            TypeException: its type is not supported.
            LookupException, ConnectivityException, ExtrapolationException: it is not known.
        """
        del new_type
        from smachpy.ros1.names import tf2_geometry_msgs

        header = object_stamped.header
        known = self.lookup_transform(target_frame, header.frame_id, header.stamp, timeout)
        function = tf2_geometry_msgs.function_for(type(object_stamped))
        return function(object_stamped, known)

    def clear(self) -> None:
        """Forget everything."""
        self._frames.clear()

    def all_frames_as_string(self) -> str:
        """Return the names of all frames, one per line."""
        return "".join(f"Frame {name} exists.\n" for name in self._frames.names())

    all_frames_as_yaml = all_frames_as_string

    def get_frame_strings(self) -> list[str]:
        """Return the names of all frames."""
        return self._frames.names()

    def registration(self) -> Any:
        """Do nothing: the conversions of messages are always registered."""

    def _add(self, transform: TransformStamped, *, static: bool) -> None:
        try:
            add_transform(self._frames, transform, static=static)
        except FrameError as error:
            raise InvalidArgumentException(str(error)) from error
        if self._listener is not None:
            self._listener.changed()

    def _look_up(self, target: str, source: str, time: Any) -> tuple[Transform, int]:
        if session().dry:
            return IDENTITY, Time.now().to_nsec()
        try:
            return self._frames.look_up(target, source, _stamp(time))
        except FrameError as error:
            raise _KINDS[type(error)](str(error)) from error

    def _problem(self, target: str, source: str, time: Any) -> str:
        try:
            self._look_up(target, source, time)
        except TransformException as error:
            return str(error)
        return ""

    def _wait(self, target: str, source: str, time: Any, timeout: Any) -> bool:
        def ready() -> bool:
            return not self._problem(target, source, time)

        seconds = float(timeout)
        if ready():
            return True
        return seconds > 0 and self.listen().wait(ready, seconds)


def _stamp(time: Any) -> int:
    return int(time.to_nsec()) if hasattr(time, "to_nsec") else round(float(time) * 1e9)


def _message(transform: Transform) -> TransformMessage:
    return TransformMessage(Vector3(*transform[:3]), Quaternion(*transform[3:]))


class TransformListener:
    """Fills a buffer from `/tf` and `/tf_static`."""

    def __init__(
        self, buffer: Buffer, queue_size: Any = None, buff_size: Any = None, tcp_nodelay: Any = None
    ) -> None:
        del queue_size, buff_size, tcp_nodelay
        self.buffer = buffer
        self._listener = buffer.listen()

    def unregister(self) -> None:
        """Stop."""
        self._listener.close()


class TransformBroadcaster:
    """Sends transforms on `/tf`."""

    _static: ClassVar[bool] = False

    def __init__(self) -> None:
        self._broadcaster = listening.Broadcaster(static=self._static)

    def sendTransform(self, transform: Any) -> None:
        """Send one `TransformStamped`, or a list of them."""
        given = transform if isinstance(transform, (list, tuple)) else [transform]
        self._broadcaster.send(given)


class StaticTransformBroadcaster(TransformBroadcaster):
    """Sends transforms that never change, on the latched topic `/tf_static`."""

    _static = True


class BufferClient(Buffer):
    """The transforms that a server has in ROS 1; here it receives them itself.

    Args:
        ns: Name of the server; ignored, as the next two.
        check_frequency: How often the client asked it [Hz].
        timeout_padding: How much longer it waited for the answer.
    """

    def __init__(self, ns: str, check_frequency: Any = None, timeout_padding: Any = None) -> None:
        del ns, check_frequency, timeout_padding
        super().__init__()
        self.listen()

    def wait_for_server(self, timeout: Any = 0.0) -> bool:
        """Return True: no server is needed."""
        del timeout
        return True


BufferInterface = Buffer
