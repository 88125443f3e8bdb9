"""The message, service and action classes of this process, made on first use."""

from __future__ import annotations

import hashlib
import re
import threading
from typing import TYPE_CHECKING, Any, ClassVar

from actionlib_core.exceptions import InterfaceError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces._definition import (
    BUILTINS,
    MAX_TYPE_NESTING,
    NESTED,
    Definition,
    Extent,
    field_extent,
    find_excess,
    message_extent,
    parse,
    too_many,
)
from actionlib_core.interfaces._message import Message, make_class
from actionlib_core.interfaces._sources import PATH_VARIABLE, Kind, Source, Sources

if TYPE_CHECKING:
    import os

ROOT = __name__.rpartition(".")[0]
"""The package below which every interface package can be imported."""

_NAME = re.compile(r"([A-Za-z][A-Za-z0-9_]*)/(?:(msg|srv|action)/)?([A-Za-z][A-Za-z0-9_]*)\Z")


class ServiceType:
    """Base of all service classes; a class is a pair of message classes, never instantiated."""

    __slots__: ClassVar[Any] = ()
    __test__: ClassVar[bool] = False  # for pytest, as in `Message`
    _wire: ClassVar[str] = "ros1"
    _type: ClassVar[str]
    """ROS name, "pkg/Name"."""
    _md5sum: ClassVar[str]
    """ROS 1 checksum over request and response."""
    _request_class: ClassVar[Any]  # the stubs of the services say which
    _response_class: ClassVar[Any]

    if TYPE_CHECKING:

        @staticmethod
        def _call(*args: Any, **kwargs: Any) -> tuple[Any, Any]:
            """Only in the stubs: arguments of the request; the request and the response."""


class UnknownTypeError(InterfaceError):
    """There is no definition of the type `name`.

    Try: check the spelling; `SMACHPY_INTERFACE_PATH` names folders with definitions.
    """

    def __init__(self, text: str, name: str) -> None:
        self.name = name
        super().__init__(text)


class Registry:
    """Makes classes from definitions, each once.

    Threads: all methods may be called from any thread.
    """

    def __init__(self, sources: Sources | None = None) -> None:
        self.sources = sources or Sources()
        self._lock = threading.RLock()
        self._messages: dict[str, type[Message]] = {}
        self._services: dict[str, type[ServiceType]] = {}
        self._extents: dict[str, Extent] = {}
        self._building: list[str] = []  # types whose classes are being made, outermost first

    def message(self, name: str) -> type[Message]:
        """Return a message class by ROS name; parts of services and actions included.

        Raises:
            InterfaceError: Unknown, malformed, or it contains itself.
        """
        package, _, short = parse_name(name)
        full = f"{package}/{short}"
        found = self._messages.get(full)
        if found is None:
            with self._lock:
                found = self._messages.get(full) or self._make(package, short)
        return found

    def service(self, name: str) -> type[ServiceType]:
        """Return a service class by ROS name; raises as `message`."""
        package, _, short = parse_name(name)
        full = f"{package}/{short}"
        with self._lock:
            if full not in self._services:
                if self.sources.find("srv", package, short) is None:
                    raise InterfaceError(self._unknown("service", full))
                self._services[full] = self._make_service(package, short)
            return self._services[full]

    def action(self, name: str) -> type[Message]:
        """Return an action's class `XAction`, by the name "pkg/X" or "pkg/XAction".

        Raises:
            InterfaceError: As `message`.
        """
        package, _, short = parse_name(name)
        for base in (short, short.removesuffix("Action")):
            if self.sources.find("action", package, base) is not None:
                return self.message(f"{package}/{base}Action")
        raise InterfaceError(self._unknown("action", f"{package}/{short}"))

    def define(self, kind: Kind, name: str, text: str) -> type[Message | ServiceType]:
        """Define an interface by its text and return its class.

        The same name and text again returns the class made first.

        Raises:
            InterfaceError: Malformed text, or the name has another definition already.
        """
        package, given, short = parse_name(name)
        if given not in {None, kind}:
            raise InterfaceError(f"define: got {name!r}; expected {package}/{kind}/{short}")
        with self._lock:
            # A class that was made stays, so its name cannot get another definition.
            before = self.sources.find(kind, package, short)
            if before is not None and before.text != text:
                raise InterfaceError(
                    f"define: got {name!r}, which {before.origin} defines differently; expected a "
                    "new name or the same text"
                )
            made = [f"{package}/{short}{end}" for end in _ENDS[kind]]
            if before is None and (taken := [n for n in made if n in self._messages]):
                raise InterfaceError(
                    f"define: got {name!r}, but there is {taken[0]!r} already; expected a new name"
                )
            if before is None:
                self.sources.define(kind, package, short, text)
            try:
                return self._built(kind, package, short)
            except InterfaceError:
                if before is None:
                    self.sources.forget(kind, package, short)
                    # Those parts that were valid must not be used for the next definition.
                    for full in made:
                        self._messages.pop(full, None)
                raise

    def add_definition(self, kind: Kind, name: str, text: str, origin: str) -> None:
        """Register a definition, which is parsed on first use; an existing one is kept."""
        package, _, short = parse_name(name)
        with self._lock:
            if self.sources.find(kind, package, short) is None:
                self.sources.define(kind, package, short, text, origin)

    def add_path(self, folder: str | os.PathLike[str]) -> None:
        """Search a folder before those known so far; classes already made stay."""
        with self._lock:
            self.sources.add_path(folder)

    def names(self, kind: Kind, package: str) -> list[str]:
        """Return the class names of `pkg.msg` (kind "msg", actions included) or `pkg.srv`."""
        with self._lock:
            if kind == "srv":
                services = self.sources.names("srv", package)
                return [f"{n}{end}" for n in services for end in ("", "Request", "Response")]
            actions = [
                f"{name}{end}"
                for name in self.sources.names("action", package)
                for end in _ACTION_ENDS
            ]
            # A build folder of ROS has the parts of actions as files too.
            return list(dict.fromkeys([*self.sources.names("msg", package), *actions]))

    def attribute(self, package: str, kind: Kind, name: str) -> type:
        """Return the class `pkg.msg.name` or `pkg.srv.name`; raises as `message`."""
        if kind == "srv" and self.sources.find("srv", package, name) is not None:
            return self.service(f"{package}/{name}")
        return self.message(f"{package}/{name}")

    def _built(self, kind: Kind, package: str, short: str) -> type[Message | ServiceType]:
        if kind == "srv":
            return self.service(f"{package}/{short}")
        return self.message(f"{package}/{short}{'Action' if kind == 'action' else ''}")

    def _make(self, package: str, short: str) -> type[Message]:
        full = f"{package}/{short}"
        section, found = "msg", self.sources.message_source(package, short)
        if found is None:
            section, found = "srv", self.sources.service_part(package, short)
        if found is None:
            raise UnknownTypeError(self._unknown("message", full), full)
        source, first_line = found
        return self._build(full, source, first_line, module=f"{ROOT}.{package}.{section}")

    def _build(self, full: str, source: Source, first_line: int, **options: Any) -> type[Message]:
        """Make the class of a type from its definition; `options` are for `make_class`."""
        if full in self._building:
            chain = " -> ".join([*self._building[self._building.index(full) :], full])
            raise InterfaceError(f"{full}: the type contains itself: {chain}")
        self._building.append(full)
        try:
            definition = parse(full, source.text, source=source.origin, first_line=first_line)
            self._check_types(definition)  # makes the nested types, which the rest needs
            self._check_extent(definition)
            cls = make_class(
                definition,
                self.message,
                _md5sum=self._checksum(definition),
                _full_text=self._full_text(definition),
                **options,
            )
        finally:
            self._building.pop()
        self._messages[full] = cls
        return cls

    def _check_types(self, definition: Definition) -> None:
        """Make the classes of all nested types; report all that fail, each at its field."""
        problems: list[str] = []
        for field in definition.fields:
            if field.type.is_builtin or field.type.base in self._messages:
                continue
            if len(self._building) >= MAX_TYPE_NESTING:
                problems.append(
                    field.position.problem(
                        too_many(f"over {MAX_TYPE_NESTING}", NESTED, MAX_TYPE_NESTING)
                    )
                )
                continue
            try:
                self.message(field.type.base)
            except UnknownTypeError as error:
                problems.append(field.position.problem(self._unknown("type", error.name)))
            except InterfaceError as error:
                problems += error.problems
        if problems:
            raise InterfaceError(*dict.fromkeys(problems))

    def _check_extent(self, definition: Definition) -> None:
        """Refuse a message that is too large, with the position of its largest field."""
        extents = {
            field: field_extent(field.type, self._extents.__getitem__)
            for field in definition.fields
        }
        extent = message_extent(extents.values())
        if found := find_excess(extent):
            attribute, problem = found
            most = max(extents, key=lambda field: getattr(extents[field], attribute))
            raise InterfaceError(most.position.problem(problem))
        self._extents[definition.name] = extent

    def _unknown(self, what: str, full: str) -> str:
        short = full.partition("/")[2]
        known = [f"{p}/{n}" for p in self.sources.packages() for n in self._names_of(what, p)]
        # `String` in a definition: usually the built-in type is meant, or std_msgs/String.
        near = [n for n in BUILTINS if n == short.lower()] if what == "type" else []
        if near:
            near += [name for name in known if name.endswith(f"/{short}")]
            hint = f" Did you mean {' or '.join(map(repr, near[:3]))}?"
        else:
            hint = did_you_mean(full, known, most=3)
        path = ", ".join(
            f"{folder}{'' if folder.is_dir() else ' (missing)'}"
            for folder in self.sources.search_path()
        )
        return (
            f"unknown {what}: got {full!r}; expected one in {path}.{hint} "
            f"Folders are added by {PATH_VARIABLE} or interfaces.add_path()."
        )

    def _names_of(self, what: str, package: str) -> list[str]:
        if what == "service":
            return self.sources.names("srv", package)
        if what == "action":
            return self.sources.names("action", package)
        return self.names("msg", package)

    def _make_service(self, package: str, short: str) -> type[ServiceType]:
        full = f"{package}/{short}"
        request = self.message(f"{full}Request")
        response = self.message(f"{full}Response")
        text = self._md5_text(request._definition) + self._md5_text(response._definition)
        namespace = {
            "__slots__": (),
            "__module__": f"{ROOT}.{package}.srv",
            "__doc__": f"The ROS service {full}.",
            "_type": full,
            "_md5sum": _md5(text),
            "_request_class": request,
            "_response_class": response,
        }
        return type(short, (ServiceType,), namespace)

    def _checksum(self, definition: Definition) -> Any:
        """Return the class attribute `_md5sum`: a string, or an object that computes it."""
        return _md5(self._md5_text(definition))

    def _md5_text(self, definition: Definition) -> str:
        """Return the text ROS 1 hashes: constants, then fields, nested types by their checksum.

        Source: genmsg's `compute_md5_text`.
        """
        lines = [f"{c.type} {c.name}={c.text}" for c in definition.constants]
        for field in definition.fields:
            if field.type.is_builtin:
                lines.append(f"{field.type} {field.name}")
            else:
                lines.append(f"{self.message(field.type.base)._md5sum} {field.name}")
        return "\n".join(lines)

    def _full_text(self, definition: Definition) -> str:
        """Return the text with that of all nested types behind it, as ROS 1 writes it.

        Source: genmsg's `compute_full_text_legacy`.
        """
        nested: dict[str, Definition] = {}
        self._gather(definition, nested)
        parts = [definition.text]
        parts += [f"{'=' * 80}\nMSG: {name}\n{inner.text}" for name, inner in nested.items()]
        return "\n".join(parts)

    def _gather(self, definition: Definition, into: dict[str, Definition]) -> None:
        for field in definition.fields:
            if not field.type.is_builtin and field.type.base not in into:
                inner = self.message(field.type.base)._definition
                into[field.type.base] = inner
                self._gather(inner, into)


_ACTION_ENDS = (
    *("Action", "ActionGoal", "ActionResult", "ActionFeedback"),
    *("Goal", "Result", "Feedback"),
)
_ENDS: dict[Kind, tuple[str, ...]] = {
    "msg": ("",),
    "srv": ("Request", "Response"),
    "action": _ACTION_ENDS,
}
"""The suffixes of the messages that a definition makes."""


def parse_name(name: str) -> tuple[str, str | None, str]:
    """Split "pkg/Name" or "pkg/msg/Name" into package, kind (or None) and short name.

    Raises:
        InterfaceError: Neither form.
    """
    match = _NAME.match(name)
    if match is None:
        raise InterfaceError(
            f"interface name: got {name!r}; expected 'package/Name' or 'package/msg/Name' "
            "(or srv, action)"
        )
    return match[1], match[2], match[3]


def _md5(text: str) -> str:
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


registry = Registry()
"""The classes of this process."""

__all__ = ["ROOT", "Registry", "ServiceType", "Source", "parse_name", "registry"]
