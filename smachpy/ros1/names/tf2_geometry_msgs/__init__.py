"""tf2_geometry_msgs: poses, points and vectors in another frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces.geometry_msgs.msg import (
    Point,
    PointStamped,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3,
    Vector3Stamped,
)
from smachpy.states.frames import Transform

if TYPE_CHECKING:
    from collections.abc import Callable


def _of(stamped: TransformStamped) -> Transform:
    move, turn = stamped.transform.translation, stamped.transform.rotation
    return Transform(move.x, move.y, move.z, turn.x, turn.y, turn.z, turn.w)


def _pose(pose: Pose, transform: Transform) -> Pose:
    place, turn = pose.position, pose.orientation
    # A pose whose orientation was never set is all zeros, which is no rotation.
    whole = (turn.x, turn.y, turn.z, turn.w) if any((turn.x, turn.y, turn.z, turn.w)) else None
    made = transform.then(Transform(place.x, place.y, place.z, *(whole or (0.0, 0.0, 0.0, 1.0))))
    return Pose(Point(*made[:3]), Quaternion(*made[3:]))


def do_transform_pose(pose: PoseStamped, transform: TransformStamped) -> PoseStamped:
    """Return the pose in the transform's frame."""
    return PoseStamped(transform.header, _pose(pose.pose, _of(transform)))


def do_transform_point(point: PointStamped, transform: TransformStamped) -> PointStamped:
    """Return the point in the transform's frame."""
    at = _of(transform).apply(point.point.x, point.point.y, point.point.z)
    return PointStamped(transform.header, Point(*at))


def do_transform_vector3(vector3: Vector3Stamped, transform: TransformStamped) -> Vector3Stamped:
    """Return the vector in the transform's frame: it is rotated but not translated."""
    turn = Transform(0.0, 0.0, 0.0, *_of(transform)[3:])
    given = vector3.vector
    return Vector3Stamped(transform.header, Vector3(*turn.apply(given.x, given.y, given.z)))


def do_transform_pose_with_covariance(
    pose: PoseWithCovarianceStamped, transform: TransformStamped
) -> PoseWithCovarianceStamped:
    """Return the pose in the transform's frame; the covariance is not changed."""
    made = PoseWithCovarianceStamped()
    made.header = transform.header
    made.pose.pose = _pose(pose.pose.pose, _of(transform))
    made.pose.covariance = pose.pose.covariance
    return made


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "geometry_msgs/PoseStamped": do_transform_pose,
    "geometry_msgs/PointStamped": do_transform_point,
    "geometry_msgs/Vector3Stamped": do_transform_vector3,
    "geometry_msgs/PoseWithCovarianceStamped": do_transform_pose_with_covariance,
}


def function_for(kind: Any) -> Callable[..., Any]:
    """Return the function that transforms messages of a class.

    Raises:
        tf2_ros.TypeException: there is none.
    """
    try:
        return _FUNCTIONS[kind._type]
    except (KeyError, AttributeError):
        from smachpy.ros1.names.tf2_ros import TypeException

        raise TypeException(
            f"Type {getattr(kind, '_type', kind)} is not loaded or supported"
        ) from None
