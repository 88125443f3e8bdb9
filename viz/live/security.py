"""Protects the page's server against other web sites and foreign commands.

The server shows a robot's data and can control it, so another web page in the same browser must not
reach it. Every request must name a host of this server, which defeats DNS rebinding; a command must
also come from this page's origin and carry the token of the printed address.
"""

from __future__ import annotations

import ipaddress
import secrets
import socket
from typing import TYPE_CHECKING

from starlette.responses import PlainTextResponse

from viz.live.assets import script_hash

if TYPE_CHECKING:
    from collections.abc import MutableMapping

    from starlette.datastructures import Headers
    from starlette.requests import Request
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

WRONG_TOKEN = "token: missing or wrong; expected the one in the address that smachpy printed."  # noqa: S105
TOKEN_HEADER = "x-smachpy-token"  # noqa: S105  a header's name


def make_token() -> str:
    """Return a new token."""
    return secrets.token_urlsafe(24)


def policy() -> str:
    """Return the content security policy: nothing from other hosts, no inline code.

    The only inline script is the import map, which is allowed by its hash.
    """
    return (
        f"default-src 'none'; script-src 'self' {script_hash()}; style-src 'self'; "
        "font-src 'self'; img-src 'self' data: blob:; connect-src 'self'; worker-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


class Guard:
    """Middleware that refuses foreign hosts and adds protective headers.

    Args:
        app: The protected application.
        hosts: Host names of the server; addresses and "localhost" are always allowed.
    """

    def __init__(self, app: ASGIApp, *, hosts: tuple[str, ...] = ()) -> None:
        self._app = app
        self._hosts = {"localhost", socket.gethostname().lower(), *(h.lower() for h in hosts)}
        self._headers = [
            (b"content-security-policy", policy().encode()),
            (b"x-content-type-options", b"nosniff"),
            (b"referrer-policy", b"no-referrer"),
            (b"cross-origin-resource-policy", b"same-origin"),
            (b"cross-origin-opener-policy", b"same-origin"),
            (b"cache-control", b"no-store"),
        ]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        host = dict(scope["headers"]).get(b"host", b"").decode("latin-1")  # as ASGI has headers
        if not self._is_ours(host):
            refusal = PlainTextResponse(
                f"host: got {host!r}; expected an address, or one of {sorted(self._hosts)}.",
                status_code=421,
            )
            await refusal(scope, receive, send)
            return

        async def protected(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._protect(message)
            await send(message)

        await self._app(scope, receive, protected)

    def _protect(self, message: MutableMapping[str, object]) -> None:
        headers = message["headers"]
        assert isinstance(headers, list)
        have = {name for name, _ in headers}
        headers.extend(pair for pair in self._headers if pair[0] not in have)

    def _is_ours(self, host: str) -> bool:
        # "name:port", "1.2.3.4:port", "[::1]:port" or the same without a port.
        name = host.rsplit(":", 1)[0] if not host.endswith("]") else host
        name = name.strip("[]").lower()
        if name in self._hosts:
            return True
        # DNS rebinding needs a name: an address cannot be made to point elsewhere.
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True


def refuse_command(request: Request, token: str | None) -> str | None:
    """Return why a command is refused; None if it is accepted."""
    headers: Headers = request.headers
    if token is None:
        return "this viewer sends no commands. Try: smachpy view --control"
    origin = headers.get("origin", "")
    if origin != f"{request.url.scheme}://{headers.get('host', '')}":
        return f"origin: got {origin!r}; expected this page."
    # compare_digest takes the same time for every wrong token, so none can be guessed by timing.
    if not secrets.compare_digest(headers.get(TOKEN_HEADER, "").encode(), token.encode()):
        return WRONG_TOKEN
    return None
