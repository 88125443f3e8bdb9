"""A cable between the bridge and a robot, which a test can cut: every connection goes through it."""

from __future__ import annotations

import contextlib
import os
import selectors
import socket
import threading

from actionlib_core.ros1 import links

_connect = socket.create_connection


class Cable:
    """Relays of TCP connections on this computer.

    Cut, it carries nothing and says so to nobody: what is sent waits, and new connections get no
    answer, as behind a switch whose other port has lost its plug.
    """

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._ports: dict[int, int] = {}  # of a robot's program -> of its relay
        self._pairs: dict[socket.socket, socket.socket] = {}
        self._lock = threading.Lock()
        self._whole = threading.Event()
        self._whole.set()
        self._over = False
        self._woken, self._wake = os.pipe()
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._carry, name="cable")
        self._thread.start()

    def port(self, target: int) -> int:
        """Return the port of the relay to a port; it is made where there is none."""
        with self._lock:
            if target not in self._ports:
                listener = socket.create_server(("127.0.0.1", 0))
                self._ports[target] = listener.getsockname()[1]
                self._selector.register(listener, selectors.EVENT_READ, target)
                os.write(self._wake, b"x")
            return self._ports[target]

    def connect(self, address: tuple[str, int], *args: object, **kwargs: object) -> socket.socket:
        """Connect as `socket.create_connection`, through the cable."""
        return _connect((address[0], self.port(address[1])), *args, **kwargs)

    def cut(self) -> None:
        """Carry nothing from now on."""
        self._whole.clear()
        os.write(self._wake, b"x")

    def mend(self, *, broken: bool) -> None:
        """Carry again what has waited; `broken`: reset the connections that there were."""
        if broken:
            there = list(self._pairs)
            for sock in there:
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            for sock in there:
                self._end(sock)
        self._whole.set()

    def close(self) -> None:
        """End everything."""
        self._over = True
        self._whole.set()
        os.write(self._wake, b"x")
        self._thread.join()
        for key in list(self._selector.get_map().values()):
            if isinstance(key.fileobj, socket.socket):
                key.fileobj.close()
        self._selector.close()
        os.close(self._woken)
        os.close(self._wake)

    def _carry(self) -> None:
        while not self._over:
            self._whole.wait()
            for key, _ in self._selector.select():
                if not self._whole.is_set():
                    break
                if key.fileobj == self._woken:
                    os.read(self._woken, 100)
                elif key.data is not None:
                    self._join(key.fileobj.accept()[0], key.data)
                else:
                    self._pass(key.fileobj)

    def _join(self, near: socket.socket, target: int) -> None:
        try:
            far = _connect(("127.0.0.1", target))
        except OSError:
            near.close()
            return
        for one, other in ((near, far), (far, near)):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._pairs[one] = other
            self._selector.register(one, selectors.EVENT_READ)

    def _pass(self, sock: socket.socket) -> None:
        try:
            data = sock.recv(1 << 16)
            if data:
                self._pairs[sock].sendall(data)
                return
        except (OSError, KeyError):
            pass
        self._end(sock)

    def _end(self, sock: socket.socket) -> None:
        for each in (sock, self._pairs.get(sock)):
            if each is not None and self._pairs.pop(each, None) is not None:
                with contextlib.suppress(KeyError, ValueError):
                    self._selector.unregister(each)
                each.close()


def lay(monkeypatch) -> Cable:
    """Lay a cable between this process and all others on this computer, both ways."""
    cable = Cable()
    listen = links.TcpListener.__init__

    def listen_behind(listener, *args, **kwargs):
        listen(listener, *args, **kwargs)
        listener.port = cable.port(listener.port)

    monkeypatch.setattr(links.TcpListener, "__init__", listen_behind)
    monkeypatch.setattr(socket, "create_connection", cable.connect)
    return cable
