"""All exceptions of actionlib_core; each has its data as attributes, too.

Exception
 +-- ActionlibError
      +-- InvalidDurationError  a duration that is negative, NaN, or infinite where it may not be
      |    +-- DurationTypeError  a value that is not a duration
      +-- NameSetupError        several problems in names or arguments, all at once
      |    +-- InvalidNameError a name breaks the ROS name rules (caret text)
      +-- ConfigError           a configuration has errors, all at once
      +-- NodeError             a node is closed, missing or made twice
      +-- TransportError        the network session is closed or could not be opened
      |    +-- AccessDeniedError a name that the router's access rules forbid
      +-- WaitTimeoutError      a wait has timed out
      +-- ServiceException      a service call failed, or its handler raised
      |    +-- ServiceUnavailableError there is no server
      |    +-- ServiceTimeoutError     no answer in time
      |    +-- ServiceLostError        the server died during the call
      |    +-- ServiceBusyError        too many calls are running, or the handler calls itself
      |    +-- ServiceConflictError    another server has the name
      +-- RemoteNodeError       a node of a ROS 2 robot refused requests, all at once
      +-- TypeMismatchError     two ends of a name disagree on the type
      +-- InterfaceError        a .msg/.srv/.action file or an interface name cannot be used
      |    +-- FieldError       a value does not fit the field of a message
      +-- Ros1Error             a ROS 1 master or node does not answer, or answers wrongly
      +-- DeserializationError  received bytes are not a message of the expected type
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable

MD5_DIGITS = 32
ERRORS_PAGE: Final = "https://smachpy.github.io/smachpy/latest/reference/errors/"
_PACKAGES: Final = ("actionlib_core", "smachpy", "smachpy_viz")


def text_of(error: BaseException, form: Callable[[object], str] = str) -> str:
    """Return the text of an exception, whose class may be the user's own and raise in turn.

    Args:
        error: The exception.
        form: `repr` to include the class.
    """
    try:
        return form(error)
    except Exception as broken:  # noqa: BLE001  user code
        return f"<{type(error).__name__}: its text raised {type(broken).__name__}>"


class Documented(Exception):  # noqa: N818  the part that all our errors share
    """An error that a page describes: a traceback ends with the page's address."""

    @property
    def __notes__(self) -> list[str]:
        """The notes of the error; the first is the address. `add_note` adds others.

        Made only for those who look, as programs catch errors more often than they print them.
        """
        kept: list[str] = self.__dict__.setdefault("__notes__", [more_about(type(self))])
        return kept

    @__notes__.setter
    def __notes__(self, notes: list[str]) -> None:
        self.__dict__["__notes__"] = notes


def more_about(kind: type[Documented]) -> str:
    """Return "More: " and the address of an error's description; of a user's, that of its base."""
    ours = (
        one.__name__
        for one in kind.__mro__
        if one.__module__.partition(".")[0] in _PACKAGES and not one.__name__.startswith("_")
    )
    return f"More: {ERRORS_PAGE}#{next(ours).lower()}"


class ActionlibError(Documented):
    """Root of all errors that actionlib_core raises on purpose.

    Try: see the error's own class; `except ActionlibError` catches them all.
    """


class InvalidDurationError(ActionlibError, ValueError):
    """A duration that is negative, not a number, or infinite where it may not be.

    Try: pass seconds that are positive and finite; None where no limit is meant.

    Attributes:
        argument: Name of the argument.
        value: The value.
    """

    def __init__(self, where: str, argument: str, value: object, expected: str) -> None:
        self.argument = argument
        self.value = value
        super().__init__(f"{where}: {argument}: got {value!r}; expected {expected}.")


class DurationTypeError(InvalidDurationError, TypeError):
    """A value that is neither a number nor a `Duration`, for example a text.

    Try: pass seconds as a number, or a `Duration`.
    """


class NameSetupError(ActionlibError, ValueError):
    """Names or command-line arguments that cannot be used.

    Try: correct each name that is listed; remappings are `old:=new`.

    Attributes:
        problems: One text per problem.
    """

    def __init__(self, *problems: str) -> None:
        self.problems = problems
        super().__init__("\n".join(problems))


class InvalidNameError(NameSetupError):
    """A name breaks the ROS name rules.

    Try: use letters, digits, `_` and `/`, with a letter in front, as in ROS.

    Attributes:
        name: The name.
        kind: The kind of name, for example "action name".
        reason: The rule that it breaks.
        index: Position of the first offending character.
    """

    def __init__(self, name: str, kind: str, reason: str, index: int) -> None:
        self.name = name
        self.kind = kind
        self.reason = reason
        self.index = index
        caret = " " * (index + 3) + "^"
        super().__init__(f"invalid {kind}: {reason}:\n  '{name}'\n{caret}")


class ConfigError(ActionlibError, ValueError):
    """A configuration that cannot be used.

    Try: correct each line that is named; docs/configuration.md lists all fields.

    Attributes:
        where: The file, or "configuration".
        problems: One text per problem.
    """

    def __init__(self, where: str, *problems: str) -> None:
        self.where = where
        self.problems = problems
        if len(problems) == 1:
            super().__init__(f"{where}: {problems[0]}")
        else:
            lines = "".join(f"\n  - {problem}" for problem in problems)
            super().__init__(f"{where}: {len(problems)} problems:{lines}")


class NodeError(ActionlibError, RuntimeError):
    """A node is closed, missing or was made twice.

    Try: make one node per process with `init_node`, and use it before it is closed.
    """


class TransportError(ActionlibError, ConnectionError):
    """The network session is closed, or could not be opened.

    Try: check the address and whether the router runs; do not use a node after its end.
    """


class AccessDeniedError(TransportError):
    """A name that the access rules of the other side forbid.

    Try: use a name that is allowed, or extend the `access` section of the router's configuration.

    Attributes:
        key: The forbidden key.
        allowed: The names that this program may use.
    """

    def __init__(
        self, key: str, who: str, allowed: tuple[str, ...], denied: tuple[str, ...]
    ) -> None:
        self.key = key
        self.allowed = allowed
        but = f" but {list(denied)}" if denied else ""
        super().__init__(
            f"{key}: access denied: got {who}; expected one who may use it, as this one may use "
            f"{list(allowed)}{but}. Try a namespace that is allowed, or another login."
        )


class WaitTimeoutError(ActionlibError, TimeoutError):
    """A wait has timed out.

    Try: start what was waited for; `actionlib list` shows who is there.
    """


class ServiceException(ActionlibError):  # noqa: N818  rospy's name
    """A service call failed.

    Try: read the text: it holds the error that the handler raised, if it raised one.

    Attributes:
        name: The service.
        reason: What happened.
        remote_type: Name of the exception that the handler raised; "" when it was not that.
        remote_text: Its text.
    """

    def __init__(
        self, name: str, reason: str, *, remote_type: str = "", remote_text: str = ""
    ) -> None:
        self.name = name
        self.reason = reason
        self.remote_type = remote_type
        self.remote_text = remote_text
        super().__init__(f"service /{name}: {reason}")


class ServiceUnavailableError(ServiceException):
    """There is no server.

    Try: start the server; `actionlib service list` shows those that run.
    """


class ServiceTimeoutError(ServiceException, TimeoutError):
    """The server did not answer in time.

    Try: allow more time with `timeout`, or look at what the handler waits for.
    """


class ServiceLostError(ServiceException):
    """The server died or left during the call.

    Try: call again if the call may be done twice; `retry=` of `ServiceState` does.
    """


class ServiceBusyError(ServiceException):
    """The server runs its largest number of calls already.

    Try: wait for answers before calling again, and do not call a service from its own handler.
    """


class ServiceConflictError(ServiceException):
    """Two servers have one name; this one has stopped, so that no call is executed twice.

    Try: end the other server, or give this one another name.

    Attributes:
        mine: (node, session) of the server that stopped.
        other: (node, session) of the one that keeps the name.
    """

    def __init__(self, name: str, mine: tuple[str, str], other: tuple[str, str]) -> None:
        self.mine = mine
        self.other = other
        super().__init__(name, _two_servers(mine, other))


class TypeMismatchError(ActionlibError, TypeError):
    """Two ends of a name have different types.

    Try: use the same definition on both sides, or give the two ends different names.

    Attributes:
        name: The name.
        expected_type: Our type, "pkg/Type".
        expected_md5: Its checksum: md5, or the type hash of ROS 2.
        found_type: The other end's type.
        found_md5: Its checksum.
    """

    def __init__(
        self,
        name: str,
        expected: tuple[str, str],
        found: tuple[str, str],
        *,
        by: str = "",
        way_out: str = "Try using one type on both ends, or another name.",
    ) -> None:
        self.name = name
        self.expected_type, self.expected_md5 = expected
        self.found_type, self.found_md5 = found
        whose = f" from {by}" if by else ""
        what = "md5" if len(expected[1]) == MD5_DIGITS else "type hash"
        super().__init__(
            f"{name}: types differ: got {found[0]!r} ({what} {found[1]}){whose}; "
            f"expected {expected[0]!r} ({what} {expected[1]}). {way_out}"
        )


class RemoteNodeError(ActionlibError):
    """A node of a ROS 2 robot refused requests.

    Try: correct each name or value that is listed; docs/ros2_nodes.md tells how to read them.

    Attributes:
        node: Its full name.
        problems: Name of a parameter or transition -> reason.
        values: Parameters that a ROS 1 node has set to others than it was told, as it limits them.
    """

    def __init__(
        self, node: str, problems: dict[str, str], values: dict[str, Any] | None = None
    ) -> None:
        self.node = node
        self.problems = problems
        self.values = values or {}
        super().__init__("\n".join(f"/{node}: {name}: {why}" for name, why in problems.items()))


class InterfaceError(ActionlibError):
    """A `.msg`, `.srv` or `.action` definition, or the name of one, cannot be used.

    Try: correct the line that is shown; `actionlib interface list` shows what is known.

    Attributes:
        problems: One text per problem, each with file, line, caret and what was expected.
    """

    def __init__(self, *problems: str) -> None:
        self.problems = problems
        super().__init__("\n".join(problems))


class FieldError(InterfaceError, TypeError):
    """Values do not fit the fields of a message that is written or filled.

    Try: correct each field that is named; `actionlib interface show TYPE` shows their types.

    Attributes:
        problems: One text per bad field, "pkg/Type: $.path.of.field: expected X, got Y".
    """


class CorrespondenceError(InterfaceError):
    """Fields of a message have no counterpart in the message that it is converted to.

    Try: convert only messages whose fields match, or fill the other message field by field.

    Attributes:
        problems: One text per field, "pkg/Type -> pkg/msg/Type: field: ...".
    """


class DeserializationError(ActionlibError, ValueError):
    """Received bytes are not a message of the expected type.

    Try: use the same version of the interface on both sides; `actionlib info NAME` shows the types.

    Attributes:
        type_name: The type that was expected, "pkg/Type"; of ROS 2 "pkg/msg/Type".
        size: Number of bytes received.
        reason: What does not fit.
    """

    def __init__(self, type_name: str, size: int, reason: str) -> None:
        self.type_name = type_name
        self.size = size
        self.reason = reason
        ros2 = type_name.count("/") > 1
        expected = (
            "CDR. Try comparing type and type hash"
            if ros2
            else ("the ROS 1 serialisation. Try comparing type and md5")
        )
        super().__init__(
            f"{type_name}: got {size} bytes that are no message of this type: {reason}; expected "
            f"{expected} at both ends."
        )


class Ros1Error(ActionlibError):
    """A ROS 1 master or node does not answer, refuses, or answers wrongly.

    Try: check `ROS_MASTER_URI` and `ROS_IP` of both computers; `smachpy bridge` prints its links.

    Attributes:
        peer: The address of the master or node, or the node's name.
        reason: The problem.
        refused: It has answered, and says no.
    """

    refused = False

    def __init__(self, peer: str, reason: str) -> None:
        self.peer = peer
        self.reason = reason
        super().__init__(f"{peer}: {reason}")


class ActionException(ActionlibError):  # noqa: N818  actionlib's name
    """Base class of the errors about actions.

    Try: see the error's own class.
    """


class IllegalTransitionError(ActionException):
    """A goal's state does not allow a transition.

    Try: call it in one of the states that are named; a goal ends once.

    Attributes:
        goal: The goal and its action, as text.
        state: Its present state.
        target: The requested state.
        call: The call that requested it.
        allowed: The states in which the call is allowed.
    """

    def __init__(self, goal: str, state: str, target: str, call: str, allowed: list[str]) -> None:
        self.goal = goal
        self.state = state
        self.target = target
        self.call = call
        self.allowed = allowed
        super().__init__(
            f"{goal}: cannot go {state} -> {target} on {call}; allowed from: {', '.join(allowed)}."
        )


class DurableGoalsError(ActionException):
    """The file of a durable action server cannot be used; nothing in it was changed.

    Try: read the reason; move the file away if its goals no longer matter.

    Attributes:
        file: The file.
    """

    def __init__(self, file: str, problem: str) -> None:
        self.file = file
        super().__init__(f"{file}: {problem}")


class ServerConflictError(ActionException):
    """Two action servers have one name; this one has stopped, so that no goal runs twice.

    Try: end the other server, or give this one another name.

    Attributes:
        name: The action's name.
        mine: (node, session) of the server that stopped.
        other: (node, session) of the one that keeps the name.
    """

    def __init__(self, name: str, mine: tuple[str, str], other: tuple[str, str]) -> None:
        self.name = name
        self.mine = mine
        self.other = other
        super().__init__(f"action {name!r}: {_two_servers(mine, other)}")


def _two_servers(mine: tuple[str, str], other: tuple[str, str]) -> str:
    return (
        f"two servers: got one of node '{mine[0]}' (session {mine[1]}) beside one of node "
        f"'{other[0]}' (session {other[1]}); expected one. Try another name or a namespace for "
        "this one, or end the other."
    )


class GoalFailedError(ActionException):
    """The end of a goal was not SUCCEEDED, or its result is no longer known.

    Try: look at `status` and `text`: the server says why. `retry=` tries again.

    Attributes:
        name: The action's name.
        status: The goal's final status, for example "ABORTED".
        text: The text of that status.
        result: The result message, or None.
    """

    def __init__(self, name: str, goal_id: str, status: str, text: str, result: object) -> None:
        self.name = name
        self.goal_id = goal_id
        self.status = status
        self.text = text
        self.result = result
        # A server forgets results in time, so that a goal may have succeeded and have none.
        got, expected = status, "SUCCEEDED"
        if status == expected:
            got, expected = f"{status} without a result", "its result"
        # The text is the server's own, and may be a sentence with its own "got" and "expected".
        said = f"Its text: {text}" if text else "It has no text."
        super().__init__(f"goal {goal_id} on '{name}': got {got}; expected {expected}. {said}")


class InterfaceWarning(UserWarning):
    """A definition was accepted although it deviates from ROS's format."""


class GoalTimeoutError(GoalFailedError, TimeoutError):
    """A goal took longer than the caller allowed, and was cancelled.

    Try: allow more time, or look at what the server does: `actionlib goal list`.

    Attributes:
        timeout: The allowed time [s].
    """

    def __init__(
        self, name: str, goal_id: str, status: str, timeout: float, *, accepted: bool = True
    ) -> None:
        self.timeout = timeout
        what = "not over" if accepted else "no server accepted it"
        text = f"{what} within {timeout:g} s, so it was cancelled"
        super().__init__(name, goal_id, status, text, None)
