"""The parts of virtual time: participants, their events, tasks and timers."""

from __future__ import annotations

import sys
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.clock._protocol import check_seconds
from actionlib_core.clock._real import IDLE_NAME, RealEvent
from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.clock._turns import take_worker

if TYPE_CHECKING:
    import contextvars
    from collections.abc import Callable, Mapping
    from types import FrameType

    from actionlib_core.clock._gates import Gate
    from actionlib_core.clock._real import RealTimer
    from actionlib_core.clock._turns import Worker
    from actionlib_core.clock._virtual import VirtualClock


class Deadlock(Exception):  # noqa: N818  the field's word
    """All participants wait, and nothing can ever wake one of them.

    Attributes:
        waits: Participant name -> what it waits for.
    """

    def __init__(self, waits: Mapping[str, str]) -> None:
        self.waits = dict(waits)
        lines = [f"  - {name}: waits for {what}" for name, what in self.waits.items()]
        super().__init__(
            "virtual clock: every thread waits, and none of them for a time; "
            "expected at least one that can continue:\n" + "\n".join(lines)
        )


class TimeLimit(Exception):  # noqa: N818  as Deadlock
    """Time would pass `VirtualClock.limit`, or stands still (`VirtualClock.most_turns`).

    Attributes:
        waits: Participant name -> what it waits for.
        turns: Number of turns while time stood still; 0 when the limit was reached.
    """

    def __init__(self, now: float, waits: Mapping[str, str], turns: int = 0) -> None:
        self.waits = dict(waits)
        self.turns = turns
        lines = [f"  - {name}: waits for {what}" for name, what in self.waits.items()]
        what = (
            f"{turns} turns were taken at {now:g} s; expected time to pass"
            if turns
            else f"time is up at {now:g} s; expected an end before its limit"
        )
        super().__init__(f"virtual clock: {what}:\n" + "\n".join(lines))


class Stopped(BaseException):
    """The clock was closed, or this participant was stopped, while it waited.

    A `BaseException`, so that user code with `except Exception` cannot stop it.
    """


class Participant:
    """One thread under the clock; it runs after it has received its turn at `gate`.

    Attributes:
        name: Its name in reports.
        gate: Gives it the turn; from `begin` on, that of its thread.
        job: The job for its thread; None once that has it, or if the thread is not from our cache.
        ended: Set when it has given its last turn away.
        event: The event that it waits for.
        deadline: When its wait ends [s]; None: only when its event is set.
        noted: Whether the clock's heap has that deadline, or need not have it.
        turn: Number of its wait; a heap entry with another number is out of date.
        woken: Whether the event ended its wait.
        error: The exception that its wait is to raise.
        stopped: Whether its waits raise `Stopped`.
    """

    __slots__ = (
        "deadline",
        "ended",
        "error",
        "event",
        "gate",
        "job",
        "name",
        "noted",
        "stopped",
        "turn",
        "woken",
    )

    def __init__(self, name: str) -> None:
        self.name = name
        self.gate: Gate
        self.job: VirtualTask | None = None
        self.ended = RealEvent()
        self.event: VirtualEvent | None = None
        self.deadline: float | None = None
        self.noted = True
        self.turn = 0
        self.woken = True
        self.error: BaseException | None = None
        self.stopped = False

    def begin(self) -> None:
        """Give it a thread that waits for the turn, if it has none."""
        if self.job is not None:
            worker = take_worker()
            worker.give(self.job)
            self.gate, self.job = worker.gate, None


class VirtualEvent:
    """An event of a `VirtualClock`; `set` may come from any thread."""

    __slots__ = ("_clock", "flag", "name", "waiters")

    def __init__(self, clock: VirtualClock, name: str = "an event") -> None:
        self._clock = clock
        self.flag = False
        self.waiters: list[Participant] = []
        self.name = name

    def is_set(self) -> bool:
        return self.flag

    def set(self) -> None:
        self._clock.set_event(self)

    def clear(self) -> None:
        self.flag = False

    def wait(self, timeout: float | None = None) -> bool:
        if self.flag:
            return True
        if timeout is not None and not timeout > 0:
            check_seconds("wait", timeout)
            return False
        return self._clock.wait_for(self, timeout) or self.flag


class VirtualTask:
    """The task of a participant; its thread calls `run` or `run_turns`, others the rest."""

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
        """Run in the calling thread, which is not from our cache."""
        self.participant.gate.acquire()
        self.run_turns()

    def run_turns(self, worker: Worker | None = None) -> None:
        """Run in the calling thread, which has received its first turn."""
        try:
            if self._clock.enter(self.participant):
                self.ident = threading.get_ident()
                self._context.run(self._target)
        except Stopped:
            pass
        except BaseException as error:  # noqa: BLE001  end of the thread's stack: reported
            self.error = error
            if not isinstance(error, SystemExit):
                report_thread_exception()
        finally:
            self.ident = None
            del self._target, self._context
            threading.current_thread().name = IDLE_NAME
            self._done.set()
            # Before the turn is given away, so that the next participant can reuse this thread.
            if worker is not None:
                worker.free()
            self._clock.leave(self.participant)


class VirtualTimer:
    """A scheduled callback.

    Attributes:
        callback: It; None once it was called or cancelled.
        real: Its timer in real time, if it was scheduled by a thread that is no participant.
    """

    __slots__ = ("callback", "real")

    def __init__(self, callback: Callable[[], object]) -> None:
        self.callback: Callable[[], object] | None = callback
        self.real: RealTimer | None = None

    @property
    def name(self) -> str:
        callback: Any = self.callback
        callback = getattr(callback, "func", callback)  # the function in a partial
        return str(getattr(callback, "__qualname__", "a callback"))

    def cancel(self) -> None:
        self.callback = None
        if self.real is not None:
            self.real.cancel()


def name_waits(
    waits: Mapping[Participant, int], idents: Mapping[int, Participant]
) -> dict[str, str]:
    """Return what each participant waits for, with the line of code if the event has no name.

    Participants with the same name are numbered.
    """
    threads = {participant: ident for ident, participant in idents.items()}
    frames = sys._current_frames()
    named: dict[str, str] = {}
    for participant in waits:
        name, number = participant.name, 1
        while name in named:
            number += 1
            name = f"{participant.name} ({number})"
        frame = frames.get(threads.get(participant, 0))
        what = _describe(participant)
        named[name] = what + (_where(frame) if what.startswith(UNNAMED) else "")
    return named


def _describe(participant: Participant) -> str:
    event, deadline = participant.event, participant.deadline
    what = "time to pass" if event is None else event.name
    return what if deadline is None else f"{what} (until {deadline:.6g} s)"


def _where(frame: FrameType | None) -> str:
    """Return the line that waits, and the line of the user's code that led there."""
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
