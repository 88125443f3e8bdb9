"""The progress of a mission, for the terminal view and the live page."""

from __future__ import annotations

from dataclasses import dataclass

from smachpy.userdata.kept_types import register_type


@register_type
@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a mission; viewers show it if it is written to a userdata key.

    Attributes:
        fraction: 0 to 1; None if unknown.
        seconds_left: Estimated time until the end [s]; None if unknown.
        text: A short text.
    """

    fraction: float | None
    seconds_left: float | None
    text: str
