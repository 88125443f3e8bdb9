"""Serves the page until the program is asked to end."""

from __future__ import annotations

import contextlib
import errno
import socket
import threading
from typing import TYPE_CHECKING, Final

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from actionlib_core import shutdown
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Iterator

    from smachpy_viz.live.app import Viewer

SHUTDOWN_S = 1
"""Longest wait for open requests at the end; uvicorn takes whole seconds."""
REQUEST_S: Final = 10.0
"""Longest time for a request to arrive, head and body [s]."""

MAX_CONNECTIONS: Final = 500
"""Open connections; further ones are closed at once."""

EVERYWHERE = {
    "0.0.0.0": (socket.AF_INET, "192.0.2.1", "127.0.0.1"),  # noqa: S104  the user's choice
    "::": (socket.AF_INET6, "2001:db8::1", "::1"),
}
"""Hosts that mean all addresses of this computer: family, a remote address, the local one."""


class AddressError(SmachError):
    """The page cannot be served at the given address.

    Try: choose another `--host` or `--port`.

    Attributes:
        host: The host.
        port: The port.
    """

    def __init__(self, host: str, port: int, reason: str, *, bad_host: bool = False) -> None:
        self.host = host
        self.port = port
        advice = (
            "expected an address of this computer. Try --host 127.0.0.1, or 0.0.0.0 for others."
            if bad_host
            else "expected a free port. Try --port 0 for any free port."
        )
        super().__init__(f"smachpy view: {host}:{port}: cannot listen: {reason}; {advice}")


def outward_address(host: str) -> str:
    """Return the address under which other computers reach a server that listens on all addresses.

    It is the local address of the route to other networks, or the loopback address without such a
    route. Nothing is sent: connecting a datagram socket only looks up the route. The remote
    addresses are reserved for documentation (RFC 5737 and RFC 3849).

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


class Connection(H11Protocol):
    """A connection of a browser, which must send its requests in time.

    uvicorn waits for ever for the end of a request that has begun.
    """

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for the first request."""
        super().connection_made(transport)
        if len(self.connections) > MAX_CONNECTIONS:
            transport.abort()
        else:
            self._watch()

    def data_received(self, data: bytes) -> None:
        """Handle data; wait for the rest of a request only for so long."""
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Handle the end of the connection."""
        super().connection_lost(exc)
        self._stop()

    def _watch(self) -> None:
        if self.conn.their_state not in {h11.IDLE, h11.SEND_BODY}:
            self._stop()  # the request is complete
        elif self._deadline is None:  # not set again with every byte
            self._deadline = self.loop.call_later(REQUEST_S, self._give_up)

    def _stop(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _give_up(self) -> None:
        self._deadline = None
        self.transport.abort()

    def on_response_complete(self) -> None:
        """Handle the end of a response; between two requests, uvicorn's own deadline holds."""
        super().on_response_complete()
        self._stop()


class PageServer(uvicorn.Server):
    """Serves one `Viewer`.

    Args:
        viewer: The viewer.
        host: The address to listen on.
        port: The port; 0 for any free one.

    Raises:
        AddressError: the address is invalid or in use.
    """

    def __init__(self, viewer: Viewer, host: str, port: int) -> None:
        self._viewer = viewer
        # The socket is opened here and not by uvicorn, which would exit the program on an error and
        # does not tell which port it got.
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        if not host:  # the system takes it for all addresses: an unset variable would open the page
            raise AddressError(host, port, "got no host", bad_host=True)
        try:
            host.encode("idna")  # as binding does, but there a failure leaks a socket
            self._socket = socket.create_server((host, port), family=family)
        except OSError as error:
            # Any other reason is the host: unknown, or another computer's.
            bad_host = error.errno not in {errno.EADDRINUSE, errno.EACCES}
            reason = error.strerror or str(error)
            raise AddressError(host, port, reason, bad_host=bad_host) from error
        except OverflowError as error:  # an invalid port
            raise AddressError(host, port, str(error)) from error
        except UnicodeError as error:  # a host that no name server can look up
            raise AddressError(host, port, str(error), bad_host=True) from error
        self.host = host
        self.port: int = self._socket.getsockname()[1]
        config = uvicorn.Config(
            viewer.app,
            http=Connection,
            log_level="warning",
            access_log=False,
            server_header=False,
            ws="none",
            timeout_graceful_shutdown=SHUTDOWN_S,
        )
        super().__init__(config)

    @property
    def address(self) -> str:
        """The page's URL; if the server listens on all addresses, one that others can open."""
        bound = self._socket.getsockname()[0]  # "0.0.0.0", also if it was written as "0"
        host = outward_address(bound) if bound in EVERYWHERE else self.host
        host = f"[{host}]" if ":" in host and not host.startswith("[") else host
        return f"http://{host}:{self.port}/"

    def serve_here(self) -> str | None:
        """Serve until a signal that ends programs, or `stop`; return the signal's name, or None.

        Blocks: until the server has stopped.
        """
        with shutdown.use_shutdown(shutdown.Shutdown()) as ending:
            self.run(sockets=[self._socket])
        return ending.reason

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Stop on any signal that ends programs; uvicorn knows only two of them."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        with shutdown.handle_signals() as ending:
            forget = ending.on_shutdown(self.stop)
            try:
                yield
            finally:
                forget()

    def stop(self) -> None:
        """End `serve_here`; may be called from any thread."""
        self.should_exit = True

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the event streams first; uvicorn waits for them and they never end by themselves."""
        self._viewer.close()
        await super().shutdown(sockets)
