"""How far a mission is, for the terminal view and the live page."""

from __future__ import annotations

from dataclasses import dataclass

from smachpy.userdata.kept_types import register_type


@register_type
@dataclass(frozen=True, slots=True)
class Progress:
    """How far a mission is; written to a userdata key, it is shown while the mission runs.

    Attributes:
        fraction: 0 to 1; None when it is not known.
        seconds_left: Estimated time until the end [s]; None when it is not known.
        text: Where it is, in a few words.
    """

    fraction: float | None
    seconds_left: float | None
    text: str
