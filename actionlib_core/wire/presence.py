"""Who is on the network, by the tokens of its ends: found, waited for, compared."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.transport.tokens import Endpoint, Kind, parse_token, token_pattern

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib_core.clock import Clock
    from actionlib_core.node import Node
    from actionlib_core.transport import Transport

LIST_TIMEOUT_S = 1.0  # longest wait for the answers to a query for tokens
SETTLE_S = 0.4  # discovery counts as finished after this time without a new token
FIRST_S = 2.0  # a program that was found, but is busy, may take this long to show its first token
SETTLE_MOST_S = 20.0  # longest wait while tokens keep coming


def with_age(endpoint: Endpoint, node: Node) -> Endpoint:
    """Return `endpoint` with an entity number that contains the time: milliseconds, then its own.

    For names that only one end may have: of two, the older stays. On one computer the time is the
    monotonic one, as the other can be put back; else it is that since the epoch.
    """
    clock = node.clock
    now_ns = round(clock.now() * 1e9) if node.transport.is_local else clock.time_ns()
    entity = now_ns // 1_000_000 * 1_000_000 + endpoint.entity % 1_000_000
    return endpoint._replace(entity=entity)


def is_younger(endpoint: Endpoint, other: Endpoint) -> bool:
    """Return whether `endpoint` started after `other`; both sides come to the same answer."""
    return endpoint.age > other.age


def in_conflict(
    own: Endpoint, other: Endpoint, *, stays: bool = False
) -> tuple[tuple[str, str], tuple[str, str]]:
    """Return (node, session) of the server that stops, then of the one that keeps the name.

    `own` stops; with `stays`, the other one does.
    """
    stops, keeps = (other, own) if stays else (own, other)
    return (stops.node, stops.session), (keeps.node, keeps.session)


def list_endpoints(
    transport: Transport,
    *,
    kind: Kind | None = None,
    name: str = "**",
    timeout: float = LIST_TIMEOUT_S,
) -> list[Endpoint]:
    """Return the ends that have a token now, sorted.

    Blocks: until the network has answered, `timeout` [s] at most.
    """
    # Of one name all kinds are asked for: the transport knows them if they are watched, too.
    keys = transport.list_alive(token_pattern(kind if "*" in name else None, name), timeout)
    found = (parse_token(key) for key in keys)
    return sorted(end for end in found if end is not None and kind in {None, end.kind})


def settle_network(transport: Transport, clock: Clock, quiet: float = SETTLE_S) -> bool:
    """Wait in a new session until no new token has been found for `quiet` [s].

    Returns:
        Whether that was so; False if tokens were still coming at the end of the time.

    Blocks: until then, `SETTLE_MOST_S` at most.
    """
    news = clock.event("the network to be known")
    everything = token_pattern(None, "**")
    watch = transport.watch_alive(everything, lambda _presence: news.set())
    started = clock.now()
    heard = False
    try:
        while clock.now() < started + SETTLE_MOST_S:
            if news.wait(quiet):
                heard = True
                news.clear()
            elif heard:
                return True
            elif not transport.is_linked:  # alone; a busy computer takes its time to find others
                if clock.now() >= started + (FIRST_S if is_busy() else quiet):
                    return True
            elif clock.now() >= started + FIRST_S:
                # Busy programs show nothing for long, but answer: with nothing, if they have none.
                left = started + SETTLE_MOST_S - clock.now()
                if not transport.list_alive(everything, left):
                    return clock.now() < started + SETTLE_MOST_S
                heard = True
        return False
    finally:
        watch.close()


def is_busy() -> bool:
    """Return whether more than two programs wait for each core of this computer."""
    return os.getloadavg()[0] > 2 * (os.cpu_count() or 1)


def find_mismatch(endpoints: Iterable[Endpoint], own: Endpoint) -> TypeMismatchError | None:
    """Return the error of the first end that has another type than `own`, None when all agree."""
    for other in endpoints:
        if (other.type, other.md5) != (own.type, own.md5):
            return TypeMismatchError(
                own.name,
                (own.type, own.md5),
                (other.type, other.md5),
                by=f"{other.kind} in node {other.node!r}",
            )
    return None
