"""TCP connections of a ROS 1 node: one object each, with a limited buffer for sending.

Each connection has a thread that reads until the other side closes it, even if only the other
direction carries messages: this is how the death of a process is noticed.
"""

from __future__ import annotations

import contextlib
import fcntl
import logging
import select
import socket
import termios
import threading
from collections import deque
from typing import TYPE_CHECKING

from actionlib_core.exceptions import Ros1Error
from actionlib_core.ros1.frames import (
    LARGEST_HEADER,
    LARGEST_MESSAGE,
    LENGTH,
    Header,
    pack_frame,
    pack_header,
    read_length,
    unpack_header,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from typing import Self

    from actionlib_core.clock import Clock, Task

log = logging.getLogger("actionlib_core")

CONNECT_S = 3.0  # longest wait for a connection
HEADER_S = 5.0  # longest silence before the end of the other side's connection header
WHOLE_HEADER_S = 10.0  # longest time for the whole header
BUFFER = 16 << 20  # unsent bytes for one subscriber; beyond, the oldest messages are dropped
FULL_S = 0.1  # pause when the system has no file descriptor for another connection
MAX_CONNECTIONS = 1000  # limited, as each has a thread
MAX_SKIPPED = 100
READ_SIZE = 1 << 16
LARGEST_READ = 1 << 20  # limit for one system call, so that a wrong length allocates no more
# A peer whose computer is gone is noticed after 11 s: 5 s of silence, then three probes 2 s apart.
_KEEPALIVE = ((socket.TCP_KEEPIDLE, 5), (socket.TCP_KEEPINTVL, 2), (socket.TCP_KEEPCNT, 3))
# The same limit for sent data without an acknowledgement, during which no probes are sent.
_GONE_MS = 11_000


class Budget:
    """The bytes that may be received at the same time, by all connections of a node.

    Threads: every method may be called from any thread.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._taken = 0
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def take(self, size: int, peer: str) -> Iterator[None]:
        """Take `size` bytes during the block.

        Raises:
            Ros1Error: there are not so many left.
        """
        with self._lock:
            if self._taken + size > self._most:
                text = f"message: got {size} bytes; expected fewer beside {self._taken} of others."
                raise Ros1Error(peer, text)
            self._taken += size
        try:
            yield
        finally:
            with self._lock:
                self._taken -= size


class Connection:
    """One TCP connection to another node.

    Args:
        sock: The connected socket; this object closes it.
        peer: The other side, for error texts.
        clock: Starts the thread that sends messages which do not fit into the system's buffer.
        budget: What all connections of the node may receive at once.

    Attributes:
        peer: See above; later the node's name.
        dropped: Number of messages that were dropped because the other side reads too slowly.

    Threads: `put` and `close` may be called from any thread and never wait; one thread reads, and
        calls `release` at the end.
    """

    def __init__(self, sock: socket.socket, peer: str, clock: Clock, budget: Budget) -> None:
        self.peer = peer
        self._budget = budget
        self.dropped = 0
        self._sock = sock
        self._clock = clock
        self._lock = threading.Lock()
        self._waiting: deque[bytes] = deque()
        self._size = 0
        self._sender: Task | None = None
        self._closed = False
        sock.settimeout(HEADER_S)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # small messages leave at once
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in _KEEPALIVE:
            sock.setsockopt(socket.IPPROTO_TCP, option, value)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _GONE_MS)
        self._poll = select.poll()
        self._poll.register(sock, select.POLLIN)
        self._limit: float | None = HEADER_S
        self._buffer = bytearray()
        self._received = 0  # bytes, in total
        self._taken = 0  # of these, the bytes of messages that the reading thread has handled
        self._waits = clock.event(f"the end of what {peer} has sent")

    @classmethod
    def open(cls, host: str, port: int, peer: str, clock: Clock, budget: Budget) -> Self:
        """Connect.

        Raises:
            Ros1Error: nobody answers there, or the host's name is not known here.

        Blocks: `CONNECT_S` at most, and while the system looks up the host's name.
        """
        try:
            return cls(socket.create_connection((host, port), CONNECT_S), peer, clock, budget)
        except socket.gaierror as error:
            raise Ros1Error(
                peer,
                f"host: got {host!r}, which is not known here ({error.strerror}); expected a name "
                "or address that is. Try a line for it in /etc/hosts, or ROS_IP on the robot.",
            ) from error
        except OSError as error:
            raise Ros1Error(
                peer, f"cannot connect to {host}:{port}: {error.strerror or error}."
            ) from error

    # -- reading -------------------------------------------------------------------------------

    def read_header(self) -> Header:
        """Return the other side's connection header.

        Raises:
            Ros1Error: none arrived, or it is malformed, or it contains an error.

        Blocks: `HEADER_S` at most between two parts of it, and `WHOLE_HEADER_S` together.
        """
        timer = self._clock.call_later(WHOLE_HEADER_S, self.close)
        try:
            raw = self.read_frame(LARGEST_HEADER)
        finally:
            timer.cancel()
        if raw is None:
            raise Ros1Error(self.peer, "connection header: got none; expected one.")
        try:
            header = unpack_header(raw)
        except ValueError as error:
            raise Ros1Error(self.peer, f"connection header: {error}.") from error
        if "error" in header:
            raise Ros1Error(self.peer, f"refuses the connection: {header['error']:.500}")
        self.limit(None)
        return header

    def limit(self, seconds: float | None) -> None:
        """Give up reading and sending after so long [s]; None: wait for the other side's end."""
        self._limit = seconds
        self._sock.settimeout(seconds)

    def read_frame(self, limit: int = LARGEST_MESSAGE) -> bytes | None:
        """Return the next message; None when the connection has ended.

        Raises:
            Ros1Error: the other side announces more than `limit` bytes, or is too slow.

        Blocks: until there is one, or the other side closes; see `limit`.
        """
        raw = self.read(LENGTH.size)
        if raw is None:
            return None
        try:
            length = read_length(raw, limit)
        except ValueError as error:
            raise Ros1Error(self.peer, f"message {error}.") from error
        with self._budget.take(length, self.peer):
            return self.read(length)

    def read_latest(self, within: float) -> bytes | None:
        """Return the last of the messages that arrive within this time [s]; see `read_frame`.

        At most `MAX_SKIPPED` are skipped, in case the peer sends without a pause.
        """
        payload = self.read_frame()
        if payload is not None:
            self._clock.sleep(within)
            for _ in range(MAX_SKIPPED):
                if not (self._buffer or self._poll.poll(0)) or (later := self.read_frame()) is None:
                    break
                payload = later
        return payload

    def read(self, size: int) -> bytes | None:
        """Return `size` bytes; None when the connection has ended; as `read_frame`."""
        while len(self._buffer) < size:
            missing = size - len(self._buffer)
            part = self._receive(min(max(missing, READ_SIZE), LARGEST_READ))
            if not part:
                return None
            self._buffer += part
        raw = bytes(self._buffer[:size])
        del self._buffer[:size]
        return raw

    def _receive(self, most: int) -> bytes:
        """Return the bytes that have arrived, at least one; b"" at the end."""
        # The reading thread asks for more bytes when it has handled all messages before.
        self._taken = self._received - len(self._buffer)
        self._waits.set()
        try:
            if not self._poll.poll(None if self._limit is None else self._limit * 1000):
                raise Ros1Error(self.peer, f"silent for {self._limit:g} s; expected an answer.")
            # With the lock, so that `wait_idle` counts these bytes once: as received or as waiting
            # in the system's buffer.
            with self._lock:
                part = self._sock.recv(most, socket.MSG_DONTWAIT)
                self._received += len(part)
        except BlockingIOError:  # poll may report data that the system then discards
            return self._receive(most)
        except OSError:  # reset by the other side
            return b""
        return part

    def wait_idle(self, timeout: float) -> None:
        """Wait until the reading thread has handled everything that has arrived so far.

        Blocks: `timeout` [s] at most.
        """
        deadline = self._clock.now() + timeout
        try:
            with self._lock:
                # FIONREAD: the number of bytes in the system's buffer.
                there = fcntl.ioctl(self._sock, termios.FIONREAD, bytes(LENGTH.size))
                arrived = self._received + int(LENGTH.unpack(there)[0])
        except (OSError, ValueError):  # the connection has ended
            return
        while self._taken < arrived and (left := deadline - self._clock.now()) > 0:
            self._waits.wait(left)
            self._waits.clear()

    # -- sending -------------------------------------------------------------------------------

    def send_header(self, fields: Mapping[str, str]) -> None:
        """Send a connection header; raises and blocks as `send`."""
        self.send(pack_header(fields))

    def send(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            Ros1Error: the connection has ended, or the other side does not read.

        Blocks: while the other side's buffer is full; see `limit`.
        """
        try:
            self._sock.sendall(data)
        except OSError as error:
            raise Ros1Error(self.peer, f"cannot send: {error.strerror or error}.") from error

    def put(self, payload: bytes) -> None:
        """Send a message now, or in another thread when the buffer is full; never waits.

        Beyond `BUFFER` unsent bytes, the oldest messages are dropped.
        """
        data = pack_frame(payload)
        with self._lock:
            if self._closed:
                return
            # Usually the message fits into the system's buffer and no thread is needed. While the
            # sending thread exists, everything goes through the queue: the order is kept.
            if self._sender is None:
                try:
                    sent = self._sock.send(data, socket.MSG_DONTWAIT)
                except BlockingIOError:
                    sent = 0
                except OSError:  # the reading thread handles the end of the connection
                    return
                if sent == len(data):
                    return
                rest = data[sent:]
                try:
                    self._sender = self._clock.spawn(lambda: self._send(rest), name="ros1-send")
                except RuntimeError as error:  # no thread: the next message would be read as a rest
                    log.warning("%s: %s: its connection ends", self.peer, error)
                    self._end()
                return
            self._waiting.append(data)
            self._size += len(data)
            while self._size > BUFFER and len(self._waiting) > 1:
                self._size -= len(self._waiting.popleft())
                self.dropped += 1
                if self.dropped == 1:
                    log.warning("%s: reads too slowly: messages for it are dropped", self.peer)

    def _send(self, data: bytes) -> None:
        """Send the rest of a message, then those that were queued meanwhile."""
        while True:
            try:
                self._sock.sendall(data)
            except OSError:  # the reading thread handles the end of the connection
                return
            with self._lock:
                if not self._waiting:
                    self._sender = None
                    return
                data = self._waiting.popleft()
                self._size -= len(data)

    # -- the end -------------------------------------------------------------------------------

    def close(self) -> None:
        """End the connection: calls that wait on it return."""
        with self._lock:
            self._end()

    def _end(self) -> None:
        """End the connection. Needs the lock."""
        self._closed = True
        # Not `close`: that would not wake a thread that waits on the socket, and the system could
        # give its number to another file.
        with contextlib.suppress(OSError):
            self._sock.shutdown(socket.SHUT_RDWR)

    def release(self) -> None:
        """End the connection and free its socket; for the reading thread."""
        self.close()
        sender = self._sender
        if sender is not None:
            sender.join(HEADER_S)
        self._sock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


class TcpListener:
    """Accepts connections at a free port and handles each in its own thread.

    Args:
        host: Address to listen at; "": all addresses of this computer.
        clock: Starts the threads.
        name: Name of the threads.
        handle: Gets each socket and the other side's address; afterwards the socket is closed.
        within: Longest time for handling one socket [s]; None: no limit.

    Attributes:
        port: The port.
    """

    def __init__(
        self,
        host: str,
        clock: Clock,
        name: str,
        handle: Callable[[socket.socket, str], object],
        *,
        within: float | None = None,
    ) -> None:
        self._within = within
        self._clock = clock
        self._name = name
        self._handle = handle
        self._lock = threading.Lock()
        self._open: set[socket.socket] = set()
        self._closed = False
        self._sock = socket.create_server((host, 0), backlog=100)
        self.port: int = self._sock.getsockname()[1]
        self._task = clock.spawn(self._accept, name=name)

    def _accept(self) -> None:
        while not self._is_closed():
            try:
                sock, address = self._sock.accept()
            except OSError:
                if not self._is_closed():  # no file descriptor is free; wait for one
                    self._clock.sleep(FULL_S)
                continue
            with self._lock:
                full = len(self._open) >= MAX_CONNECTIONS
                if not full:
                    self._open.add(sock)
            if full:
                log.error(
                    "%s: %s: refused, as there are %d others", self._name, address, MAX_CONNECTIONS
                )
                sock.close()
                continue
            if self._is_closed():  # `close` may have missed this one
                sock.shutdown(socket.SHUT_RDWR)
            try:
                self._clock.spawn(lambda s=sock, a=address: self._run(s, a), name=self._name)  # type: ignore[misc]  # mypy: lambda defaults
            except RuntimeError as error:  # no thread can be started: that ends one link, not all
                log.warning("%s: %s: refused: %s", self._name, address, error)
                self._release(sock)

    def _run(self, sock: socket.socket, address: tuple[str, int]) -> None:
        timer = None
        if self._within is not None:
            timer = self._clock.call_later(self._within, lambda: _shut(sock))
        try:
            self._handle(sock, f"{address[0]}:{address[1]}")
        except OSError as error:
            log.debug("%s: %s", address, error)
        finally:
            if timer is not None:
                timer.cancel()
            self._release(sock)

    def _release(self, sock: socket.socket) -> None:
        with self._lock:
            self._open.discard(sock)
        sock.close()

    def _is_closed(self) -> bool:
        return self._closed

    def close(self, timeout: float) -> None:
        """Accept no more connections and end the open ones.

        Blocks: until the accepting thread has ended, `timeout` [s] at most.
        """
        self._closed = True
        with self._lock:
            there = list(self._open)
        for sock in (self._sock, *there):
            _shut(sock)
        self._task.join(timeout)
        self._sock.close()


def _shut(sock: socket.socket) -> None:
    """End a connection: calls that wait on its socket return."""
    with contextlib.suppress(OSError):
        sock.shutdown(socket.SHUT_RDWR)
