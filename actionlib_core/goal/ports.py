"""The interfaces between the rules of actions and the network.

An `ActionClient` sends through a `ClientPort` and receives as a `ClientListener`; an `ActionServer`
sends through a `ServerPort` and receives as a `ServerListener`. Only the ports know keys and
encodings: goals, results and feedback cross here as the bytes (`body`) that the port has packed.

Threads: ports may be used from any thread. Listeners are called on the network's threads, in order
per sender, and must not block.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.exceptions import TypeMismatchError


class StatusEntry(NamedTuple):
    """One goal's status: an actionlib_msgs/GoalStatus."""

    id: str
    stamp_ns: int
    status: int
    text: str


class Server(Protocol):
    """A server that announces itself with a token; hashable, equal when it is the same server."""

    @property
    def session(self) -> str:
        """Id of its network session."""

    @property
    def node(self) -> str:
        """Full name of its node."""

    @property
    def age(self) -> tuple[int, str]:
        """Sorts servers by their start: the later, the greater."""


class ClientPort(Protocol):
    """A client's end of the wire."""

    def open(self, listener: ClientListener) -> None:
        """Subscribe, then announce the client.

        Raises:
            TransportError: the session is closed.
        """

    def close(self) -> None:
        """Withdraw from the network; a second call does nothing."""

    def is_heard(self) -> bool:
        """Return whether anybody subscribes to goals."""

    @property
    def lost_link(self) -> str:
        """What connects this client with all servers, while that is lost; else "".

        As `Transport.lost_link`, also for the next.
        """

    @property
    def link_delay(self) -> float:
        """A lost link is known this long after the servers behind it were reported gone [s]."""

    def explain_absence(self) -> str:
        """Return why there may be no server: where it was looked for, what is there, what to try.

        Raises:
            TransportError: the session is closed.

        Blocks: for the network's answers, 1 s at most.
        """

    def pack_goal(self, goal: Any) -> bytes:
        """Return the bytes of a goal message.

        Raises:
            FieldError: a field of it has a wrong type.
        """

    def read_feedback(self, body: bytes) -> Any:
        """Return the feedback message.

        Raises:
            ValueError, ActionlibError: the bytes are malformed.
        """

    def read_result(self, body: bytes) -> Any:
        """Return the result message; errors as `read_feedback`."""

    def send_goal(
        self,
        goal_id: str,
        stamp_ns: int,
        body: bytes,
        server: Any,
        *,
        age: float = 0.0,
        wait: bool = True,
        cancel_if_lost: bool = False,
    ) -> None:
        """Send a goal, made `age` [s] ago, to one server; None: to a server without a token.

        With `cancel_if_lost` the server is to cancel it when this client dies.

        Blocks: with `wait`, while a link is full; without, the goal is then dropped.
        """

    def send_cancel(self, goal_id: str, stamp_ns: int, *, wait: bool = True) -> None:
        """Send a cancel; see `ServerGoals.on_cancel` for its meaning. Blocks as `send_goal`."""

    def acknowledge(self, goal_ids: list[str], *, farewell: bool = False) -> None:
        """Acknowledge the results of these goals and, if asked, a server's farewell.

        Never blocks; the message may get lost.
        """

    def ask(self, goal_id: str, on_done: Callable[[], None]) -> None:
        """Query the server for the state of a goal; the reply goes to the listener.

        `on_done` is called after the reply, or when none came in time.
        """


class ClientListener(Protocol):
    """The client's side of the port. `session` is the sender's; "" when unknown."""

    def on_server(self, server: Any, error: TypeMismatchError | None) -> None:
        """Handle the appearance of a server; `error` when it has another type."""

    def on_server_gone(self, server: Any, why: str = "is gone") -> None:
        """Handle the disappearance of a server; `why` goes into the text of its goals."""

    def on_statuses(self, entries: list[StatusEntry], session: str, *, whole: bool = True) -> None:
        """Handle a list of all the server's goals; without `whole`, of the changed ones only."""

    def on_farewell(self, entries: list[StatusEntry], server: Any) -> None:
        """Handle the last list of a server that leaves: every goal that it has ever taken."""

    def on_feedback(self, entry: StatusEntry, body: bytes, session: str) -> None:
        """Handle feedback."""

    def on_result(
        self, entry: StatusEntry, body: bytes | None, session: str, *, answered: bool = False
    ) -> None:
        """Handle a result. `answered`: it is the reply to `ask`; `body` None: no longer kept."""

    def on_answer(self, entry: StatusEntry, session: str = "") -> None:
        """Handle a reply to `ask` without a result."""

    def follows(self, goal_id: str) -> bool:
        """Return whether a goal is followed and has not ended."""

    def on_stranger(self, session: str) -> None:
        """Report a session that sends as a server but is not the action's server."""


class ServerPort(Protocol):
    """A server's end of the wire."""

    def open(self, listener: ServerListener) -> None:
        """Subscribe, then announce the server.

        Raises:
            ServerConflictError: the name has a server.
            TransportError: the session is closed.

        Blocks: until the network has listed the servers of the name, 1 s at most.
        """

    def close(self) -> None:
        """Withdraw from the network; a second call does nothing."""

    def clients(self) -> set[str]:
        """Return the action's clients, as `ServerListener.on_goal` names them."""

    def begin_farewell(self) -> bool:
        """Note the clients that are to acknowledge the farewell; return whether there are any.

        Raises:
            TransportError: the session is closed.

        Blocks: until the network has listed the clients, 0.2 s at most.
        """

    def send_farewell(self, taken: Iterable[StatusEntry]) -> None:
        """Announce that the server leaves, with every goal that it has taken.

        Clients conclude that it will never take any other goal.
        """

    def is_farewell_heard(self) -> bool:
        """Return whether all clients have acknowledged the farewell."""

    def pack_result(self, result: Any) -> bytes:
        """Return the bytes of a result message.

        Raises:
            FieldError: a field of it has a wrong type.
        """

    def pack_feedback(self, feedback: Any) -> bytes:
        """Return the bytes of a feedback message; errors as `pack_result`."""

    @property
    def send_accepted(self) -> Callable[[StatusEntry], None] | None:
        """Function that sends the acceptance of a goal; None where the status list suffices."""

    def send_status(self, entries: Iterable[StatusEntry]) -> None:
        """Send the status list; dropped when a link is full, since it is repeated."""

    def send_result(self, entry: StatusEntry, body: bytes, *, wait: bool = True) -> None:
        """Send a result.

        Blocks: with `wait`, while a link is full; without, the result is then dropped.
        """

    def send_feedback(self, entry: StatusEntry, body: bytes) -> None:
        """Send feedback.

        Blocks: while a link is full.
        """


class ServerListener(Protocol):
    """The server's side of the port."""

    def on_goal(
        self,
        goal_id: str,
        stamp_ns: int,
        content: Any,
        client: str,
        age: float = 0.0,
        *,
        cancel_if_lost: bool = False,
    ) -> bool:
        """Handle a goal.

        Args:
            goal_id: Its id.
            stamp_ns: When its client sent it first, by its clock [ns since the epoch].
            content: The goal message.
            client: Identifies its sender, as in `on_client_lost`.
            age: Time from then until this copy was sent, by the client's monotonic clock [s].
            cancel_if_lost: Its client wants it to be cancelled when it dies.

        Returns:
            Whether it is new and has been taken.
        """

    def on_cancel(self, goal_id: str, stamp_ns: int) -> list[StatusEntry]:
        """Handle a cancel; return the goals that it asks to stop and that were not asked before."""

    def on_acknowledged(self, goal_ids: list[str]) -> None:
        """Handle acknowledged results; the answer of `is_farewell_heard` may change too."""

    def on_client(self) -> None:
        """Handle the appearance of a client, which `clients` has already."""

    def on_client_lost(self, client: str) -> None:
        """Handle the death of a client, or of its session."""

    def on_conflict(self, error: Any) -> None:
        """Stop, because an older server has the name."""

    def list_goals(self) -> list[StatusEntry]:
        """Return the status list."""

    def find_end(self, goal_id: str) -> tuple[StatusEntry, bytes | None]:
        """Return the status of a goal, LOST when it is unknown, and its result if it has one."""

    def find_goal(self, goal_id: str) -> tuple[int, Any] | None:
        """Return stamp [ns] and message of a goal; None when it is no longer tracked."""
