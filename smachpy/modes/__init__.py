"""Modes of a robot: a machine that events move from mode to mode; see docs/modes.md."""

from __future__ import annotations

from smachpy.modes.modes import Modes, Waiting
from smachpy.modes.sources import on_service, on_signal, on_topic
from smachpy.modes.table import ModesError, Table, Way

__all__ = [
    "Modes",
    "ModesError",
    "Table",
    "Waiting",
    "Way",
    "on_service",
    "on_signal",
    "on_topic",
]
