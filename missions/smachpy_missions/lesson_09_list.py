"""Lesson 9, a list of places: an `Iterator` runs the same machine for each of them.

    INSPECT
      PLACES        runs LOOK for each place; goes on if one is out of reach
        LOOK
          DRIVE
          NOTE      prints the name of the place

Run it: `smachpy run inspect --start-robot`
"""

import smachpy
from smachpy.places.maps import OFFICE_WAYPOINTS
from smachpy.states import drive_to, load_route


@smachpy.state(outcomes=["noted"], input_keys=["place"])
def note(userdata: smachpy.UserData) -> str:
    """Replace this by what your robot does at the place."""
    print(f"Inspected: {userdata.place.name}.")
    return "noted"


def inspect(waypoints: str = str(OFFICE_WAYPOINTS)) -> smachpy.StateMachine:
    """Visit the places of a YAML file, one after the other."""
    ends = ["noted", "aborted", "preempted"]
    look = smachpy.StateMachine(outcomes=ends, input_keys=["place"])
    with look:
        look.add("DRIVE", drive_to("place"), transitions={"succeeded": "NOTE"})
        look.add("NOTE", note)
    places = smachpy.Iterator(
        outcomes=["preempted"],
        input_keys=[],
        output_keys=[],
        it=load_route(waypoints).waypoints,
        it_label="place",  # the key in which LOOK finds the item
        exhausted_outcome="all_tried",
    )
    places.set_contained_state("LOOK", look, loop_outcomes=["noted", "aborted"])
    sm = smachpy.StateMachine(outcomes=["succeeded", "preempted"], name="INSPECT")
    with sm:
        sm.add("PLACES", places, transitions={"all_tried": "succeeded"})
    return sm
