"""States that the mission files of these tests name."""

from __future__ import annotations

import os  # noqa: F401  a mission file must not reach it
from typing import Any

import smachpy
from smachpy import State


class Count(State):
    """Counts its visits in the userdata."""

    def __init__(self) -> None:
        super().__init__(["more", "enough"], io_keys=["count"])

    def execute(self, userdata: Any) -> str:
        userdata.count = userdata.count + 1
        return "enough" if userdata.count >= 3 else "more"


class Up(State):
    """Ends with 'a' and 'b' in turn, as the count says."""

    def __init__(self) -> None:
        super().__init__(["a", "b"], io_keys=["count"])

    def execute(self, userdata: Any) -> str:
        userdata.count = userdata.count + 1
        return "a" if userdata.count % 2 else "b"


class Limited(Up):
    """The same, with a time limit."""

    def __init__(self) -> None:
        super().__init__()
        smachpy.set_options(self, timeout=5.0, timeout_outcome="b")


@smachpy.state(["a", "b"], io_keys=["count"])
def down(userdata: Any) -> str:
    """The same, as a function."""
    userdata.count = userdata.count + 1
    return "b" if userdata.count % 3 else "a"


def step(seconds: float = 0.0) -> State:
    """Return a state that takes a time."""
    from smachpy.states import Wait

    return Wait(seconds)


NUMBER = 3
