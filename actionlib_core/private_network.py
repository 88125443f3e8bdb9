"""Networks of single programs on one computer, which others do not meet by chance but can find.

A program that brings everything it talks to takes a domain that nobody uses, so that two of them do
not disturb each other. It shows a token in the default domain, by which tools find it:

    @smachpy/network/<user id>/<domain>/<session>
"""

from __future__ import annotations

import contextlib
import os
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
from actionlib_core.wire.presence import LIST_TIMEOUT_S, ROOT

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.transport import Closable, Presence, Transport

FIRST_PRIVATE_DOMAIN: Final = 5000
"""Domains from here to the last one are taken by programs that want one of their own."""


def network_is_chosen() -> bool:
    """Tell whether the environment says which network to join."""
    return any(os.environ.get(name) for name in (ENVIRONMENT_VARIABLE, DOMAIN_VARIABLE))


@contextlib.contextmanager
def private_network() -> Iterator[int]:
    """Give this process and its children a domain that nobody uses, inside the `with` block.

    It is for programs that have not joined a network yet: `SMACHPY_DOMAIN` is set.

    Raises:
        TransportError: no domain is free, or the default one, where the token is shown, cannot be
            joined.
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
    known = word.isascii() and word.isdigit() and int(word) <= LAST_DOMAIN
    return int(word) if known else None


def _prefix() -> str:
    return f"{ROOT}/network/{os.getuid()}"


@contextlib.contextmanager
def _free_domain() -> Iterator[int]:
    """Hold a domain that no other program holds, and in which nobody is."""
    count = LAST_DOMAIN + 1 - FIRST_PRIVATE_DOMAIN
    for i in range(count):
        domain = FIRST_PRIVATE_DOMAIN + (os.getpid() + i) % count
        port = FIRST_PORT + domain
        with _bound("127.0.0.1", port) as mine:  # the others' `mine` fails as long as it is open
            if mine:
                with _bound(DISCOVERY_GROUP, port) as empty:  # zenoh's sockets would be there
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
    """Hold a UDP port; gives False when somebody else has it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as held:
        try:
            held.bind((address, port))
        except OSError:
            yield False
        else:
            yield True
