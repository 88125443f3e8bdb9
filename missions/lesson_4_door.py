"""Lesson 4, services, retries and timeouts: ask for a door to be opened, then drive through it.

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
from smachpy import ServiceState, StateMachine, UserData
from smachpy.sim.maps import OFFICE_DOORS
from smachpy.states import AwaitMessage, Pose2D, drive_to

SOUTH = -1.5708  # [rad]
BEFORE, BEHIND = Pose2D(18.0, 7.7, SOUTH), Pose2D(17.9, 5.4, SOUTH)


def obeyed(_userdata: UserData, response: SetBoolResponse) -> str:
    """Return the outcome: an answer arrived, but the door may have refused."""
    return "succeeded" if response.success else "aborted"


@smachpy.mission(world=OFFICE_DOORS)
def door(name: str = "lab", patience: float = 20.0) -> StateMachine:
    """Drive into the lab through its door.

    Args:
        name: The door's name.
        patience: How long the door may take to open [s].
    """
    open_it = ServiceState(
        f"/doors/{name}/set",
        SetBool,
        SetBoolRequest(data=True),
        response_cb=obeyed,
        timeout=5.0,  # for one attempt [s]
        retry=(3, 2.0, ["aborted"]),  # attempts, first pause [s], outcomes that are retried
    )
    is_open = AwaitMessage(f"/doors/{name}/open", Bool, lambda msg: msg.data, timeout=patience)
    sm = StateMachine(["succeeded", "closed", "aborted", "preempted"], name="THROUGH_THE_DOOR")
    with sm:
        sm.add("APPROACH", drive_to(BEFORE, retry=2), {"succeeded": "OPEN"})
        sm.add("OPEN", open_it, {"succeeded": "WAIT", "aborted": "closed"})
        sm.add("WAIT", is_open, {"came": "ENTER", "timeout": "closed"})
        sm.add("ENTER", drive_to(BEHIND))
    return sm
