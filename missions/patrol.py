"""Patrol: drive from waypoint to waypoint; when the battery is low, charge and go on.

    PATROL
      ROUND            both children at once; the first that ends calls the other off
        VISIT          NEXT -> DRIVE -> TICK_OFF -> NEXT ...
        WATCH_BATTERY  ends when the battery is low
      RECHARGE         DRIVE_TO_DOCK -> CHARGE, then ROUND goes on with the interrupted waypoint

Run it: `smachpy run patrol --start-robot`
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from missions.exceptions import MissionError
from missions.interfaces import ChargeAction, ChargeGoal
from missions.maps import OFFICE_WAYPOINTS
from missions.waypoint_file import load_route
from smachpy import CBState, Concurrence, MonitorState, SimpleActionState, StateMachine, UserData
from smachpy.checks import ignore

if TYPE_CHECKING:
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
    from missions.waypoint_file import Route

DRIVES = "ways have any length; a robot that cannot go on aborts, a dead one is seen"


def patrol(waypoints: str | Path = OFFICE_WAYPOINTS, rounds: int = 1) -> StateMachine:
    """Patrol the waypoints of a file; charge when the battery is low.

    Args:
        waypoints: The YAML file that lists them.
        rounds: How often to visit all of them.

    Raises:
        InputFileError: the file is wrong; with the line and field of every problem.
        MissionError: there is no round to drive.
    """
    if rounds < 1:
        raise MissionError(f"rounds: got {rounds}; expected 1 or more.")
    route = load_route(Path(waypoints))
    sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="PATROL")
    sm.userdata.waypoints = list(route.waypoints) * rounds
    sm.userdata.index = 0
    with sm:
        StateMachine.add(
            "ROUND",
            watched_round(route),
            transitions={"all_visited": "succeeded", "battery_low": "RECHARGE"},
        )
        StateMachine.add("RECHARGE", recharge(route), transitions={"succeeded": "ROUND"})
    return sm


def watched_round(route: Route) -> Concurrence:
    """Visit the waypoints while the battery is watched."""
    round_ = Concurrence(
        outcomes=["all_visited", "battery_low", "aborted", "preempted"],
        default_outcome="aborted",
        input_keys=["waypoints", "index"],
        output_keys=["index"],
        outcome_map={
            "all_visited": {"VISIT": "all_visited"},
            "battery_low": {"VISIT": "preempted", "WATCH_BATTERY": "invalid"},
        },
        child_termination_cb=lambda _outcomes: True,
    )
    battery = MonitorState(
        "battery", BatteryState, lambda _, msg: msg.percentage >= route.low_battery
    )
    with round_:
        Concurrence.add("VISIT", visit())
        Concurrence.add(
            "WATCH_BATTERY",
            ignore(battery, "no-timeout", "it watches for as long as the round takes"),
        )
    return round_


def visit() -> StateMachine:
    """Drive to one waypoint after the other, beginning at `index`."""
    sm = StateMachine(
        outcomes=["all_visited", "aborted", "preempted"],
        input_keys=["waypoints", "index"],
        output_keys=["index"],
    )
    drive = SimpleActionState(
        "move_base", MoveBaseAction, goal_cb=drive_goal, input_keys=["waypoint"]
    )
    with sm:
        StateMachine.add(
            "NEXT",
            CBState(
                next_waypoint,
                outcomes=["drive", "all_visited"],
                input_keys=["waypoints", "index"],
                output_keys=["waypoint"],
            ),
            transitions={"drive": "DRIVE"},
        )
        StateMachine.add(
            "DRIVE",
            ignore(drive, "no-timeout", DRIVES),
            transitions={"succeeded": "TICK_OFF"},
        )
        StateMachine.add(
            "TICK_OFF",
            CBState(tick_off, outcomes=["done"], input_keys=["index"], output_keys=["index"]),
            transitions={"done": "NEXT"},
        )
    return sm


def recharge(route: Route) -> StateMachine:
    """Drive to the dock and charge."""
    sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"])
    drive = SimpleActionState("move_base", MoveBaseAction, goal=route.dock.goal())
    charge = SimpleActionState("charge", ChargeAction, goal=ChargeGoal(until=route.charge_until))
    with sm:
        StateMachine.add(
            "DRIVE_TO_DOCK",
            ignore(drive, "no-timeout", DRIVES),
            transitions={"succeeded": "CHARGE"},
        )
        StateMachine.add(
            "CHARGE",
            ignore(charge, "no-timeout", "batteries charge for any time; a dead dock is seen"),
        )
    return sm


def next_waypoint(userdata: UserData) -> str:
    """Take the next waypoint, if there is one."""
    if userdata.index >= len(userdata.waypoints):
        return "all_visited"
    userdata.waypoint = userdata.waypoints[userdata.index]
    return "drive"


def tick_off(userdata: UserData) -> str:
    """The waypoint is reached: the next one is due."""
    userdata.index += 1
    return "done"


def drive_goal(userdata: UserData, _default: MoveBaseGoal) -> MoveBaseGoal:
    """Make the goal that drives to the waypoint."""
    goal: MoveBaseGoal = userdata.waypoint.goal()
    return goal
