"""Lesson 2, two things at once: drive from waypoint to waypoint and watch the battery.

    PATROL
      ROUND            runs both children at once; the first to end preempts the other
        VISIT          NEXT -> DRIVE -> TICK_OFF -> NEXT ...
        WATCH_BATTERY  ends when the battery is low
      RECHARGE         DRIVE_TO_DOCK -> CHARGE; then ROUND continues at the interrupted waypoint

Run it: `smachpy run patrol --start-robot`
"""

import smachpy
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from smachpy import Concurrence, MonitorState, SimpleActionState, StateMachine, UserData
from smachpy.sim.interfaces import ChargeAction, ChargeGoal
from smachpy.sim.maps import OFFICE_WAYPOINTS
from smachpy.states import MissionError, drive_to, load_route


@smachpy.state(["drive", "all_visited"], ["waypoints", "index"], ["waypoint"])
def next_waypoint(userdata: UserData) -> str:
    """Store the next waypoint in userdata, if any is left."""
    if userdata.index >= len(userdata.waypoints):
        return "all_visited"
    userdata.waypoint = userdata.waypoints[userdata.index]
    return "drive"


@smachpy.state(["done"], io_keys=["index"])
def tick_off(userdata: UserData) -> str:
    """Count the waypoint that was reached; an interrupted one is not counted."""
    userdata.index += 1
    return "done"


def patrol(waypoints: str = str(OFFICE_WAYPOINTS), rounds: int = 1) -> StateMachine:
    """Patrol the waypoints of a file; charge when the battery is low.

    Args:
        waypoints: A YAML file with the list.
        rounds: How often to visit them all.
    """
    if rounds < 1:
        raise MissionError(f"rounds: got {rounds}; expected 1 or more.")
    route = load_route(waypoints)
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="PATROL")
    sm.userdata.waypoints = list(route.waypoints) * rounds
    sm.register_start_cb(lambda userdata, _: userdata.update({"index": 0}))  # for every run
    visit = StateMachine(["all_visited", "aborted", "preempted"], ["waypoints", "index"], ["index"])
    visit.add("NEXT", next_waypoint, {"drive": "DRIVE"})
    visit.add("DRIVE", drive_to("waypoint"), {"succeeded": "TICK_OFF"})
    visit.add("TICK_OFF", tick_off, {"done": "NEXT"})
    low = {"VISIT": "preempted", "WATCH_BATTERY": "invalid"}
    watched = Concurrence(
        outcomes=["all_visited", "battery_low", "aborted", "preempted"],
        default_outcome="aborted",
        input_keys=["waypoints", "index"],
        output_keys=["index"],
        outcome_map={"all_visited": {"VISIT": "all_visited"}, "battery_low": low},
        child_termination_cb=lambda _outcomes: True,  # the first child to end preempts the other
    )
    battery = MonitorState("battery", BatteryState, lambda _, m: m.percentage >= route.low_battery)
    watched.add("VISIT", visit)
    watched.add("WATCH_BATTERY", battery)
    charge = StateMachine(["succeeded", "aborted", "preempted"])
    charge.add("DRIVE_TO_DOCK", drive_to(route.dock.pose), {"succeeded": "CHARGE"})
    charge.add("CHARGE", SimpleActionState("charge", ChargeAction, ChargeGoal(route.charge_until)))
    sm.add("ROUND", watched, {"all_visited": "succeeded", "battery_low": "RECHARGE"})
    sm.add("RECHARGE", charge, {"succeeded": "ROUND"})
    return sm
