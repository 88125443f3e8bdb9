"""`machine.control` over the network, for machines whose server was told to obey.

    <server>/smach/control          commands, JSON in std_msgs/String
    <server>/smach/control_result   the answers, JSON in std_msgs/String
    <server>/smach/control_state    `paused` and `breakpoints`, latched, whenever they change,
                                    whoever changes them; JSON in std_msgs/String

A command is an object: `id` (comes back with the answer), `by` (who sends it, for those who watch;
may be left out), `command`, and what that needs:

    pause [running]  resume  step
    preempt path          jump path          force path outcome
    break path [outcome]  unbreak path [outcome]
    initial path states

A path is the whole one that viewers show, from the machine on ("/JOB/A").
`running` is "keep" or "cancel", as for `Control.pause`. An answer is `id`, `ok`, `text` (why not),
`paused` and `breakpoints` (pairs path, outcome) as they were then: what they are now is what
`control_state` has told last.
"""

from __future__ import annotations

import json
import uuid
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import SerialExecutor
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.topic import Publisher, Subscriber
from smachpy import log
from smachpy._runtime.asker import asking
from smachpy.exceptions import SmachError
from smachpy.user_data import UserData

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.node import Node
    from smachpy.container import Container

CONTROL_TOPIC = "/smach/control"
RESULT_TOPIC = "/smach/control_result"
STATE_TOPIC = "/smach/control_state"

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
}
"""What every command needs."""

RUNNING = (None, "keep", "cancel")

ANSWER_S = 3.0


class CommandError(SmachError):
    """A command is unknown, lacks something, or is about a state that is not there."""


class ControlServer:
    """Obeys commands from the network.

    Args:
        server_name: First part of the topics' names.
        machine: What to control.
        path: What the machine is called in commands.
        node: Where it listens.

    Threads: commands are carried out one after another in a thread of the node's clock.
    """

    def __init__(self, server_name: str, machine: Container, path: str, node: Node) -> None:
        self._machine = machine
        self._path = path
        self._executor = SerialExecutor(node.clock, f"control of {server_name}")
        self._results = Publisher(server_name + RESULT_TOPIC, String, node=node)
        self._states = Publisher(server_name + STATE_TOPIC, String, latch=True, node=node)
        self._commands = Subscriber(server_name + CONTROL_TOPIC, String, self._take, node=node)
        self._forget = machine.control.on_change(lambda: self._executor.submit(self._tell_state))
        self._executor.submit(self._tell_state)

    def close(self) -> None:
        """Obey no more; a second call does nothing."""
        self._forget()
        self._commands.unregister()
        self._executor.join(ANSWER_S)
        self._results.unregister()
        self._states.unregister()

    def _tell_state(self) -> None:
        """Tell after each change, even as before: an answer may have told what was in between."""
        self._states.publish(json.dumps(self.state()))

    def state(self) -> dict[str, Any]:
        """Return whether the machine is paused, and its breakpoints."""
        control = self._machine.control
        return {
            "paused": control.is_paused(),
            "breakpoints": [[self._shown(path), out] for path, out in control.breakpoints()],
        }

    def _take(self, message: Any) -> None:
        self._executor.submit(lambda: self._obey(message.data))

    def _obey(self, text: str) -> None:
        request, problem = "", ""
        try:
            command = parse_command(text)
            request = str(command.get("id", ""))
            words = [command["command"], *(str(command[f]) for f in COMMANDS[command["command"]])]
            with asking("operator", command.get("by") or "", " ".join(words)):
                self._carry_out(command)
            log.loginfo(f"{self._path}: command from remote: {command}")
        except SmachError as error:
            problem = str(error)
            log.logwarn(f"{self._path}: command from remote refused: {problem}")
        answer = {"id": request, "ok": not problem, "text": problem, **self.state()}
        self._results.publish(json.dumps(answer))

    def _carry_out(self, command: dict[str, Any]) -> None:
        control = self._machine.control
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
        self._machine.control.add_breakpoint(path, outcome)

    def _begin_at(self, path: str, states: list[str]) -> None:
        container = self._find(path)
        if not hasattr(container, "set_initial_state"):
            raise CommandError(
                f"command 'initial': path: got {self._shown(path)!r}; expected a container's, such "
                f"as {self._path!r}."
            )
        container.set_initial_state([str(state) for state in states], UserData())

    def _find(self, path: str) -> Any:
        """The state at a path, whose labels may have slashes in them; None when there is none."""
        root = self._root()
        return _below(self._machine, path.removeprefix(root)) if _is_in(root, path) else None

    def _root(self) -> str:
        return f"/{self._machine.name or 'SM_ROOT'}"

    def _own(self, path: str) -> str:
        """The path of the machine's own that a command means."""
        return _moved(path, self._path, self._root())

    def _shown(self, path: str) -> str:
        return _moved(path, self._root(), self._path)


def _is_in(root: str, path: str) -> bool:
    return path == root or path.startswith(root + "/")


def _moved(path: str, old: str, new: str) -> str:
    """Return `path` with the root `new` in place of `old`; as it is when it is not in that."""
    return new + path.removeprefix(old) if _is_in(old, path) else path


def _below(state: Any, rest: str) -> Any:
    """The state at `rest` ("/A/B"; "" is `state` itself), None when there is none."""
    if not rest:
        return state
    children = state.get_children() if hasattr(state, "get_children") else {}
    for label, child in children.items():
        if rest == f"/{label}" or rest.startswith(f"/{label}/"):
            found = _below(child, rest.removeprefix(f"/{label}"))
            if found is not None:
                return found
    return None


class ControlClient:
    """Sends commands to one server.

    Args:
        server_name: The server.
        node: Where.
    """

    def __init__(self, server_name: str, node: Node) -> None:
        self._name = server_name
        self._clock = node.clock
        self._by = node.full_name
        self._waiting: dict[str, tuple[Any, list[dict[str, Any]]]] = {}
        self._results = Subscriber(server_name + RESULT_TOPIC, String, self._take, node=node)
        self._commands = Publisher(server_name + CONTROL_TOPIC, String, node=node)

    def close(self) -> None:
        """Leave the topics; a second call does nothing."""
        self._results.unregister()
        self._commands.unregister()

    def send(self, command: dict[str, Any], timeout: float = ANSWER_S) -> dict[str, Any]:
        """Send a command and return the answer; `by` is the node's name if it is left out.

        Raises:
            CommandError: the command is wrong, or nobody answers.

        Blocks: until the answer, `timeout` [s] at most.
        """
        request = uuid.uuid4().hex
        text = json.dumps({"by": self._by, **command, "id": request})
        parse_command(text)
        event, answers = self._clock.event(), list[dict[str, Any]]()
        self._waiting[request] = event, answers
        try:
            self._commands.wait_for_connections(1, timeout)
            self._commands.publish(text)
            if not event.wait(timeout):
                raise CommandError(
                    f"{self._name}: got no answer in {timeout:g} s; expected one. Was the mission "
                    "started with --control?"
                )
            return answers[0]
        finally:
            del self._waiting[request]

    def _take(self, message: Any) -> None:
        answer = json.loads(message.data)
        waiting = self._waiting.get(answer["id"])
        if waiting is not None:
            waiting[1].append(answer)
            waiting[0].set()


def parse_command(text: str) -> dict[str, Any]:
    """Return the command that `text` is.

    Raises:
        CommandError: it is none; names what is missing.
    """
    try:
        command = json.loads(text)
    except ValueError as error:
        raise CommandError(f"command: got no JSON: {error}; expected an object.") from error
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
