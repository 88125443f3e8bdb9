"""Offers the robot on the network: actions `move_base` and `charge`, topics, a service."""

from __future__ import annotations

import logging
import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from actionlib_core.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry, Path
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState, LaserScan
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.interfaces.std_srvs.srv import Empty, EmptyResponse
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from actionlib_core.node import get_node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import NewsPublisher, WatchingSubscriber
from actionlib_core.time import Time
from smachpy.places.exceptions import NavigationError
from smachpy.places.pose import Pose2D, quaternion_of, yaw_of
from smachpy.sim.interfaces import ChargeAction, ChargeFeedback, ChargeResult
from smachpy.sim.navigation import STOP
from smachpy.sim.pilot import Pilot
from smachpy.sim.scanner import Scanner
from smachpy.sim.stepper import JUST_PAST, Stepper
from smachpy.sim.world import AT_DOCK

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.exceptions import ServerConflictError
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
    from actionlib_core.node import Node
    from smachpy.places.occupancy import OccupancyMap
    from smachpy.sim.interfaces import ChargeGoal
    from smachpy.sim.world import Robot

logger = logging.getLogger(__name__)

MAP_FRAME: Final = "map"
ODOM_FRAME: Final = "odom"  # coincides with the map frame: the odometry does not drift
BASE_FRAME: Final = "base_link"
_UNHEARD: Final = 10  # battery periods between two messages without subscribers
_CHARGE_PERIOD: Final = 0.5  # [s] between two feedback messages of `charge`
_SHORTEST_ROTATION: Final = 1e-3  # a shorter quaternion is not a rotation


class RobotServer:
    """Serves one robot.

    A stepper's thread moves the robot; the goal's thread only waits for the end. A robot that
    stands still publishes only its battery, and rarely if there are no subscribers.

    Args:
        robot: The robot; nothing else may steer it.
        node: Its node; None uses the current one.
        stepper: Steps this robot and others; None makes one for this robot alone.

    Threads: `start` and `close` may be called from any thread.
    """

    def __init__(
        self, robot: Robot, *, node: Node | None = None, stepper: Stepper | None = None
    ) -> None:
        self._node = node if node is not None else get_node()
        self._clock = self._node.clock
        self._robot = robot
        self._pilot = Pilot(robot)
        control = robot.config.control
        self._owns_stepper = stepper is None
        self._stepper = stepper or Stepper(self._clock, rate=control.rate)
        self._feedback_period = 1.0 / control.feedback_rate
        self._fed_back = self._battery_told = self._scanned = -math.inf
        self._scanner = Scanner(robot)
        self._moved = False
        self._closing = self._clock.event("the robot closes")
        self._wake = self._clock.event("the end of the drive")
        self._charge_wake = self._clock.event("the charge")
        self._parts: list[NewsPublisher | WatchingSubscriber[Twist] | Service] = []
        self._odom = NewsPublisher("odom", Odometry, latch=True, node=self._node)
        self._frames = NewsPublisher("tf_static", TFMessage, latch=True, node=self._node)
        self._battery = NewsPublisher("battery", BatteryState, latch=True, node=self._node)
        self._scan = NewsPublisher("scan", LaserScan, node=self._node)
        self._plan = NewsPublisher("plan", Path, latch=True, node=self._node)
        self._way: tuple[tuple[float, float], ...] = ()  # the plan that was published last
        self._move = SimpleActionServer(
            "move_base", MoveBaseAction, self._drive, auto_start=False, node=self._node
        )
        self._charge = SimpleActionServer(
            "charge", ChargeAction, self._fill, auto_start=False, node=self._node
        )
        self._move.register_preempt_callback(self._wake.set)
        self._charge.register_preempt_callback(self._charge_wake.set)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self._robot

    def start(self) -> None:
        """Offer the robot on the network and accept goals.

        Raises:
            ServerConflictError: another server has one of the names.
        """
        self._move.start()
        self._charge.start()
        self._parts = [
            self._odom,
            self._frames,
            self._battery,
            self._scan,
            self._plan,
            *([map_publisher(self._robot.world.map, self._node)] if self._owns_stepper else ()),
            WatchingSubscriber("cmd_vel", Twist, self._on_cmd_vel, queue_size=1, node=self._node),
            Service("move_base/clear_costmaps", Empty, self._on_clear, node=self._node),
        ]
        # Where the odometry began is known, as if by a localisation that is never wrong.
        known = TransformStamped(self._header(MAP_FRAME), ODOM_FRAME)
        known.transform.rotation.w = 1.0
        self._frames.publish([known])
        self._publish_odometry()
        self._publish_battery()
        self._stepper.add(self)

    def wait(self) -> None:
        """Wait until `close` is called.

        Raises:
            ServerConflictError: an older robot of the same name was found later.

        Blocks: until then.
        """
        self._move.wait()

    @property
    def conflict(self) -> ServerConflictError | None:
        """Why it gave up its names to an older robot; None if it has not."""
        return self._move.action_server.error or self._charge.action_server.error

    def close(self) -> None:
        """Stop accepting goals; a running one is aborted. A second call does nothing.

        Blocks: until the robot's threads have ended, two seconds at most.
        """
        self._closing.set()
        self._wake.set()
        self._charge_wake.set()
        self._move.stop()
        self._charge.stop()
        self._stepper.remove(self)
        if self._owns_stepper:
            self._stepper.close()
        for part in self._parts:
            part.unregister() if isinstance(
                part, (NewsPublisher, WatchingSubscriber)
            ) else part.close()

    # -- steps: in the stepper's thread --------------------------------------------------------

    def is_busy(self, now: float) -> bool:
        """Return whether the robot moves, is to move, or has subscribers to its scans."""
        return self._pilot.is_busy(now) or self._scan.get_num_connections() > 0

    def step(self, now: float, dt: float) -> None:
        """Drive for `dt` seconds."""
        if self._pilot.is_busy(now):
            self._moved = True
            self._pilot.step(now, dt)

    def report(self, now: float) -> None:
        """Publish everything that is due, and report orders that have ended."""
        moved, self._moved = self._moved, False
        due = moved and now - self._fed_back > self._feedback_period - JUST_PAST
        if due:
            self._fed_back = now
            self._publish_feedback()
        # Latched: later subscribers get the last message, so it must have the final pose even if
        # nobody has subscribed so far.
        if due or (moved and (self._robot.body.standing or self._odom.get_num_connections())):
            self._publish_odometry()
        self._report_scan(now)
        self._report_plan()
        self._report_battery(now)
        with self._stepper.lock:
            # Called without the lock below: a callback may give the next order, which needs it.
            ended = self._pilot.take_ends()
        for tell in ended:
            tell()

    def _report_scan(self, now: float) -> None:
        """Publish a scan if it is due and has subscribers."""
        config = self._robot.config.scan
        if now - self._scanned < 1.0 / config.rate - JUST_PAST:
            return
        if not self._scan.get_num_connections():
            return
        self._scanned = now
        with self._stepper.lock:
            ranges = self._scanner.scan()
        self._scan.publish(
            LaserScan(
                header=self._header(BASE_FRAME),
                angle_min=self._scanner.first,
                angle_max=-self._scanner.first,
                angle_increment=self._scanner.step,
                scan_time=1.0 / config.rate,
                range_min=config.range_min,
                range_max=config.range_max,
                ranges=ranges,
            )
        )

    def _report_plan(self) -> None:
        """Publish the robot's way if it has changed; an empty one at its end."""
        with self._stepper.lock:
            follower = self._robot.follower
            way = tuple(follower.points) if follower is not None else ()
        if way != self._way and self._plan.get_num_connections():
            self._way = way
            header = self._header(MAP_FRAME)
            poses = [PoseStamped(header, Pose(Point(x, y, 0.0), Quaternion(w=1.0))) for x, y in way]
            self._plan.publish(Path(header, poses))

    # -- by hand -------------------------------------------------------------------------------

    def _on_cmd_vel(self, twist: Twist) -> None:
        command = twist.linear.x, twist.angular.z
        if not all(math.isfinite(value) for value in command):
            logger.error(
                "%s: got a speed that is no finite number; it stops", self._node.resolve("cmd_vel")
            )
            command = STOP
        with self._stepper.lock:
            self._pilot.override(self._clock.now(), command)
        self._stepper.wake()

    def _on_clear(self, _request: object) -> EmptyResponse:
        with self._stepper.lock:
            self._robot.forget()
            self._pilot.plan_anew()
        return EmptyResponse()

    # -- move_base -----------------------------------------------------------------------------

    def _drive(self, goal: MoveBaseGoal) -> None:
        try:
            target = read_pose(goal.target_pose, self._robot, self._node.namespace)
            self._robot.check_place(target.x, target.y)
        except NavigationError as error:
            self._order(self._pilot.stop)
            self._move.set_aborted(text=str(error))
            return
        trouble = self._order(partial(self._pilot.drive, target))
        if trouble is None:
            self._order(self._pilot.stop)
            self._give_way()
        elif trouble:
            self._move.set_aborted(text=trouble)
        else:
            self._move.set_succeeded(text="arrived")

    def _give_way(self) -> None:
        """End a goal that was cancelled or replaced, or whose robot is closing."""
        if self._closing.is_set():
            self._move.set_aborted(text="the robot is shutting down")
        else:
            self._move.set_preempted(text="stopped on request")

    def _order(self, order: Callable[[Callable[[str], object]], object]) -> str | None:
        """Give the pilot an order and wait for its end.

        Returns:
            The error, "" for none; None if a newer goal waits, the goal is cancelled while the
            robot drives, or the robot is closed.

        Blocks: until then.
        """
        ended: list[str] = []
        driving = order != self._pilot.stop

        def done(trouble: str) -> None:
            ended.append(trouble)
            self._wake.set()

        with self._stepper.lock:
            order(done)
        self._stepper.wake()
        while not ended:
            asked = self._move.is_preempt_requested() and driving
            if self._closing.is_set() or asked or self._move.is_new_goal_available():
                with self._stepper.lock:
                    self._pilot.let_go()
                return None
            self._wake.wait()
            self._wake.clear()
        return ended[0]

    def _publish_feedback(self) -> None:
        if self._move.is_active():
            pose = _pose_message(self._robot.body.pose)
            stamped = PoseStamped(self._header(MAP_FRAME), pose)
            self._move.publish_feedback(MoveBaseFeedback(stamped))

    def _publish_odometry(self) -> None:
        body = self._robot.body
        twist = Twist(linear=Vector3(x=body.speed), angular=Vector3(z=body.turn_rate))
        self._odom.publish(
            Odometry(
                header=self._header(ODOM_FRAME),
                child_frame_id=BASE_FRAME,
                pose=PoseWithCovariance(pose=_pose_message(body.pose)),
                twist=TwistWithCovariance(twist=twist),
            )
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
            self._charge_wake.wait(min(left + JUST_PAST, _CHARGE_PERIOD))
            if not self._closing.is_set():
                self._charge_wake.clear()
        self._charge.set_succeeded(self._charge_result(), text="charged")

    def _why_not_charge(self, until: float) -> str:
        body = self._robot.body
        if not 0.0 < until <= 1.0:
            return f"until: got {until:g}; expected more than 0, at most 1"
        dock = self._robot.nearest_dock()
        if dock is None:
            return "this robot has no dock"
        distance = body.pose.distance(dock.pose)
        if distance > AT_DOCK:
            which = f"dock {dock.name}" if dock.name else "its dock"
            holder = self._robot.world.holder(dock)
            held = f"; {holder} holds it" if holder else ""
            return (
                f"the robot is {distance:.1f} m away from {which}; drive to "
                f"({dock.pose.x:.2f}, {dock.pose.y:.2f}) first{held}"
            )
        return "" if body.standing else "the robot is still moving"

    def _charge_result(self) -> ChargeResult:
        return ChargeResult(charge=self._robot.battery.charge(self._clock.now()))

    # -- battery -------------------------------------------------------------------------------

    def _report_battery(self, now: float) -> None:
        """Publish the battery if it is due; rarely without subscribers."""
        period = self._robot.config.battery.period
        since = now - self._battery_told
        if since < period - JUST_PAST:
            return
        if self._battery.get_num_connections() or since > _UNHEARD * period:
            self._battery_told = now
            self._publish_battery()

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


def map_publisher(floor: OccupancyMap, node: Node) -> NewsPublisher:
    """Publish a map on the latched topic `map`; return the publisher."""
    stamp = Time(0, node.clock.time_ns())
    publisher = NewsPublisher("map", OccupancyGrid, latch=True, node=node)
    publisher.publish(
        header=Header(stamp=stamp, frame_id=MAP_FRAME),
        info=MapMetaData(
            map_load_time=stamp,
            resolution=floor.resolution,
            width=floor.width,
            height=floor.height,
            origin=_pose_message(floor.origin),
        ),
        data=floor.cells.ravel(),
    )
    return publisher


def _pose_message(pose: Pose2D) -> Pose:
    x, y, z, w = quaternion_of(pose.yaw)
    return Pose(Point(pose.x, pose.y, 0.0), Quaternion(x, y, z, w))


def read_pose(stamped: Any, robot: Robot, namespace: str) -> Pose2D:
    """Return a goal's pose in the map frame.

    Args:
        stamped: A PoseStamped of ROS 1 or 2.
        robot: The robot; the pose may be in its frame.
        namespace: The namespace of the robot's node; its frame may have it as a prefix.

    Raises:
        NavigationError: the frame is unknown, or the pose is invalid.
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
    own = f"{namespace}/{BASE_FRAME}".removeprefix("/")
    if frame in {BASE_FRAME, own}:
        return robot.body.pose.then(pose)
    raise NavigationError(
        f"goal frame: got {stamped.header.frame_id!r}; expected {MAP_FRAME!r} or {own!r}"
    )
