"""Records one run of a machine under test, fires triggers, and ends it if no time passes."""

from __future__ import annotations

import contextlib
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from actionlib_core.clock import VirtualClock
from actionlib_core.clock._virtual import START_TIME_NS
from actionlib_core.clock._virtual_parts import Stopped
from smachpy.events import Entered, Event
from smachpy.events.buffer import RawEventBuffer
from smachpy.testing.runs import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock, Timer
    from actionlib_core.clock._virtual_parts import VirtualTask
    from smachpy.events.introspection import StateRecord
    from smachpy.machines.container import Container

STEPS = 100_000  # events at one moment of virtual time, after which a run counts as endless
TURN_STEPS = 5  # a thread switch takes the computer about as long as five transitions


class MissionClock(VirtualClock):
    """A virtual clock that records the exceptions of its threads and of a run's triggers.

    Attributes:
        failures: Name of the thread or trigger, and its exception.
    """

    def __init__(
        self,
        seed: int | None = None,
        *,
        rate: float | None = None,
        choose: Callable[[list[str]], int] | None = None,
        begin_ns: int = START_TIME_NS,
    ) -> None:
        super().__init__(seed, rate=rate, choose=choose, begin_ns=begin_ns)
        self.failures: list[tuple[str, BaseException]] = []

    def spawn(self, target: Callable[[], object], *, name: str) -> VirtualTask:

        def run() -> None:
            try:
                target()
            except (Stopped, SystemExit):
                raise
            except BaseException as error:
                self.failures.append((name, error))
                raise

        return super().spawn(run, name=name)


class Stuck(BaseException):
    """A run has taken too many steps at one moment of virtual time.

    Not an `Exception`: a mission that catches those must end nevertheless.
    """


@dataclass(frozen=True, slots=True)
class Trigger:
    """Something to do during the next run.

    Attributes:
        what: Its name, for messages.
        act: The function to call.
        at: When [s after the start], or None.
        on: When the state at this path begins, or None.
        after: This long after that [s].
        visit: At this visit of the state.
    """

    what: str
    act: Callable[[Container], object]
    at: float | None
    on: str | None
    after: float
    visit: int

    def __str__(self) -> str:
        if self.on is None:
            return f"{self.what}(at={self.at:g})"
        after = f", after={self.after:g}" if self.after else ""
        visit = f", visit={self.visit}" if self.visit != 1 else ""
        return f"{self.what}(on={self.on!r}{after}{visit})"


class RunRecorder:
    """Records the events of one run, fires its triggers, and ends it when no time passes.

    Args:
        clock: The clock.
        machine: The machine.
        record: Its structure.
        triggers: The triggers.
        steps: The most events at one moment.

    Attributes:
        events: All events, after the run.
        started: When it began [s].
    """

    def __init__(
        self,
        clock: MissionClock,
        machine: Container,
        record: StateRecord,
        triggers: list[Trigger],
        steps: int,
    ) -> None:
        self._clock = clock
        self._machine = machine
        self._root = record.path
        self._steps = steps
        self._paths = [find_path(record, t.on) if t.on is not None else None for t in triggers]
        self._triggers = triggers
        self._fired = [False] * len(triggers)
        self._timers: list[Timer] = []
        self._visits = Counter({record.path: 1})
        self._unsubscribe: Callable[[], object] = lambda: None
        self.events: list[Event] = []
        self.started = clock.now()

    @contextlib.contextmanager
    def installed(self) -> Iterator[None]:
        """Record the run within this block."""
        waiting: dict[tuple[str, int], list[int]] = {}  # (path, visit) -> triggers
        for number, (trigger, path) in enumerate(zip(self._triggers, self._paths, strict=True)):
            if path is None:
                self._start_timer(number, trigger.at or 0.0)
            elif (path, trigger.visit) == (self._root, 1):  # the root has no Entered event
                self._start_timer(number, trigger.after)
            else:
                waiting.setdefault((path, trigger.visit), []).append(number)

        def on_event(event: Event) -> None:
            if isinstance(event, Entered):
                self._visits[event.path] += 1
                for number in waiting.pop((event.path, self._visits[event.path]), ()):
                    self._start_timer(number, self._triggers[number].after)
                if not waiting:  # no longer needed: a listener slows the machine down
                    self._unsubscribe()

        buffer = _StepBuffer(self._machine, self._clock, self._steps)
        if waiting:
            self._unsubscribe = self._machine.subscribe(on_event)
        try:
            yield
        finally:
            self._unsubscribe()
            buffer.close()
            self.events = buffer.events()
            for timer in self._timers:
                timer.cancel()

    def _start_timer(self, number: int, delay: float) -> None:
        def fire() -> None:
            self._fired[number] = True
            try:
                self._triggers[number].act(self._machine)
            except Exception as error:  # noqa: BLE001  the test fails with it
                self._clock.failures.append((str(self._triggers[number]), error))

        self._timers.append(self._clock.call_later(delay, fire))

    def unfired(self) -> tuple[str, ...]:
        """Return, after the run, the triggers that never fired, and why."""
        ended = f"the run ended after {self._clock.now() - self.started:g} s"
        found = []
        for trigger, path, fired in zip(self._triggers, self._paths, self._fired, strict=True):
            visits = trigger.visit if path is None else self._visits[path]
            times = f"{path} began {visits} times, and " if visits < trigger.visit else ""
            if not fired:
                found.append(f"{trigger}: {times}{ended}")
        return tuple(found)


class _StepBuffer(RawEventBuffer):
    """An event buffer that raises in the machine's thread if too much happens at one moment."""

    def __init__(self, machine: Container, clock: Clock, most: int) -> None:
        self._time = clock
        self._moment = clock.now()
        self._begun = 0
        self._size = 2 * most  # events: a step begins and ends
        super().__init__(machine)

    def take(self, event: Event) -> None:
        """Record an event."""
        super().take(event)
        if type(event) is Entered:  # published by the machine's own thread, which is to be ended
            self._look()

    def _look(self) -> None:
        now, size = self._time.now(), len(self._entries)
        if now != self._moment:
            self._moment, self._begun = now, size
        elif size - self._begun > self._size:
            raise Stuck
