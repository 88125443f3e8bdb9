"""The event streams of the pages: server-sent events about some machines and the list of all.

    GET /api/events?machine=A&machine=B&last=EPOCH:SEQ&last=EPOCH:SEQ&seen=N&seen=N&actions=1

A stream follows the machines that it names; an empty name is the first machine, to which the stream
then stays. `last` is the newest event that the page has of each, in the same order; so is the id of
a message, with which a browser that reconnects continues. `seen` is the newest
record of robot topics. The messages are `wire.STREAM`.

A slow page never delays a machine: each gets the events that it has not seen when it can take them,
and a page that is too far behind gets a snapshot instead.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import math
import re
import threading
import time
from typing import TYPE_CHECKING, Any, Final, TypeAlias
from urllib.parse import quote, unquote

from starlette.responses import Response
from starlette.routing import Route

from smachpy_viz.live.answers import RequestError
from smachpy_viz.live.kept import with_commas

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterable, Iterator

    from starlette.requests import Request
    from starlette.types import Receive, Scope, Send

    from smachpy_viz.live.actions import Actions
    from smachpy_viz.live.machines import Machine, Machines
    from smachpy_viz.live.security import Access

    Message: TypeAlias = str | Iterator[str]
    """A message as text, or a long one in parts."""

COALESCE_S: Final = 0.004
"""Time to wait for further events before a message, besides that of the link [s]."""

LIST_S: Final = 0.5
"""Shortest time between two messages with the list of machines [s]."""

ACTIONS_S: Final = 0.15
"""Shortest time between two messages about goals sent from here [s]."""

OBSERVED_S: Final = 0.1
"""Shortest time between two messages about the robot [s]."""

BEAT_S: Final = 2.0
"""Longest time between two beats; without them the page considers the server lost [s]."""

SEND_S: Final = 30.0
"""Time in which a page must take a message, or a part of a long one [s]."""

SENT_AT_ONCE: Final = 256_000
"""About the longest part of a message [characters]."""

MAX_LAG_EVENTS: Final = 3_000
"""A page that is more events behind than this gets a snapshot."""

MAX_FOLLOWED_MACHINES: Final = 32
"""Machines that one stream follows; a browser has one stream for all its pages."""

MAX_STRANGERS: Final = 64
"""Streams of pages that have not logged in with a token."""

MAX_STREAMS_PER_ADDRESS: Final = 48
"""Those of one address."""

MAX_STREAMS: Final = 256
"""Streams together: strangers always leave room for pages that have logged in."""

_NUMBER: Final = re.compile(r"-1|[0-9]{1,18}")
_LAST_EVENT: Final = re.compile(r"(.*:[0-9]{1,18})?", re.DOTALL)


class Streams:
    """All open streams; wakes those that follow a machine that has changed.

    Args:
        machines: The machines.
        settings: The first message of each stream.
        actions: The actions on the network; None for none.
        access: Who has logged in.
    """

    def __init__(
        self,
        machines: Machines,
        settings: dict[str, Any],
        actions: Actions | None,
        access: Access,
    ) -> None:
        self._machines = machines
        self._settings = settings
        self._actions = actions
        self._access = access
        self._open: dict[Any, str] = {}  # stream -> its address; "" if its page has logged in
        self._loop: asyncio.AbstractEventLoop | None = None  # while the server runs
        self._lock = threading.Lock()
        self._changed: set[str] = set()  # machines that changed since the last wake-up
        self.routes = [Route("/api/events", self._begin)]
        machines.listen(lambda machine: self._on_change(machine.name))
        if actions is not None:
            actions.listen(lambda: self._on_change(""))

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Wake streams in this event loop until the block ends."""
        self._loop = asyncio.get_running_loop()
        yield
        self._loop = None

    def close(self) -> None:
        """End all streams, which are endless; may be called from any thread."""
        self._call(self._end)

    def _call(self, function: Any) -> None:
        loop = self._loop
        if loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop was closed meanwhile
                loop.call_soon_threadsafe(function)

    def _end(self) -> None:
        for one in self._open:
            one.closed = True
            one.news.set()

    def _on_change(self, name: str) -> None:
        """Note a change, from any thread, and wake the streams; "" is a change of actions."""
        with self._lock:
            pending = bool(self._changed)
            self._changed.add(name)
        if not pending:
            self._call(self._wake)

    def _wake(self) -> None:
        with self._lock:
            changed, self._changed = self._changed, set()
        for one in self._open:
            if one.wants(changed):
                one.news.set()

    async def _begin(self, request: Request) -> Response:
        stranger = self._stranger(request)
        # A browser that reconnects sends the id of the last message: the stream goes on after it.
        query, last_id = request.query_params, request.headers.get("last-event-id", "")
        names = query.getlist("machine")[:MAX_FOLLOWED_MACHINES]
        last = [unquote(word) for word in last_id.split()] or query.getlist("last")
        positions = [_position(word) for word in last] + [("", 0)] * len(names)
        seen = [_number(word) for word in query.getlist("seen")] + [-1] * len(names)
        known = zip(names, positions, seen, strict=False)
        followed = [Followed(name, *at, observed=n) for name, at, n in known]
        actions = self._actions if query.get("actions") == "1" else None
        one = Stream(self._machines, followed, self._settings, actions)
        return EventStream(self._messages(one, stranger))

    def _stranger(self, request: Request) -> str:
        """Return the address of a page that has not logged in, otherwise "".

        Raises:
            RequestError: there are too many streams.
        """
        address = ""
        if not self._access.is_known(request):
            address = request.client.host if request.client else "?"
            strangers = [one for one in self._open.values() if one]
            full = (
                len(strangers) >= MAX_STRANGERS
                or strangers.count(address) >= MAX_STREAMS_PER_ADDRESS
            )
        else:
            full = len(self._open) >= MAX_STREAMS
        if full:
            raise RequestError("pages: got too many open ones; expected fewer. Close one.", 503)
        return address

    async def _messages(self, one: Any, stranger: str) -> AsyncIterator[str]:
        self._open[one] = stranger
        try:
            async for text in one.messages():
                yield text
        finally:
            del self._open[one]


def _position(word: str) -> tuple[str, int]:
    """Read the epoch of a program and the number of an event: "EPOCH:12"."""
    if not _LAST_EVENT.fullmatch(word):
        text = f"last: got {word!r}; expected EPOCH:NUMBER, the id of an event, or nothing."
        raise RequestError(text)
    epoch, _, seq = word.rpartition(":")
    return epoch, int(seq or 0)


def _number(word: str) -> int:
    """Read the number of a record of robot topics; -1 for none."""
    if not _NUMBER.fullmatch(word):
        raise RequestError(f"seen: got {word!r}; expected the number of a record, or -1.")
    return int(word)


class Followed:
    """One machine of a stream, and how far the page has its events and records of robot topics."""

    def __init__(self, name: str, epoch: str, seq: int, observed: int = -1) -> None:
        self.name = name
        self._epoch = epoch
        self._seq = seq
        self._version = -1  # of the machine, when it was last looked at
        self._facts: dict[str, Any] = {}
        self._observed = observed  # number of the newest sent record of robot topics
        self._observed_sent = -math.inf

    @property
    def id(self) -> str:
        """Its part of a message's id."""
        return quote(f"{self._epoch}:{self._seq}", safe="")

    def observed_due(self, machine: Machine, now: float) -> float:
        """Return the time until the next message about its robot [s]."""
        waits = self._observed != machine.observed_seq
        return max(0.0, self._observed_sent + OBSERVED_S - now) if waits else math.inf

    def update(self, machine: Machine, now: float) -> Iterator[Message]:
        """Yield the messages with what is new of the machine."""
        if machine.version != self._version:
            self._version = machine.version
            yield from self._events(machine)
        if self.observed_due(machine, now) <= 0:
            texts = machine.observed_since(self._observed)
            self._observed, self._observed_sent = machine.observed_seq, now
            head = f'event: observed\ndata: {{"name":{json.dumps(machine.name)},"records":['
            yield itertools.chain([head], with_commas(texts), ["]}\n\n"])

    def _events(self, machine: Machine) -> Iterator[Message]:
        # A snapshot for a new page, another program or a page too far behind; else the new events.
        behind = machine.since(self._seq) if machine.epoch == self._epoch else None
        if behind is None or len(behind) > MAX_LAG_EVENTS:
            missed, before = behind is not None, self._seq
            self._epoch = machine.epoch
            self._observed, self._observed_sent = -1, -math.inf
            self._seq, snap = machine.snapshot_parts(short=missed)
            yield itertools.chain(["event: snap\ndata: "], snap, ["\n\n"])
            if missed:
                yield _message("gap", {"name": machine.name, "missed": self._seq - before})
            behind = []
        facts = machine.facts()
        if facts != self._facts:
            self._facts = facts
            yield _message("facts", facts)
        if behind:
            # Not `+= len(behind)`: numbers of dropped events are missing.
            self._seq = json.loads(behind[-1])["seq"]
            head = json.dumps({"name": machine.name, "epoch": self._epoch, "seq": self._seq})
            yield f'event: events\ndata: {head[:-1]},"events":[{",".join(behind)}]}}\n\n'


class Stream:
    """The messages for one browser.

    Args:
        machines: The machines.
        followed: Those that it follows.
        settings: The first message.
        actions: The actions; None if the browser does not want them.
    """

    def __init__(
        self,
        machines: Machines,
        followed: list[Followed],
        settings: dict[str, Any],
        actions: Actions | None,
    ) -> None:
        self.news = asyncio.Event()
        self.closed = False
        self._machines = machines
        self._followed = followed
        self._settings = settings
        self._actions = actions
        self._names = {one.name for one in followed}
        self._listed = -math.inf
        self._list_version = -1
        self._known: set[str] = set()  # machines that the browser has in its list
        self._beaten = -math.inf
        self._actions_revision = -1
        self._actions_sent = -math.inf

    def wants(self, changed: set[str]) -> bool:
        """Return whether it follows one of the changed machines; "" are the actions."""
        return not self._names.isdisjoint(changed)

    async def messages(self) -> AsyncIterator[str]:
        """Yield texts with one or more messages, until the stream is closed."""
        loop = asyncio.get_running_loop()
        yield f"retry: 500\n{_message('settings', self._settings)}"
        while not self.closed:
            # Cleared before looking: a change from now on ends the wait below at once.
            self.news.clear()
            now = loop.time()
            found = [*self._list(now), *self._machine_messages(now), *self._others(now)]
            if found:
                # At the last one: a browser that reconnects between two of them lacks the others.
                ids = " ".join(one.id for one in self._followed)
                for text in _texts([*found[:-1], f"id: {ids}\n", found[-1]]):
                    yield text
            # Wait for a change or until something is due; after a change, a little for others.
            try:
                async with asyncio.timeout(max(self._due(now), COALESCE_S)):
                    await self.news.wait()
            except TimeoutError:
                continue
            await asyncio.sleep(COALESCE_S)

    def _machine_messages(self, now: float) -> Iterator[Message]:
        for one in self._followed:
            machine = self._machines.get(one.name) if one.name else self._machines.first()
            if machine is None or machine.record is None:
                continue
            one.name = machine.name
            yield from one.update(machine, now)
        self._names = {one.name for one in self._followed} | (
            set() if self._actions is None else {""}
        )

    def _list(self, now: float) -> Iterator[str]:
        """The summaries that have changed, and the names of machines that are gone."""
        if now < self._listed + LIST_S:
            return
        self._listed = now
        version, changed, names = self._machines.changed_since(self._list_version)
        gone = sorted(self._known - names)
        first = self._list_version < 0
        self._list_version, self._known = version, names
        if changed or gone or first:
            yield _message("machines", {"machines": changed, "gone": gone})

    def _others(self, now: float) -> Iterator[str]:
        if now >= self._beaten + BEAT_S:
            self._beaten = now
            yield f"event: beat\ndata: {time.time_ns() // 1_000_000}\n\n"
        actions = self._actions
        waits = actions is not None and self._actions_revision != actions.revision
        if actions is not None and waits and now >= self._actions_sent + ACTIONS_S:
            self._actions_revision, self._actions_sent = actions.revision, now
            yield _message("actions", actions.summary())

    def _due(self, now: float) -> float:
        """The longest time until something must be sent without a change [s]."""
        due = min(self._listed + LIST_S, self._beaten + BEAT_S) - now
        if self._actions is not None and self._actions_revision != self._actions.revision:
            due = min(due, self._actions_sent + ACTIONS_S - now)
        for one in self._followed:
            machine = self._machines.get(one.name)
            if machine is not None and machine.record is not None:
                due = min(due, one.observed_due(machine, now))
        return due


class EventStream(Response):
    """A response of server-sent events, until they end or the browser goes or takes none."""

    media_type = "text/event-stream"

    def __init__(self, messages: AsyncIterator[str]) -> None:
        super().__init__()
        del self.headers["content-length"]
        self._texts = messages

    async def __call__(self, _scope: Scope, receive: Receive, send: Send) -> None:
        """Send the messages."""
        start = {"type": "http.response.start", "status": 200, "headers": self.raw_headers}
        await send(start)
        sending = asyncio.ensure_future(self._send(send))
        leaving = asyncio.ensure_future(_left(receive))
        try:
            await asyncio.wait({sending, leaving}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (sending, leaving):
                task.cancel()
            results = await asyncio.gather(sending, leaving, return_exceptions=True)
        for result in results:
            if isinstance(result, Exception) and not isinstance(result, TimeoutError):
                raise result

    async def _send(self, send: Send) -> None:
        async for text in self._texts:
            async with asyncio.timeout(SEND_S):
                body = text.encode("utf-8", "replace")
                await send({"type": "http.response.body", "body": body, "more_body": True})
        await send({"type": "http.response.body", "body": b"", "more_body": False})


async def _left(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass


def _texts(messages: Iterable[Message]) -> Iterator[str]:
    """Yield short messages together, and long ones in parts that are made when they are sent."""
    text = ""
    for one in messages:
        for part in (one,) if isinstance(one, str) else one:
            text += part
            if len(text) > SENT_AT_ONCE:
                yield text
                text = ""
    if text:
        yield text


def _message(name: str, data: Any) -> str:
    return f"event: {name}\ndata: {json.dumps(data)}\n\n"
