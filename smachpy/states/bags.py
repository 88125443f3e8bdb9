"""A state that records topics to a bag."""

from __future__ import annotations

import contextlib
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from actionlib_core.goal.bounded import Backlog
from actionlib_core.interfaces.bags import BagError, BagWriter
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import NotingSubscriber
from smachpy.actions.wakeup import Wakeup, answer_preempt
from smachpy.base import log
from smachpy.base.context import current_path
from smachpy.base.problems import Problems
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Unpack

    from actionlib_core.clock import Clock
    from actionlib_core.time import Duration
    from smachpy.actions.interface import UntimedOptions
    from smachpy.events.introspection import Kind
    from smachpy.userdata.user_data import UserData

MOST_FILES = 10_000  # of one name


class RecordBag(State):
    """Records topics to a bag until it is preempted. Outcomes: 'done', 'aborted', 'preempted'.

    Put it into a concurrence beside the work. A preempt completes the file. If the file exists, the
    next one is `drive-2.mcap`, `drive-3.mcap` and so on: also when the state is visited again, or
    executed again after a kill. The file of a process that was killed has no index; `mcap recover`
    makes one.

    'done': after `seconds`. 'aborted': the file cannot be made or written, with the reason in the
    log.

    Args:
        path: The file, ending in `.mcap`; its folder is made.
        topics: Topic -> class of its messages, of ROS 1 or ROS 2.
        seconds: How long it records [s]; None: until a preempt. Latched messages take a moment to
            arrive: with 0 none does.
        key: The userdata key that gets the path of the file, a text; None: none does.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "monitor"

    def __init__(
        self,
        path: str | Path,
        topics: Mapping[str, Any],
        *,
        seconds: float | Duration | None = None,
        key: str | None = None,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(f"RecordBag {str(path)!r}")
        keys = [] if key is None else [problems.word("key", key)]
        with problems:
            super().__init__(("done", "aborted", "preempted"), (), keys, **options)
        if not isinstance(path, (str, Path)) or Path(path).suffix != ".mcap":
            problems.add(f"path: got {path!r}; expected a file that ends in .mcap.")
        self.__path = path
        self.__topics = problems.mapping("topics", topics, "topic: class of its messages")
        if not self.__topics:
            problems.add(f"topics: got {topics!r}; expected at least one topic.")
        for topic, kind in self.__topics.items():
            problems.network_name("topics", topic)
            problems.kind_of(f"topics: {topic}", kind, "_slot_types", "a class of messages")
        self.__seconds = problems.seconds("seconds", seconds)
        self.__key = key
        problems.raise_all()

    def execute(self, userdata: UserData) -> str:
        """Record.

        Blocks: for `seconds`, or until a preempt.
        """
        if answer_preempt(self):
            return "preempted"
        where = current_path() or type(self).__name__
        try:
            path, writer = _new_bag(Path(self.__path))
            if self.__key is not None:
                userdata[self.__key] = str(path)
            with writer:
                ended = self.__record(writer, where)
        except BagError as error:
            log.logwarn(f"{where}: {error}")
            return "preempted" if answer_preempt(self) else "aborted"
        return ended

    def __record(self, writer: BagWriter, where: str) -> str:
        with Wakeup(self) as wake:
            clock, inlet = wake.clock, _Inlet(wake.clock, wake.set)
            until = None if self.__seconds is None else clock.now() + self.__seconds
            node = get_node()
            with contextlib.ExitStack() as listening:
                for topic, kind in self.__topics.items():
                    take = inlet.taker(topic, kind)
                    listening.enter_context(NotingSubscriber(topic, kind, take, node=node))
                while True:
                    wake.clear()
                    over = until is not None and clock.now() >= until
                    asked = self.preempt_requested()
                    if over or asked:
                        break
                    inlet.write_to(writer)
                    wake.wait_until(until)
            inlet.write_to(writer)
            if inlet.dropped:
                log.logwarn(
                    f"{where}: messages came faster than they were written: {inlet.dropped} of "
                    "them are not in the bag."
                )
            return "preempted" if answer_preempt(self) else "done"

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the file and the topics."""
        kind, details = super().describe_details()
        own = (("file", str(self.__path)), ("topics", ", ".join(self.__topics)))
        return kind, (*own, *details)


class _Inlet:
    """Messages that wait to be written: the network's threads must not wait for a disk."""

    def __init__(self, clock: Clock, changed: Callable[[], None]) -> None:
        self._clock = clock
        self._changed = changed
        self._lock = threading.Lock()  # guards `_waiting`
        self._waiting: Backlog[tuple[str, Any, bytes, int]] = Backlog()

    @property
    def dropped(self) -> int:
        return self._waiting.dropped

    def taker(self, topic: str, kind: Any) -> Callable[[Any], None]:
        """Return the callback for the messages of a topic."""

        def take(message: Any) -> None:
            data = message.to_cdr() if kind._wire == "ros2" else message.to_bytes()
            with self._lock:
                self._waiting.add((topic, kind, data, self._clock.time_ns()), len(data))
            self._changed()

        return take

    def write_to(self, writer: BagWriter) -> None:
        """Write all that wait.

        Raises:
            BagError: the bag cannot be written.
        """
        while True:
            with self._lock:
                found = self._waiting.take()
            if found is None:
                return
            writer.write(*found)


def _new_bag(path: Path) -> tuple[Path, BagWriter]:
    """Make a bag at a path, or at the next one that does not exist.

    Raises:
        BagError: it cannot be made.
    """
    for number in range(1, MOST_FILES):
        one = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        if one.exists():
            continue
        try:
            return one, BagWriter(one)
        except BagError as error:  # maybe somebody else has just made it
            if not (isinstance(error.__cause__, FileExistsError) and one.exists()):
                raise
    raise BagError(path, f"got {MOST_FILES} files of this name; expected fewer.")
