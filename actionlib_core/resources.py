"""Who holds a resource, such as the base of a robot, and who waits for it.

A resource has one holder. What runs inside of the holder may hold it too, then in its turn as the
only one inside: so the holders of a resource form a stack, and it is free for a claim if all
of them are around the claim. The holders and claims of a process are in one table for
each clock, as the runs on different virtual clocks have nothing to do with each other.
"""

from __future__ import annotations

import contextlib
import threading
from contextvars import ContextVar
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args
from weakref import WeakKeyDictionary, WeakValueDictionary

from actionlib_core.clock import RealClock

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock, Event

Policy: TypeAlias = Literal["wait", "preempt", "refuse"]
"""What a claim does while another one holds the resource."""

POLICIES: tuple[Policy, ...] = get_args(Policy)


class Claim:
    """The wish to hold a resource.

    Attributes:
        resource: Its full name.
        policy: What to do while it is held.
        around: What makes the claim, and all that is around that, the innermost first; compared by
            identity.
        who: Returns who makes it, for people.
        stop: Asks who makes it to stop, for the claim that is given; it must not block.
        wake: Set when it holds the resource.
        has_asked: With "preempt", it has asked the holder to stop.
        give: Gives the resource back to other processes, from which the claim has it; or None.
    """

    def __init__(
        self,
        resource: str,
        policy: Policy,
        around: tuple[object, ...],
        who: Callable[[], str],
        stop: Callable[[Claim], object],
        wake: Event,
    ) -> None:
        self.resource = resource
        self.policy = policy
        self.around = around
        self.who = who
        self.stop = stop
        self.wake = wake
        self.has_asked = False
        self.give: Callable[[], object] | None = None

    def is_inside(self, other: Claim) -> bool:
        """Return whether the claim is made inside of `other`, or is it."""
        return any(one is other.around[0] for one in self.around)


class Resources:
    """The claims on one clock. Threads: any."""

    def __init__(self) -> None:
        self._holders: dict[str, list[Claim]] = {}  # the innermost last
        self._waiting: dict[str, list[Claim]] = {}  # the next one first
        self._lock = threading.RLock()

    def claim(self, claim: Claim) -> Claim | None:
        """Hold the resource, or else wait for it, unless the claim refuses to.

        With "preempt" it waits in front of all others, and the caller asks the holder to stop.

        Returns:
            The holder that is in the way; None if the claim holds the resource now.

        Raises:
            CircleError: it would wait for what waits for it.
        """
        with self._lock:
            holder = self._in_the_way(claim)
            if holder is None:
                self._holders.setdefault(claim.resource, []).append(claim)
            elif claim.policy == "preempt":
                self._waiting.setdefault(claim.resource, []).insert(0, claim)
            elif claim.policy == "wait":
                circle = self._circle(claim, holder)
                if circle:
                    raise CircleError(claim, circle)
                self._waiting.setdefault(claim.resource, []).append(claim)
            return holder

    def holds(self, claim: Claim) -> bool:
        """Return whether the claim holds its resource."""
        return claim in self._holders.get(claim.resource, ())

    def others(self, claim: Claim) -> list[Claim]:
        """Return the other holders of what a claim holds: all are around it, or inside of it."""
        with self._lock:
            return [one for one in self._holders.get(claim.resource, ()) if one is not claim]

    def release(self, claim: Claim) -> None:
        """Hold the resource no longer, or wait no longer; it may be called again."""
        name = claim.resource
        with self._lock:
            for table in (self._holders, self._waiting):
                claims = table.get(name, [])
                if claim in claims:
                    claims.remove(claim)
            for each in tuple(self._waiting.get(name, ())):
                if self._in_the_way(each) is None:
                    self._holders.setdefault(name, []).append(each)
                    self._waiting[name].remove(each)
            # All of them, as an interruption may have ended the call before this one.
            for each in self._holders.get(name, ()):
                each.wake.set()
            for table in (self._holders, self._waiting):
                if not table.get(name):
                    table.pop(name, None)

    def _in_the_way(self, claim: Claim) -> Claim | None:
        """Return the outermost holder that is not around the claim; the others are inside of it."""
        holders = self._holders.get(claim.resource, ())
        return next((one for one in holders if not claim.is_inside(one)), None)

    def _circle(self, claim: Claim, holder: Claim) -> list[Claim]:
        """Return the claims that wait for each other if `claim` waits for `holder`; [] for none.

        One that preempts is in none before the holder has heard of it. What the holder does after
        that, such as to brake, is not asked again.
        """
        waiting = [one for all_of in self._waiting.values() for one in all_of]
        ways = [[one] for one in self._inside(holder, waiting)]
        seen: set[int] = set()
        while ways:
            way = ways.pop()
            last = self._in_the_way(way[-1])
            if last is None or id(way[-1]) in seen:
                continue
            seen.add(id(way[-1]))
            if claim.is_inside(last):
                return way
            ways += [[*way, one] for one in self._inside(last, waiting)]
        return []

    @staticmethod
    def _inside(holder: Claim, waiting: list[Claim]) -> Iterator[Claim]:
        blocked = (one for one in waiting if one.policy == "wait" or one.has_asked)
        return (one for one in blocked if one.is_inside(holder))


class CircleError(Exception):
    """A claim would wait for what waits for it.

    Attributes:
        claim: The claim.
        circle: The claims that wait, each for a holder that is around the next one.
    """

    def __init__(self, claim: Claim, circle: list[Claim]) -> None:
        self.claim = claim
        self.circle = circle
        waits = [f"{one.who()} waits for {one.resource}" for one in circle]
        super().__init__(
            f"got a wait for {claim.resource} that closes a circle: {', '.join(waits)}; expected "
            "that all take their resources in the same order."
        )


_around: ContextVar[tuple[object, ...]] = ContextVar("around", default=())


@contextlib.contextmanager
def inside(claim: Claim) -> Iterator[None]:
    """Let claims and goals of this block be made inside of a claim that holds its resource."""
    token = _around.set(claim.around)
    try:
        yield
    finally:
        _around.reset(token)


def around_here() -> tuple[object, ...]:
    """Return what is around the code that calls this, the innermost first."""
    return _around.get()


class _Sender:
    """What was around the sender of a goal."""

    __slots__ = ("__weakref__", "around")

    def __init__(self, around: tuple[object, ...]) -> None:
        self.around = around


_senders: WeakValueDictionary[str, _Sender] = WeakValueDictionary()


def note_sender(goal_id: str) -> object:
    """Note what is around the sender of a goal, for as long as the returned object is kept.

    A server in the same process works inside of that: it does not wait for a resource that its
    client holds.
    """
    around = _around.get()
    if not around:
        return None
    sender = _senders[goal_id] = _Sender(around)
    return sender


def around_sender(goal_id: str) -> tuple[object, ...]:
    """Return what was around the sender of a goal; () if it is not of this process."""
    sender = _senders.get(goal_id)
    return () if sender is None else sender.around


_of_real = Resources()
_of_others: WeakKeyDictionary[Clock, Resources] = WeakKeyDictionary()


def resources_on(clock: Clock) -> Resources:
    """Return the claims of the process on a clock; all real clocks have the same."""
    return _of_real if isinstance(clock, RealClock) else _of_others.setdefault(clock, Resources())
