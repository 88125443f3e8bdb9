"""Tests missions: virtual time, scripted servers, doubles, exploration, coverage.

Under pytest the fixtures `mission`, `action_server`, `service_server` and `topic` are available
without an import (`smachpy.testing.plugin`). Elsewhere:

    with mission_kit() as mission:
        run = mission(machine)

or `MissionTestCase` for unittest. The modules of this package are imported when they are used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from smachpy.testing.cases import MissionTestCase as MissionTestCase
    from smachpy.testing.doubles import Double as Double
    from smachpy.testing.doubles import DoubleError as DoubleError
    from smachpy.testing.exploring.exploration import Exploration as Exploration
    from smachpy.testing.exploring.exploration import explore as explore
    from smachpy.testing.exploring.exploration import replay as replay
    from smachpy.testing.kit import MissionKit as MissionKit
    from smachpy.testing.kit import UnfiredWarning as UnfiredWarning
    from smachpy.testing.kit import mission_kit as mission_kit
    from smachpy.testing.runs import Run as Run
    from smachpy.testing.runs import TimeLimitError as TimeLimitError
    from smachpy.testing.runs import UnknownStateError as UnknownStateError

__all__ = [
    "Double",
    "DoubleError",
    "Exploration",
    "MissionKit",
    "MissionTestCase",
    "Run",
    "TimeLimitError",
    "UnfiredWarning",
    "UnknownStateError",
    "explore",
    "mission_kit",
    "replay",
]

_HOMES = {
    "Double": "doubles",
    "DoubleError": "doubles",
    "Exploration": "exploring.exploration",
    "MissionKit": "kit",
    "MissionTestCase": "cases",
    "Run": "runs",
    "TimeLimitError": "runs",
    "UnfiredWarning": "kit",
    "UnknownStateError": "runs",
    "explore": "exploring.exploration",
    "mission_kit": "kit",
    "replay": "exploring.exploration",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'smachpy.testing' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"smachpy.testing.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
