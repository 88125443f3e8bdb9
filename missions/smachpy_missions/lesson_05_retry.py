"""Lesson 5, when something fails: a timeout, retries, and an exception that becomes an outcome.

    TAKE_CUP
      WAIT   waits until somebody hands over a cup; after 5 s the outcome is `nobody`
      GRIP   tries three times; then the exception is the outcome `broken`

Run it: `smachpy run take_cup`
"""

import smachpy


class Gripper:
    """Replace this by the driver of your gripper, which may raise."""

    def close(self) -> None:
        """Close the gripper, or raise OSError."""


class Wait(smachpy.State):
    """Wait until somebody comes, for 5 s at most."""

    def __init__(self, seconds: float) -> None:
        super().__init__(outcomes=["came", "preempted"], timeout=5.0, timeout_outcome="nobody")
        self.seconds = seconds

    def execute(self, userdata: smachpy.UserData) -> str:
        """Sleep; the timeout, or a preempt, ends the sleep early."""
        return "preempted" if self.sleep(self.seconds) else "came"


def take_cup(seconds: float = 1.0, gripper: Gripper | None = None) -> smachpy.StateMachine:
    """Wait for a cup that comes after `seconds`, and take it."""
    hand = gripper or Gripper()

    @smachpy.state(outcomes=["held"], retry=(3, 0.5, [OSError]), on_exception={OSError: "broken"})
    def grip(userdata: smachpy.UserData) -> str:
        hand.close()
        return "held"

    sm = smachpy.StateMachine(outcomes=["held", "nobody", "broken", "preempted"], name="TAKE_CUP")
    with sm:
        sm.add("WAIT", Wait(seconds), transitions={"came": "GRIP"})
        sm.add("GRIP", grip)
    return sm
