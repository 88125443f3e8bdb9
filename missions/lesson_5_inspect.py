"""Lesson 5, an Iterator: drive to every waypoint, measure the free space there, report it.

    INSPECT
      WAYPOINTS    runs LOOK for each waypoint; skips waypoints out of reach
        LOOK       DRIVE -> SCAN
      REPORT       succeeded if every waypoint was measured, else incomplete

Run it: `smachpy run inspect --start-robot`
"""

import smachpy
from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from smachpy import Iterator, MonitorState, StateMachine, UserData
from smachpy.sim.maps import OFFICE_WAYPOINTS
from smachpy.states import SIGNAL_TIMEOUT, drive_to, load_route


def note_room(userdata: UserData, scan: LaserScan) -> bool:
    """Store the distance to the nearest obstacle [m] under the waypoint's name."""
    userdata.room = {**userdata.room, userdata.waypoint.name: round(min(scan.ranges), 2)}
    return True


def inspect(waypoints: str = str(OFFICE_WAYPOINTS)) -> StateMachine:
    """Measure the free space around each waypoint of a file; the userdata key `room` holds it.

    Args:
        waypoints: A YAML file with the list.

    Raises:
        InputFileError: the file has problems; each is listed with its line and field.
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
    sm.register_start_cb(lambda userdata, _: userdata.update({"room": {}}))  # for every run
    with sm:
        sm.add("WAYPOINTS", each, {"all_tried": "REPORT"})
        sm.add("REPORT", report)
    return sm
