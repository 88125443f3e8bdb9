"""All parameters of the simulated robot, with units, limits and defaults.

The YAML file has one section per class and one line per field:

    robot:
      radius: 0.25        # [m]
      max_speed: 0.8      # [m/s]
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile, Limits
from smachpy.places.exceptions import InputFileError
from smachpy.places.pose import ORIGIN, Pose2D, wrap_angle

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from actionlib_core.inputs.checked_file import Section

S = TypeVar("S")


def _quantity(default: S, unit: str, doc: str, **limits: float) -> S:
    metadata = {"unit": unit, "doc": doc, "limits": Limits(**limits)}
    result: S = field(default=default, metadata=metadata)
    return result


@dataclass(frozen=True, slots=True)
class RobotConfig:
    """The body: a disc that drives like a unicycle."""

    radius: float = _quantity(0.25, "m", "Radius of the body.", above=0, high=5)
    max_speed: float = _quantity(0.8, "m/s", "Fastest forward speed.", above=0, high=10)
    max_reverse_speed: float = _quantity(0.2, "m/s", "Fastest speed backwards.", above=0, high=10)
    max_turn_rate: float = _quantity(1.5, "rad/s", "Fastest turn rate.", above=0, high=20)
    acceleration: float = _quantity(0.8, "m/s^2", "Acceleration.", above=0, high=50)
    braking: float = _quantity(1.2, "m/s^2", "Deceleration.", above=0, high=50)
    turn_acceleration: float = _quantity(
        3.0, "rad/s^2", "Acceleration of turns.", above=0, high=100
    )
    sight: float = _quantity(
        3.0,
        "m",
        "Distance from which it sees obstacles that are not on the map.",
        above=0,
        high=100,
    )


@dataclass(frozen=True, slots=True)
class PlannerConfig:
    """How ways are chosen on the map."""

    margin: float = _quantity(0.03, "m", "Smallest distance between body and walls.", low=0, high=2)
    wall_distance: float = _quantity(
        0.6, "m", "Distance from walls within which a way costs more.", low=0, high=10
    )
    wall_weight: float = _quantity(
        4.0, "1", "Extra cost of a metre right beside a wall, as a factor.", low=0, high=100
    )
    unknown_is_free: bool = field(
        default=False, metadata={"doc": "Whether it drives over unknown cells of the map."}
    )


@dataclass(frozen=True, slots=True)
class ControlConfig:
    """How the way is followed and when the goal counts as reached."""

    rate: float = _quantity(20.0, "Hz", "Control steps per second.", low=5, high=1000)
    feedback_rate: float = _quantity(5.0, "Hz", "Feedback messages per second.", above=0, high=10)
    override_time: float = _quantity(
        0.5, "s", "Time for which a message on cmd_vel drives it.", above=0, high=60
    )
    xy_tolerance: float = _quantity(
        0.05, "m", "Largest distance from a reached goal.", low=0.01, high=2
    )
    yaw_tolerance: float = _quantity(
        0.05, "rad", "Largest heading error at a reached goal.", low=0.01, high=3.2
    )
    lookahead_time: float = _quantity(
        0.7, "s", "It steers to the point of its way this far ahead in time.", above=0, high=5
    )
    lookahead_min: float = _quantity(0.3, "m", "Smallest distance to that point.", low=0.05, high=5)
    turn_on_spot: float = _quantity(
        0.8, "rad", "Heading error from which it stops and turns first.", above=0.1, high=3.2
    )


@dataclass(frozen=True, slots=True)
class RecoveryConfig:
    """What it tries when no way is left."""

    attempts: int = _quantity(3, "", "Recoveries before the goal is aborted.", low=0, high=100)
    back_up: float = _quantity(0.3, "m", "How far it backs up.", low=0, high=5)
    patience: float = _quantity(1.0, "s", "Pause before it looks again.", low=0, high=600)
    traffic_patience: float = _quantity(
        20.0, "s", "Longest wait for a robot or person in its way.", low=0, high=3600
    )


@dataclass(frozen=True, slots=True)
class ScanConfig:
    """The laser scanner, in the middle of the robot."""

    rate: float = _quantity(
        5.0, "Hz", "Scans per second, while there are subscribers.", above=0, high=50
    )
    rays: int = _quantity(271, "", "Rays of a scan.", low=2, high=10_000)
    field: float = _quantity(
        4.712389, "rad", "Angle from the first ray to the last.", above=0, high=6.2832
    )
    range_min: float = _quantity(0.05, "m", "Smallest range.", low=0, high=10)
    range_max: float = _quantity(8.0, "m", "Greatest range.", above=0, high=100)
    noise: float = _quantity(0.0, "m", "Standard deviation of the noise of a range.", low=0, high=1)


@dataclass(frozen=True, slots=True)
class BatteryConfig:
    """The battery and the charger of the dock."""

    capacity: float = _quantity(1.0, "Wh", "Energy when full.", above=0, high=1e5)
    charge: float = _quantity(0.6, "1", "Fraction left at the start.", low=0, high=1)
    voltage: float = _quantity(24.0, "V", "Nominal voltage.", above=0, high=1000)
    idle_power: float = _quantity(4.0, "W", "Consumption at rest.", low=0, high=1e4)
    drive_power: float = _quantity(
        40.0, "W", "Additional consumption at full speed.", low=0, high=1e5
    )
    charge_power: float = _quantity(600.0, "W", "Power of the dock.", above=0, high=1e6)
    period: float = _quantity(0.5, "s", "Time between battery messages.", low=0.05, high=60)


@dataclass(frozen=True, slots=True)
class SimConfig:
    """All parameters.

    Attributes:
        start: The robot's start pose, in the map frame.
        dock: Its pose while it charges, in the map frame; None if it has no dock.
    """

    robot: RobotConfig = RobotConfig()
    planner: PlannerConfig = PlannerConfig()
    control: ControlConfig = ControlConfig()
    recovery: RecoveryConfig = RecoveryConfig()
    scan: ScanConfig = ScanConfig()
    battery: BatteryConfig = BatteryConfig()
    start: Pose2D = ORIGIN
    dock: Pose2D | None = None


def load_config(path: Path) -> SimConfig:
    """Read a robot's YAML file; missing sections and fields keep their defaults.

    Raises:
        InputFileError: the file has problems; all are listed.
    """
    file = CheckedFile(path, InputFileError)
    top = file.top
    config = SimConfig(
        robot=_read(top.section("robot"), RobotConfig),
        planner=_read(top.section("planner"), PlannerConfig),
        control=_read(top.section("control"), ControlConfig),
        recovery=_read(top.section("recovery"), RecoveryConfig),
        scan=_read(top.section("scan"), ScanConfig),
        battery=_read(top.section("battery"), BatteryConfig),
        start=read_pose(top.section("start")) if "start" in top else ORIGIN,
        dock=read_pose(top.section("dock")) if "dock" in top else None,
    )
    top.allow("start", "dock")
    top.close()
    file.check()
    return config


def read_pose(section: Section) -> Pose2D:
    """Read the fields x [m], y [m] and yaw [rad, default 0], and close the section."""
    x = section.number("x", REQUIRED, unit="m")
    y = section.number("y", REQUIRED, unit="m")
    yaw = section.number("yaw", 0.0, unit="rad")
    section.close()
    return Pose2D(x, y, wrap_angle(yaw))


def read_file(
    section: Section, key: str, load: Callable[[Path], S], default: Path | None = None
) -> S | None:
    """Return what is in the file that the field `key` names, or else in `default`.

    None without either, or if the file has problems: they are added to those of the section's file.
    """
    section.allow(key)
    path = section.file.folder / section.text(key, REQUIRED) if key in section else default
    if path is not None and section.is_good(key):
        try:
            return load(path)
        except InputFileError as error:
            section.file.problems += error.problems
    return None


def _read(section: Section, kind: type[S]) -> S:
    """Read one parameter class from its section."""
    values = section.values(kind)
    section.close()
    return kind(**values)
