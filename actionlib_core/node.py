"""A node: a name on the network and everything a client or server needs to be there.

Programs need not make one: the first client, server, publisher or subscriber makes the default
node, named after the program, and it is closed when the interpreter exits, on every path. `init`
names it; tests use `use_node`.
"""

from __future__ import annotations

import atexit
import contextlib
import itertools
import os
import re
import sys
import threading
from contextvars import ContextVar
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core.clock import RealClock, current_clock
from actionlib_core.clock._ending import ending
from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.config import Config, load_config
from actionlib_core.exceptions import NodeError, TransportError
from actionlib_core.names import check_base_name, clean_namespace, parse_arguments, resolve_name
from actionlib_core.shutdown import current_shutdown
from actionlib_core.wire.presence import Endpoint, Kind, token_key

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterator, Sequence
    from pathlib import Path
    from typing import Self

    from actionlib_core.clock import Clock
    from actionlib_core.names import NameArguments
    from actionlib_core.transport import Closable, Transport

T = TypeVar("T")

CLOSE_S = 0.8  # what is closed with a node waits no longer, all together

_NO_ZENOH = (
    "{what}: the clock is not the real one, so a session on zenoh does not fit; expected one on "
    "the same clock. Try use_node(Node(..., clock=clock, "
    "transport=MemoryNetwork(clock).session()))."
)


class Node:
    """A named participant of the network.

    Args:
        name: One word, the node's base name.
        transport: Its network session, which stays the caller's; None opens one on zenoh, which
            the node closes.
        clock: Time and threads; the current clock when None.
        namespace: What the node's name and its relative names live under, "robot_1" for example.
        arguments: Renaming from a command line (`actionlib_core.names.parse_arguments`).
        config: How that session joins the network; None takes `SMACHPY_CONFIG`. Its `namespace`
            is for the default node only. With a transport of the caller's, only its `ros2` counts,
            and all of those networks are in that transport.

    Raises:
        InvalidNameError: the name or the namespace breaks the ROS rules.
        NodeError: there is no transport, but a clock that zenoh does not run on.
        TransportError: no network session could be opened.

    Threads: every method may be called from any thread.
    """

    def __init__(
        self,
        name: str,
        *,
        transport: Transport | None = None,
        clock: Clock | None = None,
        namespace: str = "",
        arguments: NameArguments | None = None,
        config: Config | None = None,
    ) -> None:
        self.clock = clock if clock is not None else current_clock()
        self.arguments = arguments if arguments is not None else parse_arguments(())
        self.name = check_base_name(self.arguments.node_name(name))
        given = self.arguments.namespace(name)
        self.namespace = clean_namespace(namespace if given is None else given)
        self.full_name = f"{self.namespace}/{self.name}" if self.namespace else self.name
        self._remappings = self.arguments.remappings(
            name, namespace=self.namespace, node=self.full_name
        )
        if transport is None and not isinstance(self.clock, RealClock):
            raise NodeError(_NO_ZENOH.format(what=f"node {self.full_name}"))
        self.owns_transport = transport is None
        if config is None:
            config = load_config() if transport is None else Config()
        self.config = config
        self.transport: Transport = transport if transport is not None else open_zenoh(config)
        self._lock = threading.Lock()  # guards who is to be closed, and whether it is over
        self._entities = itertools.count(1)
        self._shared_lock = (
            threading.RLock()
        )  # held while something is made, of other shared things, too
        self._shared: dict[Hashable, Any] = {}
        self._closers: dict[int, Callable[[], object]] = {}
        self._asks: dict[int, Callable[[], object]] = {}
        self._closed = False
        self._leave_by: float | None = None

    def __repr__(self) -> str:
        state = " closed" if self._closed else ""
        return f"<Node /{self.full_name}{state}>"

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def resolve(self, name: str, kind: str = "name") -> str:
        """Return the full name, remapped, no slash in front; it is the key on the network.

        Args:
            name: Relative, absolute (`/...`) or private (`~...`) name.
            kind: What it names, for the error text: "action name".

        Raises:
            InvalidNameError: the name breaks the ROS rules.
        """
        return resolve_name(
            name,
            namespace=self.namespace,
            node=self.full_name,
            remappings=self._remappings,
            kind=kind,
        )

    def endpoint(self, kind: Kind, name: str, type_name: str, md5: str) -> Endpoint:
        """Return a new end of the full name `name`, not yet shown to anybody."""
        return Endpoint(
            kind,
            name,
            type_name,
            md5,
            self.transport.session_id,
            self.full_name,
            next(self._entities),
        )

    def announce(self, kind: Kind, name: str, type_name: str, md5: str) -> Closable:
        """Show the token of a new end of the full name `name`, until closed.

        Raises:
            TransportError: the session is closed.
        """
        return self.transport.declare_alive(token_key(self.endpoint(kind, name, type_name, md5)))

    def shared(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what was made under `key` on this node, made now when it was not.

        For what many short-lived objects can share; it is theirs to close it with `on_close`.

        Args:
            key: Identifies it.
            make: Makes it, at most once per key and node.
        """
        with self._shared_lock:
            if key not in self._shared:
                self._shared[key] = make()
            made: T = self._shared[key]
            return made

    def on_close(
        self, closer: Callable[[], object], *, ask: Callable[[], object] | None = None
    ) -> Callable[[], None]:
        """Call `closer` when the node closes, the newest first, before the network is left.

        Args:
            closer: Closes its owner; it may wait for as long as `time_to_leave` says.
            ask: Called before, for all owners one after another; it asks what still works to end,
                and does not wait for that. So they all end at the same time.

        Returns:
            Forgets `closer` again; for owners that were closed before.

        Raises:
            NodeError: the node is closed.
        """
        with self._lock:
            if self._closed:
                raise NodeError(
                    f"node {self.full_name}: it is closed. Try making clients and servers before, "
                    "or a new node."
                )
            number = next(self._entities)
            self._closers[number] = closer
            if ask is not None:
                self._asks[number] = ask

        def forget() -> None:
            with self._lock:
                self._closers.pop(number, None)
                self._asks.pop(number, None)

        return forget

    def let_go(self, closer: Callable[[], object]) -> None:
        """Call `closer` soon, in another thread: nobody holds any more what it closes.

        Threads: any, also one that collects garbage, at any moment.
        """

        def close() -> None:
            try:
                closer()
            except TransportError:  # the node was closed meanwhile, and all that is on it
                if not self._closed:
                    raise

        if not self._closed:
            name = f"let go by node {self.full_name}"
            # Not here: the garbage collector runs this amid any code, which may hold any lock.
            self.clock.call_later(0.0, lambda: self.clock.spawn(close, name=name))

    def time_to_leave(self, longest: float) -> float:
        """Return how long what is being closed may wait [s].

        That is `longest`, or what is left of the `CLOSE_S` that all have together when it is closed
        with its node.
        """
        if self._leave_by is None:
            return longest
        return max(0.0, min(longest, self._leave_by - self.clock.now()))

    def close(self) -> None:
        """Close what was made on this node, then leave the network; a second call does nothing.

        Blocks: under a second, however much there is to close.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._leave_by = self.clock.now() + CLOSE_S
            closers, asks = (
                [made[number] for number in sorted(made, reverse=True)]
                for made in (self._closers, self._asks)
            )
            self._closers.clear()
            self._asks.clear()
        # All are asked first, so that their grace runs at the same time; the newest closes first.
        for call in (*asks, *closers):
            try:
                call()
            except Exception:  # noqa: BLE001  a border: reported, the others are closed too
                report_thread_exception()
        if self.owns_transport:
            self.transport.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_zenoh(config: Config) -> Transport:
    """Open a session on zenoh, which is imported only now."""
    from actionlib_core.transport.zenoh import ZenohTransport

    return ZenohTransport(config)


_current: ContextVar[Node | None] = ContextVar("node", default=None)


class _Default:
    """The process's default node, made once.

    The lock is held while the node is made, so that two threads that need it get the same one.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._node: Node | None = None

    def get(self) -> Node:
        with self._lock:
            if not self.exists:
                self._make(f"{_program_name()}_{os.getpid()}", load_config(), sys.argv[1:], None)
            assert self._node is not None
            return self._node

    @property
    def exists(self) -> bool:
        return self._node is not None and not self._node.closed

    def init(self, name: str, config: Config, argv: Sequence[str], namespace: str | None) -> Node:
        with self._lock:
            if self._node is not None and self.exists:
                raise NodeError(
                    f"init: the default node exists already: got {name!r}; expected the first "
                    f"call, as the node is called {self._node.full_name!r}. Try calling init "
                    "before the first client, server, publisher or subscriber is made."
                )
            return self._make(name, config, argv, namespace)

    def _make(self, name: str, config: Config, argv: Sequence[str], namespace: str | None) -> Node:
        node = Node(
            name,
            config=config,
            namespace=config.namespace if namespace is None else namespace,
            arguments=parse_arguments(argv),
            clock=RealClock(),
        )
        self._node = node
        atexit.register(_leave, node, os.getpid())
        return node


def _leave(node: Node, pid: int) -> None:
    """Let those finish who asked for it (`Shutdown.at_exit`), then leave the network.

    Only in the process that made the node: what a forked one ends with is not its own.
    """
    if os.getpid() != pid:
        return
    ending.begin()
    current_shutdown().leave()
    node.close()


_default = _Default()


def has_node() -> bool:
    """Tell whether the process's default node has been made, and so has joined its network."""
    return _default.exists


def init(
    name: str | None = None,
    argv: Sequence[str] | None = None,
    config: Config | str | Path | None = None,
    *,
    namespace: str | None = None,
) -> Node:
    """Make the default node with a name and a configuration of your own; optional.

    Args:
        name: One word; None takes the program's name and process id.
        argv: Arguments with renaming; None takes `sys.argv[1:]`. What is the program's own is in
            `node.arguments.rest` afterwards.
        config: How to join the network, or the file that says it; None takes `SMACHPY_CONFIG`.
        namespace: What relative names live under; None takes the configuration's.

    Raises:
        NodeError: the default node exists already.
        ConfigError: the configuration has errors.
        NameSetupError: a name or an argument is not allowed.
        TransportError: the network cannot be joined.
    """
    return _default.init(
        name or f"{_program_name()}_{os.getpid()}",
        load_config(config),
        sys.argv[1:] if argv is None else argv,
        namespace,
    )


def get_node() -> Node:
    """Return the node in force here: that of `use_node`, else the default one, made when needed.

    Raises:
        NodeError: a clock other than the real one is in use, but no node.
        NameSetupError: the command line renames something in a way that is not allowed.
        TransportError: no network session could be opened.
    """
    node = _current.get()
    if node is not None:
        return node
    if not isinstance(current_clock(), RealClock):
        raise NodeError(_NO_ZENOH.format(what="no node in use"))
    return _default.get()


@contextlib.contextmanager
def use_node(node: Node) -> Iterator[Node]:
    """Make `node` the current one inside the `with` block, also for tasks spawned in it."""
    token = _current.set(node)
    try:
        yield node
    finally:
        _current.reset(token)


def _program_name() -> str:
    """Return a node name from the program's file name."""
    stem = PurePath(sys.argv[0] if sys.argv else "").stem
    name = re.sub(r"[^A-Za-z0-9_]", "_", stem).strip("_")
    return name if name and not name[0].isdigit() else f"python_{name}".rstrip("_")
