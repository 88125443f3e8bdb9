"""The base class of the ends of topics and services, and the watch on the other ends of a name."""

from __future__ import annotations

import contextlib
import logging
import threading
from functools import partial
from typing import TYPE_CHECKING

from actionlib_core.exceptions import TransportError
from actionlib_core.node import get_node
from actionlib_core.shutdown import current_shutdown
from actionlib_core.transport.tokens import Endpoint, Kind
from actionlib_core.wire import looked_for
from actionlib_core.wire.absence import ABSENT_S
from actionlib_core.wire.arrivals import REPORTED
from actionlib_core.wire.end_port import make_end_port
from actionlib_core.wire.presence import find_mismatch

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from typing import Self

    from actionlib_core.clock import Event
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.interfaces import Message, ServiceType
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable
    from actionlib_core.wire.end_port import EndPort

logger = logging.getLogger("actionlib_core")

_ABSENT = {
    Kind.PUBLISHER: ("topic", "publisher"),
    Kind.SUBSCRIBER: ("topic", "subscriber"),
    Kind.SERVICE: ("service", "server"),
}


class NamedEnd:
    """Base class of publisher, subscriber, service and proxy.

    A subclass sets `_ends` and `_forget`, and appends to `_parts` everything that is to be closed
    with it.
    """

    _what: str
    _kind: Kind
    _ends: NameWatch
    _forget: Callable[[], None]

    def __init__(
        self, name: str, interface: type[Message | ServiceType], node: Node | None
    ) -> None:
        self.node = get_node() if node is None else node
        self._full_name = self.node.resolve(name, f"{self._what} name")
        self.type = interface._type
        self.md5sum = interface._md5sum
        self._end = self._make_end(interface)
        self._parts: list[Closable] = []
        self._closed = False

    def _make_end(self, interface: type[Message | ServiceType]) -> EndPort:
        return make_end_port(self.node, self._kind, self._full_name, interface)

    @property
    def resolved_name(self) -> str:
        """The full name without a slash in front, which is the network's key."""
        return self._full_name

    @property
    def mismatches(self) -> list[TypeMismatchError]:
        """The ends of this name that have another type, as errors; each was logged once."""
        return self._ends.mismatches

    def _leave(self) -> None:
        if not self._closed:
            self._closed = True
            self._forget()
            close_all(self._parts)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} /{self._full_name} [{self.type}]>"


def close_all(parts: list[Closable]) -> None:
    """Close the parts, the newest first."""
    for part in reversed(parts):
        part.close()


class NameWatch:
    """Tracks the present ends of a name by their tokens.

    An end with another type than ours is logged as an error, once, and kept in `mismatches`.

    Args:
        node: Our node.
        end: Our own end, which is not counted.
        kinds: The kinds of ends to track.
        any_type: Ends of other types are no error.
        on_new: Called with each end that appears, on the network's thread.

    Threads: every method may be called from any thread; `wait` not from a transport callback.
    """

    def __init__(
        self,
        node: Node,
        end: EndPort,
        kinds: Collection[Kind],
        *,
        any_type: bool = False,
        on_new: Callable[[Endpoint], object] | None = None,
    ) -> None:
        self._node = node
        self._end = end
        self._any_type = any_type
        self._on_new = on_new
        self._lock = threading.Lock()  # guards the next three; not held during callbacks
        self._ends: dict[str, Endpoint] = {}
        self._mismatches: dict[Endpoint, TypeMismatchError] = {}
        self._waiters: list[Event] = []
        self._closed = False
        self._watch: Closable | None = None
        self._forget = node.on_close(self.close)  # first: it raises when the node is closed
        if Kind.SERVICE in kinds:
            looked_for.services.add(end.own.name)
        try:
            self._watch = end.watch(frozenset(kinds), self._on_end)
        except BaseException:
            self._forget()
            raise

    def ends(self, kind: Kind | None = None, *, any_type: bool = False) -> list[Endpoint]:
        """Return the present ends: of `kind` or of all kinds, of our type or of any type."""
        with self._lock:
            ends = list(self._ends.values())
        wanted = self._end.own.type, self._end.own.md5
        return [
            end
            for end in ends
            if kind in {None, end.kind} and (any_type or (end.type, end.md5) == wanted)
        ]

    @property
    def mismatches(self) -> list[TypeMismatchError]:
        """The errors of ends of another type that are present, or have sent to us."""
        with self._lock:
            return list(self._mismatches.values())

    def note(self, error: TypeMismatchError, end: Endpoint) -> None:
        """Store and log the mismatch of `end`, unless it is already known."""
        with self._lock:
            if end in self._mismatches:
                return
            self._mismatches[end] = error
            if len(self._mismatches) > REPORTED:  # a sender can invent ends without end
                del self._mismatches[next(iter(self._mismatches))]
        logger.error("%s %s", self._end.own.kind.value, error)
        self.wake()

    def wait(
        self, condition: Callable[[], bool], timeout: float | None, changed: Event | None = None
    ) -> bool:
        """Wait until `condition` holds; it is checked whenever an end appears or vanishes.

        Args:
            condition: The condition.
            timeout: Longest wait [s]; None: no limit.
            changed: An event that the caller sets when the condition may have changed; it wakes
                this wait only.

        Returns:
            Whether it holds.

        Blocks: until then, `timeout` [s] at most, or until the node closes; without a timeout also
            until shutdown is requested.
        """
        clock = self._node.clock
        deadline = None if timeout is None else clock.now() + timeout
        changed = clock.event() if changed is None else changed
        with self._lock:
            self._waiters.append(changed)
        # Also with a timeout: then the shutdown only lets the condition be checked once more.
        forget = current_shutdown().on_shutdown(changed.set)
        try:
            while not condition():
                left = None if deadline is None else deadline - clock.now()
                over = current_shutdown().requested() if left is None else left <= 0
                if over or self._closed:
                    return False
                changed.wait(left)
                changed.clear()  # before the condition is read: a later change sets it again
            return True
        finally:
            forget()
            with self._lock:
                self._waiters.remove(changed)

    @contextlib.contextmanager
    def telling(self, kind: Kind) -> Iterator[None]:
        """Wait in the block for an end of `kind`; if there is none after `ABSENT_S`, log that.

        The log says where it was looked for and which names there are.
        """

        def look() -> None:
            if not self.ends(kind, any_type=True):
                self._node.clock.spawn(partial(self._log_absence, kind), name="absence")

        timer = self._node.clock.call_later(ABSENT_S, look)
        try:
            yield
        finally:
            timer.cancel()

    def _log_absence(self, kind: Kind) -> None:
        what, nobody = _ABSENT[kind]
        name = self._end.own.name
        with contextlib.suppress(TransportError):  # the session is closed: nobody waits any more
            why = self._end.explain_absence()
            logger.warning("%s '%s': no %s after %g s: %s", what, name, nobody, ABSENT_S, why)

    def wake(self) -> None:
        """Let the waiting threads check their conditions again."""
        with self._lock:
            waiters = list(self._waiters)
        for waiter in waiters:
            waiter.set()

    def close(self) -> None:
        """Stop tracking, and wake the waiting threads."""
        self._closed = True
        self._forget()
        if self._watch is not None:
            self._watch.close()
        self.wake()

    def _on_end(self, key: str, end: Endpoint, alive: bool) -> None:
        if end == self._end.own:
            return
        with self._lock:
            if alive:
                self._ends[key] = end
            else:
                self._ends.pop(key, None)
                self._mismatches.pop(end, None)
        # Without the lock from here on: these call the log, threads that wait, and `on_new`.
        error = self._find_mismatch(end) if alive else None
        if error is not None:
            self.note(error, end)
        else:
            self.wake()
        if alive and self._on_new is not None:
            self._on_new(end)

    def _find_mismatch(self, end: Endpoint) -> TypeMismatchError | None:
        return None if self._any_type else find_mismatch([end], self._end.own)
