"""What takes part in virtual time: participants, their events, tasks and timers."""

from __future__ import annotations

import _thread
import sys
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.clock._real import RealEvent
from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.clock._threads import mark_idle

if TYPE_CHECKING:
    import contextvars
    from collections.abc import Callable, Mapping
    from types import FrameType

    from actionlib_core.clock._virtual import VirtualClock


class Deadlock(Exception):  # noqa: N818  the field's word
    """Every participant waits and nothing can ever wake one of them.

    Attributes:
        waits: Participant name -> what it waits for.
    """

    def __init__(self, waits: Mapping[str, str]) -> None:
        self.waits = dict(waits)
        lines = [f"  - {name}: waits for {what}" for name, what in self.waits.items()]
        super().__init__(
            "virtual clock: every participant waits and no deadline is left; "
            "expected at least one that can go on:\n" + "\n".join(lines)
        )


class TimeLimit(Exception):  # noqa: N818  as Deadlock
    """Time would have passed `VirtualClock.limit`.

    Attributes:
        waits: Participant name -> what it waits for.
    """

    def __init__(self, now: float, waits: Mapping[str, str]) -> None:
        self.waits = dict(waits)
        lines = [f"  - {name}: waits for {what}" for name, what in self.waits.items()]
        super().__init__(
            f"virtual clock: time is up at {now:g} s; expected an end before its limit:\n"
            + "\n".join(lines)
        )


class Stopped(BaseException):
    """The clock was closed while this participant waited."""


class Participant:
    """One thread under the clock; `gate` is locked while it must not run."""

    __slots__ = ("ended", "error", "event", "gate", "name", "waiting", "woken")

    def __init__(self, name: str) -> None:
        self.name = name
        self.ended = RealEvent()
        self.gate = _thread.allocate_lock()
        self.gate.acquire()
        self.waiting = ""
        self.event: VirtualEvent | None = None
        self.woken = True
        self.error: BaseException | None = None


class VirtualEvent:
    """An event of a `VirtualClock`; `set` may come from any thread."""

    __slots__ = ("_clock", "_flag", "_waiters", "name")

    def __init__(self, clock: VirtualClock, name: str = "an event") -> None:
        self._clock = clock
        self._flag = False
        self._waiters: list[Participant] = []
        self.name = name

    def is_set(self) -> bool:
        return self._flag

    def set(self) -> None:
        self._flag = True
        if self._waiters:
            self._clock._wake_all(self._waiters)  # noqa: SLF001  the two are one module's secret

    def clear(self) -> None:
        self._flag = False

    def wait(self, timeout: float | None = None) -> bool:
        if self._flag:
            return True
        if timeout is not None and timeout <= 0:
            return False
        return self._clock._wait(self, timeout) or self._flag  # noqa: SLF001


class VirtualTask:
    """A participant as its starter sees it; `run` is its thread's side."""

    __slots__ = ("_clock", "_context", "_done", "_target", "error", "ident", "name", "participant")

    def __init__(
        self,
        clock: VirtualClock,
        target: Callable[[], object],
        context: contextvars.Context,
        name: str,
    ) -> None:
        self._clock = clock
        self._target = target
        self._context = context
        self._done = VirtualEvent(clock, f"the end of {name}")
        self.participant = Participant(name)
        self.name = name
        self.ident: int | None = None
        self.error: BaseException | None = None

    def is_alive(self) -> bool:
        return not self._done.is_set()

    def join(self, timeout: float | None = None) -> bool:
        return self._done.wait(timeout)

    def run(self) -> None:
        try:
            if self._clock._enter(self.participant):  # noqa: SLF001  the two are one secret
                self.ident = threading.get_ident()
                self._context.run(self._target)
        except Stopped:
            pass
        except BaseException as error:  # noqa: BLE001  the thread's border: kept and reported
            self.error = error
            if not isinstance(error, SystemExit):
                report_thread_exception()
        finally:
            self.ident = None
            del self._target, self._context
            mark_idle()
            self._done.set()
            self._clock._leave(self.participant)  # noqa: SLF001


class VirtualTimer:
    """A scheduled callback."""

    __slots__ = ("callback",)

    def __init__(self, callback: Callable[[], object]) -> None:
        self.callback: Callable[[], object] | None = callback

    @property
    def name(self) -> str:
        callback: Any = self.callback
        callback = getattr(callback, "func", callback)  # of a partial
        return str(getattr(callback, "__qualname__", "a callback"))

    def cancel(self) -> None:
        self.callback = None


def name_waits(
    waits: Mapping[Participant, int], idents: Mapping[int, Participant]
) -> dict[str, str]:
    """Say who waits for what, and where if that has no name; names that come twice get numbers."""
    threads = {participant: ident for ident, participant in idents.items()}
    frames = sys._current_frames()  # noqa: SLF001  the documented way
    named: dict[str, str] = {}
    for participant in waits:
        name, number = participant.name, 1
        while name in named:
            number += 1
            name = f"{participant.name} ({number})"
        frame = frames.get(threads.get(participant, 0))
        unnamed = participant.waiting.startswith(UNNAMED)
        named[name] = participant.waiting + (_where(frame) if unnamed else "")
    return named


def _where(frame: FrameType | None) -> str:
    """Return the line that waits, and the line outside of the packages that led there."""
    lines: list[str] = []
    while frame is not None and len(lines) < 2:  # noqa: PLR2004  the two lines
        module = str(frame.f_globals.get("__name__", ""))
        ours = _OURS if lines else _CLOCK
        if not module.startswith(ours):
            lines.append(f"{frame.f_code.co_filename}:{frame.f_lineno}")
        frame = frame.f_back
    return f" at {', from '.join(lines)}" if lines else ""


UNNAMED = "an event"
_CLOCK = ("actionlib_core.clock.", "threading", "queue")
_OURS = ("actionlib_core.", "smachpy.", "contextvars", "threading")
