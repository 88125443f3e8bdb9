"""A node: a program's name on the network, with its session, clock and name resolution.

Programs need not make one: the first client, server, publisher or subscriber makes the default
node, named after the program, which is closed when the interpreter exits. `init` sets its name;
tests use `use_node`.
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

from actionlib_core.clock import RealClock, current_clock, wall_time
from actionlib_core.clock._ending import ending
from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.config import Config, load_config
from actionlib_core.exceptions import NodeError, TransportError
from actionlib_core.names import check_base_name, clean_namespace, parse_arguments, resolve_name
from actionlib_core.shutdown import current_shutdown
from actionlib_core.transport.tokens import Endpoint, Kind, token_key

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterator, Sequence
    from pathlib import Path
    from typing import Self

    from actionlib_core.clock import Clock
    from actionlib_core.names import NameArguments
    from actionlib_core.transport import Closable, Transport

T = TypeVar("T")

BRIEF_S = 3.0  # a program that ends sooner after it has joined the network has waited for nobody
CLOSE_S = 0.8  # total time for closing everything on a node

_NO_ZENOH = (
    "{what}: the clock is not the real one, so a session on zenoh does not fit; expected one on "
    "the same clock. Try use_node(Node(..., clock=clock, "
    "transport=MemoryNetwork(clock).session()))."
)


class _Shared:
    """An object that `Node.shared` makes on first use, with a lock of its own.

    So one that takes long to make, as its network cannot be reached, holds up no other one.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()  # a signal handler may ask for an object that is being made
        self.made: list[Any] = []


class Node:
    """A named participant of the network.

    Args:
        name: One word, the node's base name.
        transport: Its network session, which the caller closes; None: the node opens a Zenoh
            session, and closes it.
        clock: Its clock; None: the current clock.
        namespace: Prefix of the node's name and of its relative names, "robot_1" for example.
        arguments: Remapping from a command line (`actionlib_core.names.parse_arguments`).
        config: How the session joins the network; None: by `SMACHPY_CONFIG`. Its `namespace` is
            used by the default node only. With a `transport`, only its `ros2` is used, and all of
            those networks are in that transport.

    Raises:
        InvalidNameError: the name or the namespace breaks the ROS rules.
        NodeError: there is no transport, and the clock is not the real one, which Zenoh needs.
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
        wall_time(self.clock).check()  # from now on, steps of its wall time are reported
        self.arguments = arguments if arguments is not None else parse_arguments(())
        self._set_name(name, namespace)
        if transport is None and not isinstance(self.clock, RealClock):
            raise NodeError(_NO_ZENOH.format(what=f"node {self.full_name}"))
        self.owns_transport = transport is None
        # The environment's configuration is not applied to a session of the caller's.
        if config is None:
            config = load_config() if transport is None else Config()
        self.config = config
        self.transport: Transport = transport if transport is not None else open_zenoh(config)
        self._lock = threading.Lock()  # guards `_closers`, `_asks` and `_closed`
        self._entities = itertools.count(1)
        self._shared: dict[Hashable, _Shared] = {}
        self._unused: dict[int, str] = {}  # what it offers and nobody has used
        self._made_at = self.clock.now()
        self._closers: dict[int, Callable[[], object]] = {}
        self._asks: dict[int, Callable[[], object]] = {}
        self._closed = False
        self._leave_by: float | None = None

    def _set_name(self, name: str, namespace: str) -> None:
        self.name = check_base_name(self.arguments.node_name(name))
        given = self.arguments.namespace(name)
        self.namespace = clean_namespace(namespace if given is None else given)
        self.full_name = f"{self.namespace}/{self.name}" if self.namespace else self.name
        self._remappings = self.arguments.remappings(
            name, namespace=self.namespace, node=self.full_name
        )

    def rename(self, name: str, *, namespace: str | None = None) -> None:
        """Give the node a name when the program says it only after something has used the network.

        What was made before stays announced under the old name; private names and remappings follow
        the new one from now on.

        Args:
            name: As for a new node; a name on the command line still wins.
            namespace: As for a new node; None: it stays.

        Raises:
            InvalidNameError: the name breaks the ROS rules.
        """
        self._set_name(name, self.namespace if namespace is None else namespace)

    def __repr__(self) -> str:
        state = " closed" if self._closed else ""
        return f"<Node /{self.full_name}{state}>"

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def resolve(self, name: str, kind: str = "name") -> str:
        """Return the remapped full name without a leading slash, which is the network's key.

        Args:
            name: Relative, absolute (`/...`) or private (`~...`) name.
            kind: The kind of name, for the error text: "action name".

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
        """Return a new end of the full name `name`, which is not yet announced."""
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
        """Declare the token of a new end of the full name `name`, until it is closed.

        Raises:
            TransportError: the session is closed.
        """
        return self.transport.declare_alive(token_key(self.endpoint(kind, name, type_name, md5)))

    def shared(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return the object with this key, which is made on first use.

        For objects that many short-lived ones share. The node does not close it, so `make` is to
        register it with `on_close` if necessary.

        Args:
            key: Identifies the object.
            make: Makes it, at most once per key and node.
        """
        shared = self._shared.get(key) or self._shared.setdefault(key, _Shared())
        with shared.lock:
            if not shared.made:
                shared.made.append(make())
            made: T = shared.made[0]
            return made

    def unshare(self, key: Hashable, made: object) -> None:
        """Forget a shared object, which is closed; the next `shared` makes another one."""
        shared = self._shared.get(key)
        if shared is not None and shared.made and shared.made[0] is made:
            self._shared.pop(key, None)

    def on_close(
        self, closer: Callable[[], object], *, ask: Callable[[], object] | None = None
    ) -> Callable[[], None]:
        """Call `closer` when the node closes, the newest first, before the session is closed.

        Args:
            closer: Closes its owner; it may block for `time_to_leave`.
            ask: Called first, for all owners; it asks running work to end and does not block. So
                all owners end at the same time.

        Returns:
            A function that unregisters both, for owners that close earlier.

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

    def offer(self, what: str) -> Callable[[], None]:
        """Note that others are to use something of this node: "action server '/dig'".

        A program that ends at once, and lets nobody use it, has probably forgotten to wait.

        Returns:
            A function to be called when it is used, waited for or closed.
        """
        number = next(self._entities)
        self._unused[number] = what

        def used() -> None:
            self._unused.pop(number, None)

        return used

    def let_go(self, closer: Callable[[], object]) -> None:
        """Call `closer` soon, in another thread, because the program has dropped its owner.

        Threads: any, at any moment, also during a garbage collection.
        """

        def close() -> None:
            try:
                closer()
            except TransportError:  # the node was closed in the meantime, with everything on it
                if not self._closed:
                    raise

        if not self._closed:
            name = f"let go by node {self.full_name}"
            # Not in this thread: the garbage collector may have interrupted code that holds a lock.
            self.clock.call_later(0.0, lambda: self.clock.spawn(close, name=name))

    def time_to_leave(self, longest: float) -> float:
        """Return how long an owner that is being closed may block [s].

        That is `longest`, but while the node closes no more than the rest of the `CLOSE_S` that all
        owners share.
        """
        if self._leave_by is None:
            return longest
        return max(0.0, min(longest, self._leave_by - self.clock.now()))

    def warn_of_early_end(self) -> None:
        """Log what the node offers if it was open so briefly that nobody can have used it."""
        if not self._unused or self._closed or self.clock.now() > self._made_at + BRIEF_S:
            return
        import logging  # here: it takes 4 ms

        logging.getLogger(__name__).warning(
            "the program ends at once, and with it %s, which nobody has used. Try wait() of an "
            "action server, or spin() of a service, as its last line: they wait for others, as "
            "rospy.spin() does in ROS.",
            " and ".join(self._unused.values()),
        )

    def close(self) -> None:
        """Close everything on this node, then its session; a second call does nothing.

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
        # All are asked first, so that their graces run at the same time.
        for call in (*asks, *closers):
            try:
                call()
            except Exception:  # noqa: BLE001  reported here; the others are closed too
                report_thread_exception()
        if self.owns_transport:
            self.transport.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_zenoh(config: Config) -> Transport:
    """Open a Zenoh session."""
    # Imported here: tests and programs with another transport do not need Zenoh.
    from actionlib_core.transport.zenoh import ZenohTransport

    return ZenohTransport(config)


_current: ContextVar[Node | None] = ContextVar("node", default=None)


class _Default:
    """The process's default node, made on first use.

    The lock is held while the node is made, so that two threads get the same one.
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
    """Run the `Shutdown.at_exit` callbacks, then close the node.

    Not in a forked process, which has inherited the node but must not close it.
    """
    if os.getpid() != pid:
        return
    ending.begin()
    if not hasattr(sys, "last_value"):  # else an exception has ended the program
        node.warn_of_early_end()
    current_shutdown().leave()
    node.close()


_default = _Default()


def known_node() -> Node | None:
    """Return what `get_node` would return, without making it: None if it would be made."""
    given = _current.get()
    return given if given is not None or not _default.exists else _default.get()


def has_node() -> bool:
    """Return whether the process's default node exists, and so has joined its network."""
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
        name: One word; None: the program's name and process id.
        argv: Arguments with remapping; None: `sys.argv[1:]`. The program's own arguments are then
            in `node.arguments.rest`.
        config: How to join the network, or a configuration file; None: by `SMACHPY_CONFIG`.
        namespace: Prefix of relative names; None: that of the configuration.

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
    """Return the current node: that of `use_node`, or else the default one, made on first use.

    Raises:
        NodeError: a clock other than the real one is current, but no node is.
        NameSetupError: the command line has an invalid remapping.
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
