"""XML-RPC as in ROS 1, with deadlines and limited lengths: calls, and the interface of a node.

Source:
    https://wiki.ros.org/ROS/Master_API and https://wiki.ros.org/ROS/Slave_API.
"""

from __future__ import annotations

import http.client
import xmlrpc.client
from typing import TYPE_CHECKING, Any
from xmlrpc.server import SimpleXMLRPCDispatcher, SimpleXMLRPCRequestHandler

from actionlib_core.exceptions import Ros1Error
from actionlib_core.ros1.answers import read_answer, refusal, split_address
from actionlib_core.ros1.links import TcpListener

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from actionlib_core.clock import Clock

CALL_S = 3.0  # longest silence of a master or node that is called
LARGEST_ANSWER = 16 << 20  # all parameters of a robot
LARGEST_REQUEST = 1 << 20
SILENCE_S = 10.0  # longest silence of a caller
REQUEST_S = 20.0  # longest time for a call to us


class _HttpConnection(http.client.HTTPConnection):
    """Keeps its response, to close it.

    `http.client` hands the socket over to the response when the server announces that it closes the
    connection; closing only the connection would leak it.
    """

    answer: http.client.HTTPResponse | None = None

    def getresponse(self) -> http.client.HTTPResponse:
        self.answer = super().getresponse()
        return self.answer


class _Transport(xmlrpc.client.Transport):
    """The transport of one call: waits `timeout` and reads `LARGEST_ANSWER` at most."""

    accept_gzip_encoding = False  # a small compressed answer could unpack to any size

    def __init__(self, timeout: float) -> None:
        super().__init__(use_builtin_types=True)
        self._timeout = timeout
        self._made: list[_HttpConnection] = []

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        made = _HttpConnection(host, timeout=self._timeout)
        self._made.append(made)
        return made

    def close(self) -> None:
        for made in self._made:
            if made.answer is not None:
                made.answer.close()
            made.close()

    def parse_response(self, response: http.client.HTTPResponse) -> Any:
        raw = response.read(LARGEST_ANSWER + 1)
        if len(raw) > LARGEST_ANSWER:
            raise ValueError(f"got more than {LARGEST_ANSWER} bytes")
        _check_plain(raw)
        parser, unmarshaller = self.getparser()
        parser.feed(raw)
        parser.close()
        return unmarshaller.close()


def _check_plain(data: bytes) -> None:
    """Refuse entities, which XML-RPC does not use and which can expand without end."""
    if b"<!" in data or b"<\x00!" in data:
        raise ValueError("got a document type or entities; expected plain XML")


def call(uri: str, method: str, *args: Any, timeout: float = CALL_S) -> Any:
    """Call a method of a master or node and return the value of its answer.

    Args:
        uri: Its address, "http://robot:11311".
        method: The method's name.
        args: Its arguments; in ROS the first is the caller's name.
        timeout: Longest silence [s].

    Raises:
        Ros1Error: there is no answer, or it is an error or malformed.

    Blocks: `timeout` at most between two parts of the answer.
    """
    split_address(uri, uri, "http")
    proxy = xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout), allow_none=True)
    try:
        with proxy:
            answer = getattr(proxy, method)(*args)
    except xmlrpc.client.Fault as error:
        raise refusal(uri, method, error.faultString) from error
    except TimeoutError as error:
        raise Ros1Error(uri, f"{method}: got no answer within {timeout:g} s.") from error
    except OSError as error:
        raise Ros1Error(uri, f"{method}: cannot be reached: {error.strerror or error}.") from error
    except Exception as error:  # malformed bytes raise many types: of XML, HTTP, Unicode, numbers
        raise Ros1Error(uri, f"{method}: got no XML-RPC answer: {error!s:.200}.") from error
    return read_answer(uri, method, answer)


class _Handler(SimpleXMLRPCRequestHandler):
    rpc_paths = ()  # accepts every path, as nodes use "/" as well as "/RPC2"
    timeout = SILENCE_S

    def do_POST(self) -> None:  # noqa: N802  the library's name
        length = self.headers.get("content-length", "")
        if not (length.isascii() and length.isdigit() and int(length) <= LARGEST_REQUEST):
            self.send_error(413, f"content-length: expected at most {LARGEST_REQUEST}")
            return
        super().do_POST()

    def decode_request_content(self, data: bytes) -> bytes | None:
        plain: bytes | None = super().decode_request_content(data)
        if plain is not None:
            try:
                _check_plain(plain)
            except ValueError as error:
                self.send_error(400, str(error))
                return None
        return plain

    def log_message(self, *_: Any) -> None:
        """Log nothing: the caller gets the error."""


class RpcServer(SimpleXMLRPCDispatcher):
    """Answers the calls of master and nodes.

    Args:
        host: Address to listen at.
        clock: Starts the threads.
        methods: Name -> function; its return value is sent as a success, its exception as a fault.

    Threads: each call has a thread of its own.
    """

    logRequests = False  # noqa: N815  the handler's name for it
    _send_traceback_header = False

    def __init__(self, host: str, clock: Clock, methods: dict[str, Callable[..., Any]]) -> None:
        super().__init__(allow_none=False, encoding="utf-8")
        self._methods = methods
        self._listener = TcpListener(host, clock, "ros1-rpc", self._handle, within=REQUEST_S)
        self.port = self._listener.port

    def _handle(self, sock: socket.socket, peer: str) -> None:
        _Handler(sock, peer, self)  # type: ignore[arg-type]  # this has what it needs of a server

    def _dispatch(self, method: str, params: Any) -> Any:
        function = self._methods.get(method)
        if function is None:
            return [-1, f"unknown method {method:.80}", 0]
        return [1, "", function(*params)]

    def close(self, timeout: float) -> None:
        """Stop answering; blocks `timeout` [s] at most."""
        self._listener.close(timeout)
