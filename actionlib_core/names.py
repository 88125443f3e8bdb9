"""ROS names: the rules, namespaces, private names, and remapping from the command line.

Full names have no leading slash here: `robot_1/move_base` is the ROS name `/robot_1/move_base` and
also its key on the network.

Source:
    https://wiki.ros.org/Names (valid names, resolving, remapping arguments) and, for
    `--ros-args`, https://design.ros2.org/articles/ros_command_line_arguments.html.
"""

from __future__ import annotations

import re
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.exceptions import InvalidNameError, NameSetupError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

_FORBIDDEN = re.compile(r"[^A-Za-z0-9_/~]")
_replacement: list[Callable[[str, str], str]] = []
_EMPTY: Mapping[str, str] = MappingProxyType({})


def set_name_replacement(replace: Callable[[str, str], str] | None) -> None:
    """Let `replace(name, kind)` replace names that the ROS rules forbid; None: refuse them.

    The rules were only a warning in rospy, so programs for ROS 1 have such names.
    """
    _replacement[:] = [] if replace is None else [replace]


def check_name(name: str, kind: str = "name") -> str:
    """Return `name` if the ROS rules allow it; see also `set_name_replacement`.

    Args:
        name: Relative (`move_base`), absolute (`/robot_1/move_base`) or private (`~goal`).
        kind: What it names, for the error text: "action name", "topic name".

    Raises:
        InvalidNameError: a rule is broken; the text marks the first offending character.
    """
    made, problem = name, _find_problem(name)
    if problem is not None and _replacement:
        made = _replacement[0](name, kind)
        problem = None if _find_problem(made) is None else problem
    if problem is not None:
        reason, index = problem
        raise InvalidNameError(name, kind, reason, index)
    return made


def _find_problem(name: str) -> tuple[str, int] | None:
    if not name:
        return "it is empty", 0
    # All problems are found, and that of the first position is reported.
    problems = [
        (match.start(), f"{match.group()!r} is not allowed; expected letters, digits, '_' or '/'")
        for match in [_FORBIDDEN.search(name)]
        if match is not None
    ]
    first = name[0]
    if first.isdigit():
        problems.append((0, "it must not start with a digit; expected a letter, '_', '/' or '~'"))
    for text, reason in (("//", "'//' is not allowed"), ("~", "'~' is allowed in front only")):
        found = name.find(text, 1 if text == "~" else 0)
        if found >= 0:
            problems.append((found, reason))
    if name == "/" or name.endswith("/"):
        problems.append((len(name) - 1, "it must not end with '/'"))
    if name == "~":
        problems.append((0, "'~' alone names nothing"))
    if not problems:
        return None
    index, reason = min(problems)
    return reason, index


def check_base_name(name: str, kind: str = "node name") -> str:
    """Return `name` as `check_name` does, if it is one word, without slash and tilde.

    Raises:
        InvalidNameError: it is not.
    """
    for char in "/~":
        if char in name:
            reason = f"{char!r} is not allowed; expected one word. Try a namespace"
            raise InvalidNameError(name, kind, reason, name.index(char))
    return check_name(name, kind)


def clean_namespace(namespace: str) -> str:
    """Return a namespace without outer slashes; "" and "/" are the root.

    Raises:
        InvalidNameError: it is not a valid name, or private.
    """
    if namespace in {"", "/"}:
        return ""
    trimmed = check_name(namespace.rstrip("/") or namespace, "namespace")
    if trimmed.startswith("~"):
        raise InvalidNameError(namespace, "namespace", "'~' is not allowed", 0)
    return trimmed.lstrip("/")


def resolve_name(
    name: str,
    *,
    namespace: str = "",
    node: str = "",
    remappings: Mapping[str, str] = _EMPTY,
    kind: str = "name",
) -> str:
    """Return the full name, without a slash in front.

    Args:
        name: Relative, absolute or private name.
        namespace: Prefix of relative names, without outer slashes.
        node: Full name of the node, the prefix of private names.
        remappings: Full name -> full name; applied once, after resolving.
        kind: What it names, for the error text.

    Raises:
        InvalidNameError: the name breaks the rules.
    """
    name = check_name(name, kind)
    if name[0] == "/":
        full = name[1:]
    elif name[0] == "~":
        private = name[1:].lstrip("/")
        full = f"{node}/{private}" if node else private
    else:
        full = f"{namespace}/{name}" if namespace else name
    return remappings.get(full, full)


class RemapRule(NamedTuple):
    """One `from:=to` of a command line.

    Attributes:
        old: Left side: a name, `__ns`, `__node` or `__name`.
        new: Right side.
        node: The only node that it applies to; "": all nodes.
    """

    old: str
    new: str
    node: str = ""


class NameArguments(NamedTuple):
    """The arguments about names of a command line.

    Attributes:
        rules: In the order of the command line.
        rest: The program's own arguments, which are not about names (`rospy.myargv`).
        parameters: The arguments `_name:=value` of ROS 1, unchanged.
    """

    rules: tuple[RemapRule, ...] = ()
    rest: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()

    def node_name(self, name: str) -> str:
        """Return the name of the node that the program calls `name`."""
        return self._last(("__node", "__name"), name) or name

    def namespace(self, name: str) -> str | None:
        """Return the namespace of the node that the program calls `name`; None: not given."""
        return self._last(("__ns",), name)

    def _last(self, settings: tuple[str, ...], node: str) -> str | None:
        found = [r.new for r in self.rules if r.old in settings and r.node in {"", node}]
        return found[-1] if found else None

    def remappings(self, name: str, *, namespace: str, node: str) -> dict[str, str]:
        """Return the remappings of a node, full name -> full name; the first rule wins.

        Args:
            name: The node's name in the program.
            namespace: Its namespace, without outer slashes.
            node: Its full name.
        """
        result: dict[str, str] = {}
        for rule in self.rules:
            if rule.node in {"", name} and not rule.old.startswith("__"):
                old = resolve_name(rule.old, namespace=namespace, node=node)
                result.setdefault(old, resolve_name(rule.new, namespace=namespace, node=node))
        return result


class _Collected:
    """The parts of the command line read so far."""

    def __init__(self) -> None:
        self.rules: list[RemapRule] = []
        self.rest: list[str] = []
        self.problems: list[str] = []
        self.parameters: list[str] = []

    def take_rule(self, text: str, *, node: str = "") -> None:
        """Read one `from:=to`; parameters are stored unchanged, unknown `__settings` ignored."""
        old, _, new = text.partition(":=")
        try:
            if old == "__ns":
                clean_namespace(new)
            elif old in {"__node", "__name"}:
                check_base_name(new)
            elif old.startswith("_"):
                if not old.startswith("__"):
                    self.parameters.append(text)
                return
            else:
                check_name(old, "remapped name")
                check_name(new, "remapped name")
        except NameSetupError as error:
            self.problems.append(f"argument {text!r}: {error}")
        else:
            self.rules.append(RemapRule(old, new, node))

    def take_ros_args(self, arguments: Sequence[str]) -> None:
        """Read the arguments between `--ros-args` and `--`."""
        queue = list(arguments)
        while queue:
            flag = queue.pop(0)
            if flag in {"-r", "--remap"}:
                text = queue.pop(0) if queue else ""
                if ":=" in text:
                    node, rule = _split_node(text)
                    self.take_rule(rule, node=node)
                else:
                    self.problems.append(
                        f"argument {flag!r}: no rule follows: got {text!r}; expected from:=to"
                    )
            elif flag in _FLAGS_WITH_VALUE and queue:
                queue.pop(0)
            # All other flags concern logging and parameters, and are ignored.


_FLAGS_WITH_VALUE = frozenset({
    "-p", "--param", "--params-file", "--log-level", "--log-config-file", "-e", "--enclave",
})  # fmt: skip


def _split_node(text: str) -> tuple[str, str]:
    """Split `talker:chatter:=news`, a rule for one node, into node and rule."""
    old, _, new = text.partition(":=")
    node, _, old = old.rpartition(":")
    return node, f"{old}:={new}"


def parse_arguments(argv: Sequence[str]) -> NameArguments:
    """Read remapping from a command line, in the style of ROS 1 and of ROS 2.

    ROS 1: `a:=b __ns:=/robot_1 __name:=patrol`; `_param:=value` is stored unchanged, unknown ones
    such as `__log:=...` are ignored. ROS 2: `--ros-args -r a:=b -r __ns:=/robot_1 -r
    __node:=patrol [--]`.

    Args:
        argv: The arguments, with or without the program's name.

    Raises:
        NameSetupError: some are malformed; the text lists all of them.
    """
    collected = _Collected()
    position = 0
    while position < len(argv):
        argument = argv[position]
        position += 1
        if argument == "--ros-args":
            end = _find(argv, "--", position)
            collected.take_ros_args(argv[position:end])
            position = end + 1
        elif is_rule(argument):
            collected.take_rule(argument)
        else:
            collected.rest.append(argument)
    if collected.problems:
        raise NameSetupError(*collected.problems)
    return NameArguments(tuple(collected.rules), tuple(collected.rest), tuple(collected.parameters))


def is_rule(argument: str) -> bool:
    """Return whether an argument is a rule `a:=b`, not a text with `:=` such as YAML."""
    old, sign, _ = argument.partition(":=")
    return bool(sign) and not re.search(r"[\s{}\[\]\"'=]|^-", old)


def _find(argv: Sequence[str], what: str, start: int) -> int:
    for position in range(start, len(argv)):
        if argv[position] == what:
            return position
    return len(argv)
