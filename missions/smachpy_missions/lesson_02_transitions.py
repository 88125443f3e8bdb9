"""Lesson 2, transitions and userdata: what happens next, and the values that states share.

    MAIL
      OPEN   opens the box: writes the userdata key `letters`
      READ   reads one letter, then READ again until there is none

Run it: `smachpy run mail`
"""

import smachpy


class Open(smachpy.State):
    """Open the box."""

    def __init__(self) -> None:
        super().__init__(outcomes=["opened"], output_keys=["letters"])

    def execute(self, userdata: smachpy.UserData) -> str:
        """Write what is in the box."""
        userdata.letters = ["bill", "post card"]
        return "opened"


class Read(smachpy.State):
    """Read one letter and throw it away."""

    def __init__(self) -> None:
        super().__init__(outcomes=["read", "empty"], io_keys=["letters"])

    def execute(self, userdata: smachpy.UserData) -> str:
        """`io_keys` are read and written."""
        if not userdata.letters:
            return "empty"
        print(f"It is a {userdata.letters.pop(0)}.")
        return "read"


def mail() -> smachpy.StateMachine:
    """Read every letter in the box."""
    sm = smachpy.StateMachine(outcomes=["succeeded"], name="MAIL")
    with sm:
        sm.add("OPEN", Open(), transitions={"opened": "READ"})
        sm.add("READ", Read(), transitions={"read": "READ", "empty": "succeeded"})
    return sm
