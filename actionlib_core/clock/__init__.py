"""One clock for everything that waits: real time, or virtual time for tests.

Everything in smachpy that sleeps, starts a thread or waits for an event does so through the `Clock`
protocol. So a mission with its action servers runs unchanged on `RealClock` (wall time) or
`VirtualClock` (deterministic, as fast as the computer allows).
"""

from typing import TYPE_CHECKING, Any

from actionlib_core.clock._protocol import Clock as Clock
from actionlib_core.clock._protocol import Event as Event
from actionlib_core.clock._protocol import Task as Task
from actionlib_core.clock._protocol import Timer as Timer
from actionlib_core.clock._real import RealClock as RealClock
from actionlib_core.clock._real import current_clock as current_clock
from actionlib_core.clock._real import use_clock as use_clock
from actionlib_core.clock._serial import SerialExecutor as SerialExecutor
from actionlib_core.clock._wall import wall_time as wall_time

if TYPE_CHECKING:
    from actionlib_core.clock._virtual import VirtualClock as VirtualClock
    from actionlib_core.clock._virtual_parts import Deadlock as Deadlock
    from actionlib_core.clock._virtual_parts import TimeLimit as TimeLimit

# Imported on first use: only tests need virtual time, and programs on robots start faster.
_VIRTUAL = {"VirtualClock": "_virtual", "Deadlock": "_virtual_parts", "TimeLimit": "_virtual_parts"}

__all__ = [
    "Clock",
    "Deadlock",
    "Event",
    "RealClock",
    "SerialExecutor",
    "Task",
    "TimeLimit",
    "Timer",
    "VirtualClock",
    "current_clock",
    "use_clock",
    "wall_time",
]


def __getattr__(name: str) -> Any:
    if name in _VIRTUAL:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_VIRTUAL[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
