"""Fleet: robots deliver parcels, a coordinator assigns the orders, and the robots share docks.

    FLEET           one branch per robot, all at once
      ROBOT_0
        NEXT        waits for the robot's next task
        DELIVER     -> NEXT: its action robot_0/deliver
        RECHARGE    -> NEXT: its action robot_0/recharge
        PARK        -> NEXT: drives home if there is nothing to do
      ROBOT_1 ...

This is the coordinator. Each robot runs a mission of its own, `smachpy_missions.fleet.robot`;
`smachpy_missions.fleet.order_book` says what happens to an order if its robot dies.

Run it, with eight robots as processes: `smachpy run fleet -- --robots 8`
"""

from __future__ import annotations

import random
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import smachpy
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from smachpy import Concurrence, SimpleActionState, State, StateMachine, UserData
from smachpy.places.maps import OFFICE_FLEET
from smachpy.states import MissionError, drive_to, goal_at, pose_of, serve_during
from smachpy_missions.fleet.dispatcher import Dispatcher, Robot
from smachpy_missions.fleet.order_book import Order, Stage
from smachpy_missions.fleet.processes import RobotProcesses
from smachpy_missions.fleet.site import load_site
from smachpy_missions.interfaces import DeliverAction, DeliverGoal, RechargeAction, RechargeGoal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actionlib_core.interfaces.geometry_msgs.msg import Pose
    from smachpy.states import Pose2D, Waypoint
    from smachpy_missions.fleet.site import Site
    from smachpy_missions.interfaces import DeliverResult, RechargeResult

MAX_ROBOTS = 100  # robots in one fleet
ACTIONS = ("deliver", "recharge", "move_base")  # of each robot
ORDER_LIMIT = 900.0  # [s] an order that takes longer is cancelled
DOCK_LIMIT = 1800.0  # [s] a charge that takes longer is cancelled
WAY_LIMIT = 300.0  # [s] a drive home that takes longer is cancelled
START_LIMIT = 60.0  # [s] a robot whose server does not appear within this is lost


@smachpy.mission(
    serves=[f"/robot_{n}/{action}" for n in range(MAX_ROBOTS) for action in ACTIONS],
    real_time="its robots are processes of their own",
    robots="start",
)
def fleet(
    robots: int = 8,
    orders: int = 16,
    *,
    lose: int = 0,
    seed: int = 1,
    site: Path = OFFICE_FLEET,
    together: bool = False,
    start: bool = True,
) -> Concurrence:
    """Deliver parcels with several robots that share docks.

    Args:
        robots: The number of robots, called robot_0, robot_1 and so on.
        orders: The number of parcels; the seed picks their places.
        lose: Kill this many robots while they carry a parcel.
        seed: Picks the places.
        site: A YAML file with docks, homes and places.
        together: Simulate all robots on one floor, where they see each other.
        start: Start the robots, simulated, as processes; otherwise they must be running already.

    Raises:
        MissionError: the numbers do not fit the site.
        InputFileError: the file has problems; each is listed with its line and field.
    """
    place = load_site(Path(site))
    check_numbers(robots, orders, lose, place)
    if together and lose:
        raise MissionError(
            f"lose: got {lose} with together; expected 0: the body of a robot whose mission is "
            "killed stays on the shared floor, where it continues to its last goal."
        )
    if together and place.map is None:
        raise MissionError(f"{site}: map: got none; expected one for the shared floor.")
    team = [Robot(f"robot_{n}", place.homes[n].pose) for n in range(robots)]
    processes = RobotProcesses(
        team if start else [], place, Path(site), lose=lose, together=together
    )
    dispatcher = Dispatcher(
        team,
        make_orders(place.places, orders, seed),
        place.docks,
        low=place.low_battery,
        on_permit=processes.on_permit,
    )
    sm = coordinator(dispatcher, place.charge_until)
    serve_during(sm, dispatcher.serve, processes.start)
    return sm


def check_numbers(robots: int, orders: int, lose: int, site: Site) -> None:
    """Check that the numbers fit the site.

    Raises:
        MissionError: one does not.
    """
    most = min(len(site.homes), MAX_ROBOTS)
    if not 1 <= robots <= most:
        raise MissionError(f"robots: got {robots}; expected 1 to {most}: one for each home.")
    if orders < 0:
        raise MissionError(f"orders: got {orders}; expected 0 or more.")
    if not 0 <= lose <= robots:
        raise MissionError(f"lose: got {lose}; expected 0 to {robots}, of {robots} robots.")
    if orders and len(site.places) < 2:  # noqa: PLR2004  from one place to another
        raise MissionError(f"places: got {len(site.places)}; expected 2 or more for orders.")


def make_orders(places: Sequence[Waypoint], count: int, seed: int) -> list[Order]:
    """Return orders between random places; the same seed gives the same orders."""
    pick = random.Random(seed)  # noqa: S311  not for security
    pairs = [pick.sample(list(places), 2) for _ in range(count)]
    return [Order(f"order {n}", a, b) for n, (a, b) in enumerate(pairs, 1)]


# -- the coordinator -------------------------------------------------------------------------------


def coordinator(dispatcher: Dispatcher, charge_until: float) -> Concurrence:
    """Return the machine that keeps all robots working until no order is open.

    Args:
        dispatcher: Decides which robot does what.
        charge_until: A robot leaves its dock at this charge, 0 to 1.
    """
    sm = Concurrence(
        outcomes=["succeeded", "undelivered", "preempted"],
        default_outcome="undelivered",
        output_keys=["report"],
        outcome_cb=partial(verdict, dispatcher),
        name="FLEET",
    )
    sm.userdata.report = ""
    sm.register_termination_cb(
        lambda userdata, _final, _outcome: userdata.update({"report": dispatcher.finish()})
    )
    with sm:
        for robot in dispatcher.robots:
            sm.add(robot.name.upper(), branch_of(robot, dispatcher, charge_until))
    return sm


def verdict(dispatcher: Dispatcher, outcomes: dict[str, str | None]) -> str:
    """Return the fleet's outcome."""
    if "preempted" in outcomes.values():
        return "preempted"
    done = all(entry.stage is Stage.DELIVERED for entry in dispatcher.book.entries.values())
    return "succeeded" if done else "undelivered"


def branch_of(robot: Robot, dispatcher: Dispatcher, charge_until: float) -> StateMachine:
    """Return one robot's branch: it runs the tasks of the dispatcher until there are none left."""
    sm = StateMachine(outcomes=["done", "out", "lost", "preempted"])
    with sm:
        # No timeout: an order of a robot that dies hours later may still come back to this one.
        tasks = {"deliver": "DELIVER", "recharge": "RECHARGE", "park": "PARK"}
        sm.add("NEXT", Next(dispatcher, robot.name), tasks)
        again = {"succeeded": "NEXT", "aborted": "NEXT"}
        sm.add("DELIVER", delivering(robot.name, dispatcher), again)
        sm.add("RECHARGE", recharging(robot, dispatcher, charge_until), again)
        sm.add("PARK", parking(robot, dispatcher), {"succeeded": "NEXT", "aborted": "out"})
    return sm


class Next(State):
    """Waits until the dispatcher has a task for the robot."""

    def __init__(self, dispatcher: Dispatcher, robot: str) -> None:
        outcomes = ["deliver", "recharge", "park", "done", "out", "preempted"]
        super().__init__(outcomes, output_keys=["task"])
        self._dispatcher = dispatcher
        self._robot = robot

    def execute(self, userdata: UserData) -> str:
        """Wait for the next task.

        Blocks: until there is an order or a dock, or the work is over.
        """
        forget = self.on_preempt(lambda: self._dispatcher.wake(self._robot))
        try:
            while not self.preempt_requested():
                task = self._dispatcher.next_task(self._robot)
                if task is not None:
                    what, userdata.task = task
                    return what
                # A preempt just before `next_task` has already woken this thread in vain, since
                # that call clears the wake-up; so look at the flag once more before waiting.
                if not self.preempt_requested():
                    self._dispatcher.wait(self._robot)
        finally:
            forget()
        return "preempted"


def delivering(robot: str, dispatcher: Dispatcher) -> SimpleActionState:
    """Send an order to the robot's action and report its end to the dispatcher."""

    def goal(userdata: UserData, _goal: DeliverGoal) -> DeliverGoal:
        task = userdata.task
        return DeliverGoal(
            order=task.order,
            attempt=task.attempt,
            pickup=pose_message(task.pickup),
            dropoff=pose_message(task.dropoff),
        )

    def note(userdata: UserData, status: int, result: DeliverResult) -> str | None:
        if status == GoalStatus.LOST:
            dispatcher.lost(robot, userdata.task)
            return "lost"
        dispatcher.charged(robot, result.charge)
        if status == GoalStatus.SUCCEEDED:
            dispatcher.delivered(robot, userdata.task)
            return None
        useful = dispatcher.failed(
            robot, userdata.task, result.text or "no reason", aboard=result.aboard
        )
        return None if useful else "out"

    return SimpleActionState(
        f"/{robot}/deliver",
        DeliverAction,
        goal_cb=goal,
        result_cb=note,
        feedback_cb=partial(note_place, robot, dispatcher),
        input_keys=["task"],
        outcomes=["lost", "out"],
        exec_timeout=ORDER_LIMIT,
        server_wait_timeout=START_LIMIT,
    )


def recharging(robot: Robot, dispatcher: Dispatcher, charge_until: float) -> SimpleActionState:
    """Send the robot to its dock, and home again."""

    def goal(userdata: UserData, _goal: RechargeGoal) -> RechargeGoal:
        return RechargeGoal(
            dock=pose_message(userdata.task.pose),
            outside=pose_message(robot.home),
            until=charge_until,
        )

    def note(userdata: UserData, status: int, result: RechargeResult) -> str | None:
        if status == GoalStatus.LOST:
            dispatcher.lost_at(robot.name, userdata.task)
            return "lost"
        dispatcher.charged(robot.name, result.charge)
        left = dispatcher.left_dock(robot.name, userdata.task, left=result.left)
        if status != GoalStatus.SUCCEEDED:  # a robot that cannot charge cannot work either
            dispatcher.out_of_duty(robot.name)
        return None if left and status == GoalStatus.SUCCEEDED else "out"

    return SimpleActionState(
        f"/{robot.name}/recharge",
        RechargeAction,
        goal_cb=goal,
        result_cb=note,
        feedback_cb=partial(note_place, robot.name, dispatcher),
        input_keys=["task"],
        outcomes=["lost", "out"],
        exec_timeout=DOCK_LIMIT,
        server_wait_timeout=START_LIMIT,
    )


def parking(robot: Robot, dispatcher: Dispatcher) -> SimpleActionState:
    """Drive the robot home, where it blocks no other robot."""

    def note(_userdata: UserData, status: int, _result: object) -> str | None:
        if status == GoalStatus.SUCCEEDED:
            dispatcher.parked(robot.name)
            return None
        dispatcher.out_of_duty(robot.name)
        return "lost" if status == GoalStatus.LOST else None

    return drive_to(
        robot.home,
        action=f"/{robot.name}/move_base",
        result_cb=note,
        outcomes=["lost"],
        exec_timeout=WAY_LIMIT,
        server_wait_timeout=START_LIMIT,
    )


def note_place(robot: str, dispatcher: Dispatcher, _userdata: UserData, feedback: Any) -> None:
    """Report the robot's pose to the dispatcher."""
    dispatcher.seen(robot, pose_of(feedback.base_position.pose))


def pose_message(pose: Pose2D) -> Pose:
    """Return a pose as the message in a goal."""
    message: Pose = goal_at(pose).target_pose.pose
    return message
