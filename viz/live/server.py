"""Serves the page until the program is to end."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

import uvicorn

from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from viz.live.app import Viewer

GOODBYE_S = 1
EVERYWHERE = {
    "0.0.0.0": (socket.AF_INET, "192.0.2.1", "127.0.0.1"),  # noqa: S104  what a user asked for
    "::": (socket.AF_INET6, "2001:db8::1", "::1"),
}
"""Hosts that mean all of this computer's addresses: family, an address far away, its own."""


class AddressError(SmachError):
    """The page cannot be served at the address asked for.

    Attributes:
        host: The host.
        port: The port.
    """

    def __init__(self, host: str, port: int, reason: str) -> None:
        self.host = host
        self.port = port
        super().__init__(
            f"smachpy view: {host}:{port}: cannot listen: {reason}; expected a free port. "
            "Try --port 0, which takes any."
        )


def outward_address(host: str) -> str:
    """Return this computer's address on the way to other networks, where a server listens to all.

    Nothing is sent: a datagram socket that is connected only looks the way up (the addresses are
    those for documentation, RFC 5737 and RFC 3849). Without a way out it is the computer itself.

    Args:
        host: "0.0.0.0" or "::".
    """
    family, target, alone = EVERYWHERE[host]
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((target, 9))
            found: str = probe.getsockname()[0]
    except OSError:
        return alone
    return found


class PageServer(uvicorn.Server):
    """Serves one `Viewer`.

    Args:
        viewer: What to serve.
        host: Where to listen.
        port: 0 takes any free port.

    Raises:
        AddressError: nobody can listen there.
    """

    def __init__(self, viewer: Viewer, host: str, port: int) -> None:
        self._viewer = viewer
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._socket = socket.create_server((host, port), family=family)
        except OSError as error:
            raise AddressError(host, port, error.strerror or str(error)) from error
        except (OverflowError, UnicodeError) as error:  # a port or a host that is none
            raise AddressError(host, port, str(error)) from error
        self.host = host
        self.port: int = self._socket.getsockname()[1]
        config = uvicorn.Config(
            viewer.app,
            log_level="warning",
            access_log=False,
            server_header=False,
            ws="none",
            timeout_graceful_shutdown=GOODBYE_S,
        )
        super().__init__(config)

    @property
    def address(self) -> str:
        """Return the page's address: one that others can open where it listens everywhere."""
        host = outward_address(self.host) if self.host in EVERYWHERE else self.host
        host = f"[{host}]" if ":" in host and not host.startswith("[") else host
        return f"http://{host}:{self.port}/"

    def serve_here(self) -> None:
        """Serve until SIGINT, SIGTERM or `stop`.

        Blocks: until then.
        """
        self.run(sockets=[self._socket])

    def stop(self) -> None:
        """End `serve_here`; from any thread."""
        self.should_exit = True

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams first, as they would never end by themselves."""
        self._viewer.close()
        await super().shutdown(sockets)
