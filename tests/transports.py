"""Every transport, for the suites that must hold on all of them."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import pytest

from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.transport.faulty import FaultyTransport
from actionlib_core.transport.memory import MemoryNetwork

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.transport import Transport

TRANSPORTS = [
    "memory-virtual",
    "memory-seeded",
    "memory-real",
    "faulty",
    pytest.param("zenoh", marks=pytest.mark.zenoh),
]


@contextlib.contextmanager
def opened(
    transport: str, seed: int, make_faulty: Callable[[Transport], Transport] = FaultyTransport
) -> Iterator[tuple[Clock, Callable[[], Transport]]]:
    """Put a clock in force; yield it and what opens sessions that can reach each other.

    Args:
        transport: One of `TRANSPORTS`.
        seed: Of the interleaving, for the seeded one.
        make_faulty: Puts faults around a session, for the faulty one.
    """
    if transport in {"memory-real", "zenoh"}:
        clock: Clock = RealClock()
        with use_clock(clock):
            yield clock, _zenoh if transport == "zenoh" else MemoryNetwork(clock).session
        return
    with VirtualClock(seed if transport == "memory-seeded" else None) as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        if transport == "faulty":
            yield clock, lambda: make_faulty(network.session())
        else:
            yield clock, network.session


def _zenoh() -> Transport:
    from actionlib_core.transport.zenoh import ZenohTransport

    return ZenohTransport()
