# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Time as _Time

class BatteryState(_Message):
    """State of a battery. A value that is not measured is NaN."""

    POWER_SUPPLY_STATUS_UNKNOWN: _Final = 0
    POWER_SUPPLY_STATUS_CHARGING: _Final = 1
    POWER_SUPPLY_STATUS_DISCHARGING: _Final = 2
    POWER_SUPPLY_STATUS_NOT_CHARGING: _Final = 3
    POWER_SUPPLY_STATUS_FULL: _Final = 4
    POWER_SUPPLY_HEALTH_UNKNOWN: _Final = 0
    POWER_SUPPLY_HEALTH_GOOD: _Final = 1
    POWER_SUPPLY_HEALTH_OVERHEAT: _Final = 2
    POWER_SUPPLY_HEALTH_DEAD: _Final = 3
    POWER_SUPPLY_HEALTH_OVERVOLTAGE: _Final = 4
    POWER_SUPPLY_HEALTH_UNSPEC_FAILURE: _Final = 5
    POWER_SUPPLY_HEALTH_COLD: _Final = 6
    POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE: _Final = 7
    POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE: _Final = 8
    POWER_SUPPLY_TECHNOLOGY_UNKNOWN: _Final = 0
    POWER_SUPPLY_TECHNOLOGY_NIMH: _Final = 1
    POWER_SUPPLY_TECHNOLOGY_LION: _Final = 2
    POWER_SUPPLY_TECHNOLOGY_LIPO: _Final = 3
    POWER_SUPPLY_TECHNOLOGY_LIFE: _Final = 4
    POWER_SUPPLY_TECHNOLOGY_NICD: _Final = 5
    POWER_SUPPLY_TECHNOLOGY_LIMN: _Final = 6
    header: _std_msgs_msg.Header
    voltage: float  # [V]
    temperature: float  # [degrees Celsius]
    current: float  # [A], negative while discharging
    charge: float  # [Ah]
    capacity: float  # [Ah], as of now
    design_capacity: float  # [Ah], when new
    percentage: float  # 0 to 1
    power_supply_status: int  # one of POWER_SUPPLY_STATUS_*
    power_supply_health: int  # one of POWER_SUPPLY_HEALTH_*
    power_supply_technology: int  # one of POWER_SUPPLY_TECHNOLOGY_*
    present: bool  # whether there is a battery
    cell_voltage: list[float]  # [V] each
    cell_temperature: list[float]  # [degrees Celsius] each
    location: str  # where it is plugged in
    serial_number: str
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        voltage: float | None = None,
        temperature: float | None = None,
        current: float | None = None,
        charge: float | None = None,
        capacity: float | None = None,
        design_capacity: float | None = None,
        percentage: float | None = None,
        power_supply_status: int | None = None,
        power_supply_health: int | None = None,
        power_supply_technology: int | None = None,
        present: bool | None = None,
        cell_voltage: _Collection[float] | None = None,
        cell_temperature: _Collection[float] | None = None,
        location: str | None = None,
        serial_number: str | None = None,
    ) -> None: ...

class CameraInfo(_Message):
    """Calibration of a camera."""

    header: _std_msgs_msg.Header
    height: int  # rows
    width: int  # columns
    distortion_model: str  # for example plumb_bob
    D: list[float]  # distortion
    K: list[float]  # 3x3 intrinsic matrix by rows [pixel]
    R: list[float]  # 3x3 rectification by rows
    P: list[float]  # 3x4 projection by rows [pixel]
    binning_x: int  # 0 as 1
    binning_y: int  # 0 as 1
    roi: RegionOfInterest  # all zeros: the full picture
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        height: int | None = None,
        width: int | None = None,
        distortion_model: str | None = None,
        D: _Collection[float] | None = None,
        K: _Collection[float] | None = None,
        R: _Collection[float] | None = None,
        P: _Collection[float] | None = None,
        binning_x: int | None = None,
        binning_y: int | None = None,
        roi: RegionOfInterest | None = None,
    ) -> None: ...

class ChannelFloat32(_Message):
    """One value for each point of a PointCloud."""

    name: str  # for example intensity
    values: list[float]
    def __init__(
        self,
        name: str | None = None,
        values: _Collection[float] | None = None,
    ) -> None: ...

class CompressedImage(_Message):
    """A compressed picture."""

    header: _std_msgs_msg.Header
    format: str  # for example jpeg or png
    data: bytes
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        format: str | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class FluidPressure(_Message):
    header: _std_msgs_msg.Header
    fluid_pressure: float  # [Pa], absolute
    variance: float  # 0: not known
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        fluid_pressure: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class Illuminance(_Message):
    header: _std_msgs_msg.Header
    illuminance: float  # [lux]
    variance: float  # 0: not known
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        illuminance: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class Image(_Message):
    """A picture, row by row."""

    header: _std_msgs_msg.Header
    height: int  # rows
    width: int  # columns
    encoding: str  # for example rgb8, bgr8, mono8, 32FC1
    is_bigendian: int  # 0 or 1
    step: int  # bytes per row
    data: bytes  # step * height bytes
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        height: int | None = None,
        width: int | None = None,
        encoding: str | None = None,
        is_bigendian: int | None = None,
        step: int | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Imu(_Message):
    """Inertial measurement. A covariance whose first element is -1 says that the value is not measured."""

    header: _std_msgs_msg.Header
    orientation: _geometry_msgs_msg.Quaternion
    orientation_covariance: list[float]  # 3x3 by rows about x, y, z
    angular_velocity: _geometry_msgs_msg.Vector3  # [rad/s]
    angular_velocity_covariance: list[float]  # 3x3 by rows about x, y, z
    linear_acceleration: _geometry_msgs_msg.Vector3  # [m/s^2]
    linear_acceleration_covariance: list[float]  # 3x3 by rows x, y, z
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        orientation: _geometry_msgs_msg.Quaternion | None = None,
        orientation_covariance: _Collection[float] | None = None,
        angular_velocity: _geometry_msgs_msg.Vector3 | None = None,
        angular_velocity_covariance: _Collection[float] | None = None,
        linear_acceleration: _geometry_msgs_msg.Vector3 | None = None,
        linear_acceleration_covariance: _Collection[float] | None = None,
    ) -> None: ...

class JointState(_Message):
    """State of joints; each array is empty or has one element per name."""

    header: _std_msgs_msg.Header
    name: list[str]
    position: list[float]  # [rad] or [m]
    velocity: list[float]  # [rad/s] or [m/s]
    effort: list[float]  # [Nm] or [N]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        name: _Collection[str] | None = None,
        position: _Collection[float] | None = None,
        velocity: _Collection[float] | None = None,
        effort: _Collection[float] | None = None,
    ) -> None: ...

class Joy(_Message):
    """State of a joystick."""

    header: _std_msgs_msg.Header
    axes: list[float]  # -1 to 1
    buttons: list[int]  # 1 while pressed
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        axes: _Collection[float] | None = None,
        buttons: _Collection[int] | None = None,
    ) -> None: ...

class JoyFeedback(_Message):
    TYPE_LED: _Final = 0
    TYPE_RUMBLE: _Final = 1
    TYPE_BUZZER: _Final = 2
    type: int  # one of TYPE_*
    id: int
    intensity: float  # 0 to 1
    def __init__(
        self,
        type: int | None = None,
        id: int | None = None,
        intensity: float | None = None,
    ) -> None: ...

class JoyFeedbackArray(_Message):
    array: list[JoyFeedback]
    def __init__(
        self,
        array: _Collection[JoyFeedback] | None = None,
    ) -> None: ...

class LaserEcho(_Message):
    """Several echoes of one ray."""

    echoes: list[float]  # [m] or intensities
    def __init__(
        self,
        echoes: _Collection[float] | None = None,
    ) -> None: ...

class LaserScan(_Message):
    """One sweep of a planar laser scanner."""

    header: _std_msgs_msg.Header
    angle_min: float  # of the first ray [rad]
    angle_max: float  # of the last ray [rad]
    angle_increment: float  # between rays [rad]
    time_increment: float  # between rays [s]
    scan_time: float  # between scans [s]
    range_min: float  # shorter ranges are not valid [m]
    range_max: float  # longer ranges are not valid [m]
    ranges: list[float]  # [m], one per ray
    intensities: list[float]  # device's own unit, or empty
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        angle_min: float | None = None,
        angle_max: float | None = None,
        angle_increment: float | None = None,
        time_increment: float | None = None,
        scan_time: float | None = None,
        range_min: float | None = None,
        range_max: float | None = None,
        ranges: _Collection[float] | None = None,
        intensities: _Collection[float] | None = None,
    ) -> None: ...

class MagneticField(_Message):
    header: _std_msgs_msg.Header
    magnetic_field: _geometry_msgs_msg.Vector3  # [T]
    magnetic_field_covariance: list[float]  # 3x3 by rows; 0: not known
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        magnetic_field: _geometry_msgs_msg.Vector3 | None = None,
        magnetic_field_covariance: _Collection[float] | None = None,
    ) -> None: ...

class MultiDOFJointState(_Message):
    """State of joints with several degrees of freedom; arrays as in JointState."""

    header: _std_msgs_msg.Header
    joint_names: list[str]
    transforms: list[_geometry_msgs_msg.Transform]
    twist: list[_geometry_msgs_msg.Twist]
    wrench: list[_geometry_msgs_msg.Wrench]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        transforms: _Collection[_geometry_msgs_msg.Transform] | None = None,
        twist: _Collection[_geometry_msgs_msg.Twist] | None = None,
        wrench: _Collection[_geometry_msgs_msg.Wrench] | None = None,
    ) -> None: ...

class MultiEchoLaserScan(_Message):
    """One sweep of a scanner that sees several echoes per ray; fields as in LaserScan."""

    header: _std_msgs_msg.Header
    angle_min: float  # [rad]
    angle_max: float  # [rad]
    angle_increment: float  # [rad]
    time_increment: float  # [s]
    scan_time: float  # [s]
    range_min: float  # [m]
    range_max: float  # [m]
    ranges: list[LaserEcho]
    intensities: list[LaserEcho]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        angle_min: float | None = None,
        angle_max: float | None = None,
        angle_increment: float | None = None,
        time_increment: float | None = None,
        scan_time: float | None = None,
        range_min: float | None = None,
        range_max: float | None = None,
        ranges: _Collection[LaserEcho] | None = None,
        intensities: _Collection[LaserEcho] | None = None,
    ) -> None: ...

class NavSatFix(_Message):
    """A position by satellite (WGS 84)."""

    COVARIANCE_TYPE_UNKNOWN: _Final = 0
    COVARIANCE_TYPE_APPROXIMATED: _Final = 1
    COVARIANCE_TYPE_DIAGONAL_KNOWN: _Final = 2
    COVARIANCE_TYPE_KNOWN: _Final = 3
    header: _std_msgs_msg.Header
    status: NavSatStatus
    latitude: float  # [degrees], north positive
    longitude: float  # [degrees], east positive
    altitude: float  # above the ellipsoid [m]; NaN: not known
    position_covariance: list[float]  # 3x3 by rows, east, north, up [m^2]
    position_covariance_type: int  # one of COVARIANCE_TYPE_*
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: NavSatStatus | None = None,
        latitude: float | None = None,
        longitude: float | None = None,
        altitude: float | None = None,
        position_covariance: _Collection[float] | None = None,
        position_covariance_type: int | None = None,
    ) -> None: ...

class NavSatStatus(_Message):
    """Kind of a satellite fix."""

    STATUS_NO_FIX: _Final = -1
    STATUS_FIX: _Final = 0
    STATUS_SBAS_FIX: _Final = 1
    STATUS_GBAS_FIX: _Final = 2
    SERVICE_GPS: _Final = 1
    SERVICE_GLONASS: _Final = 2
    SERVICE_COMPASS: _Final = 4
    SERVICE_GALILEO: _Final = 8
    status: int  # one of STATUS_*
    service: int  # sum of SERVICE_*
    def __init__(
        self,
        status: int | None = None,
        service: int | None = None,
    ) -> None: ...

class PointCloud(_Message):
    """Points with further values per point."""

    header: _std_msgs_msg.Header
    points: list[_geometry_msgs_msg.Point32]
    channels: list[ChannelFloat32]  # each has one value per point
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        points: _Collection[_geometry_msgs_msg.Point32] | None = None,
        channels: _Collection[ChannelFloat32] | None = None,
    ) -> None: ...

class PointCloud2(_Message):
    """Points in a packed binary layout."""

    header: _std_msgs_msg.Header
    height: int  # 1 for a cloud without order
    width: int  # points per row
    fields: list[PointField]  # what one point holds
    is_bigendian: bool
    point_step: int  # bytes per point
    row_step: int  # bytes per row
    data: bytes  # row_step * height bytes
    is_dense: bool  # whether no point is invalid
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        height: int | None = None,
        width: int | None = None,
        fields: _Collection[PointField] | None = None,
        is_bigendian: bool | None = None,
        point_step: int | None = None,
        row_step: int | None = None,
        data: _Collection[int] | None = None,
        is_dense: bool | None = None,
    ) -> None: ...

class PointField(_Message):
    """One value of each point of a PointCloud2."""

    INT8: _Final = 1
    UINT8: _Final = 2
    INT16: _Final = 3
    UINT16: _Final = 4
    INT32: _Final = 5
    UINT32: _Final = 6
    FLOAT32: _Final = 7
    FLOAT64: _Final = 8
    name: str  # for example x
    offset: int  # bytes from the start of the point
    datatype: int  # one of the constants
    count: int  # number of elements
    def __init__(
        self,
        name: str | None = None,
        offset: int | None = None,
        datatype: int | None = None,
        count: int | None = None,
    ) -> None: ...

class Range(_Message):
    """One reading of a distance sensor."""

    ULTRASOUND: _Final = 0
    INFRARED: _Final = 1
    header: _std_msgs_msg.Header
    radiation_type: int  # ULTRASOUND or INFRARED
    field_of_view: float  # angle [rad]
    min_range: float  # [m]
    max_range: float  # [m]
    range: float  # [m]; below min_range or above max_range: not valid, see REP 117
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        radiation_type: int | None = None,
        field_of_view: float | None = None,
        min_range: float | None = None,
        max_range: float | None = None,
        range: float | None = None,
    ) -> None: ...

class RegionOfInterest(_Message):
    """Part of a picture [pixel]."""

    x_offset: int
    y_offset: int
    height: int
    width: int
    do_rectify: bool  # whether it was cut from the rectified picture
    def __init__(
        self,
        x_offset: int | None = None,
        y_offset: int | None = None,
        height: int | None = None,
        width: int | None = None,
        do_rectify: bool | None = None,
    ) -> None: ...

class RelativeHumidity(_Message):
    header: _std_msgs_msg.Header
    relative_humidity: float  # 0 to 1
    variance: float  # 0: not known
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        relative_humidity: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class Temperature(_Message):
    header: _std_msgs_msg.Header
    temperature: float  # [degrees Celsius]
    variance: float  # 0: not known
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        temperature: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class TimeReference(_Message):
    """Another clock's time at the header's stamp."""

    header: _std_msgs_msg.Header
    time_ref: _Time  # that clock's time
    source: str  # its name
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        time_ref: _Time | float | None = None,
        source: str | None = None,
    ) -> None: ...
