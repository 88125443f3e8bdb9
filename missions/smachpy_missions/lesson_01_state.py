"""Lesson 1, a state: a class that does one thing and says how it ended.

    HELLO
      GREET   prints a line

Run it: `python -m smachpy_missions.lesson_01_state`, or `smachpy run hello`
"""

import smachpy


class Greet(smachpy.State):
    """Say hello."""

    def __init__(self) -> None:
        super().__init__(outcomes=["done"])

    def execute(self, userdata: smachpy.UserData) -> str:
        """Return the outcome: one of those above."""
        print("Hello, I am a robot.")
        return "done"


def hello() -> smachpy.StateMachine:
    """Say hello: the smallest mission."""
    sm = smachpy.StateMachine(outcomes=["succeeded"], name="HELLO")
    with sm:
        sm.add("GREET", Greet(), transitions={"done": "succeeded"})
    return sm


if __name__ == "__main__":
    machine = hello()
    print(f"The outcome is {machine.execute()}.")
