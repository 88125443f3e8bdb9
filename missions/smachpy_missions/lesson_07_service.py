"""Lesson 7, a service and a message: ask for a door to be opened, and drive in when it is open.

    THROUGH_THE_DOOR
      APPROACH   drives to a place in front of the door
      OPEN       calls the door's service, at most three times
      WAIT       waits until the door reports that it is open
      ENTER      drives to a place behind the door

Run it: `smachpy run door --start-robot`
"""

import smachpy
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse
from smachpy.places.maps import OFFICE_DOORS
from smachpy.states import AwaitMessage, Pose2D, drive_to


def obeyed(_userdata: smachpy.UserData, response: SetBoolResponse) -> str:
    """Return the outcome of OPEN: the door may answer that it refuses."""
    return "succeeded" if response.success else "aborted"


@smachpy.mission(world=OFFICE_DOORS)
def door(name: str = "lab", patience: float = 20.0) -> smachpy.StateMachine:
    """Drive into the lab through its door, which may take `patience` seconds to open."""
    ask = SetBoolRequest(data=True)
    open_it = smachpy.ServiceState(
        f"/doors/{name}/set", SetBool, request=ask, response_cb=obeyed, timeout=5.0, retry=3
    )
    is_open = AwaitMessage(f"/doors/{name}/open", Bool, lambda msg: msg.data, timeout=patience)
    outcomes = ["succeeded", "closed", "aborted", "preempted"]
    sm = smachpy.StateMachine(outcomes=outcomes, name="THROUGH_THE_DOOR")
    with sm:
        approach, enter = drive_to(Pose2D(18.0, 7.7, -1.57)), drive_to(Pose2D(17.9, 5.4, -1.57))
        sm.add("APPROACH", approach, transitions={"succeeded": "OPEN"})
        sm.add("OPEN", open_it, transitions={"succeeded": "WAIT", "aborted": "closed"})
        sm.add("WAIT", is_open, transitions={"came": "ENTER", "timeout": "closed"})
        sm.add("ENTER", enter)
    return sm
