"""Actions of this folder's plans, apart from driving."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy import log, pnp

if TYPE_CHECKING:
    from smachpy import UserData


def say(userdata: UserData, *words: str, robot: str = "") -> None:
    """Write a line to the log."""
    del userdata
    log.loginfo(f"{robot or 'robot'}: {' '.join(words)}")


def _look(userdata: UserData) -> str:
    """Look for a cup; the simulated robot has no camera, so userdata says whether one is there."""
    return "cup" if "cup" in userdata and userdata.cup else "nothing"


look = pnp.Function(_look, outcomes=("cup", "nothing"), input_keys=("cup",))
