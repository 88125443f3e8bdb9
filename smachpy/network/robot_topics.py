"""Subscribes to the topics of the robots that a mission drives, for viewers and recordings."""

from __future__ import annotations

import logging
import threading
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import SerialExecutor
from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces import get_message
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import WatchingSubscriber
from actionlib_core.transport.tokens import Kind, parse_token, token_pattern
from smachpy.events import record_text
from smachpy.network.observations import NUMBERS, Observer, is_small, role_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Self

    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence
    from actionlib_core.transport.tokens import Endpoint

logger = logging.getLogger("smachpy")

MAX_KEPT_OBSERVATIONS: Final = 20_000
"""Number of records kept for viewers that join late, besides the newest maps."""

MAX_KEPT_BYTES: Final = 8_000_000
"""Limit of their text, and of that of the newest maps [bytes]."""

MAX_TOPICS: Final = 400
"""Maximum number of topics to which it subscribes."""


CLOSE_S: Final = 1.0
_HAVE_NUMBERS: Final = frozenset({"battery", "odometry"})
"""Roles of topics whose numbers are recorded as well: voltage, speed."""


class RobotTopics:
    """Provides data of robots' topics to listeners: poses, scans, plans, maps, ...

    While it has a listener, it subscribes to topics with the types and names of
    `observations.TOPICS` in the node's namespace, to every other topic there whose messages are
    small and have numbers, and to `/map` and `/tf`, over every wire that the node's configuration
    names. A context manager.

    Args:
        node: The node, whose clock is used too; None for the current node.
        scans: Whether scans are among them; a simulated robot makes none for nobody.

    Threads: every method may be called from any thread. Listeners are called in threads of the
        node's clock, one at a time; an exception of a listener goes to `threading.excepthook`.
    """

    def __init__(self, node: Node | None = None, *, scans: bool = True) -> None:
        self._scans = scans
        self._node = get_node() if node is None else node
        self._lock = threading.Lock()
        # Held while listeners are called, so that records keep their order. Re-entrant, because a
        # listener may end its own subscription.
        self._calling = threading.RLock()
        self._executor = SerialExecutor(self._node.clock, "robot topics")
        self._begun_at, self._begun_ns = self._node.clock.now(), self._node.clock.time_ns()
        self._observer = Observer()
        self._listeners: list[Callable[[dict[str, Any]], object]] = []
        self._kept: deque[tuple[dict[str, Any], int]] = deque()
        self._kept_bytes = 0
        self._maps: dict[str, tuple[dict[str, Any], int]] = {}  # by robot, the newest last
        self._maps_bytes = 0
        self._count = 0
        self._watches: list[Closable] = []
        self._topics: dict[
            str, tuple[WatchingSubscriber[Any], set[str]]
        ] = {}  # by name, with its publishers

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def listen(self, listener: Callable[[dict[str, Any]], object]) -> Callable[[], None]:
        """Call `listener` with each record from now on; return a function that ends it.

        Records are numbered from 1 in `n`; see `observations` for their other fields, and `kept`.
        The returned function waits for a running call, at most 1 s, so that whatever the listener
        uses can be closed afterwards.

        Blocks: until the networks of ROS 2 robots are joined; one that cannot be is tried again.
        """
        with self._lock:
            self._listeners.append(listener)
            first = len(self._listeners) == 1
        if first:  # without the lock: joining a network may take a while
            self._begin()
        return partial(self._leave, listener)

    def kept(self) -> list[dict[str, Any]]:
        """Return the newest records and the newest map of each robot, oldest first."""
        with self._lock:
            first = self._kept[0][0]["n"] if self._kept else self._count + 1
            return [
                *(one for one, _ in self._maps.values() if one["n"] < first),
                *(record for record, _ in self._kept),
            ]

    def close(self) -> None:
        """End all subscriptions; may be called twice.

        Blocks: until running calls are done, at most 1 s.
        """
        with self._lock:
            self._listeners.clear()
        self._end()
        self._executor.join(CLOSE_S)
        self._wait_for_calls()

    def _leave(self, listener: Callable[[dict[str, Any]], object]) -> None:
        with self._lock:
            if listener not in self._listeners:
                return
            self._listeners.remove(listener)
            last = not self._listeners
        if last:
            self._end()
        self._wait_for_calls()

    def _wait_for_calls(self) -> None:
        if self._calling.acquire(timeout=CLOSE_S):
            self._calling.release()

    def _begin(self) -> None:
        node = self._node
        watches = [node.transport.watch_alive(token_pattern(Kind.PUBLISHER), self._on_presence)]
        if node.config.ros2:
            from actionlib_core.wire.ros2.ends import watch_ends

            watches += watch_ends(node, self._on_end)
        with self._lock:
            self._watches += watches

    def _end(self) -> None:
        with self._lock:
            watches, self._watches = self._watches, []
            topics, self._topics = self._topics, {}
        for watch in watches:
            watch.close()
        for subscriber, _ in topics.values():
            subscriber.unregister()

    def _on_presence(self, presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is not None:
            self._on_end(end, presence.key, presence.alive)

    def _on_end(self, end: Endpoint, key: str, alive: bool) -> None:
        """Handle a publisher that has appeared or gone; on the network's threads, so no waiting."""
        if end.kind is not Kind.PUBLISHER or self._scope(end) is None:
            return
        self._executor.submit(partial(self._change, end, key, alive=alive))

    def _scope(self, end: Endpoint) -> tuple[str, str] | None:
        """Return the role and the robot of a topic; None if it does not belong to this mission."""
        space = self._node.namespace.strip("/")
        inside = not space or end.name.startswith(f"{space}/")
        if not inside and end.name not in {"map", "tf", "tf_static"}:
            return None
        # The robot is named with the namespace, as the actions in events are.
        found = role_of(end.type, end.name)
        if found is not None and found[0] == "scan" and not self._scans:
            return None
        return found or ((NUMBERS, self._inside(end.name)) if inside else None)

    def _change(self, end: Endpoint, key: str, *, alive: bool) -> None:
        scope = self._scope(end)
        assert scope is not None
        gone: WatchingSubscriber[Any] | None = None
        with self._lock:
            known = self._topics.get(end.name)
            if known is not None:
                known[1].add(key) if alive else known[1].discard(key)
                if not known[1]:
                    gone = self._topics.pop(end.name)[0]
            wanted = known is None and alive and self._listeners and len(self._topics) < MAX_TOPICS
        if gone is not None:
            gone.unregister()
        if not wanted:
            return
        try:
            kind = self._class(end)
            if scope[0] == NUMBERS and not is_small(kind()):
                return
            made = WatchingSubscriber(
                f"/{end.name}",
                kind,
                partial(self._on_message, *scope, self._inside(end.name)),
                queue_size=20,
                node=self._node,
            )
        except ActionlibError as error:
            level = logging.DEBUG if scope[0] == NUMBERS else logging.WARNING
            logger.log(level, "robot topics: %s", error)  # an unknown type, for instance
            return
        # The last listener, or another publisher's event, may have come in between.
        with self._lock:
            spare = made if end.name in self._topics or not self._listeners else None
            if spare is None:
                self._topics[end.name] = made, {key}
        if spare is not None:
            spare.unregister()

    def _class(self, end: Endpoint) -> Any:
        if end.type.count("/") > 1:
            from actionlib_core.wire.ros2.ends import class_of

            return class_of(self._node, end)
        return get_message(end.type)

    def _inside(self, name: str) -> str:
        return name.removeprefix(f"{self._node.namespace.strip('/')}/")

    def _on_message(self, role: str, robot: str, topic: str, message: Any) -> None:
        at = self._node.clock.now()
        # No step of the wall clock changes what is due.
        stamp_ns = self._begun_ns + round((at - self._begun_at) * 1e9)
        with self._calling:
            with self._lock:
                records = self._observer.take(role, robot, message, stamp_ns)
                if role in _HAVE_NUMBERS:
                    records += self._observer.take(NUMBERS, topic, message, stamp_ns)
                for record in records:
                    record["t"] = at
                    self._keep(record)
                listeners = list(self._listeners)
            for record in records:
                for listener in listeners:
                    listener(record)

    def _keep(self, record: dict[str, Any]) -> None:
        self._count += 1
        record["n"] = self._count
        size = len(record_text(record))
        if record["what"] == "map":
            self._forget_map(record["robot"])
            self._maps[record["robot"]] = record, size
            self._maps_bytes += size
            while self._maps_bytes > MAX_KEPT_BYTES and len(self._maps) > 1:
                self._forget_map(next(iter(self._maps)))
        self._kept.append((record, size))
        self._kept_bytes += size
        while len(self._kept) > MAX_KEPT_OBSERVATIONS or self._kept_bytes > MAX_KEPT_BYTES:
            self._kept_bytes -= self._kept.popleft()[1]

    def _forget_map(self, robot: str) -> None:
        _, size = self._maps.pop(robot, (None, 0))
        self._maps_bytes -= size
