"""The action `turn`: turns a robot on the spot through its topics `odom` and `cmd_vel`."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Final

from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.interfaces.geometry_msgs.msg import Twist, Vector3
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import Publisher, Subscriber
from smachpy.exceptions import did_you_mean
from smachpy.places.pose import wrap_angle, yaw_of
from smachpy.states import NavigationError
from smachpy_missions.interfaces import TurnAction, TurnFeedback, TurnResult

if TYPE_CHECKING:
    from actionlib_core.node import Node
    from smachpy_missions.interfaces import TurnGoal

REFERENCES: Final = ("ABS", "REL")
FASTEST: Final = 60.0  # [deg/s] limit for goals that set none
_TOLERANCE: Final = math.radians(0.5)  # [rad] the turn ends within this of its target
# [1/s] commanded rate per remaining angle. Odometry is up to 0.15 s late; with a much larger gain
# the robot would still turn at speed when it passes the target.
_GAIN: Final = 2.0
# [rad/s] slowest command: a rate proportional to the remaining angle alone would only approach the
# target and never reach it.
_CREEP: Final = math.radians(3.0)
_STILL: Final = 0.02  # [rad/s] below this the robot counts as standing
_REPEAT: Final = 0.2  # [s] commands are repeated: a robot's base drops a velocity that gets old
_SILENCE: Final = 3.0  # [s] without odometry or progress the turn is aborted
_PROGRESS: Final = math.radians(0.2)  # [rad] a smaller change does not count as progress
_LARGEST: Final = 36000.0  # [deg] a hundred turns


def goal_trouble(goal: TurnGoal) -> str:
    """Return what is wrong with a goal; "" if nothing."""
    angle, flag, fastest = goal.target_angle, goal.absolute_relative_flag, goal.max_ang_vel
    if flag not in REFERENCES:
        hint = did_you_mean(flag.upper(), REFERENCES)
        return f"reference: got {flag!r}; expected 'ABS' or 'REL'.{hint}"
    if not abs(angle) <= _LARGEST:  # written so that NaN, which compares false, is refused too
        return f"angle: got {angle:g}; expected -{_LARGEST:g} to {_LARGEST:g} [deg]."
    if not 0.0 <= fastest < math.inf:
        return f"max_ang_vel: got {fastest:g}; expected 0 or more [deg/s]."
    return ""


class TurnServer:
    """Offers `turn` for one robot.

    Args:
        prefix: The prefix of the robot's names, for example "robot_0/".
        node: The server's node; None uses the current one.

    Threads: a goal runs in a thread of the action server; odometry arrives in another one.
    """

    def __init__(self, prefix: str = "", *, node: Node | None = None) -> None:
        node = get_node() if node is None else node
        self._clock = node.clock
        self._lock = threading.Lock()
        self._news = self._clock.event("odometry")
        self._yaw: float | None = None  # [rad] heading in the last message
        # [rad] turned since this server started. It is the sum of wrapped differences, so goals of
        # more than one revolution can be measured, which a heading alone cannot.
        self._total = 0.0
        self._rate = 0.0  # [rad/s]
        self._velocity = Publisher(f"{prefix}cmd_vel", Twist, node=node)
        self._odometry = Subscriber(f"{prefix}odom", Odometry, self._on_odometry, node=node)
        self._server = SimpleActionServer(
            f"{prefix}turn", TurnAction, self._execute, auto_start=False, node=node
        )
        self._server.register_preempt_callback(self._news.set)
        try:
            self._server.start()
        except BaseException:  # a second server of this name, for example: leave no subscriber
            self.close()
            raise

    def close(self) -> None:
        """Stop turning and leave the network."""
        self._server.stop()
        self._odometry.unregister()
        self._velocity.unregister()

    def _on_odometry(self, message: Odometry) -> None:
        turn = message.pose.pose.orientation
        yaw = yaw_of(turn.x, turn.y, turn.z, turn.w)
        with self._lock:
            if self._yaw is not None:
                self._total += wrap_angle(yaw - self._yaw)
            self._yaw = yaw
            self._rate = message.twist.twist.angular.z
        self._news.set()

    # -- one goal ------------------------------------------------------------------------------

    def _execute(self, goal: TurnGoal) -> None:
        trouble = goal_trouble(goal)
        if trouble:
            self._server.set_aborted(TurnResult(result=trouble), trouble)
            return
        start = self._total
        try:
            arrived = self._turn(goal, start)
            self._stand()
        except NavigationError as error:
            self._command(0.0)
            text = f"{error}; {self._account(start)}"
            self._server.set_aborted(self._result(text, start), text)
            return
        text = self._account(start)
        if arrived:
            self._server.set_succeeded(self._result(text, start), text)
        else:
            text = f"stopped on request; {text}"
            self._server.set_preempted(self._result(text, start), text)

    def _turn(self, goal: TurnGoal, start: float) -> bool:
        """Turn until the goal's angle is reached; return False after a preempt.

        Raises:
            NavigationError: there is no odometry, or the robot does not turn.
        """
        aim = start + self._way(goal)
        fastest = math.radians(goal.max_ang_vel or FASTEST)
        # When the remaining angle last shrank to a new minimum: without that the robot is stuck.
        progressed, best = self._clock.now(), math.inf
        while abs(left := aim - self._total) > _TOLERANCE:
            if self._server.is_preempt_requested():
                return False
            if abs(left) < best - _PROGRESS:
                progressed, best = self._clock.now(), abs(left)
            if self._clock.now() - progressed > _SILENCE:
                raise NavigationError(f"the robot does not turn: nothing for {_SILENCE:g} s")
            self._command(math.copysign(min(fastest, max(_CREEP, _GAIN * abs(left))), left))
            self._tell(start, left)
            self._news.wait(_REPEAT)
            self._news.clear()
        return True

    def _way(self, goal: TurnGoal) -> float:
        """Return how far to turn [rad].

        Raises:
            NavigationError: there is no odometry.
        """
        deadline = self._clock.now() + _SILENCE
        while self._yaw is None:
            left = deadline - self._clock.now()
            if left <= 0.0:
                raise NavigationError(f"no odometry on {self._odometry.name}")
            self._news.wait(left)
            self._news.clear()
        angle = math.radians(goal.target_angle)
        return angle if goal.absolute_relative_flag == "REL" else wrap_angle(angle - self._yaw)

    def _stand(self) -> None:
        """Stop, and wait until the robot stands still.

        Raises:
            NavigationError: it does not stop turning.
        """
        deadline = self._clock.now() + _SILENCE
        self._command(0.0)
        while abs(self._rate) > _STILL:
            if self._clock.now() > deadline:
                raise NavigationError("the robot does not stop")
            self._news.wait(_REPEAT)
            self._news.clear()
            self._command(0.0)

    def _command(self, rate: float) -> None:
        self._velocity.publish(Twist(angular=Vector3(z=rate)))

    def _tell(self, start: float, left: float) -> None:
        text = f"{self._account(start)}, {math.degrees(left):.0f} deg left"
        self._server.publish_feedback(TurnFeedback(feedback=text, left=math.degrees(left)))

    def _account(self, start: float) -> str:
        heading = "?" if self._yaw is None else f"{math.degrees(self._yaw):.0f}"
        turned = math.degrees(self._total - start)
        return f"turned {turned:.0f} deg, heading {heading} deg"

    def _result(self, text: str, start: float) -> TurnResult:
        return TurnResult(result=text, turned=math.degrees(self._total - start))
