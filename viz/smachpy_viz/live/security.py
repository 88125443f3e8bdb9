"""Protects the page's server against other web sites and foreign commands.

The server shows a robot's data and can control it, so another web page in the same browser must not
reach it. Every request must name a host of this server, which defeats DNS rebinding; a command must
also come from this page's origin and carry the token of the printed address. Reading needs a token
only with `--token-for-reading`.
"""

from __future__ import annotations

import hashlib
import ipaddress
import secrets
import socket
from typing import TYPE_CHECKING

from starlette.requests import Request

from smachpy_viz.live.answers import RequestError, failure

if TYPE_CHECKING:
    from collections.abc import MutableMapping

    from starlette.types import ASGIApp, Message, Receive, Scope, Send

WRONG_TOKEN = "token: missing or wrong; expected the one in the address that smachpy printed."  # noqa: S105
TOKEN_HEADER = "x-smachpy-token"  # noqa: S105  a header's name


def make_token() -> str:
    """Return a new token."""
    return secrets.token_urlsafe(24)


def policy() -> str:
    """Return the content security policy: nothing from other hosts, no inline code."""
    return (
        "default-src 'none'; script-src 'self'; style-src 'self'; "
        "font-src 'self'; img-src 'self' data: blob:; connect-src 'self'; worker-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


class Guard:
    """Middleware that refuses foreign hosts and adds protective headers.

    Args:
        app: The protected application.
        access: Who may read.
        hosts: Host names of the server; addresses and "localhost" are always allowed.
    """

    def __init__(self, app: ASGIApp, *, access: Access, hosts: tuple[str, ...] = ()) -> None:
        self._app = app
        self._access = access
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
            text = f"host: got {host!r}; expected an address, or one of {sorted(self._hosts)}."
            refusal = failure(text, 421)
            await refusal(scope, receive, send)
            return
        # The page itself has no data; it asks for the token.
        if scope["path"].startswith("/api/") and scope["path"] != "/api/login":
            try:
                self._access.check_reader(Request(scope))
            except RequestError as error:
                refused = failure(str(error), error.status, wants_token=error.wants_token)
                await refused(scope, receive, send)
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


class Access:
    """Who may read what this server shows, and who may command.

    A page sends its token once to `/api/login`, and gets a cookie by which all its requests may
    read: also links, pictures and streams, which cannot send headers. Commands need the token
    itself in a header, which no other page can send.

    Args:
        command_token: The token that commands must carry; None refuses all commands.
        read_token: The token for reading only; None lets everybody read.
    """

    def __init__(self, command_token: str | None = None, read_token: str | None = None) -> None:
        self._command_token = command_token
        self._read_token = read_token

    def check_command(self, request: Request) -> None:
        """Check that a request may command.

        Raises:
            RequestError: it may not.
        """
        if self._command_token is None:
            raise RequestError("this viewer sends no commands. Try: smachpy view --control", 403)
        _check_origin(request)
        # compare_digest takes the same time for every wrong token, so none can be guessed by it.
        if not _is_same(request.headers.get(TOKEN_HEADER, ""), self._command_token):
            raise RequestError(WRONG_TOKEN, 403, wants_token=True)

    def check_reader(self, request: Request) -> None:
        """Check that a request may read.

        Raises:
            RequestError: it may not.
        """
        if self._read_token is None or self.is_known(request):
            return
        given = request.headers.get(TOKEN_HEADER, "")
        if not any(_is_same(given, one) for one in self._tokens()):
            raise RequestError(WRONG_TOKEN, 401, wants_token=True)

    def is_known(self, request: Request) -> bool:
        """Return whether a request comes from a page that has logged in."""
        given = request.cookies.get(_cookie_of(request), "")
        return any(_is_same(given, _sealed(one)) for one in self._tokens())

    def log_in(self, request: Request, token: object) -> str:
        """Return the cookie for a page that knows a token.

        Raises:
            RequestError: it does not, or the request comes from another page.
        """
        _check_origin(request)
        for one in self._tokens():
            if isinstance(token, str) and _is_same(token, one):
                name = _cookie_of(request)
                return f"{name}={_sealed(one)}; HttpOnly; SameSite=Strict; Path=/"
        raise RequestError(WRONG_TOKEN, 403, wants_token=True)

    def _tokens(self) -> list[str]:
        return [one for one in (self._command_token, self._read_token) if one is not None]


def _is_same(given: str, token: str) -> bool:
    return secrets.compare_digest(given.encode("utf-8", "replace"), token.encode())


def _sealed(token: str) -> str:
    """What the cookie has: it shows that the token was known, and is none."""
    return hashlib.sha256(f"smachpy page {token}".encode()).hexdigest()


def _cookie_of(request: Request) -> str:
    # Cookies are shared by all ports of a computer.
    server = request.scope.get("server") or ("", 0)
    return f"smachpy-{server[1]}"


def _check_origin(request: Request) -> None:
    origin = request.headers.get("origin", "")
    if origin != f"{request.url.scheme}://{request.headers.get('host', '')}":
        raise RequestError(f"origin: got {origin!r}; expected this page.", 403)
