"""`machine.control` over the network, for servers made with `control=True`.

    <server>/smach/control          service smachpy_msgs/Command: a command and its answer, in JSON
    <server>/smach/control_state    `paused` and `breakpoints`, sent on every change, latched;
                                    JSON in std_msgs/String

A command is a JSON object: `command`, its arguments, and optionally `by` (who sent it, shown by
viewers):

    pause [running]  resume  step
    preempt path          jump path          force path outcome
    break path [outcome]  unbreak path [outcome]
    initial path states
    fire path transition   post path event        (of a Petri net plan)

A path is absolute and begins with the machine's name as viewers show it ("/JOB/A"). `running` is
"keep" or "cancel", as for `Control.pause`. An answer has `ok`, `text` (the reason of a refusal),
and `paused` and `breakpoints` (pairs path, outcome) as they are right after the command; the
present values are those of the newest `control_state`.
"""

from __future__ import annotations

import json
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import SerialExecutor
from actionlib_core.exceptions import ActionlibError, ServiceUnavailableError
from actionlib_core.inputs.json_text import load_json
from actionlib_core.interfaces import define_service
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import NewsPublisher
from smachpy.base import log
from smachpy.engine.preempt import asking
from smachpy.exceptions import SmachError
from smachpy.machines.container import control_of
from smachpy.network.reading import MAX_COMMAND_LENGTH, read_control_answer
from smachpy.network.values import find_state
from smachpy.userdata.user_data import UserData

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.node import Node
    from smachpy.machines.container import Container

CONTROL_SERVICE = "/smach/control"
STATE_TOPIC = "/smach/control_state"

Command = define_service("smachpy_msgs/Command", "string command\n---\nstring answer")

COMMANDS: dict[str, tuple[str, ...]] = {
    "pause": (),
    "resume": (),
    "step": (),
    "preempt": ("path",),
    "jump": ("path",),
    "force": ("path", "outcome"),
    "break": ("path",),
    "unbreak": ("path",),
    "initial": ("path", "states"),
    "fire": ("path", "transition"),
    "post": ("path", "event"),
}
"""Command -> its required arguments."""

RUNNING = (None, "keep", "cancel")

MAX_AUTHOR_LENGTH = 200
MAX_REASON_LENGTH = 1_000
"""Lengths of the sender's name and of a command in events [characters]."""

ANSWER_S = 3.0


class CommandError(SmachError):
    """A command is unknown or incomplete, names no existing state, or got no answer.

    Try: name a state by its path; `smachpy view` shows the machines that can be asked.
    """


class ControlServer:
    """Executes commands from the network.

    Args:
        server_name: First part of the names.
        machine: The machine to control.
        path: Its path in commands.
        node: Node that takes them.

    Threads: commands are executed one after another, in threads of the node's clock.
    """

    def __init__(self, server_name: str, machine: Container, path: str, node: Node) -> None:
        self._machine = machine
        self._path = path
        self._lock = threading.Lock()
        self._executor = SerialExecutor(node.clock, f"control of {server_name}")
        self._states = NewsPublisher(server_name + STATE_TOPIC, String, latch=True, node=node)
        self._service = Service(
            server_name + CONTROL_SERVICE, Command, self._answer, node=node, alone=False
        )
        self._forget = control_of(machine).on_change(
            lambda: self._executor.submit(self._publish_state)
        )
        self._executor.submit(self._publish_state)

    def close(self) -> None:
        """Stop taking commands; may be called twice."""
        self._forget()
        self._service.close()
        self._executor.join(ANSWER_S)
        self._states.unregister()

    def _publish_state(self) -> None:
        """Publish the state after a change, even if the values are the same.

        An answer that was sent in between may have had other ones.
        """
        self._states.publish(json.dumps(self.state()))

    def state(self) -> dict[str, Any]:
        """Return whether the machine is paused, and its breakpoints."""
        control = control_of(self._machine)
        return {
            "paused": control.is_paused(),
            "breakpoints": [[self._shown(path), out] for path, out in control.breakpoints()],
        }

    def _answer(self, request: Any) -> str:
        problem = ""
        try:
            command = parse_command(request.command)
            words = [command["command"], *(str(command[f]) for f in COMMANDS[command["command"]])]
            by = (command.get("by") or "")[:MAX_AUTHOR_LENGTH]
            with self._lock, asking("operator", by, " ".join(words)[:MAX_REASON_LENGTH]):
                self._carry_out(command)
            log.loginfo(f"{self._path}: command from remote: {command}")
        except SmachError as error:
            problem = str(error)
            log.logwarn(f"{self._path}: command from remote refused: {problem}")
        return json.dumps({"ok": not problem, "text": problem, **self.state()})

    def _carry_out(self, command: dict[str, Any]) -> None:
        control = control_of(self._machine)
        path = self._own(str(command.get("path", "")))
        outcome = command.get("outcome")
        actions: dict[str, Callable[[], object]] = {
            "pause": lambda: control.pause(running=command.get("running") or "keep"),
            "resume": control.resume,
            "step": control.step,
            "preempt": lambda: control.preempt(path),
            "jump": lambda: control.jump(path),
            "force": lambda: control.force_outcome(path, str(outcome)),
            "break": lambda: self._break(path, outcome),
            "unbreak": lambda: control.remove_breakpoint(path, outcome),
            "initial": lambda: self._begin_at(path, command["states"]),
            "fire": lambda: self._plan(path, "fire").fire(command["transition"]),
            "post": lambda: self._plan(path, "post").post(command["event"]),
        }
        actions[command["command"]]()

    def _break(self, path: str, outcome: str | None) -> None:
        state = self._find(path)
        if state is None or state is self._machine:
            raise CommandError(
                f"command 'break': path: got {self._shown(path)!r}; expected that of a state below "
                f"{self._path!r}."
            )
        outcomes = state.get_registered_outcomes()
        if outcome is not None and outcome not in outcomes:
            raise CommandError(
                f"command 'break': outcome: got {outcome!r}; expected one of {sorted(outcomes)}."
            )
        control_of(self._machine).add_breakpoint(path, outcome)

    def _begin_at(self, path: str, states: list[str]) -> None:
        container = self._find(path)
        if not hasattr(container, "set_initial_state"):
            raise CommandError(
                f"command 'initial': path: got {self._shown(path)!r}; expected a container's, such "
                f"as {self._path!r}."
            )
        container.set_initial_state([str(state) for state in states], UserData())

    def _plan(self, path: str, command: str) -> Any:
        found = self._find(path)
        if getattr(found, "_smachpy_kind", "") != "plan":
            raise CommandError(
                f"command {command!r}: path: got {self._shown(path)!r}; expected that of a Petri "
                "net plan."
            )
        return found

    def _find(self, path: str) -> Any:
        """Return the state at an absolute path, or None."""
        root = self._root()
        return find_state(self._machine, path.removeprefix(root)) if _is_in(root, path) else None

    def _root(self) -> str:
        return f"/{self._machine.name or 'SM_ROOT'}"

    def _own(self, path: str) -> str:
        """Return a command's path with the machine's own name."""
        return _moved(path, self._path, self._root())

    def _shown(self, path: str) -> str:
        return _moved(path, self._root(), self._path)


def _is_in(root: str, path: str) -> bool:
    return path == root or path.startswith(root + "/")


def _moved(path: str, old: str, new: str) -> str:
    """Return `path` with the root `old` replaced by `new`; unchanged if its root is another."""
    return new + path.removeprefix(old) if _is_in(old, path) else path


class ControlClient:
    """Sends commands to one server.

    Args:
        server_name: The server.
        node: The node to use.
    """

    def __init__(self, server_name: str, node: Node) -> None:
        self._name = server_name
        self._by = node.full_name
        self._service = ServiceProxy(
            server_name + CONTROL_SERVICE, Command, timeout=ANSWER_S, node=node
        )

    def close(self) -> None:
        """End calls that wait; may be called twice."""
        self._service.close()

    def send(self, command: dict[str, Any]) -> dict[str, Any]:
        """Send a command and return the answer; `by` is the node's name if it is left out.

        Raises:
            CommandError: the command is wrong, or nobody answers.

        Blocks: until the answer, at most `ANSWER_S`.
        """
        text = json.dumps({"by": self._by, **command})
        parse_command(text)
        try:
            return read_control_answer(self._service(text).answer)
        except ValueError as error:
            raise CommandError(f"{self._name}: got an answer that is none: {error}") from error
        except ActionlibError as error:
            absent = isinstance(error, ServiceUnavailableError)
            hint = " Was the mission started with --control?" if absent else ""
            raise CommandError(f"{self._name}: got no answer: {error}{hint}") from error


def parse_command(text: str) -> dict[str, Any]:
    """Parse the text of a command.

    Raises:
        CommandError: it is not a command, or an argument is missing.
    """
    try:
        command = load_json(text, longest=MAX_COMMAND_LENGTH)
    except ValueError as error:
        raise CommandError(f"command: {error}; expected a JSON object.") from error
    if not isinstance(command, dict):
        raise CommandError(f"command: got {command!r}; expected an object.")
    name = command.get("command")
    if not isinstance(name, str) or name not in COMMANDS:
        raise CommandError(f"command: got {name!r}; expected one of {sorted(COMMANDS)}.")
    for field in COMMANDS[name]:
        kind = list if field == "states" else str
        if not isinstance(command.get(field), kind):
            got = command.get(field)
            raise CommandError(f"command {name!r}: {field}: got {got!r}; expected {kind.__name__}.")
    if command.get("running") not in RUNNING:
        got = command["running"]
        raise CommandError(f"command {name!r}: running: got {got!r}; expected 'keep' or 'cancel'.")
    for field in ("outcome", "by"):
        value = command.get(field)
        if value is not None and not isinstance(value, str):
            raise CommandError(f"command {name!r}: {field}: got {value!r}; expected str.")
    return command
