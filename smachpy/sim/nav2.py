"""The robot as a Nav2 robot on a ROS 2 network: `navigate_to_pose`, `spin` and `back_up`.

A replacement for a real robot. Its topics are those of `nav2_topics`.

Source:
    https://docs.nav2.org (interfaces and error codes), nav2_behaviors (what `back_up` takes).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.interfaces import ros2
from actionlib_core.node import get_node
from actionlib_core.wire.ros2.network import choose_network
from smachpy.places.exceptions import NavigationError
from smachpy.places.pose import ORIGIN, wrap_angle
from smachpy.sim.battery import Battery
from smachpy.sim.behaviors import back_up, spin
from smachpy.sim.nav2_topics import NS, Nav2Topics, fill_pose, set_time
from smachpy.sim.navigation import STOP
from smachpy.sim.pilot import Pilot
from smachpy.sim.server import MAP_FRAME, read_pose
from smachpy.sim.stepper import JUST_PAST, Stepper

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Event
    from actionlib_core.exceptions import ServerConflictError
    from actionlib_core.node import Node
    from smachpy.sim.world import Robot

    Order = Callable[[Callable[[str], object]], object]  # starts the pilot, which reports its end

_UNKNOWN: Final = {"navigate_to_pose": 9000, "spin": 700, "back_up": 710}
"""Nav2's error code of each action for an error without a code of its own."""
_TIMEOUT: Final = {"navigate_to_pose": 9003, "spin": 701, "back_up": 711}
_INVALID_INPUT: Final = 713
_COLLISION_AHEAD: Final = 714
_TAKEN: Final = "another behavior has taken over"


class _Stopped(Exception):  # noqa: N818  not an error: the goal was cancelled
    """The goal was cancelled."""


class _Behavior:
    """One action: its server, and the state of its goal."""

    def __init__(
        self, name: str, action: Any, execute: Callable[[Any], object], node: Node
    ) -> None:
        self.name = name
        self.action = action
        self.wake: Event = node.clock.event(f"the end of {name}")
        self.server = SimpleActionServer(name, action, execute, auto_start=False, node=node)
        self.server.register_preempt_callback(self.wake.set)
        self.begun = 0.0
        self.from_pose = ORIGIN
        self.target = ORIGIN  # of navigate_to_pose

    def result(self, elapsed: float, code: int = 0, text: str = "") -> Any:
        """Return a result message; the definitions of older distributions have fewer fields."""
        result = self.action.Result()
        if hasattr(result, "total_elapsed_time"):
            set_time(result.total_elapsed_time, round(elapsed * NS))
        if hasattr(result, "error_code"):
            result.error_code, result.error_msg = code, text
        return result


class Nav2Server:
    """Serves one robot like Nav2, on the ROS 2 network of the node's configuration.

    Its battery does not drain: Nav2 has no action with which a mission could charge it.

    Args:
        robot: The robot; nothing else may steer it.
        node: Its node; None uses the current one.
        stepper: Steps this robot and others; None makes one for this robot alone.

    Raises:
        ConfigError: there are several ROS 2 networks, and none has the names.
        TransportError: the network cannot be joined.

    Threads: `start` and `close` may be called from any thread. A stepper's thread moves the robot.
    """

    def __init__(
        self, robot: Robot, *, node: Node | None = None, stepper: Stepper | None = None
    ) -> None:
        self._node = node if node is not None else get_node()
        self._clock = clock = self._node.clock
        self._robot = robot
        self._pilot = Pilot(robot)
        control = robot.config.control
        self._owns_stepper = stepper is None
        self._stepper = stepper or Stepper(clock, rate=control.rate)
        battery = replace(robot.config.battery, charge=1.0, idle_power=0.0, drive_power=0.0)
        robot.battery = Battery(battery, clock.now())
        self._feedback_period = 1.0 / control.feedback_rate
        self._closing = clock.event("the robot closes")
        self._busy: _Behavior | None = None
        self._reported = -math.inf
        self._turned, self._yaw = 0.0, robot.body.yaw
        network = choose_network(self._node.config.ros2, self._node.resolve("navigate_to_pose"))
        self._behaviors = {
            name: _Behavior(name, ros2.get_action(action, network.distro), execute, self._node)
            for name, action, execute in (
                ("navigate_to_pose", "nav2_msgs/NavigateToPose", self._navigate),
                ("spin", "nav2_msgs/Spin", self._spin),
                ("back_up", "nav2_msgs/BackUp", self._back_up),
            )
        }
        self._topics = Nav2Topics(robot, self._stepper, self._node, network.distro, self._on_speed)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self._robot

    def start(self) -> None:
        """Offer the robot on the network and accept goals.

        Raises:
            ServerConflictError: another server has one of the names.
        """
        for behavior in self._behaviors.values():
            behavior.server.start()
        self._stepper.add(self)

    def wait(self) -> None:
        """Wait until `close` is called.

        Raises:
            ServerConflictError: as for `start`.

        Blocks: until then.
        """
        self._behaviors["navigate_to_pose"].server.wait()

    @property
    def conflict(self) -> ServerConflictError | None:
        """Why it gave up its names; None if it has not."""
        errors = (b.server.action_server.error for b in self._behaviors.values())
        return next((error for error in errors if error is not None), None)

    def close(self) -> None:
        """Stop accepting goals; running ones are aborted. A second call does nothing.

        Blocks: until the robot's threads have ended, two seconds at most.
        """
        self._closing.set()
        for behavior in self._behaviors.values():
            behavior.wake.set()
        for behavior in self._behaviors.values():
            behavior.server.stop()
        self._stepper.remove(self)
        if self._owns_stepper:
            self._stepper.close()
        self._topics.close()

    # -- goals: each in its server's thread ----------------------------------------------------

    def _navigate(self, goal: Any) -> None:
        behavior = self._behaviors["navigate_to_pose"]
        try:
            target = read_pose(goal.pose, self._robot, self._node.namespace)
            self._robot.check_place(target.x, target.y)
        except NavigationError as error:
            self._refuse(behavior, _UNKNOWN[behavior.name], str(error))
            return
        behavior.target = target
        self._carry_out(behavior, partial(self._pilot.drive, target))

    def _spin(self, goal: Any) -> None:
        behavior = self._behaviors["spin"]
        angle = float(goal.target_yaw)
        if not math.isfinite(angle):
            self._refuse(behavior, _UNKNOWN["spin"], "target_yaw: got no finite number")
            return
        script = spin(self._robot, angle)
        self._carry_out(behavior, partial(self._pilot.run, script), allowance_of(goal))

    def _back_up(self, goal: Any) -> None:
        behavior = self._behaviors["back_up"]
        distance, speed = abs(goal.target.x), abs(goal.speed)
        if goal.target.y or goal.target.z:
            trouble = "target: got y or z; expected x alone: it drives straight back"
        elif not (math.isfinite(distance) and math.isfinite(speed) and speed > 0.0):
            trouble = f"got distance {distance}, speed {speed}; expected finite ones, speed above 0"
        else:
            fastest = self._robot.config.robot.max_reverse_speed
            script = back_up(self._robot, distance, min(speed, fastest))
            order = partial(self._pilot.run, script)
            self._carry_out(behavior, order, allowance_of(goal), _COLLISION_AHEAD)
            return
        self._refuse(behavior, _INVALID_INPUT, trouble)

    def _refuse(self, behavior: _Behavior, code: int, text: str) -> None:
        behavior.server.set_aborted(behavior.result(0.0, code, text), text)

    def _carry_out(
        self,
        behavior: _Behavior,
        order: Order,
        allowance: float = math.inf,
        code: int | None = None,
    ) -> None:
        """Give the pilot an order, wait for its end, and end the goal accordingly.

        Args:
            behavior: The goal's action.
            order: Starts the pilot.
            allowance: The goal fails if it takes longer than this [s].
            code: Nav2's error code if the pilot reports an error.

        Blocks: until the goal has ended.
        """
        server, begun = behavior.server, self._clock.now()
        code = _UNKNOWN[behavior.name] if code is None else code
        try:
            trouble = self._wait_for(behavior, order, begun + allowance)
        except TimeoutError:
            code, trouble = _TIMEOUT[behavior.name], f"it took longer than {allowance:g} s"
        except _Stopped:
            result = behavior.result(self._clock.now() - begun)
            if self._closing.is_set():
                server.set_aborted(result, "the robot is shutting down")
            else:
                server.set_preempted(result, "stopped on request")
            return
        elapsed = self._clock.now() - begun
        if trouble:
            server.set_aborted(behavior.result(elapsed, code, trouble), trouble)
        else:
            server.set_succeeded(behavior.result(elapsed))

    def _wait_for(
        self,
        behavior: _Behavior,
        order: Order,
        until: float,
    ) -> str:
        """Return the error; "" for none.

        Raises:
            TimeoutError: it did not end in time.
            _Stopped: it was cancelled.
        """
        ended: list[str] = []

        def done(trouble: str) -> None:
            ended.append(trouble)
            behavior.wake.set()

        with self._stepper.lock:
            before, self._busy = self._busy, behavior
            behavior.begun, behavior.from_pose = self._clock.now(), self._robot.body.pose
            self._turned, self._yaw = 0.0, self._robot.body.yaw
            order(done)
        # The goal of another action gives way: its thread sees that `_busy` is no longer its own.
        if before is not None:
            before.wake.set()
        self._stepper.wake()
        server = behavior.server
        try:
            while not ended:
                if self._busy is not behavior:
                    return _TAKEN
                stop = server.is_preempt_requested() or server.is_new_goal_available()
                if stop or self._closing.is_set():
                    raise _Stopped
                if not behavior.wake.wait(None if math.isinf(until) else until - self._clock.now()):
                    raise TimeoutError
                behavior.wake.clear()
        finally:
            with self._stepper.lock:
                if self._busy is behavior:
                    self._busy = None
                    if not ended:
                        self._pilot.let_go()
        return ended[0]

    def _on_speed(self, command: tuple[float, float]) -> None:
        """Drive by hand; a speed that is not finite stops the robot."""
        finite = all(math.isfinite(value) for value in command)
        with self._stepper.lock:
            self._pilot.override(self._clock.now(), command if finite else STOP)
        self._stepper.wake()

    # -- steps: in the stepper's thread --------------------------------------------------------

    def is_busy(self, now: float) -> bool:
        """Return whether the robot moves, is to move, or has subscribers to its scans."""
        return self._pilot.is_busy(now) or self._topics.is_watched()

    def step(self, now: float, dt: float) -> None:
        """Drive for `dt` seconds."""
        if not self._pilot.is_busy(now):
            return
        self._pilot.step(now, dt)
        yaw = self._robot.body.yaw
        self._turned += abs(wrap_angle(yaw - self._yaw))
        self._yaw = yaw

    def report(self, now: float) -> None:
        """Publish everything that is due, and report orders that have ended."""
        self._topics.report(now)
        if now - self._reported > self._feedback_period - JUST_PAST:
            self._reported = now
            self._publish_feedback(now)
        with self._stepper.lock:
            # Called without the lock below: a callback may give the next order, which needs it.
            ended = self._pilot.take_ends()
        for tell in ended:
            tell()

    def _publish_feedback(self, now: float) -> None:
        behavior = self._busy
        if behavior is None or not behavior.server.is_active():
            return
        body = self._robot.body
        feedback = behavior.action.Feedback()
        if behavior.name == "spin":
            feedback.angular_distance_traveled = self._turned
        elif behavior.name == "back_up":
            feedback.distance_traveled = behavior.from_pose.distance(body.pose)
        else:
            self._topics.fill_header(feedback.current_pose.header, MAP_FRAME)
            fill_pose(feedback.current_pose.pose, body.pose)
            follower = self._robot.follower
            straight = body.pose.distance(behavior.target)
            left = follower.remaining if follower is not None else straight
            feedback.distance_remaining = left
            set_time(feedback.navigation_time, round((now - behavior.begun) * NS))
            seconds = left / self._robot.config.robot.max_speed
            set_time(feedback.estimated_time_remaining, round(seconds * NS))
        behavior.server.publish_feedback(feedback)


def allowance_of(goal: Any) -> float:
    """Return how long a goal may take [s]; in Nav2 0 means no limit."""
    allowance = goal.time_allowance
    return float(allowance.sec + allowance.nanosec / NS) or math.inf
