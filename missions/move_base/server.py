"""The robot on the network: actions `move_base` and `charge`, topics `odom` and `battery`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from actionlib_core.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.node import get_node
from actionlib_core.simple_action_server import SimpleActionServer
from actionlib_core.time import Time
from actionlib_core.topic import Publisher
from missions.exceptions import NavigationError
from missions.interfaces import ChargeAction, ChargeFeedback, ChargeResult
from missions.move_base.geometry import Pose2D, quaternion_of, yaw_of
from missions.move_base.navigation import STOP, drive_to

if TYPE_CHECKING:
    from actionlib_core.clock import Task
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
    from actionlib_core.node import Node
    from missions.interfaces import ChargeGoal
    from missions.move_base.navigation import Command
    from missions.move_base.world import Robot

MAP_FRAME: Final = "map"
BASE_FRAME: Final = "base_link"
_LATE: Final = 0.5  # [s] a loop this late gives the lost time up instead of hurrying after it
_AT_DOCK: Final = 0.2  # [m] the charger reaches this far
_CHARGE_PERIOD: Final = 0.5  # [s] between two feedback messages of `charge`
_JUST_PAST: Final = 1e-3  # [s] waited longer, as a rounding error would never pass
_SHORTEST_ROTATION: Final = 1e-3  # a quaternion shorter than this is no rotation


class RobotServer:
    """Serves one robot.

    The robot moves only while a goal of `move_base` is executed, in that server's own thread;
    an idle robot costs one battery message now and then.

    Args:
        robot: The robot; nothing else may steer it.
        node: Where it is on the network; None takes the node in force.

    Threads: `start` and `close` may be called from any thread.
    """

    def __init__(self, robot: Robot, *, node: Node | None = None) -> None:
        self._node = node if node is not None else get_node()
        self._clock = self._node.clock
        self._robot = robot
        control = robot.config.control
        self._dt = 1.0 / control.rate
        self._feedback_every = max(1, round(control.rate / control.feedback_rate))
        self._steps = 0
        self._next = 0.0
        self._closing = self._clock.event()
        self._wake = self._clock.event()
        self._charge_wake = self._clock.event()
        self._housekeeper: Task | None = None
        self._odom = Publisher("odom", Odometry, latch=True, node=self._node)
        self._battery = Publisher("battery", BatteryState, latch=True, node=self._node)
        self._move = SimpleActionServer(
            "move_base", MoveBaseAction, self._drive, auto_start=False, node=self._node
        )
        self._charge = SimpleActionServer(
            "charge", ChargeAction, self._fill, auto_start=False, node=self._node
        )
        self._move.register_preempt_callback(self._wake.set)
        self._charge.register_preempt_callback(self._charge_wake.set)

    def start(self) -> None:
        """Show the robot on the network and take goals.

        Raises:
            ServerConflictError: another server has one of the names.
        """
        self._move.start()
        self._charge.start()
        self._publish_odometry()
        self._housekeeper = self._clock.spawn(self._keep_house, name="robot battery")

    def wait(self) -> None:
        """Wait until `close` was called.

        Raises:
            ServerConflictError: an older robot of this name was found after all.

        Blocks: until then.
        """
        self._move.wait()

    def close(self) -> None:
        """Stop taking goals; a running one is aborted. A second call does nothing.

        Blocks: until the robot's threads have seen it, two seconds at most.
        """
        self._closing.set()
        self._wake.set()
        self._charge_wake.set()
        self._move.stop()
        self._charge.stop()
        if self._housekeeper is not None:
            self._housekeeper.join(1.0)
        self._odom.unregister()
        self._battery.unregister()

    # -- move_base -----------------------------------------------------------------------------

    def _drive(self, goal: MoveBaseGoal) -> None:
        self._next = self._clock.now()
        try:
            self._go(self._target(goal.target_pose))
        except NavigationError as error:
            self._halt()
            self._move.set_aborted(text=str(error))

    def _go(self, target: Pose2D) -> None:
        """Drive to `target`; ends the goal unless it fails.

        Raises:
            NavigationError: it failed.
        """
        for command in drive_to(self._robot, target):
            if self._move.is_preempt_requested():
                self._halt()
                self._move.set_preempted(text="stopped on request")
                return
            self._step(command)
            self._check_health()
        self._catch_up()
        self._publish_odometry()
        self._move.set_succeeded(text="arrived")

    def _halt(self) -> None:
        """Brake to a stop; a new goal that waits takes over at once, moving as it is."""
        robot = self._robot
        while not (robot.body.standing or self._move.is_new_goal_available()):
            if self._closing.is_set():
                return
            self._step(STOP)
        self._catch_up()
        self._publish_odometry()

    def _step(self, command: Command) -> None:
        """Drive for one control period; now and then let time catch up and report.

        Blocks: until the time that was driven has passed, less when the goal is to stop.
        """
        self._robot.step(self._next, self._dt, command)
        self._next += self._dt
        self._steps += 1
        if self._steps % self._feedback_every == 0:
            self._catch_up()
            self._report()

    def _catch_up(self) -> None:
        wait = self._next - self._clock.now()
        if wait > 0.0:
            self._wake.wait(wait)
            if not self._closing.is_set():
                self._wake.clear()
        elif wait < -_LATE:
            self._next -= wait

    def _check_health(self) -> None:
        if self._closing.is_set():
            raise NavigationError("the robot is shutting down")
        if self._steps % self._feedback_every == 0 and not self._robot.battery.charge(self._next):
            raise NavigationError("the battery is empty")

    def _report(self) -> None:
        """Send feedback and odometry."""
        header = self._header(MAP_FRAME)
        pose = _pose_message(self._robot.body.pose)
        if self._move.is_active():
            self._move.publish_feedback(MoveBaseFeedback(PoseStamped(header, pose)))
        self._publish_odometry(header, pose)

    def _publish_odometry(self, header: Header | None = None, pose: Pose | None = None) -> None:
        body = self._robot.body
        twist = Twist(linear=Vector3(x=body.speed), angular=Vector3(z=body.turn_rate))
        self._odom.publish(
            Odometry(
                header=header or self._header(MAP_FRAME),
                child_frame_id=BASE_FRAME,
                pose=PoseWithCovariance(pose=pose or _pose_message(body.pose)),
                twist=TwistWithCovariance(twist=twist),
            )
        )

    def _target(self, stamped: PoseStamped) -> Pose2D:
        """Return a goal's pose in the map frame.

        Raises:
            NavigationError: the frame is unknown or the pose is none.
        """
        position, turn = stamped.pose.position, stamped.pose.orientation
        values = (position.x, position.y, turn.x, turn.y, turn.z, turn.w)
        if not all(math.isfinite(value) for value in values):
            raise NavigationError("goal pose: some coordinates are no finite numbers")
        if math.hypot(turn.x, turn.y, turn.z, turn.w) < _SHORTEST_ROTATION:
            raise NavigationError(
                "goal orientation: all zeros are no rotation; for 'as it lies' use w = 1"
            )
        pose = Pose2D(position.x, position.y, yaw_of(turn.x, turn.y, turn.z, turn.w))
        frame = stamped.header.frame_id.removeprefix("/")
        if frame == MAP_FRAME:
            return pose
        own = f"{self._node.namespace}/{BASE_FRAME}".removeprefix("/")
        if frame in {BASE_FRAME, own}:
            return self._robot.body.pose.then(pose)
        raise NavigationError(
            f"goal frame: got {stamped.header.frame_id!r}; expected {MAP_FRAME!r} or {own!r}"
        )

    # -- charge --------------------------------------------------------------------------------

    def _fill(self, goal: ChargeGoal) -> None:
        trouble = self._why_not_charge(goal.until)
        if trouble:
            self._charge.set_aborted(self._charge_result(), text=trouble)
            return
        battery = self._robot.battery
        battery.fill(self._clock.now())
        try:
            self._wait_until_full(goal.until)
        finally:
            if battery.power > 0.0:
                battery.drive(self._clock.now(), 0.0)

    def _wait_until_full(self, until: float) -> None:
        battery = self._robot.battery
        while (left := battery.seconds_until(until, self._clock.now())) > 0.0:
            if self._charge.is_preempt_requested():
                self._charge.set_preempted(self._charge_result(), text="charging was stopped")
                return
            if self._closing.is_set() or math.isinf(left):
                why = "the robot left the dock" if math.isinf(left) else "the robot shuts down"
                self._charge.set_aborted(self._charge_result(), text=why)
                return
            charge = battery.charge(self._clock.now())
            self._charge.publish_feedback(ChargeFeedback(charge=charge, seconds_left=left))
            self._charge_wake.wait(min(left + _JUST_PAST, _CHARGE_PERIOD))
            if not self._closing.is_set():
                self._charge_wake.clear()
        self._charge.set_succeeded(self._charge_result(), text="charged")

    def _why_not_charge(self, until: float) -> str:
        dock, body = self._robot.config.dock, self._robot.body
        if not 0.0 < until <= 1.0:
            return f"until: got {until:g}; expected more than 0, at most 1"
        if dock is None:
            return "this robot has no dock"
        distance = body.pose.distance(dock)
        if distance > _AT_DOCK:
            return (
                f"the robot is {distance:.1f} m away from its dock; drive to "
                f"({dock.x:.2f}, {dock.y:.2f}) first"
            )
        return "" if body.standing else "the robot is still moving"

    def _charge_result(self) -> ChargeResult:
        return ChargeResult(charge=self._robot.battery.charge(self._clock.now()))

    # -- battery -------------------------------------------------------------------------------

    def _keep_house(self) -> None:
        while not self._closing.is_set():
            self._publish_battery()
            self._closing.wait(self._robot.config.battery.period)

    def _publish_battery(self) -> None:
        battery = self._robot.battery
        config, power = battery.config, battery.power
        charge = battery.charge(self._clock.now())
        if power <= 0.0:
            status = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
        elif charge < 1.0:
            status = BatteryState.POWER_SUPPLY_STATUS_CHARGING
        else:
            status = BatteryState.POWER_SUPPLY_STATUS_FULL
        ampere_hours = config.capacity / config.voltage
        self._battery.publish(
            BatteryState(
                header=self._header(BASE_FRAME),
                voltage=config.voltage,
                current=power / config.voltage,
                charge=charge * ampere_hours,
                capacity=ampere_hours,
                design_capacity=ampere_hours,
                percentage=charge,
                power_supply_status=status,
                present=True,
            )
        )

    def _header(self, frame: str) -> Header:
        stamp = Time(0, self._clock.time_ns())
        return Header(stamp=stamp, frame_id=frame)


def _pose_message(pose: Pose2D) -> Pose:
    x, y, z, w = quaternion_of(pose.yaw)
    return Pose(Point(pose.x, pose.y, 0.0), Quaternion(x, y, z, w))
