"""One suite, several networks: memory on virtual and on real time, and zenoh."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Generic, TypeVar

import pytest

from tests.transports import TRANSPORTS, opened

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.transport import Presence, Sample, Transport

T = TypeVar("T")
DEADLINE_S = 60.0  # peers that missed each other look again after up to 8 s


class Inbox(Generic[T]):
    """A callback that collects, and waits for what it collects."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.items: list[T] = []
        self._changed = clock.event()

    def __call__(self, item: T) -> None:
        self.items.append(item)
        self._changed.set()

    def wait(self, condition: Callable[[list[T]], bool]) -> list[T]:
        deadline = self.clock.now() + DEADLINE_S
        while True:
            self._changed.clear()
            if condition(self.items):
                return self.items
            left = deadline - self.clock.now()
            assert left > 0, f"still only {self.items}"
            self._changed.wait(left)

    def wait_for(self, count: int) -> list[T]:
        return self.wait(lambda items: len(items) >= count)


class Network:
    """Sessions that can reach each other, closed at the end of the test."""

    def __init__(self, clock: Clock, open_session: Callable[[], Transport]) -> None:
        self.clock = clock
        self._open = open_session
        self._sessions: list[Transport] = []
        self._meetings = itertools.count()

    def session(self) -> Transport:
        session = self._open()
        self._sessions.append(session)
        return session

    def inbox(self) -> Inbox:
        return Inbox(self.clock)

    def meet(self, *sessions: Transport) -> None:
        """Wait until each session has all that the others have declared and put so far.

        Both are waited for: Zenoh's declarations overtake messages, and until the declarations are
        there a message goes to everybody, also to who subscribes while it is on its way.
        """
        key = f"@meeting/{next(self._meetings)}"
        tokens: list[Inbox[Presence]] = []
        messages: list[Inbox[Sample]] = []
        handles = []
        for session in sessions:
            tokens.append(self.inbox())
            messages.append(self.inbox())
            handles.append(session.watch_alive(f"{key}/*", tokens[-1]))
            handles.append(session.subscribe(key, messages[-1], history=False))
        for session in sessions:
            handles.append(session.declare_alive(f"{key}/{session.session_id}"))
        for inbox in tokens:
            inbox.wait_for(len(sessions))
        for session in sessions:
            publisher = session.publisher(key)
            handles.append(publisher)
            publisher.put(b"")
        for inbox in messages:
            inbox.wait_for(len(sessions))
        for handle in handles:
            handle.close()

    def close(self) -> None:
        for session in self._sessions:
            session.close()


@pytest.fixture(params=TRANSPORTS)
def network(request: pytest.FixtureRequest) -> Iterator[Network]:
    with opened(request.param, seed=7) as (clock, open_session):
        network = Network(clock, open_session)
        yield network
        network.close()
