"""ROS 2's message, service and action classes, one registry per distribution.

The bundled definitions are in one file per ROS package in `ros2/definitions`; each entry lists its
distributions. Your own files are found by `Sources` and parsed in ROS 2's dialect.
"""

from __future__ import annotations

import functools
import os
import re
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, cast

from actionlib_core.exceptions import InterfaceError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces._cdr import make_cdr_codecs
from actionlib_core.interfaces._definition import parse
from actionlib_core.interfaces._message import Message, Ros2Message, make_class
from actionlib_core.interfaces._registry import ROOT, Registry, UnknownTypeError, registry
from actionlib_core.interfaces._rihs01 import rihs01_of
from actionlib_core.interfaces._sources import (
    ACTION_PARTS,
    BUNDLED,
    SERVICE_PARTS,
    Kind,
    Source,
    Sources,
    action_messages,
)

if TYPE_CHECKING:
    from actionlib_core.interfaces._definition import Definition

DISTROS = ("humble", "jazzy", "kilted", "lyrical", "rolling")
"""The distributions whose definitions are known, oldest first."""
DISTRO_VARIABLE = "SMACHPY_ROS2_DISTRO"
DEFAULT_DISTRO = "jazzy"
NO_HASH = "TypeHashNotSupported"
"""Used instead of a type hash by Humble, which has none."""

_DEFINITIONS = Path(__file__).parent / "ros2" / "definitions"
_ENTRY = re.compile(r"=== (msg|srv|action)/(\w+)(?:: ([a-z ]+))?\Z")
_SERVICE_ENDS = tuple(f"_{part.title()}" for part in SERVICE_PARTS)
_ACTION_ENDS = tuple(f"_{part.title()}" for part in ACTION_PARTS)
_UUID = "unique_identifier_msgs/UUID goal_id"
_DERIVED = {
    "_SendGoal_Request": f"{_UUID}\n{{0}}_Goal goal",
    "_SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
    "_GetResult_Request": _UUID,
    "_GetResult_Response": "int8 status\n{0}_Result result",
    "_FeedbackMessage": f"{_UUID}\n{{0}}_Feedback feedback",
}
"""The messages around an action's goal, result and feedback. Source: rosidl_parser."""


class _Hash:
    """The attribute `_rihs01` of a class, computed on first use: few classes need their own."""

    def __get__(self, instance: object, owner: Any) -> str:
        value: str = owner._registry.hash(owner._type)
        return value


class Ros2Service:
    """Base of ROS 2's service classes; a class is a pair of message classes, never instantiated."""

    __slots__: ClassVar[Any] = ()
    __test__: ClassVar[bool] = False  # for pytest, as in `Message`
    _wire: ClassVar[str] = "ros2"
    _type: ClassVar[str]
    """ROS name, "pkg/srv/Name"."""
    _rihs01: ClassVar[str]
    """Type hash of the service."""
    _distro: ClassVar[str]
    Request: ClassVar[type[Ros2Message]]
    Response: ClassVar[type[Ros2Message]]
    _request_class: ClassVar[type[Ros2Message]]
    _response_class: ClassVar[type[Ros2Message]]


class Ros2Action:
    """Base of ROS 2's action classes, which clients and servers accept like ROS 1's `XAction`.

    As in ROS 1, an object has `action_goal`, `action_result` and `action_feedback`, with
    actionlib's goal id or status. These three are never sent.
    """

    __test__: ClassVar[bool] = False  # for pytest, as in `Message`
    _wire: ClassVar[str] = "ros2"
    _type: ClassVar[str]
    """ROS name, "pkg/action/Name"."""
    _rihs01: ClassVar[str]
    """Type hash of the action as a whole, which no key contains."""
    _distro: ClassVar[str]
    Goal: ClassVar[type[Ros2Message]]
    Result: ClassVar[type[Ros2Message]]
    Feedback: ClassVar[type[Ros2Message]]
    _parts: ClassVar[tuple[type[Message], type[Message], type[Message]]]

    action_goal: Any
    action_result: Any
    action_feedback: Any

    def __init__(self) -> None:
        self.action_goal, self.action_result, self.action_feedback = (
            part() for part in self._parts
        )


class ServiceParts(NamedTuple):
    """One service of an action.

    Attributes:
        type: "pkg/action/X_SendGoal" or "action_msgs/srv/CancelGoal".
        hash: Its type hash.
        request: Class of the request.
        response: Class of the response.
    """

    type: str
    hash: str
    request: Any
    response: Any


class TopicParts(NamedTuple):
    """One topic of an action.

    Attributes:
        type: "pkg/action/X_FeedbackMessage" or "action_msgs/msg/GoalStatusArray".
        hash: Its type hash.
        message: Its class.
    """

    type: str
    hash: str
    message: Any


class ActionParts(NamedTuple):
    """The three services and two topics of an action, with the class of the action itself."""

    action: type[Ros2Action]
    send_goal: ServiceParts
    get_result: ServiceParts
    cancel_goal: ServiceParts
    feedback: TopicParts
    status: TopicParts


class _RosType(NamedTuple):
    distros: tuple[str, ...]
    source: Source
    first_line: int


@functools.cache
def _entries(package: str) -> dict[tuple[str, str], list[_RosType]]:
    """Read the bundled definitions of a package, by kind and name."""
    path = _DEFINITIONS / f"{package}.txt"
    found: dict[tuple[str, str], list[_RosType]] = {}
    # Unlike `Path.is_file`, this is False also for a name that no file can have.
    if not package.isidentifier() or not os.path.isfile(path):  # noqa: PTH113
        return found
    lines = path.read_text(encoding="utf-8").splitlines()
    starts = [number for number, line in enumerate(lines) if _ENTRY.match(line)]
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        heading = _ENTRY.match(lines[start])
        assert heading is not None
        distros = tuple((heading[3] or " ".join(DISTROS)).split())
        source = Source("\n".join(lines[start + 1 : end]).rstrip() + "\n", str(path))
        entry = _RosType(distros, source, start + 2)
        found.setdefault((heading[1], heading[2]), []).append(entry)
    return found


class Ros2Sources(Sources):
    """Finds ROS 2 definitions: yours as `Sources` finds them, then the bundled ones.

    Args:
        distro: The distribution of the bundled ones, one of `DISTROS`.
        ours: Search only the bundled ones.
    """

    def __init__(self, distro: str, *, ours: bool = False) -> None:
        super().__init__()
        self._distro = distro
        self._ours = ours

    def search_path(self) -> list[Path]:
        if self._ours:
            return []
        return [path for path in registry.sources.search_path() if path != BUNDLED]

    def find(self, kind: Kind, package: str, name: str) -> Source | None:
        return super().find(kind, package, name) or next(
            (entry.source for entry in self._bundled(package).get((kind, name), [])), None
        )

    def first_line(self, source: Source, kind: Kind, package: str, name: str) -> int:
        """Return the number of a definition's first line in its file."""
        entries = self._bundled(package).get((kind, name), [])
        return next((entry.first_line for entry in entries if entry.source is source), 1)

    def packages(self) -> list[str]:
        ours = {path.stem for path in _DEFINITIONS.glob("*.txt")}
        return sorted({*super().packages(), *(p for p in ours if self._bundled(p))})

    def has_package(self, package: str) -> bool:
        return bool(self._bundled(package)) or super().has_package(package)

    def names(self, kind: Kind, package: str) -> list[str]:
        ours = {name for found, name in self._bundled(package) if found == kind}
        return sorted({*super().names(kind, package), *ours})

    def _bundled(self, package: str) -> dict[tuple[str, str], list[_RosType]]:
        fitting = {
            key: [entry for entry in entries if self._distro in entry.distros]
            for key, entries in _entries(package).items()
        }
        return {key: entries for key, entries in fitting.items() if entries}


class Ros2Registry(Registry):
    """Makes ROS 2's classes of one distribution.

    Names are "pkg/kind/Name"; without a kind, the first kind that has the name is used.

    Args:
        distro: One of `DISTROS`.
        ours: As for `Ros2Sources`.
    """

    def __init__(self, distro: str, *, ours: bool = False) -> None:
        self._ros2_sources = Ros2Sources(distro, ours=ours)
        super().__init__(self._ros2_sources)
        self.distro = distro
        self._ros2_services: dict[str, type[Ros2Service]] = {}
        self._actions: dict[str, type[Ros2Action]] = {}
        self._hashes: dict[str, str] = {}

    def message(self, name: str) -> type[Ros2Message]:
        found = self._messages.get(name)
        if found is None:
            with self._lock:
                package, kind, short = self._full("message", name, ("msg", "srv", "action"))
                full = f"{package}/{kind}/{short}"
                found = self._messages.get(full) or self._make_ros2(package, kind, short)
        return cast("type[Ros2Message]", found)

    def service(self, name: str) -> Any:
        """Return a service class by ROS name; also the two services of an action's own type."""
        with self._lock:
            package, kind, short = self._full("service", name, ("srv",))
            full = f"{package}/{kind}/{short}"
            if full not in self._ros2_services:
                classes = [self.message(f"{full}{end}") for end in _SERVICE_ENDS]
                self._ros2_services[full] = self._composed(
                    Ros2Service,
                    full,
                    dict(zip(("Request", "Response"), classes, strict=True))
                    | {"_request_class": classes[0], "_response_class": classes[1]},
                )
            return self._ros2_services[full]

    def action(self, name: str) -> Any:
        """Return an action's class `X` by ROS name."""
        with self._lock:
            package, kind, short = self._full("action", name, ("action",))
            full = f"{package}/{kind}/{short}"
            if full not in self._actions:
                classes = [self.message(f"{full}{end}") for end in _ACTION_ENDS]
                attributes = dict(zip(("Goal", "Result", "Feedback"), classes, strict=True))
                parts = self._action_parts(package, short, classes)
                self._actions[full] = self._composed(
                    Ros2Action, full, {**attributes, "_parts": parts}
                )
            return self._actions[full]

    def parts(self, action: type[Ros2Action]) -> ActionParts:
        """Return the services and topics of an action."""
        of = action._type

        def service(full: str, hashed: str) -> ServiceParts:
            request, response = (self.message(f"{full}{end}") for end in _SERVICE_ENDS)
            return ServiceParts(full, hashed, request, response)

        def topic(full: str) -> TopicParts:
            message = self.message(full)
            return TopicParts(full, message._rihs01, message)

        cancel = "action_msgs/srv/CancelGoal"
        return ActionParts(
            action=action,
            send_goal=service(f"{of}_SendGoal", self.hash(f"{of}_SendGoal")),
            get_result=service(f"{of}_GetResult", self.hash(f"{of}_GetResult")),
            cancel_goal=service(cancel, self.service(cancel)._rihs01),
            feedback=topic(f"{of}_FeedbackMessage"),
            status=topic("action_msgs/msg/GoalStatusArray"),
        )

    def defines(self, full: str) -> bool:
        """Return whether a type is defined, by its name in keys and tokens; any text is accepted.

        It is much faster than to catch the error about an unknown type, which suggests others.
        """
        match = _NAME.match(full)
        if match is None or match[2] is None:
            return False
        package, kind, short = match[1], cast("Kind", match[2]), match[3]
        # Parts of services and actions have the name of these in front: `X_SendGoal_Request`.
        return any(
            self.sources.find(kind, package, name) is not None
            for name in (short, short.partition("_")[0])
        )

    def hash(self, full: str) -> str:
        """Return the type hash of "pkg/kind/Name", also of a type that has no class.

        Raises:
            InterfaceError: No such type, or not such a name.
        """
        if self.distro == "humble":
            return NO_HASH
        if full not in self._hashes:
            # Names in tokens of other programs may be any text.
            if parse_ros2_name(full)[1] is None:
                raise InterfaceError(
                    f"interface name: got {full!r}; expected 'package/msg/Name' (or srv, action)"
                )
            self._hashes[full] = rihs01_of(full, self.fields)
        return self._hashes[full]

    def fields(self, full: str) -> list[tuple[str, str]]:
        """Return (type, full name) of each field of a type, for its hash.

        For its hash, a service is a message with request, response and event, and an action is a
        message with its parts (REP 2016).

        Raises:
            InterfaceError: No such type.
        """
        package, kind, short = full.split("/")
        if kind == "srv" or short.endswith(("_SendGoal", "_GetResult", "_Event")):
            # The event is a message that ROS 2 adds for introspection; only the hash needs it.
            if short.endswith("_Event"):
                base = full.removesuffix("_Event")
                return [
                    ("service_msgs/msg/ServiceEventInfo", "info"),
                    (f"{base}_Request[<=1]", "request"),
                    (f"{base}_Response[<=1]", "response"),
                ]
            if not short.endswith(_SERVICE_ENDS):
                parts = ("Request", "Response", "Event")
                return [(f"{full}_{part}", f"{part.lower()}_message") for part in parts]
        if kind == "action" and self.sources.find("action", package, short) is not None:
            return [
                *((f"{full}_{part.title()}", part) for part in ACTION_PARTS),
                (f"{full}_SendGoal", "send_goal_service"),
                (f"{full}_GetResult", "get_result_service"),
                (f"{full}_FeedbackMessage", "feedback_message"),
            ]
        return [(str(field.type), field.name) for field in self.message(full)._definition.fields]

    def names(self, kind: Kind, package: str) -> list[str]:
        """Return the class names of `pkg.msg`, `pkg.srv` or `pkg.action`."""
        ends = {"msg": (), "srv": _SERVICE_ENDS, "action": _ACTION_ENDS}[kind]
        return [f"{name}{end}" for name in self.sources.names(kind, package) for end in ("", *ends)]

    def attribute(self, package: str, kind: Kind, name: str) -> Any:
        if self.sources.find(kind, package, name) is None:
            return self.message(f"{package}/{kind}/{name}")
        make = {"msg": self.message, "srv": self.service, "action": self.action}[kind]
        return make(f"{package}/{kind}/{name}")

    def _built(self, kind: Kind, package: str, short: str) -> Any:
        return self.attribute(package, kind, short)

    def _full(self, what: str, name: str, kinds: tuple[Kind, ...]) -> tuple[str, Kind, str]:
        """Complete a name with the kind of its definition; raises when there is none."""
        package, given, short = parse_ros2_name(name)
        for kind in [k for k in kinds if given in {None, k}]:
            if what != "message" or kind == "msg":
                if self.sources.find(kind, package, short) is not None:
                    return package, kind, short
            # A part of a service or action has no definition of its own name.
            elif self._part(package, kind, short) is not None:
                return package, kind, short
        raise UnknownTypeError(self._unknown(what, name), name)

    def _part(self, package: str, kind: Kind, short: str) -> tuple[Source, int] | None:
        """Return the text and first line of a part of a service or action."""
        ends = _SERVICE_ENDS if kind == "srv" else _ACTION_ENDS
        for end in ends:
            base = short.removesuffix(end)
            source = self.sources.find(kind, package, base) if base != short else None
            if source is not None:
                section = self.sources.sections(kind, package, base)[end[1:].lower()]
                first = self._ros2_sources.first_line(source, kind, package, base)
                return Source(section.text, source.origin), first + section.first_line - 1
        for end, text in _DERIVED.items() if kind == "action" else ():
            base = short.removesuffix(end)
            source = self.sources.find(kind, package, base) if base != short else None
            if source is not None:
                inner = f"{package}/action/{base}"
                return Source(text.format(inner), source.origin), 1
        return None

    def _make_ros2(self, package: str, kind: Kind, short: str) -> type[Message]:
        full = f"{package}/{kind}/{short}"
        if kind == "msg":
            source = self.sources.find(kind, package, short)
            assert source is not None
            first_line = self._ros2_sources.first_line(source, kind, package, short)
        else:
            part = self._part(package, kind, short)
            assert part is not None
            source, first_line = part
        return self._build(
            full,
            source,
            first_line,
            module=self._module(package, kind),
            base=Ros2Message,
            make=make_cdr_codecs,
            _distro=self.distro,
            _registry=self,
            _rihs01=_Hash(),
        )

    def _checksum(self, definition: Definition) -> _Hash:  # noqa: ARG002  of the base class
        return _Hash()

    def _composed(self, base: Any, full: str, attributes: dict[str, Any]) -> Any:
        package, kind, short = full.split("/")
        what = "service" if kind == "srv" else "action"
        namespace = {
            "__module__": self._module(package, cast("Kind", kind)),
            "__doc__": f"The ROS 2 {what} {full}.",
            "_type": full,
            "_distro": self.distro,
            "_registry": self,
            "_rihs01": _Hash(),
            "_md5sum": _Hash(),
        }
        return type(short, (base,), namespace | attributes)

    def _action_parts(
        self, package: str, short: str, classes: list[type[Ros2Message]]
    ) -> tuple[type[Message], ...]:
        """Make the classes of `action_goal`, `action_result` and `action_feedback`."""
        inner = {
            f"{package}/{short}{part.title()}": cls
            for part, cls in zip(ACTION_PARTS, classes, strict=True)
        }

        def resolve(name: str) -> type[Message]:
            return inner.get(name) or registry.message(name)

        texts = action_messages(short)
        return tuple(
            make_class(
                parse(f"{package}/{short}Action{part}", texts[f"{short}Action{part}"]),
                resolve,
                module=self._module(package, "action"),
                _wire="ros2",
            )
            for part in ("Goal", "Result", "Feedback")
        )

    def _module(self, package: str, kind: Kind) -> str:
        return f"{ROOT}.ros2.{package}.{kind}"

    def _unknown(self, what: str, full: str) -> str:
        known = [
            f"{package}/{kind}/{name}"
            for package in self.sources.packages()
            for kind in ("msg", "srv", "action")
            if what in {"message", "type", {"srv": "service"}.get(kind, kind)}
            for name in self.names(kind, package)
        ]
        others = [d for d in DISTROS if d != self.distro and _defines(d, full)]
        hint = f" ROS 2 {', '.join(map(str.title, others))} has it." if others else ""
        return (
            f"unknown {what}: got {full!r}; expected one that ROS 2 {self.distro.title()} has, or "
            f"one of yours.{hint or did_you_mean(full, known, most=3)} Folders are added by "
            "SMACHPY_INTERFACE_PATH or interfaces.add_path()."
        )


def _defines(distro: str, full: str) -> bool:
    try:
        package, given, short = parse_ros2_name(full)
    except InterfaceError:
        return False
    return any(
        (given in {None, kind}) and name == short and any(distro in e.distros for e in entries)
        for (kind, name), entries in _entries(package).items()
    )


def is_only_ros2(package: str) -> bool:
    """Return whether the bundled definitions have a package for ROS 2 only."""
    return bool(_entries(package)) and not (BUNDLED / package).is_dir()


_NAME = re.compile(r"([a-z][a-z0-9_]*)/(?:(msg|srv|action)/)?([A-Za-z][A-Za-z0-9_]*)\Z")


def parse_ros2_name(name: str) -> tuple[str, str | None, str]:
    """Split "pkg/Name" or "pkg/msg/Name" into package, kind (or None) and short name.

    Raises:
        InterfaceError: Neither form.
    """
    match = _NAME.match(name)
    if match is None:
        raise InterfaceError(
            f"interface name: got {name!r}; expected 'package/msg/Name' (or srv, action)"
        )
    return match[1], match[2], match[3]


_registries: dict[str, Ros2Registry] = {}
_lock = threading.Lock()
_default = ""


def ros2_registry(distro: str | None = None) -> Ros2Registry:
    """Return the classes of a distribution; None: the default one.

    Raises:
        InterfaceError: Not one of `DISTROS`.
    """
    wanted = distro or default_distro()
    if wanted not in DISTROS:
        raise InterfaceError(
            f"distro: got {wanted!r}; expected one of {', '.join(DISTROS)}."
            + did_you_mean(wanted, DISTROS)
        )
    with _lock:
        if wanted not in _registries:
            _registries[wanted] = Ros2Registry(wanted)
        return _registries[wanted]


def default_distro() -> str:
    """Return the default distribution: the one that was set, or that of the environment."""
    return _default or os.environ.get(DISTRO_VARIABLE, "").strip().lower() or DEFAULT_DISTRO


def set_default_distro(distro: str) -> None:
    """Set the default distribution of classes that are looked up from now on.

    Raises:
        InterfaceError: Not one of `DISTROS`.
    """
    global _default  # noqa: PLW0603 # one per process, as the environment variable
    _default = ros2_registry(distro).distro
