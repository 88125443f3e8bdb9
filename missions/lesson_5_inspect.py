"""Lesson 5, an Iterator: drive to every waypoint, measure how much room there is, report it.

    INSPECT
      WAYPOINTS    once for each waypoint; one out of reach is left out
        LOOK       DRIVE -> SCAN
      REPORT       all waypoints seen: succeeded; some left out: incomplete

Run it: `smachpy run inspect --start-robot`
"""

import smachpy
from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from smachpy import Iterator, MonitorState, StateMachine, UserData
from smachpy.sim.maps import OFFICE_WAYPOINTS
from smachpy.states import SIGNAL_TIMEOUT, drive_to, load_route


def note_room(userdata: UserData, scan: LaserScan) -> bool:
    """Keep the distance to the nearest obstacle [m], by the waypoint's name."""
    userdata.room = {**userdata.room, userdata.waypoint.name: round(min(scan.ranges), 2)}
    return True


def inspect(waypoints: str = str(OFFICE_WAYPOINTS)) -> StateMachine:
    """Measure the room around each waypoint of a file; the userdata key `room` has the report.

    Args:
        waypoints: The YAML file that lists them.

    Raises:
        InputFileError: the file is wrong; with the line and field of every problem.
    """
    places = load_route(waypoints).waypoints
    look = StateMachine(["succeeded", "aborted", "preempted"], ["waypoint", "room"], ["room"])
    look.add("DRIVE", drive_to("waypoint", retry=2), {"succeeded": "SCAN"})
    scan = MonitorState(
        "scan",
        LaserScan,
        note_room,
        max_checks=1,
        input_keys=["waypoint", "room"],
        output_keys=["room"],
        timeout=SIGNAL_TIMEOUT,
    )
    look.add("SCAN", scan, {"valid": "succeeded", "invalid": "aborted"})
    each = Iterator(
        ["preempted"],
        input_keys=["room"],
        output_keys=["room"],
        it=places,
        it_label="waypoint",
        exhausted_outcome="all_tried",
    )
    each.set_contained_state("LOOK", look, loop_outcomes=["succeeded", "aborted"])

    @smachpy.state(["succeeded", "incomplete"], ["room"])
    def report(userdata: UserData) -> str:
        return "succeeded" if len(userdata.room) == len(places) else "incomplete"

    sm = StateMachine(
        ["succeeded", "incomplete", "preempted"], output_keys=["room"], name="INSPECT"
    )
    sm.register_start_cb(lambda userdata, _: userdata.update({"room": {}}))  # at each run
    with sm:
        sm.add("WAYPOINTS", each, {"all_tried": "REPORT"})
        sm.add("REPORT", report)
    return sm
