"""The conditions, events and variables that a plan's guards ask for.

The value of a name comes from the first of these that exists: a condition registered under the
name, or under its beginning up to a `_`, which is called with the rest; `timeout_ACTION_SECONDS`;
`equal_A_B`; an event; the value of the last `set`; `true`. Other names are false. Source:
PNPActionServer of PetriNetPlans 1.4.
"""

from __future__ import annotations

import contextlib
import math
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from actionlib_core.clock import current_clock
from actionlib_core.inputs.expression import Expression as _Expression
from actionlib_core.inputs.expression import MissingNameError
from smachpy.base import log
from smachpy.base.problems import Problems
from smachpy.exceptions import InvalidUserCodeError, error_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock
    from smachpy.pnp.server import PNPServer

EVENT_LIFE_S: Final = 2.0  # an unread event is dropped then
Events: TypeAlias = Literal["once", "lasting"]
_MAX_EVENTS: Final = 1000  # unread; a topic may post faster than the plan reads


def is_built_in(name: str) -> bool:
    """Return whether a name in a guard has a value without anything being registered for it."""
    return name in {"true", "action_failed"} or name.startswith(("timeout_", "equal_", "equals_"))


@dataclass(frozen=True, slots=True)
class TopicCondition:
    """A condition on the newest message of a topic; false before the first message.

    Attributes:
        topic: Name of the topic.
        msg_type: Class of its messages.
        when: Called with the message, in the thread that runs the plan; true or false.
    """

    topic: str
    msg_type: Any
    when: Callable[[Any], object]


@dataclass(frozen=True, slots=True)
class Polled:
    """A condition that changes without notice, so that it has to be evaluated again and again.

    Attributes:
        function: Called with the plan's userdata; true or false.
        every: Time between two calls while the plan waits for it [s].
    """

    function: Callable[..., object]
    every: float


class Expression(_Expression):
    """A condition on the userdata or a message: "battery.percentage < 0.2 and not charging".

    See `actionlib_core.inputs.expression` for what it may contain. It is false while a key or field
    that it names is not there.

    Args:
        text: The expression.

    Raises:
        ExpressionError: it is none, or contains something that is not allowed; a `ValueError`.
    """

    def __call__(self, values: Any) -> bool:
        """Return whether it is true for userdata or a message.

        Raises:
            ExpressionError: an operation does not fit its values.
        """
        is_message = hasattr(values, "_slot_types")
        try:
            return bool(super().__call__(values if is_message else _Keys(values)))
        except MissingNameError:
            return False


class _Keys(Mapping[str, Any]):
    """Userdata as a mapping."""

    def __init__(self, values: Any) -> None:
        self._values = values

    def __getitem__(self, key: str) -> Any:
        return self._values[key]

    def __contains__(self, key: object) -> bool:
        return key in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values.keys())

    def __len__(self) -> int:
        return len(self._values.keys())


class Knowledge:
    """The values of names in the guards of one plan.

    Args:
        conditions: Name -> function of the userdata (and of the name's parameters), `Expression`,
            `TopicCondition`, `Polled`, or a bool.
        userdata: Returns the plan's userdata.
        events: "once": the first guard that reads an event uses it up, and it is dropped after
            `life`, as in PNP. "lasting": it holds until its opposite is posted.
        life: Time after which an unread event is dropped [s].
        server: Evaluates the names that are not known here; see `PNPServer`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.

    Attributes:
        sources: Name -> the condition registered for it.
        dropped: Events that were dropped because too many were unread.
        changes: The number of changes so far of the value of `kept`.

    Threads: `post`, `set` and `subscribe` from any thread; `value` from the plan's and from those
        of its actions.
    """

    def __init__(
        self,
        conditions: Mapping[str, Any] | None,
        userdata: Callable[[], Any],
        *,
        events: Events = "once",
        life: float = EVENT_LIFE_S,
        server: PNPServer | None = None,
    ) -> None:
        # A server without a service for conditions only executes actions.
        self._server = server if server is not None and server.conditions else None
        problems = Problems("conditions")
        holds = "name -> function, Expression, TopicCondition, Polled, or true or false"
        self.sources = problems.mapping("conditions", conditions, holds)
        for name, source in self.sources.items():
            known = callable(source) or isinstance(source, (TopicCondition, Polled, bool))
            if not (isinstance(name, str) and name and known):
                problems.add(f"got {name!r}: {source!r}; expected {holds}.")
            if isinstance(source, Polled):
                problems.seconds(f"{name}: every", source.every, optional=False)
                if source.every == 0:
                    problems.add(f"{name}: every: got 0; expected more.")
        if events not in {"once", "lasting"}:
            problems.add(f"events: got {events!r}; expected 'once' or 'lasting'.")
        self._life = problems.seconds("event_life", life) or math.inf
        problems.raise_all()
        self._events = events
        self._userdata = userdata
        self.dropped = self.changes = 0
        self._lock = threading.Lock()
        # Unread events: name, and the time [s] from which its life counts, None if not yet known.
        self._posted: deque[tuple[str, float | None]] = deque(maxlen=_MAX_EVENTS)
        self._set: dict[str, bool] = {}
        self._newest: dict[str, Any] = {}  # name of a topic's condition -> its newest message
        # Replaced, never changed: `changed` iterates over it without the lock.
        self._listeners: tuple[Callable[[], object], ...] = ()

    # -- from outside --------------------------------------------------------------------------

    def post(self, event: str, clock: Clock | None = None) -> None:
        """Post an event; "not_NAME" and "!NAME" make NAME false.

        Args:
            event: Its name.
            clock: The clock of the run, if there is one: then the event's life begins now. If None,
                it begins when the plan first evaluates its guards.
        """
        problems = Problems("post")
        event = problems.word("event", event)
        problems.raise_all()
        # The opposite of an event is a value, which holds: it does not end after `life`.
        name = event[1:] if event.startswith("!") else event.removeprefix("not_")
        if not name:
            problems.add(f"event: got {event!r}; expected a name in it.")
            problems.raise_all()
        if name != event:
            self.set(name, value=False)
            return
        if self._events == "lasting":
            self.set(name, value=True)
            return
        with self._lock:
            full = len(self._posted) == _MAX_EVENTS  # then `append` drops the oldest
            oldest = self._posted[0][0] if full else ""
            self.dropped += full
            first = full and self.dropped == 1
            self._posted.append((name, None if clock is None else clock.now()))
            self.changes += 1
        if first:  # logged once; `dropped` has the count
            log.logwarn(
                f"event {name!r}: {_MAX_EVENTS} events wait for a guard: the oldest are dropped, "
                f"{oldest!r} first. Try events='lasting', or post what guards ask for."
            )
        self.changed()

    def set(self, name: str, value: object) -> None:
        """Set a condition, unless one is registered; None deletes it.

        Raises:
            InvalidStateError: `name` is empty or no text, or `value` is a text.
        """
        problems = Problems("set_condition")
        name = problems.word("name", name)
        if isinstance(value, (str, bytes)):  # would be true, also "False" and "0"
            problems.add(f"value: got {value!r}; expected True, False or None.")
        problems.raise_all()
        with self._lock:
            # Unread events of this name are older than this value.
            self._posted = deque(
                (pair for pair in self._posted if pair[0] != name), maxlen=_MAX_EVENTS
            )
            if value is None:
                self._set.pop(name, None)
            else:
                self._set[name] = bool(value)
            self.changes += 1
        self.changed()

    def set_values(self) -> dict[str, bool]:
        """Return the conditions that were set, and their values."""
        with self._lock:
            return dict(self._set)

    def changed(self) -> None:
        """Notify the listeners: a waiting plan evaluates its guards again."""
        for listener in self._listeners:
            listener()

    def subscribe(self, listener: Callable[[], object]) -> Callable[[], None]:
        """Call `listener` at each change, in the thread of the change.

        Returns:
            A function that ends this.
        """
        with self._lock:
            self._listeners = (*self._listeners, listener)

        def forget() -> None:
            with self._lock:
                self._listeners = tuple(one for one in self._listeners if one is not listener)

        return forget

    # -- for a journal -------------------------------------------------------------------------

    def kept(self, clock: Clock) -> tuple[int, dict[str, Any]]:
        """Return the number of changes, and the set values and unread events, as plain JSON.

        `set`: name -> truth; `events`: pairs [name, stamp since the epoch [ns]].
        """
        # Stamps, because the clock of a run in another process begins anew.
        with self._lock:
            now, now_ns = clock.now(), clock.time_ns()
            events = [
                [name, now_ns - int((now - (now if since is None else since)) * 1e9)]
                for name, since in self._posted
            ]
            return self.changes, {"set": dict(self._set), "events": events}

    def restore(self, kept: Mapping[str, Any], shift_ns: int) -> None:
        """Restore the value of `kept` from an earlier process, with stamps `shift_ns` later."""
        clock = current_clock()
        now, now_ns = clock.now(), clock.time_ns()
        with self._lock:
            self._set = dict(kept["set"])
            self._posted.clear()
            self._posted.extend(
                (name, now - (now_ns - at_ns - shift_ns) / 1e9) for name, at_ns in kept["events"]
            )

    @contextlib.contextmanager
    def listening(self) -> Any:
        """Subscribe to the topics of the conditions within the block."""
        topics = {n: s for n, s in self.sources.items() if isinstance(s, TopicCondition)}
        with contextlib.ExitStack() as stack:
            if self._server is not None:
                stack.enter_context(self._server.listening(self.changed))
            if topics:
                from actionlib_core.pubsub.topic import NotingSubscriber

                for name, source in topics.items():
                    self._newest.pop(name, None)  # of an earlier run
                    stack.enter_context(
                        NotingSubscriber(source.topic, source.msg_type, self._noting(name))
                    )
            yield

    def _noting(self, name: str) -> Callable[[Any], None]:
        def note(message: Any) -> None:
            self._newest[name] = message
            self.changed()

        return note

    # -- for guards ----------------------------------------------------------------------------

    def source_of(self, name: str) -> tuple[Any, tuple[str, ...]] | None:
        """Return the condition registered for a name, and the parameters in the name, or None."""
        if name in self.sources:
            return self.sources[name], ()
        parts = name.split("_")
        for count in range(len(parts) - 1, 0, -1):
            source = self.sources.get("_".join(parts[:count]))
            # An expression is callable, too, but takes no parameters.
            if isinstance(source, Polled) or (
                callable(source) and not isinstance(source, Expression)
            ):
                return source, tuple(parts[count:])
        return None

    def asks_server(self, name: str) -> bool:
        """Return whether a robot evaluates a name, unless it was posted or set here."""
        return self._server is not None and not is_built_in(name) and self.source_of(name) is None

    def is_code(self, name: str) -> bool:
        """Return whether the value of a name comes from the user's code or a robot."""
        found = self.source_of(name)
        if found is None:
            return self.asks_server(name)
        return not isinstance(found[0], (bool, Expression))

    def every(self, name: str) -> float | None:
        """Return the time between two evaluations of a name [s]; None if changes are notified."""
        if self._server is not None and self.asks_server(name):
            return self._server.every
        found = self.source_of(name)
        return found[0].every if found is not None and isinstance(found[0], Polled) else None

    def value(self, name: str, path: str, now: float) -> bool:
        """Return the value of a name now; an event is used up.

        Raises:
            InvalidUserCodeError: the condition raised.
        """
        found = self.source_of(name)
        if found is not None:
            try:
                return self._ask(name, *found)
            except Exception as error:
                text = f"{path}: condition {name!r} raised {error_text(error)}"
                raise InvalidUserCodeError(text, path=path) from error
        # Built in, unless a condition of this name is registered.
        if name.startswith(("equal_", "equals_")):
            _, _, rest = name.partition("_")
            one, _, other = rest.partition("_")
            return self.text(one) == self.text(other)
        if self._happened(name, now):
            return True
        if name not in self._set and self._server is not None and self.asks_server(name):
            try:
                return self._server.value(name)
            except Exception as error:
                text = f"{path}: condition {name!r}: {error}"
                raise InvalidUserCodeError(text, path=path) from error
        return self._set.get(name, name == "true")

    def _ask(self, name: str, source: Any, parameters: tuple[str, ...]) -> bool:
        if isinstance(source, bool):
            return source
        if isinstance(source, TopicCondition):
            return name in self._newest and bool(source.when(self._newest[name]))
        function = source.function if isinstance(source, Polled) else source
        return bool(function(self._userdata(), *map(self.text, parameters)))

    def _happened(self, name: str, now: float) -> bool:
        """Use up an event of this name, if there is one, and drop those whose life is over."""
        with self._lock:
            kept: deque[tuple[str, float | None]] = deque(maxlen=_MAX_EVENTS)
            hit = False
            # From the newest on: the newest event of the name is used up. Events without a time
            # were posted before the run, and their life begins now.
            for event, since in reversed(self._posted):
                if since is not None and now - since > self._life:
                    continue
                if event == name and not hit:
                    hit = True
                    continue
                kept.appendleft((event, now if since is None else since))
            self.changes += len(kept) != len(self._posted)
            self._posted = kept
            return hit

    def text(self, parameter: str) -> str:
        """Return a parameter, or the value of the userdata key NAME for "@NAME"."""
        if not parameter.startswith("@"):
            return parameter
        data = self._userdata()
        return str(data[parameter[1:]]) if parameter[1:] in data else parameter
