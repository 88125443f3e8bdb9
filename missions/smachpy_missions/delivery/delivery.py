"""Delivery: bring something to a place behind a door; if anything fails on the way, come back.

    DELIVERY
      GO            APPROACH the door, OPEN it (call the service, then wait until it is), ENTER
      CONFIRM       asks a person whether to hand over: yes, no, or no answer
      HAND_OVER     TURN the tray to the person, RELEASE the parcel
      NOTE          records that the parcel is delivered
      COME_BACK     OPEN the door again, DRIVE_HOME, CLOSE it; asks for HELP if the robot is stuck
      REPORT        succeeded, or brought_back

Run it: `smachpy run delivery --start-robot`, and answer when it asks
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import smachpy
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool, SetBoolRequest
from smachpy import ServiceState, StateMachine, UserData
from smachpy.exceptions import did_you_mean
from smachpy.places.maps import OFFICE_DOORS, OFFICE_PLACES
from smachpy.states import AskOperator, AwaitMessage, MissionError, Wait, drive_to, turn
from smachpy_missions.delivery.places import load_places

if TYPE_CHECKING:
    from actionlib_core.interfaces.std_srvs.srv import SetBoolResponse
    from smachpy.states import Waypoint
    from smachpy_missions.delivery.places import DeliveryPlace, Places

CALL_TIMEOUT = 5.0  # [s] to find the door's service and get its answer
OPEN_TIMEOUT = 20.0  # [s] for the door to open
RELEASE_TIME = 3.0  # [s] the tray needs to release the parcel
ENDS = ("succeeded", "aborted", "preempted")


@smachpy.mission(world=OFFICE_DOORS)
def delivery(
    to: str = "lab", places: str | Path = OFFICE_PLACES, patience: float = 60.0
) -> StateMachine:
    """Bring something to a place, through its door; ask before handing it over.

    Args:
        to: The name of the place.
        places: A YAML file with the places.
        patience: How long to wait for an answer [s].

    Raises:
        InputFileError: the file has problems; each is listed with its line and field.
        MissionError: there is no such place.
    """
    known = load_places(Path(places))
    place = find(known, to)
    sm = StateMachine(
        ["succeeded", "brought_back", "aborted", "preempted"],
        name="DELIVERY",
        userdata={"delivered": False},
    )
    with sm:
        # Every failure leads to COME_BACK: the robot must not stay where it blocks a door.
        sm.add("GO", go(place), {"succeeded": "CONFIRM", "aborted": "COME_BACK"})
        sm.add(
            "CONFIRM",
            AskOperator(f"Delivery to {to}: may I hand it over?", patience=patience),
            {"yes": "HAND_OVER", "no": "COME_BACK", "no_answer": "COME_BACK"},
        )
        sm.add("HAND_OVER", hand_over(), {"succeeded": "NOTE", "aborted": "COME_BACK"})
        sm.add("NOTE", note, {"done": "COME_BACK"})
        sm.add("COME_BACK", come_back(place, known.home, patience), {"succeeded": "REPORT"})
        sm.add("REPORT", report)
    return sm


def find(known: Places, name: str) -> DeliveryPlace:
    """Return the place of that name.

    Raises:
        MissionError: there is none.
    """
    if name in known.places:
        return known.places[name]
    hint = did_you_mean(name, known.places)
    raise MissionError(f"to: got {name!r}; expected one of {sorted(known.places)}.{hint}")


def go(place: DeliveryPlace) -> StateMachine:
    """Drive to the place; if there is a door, wait in front of it until it is open."""
    sm = StateMachine(ENDS)
    with sm:
        if place.wait is not None:
            sm.add("APPROACH", drive_to(place.wait.pose), {"succeeded": "OPEN"})
            sm.add("OPEN", open_door(place.door), {"succeeded": "ENTER"})
        sm.add("ENTER", drive_to(place.goal.pose))
    return sm


def open_door(door: str) -> StateMachine:
    """Ask for a door to be opened, and wait until it is.

    The service's answer only says that the door has begun to open; its topic says when it is open.
    """
    sm = StateMachine(ENDS)
    with sm:
        sm.add("CALL", set_door(door, is_open=True), {"succeeded": "WAIT"})
        is_open = AwaitMessage(
            f"/doors/{door}/open", Bool, lambda message: message.data, timeout=OPEN_TIMEOUT
        )
        sm.add("WAIT", is_open, {"came": "succeeded", "timeout": "aborted"})
    return sm


def set_door(door: str, *, is_open: bool) -> ServiceState:
    """Ask for a door to be opened or closed, with at most three attempts."""
    return ServiceState(
        f"/doors/{door}/set",
        SetBool,
        SetBoolRequest(is_open),
        response_cb=verdict,
        timeout=CALL_TIMEOUT,
        retry=(3, 2.0, ["aborted"]),
    )


def verdict(_userdata: UserData, response: SetBoolResponse) -> str:
    """Return the outcome of a call that was answered: the door may refuse."""
    return "succeeded" if response.success else "aborted"


def hand_over() -> StateMachine:
    """Turn the tray to the person and release the parcel."""
    sm = StateMachine(ENDS)
    with sm:
        sm.add("TURN", turn(180.0), {"succeeded": "RELEASE"})
        sm.add("RELEASE", Wait(RELEASE_TIME), {"done": "succeeded"})
    return sm


@smachpy.state(["done"], output_keys=["delivered"])
def note(userdata: UserData) -> str:
    """Record that the parcel is delivered, even if the way home fails."""
    userdata.delivered = True
    return "done"


def come_back(place: DeliveryPlace, home: Waypoint, patience: float) -> StateMachine:
    """Drive home; try to drive even if the door's service does not answer: it may be open."""
    sm = StateMachine(ENDS)
    with sm:
        if place.door:
            sm.add(
                "OPEN",
                open_door(place.door),
                {"succeeded": "DRIVE_HOME", "aborted": "DRIVE_HOME"},
            )
        drive_home = drive_to(home.pose, retry=(3, 5.0, ["aborted"]))
        after = "CLOSE" if place.door else "succeeded"
        sm.add("DRIVE_HOME", drive_home, {"succeeded": after, "aborted": "HELP"})
        if place.door:
            closed = {"succeeded": "succeeded", "aborted": "succeeded"}
            sm.add("CLOSE", set_door(place.door, is_open=False), closed)
        sm.add(
            "HELP",
            AskOperator("I cannot get home. Shall I try again?", patience=patience),
            {
                "yes": "OPEN" if place.door else "DRIVE_HOME",
                "no": "aborted",
                "no_answer": "aborted",
            },
        )
    return sm


@smachpy.state(["succeeded", "brought_back"], input_keys=["delivered"])
def report(userdata: UserData) -> str:
    """Return the mission's outcome: delivered or not."""
    return "succeeded" if userdata.delivered else "brought_back"
