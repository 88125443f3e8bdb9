"""tf: listener and broadcaster of transforms, with the interface from before tf2.

Source:
    http://docs.ros.org/en/noetic/api/tf/html/python/tf_python.html for names and arguments.
"""

from __future__ import annotations

from typing import Any

from actionlib_core.interfaces import define_message
from actionlib_core.interfaces.geometry_msgs.msg import (
    PointStamped,
    PoseStamped,
    Quaternion,
    QuaternionStamped,
    TransformStamped,
    Vector3Stamped,
)
from actionlib_core.time import Duration, Time
from smachpy.ros1.listening import Broadcaster
from smachpy.ros1.names import tf2_geometry_msgs
from smachpy.ros1.names.tf import transformations as transformations
from smachpy.ros1.names.tf2_ros import (
    Buffer,
    ConnectivityException,
    ExtrapolationException,
    LookupException,
    TransformException,
)
from smachpy.states.frames import Transform

Exception = TransformException
define_message("tf/tfMessage", "geometry_msgs/TransformStamped[] transforms\n")


class TransformerROS:
    """Keeps transforms and converts stamped messages to other frames.

    Args:
        interpolate: Ignored: transforms are always interpolated.
        cache_time: Length of the history, seconds or `Duration`; None: ten seconds.
    """

    def __init__(self, interpolate: bool = True, cache_time: Any = None) -> None:
        del interpolate
        self._buffer = Buffer(cache_time)

    def lookupTransform(
        self, target_frame: str, source_frame: str, time: Any
    ) -> tuple[list[float], list[float]]:
        """Return translation [m] and rotation (x, y, z, w) from `source_frame` to `target_frame`.

        Raises:
            LookupException, ConnectivityException, ExtrapolationException: it is not known.
        """
        found = self._buffer.lookup_transform(target_frame, source_frame, time).transform
        move, turn = found.translation, found.rotation
        return [move.x, move.y, move.z], [turn.x, turn.y, turn.z, turn.w]

    def waitForTransform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any,
        polling_sleep_duration: Any = None,
    ) -> None:
        """Wait until a transform is known.

        Raises:
            tf.Exception: it is not known within `timeout`.

        Blocks: `timeout` at most.
        """
        del polling_sleep_duration
        there, problem = self._buffer.can_transform(
            target_frame, source_frame, time, timeout, return_debug_tuple=True
        )
        if not there:
            raise TransformException(problem)

    def canTransform(self, target_frame: str, source_frame: str, time: Any) -> bool:
        """Return whether a transform is known."""
        return bool(self._buffer.can_transform(target_frame, source_frame, time))

    def getLatestCommonTime(self, source_frame: str, dest_frame: str) -> Time:
        """Return the latest time at which the transform is known."""
        return self._buffer.lookup_transform(dest_frame, source_frame, Time(0)).header.stamp

    def frameExists(self, frame_id: str) -> bool:
        """Return whether a frame is known."""
        return frame_id.lstrip("/") in self._buffer.get_frame_strings()

    def getFrameStrings(self) -> list[str]:
        """Return the names of all frames."""
        return self._buffer.get_frame_strings()

    def allFramesAsString(self) -> str:
        """Return the names of all frames, one a line."""
        return self._buffer.all_frames_as_string()

    def setTransform(self, transform: TransformStamped, authority: str = "") -> None:
        """Add a transform."""
        self._buffer.set_transform(transform, authority)

    def clear(self) -> None:
        """Forget everything."""
        self._buffer.clear()

    def fromTranslationRotation(self, translation: Any, rotation: Any) -> Any:
        """Return the 4x4 matrix of a translation [m] and a rotation (x, y, z, w)."""
        made = transformations.quaternion_matrix(rotation)
        made[:3, 3] = translation
        return made

    def asMatrix(self, target_frame: str, hdr: Any) -> Any:
        """Return the 4x4 matrix from the frame of a header to `target_frame`."""
        return self.fromTranslationRotation(
            *self.lookupTransform(target_frame, hdr.frame_id, hdr.stamp)
        )

    def transformPose(self, target_frame: str, ps: PoseStamped) -> PoseStamped:
        """Return a pose in another frame."""
        return tf2_geometry_msgs.do_transform_pose(ps, self._for(target_frame, ps))

    def transformPoint(self, target_frame: str, ps: PointStamped) -> PointStamped:
        """Return a point in another frame."""
        return tf2_geometry_msgs.do_transform_point(ps, self._for(target_frame, ps))

    def transformVector3(self, target_frame: str, v3s: Vector3Stamped) -> Vector3Stamped:
        """Return a vector in another frame."""
        return tf2_geometry_msgs.do_transform_vector3(v3s, self._for(target_frame, v3s))

    def transformQuaternion(self, target_frame: str, ps: QuaternionStamped) -> QuaternionStamped:
        """Return a rotation in another frame."""
        known = self._for(target_frame, ps)
        turn, own = known.transform.rotation, ps.quaternion
        made = Transform(0.0, 0.0, 0.0, turn.x, turn.y, turn.z, turn.w).then(
            Transform(0.0, 0.0, 0.0, own.x, own.y, own.z, own.w)
        )
        return QuaternionStamped(known.header, Quaternion(*made[3:]))

    def _for(self, target_frame: str, message: Any) -> TransformStamped:
        header = message.header
        return self._buffer.lookup_transform(target_frame, header.frame_id, header.stamp)


Transformer = TransformerROS


class TransformListener(TransformerROS):
    """A `TransformerROS` that receives the transforms on the network."""

    def __init__(self, interpolate: bool = True, cache_time: Any = None) -> None:
        super().__init__(interpolate, cache_time)
        self._buffer.listen()


class TransformBroadcaster:
    """Sends transforms."""

    def __init__(self, queue_size: int = 100) -> None:
        del queue_size
        self._broadcaster = Broadcaster()

    def sendTransform(
        self, translation: Any, rotation: Any, time: Any, child: str, parent: str
    ) -> None:
        """Send the pose of `child` in `parent`: translation [m], rotation (x, y, z, w)."""
        made = TransformStamped()
        made.header.frame_id, made.header.stamp, made.child_frame_id = parent, time, child
        move, turn = made.transform.translation, made.transform.rotation
        move.x, move.y, move.z = map(float, translation)
        turn.x, turn.y, turn.z, turn.w = map(float, rotation)
        self._broadcaster.send([made])

    def sendTransformMessage(self, transform: TransformStamped) -> None:
        """Send a message."""
        self._broadcaster.send([transform])
