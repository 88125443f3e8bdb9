# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Time as _Time

class BatteryState(_Ros2Message):
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
    POWER_SUPPLY_TECHNOLOGY_TERNARY: _Final = 7
    POWER_SUPPLY_TECHNOLOGY_VRLA: _Final = 8
    header: _std_msgs_msg.Header
    voltage: float
    temperature: float
    current: float
    charge: float
    capacity: float
    design_capacity: float
    percentage: float
    power_supply_status: int
    power_supply_health: int
    power_supply_technology: int
    present: bool
    cell_voltage: list[float]
    cell_temperature: list[float]
    location: str
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

class CameraInfo(_Ros2Message):
    header: _std_msgs_msg.Header
    height: int
    width: int
    distortion_model: str
    d: list[float]
    k: list[float]
    r: list[float]
    p: list[float]
    binning_x: int
    binning_y: int
    roi: RegionOfInterest
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        height: int | None = None,
        width: int | None = None,
        distortion_model: str | None = None,
        d: _Collection[float] | None = None,
        k: _Collection[float] | None = None,
        r: _Collection[float] | None = None,
        p: _Collection[float] | None = None,
        binning_x: int | None = None,
        binning_y: int | None = None,
        roi: RegionOfInterest | None = None,
    ) -> None: ...

class ChannelFloat32(_Ros2Message):
    name: str
    values: list[float]
    def __init__(
        self,
        name: str | None = None,
        values: _Collection[float] | None = None,
    ) -> None: ...

class CompressedImage(_Ros2Message):
    header: _std_msgs_msg.Header
    format: str
    data: bytes
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        format: str | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class FluidPressure(_Ros2Message):
    header: _std_msgs_msg.Header
    fluid_pressure: float
    variance: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        fluid_pressure: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class Illuminance(_Ros2Message):
    header: _std_msgs_msg.Header
    illuminance: float
    variance: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        illuminance: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class Image(_Ros2Message):
    header: _std_msgs_msg.Header
    height: int
    width: int
    encoding: str
    is_bigendian: int
    step: int
    data: bytes
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

class Imu(_Ros2Message):
    header: _std_msgs_msg.Header
    orientation: _geometry_msgs_msg.Quaternion
    orientation_covariance: list[float]
    angular_velocity: _geometry_msgs_msg.Vector3
    angular_velocity_covariance: list[float]
    linear_acceleration: _geometry_msgs_msg.Vector3
    linear_acceleration_covariance: list[float]
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

class JointState(_Ros2Message):
    header: _std_msgs_msg.Header
    name: list[str]
    position: list[float]
    velocity: list[float]
    effort: list[float]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        name: _Collection[str] | None = None,
        position: _Collection[float] | None = None,
        velocity: _Collection[float] | None = None,
        effort: _Collection[float] | None = None,
    ) -> None: ...

class Joy(_Ros2Message):
    header: _std_msgs_msg.Header
    axes: list[float]
    buttons: list[int]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        axes: _Collection[float] | None = None,
        buttons: _Collection[int] | None = None,
    ) -> None: ...

class JoyFeedback(_Ros2Message):
    TYPE_LED: _Final = 0
    TYPE_RUMBLE: _Final = 1
    TYPE_BUZZER: _Final = 2
    type: int
    id: int
    intensity: float
    def __init__(
        self,
        type: int | None = None,
        id: int | None = None,
        intensity: float | None = None,
    ) -> None: ...

class JoyFeedbackArray(_Ros2Message):
    array: list[JoyFeedback]
    def __init__(
        self,
        array: _Collection[JoyFeedback] | None = None,
    ) -> None: ...

class LaserEcho(_Ros2Message):
    echoes: list[float]
    def __init__(
        self,
        echoes: _Collection[float] | None = None,
    ) -> None: ...

class LaserScan(_Ros2Message):
    header: _std_msgs_msg.Header
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: list[float]
    intensities: list[float]
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

class MagneticField(_Ros2Message):
    header: _std_msgs_msg.Header
    magnetic_field: _geometry_msgs_msg.Vector3
    magnetic_field_covariance: list[float]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        magnetic_field: _geometry_msgs_msg.Vector3 | None = None,
        magnetic_field_covariance: _Collection[float] | None = None,
    ) -> None: ...

class MultiDOFJointState(_Ros2Message):
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

class MultiEchoLaserScan(_Ros2Message):
    header: _std_msgs_msg.Header
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
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

class NavSatFix(_Ros2Message):
    COVARIANCE_TYPE_UNKNOWN: _Final = 0
    COVARIANCE_TYPE_APPROXIMATED: _Final = 1
    COVARIANCE_TYPE_DIAGONAL_KNOWN: _Final = 2
    COVARIANCE_TYPE_KNOWN: _Final = 3
    header: _std_msgs_msg.Header
    status: NavSatStatus
    latitude: float
    longitude: float
    altitude: float
    position_covariance: list[float]
    position_covariance_type: int
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

class NavSatStatus(_Ros2Message):
    STATUS_UNKNOWN: _Final = -2
    STATUS_NO_FIX: _Final = -1
    STATUS_FIX: _Final = 0
    STATUS_SBAS_FIX: _Final = 1
    STATUS_GBAS_FIX: _Final = 2
    SERVICE_UNKNOWN: _Final = 0
    SERVICE_GPS: _Final = 1
    SERVICE_GLONASS: _Final = 2
    SERVICE_COMPASS: _Final = 4
    SERVICE_GALILEO: _Final = 8
    status: int
    service: int
    def __init__(
        self,
        status: int | None = None,
        service: int | None = None,
    ) -> None: ...

class PointCloud(_Ros2Message):
    header: _std_msgs_msg.Header
    points: list[_geometry_msgs_msg.Point32]
    channels: list[ChannelFloat32]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        points: _Collection[_geometry_msgs_msg.Point32] | None = None,
        channels: _Collection[ChannelFloat32] | None = None,
    ) -> None: ...

class PointCloud2(_Ros2Message):
    header: _std_msgs_msg.Header
    height: int
    width: int
    fields: list[PointField]
    is_bigendian: bool
    point_step: int
    row_step: int
    data: bytes
    is_dense: bool
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

class PointField(_Ros2Message):
    INT8: _Final = 1
    UINT8: _Final = 2
    INT16: _Final = 3
    UINT16: _Final = 4
    INT32: _Final = 5
    UINT32: _Final = 6
    FLOAT32: _Final = 7
    FLOAT64: _Final = 8
    name: str
    offset: int
    datatype: int
    count: int
    def __init__(
        self,
        name: str | None = None,
        offset: int | None = None,
        datatype: int | None = None,
        count: int | None = None,
    ) -> None: ...

class Range(_Ros2Message):
    ULTRASOUND: _Final = 0
    INFRARED: _Final = 1
    header: _std_msgs_msg.Header
    radiation_type: int
    field_of_view: float
    min_range: float
    max_range: float
    range: float
    variance: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        radiation_type: int | None = None,
        field_of_view: float | None = None,
        min_range: float | None = None,
        max_range: float | None = None,
        range: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class RegionOfInterest(_Ros2Message):
    x_offset: int
    y_offset: int
    height: int
    width: int
    do_rectify: bool
    def __init__(
        self,
        x_offset: int | None = None,
        y_offset: int | None = None,
        height: int | None = None,
        width: int | None = None,
        do_rectify: bool | None = None,
    ) -> None: ...

class RelativeHumidity(_Ros2Message):
    header: _std_msgs_msg.Header
    relative_humidity: float
    variance: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        relative_humidity: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class Temperature(_Ros2Message):
    header: _std_msgs_msg.Header
    temperature: float
    variance: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        temperature: float | None = None,
        variance: float | None = None,
    ) -> None: ...

class TimeReference(_Ros2Message):
    header: _std_msgs_msg.Header
    time_ref: _builtin_interfaces_msg.Time
    source: str
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        time_ref: _builtin_interfaces_msg.Time | _Time | float | None = None,
        source: str | None = None,
    ) -> None: ...
