"""A faulty network for tests: it drops, delays, repeats and reorders messages, and cuts the link.

Wrap the session of one side, or of both, to test a protocol. Everything is deterministic: a plan
decides the fate of the n-th message of a key, and the clock delivers late messages.
"""

from __future__ import annotations

import random
import threading
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.clock import current_clock
from actionlib_core.transport._keys import key_matches

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import TypeAlias

    from actionlib_core.clock import Clock, Timer
    from actionlib_core.transport.memory import MemoryTransport

    Fate: TypeAlias = tuple[float, ...]
    Plan: TypeAlias = Callable[[str, int], Fate]

DELIVERED: Fate = (0.0,)
DROPPED: Fate = ()


def deliver_all(key: str, number: int) -> Fate:  # noqa: ARG001  a plan's signature
    """Return the fate of a message on a good network: one copy, at once."""
    return DELIVERED


@dataclass(frozen=True)
class RandomFaults:
    """Chooses fates at random, but reproducibly: by the seed, the key and the message's number.

    Attributes:
        seed: Selects the faults.
        pattern: The keys with faults.
        drop: Share of the messages that are lost, 0 to 1.
        repeat: Share of the others that arrive twice.
        delay: Share of the others that come late, and so out of order.
        longest: Longest delay [s].
    """

    seed: int
    pattern: str = "**"
    drop: float = 0.0
    repeat: float = 0.0
    delay: float = 0.0
    longest: float = 1.0

    def __call__(self, key: str, number: int) -> Fate:
        """Return the fate of the message `number` of `key`."""
        if not key_matches(self.pattern, key):
            return DELIVERED
        # A new generator for each message, so that its fate does not depend on those of other keys.
        dice = random.Random(f"{self.seed} {key} {number}")  # noqa: S311  no secret
        if dice.random() < self.drop:
            return DROPPED
        copies = 2 if dice.random() < self.repeat else 1
        late = dice.random() < self.delay
        return tuple(dice.uniform(0, self.longest) if late or n else 0.0 for n in range(copies))


@dataclass(frozen=True)
class ScriptedFaults:
    """Takes the fates of a key's messages from a list, in order; later messages are delivered.

    Attributes:
        fates: Key pattern -> fates; the first matching pattern counts. A fate has the delay [s] of
            each copy: `()` loses the message, `(0.0,)` delivers it, `(0.0, 0.5)` repeats it.
    """

    fates: Mapping[str, Sequence[Fate]] = field(default_factory=dict)

    def __call__(self, key: str, number: int) -> Fate:
        """Return the fate of the message `number` of `key`."""
        for pattern, fates in self.fates.items():
            if key_matches(pattern, key):
                return fates[number] if number < len(fates) else DELIVERED
        return DELIVERED


class Sent(NamedTuple):
    """The fate of a message, for the report of a failed test.

    Attributes:
        t: When it was sent [s].
        key: Its key.
        number: Its number among the messages of the key, from 0.
        fate: The delays of its copies; empty when it was lost.
    """

    t: float
    key: str
    number: int
    fate: Fate


class FaultyTransport:
    """A session whose messages have the fates of a plan and whose link can be cut.

    While the link is cut, messages in both directions are lost and queries stay unanswered. If that
    lasts longer than the lease, the tokens of this session vanish for the others, and theirs for
    this session. When the link is back, present tokens appear again and latched messages are sent
    once more.

    Args:
        inner: The session that gets the faults; closing this closes it.
        plan: Decides the fates of this session's messages and queries; a query is sent once at
            most.
        clock: Delivers late messages; None: the current clock.
        lease: How long [s] a cut link counts as alive.

    Threads: as the protocol says; `cut` and `restore` from any thread.
    """

    def __init__(
        self,
        inner: MemoryTransport,
        plan: Plan = deliver_all,
        *,
        clock: Clock | None = None,
        lease: float = 10.0,
    ) -> None:
        self.inner = inner
        self.clock = current_clock() if clock is None else clock
        self.plan = plan
        self.lease = lease
        self.sent: list[Sent] = []
        self.is_cut = False
        self.is_dead = False
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()
        self._timers: list[Timer] = []
        # The entries of the inner session check `link` themselves, so its methods are used as is.
        inner.link = self
        self.publisher = inner.publisher
        self.subscribe = inner.subscribe
        self.queryable = inner.queryable
        self.query = inner.query
        self.declare_alive = inner.declare_alive
        self.watch_alive = inner.watch_alive
        self.list_alive = inner.list_alive

    @property
    def session_id(self) -> str:
        """The inner session's id."""
        return self.inner.session_id

    @property
    def rediscovery(self) -> float:
        """That of the inner session."""
        return self.inner.rediscovery

    @property
    def lost_link(self) -> str:
        """All of the network, once the link has been cut for longer than the lease."""
        return "the network" if self.is_dead else ""

    @property
    def is_linked(self) -> bool:
        """Whether other sessions are linked: those of `inner`, unless the link is cut."""
        return self.inner.is_linked and not self.is_dead

    @property
    def link_delay(self) -> float:
        """0: it is known at once."""
        return 0.0

    @property
    def is_local(self) -> bool:
        """Whether the network ends at this computer."""
        return self.inner.is_local

    def close(self) -> None:
        """Close the session."""
        self._cancel_timers()
        self.inner.close()

    def cut(self, seconds: float | None = None) -> None:
        """Cut the link, for `seconds` or until `restore`; no effect when it is cut."""
        with self._lock:
            if self.is_cut:
                return
            self.is_cut = True
            self._timers.append(self.clock.call_later(self.lease, self._die))
            if seconds is not None:
                self._timers.append(self.clock.call_later(seconds, self.restore))

    def restore(self) -> None:
        """Restore the link; no effect when it is not cut."""
        with self.inner.network.lock:
            if not self.is_cut:
                return
            self.is_cut = self.is_dead = False
            for entry in list(self.inner.declared):
                entry.link_back_locked()
        self._cancel_timers()

    def _die(self) -> None:
        with self.inner.network.lock:
            if self.is_cut:
                self.is_dead = True
                for entry in list(self.inner.declared):
                    entry.link_dead_locked()

    def _cancel_timers(self) -> None:
        with self._lock:
            timers, self._timers = self._timers, []
        for timer in timers:
            timer.cancel()

    def choose(self, key: str) -> Fate:
        """Return the fate of the next message on `key`, and record it in `sent`."""
        with self._lock:
            number = self._counts[key]
            self._counts[key] += 1
            fate = DROPPED if self.is_cut else self.plan(key, number)
            self.sent.append(Sent(self.clock.now(), key, number, fate))
        return fate

    def later(self, delay: float, function: Callable[[], object]) -> None:
        """Call `function` after `delay` [s], unless the link is then cut."""

        def call() -> None:
            if not self.is_cut:
                function()

        self.clock.call_later(delay, call)
