"""Lesson 3, a function as a state, and a mission with an argument.

    BATTERY_CHECK
      CHECK   compares the charge with what the way needs

Run it: `smachpy run battery_check --input charge=0.1`
"""

import smachpy


@smachpy.state(outcomes=["enough", "low"], input_keys=["charge"], output_keys=["advice"])
def check_charge(userdata: smachpy.UserData) -> str:
    """Store what to do, and return how the charge is."""
    if userdata.charge < 0.2:
        userdata.advice = "charge first"
        return "low"
    userdata.advice = "go"
    return "enough"


def battery_check(charge: float = 0.8) -> smachpy.StateMachine:
    """Tell whether the battery is good enough to set out.

    Args:
        charge: How full the battery is, from 0 to 1.
    """
    sm = smachpy.StateMachine(outcomes=["succeeded", "aborted"], name="BATTERY_CHECK")
    sm.userdata.charge = charge
    with sm:
        sm.add("CHECK", check_charge, transitions={"enough": "succeeded", "low": "aborted"})
    return sm
