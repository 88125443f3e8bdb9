"""The topics of a Nav2 robot: `odom`, `tf`, `scan`, `plan`, `map`, `cmd_vel`.

And the service with which programs wait for its start-up, `lifecycle_manager_navigation/is_active`.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces import ros2
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import NewsPublisher, WatchingSubscriber
from smachpy.places.pose import ORIGIN, Pose2D, quaternion_of
from smachpy.sim.scanner import Scanner
from smachpy.sim.server import BASE_FRAME, MAP_FRAME, ODOM_FRAME
from smachpy.sim.stepper import JUST_PAST

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.node import Node
    from smachpy.sim.stepper import Stepper
    from smachpy.sim.world import Robot

NS: Final = 1_000_000_000


class Nav2Topics:
    """Publishes a robot's pose and what it sees.

    Args:
        robot: The robot.
        stepper: Moves it; its lock is held while the robot is read.
        node: Its node.
        distro: The ROS 2 release whose message definitions are used.
        on_speed: Called with each speed and turn rate [m/s, rad/s] from `cmd_vel`, in the
            subscriber's thread.

    Threads: `report` is called in the stepper's thread; the other methods in any thread.
    """

    def __init__(
        self,
        robot: Robot,
        stepper: Stepper,
        node: Node,
        distro: str,
        on_speed: Callable[[tuple[float, float]], object],
    ) -> None:
        self._robot = robot
        self._stepper = stepper
        self._clock = node.clock
        self._scanner = Scanner(robot)
        self._odom_period = 1.0 / robot.config.control.feedback_rate
        self._told = self._scanned = -math.inf
        # The classes depend on the distribution at run time, so type checkers do not know their
        # fields.
        message: Callable[[str], Any] = partial(ros2.get_message, distro=distro)
        trigger: Any = ros2.get_service("std_srvs/Trigger", distro)
        self._transform = message("geometry_msgs/TransformStamped")
        self._odometry = message("nav_msgs/Odometry")
        self._laser_scan = message("sensor_msgs/LaserScan")
        self._odom = NewsPublisher("odom", self._odometry, node=node)
        self._tf = NewsPublisher("tf", message("tf2_msgs/TFMessage"), node=node)
        self._scan = NewsPublisher("scan", self._laser_scan, node=node)
        self._path = message("nav_msgs/Path")
        self._stamped = message("geometry_msgs/PoseStamped")
        self._plan = NewsPublisher("plan", self._path, node=node)
        self._way: tuple[tuple[float, float], ...] = ()  # the plan that was published last
        grid = message("nav_msgs/OccupancyGrid")
        self._map = NewsPublisher("map", grid, latch=True, node=node)
        self._publish_map(grid())
        self._speeds = WatchingSubscriber(
            "cmd_vel",
            message("geometry_msgs/Twist"),
            lambda heard: on_speed((heard.linear.x, heard.angular.z)),
            queue_size=1,
            node=node,
        )
        self._active = Service(
            "lifecycle_manager_navigation/is_active",
            trigger,
            lambda _: trigger.Response(success=True),
            node=node,
        )

    def close(self) -> None:
        """Leave the network; a second call does nothing."""
        for end in (self._odom, self._tf, self._scan, self._plan, self._map, self._speeds):
            end.unregister()
        self._active.close()

    def is_watched(self) -> bool:
        """Return whether the scans have subscribers."""
        return self._scan.get_num_connections() > 0

    def report(self, now: float) -> None:
        """Publish everything that is due at `now` [s]."""
        if now - self._told > self._odom_period - JUST_PAST:
            self._told = now
            self._publish_odometry()
        rate = self._robot.config.scan.rate
        if now - self._scanned > 1.0 / rate - JUST_PAST and self.is_watched():
            self._scanned = now
            self._publish_scan()
        self._report_plan()

    def _publish_odometry(self) -> None:
        body = self._robot.body
        odom = self._odometry()
        self.fill_header(odom.header, ODOM_FRAME)
        odom.child_frame_id = BASE_FRAME
        fill_pose(odom.pose.pose, body.pose)
        odom.twist.twist.linear.x, odom.twist.twist.angular.z = body.speed, body.turn_rate
        self._odom.publish(odom)
        # The odometry does not drift: its frame coincides with the map's.
        frames = (MAP_FRAME, ODOM_FRAME, ORIGIN), (ODOM_FRAME, BASE_FRAME, body.pose)
        transforms = []
        for frame, child, pose in frames:
            stamped = self._transform()
            self.fill_header(stamped.header, frame)
            stamped.child_frame_id = child
            moved, turned = stamped.transform.translation, stamped.transform.rotation
            moved.x, moved.y = pose.x, pose.y
            turned.x, turned.y, turned.z, turned.w = quaternion_of(pose.yaw)
            transforms.append(stamped)
        self._tf.publish(transforms=transforms)

    def _publish_scan(self) -> None:
        config = self._robot.config.scan
        with self._stepper.lock:
            ranges = self._scanner.scan()
        scan = self._laser_scan(
            angle_min=self._scanner.first,
            angle_max=-self._scanner.first,
            angle_increment=self._scanner.step,
            scan_time=1.0 / config.rate,
            range_min=config.range_min,
            range_max=config.range_max,
            ranges=ranges,
        )
        self.fill_header(scan.header, BASE_FRAME)
        self._scan.publish(scan)

    def _report_plan(self) -> None:
        """Publish the robot's way if it has changed; an empty one at its end."""
        with self._stepper.lock:
            follower = self._robot.follower
            way = tuple(follower.points) if follower is not None else ()
        if way == self._way or not self._plan.get_num_connections():
            return
        self._way = way
        plan = self._path()
        self.fill_header(plan.header, MAP_FRAME)
        for x, y in way:
            stamped = self._stamped(header=plan.header)
            fill_pose(stamped.pose, Pose2D(x, y, 0.0))
            plan.poses.append(stamped)
        self._plan.publish(plan)

    def _publish_map(self, grid: Any) -> None:
        floor = self._robot.world.map
        grid.data = floor.cells.ravel()
        self.fill_header(grid.header, MAP_FRAME)
        set_time(grid.info.map_load_time, self._clock.time_ns())
        grid.info.resolution = floor.resolution
        grid.info.width, grid.info.height = floor.width, floor.height
        fill_pose(grid.info.origin, floor.origin)
        self._map.publish(grid)

    def fill_header(self, header: Any, frame: str) -> None:
        """Set the frame and the current time."""
        set_time(header.stamp, self._clock.time_ns())
        header.frame_id = frame


def set_time(message: Any, nanoseconds: int) -> None:
    """Fill a Time or Duration of ROS 2."""
    message.sec, message.nanosec = divmod(nanoseconds, NS)


def fill_pose(message: Any, pose: Pose2D) -> None:
    """Fill a Pose of ROS 2."""
    message.position.x, message.position.y = pose.x, pose.y
    turn = message.orientation
    turn.x, turn.y, turn.z, turn.w = quaternion_of(pose.yaw)
