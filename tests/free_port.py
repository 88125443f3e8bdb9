"""A port for a server of a test: what listens on a fixed one meets that of another run."""

from __future__ import annotations

import itertools
import os
import socket
from pathlib import Path

FIRST = 10_000
_RANGE = Path("/proc/sys/net/ipv4/ip_local_port_range")
_numbers = itertools.count(1000 * os.getpid())  # the workers of a run are processes in a row


def free_port() -> int:
    """Return a port of 127.0.0.1 that nobody listens on, and that the system gives to nobody.

    One that it had given itself, it may give again before the server of the test has it.
    """
    last = int(_RANGE.read_text().split()[0])
    for number in _numbers:
        port = FIRST + number % (last - FIRST)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        return port
    raise AssertionError
