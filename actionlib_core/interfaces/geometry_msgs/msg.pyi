# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message

class Accel(_Message):
    linear: Vector3
    angular: Vector3
    def __init__(
        self,
        linear: Vector3 | None = None,
        angular: Vector3 | None = None,
    ) -> None: ...

class AccelStamped(_Message):
    header: _std_msgs_msg.Header
    accel: Accel
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        accel: Accel | None = None,
    ) -> None: ...

class AccelWithCovariance(_Message):
    accel: Accel
    covariance: list[float]
    def __init__(
        self,
        accel: Accel | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class AccelWithCovarianceStamped(_Message):
    header: _std_msgs_msg.Header
    accel: AccelWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        accel: AccelWithCovariance | None = None,
    ) -> None: ...

class Inertia(_Message):
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

class InertiaStamped(_Message):
    header: _std_msgs_msg.Header
    inertia: Inertia
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        inertia: Inertia | None = None,
    ) -> None: ...

class Point(_Message):
    x: float
    y: float
    z: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
    ) -> None: ...

class Point32(_Message):
    x: float
    y: float
    z: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
    ) -> None: ...

class PointStamped(_Message):
    header: _std_msgs_msg.Header
    point: Point
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        point: Point | None = None,
    ) -> None: ...

class Polygon(_Message):
    points: list[Point32]
    def __init__(
        self,
        points: _Collection[Point32] | None = None,
    ) -> None: ...

class PolygonStamped(_Message):
    header: _std_msgs_msg.Header
    polygon: Polygon
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        polygon: Polygon | None = None,
    ) -> None: ...

class Pose(_Message):
    position: Point
    orientation: Quaternion
    def __init__(
        self,
        position: Point | None = None,
        orientation: Quaternion | None = None,
    ) -> None: ...

class Pose2D(_Message):
    x: float
    y: float
    theta: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        theta: float | None = None,
    ) -> None: ...

class PoseArray(_Message):
    header: _std_msgs_msg.Header
    poses: list[Pose]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        poses: _Collection[Pose] | None = None,
    ) -> None: ...

class PoseStamped(_Message):
    header: _std_msgs_msg.Header
    pose: Pose
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: Pose | None = None,
    ) -> None: ...

class PoseWithCovariance(_Message):
    pose: Pose
    covariance: list[float]
    def __init__(
        self,
        pose: Pose | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class PoseWithCovarianceStamped(_Message):
    header: _std_msgs_msg.Header
    pose: PoseWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: PoseWithCovariance | None = None,
    ) -> None: ...

class Quaternion(_Message):
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

class QuaternionStamped(_Message):
    header: _std_msgs_msg.Header
    quaternion: Quaternion
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        quaternion: Quaternion | None = None,
    ) -> None: ...

class Transform(_Message):
    translation: Vector3
    rotation: Quaternion
    def __init__(
        self,
        translation: Vector3 | None = None,
        rotation: Quaternion | None = None,
    ) -> None: ...

class TransformStamped(_Message):
    header: _std_msgs_msg.Header
    child_frame_id: str
    transform: Transform
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        child_frame_id: str | None = None,
        transform: Transform | None = None,
    ) -> None: ...

class Twist(_Message):
    linear: Vector3
    angular: Vector3
    def __init__(
        self,
        linear: Vector3 | None = None,
        angular: Vector3 | None = None,
    ) -> None: ...

class TwistStamped(_Message):
    header: _std_msgs_msg.Header
    twist: Twist
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        twist: Twist | None = None,
    ) -> None: ...

class TwistWithCovariance(_Message):
    twist: Twist
    covariance: list[float]
    def __init__(
        self,
        twist: Twist | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class TwistWithCovarianceStamped(_Message):
    header: _std_msgs_msg.Header
    twist: TwistWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        twist: TwistWithCovariance | None = None,
    ) -> None: ...

class Vector3(_Message):
    x: float
    y: float
    z: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
    ) -> None: ...

class Vector3Stamped(_Message):
    header: _std_msgs_msg.Header
    vector: Vector3
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        vector: Vector3 | None = None,
    ) -> None: ...

class Wrench(_Message):
    force: Vector3
    torque: Vector3
    def __init__(
        self,
        force: Vector3 | None = None,
        torque: Vector3 | None = None,
    ) -> None: ...

class WrenchStamped(_Message):
    header: _std_msgs_msg.Header
    wrench: Wrench
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        wrench: Wrench | None = None,
    ) -> None: ...
