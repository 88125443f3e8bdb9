"""Lesson 4, nesting: a machine is a state, too, and can be used twice.

    MOVE_CUP
      FROM_TABLE   a machine: REACH, then GRIP, at the table
      FROM_SHELF   another machine of the same kind, at the shelf

Run it: `smachpy run move_cup`
"""

import smachpy


@smachpy.state(outcomes=["reached"], input_keys=["place"])
def reach(userdata: smachpy.UserData) -> str:
    """Move the arm."""
    print(f"The arm is at the {userdata.place}.")
    return "reached"


@smachpy.state(outcomes=["held"], input_keys=["place"], output_keys=["thing"])
def grip(userdata: smachpy.UserData) -> str:
    """Close the gripper."""
    userdata.thing = f"cup from the {userdata.place}"
    return "held"


def pick() -> smachpy.StateMachine:
    """Pick up the cup at `place`; a machine declares what goes in and out, like a state."""
    sm = smachpy.StateMachine(outcomes=["held"], input_keys=["place"], output_keys=["thing"])
    with sm:
        sm.add("REACH", reach, transitions={"reached": "GRIP"})
        sm.add("GRIP", grip)  # without transitions: its outcomes are the machine's
    return sm


def move_cup() -> smachpy.StateMachine:
    """Pick up two cups with one kind of machine."""
    sm = smachpy.StateMachine(outcomes=["held"], name="MOVE_CUP")
    sm.userdata.first, sm.userdata.second = "table", "shelf"
    with sm:
        table, shelf = {"place": "first"}, {"place": "second"}  # key of the child -> key here
        sm.add("FROM_TABLE", pick(), transitions={"held": "FROM_SHELF"}, remapping=table)
        sm.add("FROM_SHELF", pick(), remapping=shelf)
    return sm
