# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class Accel(_Ros2Message):
    linear: Vector3
    angular: Vector3
    def __init__(
        self,
        linear: Vector3 | None = None,
        angular: Vector3 | None = None,
    ) -> None: ...

class AccelStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    accel: Accel
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        accel: Accel | None = None,
    ) -> None: ...

class AccelWithCovariance(_Ros2Message):
    accel: Accel
    covariance: list[float]
    def __init__(
        self,
        accel: Accel | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class AccelWithCovarianceStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    accel: AccelWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        accel: AccelWithCovariance | None = None,
    ) -> None: ...

class Inertia(_Ros2Message):
    m: float
    com: Vector3
    ixx: float
    ixy: float
    ixz: float
    iyy: float
    iyz: float
    izz: float
    def __init__(
        self,
        m: float | None = None,
        com: Vector3 | None = None,
        ixx: float | None = None,
        ixy: float | None = None,
        ixz: float | None = None,
        iyy: float | None = None,
        iyz: float | None = None,
        izz: float | None = None,
    ) -> None: ...

class InertiaStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    inertia: Inertia
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        inertia: Inertia | None = None,
    ) -> None: ...

class Point(_Ros2Message):
    x: float
    y: float
    z: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
    ) -> None: ...

class Point32(_Ros2Message):
    x: float
    y: float
    z: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
    ) -> None: ...

class PointStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    point: Point
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        point: Point | None = None,
    ) -> None: ...

class Polygon(_Ros2Message):
    points: list[Point32]
    def __init__(
        self,
        points: _Collection[Point32] | None = None,
    ) -> None: ...

class PolygonInstance(_Ros2Message):
    polygon: Polygon
    id: int
    def __init__(
        self,
        polygon: Polygon | None = None,
        id: int | None = None,
    ) -> None: ...

class PolygonInstanceStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    polygon: PolygonInstance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        polygon: PolygonInstance | None = None,
    ) -> None: ...

class PolygonStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    polygon: Polygon
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        polygon: Polygon | None = None,
    ) -> None: ...

class Pose(_Ros2Message):
    position: Point
    orientation: Quaternion
    def __init__(
        self,
        position: Point | None = None,
        orientation: Quaternion | None = None,
    ) -> None: ...

class Pose2D(_Ros2Message):
    x: float
    y: float
    theta: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        theta: float | None = None,
    ) -> None: ...

class PoseArray(_Ros2Message):
    header: _std_msgs_msg.Header
    poses: list[Pose]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        poses: _Collection[Pose] | None = None,
    ) -> None: ...

class PoseStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    pose: Pose
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: Pose | None = None,
    ) -> None: ...

class PoseWithCovariance(_Ros2Message):
    pose: Pose
    covariance: list[float]
    def __init__(
        self,
        pose: Pose | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class PoseWithCovarianceStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    pose: PoseWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: PoseWithCovariance | None = None,
    ) -> None: ...

class Quaternion(_Ros2Message):
    x: float
    y: float
    z: float
    w: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        w: float | None = None,
    ) -> None: ...

class QuaternionStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    quaternion: Quaternion
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        quaternion: Quaternion | None = None,
    ) -> None: ...

class Transform(_Ros2Message):
    translation: Vector3
    rotation: Quaternion
    def __init__(
        self,
        translation: Vector3 | None = None,
        rotation: Quaternion | None = None,
    ) -> None: ...

class TransformStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    child_frame_id: str
    transform: Transform
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        child_frame_id: str | None = None,
        transform: Transform | None = None,
    ) -> None: ...

class Twist(_Ros2Message):
    linear: Vector3
    angular: Vector3
    def __init__(
        self,
        linear: Vector3 | None = None,
        angular: Vector3 | None = None,
    ) -> None: ...

class TwistStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    twist: Twist
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        twist: Twist | None = None,
    ) -> None: ...

class TwistWithCovariance(_Ros2Message):
    twist: Twist
    covariance: list[float]
    def __init__(
        self,
        twist: Twist | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class TwistWithCovarianceStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    twist: TwistWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        twist: TwistWithCovariance | None = None,
    ) -> None: ...

class Vector3(_Ros2Message):
    x: float
    y: float
    z: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
    ) -> None: ...

class Vector3Stamped(_Ros2Message):
    header: _std_msgs_msg.Header
    vector: Vector3
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        vector: Vector3 | None = None,
    ) -> None: ...

class VelocityStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    body_frame_id: str
    reference_frame_id: str
    velocity: Twist
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        body_frame_id: str | None = None,
        reference_frame_id: str | None = None,
        velocity: Twist | None = None,
    ) -> None: ...

class Wrench(_Ros2Message):
    force: Vector3
    torque: Vector3
    def __init__(
        self,
        force: Vector3 | None = None,
        torque: Vector3 | None = None,
    ) -> None: ...

class WrenchStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    wrench: Wrench
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        wrench: Wrench | None = None,
    ) -> None: ...
