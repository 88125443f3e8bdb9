"""One run of a machine under test: its events, what is to happen in it, whether it gets on."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import VirtualClock
from actionlib_core.clock._virtual_parts import Stopped
from smachpy._runtime.thinning import SLOTS
from smachpy.events import Entered, Event
from smachpy.tape import EventTape
from smachpy.testing.runs import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock, Timer
    from actionlib_core.clock._virtual_parts import VirtualTask
    from smachpy.container import Container
    from smachpy.introspection import StateRecord

STEPS = 100_000
TURN_STEPS = 5  # a turn of the clock takes the computer that much longer than a transition


class MissionClock(VirtualClock):
    """A virtual clock that keeps what the threads it started were ended by.

    Attributes:
        failures: Name of the thread, and what it raised.
    """

    def __init__(
        self,
        seed: int | None = None,
        *,
        rate: float | None = None,
        choose: Callable[[list[str]], int] | None = None,
    ) -> None:
        super().__init__(seed, rate=rate, choose=choose)
        self.failures: list[tuple[str, BaseException]] = []

    def spawn(self, target: Callable[[], object], *, name: str) -> VirtualTask:
        """Start a thread, as a clock does."""

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

    No `Exception`: whatever a mission does about those does not keep it going.
    """


@dataclass(frozen=True, slots=True)
class Trigger:
    """Something to do during the next run.

    Attributes:
        what: Its name, for the reader.
        act: What.
        at: When [s after the start], or None.
        on: When the state at this path begins, or None.
        after: So long after that [s].
        visit: At the how many-th time.
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


class Watch:
    """Sees one run: takes its events down, pulls the triggers, and ends it when no time passes.

    Args:
        clock: The clock.
        machine: The machine.
        record: Its structure.
        triggers: What is to happen.
        steps: Most events at one moment.

    Attributes:
        events: All events, after the run.
        started: When it began [s].
    """

    def __init__(
        self,
        clock: Clock,
        machine: Container,
        record: StateRecord,
        triggers: list[Trigger],
        steps: int,
    ) -> None:
        self._clock = clock
        self._machine = machine
        self._steps = steps
        self._open = list(triggers)
        self._waiting: list[tuple[Trigger, str]] = []
        self._timed: list[tuple[Trigger, float]] = []
        for trigger in triggers:
            path = None if trigger.on is None else find_path(record, trigger.on)
            if path is None:
                self._timed.append((trigger, trigger.at or 0.0))
            elif path == record.path and trigger.visit == 1:  # it begins with the run
                self._timed.append((trigger, trigger.after))
            else:
                self._waiting.append((trigger, path))
        self._timers: list[Timer] = []
        self._visits: dict[str, int] = {record.path: 1}
        self._unsubscribe: Callable[[], object] = _nothing
        self.events: list[Event] = []
        self.started = clock.now()

    @contextlib.contextmanager
    def installed(self) -> Iterator[None]:
        """Watch the run in this block."""
        for trigger, delay in self._timed:
            self._pull(trigger, delay)
        tape = _StepTape(self._machine, self._clock, self._steps)
        if self._waiting:
            self._unsubscribe = self._machine.subscribe(self._on_event)
        try:
            yield
        finally:
            self._unsubscribe()
            tape.close()
            self.events = tape.events()
            for timer in self._timers:
                timer.cancel()

    def unfired(self) -> tuple[str, ...]:
        """Return, after the run, the triggers whose moment never came, and why."""
        ended = f"the run ended after {self._clock.now() - self.started:g} s"
        paths = {id(trigger): path for trigger, path in self._waiting}
        found: list[str] = []
        for trigger in self._open:
            path = paths.get(id(trigger))
            count = 0 if path is None else self._visits.get(path, 0)
            times = "" if path is None else f"{path} began {count} times, and "
            found.append(f"{trigger}: {times}{ended}")
        return tuple(found)

    def _pull(self, trigger: Trigger, delay: float) -> None:
        self._timers.append(self._clock.call_later(delay, partial(self._act, trigger)))

    def _act(self, trigger: Trigger) -> None:
        self._open.remove(trigger)
        trigger.act(self._machine)

    def _on_event(self, event: Event) -> None:
        """Pull triggers; a listener slows the machine down, so it goes with the last of them."""
        if not isinstance(event, Entered):
            return
        count = self._visits[event.path] = self._visits.get(event.path, 0) + 1
        for trigger, path in list(self._waiting):
            if path == event.path and trigger.visit == count:
                self._pull(trigger, trigger.after)
                self._waiting.remove((trigger, path))
        if not self._waiting:
            self._unsubscribe()


class _StepTape(EventTape):
    """A tape that raises in the machine's thread when too much happens at one moment."""

    def __init__(self, machine: Container, clock: Clock, most: int) -> None:
        self._time = clock
        self._moment = clock.now()
        self._begun = 0
        self._size = most * SLOTS
        super().__init__(machine)

    def take(self, event: Event) -> None:
        """Take an event down."""
        super().take(event)
        if type(event) is Entered:  # published by the machine's own thread
            self._look()

    def room(self) -> tuple[Iterator[None], Callable[[tuple[Any, ...]], object]]:
        """Return how often to append before asking again, and what to append with."""
        self._look()
        return super().room()

    def _look(self) -> None:
        now, size = self._time.now(), len(self._entries)
        if now != self._moment:
            self._moment, self._begun = now, size
        elif size - self._begun > self._size:
            raise Stuck


def _nothing() -> None:
    pass
