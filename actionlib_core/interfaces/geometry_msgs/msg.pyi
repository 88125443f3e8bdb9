# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message

class Accel(_Message):
    """An acceleration."""

    linear: Vector3  # [m/s^2]
    angular: Vector3  # [rad/s^2]
    def __init__(
        self,
        linear: Vector3 | None = None,
        angular: Vector3 | None = None,
    ) -> None: ...

class AccelStamped(_Message):
    """An acceleration in the frame of the header."""

    header: _std_msgs_msg.Header
    accel: Accel
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        accel: Accel | None = None,
    ) -> None: ...

class AccelWithCovariance(_Message):
    """An acceleration and how sure it is."""

    accel: Accel
    covariance: list[float]  # 6x6 by rows: linear x, y, z [m/s^2], angular x, y, z [rad/s^2]
    def __init__(
        self,
        accel: Accel | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class AccelWithCovarianceStamped(_Message):
    """An acceleration with its covariance in the frame of the header."""

    header: _std_msgs_msg.Header
    accel: AccelWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        accel: AccelWithCovariance | None = None,
    ) -> None: ...

class Inertia(_Message):
    """Mass properties of a body."""

    m: float  # mass [kg]
    com: Vector3  # centre of mass [m]
    ixx: float  # inertia tensor [kg m^2]
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
    """Mass properties in the frame of the header."""

    header: _std_msgs_msg.Header
    inertia: Inertia
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        inertia: Inertia | None = None,
    ) -> None: ...

class Point(_Message):
    """A position [m]."""

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
    """A position [m] in single precision, for large clouds."""

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
    """A position in the frame of the header."""

    header: _std_msgs_msg.Header
    point: Point
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        point: Point | None = None,
    ) -> None: ...

class Polygon(_Message):
    """A closed outline: the last point joins the first."""

    points: list[Point32]
    def __init__(
        self,
        points: _Collection[Point32] | None = None,
    ) -> None: ...

class PolygonStamped(_Message):
    """An outline in the frame of the header."""

    header: _std_msgs_msg.Header
    polygon: Polygon
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        polygon: Polygon | None = None,
    ) -> None: ...

class Pose(_Message):
    """Where something is and how it is turned."""

    position: Point  # [m]
    orientation: Quaternion  # unit quaternion
    def __init__(
        self,
        position: Point | None = None,
        orientation: Quaternion | None = None,
    ) -> None: ...

class Pose2D(_Message):
    """A pose in the plane."""

    x: float  # [m]
    y: float  # [m]
    theta: float  # [rad], counter-clockwise from the x axis
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        theta: float | None = None,
    ) -> None: ...

class PoseArray(_Message):
    """Poses in the frame of the header."""

    header: _std_msgs_msg.Header
    poses: list[Pose]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        poses: _Collection[Pose] | None = None,
    ) -> None: ...

class PoseStamped(_Message):
    """A pose in the frame, and at the time, of the header."""

    header: _std_msgs_msg.Header
    pose: Pose
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: Pose | None = None,
    ) -> None: ...

class PoseWithCovariance(_Message):
    """A pose and how sure it is."""

    pose: Pose
    covariance: list[float]  # 6x6 by rows: x, y, z [m], rotation about x, y, z [rad]
    def __init__(
        self,
        pose: Pose | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class PoseWithCovarianceStamped(_Message):
    """A pose with its covariance in the frame of the header."""

    header: _std_msgs_msg.Header
    pose: PoseWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: PoseWithCovariance | None = None,
    ) -> None: ...

class Quaternion(_Message):
    """An orientation. All zeros is none: w = 1 is no rotation; a yaw angle a in the plane is z = sin(a/2), w = cos(a/2)."""

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
    """An orientation in the frame of the header."""

    header: _std_msgs_msg.Header
    quaternion: Quaternion
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        quaternion: Quaternion | None = None,
    ) -> None: ...

class Transform(_Message):
    """From one frame to another."""

    translation: Vector3  # [m]
    rotation: Quaternion  # unit quaternion
    def __init__(
        self,
        translation: Vector3 | None = None,
        rotation: Quaternion | None = None,
    ) -> None: ...

class TransformStamped(_Message):
    """The pose of the frame child_frame_id in the frame of the header."""

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
    """A velocity."""

    linear: Vector3  # [m/s]; x is forward in a robot's frame
    angular: Vector3  # [rad/s]; z is counter-clockwise in the plane
    def __init__(
        self,
        linear: Vector3 | None = None,
        angular: Vector3 | None = None,
    ) -> None: ...

class TwistStamped(_Message):
    """A velocity in the frame of the header."""

    header: _std_msgs_msg.Header
    twist: Twist
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        twist: Twist | None = None,
    ) -> None: ...

class TwistWithCovariance(_Message):
    """A velocity and how sure it is."""

    twist: Twist
    covariance: list[float]  # 6x6 by rows: vx, vy, vz [m/s], rotation rates about x, y, z [rad/s]
    def __init__(
        self,
        twist: Twist | None = None,
        covariance: _Collection[float] | None = None,
    ) -> None: ...

class TwistWithCovarianceStamped(_Message):
    """A velocity with its covariance in the frame of the header."""

    header: _std_msgs_msg.Header
    twist: TwistWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        twist: TwistWithCovariance | None = None,
    ) -> None: ...

class Vector3(_Message):
    """A direction in space; its unit is that of the message that uses it."""

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
    """A direction in the frame of the header."""

    header: _std_msgs_msg.Header
    vector: Vector3
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        vector: Vector3 | None = None,
    ) -> None: ...

class Wrench(_Message):
    """Force and torque."""

    force: Vector3  # [N]
    torque: Vector3  # [Nm]
    def __init__(
        self,
        force: Vector3 | None = None,
        torque: Vector3 | None = None,
    ) -> None: ...

class WrenchStamped(_Message):
    """Force and torque in the frame of the header."""

    header: _std_msgs_msg.Header
    wrench: Wrench
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        wrench: Wrench | None = None,
    ) -> None: ...
