"""The output of `actionlib interface show|list|stubs`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces import _stubs
from actionlib_core.interfaces._definition import AS_ROS2
from actionlib_core.interfaces._registry import parse_name, registry
from actionlib_core.interfaces._ros2 import is_only_ros2, ros2_registry
from actionlib_core.interfaces._sources import ACTION_PARTS, BUNDLED, KINDS, SERVICE_PARTS

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from actionlib_core.interfaces._definition import Definition
    from actionlib_core.interfaces._registry import Registry
    from actionlib_core.interfaces._sources import Kind

_PARTS: dict[Kind, tuple[str, ...]] = {"msg": (), "srv": SERVICE_PARTS, "action": ACTION_PARTS}


def show(name: str, *, all_comments: bool = False) -> str:
    """Return a definition with its nested types below their fields, indented by tabs.

    Args:
        name: "pkg/Name" or "pkg/kind/Name"; the short form shows every kind with that name.
        all_comments: Show the comments of nested types too.

    Raises:
        InterfaceError: Unknown or malformed.
    """
    source, found = _kinds_of(name)
    package, _, short = parse_name(name)
    blocks = []
    for kind in found:
        title = [f"# {package}/{kind}/{short}"] if len(found) > 1 else []
        lines: list[str] = []
        for number, definition in enumerate(_definitions(source, kind, package, short)):
            lines += ["---"] if number else []
            lines += _lines(source, definition, "", comments=True, nested_comments=all_comments)
        blocks.append("\n".join([*title, *lines]).rstrip())
    return "\n\n".join(blocks)


def describe(name: str) -> dict[str, Any]:
    """Return a definition as plain data: kinds, and for each part its type, md5 and fields.

    Raises:
        InterfaceError: Unknown or malformed.
    """
    source, kinds = _kinds_of(name)
    package, _, short = parse_name(name)
    return {
        f"{package}/{kind}/{short}": [
            {
                "type": definition.name,
                "md5": source.message(definition.name)._md5sum,
                "constants": [
                    {"name": c.name, "type": c.type, "value": c.value, "comment": c.comment}
                    for c in definition.constants
                ],
                "fields": [
                    {"name": f.name, "type": str(f.type), "comment": f.comment}
                    for f in definition.fields
                ],
            }
            for definition in _definitions(source, kind, package, short)
        ]
        for kind in kinds
    }


def list_interfaces(kinds: Sequence[Kind] = KINDS) -> dict[str, list[str]]:
    """Return the names of all definitions found, "pkg/kind/Name", by kind."""
    sources = registry.sources
    packages = sources.packages()
    return {
        kind: [f"{p}/{kind}/{name}" for p in packages for name in sources.names(kind, p)]
        for kind in kinds
    }


def write_stubs(folder: str | os.PathLike[str], packages: Sequence[str] = ()) -> list[Path]:
    """Write typed `.pyi` files, `<folder>/<package>/msg.pyi` and `srv.pyi`, and return their paths.

    Args:
        folder: Created if necessary; add it to mypy's `mypy_path`.
        packages: The packages; empty: all except the bundled ones, which have stubs.

    Raises:
        InterfaceError: Unknown packages, no packages, or malformed definitions.
    """
    known = registry.sources.packages()
    wanted = list(packages) or [p for p in known if not (BUNDLED / p).is_dir()]
    if unknown := [p for p in wanted if p not in known]:
        raise InterfaceError(
            *(f"stubs: got package {p!r}; expected one of {', '.join(known)}" for p in unknown)
        )
    if not wanted:
        raise InterfaceError(
            "stubs: got no package of your own; the bundled ones have their stubs. Try naming a "
            "package, or SMACHPY_INTERFACE_PATH=folder with my_pkg/{msg,srv,action} in it"
        )
    files: dict[str, str] = {}
    for package in wanted:
        files |= _stubs.package_stubs(registry, package)
    return _stubs.write(files, Path(folder))


def _kinds_of(name: str) -> tuple[Registry, list[Kind]]:
    """Return the registry of a name, ROS 1's or else ROS 2's, and the kinds that define it.

    Parts of services and actions count as messages of ROS 1. A file of the user's may be in either
    dialect, so it belongs to the first registry that can read it.

    Raises:
        InterfaceError: Unknown, or neither can read it; the error is that of its dialect.
    """
    package, given, short = parse_name(name)
    kinds = [kind for kind in KINDS if given in {None, kind}]
    sources = [registry, ros2_registry()]
    if is_only_ros2(package):
        sources.reverse()
    errors: list[InterfaceError] = []
    for source in sources:
        found = [kind for kind in kinds if source.sources.find(kind, package, short) is not None]
        try:
            for kind in found:
                _definitions(source, kind, package, short)
        except InterfaceError as error:
            errors.append(error)
        else:
            if found:
                return source, found
    if errors:
        raise errors[-1 if AS_ROS2 in str(errors[0]) else 0]
    registry.message(name)  # raises if it is unknown
    return registry, ["msg"]


def _definitions(source: Registry, kind: Kind, package: str, short: str) -> list[Definition]:
    front = f"{package}/{short}" if source is registry else f"{package}/{kind}/{short}_"
    names = [f"{front}{part.title()}" for part in _PARTS[kind]]
    return [source.message(name)._definition for name in names or [front.rstrip("_")]]


def _lines(
    source: Registry, definition: Definition, indent: str, *, comments: bool, nested_comments: bool
) -> Iterator[str]:
    waiting = list(definition.fields)
    for line in definition.text.splitlines():
        shown = line.rstrip() if comments else _without_comment(line)
        if shown or comments:
            yield f"{indent}{shown}".rstrip()
        if waiting and line == waiting[0].position.text:
            field = waiting.pop(0)
            if not field.type.is_builtin:
                nested = source.message(field.type.base)._definition
                yield from _lines(
                    source,
                    nested,
                    f"{indent}\t",
                    comments=nested_comments,
                    nested_comments=nested_comments,
                )


def _without_comment(line: str) -> str:
    if line.lstrip().startswith("string ") and "=" in line.partition("#")[0]:
        return line.rstrip()  # the value of a string constant may contain the comment sign
    return line.partition("#")[0].rstrip()
