"""One robot of a fleet: what it does with an order, and with an empty battery.

    DELIVER                                    RECHARGE
      TO_PICKUP     drives there                 TO_DOCK  drives there
      ASK_TO_TAKE   may it take the parcel?      CHARGE
      TAKE          takes it                     LEAVE    frees the dock again
      ASK_TO_LEAVE  may it leave with it?        LEAVE_EMPTY  the same, uncharged
      PUT_BACK      if not
      TO_DROPOFF    drives there
      ASK_TO_GIVE   may it hand it over?
      GIVE          hands it over

Both are offered as actions, `deliver` and `recharge`. With a simulated body, as a process:
`python -m smachpy_missions.fleet.robot robot_0 --pose 9.8 7.1 0`.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from actionlib_core import shutdown
from actionlib_core.clock import current_clock
from actionlib_core.command_line.numbers import finite
from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.node import Node
from actionlib_core.pubsub.topic import Subscriber
from actionlib_core.shutdown.child_process import end_with_stdin
from smachpy import (
    ActionServerWrapper,
    Retry,
    ServiceState,
    SimpleActionState,
    State,
    StateMachine,
    UserData,
    logwarn,
)
from smachpy.command.extras import advice
from smachpy.places.maps import OFFICE_FLEET, OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.pose import Pose2D
from smachpy.places.robot_file import load_config
from smachpy.sim.interfaces import ChargeAction, ChargeGoal
from smachpy.states import MissionError
from smachpy_missions.fleet.dispatcher import SERVICE
from smachpy_missions.fleet.site import load_site
from smachpy_missions.interfaces import (
    DeliverAction,
    DeliverFeedback,
    DeliverResult,
    RechargeAction,
    RechargeFeedback,
    RechargeResult,
)
from smachpy_missions.interfaces.srv import Permit, PermitRequest, PermitResponse

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.interfaces.move_base_msgs.msg import (
        MoveBaseFeedback,
        MoveBaseGoal,
        MoveBaseResult,
    )
    from smachpy.sim.world import Robot

    Note = Callable[[UserData], object]

OUTCOMES = ["succeeded", "aborted", "preempted"]
EXIT_BAD_INPUT = 2
KEYS = ["action_goal", "action_feedback", "action_result"]
ANSWER = 3.0  # [s] for the coordinator's answer, per attempt
ASKED = Retry(3, 0.5)  # attempts and first pause [s]; after that the robot does not take the step
GRIP = 2.0  # [s] to take a parcel or to hand it over


class Hands(Protocol):
    """The gripper. `GentleHands` only lets time pass; a test's hands may drop parcels."""

    def take(self, order: str) -> bool:
        """Take the parcel; return False if there is none."""
        ...

    def put_back(self, order: str) -> None:
        """Put it back where it was taken."""
        ...

    def give(self, order: str) -> None:
        """Hand it over."""
        ...


class GentleHands:
    """Hands that never fail; the simulation has no parcels."""

    def take(self, order: str) -> bool:
        """Take the parcel."""
        del order
        return True

    def put_back(self, order: str) -> None:
        """Put it back."""

    def give(self, order: str) -> None:
        """Hand it over."""


class FleetRobot:
    """Offers `deliver` and `recharge` for one robot.

    Args:
        name: The robot's name for the coordinator.
        hands: The gripper.
        node: The robot's node, in its namespace.

        Threads: one goal of each action runs at a time, in a thread of its server.
    """

    def __init__(self, name: str, hands: Hands, *, node: Node) -> None:
        self._charge = 0.0
        self._battery = Subscriber("battery", BatteryState, self._on_battery, node=node)
        self._servers = [
            ActionServerWrapper(action, spec, machine, ["succeeded"], node=node, policy="queue")
            for action, spec, machine in (
                ("deliver", DeliverAction, deliver(name, hands, self.charge, node)),
                ("recharge", RechargeAction, recharge(self.charge, node)),
            )
        ]
        for server in self._servers:
            server.run_server()

    def charge(self) -> float:
        """Return the battery's charge, 0 to 1; 0 before the first message."""
        return self._charge

    def close(self) -> None:
        """Stop running goals and leave the network."""
        for server in self._servers:
            server.stop()
        self._battery.unregister()

    def _on_battery(self, message: BatteryState) -> None:
        self._charge = message.percentage


# -- an order --------------------------------------------------------------------------------------


def deliver(
    name: str, hands: Hands, charge: Callable[[], float], node: Node | None = None
) -> StateMachine:
    """Fetch a parcel and hand it over; ask before every step that cannot be undone.

    Args:
        name: The robot's name.
        hands: The gripper.
        charge: Returns the battery's charge.
        node: The robot's node; None uses the current one.
    """

    def note(text: str, *, aboard: bool) -> Note:
        return lambda userdata: userdata.update(
            {"action_result": DeliverResult(aboard=aboard, charge=charge(), text=text)}
        )

    def take(userdata: UserData) -> bool:
        return hands.take(userdata.action_goal.order)

    def put_back(userdata: UserData) -> bool:
        hands.put_back(userdata.action_goal.order)
        return True

    def give(userdata: UserData) -> bool:
        hands.give(userdata.action_goal.order)
        return True

    coming = note("driving to the pickup", aboard=False)
    leaving = note("driving to the dropoff", aboard=True)
    sm = StateMachine(OUTCOMES, ["action_goal"], KEYS[1:], name="DELIVER")
    with sm:
        sm.add(
            "TO_PICKUP",
            drive("pickup", "to the pickup", coming, DeliverFeedback, node),
            {"succeeded": "ASK_TO_TAKE"},
        )
        sm.add(
            "ASK_TO_TAKE",
            ask(name, PermitRequest.PICK_UP, node),
            {"succeeded": "TAKE", "refused": "aborted"},
        )
        sm.add("TAKE", Hand(take, note("took it", aboard=True)), {"done": "ASK_TO_LEAVE"})
        sm.add(
            "ASK_TO_LEAVE",
            ask(name, PermitRequest.DRIVE_OFF, node),
            {"succeeded": "TO_DROPOFF", "refused": "PUT_BACK", "aborted": "PUT_BACK"},
        )
        sm.add("PUT_BACK", Hand(put_back, note("put it back", aboard=False)), {"done": "aborted"})
        sm.add(
            "TO_DROPOFF",
            drive("dropoff", "to the dropoff", leaving, DeliverFeedback, node),
            {"succeeded": "ASK_TO_GIVE"},
        )
        sm.add(
            "ASK_TO_GIVE",
            ask(name, PermitRequest.HAND_OVER, node),
            {"succeeded": "GIVE", "refused": "aborted"},
        )
        sm.add("GIVE", Hand(give, note("handed over", aboard=False)), {"done": "succeeded"})
    return sm


class Hand(State):
    """Takes a parcel, puts it back or hands it over: first the time it takes, then the deed.

    A preempt during that time leaves the parcel where it was; after the deed it is too late.

    Args:
        do: The deed; returns False if there is no parcel.
        note: Writes the result to userdata.
    """

    def __init__(self, do: Callable[[UserData], bool], note: Note) -> None:
        super().__init__(["done", "aborted", "preempted"], ["action_goal"], ["action_result"])
        self._do = do
        self._note = note

    def execute(self, userdata: UserData) -> str:
        """Wait for the gripper, then do the deed."""
        if self.sleep(GRIP):
            return "preempted"
        if not self._do(userdata):
            return "aborted"
        self._note(userdata)
        return "done"


def ask(name: str, step: int, node: Node | None) -> ServiceState:
    """Ask the coordinator for permission; 'refused' if it says no, 'aborted' without an answer."""

    def request(userdata: UserData, _request: PermitRequest) -> PermitRequest:
        goal = userdata.action_goal
        return PermitRequest(order=goal.order, attempt=goal.attempt, robot=name, step=step)

    def answer(_userdata: UserData, response: PermitResponse) -> str | None:
        if response.granted:
            return None
        logwarn(f"{name}: {response.reason}")
        return "refused"

    return ServiceState(
        SERVICE,
        Permit,
        request_cb=request,
        response_cb=answer,
        input_keys=["action_goal"],
        outcomes=["refused"],
        timeout=ANSWER,
        retry=ASKED,
        node=node,
    )


# -- an empty battery ------------------------------------------------------------------------------


def recharge(charge: Callable[[], float], node: Node | None = None) -> StateMachine:
    """Drive to a dock, charge there, and leave it.

    Args:
        charge: Returns the battery's charge.
        node: The robot's node; None uses the current one.
    """

    def note(text: str, *, left: bool) -> Note:
        return lambda userdata: userdata.update(
            {"action_result": RechargeResult(left=left, charge=charge(), text=text)}
        )

    coming = note("driving to the dock", left=False)
    leaving = note("leaving the dock", left=False)
    away = note("left the dock", left=True)
    sm = StateMachine(OUTCOMES, ["action_goal"], KEYS[1:], name="RECHARGE")
    with sm:
        sm.add(
            "TO_DOCK",
            drive("dock", "to the dock", coming, RechargeFeedback, node),
            {"succeeded": "CHARGE"},
        )
        sm.add("CHARGE", charging(node), {"succeeded": "LEAVE", "aborted": "LEAVE_EMPTY"})
        sm.add("LEAVE", drive("outside", "home", leaving, RechargeFeedback, node, away))
        # A robot that cannot charge leaves all the same: it must not block the dock for the others.
        empty = drive("outside", "home", leaving, RechargeFeedback, node, away)
        sm.add("LEAVE_EMPTY", empty, {"succeeded": "aborted"})
    return sm


def charging(node: Node | None) -> SimpleActionState:
    """Charge up to the goal's `until`."""
    return SimpleActionState(
        "charge",
        ChargeAction,
        goal_cb=lambda userdata, _goal: ChargeGoal(until=userdata.action_goal.until),
        input_keys=["action_goal"],
        node=node,
    )


# -- both ------------------------------------------------------------------------------------------


def drive(
    slot: str,
    doing: str,
    coming: Note,
    feedback: type[DeliverFeedback | RechargeFeedback],
    node: Node | None,
    there: Note | None = None,
) -> SimpleActionState:
    """Drive to a pose in the goal, and send the robot's pose as feedback.

    Args:
        slot: The goal's field with the pose.
        doing: What the robot does, in words.
        coming: Writes a result to userdata at the start, for a goal that ends on the way.
        feedback: The feedback class.
        node: The robot's node.
        there: Writes a result to userdata on arrival.
    """

    def goal(userdata: UserData, goal: MoveBaseGoal) -> MoveBaseGoal:
        coming(userdata)
        goal.target_pose.header.frame_id = "map"
        goal.target_pose.pose = getattr(userdata.action_goal, slot)
        return goal

    def tell(userdata: UserData, message: MoveBaseFeedback) -> None:
        userdata.action_feedback = feedback(doing=doing, base_position=message.base_position)

    def arrived(userdata: UserData, status: int, _result: MoveBaseResult) -> None:
        if there is not None and status == GoalStatus.SUCCEEDED:
            there(userdata)

    return SimpleActionState(
        "move_base",
        MoveBaseAction,
        goal_cb=goal,
        feedback_cb=tell,
        result_cb=arrived,
        input_keys=["action_goal"],
        output_keys=["action_feedback", "action_result"],
        server_wait_timeout=30.0,
        node=node,
    )


# -- the process -----------------------------------------------------------------------------------


def main(argv: Sequence[str] | None = None) -> int:
    """Run one robot until SIGINT or SIGTERM; return the exit code.

    Blocks: until then.
    """
    args = _parser().parse_args(argv)
    try:
        return serve(args)
    except (MissionError, ActionlibError) as error:
        sys.stderr.write(f"fleet_robot: {error}\n")
        return EXIT_BAD_INPUT
    except ModuleNotFoundError as error:
        text = advice(error)
        if text is None:
            raise
        sys.stderr.write(f"fleet_robot: {text}\n")
        return EXIT_BAD_INPUT


def serve(args: argparse.Namespace) -> int:
    """Simulate the robot's body if asked to, and offer its actions.

    Raises:
        InputFileError: the site, the map or the robot's file has problems.
        NavigationError: the robot cannot stand at its start pose.
        ServerConflictError: a robot of that name is already there.
    """
    with shutdown.handle_signals() as ending, contextlib.ExitStack() as stack:
        if args.child:
            current_clock().spawn(lambda: end_with_stdin(ending), name="end with parent")
        body = (
            make_body(args.site, Pose2D(*args.pose) if args.pose else None) if args.body else None
        )
        node = stack.enter_context(Node("fleet_robot", namespace=args.name))
        if body is not None:
            from smachpy.sim.server import RobotServer

            base = RobotServer(body, node=node)
            stack.callback(base.close)
            base.start()
        robot = FleetRobot(args.name, GentleHands(), node=node)
        stack.callback(robot.close)
        sys.stdout.write(f"{args.name}: ready; Ctrl-C ends it\n")
        sys.stdout.flush()
        ending.event().wait()
    return 0


def make_body(site_file: Path, pose: Pose2D | None) -> Robot:
    """Return a simulated robot on a floor of its own, with the site's docks.

    Raises:
        InputFileError: the site, the map or the robot's file has problems.
        NavigationError: the robot cannot stand at its start pose.
    """
    from smachpy.places.occupancy import load_map
    from smachpy.sim.world import Robot, World

    site = load_site(site_file)
    world = World(load_map(site.map or OFFICE_MAP))
    for dock in site.docks:
        world.add_dock(dock.name, dock.pose)
    start = pose or site.homes[0].pose
    config = load_config(site.robot or OFFICE_ROBOT)
    return Robot(world, dataclasses.replace(config, dock=None), start, current_clock().now())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m smachpy_missions.fleet.robot",
        description="A robot of the fleet: the actions deliver and recharge.",
    )
    parser.add_argument("name", help="what the coordinator calls it, robot_0 for example")
    parser.add_argument("--site", type=Path, default=OFFICE_FLEET, help="where it works, YAML")
    parser.add_argument(
        "--pose",
        type=finite,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="where it starts [m, m, rad]",
    )
    parser.add_argument(
        "--body",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="simulate the body too, with move_base and charge (default: yes)",
    )
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    return parser


if __name__ == "__main__":
    sys.exit(main())
