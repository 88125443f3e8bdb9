"""Private networks of single programs on one computer, which tools can find.

A program that starts everything that it communicates with takes an unused domain, so that two such
programs do not disturb each other. It declares a token in the default domain, by which tools find
it:

    @smachpy/network/<user id>/<domain>/<session>
"""

from __future__ import annotations

import contextlib
import os
import re
import socket
from typing import TYPE_CHECKING, Final

from actionlib_core.config import (
    DOMAIN_VARIABLE,
    ENVIRONMENT_VARIABLE,
    LAST_DOMAIN,
    Config,
)
from actionlib_core.exceptions import TransportError
from actionlib_core.transport._zenoh_config import DISCOVERY_GROUP, FIRST_PORT
from actionlib_core.transport.tokens import ROOT
from actionlib_core.wire.presence import LIST_TIMEOUT_S

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.transport import Closable, Presence, Transport

FIRST_PRIVATE_DOMAIN: Final = 5000
"""Domains from this one to the last are for private networks."""


def network_is_chosen() -> bool:
    """Return whether the environment determines which network to join."""
    return any(os.environ.get(name) for name in (ENVIRONMENT_VARIABLE, DOMAIN_VARIABLE))


@contextlib.contextmanager
def private_network() -> Iterator[int]:
    """Give this process and its children an unused domain, inside the `with` block.

    It sets `SMACHPY_DOMAIN`, so it has an effect only before the program joins a network.

    Raises:
        TransportError: no domain is free, or the default domain, where the token is declared,
            cannot be joined.
    """
    from actionlib_core.transport.zenoh import ZenohTransport

    with _free_domain() as domain:
        shared = ZenohTransport(Config())
        before = os.environ.get(DOMAIN_VARIABLE)
        try:
            shared.declare_alive(f"{_prefix()}/{domain}/{shared.session_id}")
            os.environ[DOMAIN_VARIABLE] = str(domain)
            yield domain
        finally:
            if before is None:
                os.environ.pop(DOMAIN_VARIABLE, None)
            else:
                os.environ[DOMAIN_VARIABLE] = before
            shared.close()


def watch_private_networks(
    transport: Transport, callback: Callable[[int, bool], object]
) -> Closable:
    """Call `callback(domain, alive)` for the private networks of this user, now and later.

    Args:
        transport: A session in the default domain.
        callback: Called on a thread of the transport.
    """

    def on_presence(presence: Presence) -> None:
        domain = _domain_of(presence.key)
        if domain is not None:
            callback(domain, presence.alive)

    return transport.watch_alive(f"{_prefix()}/*/*", on_presence)


def list_private_networks(transport: Transport) -> list[int]:
    """Return the domains of the private networks of this user, sorted.

    Args:
        transport: A session in the default domain.

    Blocks: until the network has answered, 1 s at most.
    """
    keys = transport.list_alive(f"{_prefix()}/*/*", LIST_TIMEOUT_S)
    return sorted({domain for key in keys if (domain := _domain_of(key)) is not None})


def _domain_of(key: str) -> int | None:
    word = key.split("/")[3]
    known = re.fullmatch(r"[0-9]{1,9}", word) and int(word) <= LAST_DOMAIN
    return int(word) if known else None


def _prefix() -> str:
    return f"{ROOT}/network/{os.getuid()}"


@contextlib.contextmanager
def _free_domain() -> Iterator[int]:
    """Reserve a domain that no other program has reserved, and in which no session is."""
    count = LAST_DOMAIN + 1 - FIRST_PRIVATE_DOMAIN
    for i in range(count):
        # Starting at different domains, programs that start together rarely compete for one.
        domain = FIRST_PRIVATE_DOMAIN + (os.getpid() + i) % count
        port = FIRST_PORT + domain
        # The reservation: as long as this socket is open, others cannot bind it.
        with _bound("127.0.0.1", port) as mine:
            if mine:
                # Fails if a session of Zenoh is in the domain, whose discovery has this socket.
                with _bound(DISCOVERY_GROUP, port) as empty:
                    pass
                if empty:
                    yield domain
                    return
    raise TransportError(
        f"no free domain: all from {FIRST_PRIVATE_DOMAIN} to {LAST_DOMAIN} are in use; expected "
        f"one. Try {DOMAIN_VARIABLE}=N with one that you may share."
    )


@contextlib.contextmanager
def _bound(address: str, port: int) -> Iterator[bool]:
    """Bind a UDP port inside the `with` block; yield False when it is in use."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as held:
        try:
            held.bind((address, port))
        except OSError:
            yield False
        else:
            yield True
