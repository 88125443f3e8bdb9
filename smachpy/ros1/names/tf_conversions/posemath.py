"""tf_conversions.posemath: converts PyKDL frames from and to poses, matrices and tf's pairs."""

from __future__ import annotations

from typing import Any

from actionlib_core.interfaces.geometry_msgs.msg import Point, Pose, Quaternion
from actionlib_core.time import Time
from smachpy.ros1.names import tf
from smachpy.ros1.names.PyKDL import Frame, Rotation, Vector


def fromMsg(p: Pose) -> Frame:
    """Return the frame of a pose message."""
    turn, place = p.orientation, p.position
    return Frame(
        Rotation.Quaternion(turn.x, turn.y, turn.z, turn.w), Vector(place.x, place.y, place.z)
    )


def toMsg(f: Frame) -> Pose:
    """Return the pose message of a frame."""
    return Pose(Point(*f.p), Quaternion(*f.M.GetQuaternion()))


def fromTf(pair: Any) -> Frame:
    """Return the frame of a translation [m] and a rotation (x, y, z, w)."""
    place, turn = pair
    return Frame(Rotation.Quaternion(*turn), Vector(*place))


def toTf(f: Frame) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return translation [m] and rotation (x, y, z, w) of a frame."""
    return tuple(f.p), f.M.GetQuaternion()


def fromMatrix(m: Any) -> Frame:
    """Return the frame of a 4x4 matrix."""
    return Frame(
        Rotation(*(m[i][j] for i in range(3) for j in range(3))),
        Vector(*(m[i][3] for i in range(3))),
    )


def toMatrix(f: Frame) -> Any:
    """Return the 4x4 matrix of a frame."""
    made = tf.transformations.identity_matrix()
    for i in range(3):
        made[i, 3] = f.p[i]
        for j in range(3):
            made[i, j] = f.M[i, j]
    return made


def fromTfListener(tf_listener: Any, source: str, target: str) -> Frame:
    """Return the latest transform of a listener as a frame."""
    return fromTf(tf_listener.lookupTransform(source, target, Time(0)))


def fromCameraParams(cv: Any, rvec: Any, tvec: Any) -> Frame:
    """Return the frame of OpenCV's rotation and translation vectors."""
    matrix = cv.Rodrigues(rvec)[0]
    values = (float(matrix[i][j]) for i in range(3) for j in range(3))
    return Frame(Rotation(*values), Vector(*(float(tvec[i]) for i in range(3))))
