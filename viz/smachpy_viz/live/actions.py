"""Lists the actions on the network for the page, describes their goals and sends goals to them.

The page's counterpart of ROS's axclient.
"""

from __future__ import annotations

import itertools
import logging
import threading
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from actionlib_core.action.client import ActionClient
from actionlib_core.exceptions import ActionlibError, FieldError, InterfaceError
from actionlib_core.goal.states import CommState, Status
from actionlib_core.interfaces import get_action
from actionlib_core.transport.tokens import Kind, parse_token, token_pattern
from smachpy.exceptions import SmachError
from smachpy_viz.live.forms import fields_of, problems_of, sensible, values_of, yaml_of
from smachpy_viz.live.server_goals import cancel, goals_of
from smachpy_viz.model.progress import progress_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action.client_goal_handle import ClientGoalHandle
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence
    from actionlib_core.transport.tokens import Endpoint

logger = logging.getLogger("smachpy_viz.live")

MAX_KEPT_GOALS = 30
"""Goals that are kept; the oldest ended ones are dropped first."""

MAX_RUNNING_GOALS = 20
"""Goals that may run at the same time; more can only be a mistake."""

MAX_ACTIONS = 2_000
"""Actions that are listed; further ones, whose tokens anybody can invent, are left out."""

SERVER_S = 2.0
"""Longest wait for the connection to a server [s]."""
MAX_TEXT_LENGTH = 200_000
"""Length of a goal as YAML [characters]."""
SHOWN = 20_000
"""Length of feedback and result on the page [characters]."""

INTERFACES = "smachpy.interfaces"
"""Group of entry points: modules that define interfaces when they are imported."""


class GoalRefusedError(SmachError):
    """A goal was not sent, or cannot be cancelled.

    Try: correct the fields that are marked, or wait for the server.

    Attributes:
        problems: For each: `path` of the field ("$.target_pose.header", "" for the whole goal) and
            `text`.
    """

    def __init__(self, text: str, problems: list[dict[str, str]] | None = None) -> None:
        self.problems = problems or []
        super().__init__(text)


@dataclass(slots=True)
class SentAction:
    """A goal that was sent from here."""

    id: str
    action: str
    type: str
    goal: Any
    sent_ns: int
    handle: ClientGoalHandle | None = None
    state: str = "WAITING_FOR_GOAL_ACK"
    status: str = "PENDING"
    text: str = ""
    ended_ns: int | None = None
    feedback_count: int = 0
    first: Any = None  # first feedback: progress of a distance is measured from it
    feedback: Any = None
    result: Any = None
    cancelled: bool = False
    texts: dict[str, str] = field(default_factory=dict)  # feedback and result for the page

    def to_json(self) -> dict[str, Any]:
        """Return the goal for the page."""
        # The messages themselves stay here: the page gets their texts and the progress.
        progress = progress_of(self.goal, self.feedback, self.first)
        return {
            "id": self.id,
            "action": self.action,
            "type": self.type,
            "state": self.state,
            "status": self.status,
            "text": self.text,
            "sent": self.sent_ns,
            "ended": self.ended_ns,
            "feedback_count": self.feedback_count,
            "cancelled": self.cancelled,
            "fraction": progress.fraction,
            "distance": progress.distance,
            **self.texts,
        }


class Actions:
    """Finds the actions on one or several networks and sends goals to them.

    An action whose name is taken by an action of another network gets a number after its name.

    Args:
        node: The node on the first network; `join` adds others.
        on_change: Called after every change.

    Threads: every method may be called from any thread; `on_change` is called from any.
    """

    def __init__(self, node: Node, on_change: Callable[[], object] = lambda: None) -> None:
        self._node = node
        self._on_change = on_change
        self._lock = threading.Lock()
        # By displayed name; the servers of an action by the key of their token. An action that a
        # page has used stays with an empty dict when its servers are gone, so that it can name it.
        self._used: set[str] = set()
        self._servers: dict[str, dict[str, Endpoint]] = {}
        self._nodes: dict[str, Node] = {}
        self._shown: dict[tuple[Node, str], str] = {}  # by network and name there
        self._goals: dict[str, SentAction] = {}
        self._clients: dict[tuple[Node, str, str], ActionClient[Any]] = {}
        self._searched = False
        self._full = False  # whether there were too many actions
        self.revision = 0
        self._watches: dict[Node, list[Closable]] = {}
        self.join(node)

    def join(self, node: Node) -> None:
        """Also find the actions on a node's network, and of the ROS 2 robots in its configuration.

        A robot whose router cannot be reached is found when it can.

        Blocks: until the networks of the other robots are joined.
        """
        # Servers of this network announce themselves by tokens; those of ROS 2 have other means.
        pattern, on_presence = token_pattern(Kind.ACTION_SERVER), partial(self._on_presence, node)
        self._watches[node] = [node.transport.watch_alive(pattern, on_presence)]
        if node.config.ros2:
            from actionlib_core.wire.ros2.ends import watch_ends

            self._watches[node] += watch_ends(node, partial(self._on_end, node))

    def leave(self, node: Node) -> None:
        """Forget the actions on a node's network."""
        for watch in self._watches.pop(node):
            watch.close()
        with self._lock:
            for name in [name for name, owner in self._nodes.items() if owner is node]:
                del self._nodes[name], self._servers[name]
            self._shown = {key: name for key, name in self._shown.items() if key[0] is not node}
            clients = [self._clients.pop(key) for key in list(self._clients) if key[0] is node]
        # Outside the lock, which the clients' callbacks need.
        for client in clients:
            client.stop()
        self._changed()

    def listen(self, on_change: Callable[[], object]) -> None:
        """Set the function that is called after every change."""
        self._on_change = on_change

    def close(self) -> None:
        """Leave the networks; running goals continue. A second call does nothing."""
        for watch in itertools.chain(*self._watches.values()):
            watch.close()
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for client in clients:
            client.stop()

    # -- actions ---------------------------------------------------------------------------------

    def summary(self) -> dict[str, Any]:
        """Return the actions by name, the names of those without servers, and the newest goals."""
        with self._lock:
            servers = {name: list(ends.values()) for name, ends in sorted(self._servers.items())}
            goals = [goal.to_json() for goal in reversed(self._goals.values())]
        return {
            "actions": [
                {
                    "name": name,
                    "type": ends[0].type.removesuffix("Action"),
                    "node": ends[0].node,
                    "servers": len(ends),
                }
                for name, ends in servers.items()
                if ends
            ],
            "gone": [name for name, ends in servers.items() if not ends],
            "goals": goals,
        }

    def definition(self, name: str) -> dict[str, Any]:
        """Return the data for a goal's form: fields, default values, and the values as YAML.

        Raises:
            GoalRefusedError: there is no server, or its type is unknown here.
        """
        end = self._server(name)
        cls = self._goal_class(name, end)
        goal = sensible(cls)
        return {
            "name": name,
            "type": end.type.removesuffix("Action"),
            "about": cls._definition.comment,
            "fields": fields_of(cls),
            "values": values_of(goal),
            "yaml": yaml_of(goal),
        }

    def check(self, name: str, text: str) -> dict[str, Any]:
        """Parse a goal from YAML; return it as values of a form and as YAML with comments.

        Raises:
            GoalRefusedError: the goal is invalid, with the problems of each field; or as
                `definition`.
        """
        goal = self._read(self._goal_class(name, self._server(name)), text)
        return {"values": values_of(goal), "yaml": yaml_of(goal)}

    # -- goals -----------------------------------------------------------------------------------

    def send(self, name: str, text: str) -> str:
        """Send a goal given as YAML and return its id.

        Raises:
            GoalRefusedError: as `check`; or it could not be sent.

        Blocks: until the server has been found, at most 2 s.
        """
        end = self._server(name)
        goal = self._read(self._goal_class(name, end), text)
        with self._lock:
            running = sum(one.ended_ns is None for one in self._goals.values())
        if running >= MAX_RUNNING_GOALS:
            raise GoalRefusedError(
                f"goals: got {running} running; expected fewer than {MAX_RUNNING_GOALS}. "
                "Cancel some."
            )
        try:
            client = self._client(name, end)
            if not client.wait_for_server(SERVER_S):
                self._server(name)  # raises if it is gone; on a busy network it is late
                raise GoalRefusedError(_late(name))
            # Made before the goal is sent: callbacks may come before `send_goal` returns its id.
            sent = SentAction("", name, end.type.removesuffix("Action"), goal, self._now())
            handle = client.send_goal(
                goal,
                lambda handle: self._on_transition(sent, handle),
                lambda _handle, feedback: self._on_feedback(sent, feedback),
            )
        except ActionlibError as error:
            raise GoalRefusedError(str(error)) from error
        with self._lock:
            sent.id, sent.handle = handle.get_goal_id(), handle
            self._goals[sent.id] = sent
            self._forget_old()
        self._changed()
        return sent.id

    def cancel(self, goal_id: str) -> None:
        """Request the cancellation of a goal; its status shows the answer.

        Raises:
            GoalRefusedError: there is no such goal, or it has ended.
        """
        with self._lock:
            goal = self._goals.get(goal_id)
        if goal is None or goal.handle is None:
            raise GoalRefusedError(f"goal {goal_id!r}: not sent from here")
        if goal.ended_ns is not None:
            raise GoalRefusedError(f"goal {goal_id!r}: has ended already: {goal.status}")
        goal.cancelled = True
        try:
            goal.handle.cancel()
        except ActionlibError as error:
            raise GoalRefusedError(str(error)) from error
        self._changed()

    def server_goals(self, name: str) -> list[dict[str, Any]]:
        """Return the running goals of an action's server, whoever sent them.

        Raises:
            GoalRefusedError: there is no server.
            GoalsError: it tells no goals.

        Blocks: 2 s at most.
        """
        return goals_of(self._nodes.get(name, self._node), self._server(name))

    def cancel_any(self, name: str, goal_id: str) -> None:
        """Request the cancellation of a goal of an action's server, whoever sent it.

        Raises:
            GoalRefusedError, GoalsError: as `server_goals`; or there is no such goal.

        Blocks: 11 s at most.
        """
        cancel(self._nodes.get(name, self._node), self._server(name), goal_id)

    def _on_transition(self, sent: SentAction, handle: ClientGoalHandle) -> None:
        state = handle.get_comm_state()
        with self._lock:
            sent.state = state.name
            sent.status = Status(handle.get_goal_status()).name
            sent.text = handle.get_goal_status_text()
            if state in {CommState.DONE, CommState.LOST}:
                sent.ended_ns = self._now()
                sent.result = handle.get_result()
                if sent.result is not None:
                    sent.texts["result"] = _shown(sent.result)
        self._changed()

    def _on_feedback(self, sent: SentAction, feedback: Any) -> None:
        with self._lock:
            sent.feedback_count += 1
            sent.feedback = feedback
            if sent.first is None:
                sent.first = feedback
            sent.texts["feedback"] = _shown(feedback)
        self._changed()

    def _forget_old(self) -> None:
        # Running goals are kept however many there are: the page must be able to cancel them.
        ended = [one.id for one in self._goals.values() if one.ended_ns is not None]
        for goal_id in ended[: max(0, len(self._goals) - MAX_KEPT_GOALS)]:
            del self._goals[goal_id]

    # -- the network -----------------------------------------------------------------------------

    def _on_presence(self, node: Node, presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is not None:
            self._on_end(node, end, presence.key, presence.alive)

    def _on_end(self, node: Node, end: Endpoint, key: str, alive: bool) -> None:
        if end.kind is not Kind.ACTION_SERVER:
            return
        with self._lock:
            # An action keeps the first of "name", "name (2)", ... that was free when it came.
            names = (f"{end.name} ({i})" if i > 1 else end.name for i in itertools.count(1))
            shown = self._shown.get((node, end.name)) or next(
                name for name in names if name not in self._nodes
            )
            full = shown not in self._servers and len(self._servers) >= MAX_ACTIONS
            if alive and not full:
                self._nodes[shown], self._shown[node, end.name] = node, shown
                self._servers.setdefault(shown, {})[key] = end
            elif alive:
                logger.log(
                    logging.DEBUG if self._full else logging.ERROR,
                    "more than %d actions: %s is not listed",
                    MAX_ACTIONS,
                    end.name,
                )
                self._full = True
            elif (servers := self._servers.get(shown)) is not None:
                servers.pop(key, None)
                if not servers and shown not in self._used:
                    del self._nodes[shown], self._servers[shown], self._shown[node, end.name]
        self._changed()

    def _changed(self) -> None:
        self.revision += 1
        self._on_change()

    def _now(self) -> int:
        return self._node.clock.time_ns()

    def _server(self, name: str) -> Endpoint:
        with self._lock:
            found = list(self._servers.get(name, {}).values())
            if found:
                self._used.add(name)
        if not found:
            raise GoalRefusedError(_gone(name))
        return found[0]

    def _goal_class(self, name: str, end: Endpoint) -> Any:
        spec = self._action_class(name, end)
        return type(spec().action_goal.goal)

    def _action_class(self, name: str, end: Endpoint) -> Any:
        """Find an action's class in this process; servers do not send their definitions."""
        if end.type.count("/") > 1:  # package/action/Name of ROS 2
            return self._ros2_class(name, end)
        try:
            spec = get_action(end.type)
        except InterfaceError:  # importing packages takes time, so only for an unknown type
            self._search()
            try:
                spec = get_action(end.type)
            except InterfaceError as error:
                raise GoalRefusedError(
                    f"{error} Name the folder with its definition in SMACHPY_INTERFACE_PATH "
                    "where `smachpy view` starts."
                ) from error
        # The server would misread the bytes of another version of the definition.
        if spec._md5sum != end.md5:
            raise GoalRefusedError(
                f"{end.type}: got md5 {spec._md5sum} of the definition here; expected that of the "
                f"server, {end.md5}. Try its version of the definition, in SMACHPY_INTERFACE_PATH."
            )
        return spec

    def _ros2_class(self, name: str, end: Endpoint) -> Any:
        from actionlib_core.wire.ros2.ends import class_of

        self._search()
        try:
            return class_of(self._nodes.get(name, self._node), end)
        except InterfaceError as error:
            raise GoalRefusedError(str(error)) from error

    def _search(self) -> None:
        """Import the interfaces that installed packages have registered, once."""
        with self._lock:
            searched, self._searched = self._searched, True
        if searched:
            return
        for point in entry_points(group=INTERFACES):
            try:
                point.load()
            except Exception:  # a broken package hides only its own definitions
                logger.exception("interfaces of %s cannot be loaded", point.value)

    def _client(self, name: str, end: Endpoint) -> ActionClient[Any]:
        spec = self._action_class(name, end)
        with self._lock:
            node = self._nodes.get(name)
            if node is None:
                raise GoalRefusedError(_gone(name))
            # One client for all goals of an action; by md5, as a restarted server can have another.
            client = self._clients.get((node, end.name, end.md5))
            if client is None:
                client = ActionClient(f"/{end.name}", spec, node=node)
                self._clients[node, end.name, end.md5] = client
            return client

    def _read(self, cls: Any, text: str) -> Any:
        if len(text) > MAX_TEXT_LENGTH:
            raise GoalRefusedError(
                f"goal: got {len(text)} characters; expected at most {MAX_TEXT_LENGTH}."
            )
        try:
            return cls.from_yaml(text)
        except FieldError as error:
            raise GoalRefusedError(str(error), problems_of(error, cls._type)) from error


def _gone(name: str) -> str:
    return f"action /{name}: got no server; expected one. Start it, then send again."


def _late(name: str) -> str:
    return (
        f"action /{name}: its server is there, but was not reached within {SERVER_S:g} s: it or "
        "the network is busy. Nothing was sent. Send again."
    )


def _shown(message: Any) -> str:
    text = str(message)
    return (
        text if len(text) <= SHOWN else f"{text[:SHOWN]}\n... {len(text) - SHOWN} more characters"
    )
