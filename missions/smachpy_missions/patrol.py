"""Drive from waypoint to waypoint, watch the battery, charge when it is low.

    PATROL
      ROUND            runs both children at once; the first to end preempts the other
        VISIT          NEXT -> DRIVE -> TICK_OFF -> NEXT ...
        WATCH_BATTERY  ends when the battery is low
      RECHARGE         DRIVE_TO_DOCK -> CHARGE; then ROUND continues at the interrupted waypoint

Run it: `smachpy run patrol --start-robot`
"""

import smachpy
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from smachpy.places.maps import OFFICE_WAYPOINTS
from smachpy.sim.interfaces import ChargeAction, ChargeGoal
from smachpy.states import MissionError, drive_to, load_route


@smachpy.state(
    outcomes=["drive", "all_visited"],
    input_keys=["waypoints", "index"],
    output_keys=["waypoint"],
)
def next_waypoint(userdata: smachpy.UserData) -> str:
    """Store the next waypoint in userdata, if any is left."""
    if userdata.index >= len(userdata.waypoints):
        return "all_visited"
    userdata.waypoint = userdata.waypoints[userdata.index]
    return "drive"


@smachpy.state(outcomes=["done"], io_keys=["index"])
def tick_off(userdata: smachpy.UserData) -> str:
    """Count the waypoint that was reached; an interrupted one is not counted."""
    userdata.index += 1
    return "done"


def patrol(waypoints: str = str(OFFICE_WAYPOINTS), rounds: int = 1) -> smachpy.StateMachine:
    """Patrol the waypoints of a file; charge when the battery is low.

    Args:
        waypoints: A YAML file with the list.
        rounds: How often to visit them all.
    """
    if rounds < 1:
        raise MissionError(f"rounds: got {rounds}; expected 1 or more.")
    route = load_route(waypoints)
    ends = ["succeeded", "aborted", "preempted"]
    visit = smachpy.StateMachine(
        outcomes=["all_visited", "aborted", "preempted"],
        input_keys=["waypoints", "index"],
        output_keys=["index"],
    )
    with visit:
        visit.add("NEXT", next_waypoint, transitions={"drive": "DRIVE"})
        visit.add("DRIVE", drive_to("waypoint"), transitions={"succeeded": "TICK_OFF"})
        visit.add("TICK_OFF", tick_off, transitions={"done": "NEXT"})
    watched = smachpy.Concurrence(
        outcomes=["all_visited", "battery_low", "aborted", "preempted"],
        default_outcome="aborted",
        input_keys=["waypoints", "index"],
        output_keys=["index"],
        outcome_map={
            "all_visited": {"VISIT": "all_visited"},
            "battery_low": {"VISIT": "preempted", "WATCH_BATTERY": "invalid"},
        },
        child_termination_cb=lambda _outcomes: True,  # the first child to end preempts the other
    )
    battery = smachpy.MonitorState(
        "battery", BatteryState, lambda _, message: message.percentage >= route.low_battery
    )
    with watched:
        watched.add("VISIT", visit)
        watched.add("WATCH_BATTERY", battery)
    charge = smachpy.StateMachine(outcomes=ends)
    until_full = ChargeGoal(route.charge_until)
    with charge:
        charge.add("DRIVE_TO_DOCK", drive_to(route.dock.pose), transitions={"succeeded": "CHARGE"})
        charge.add("CHARGE", smachpy.SimpleActionState("charge", ChargeAction, goal=until_full))
    sm = smachpy.StateMachine(outcomes=ends, name="PATROL", userdata={"index": 0})
    sm.userdata.waypoints = list(route.waypoints) * rounds
    with sm:
        sm.add(
            "ROUND", watched, transitions={"all_visited": "succeeded", "battery_low": "RECHARGE"}
        )
        sm.add("RECHARGE", charge, transitions={"succeeded": "ROUND"})
    return sm
