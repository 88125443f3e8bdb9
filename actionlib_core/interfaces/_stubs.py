"""Typed `.pyi` files, so that editors and mypy know the fields of every message."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actionlib_core.interfaces._definition import FLOATS, INTEGERS, OCTETS, FieldType
from actionlib_core.interfaces._registry import ROOT, Registry, ServiceType
from actionlib_core.interfaces._sources import BUNDLED, Sources

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from actionlib_core.interfaces._definition import Constant, Definition
    from actionlib_core.interfaces._message import Message
    from actionlib_core.interfaces._sources import Kind

_HEADER: Final = "# Written by `actionlib interface stubs`; changes are lost.\n"
_SCALARS: Final = {
    **dict.fromkeys(INTEGERS, "int"),
    **dict.fromkeys(FLOATS, "float"),
    "bool": "bool",
    "string": "str",
    "time": "_Time",
    "duration": "_Duration",
}
_BUILTIN_NAMES: Final = frozenset({"int", "float", "bool", "str", "bytes", "list", "type"})


def bundled_stubs() -> dict[str, str]:
    """Return the text of each stub of the bundled packages by its path below this package."""
    # Only what is bundled: the result must not depend on the environment.
    registry = Registry(Sources(folders=[BUNDLED]))
    files: dict[str, str] = {}
    for package in registry.sources.packages():
        files |= package_stubs(registry, package)
    return files


def package_stubs(registry: Registry, package: str) -> dict[str, str]:
    """Return the stubs of one package by relative path: "pkg/__init__.pyi", "pkg/msg.pyi", ..."""
    kinds: tuple[Kind, ...] = ("msg", "srv")
    texts = {kind: _module(registry, package, kind) for kind in kinds}
    imports = "".join(f"from . import {kind} as {kind}\n" for kind, text in texts.items() if text)
    files = {f"{package}/__init__.pyi": _HEADER + imports}
    files |= {f"{package}/{kind}.pyi": text for kind, text in texts.items() if text}
    return files


def write(files: dict[str, str], folder: Path) -> list[Path]:
    """Write files below a folder, which is made if need be; return their paths."""
    written = []
    for relative, text in files.items():
        path = folder / relative
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        written.append(path)
    return written


def _module(registry: Registry, package: str, kind: Kind) -> str:
    """Return the stub of `pkg.msg` or `pkg.srv`, "" when it has no classes."""
    names = registry.names(kind, package)
    if not names:
        return ""
    stub = _Stub(registry, package, kind)
    bodies = [stub.body(registry.attribute(package, kind, name)) for name in names]
    return "\n".join([_HEADER + stub.imports(), *bodies])


class _Stub:
    """The text of one stub module, and the imports that its classes turned out to need."""

    def __init__(self, registry: Registry, package: str, kind: Kind) -> None:
        self._registry = registry
        self._package = package
        self._kind = kind
        self._others: set[tuple[str, str]] = set()
        self._needs: set[str] = set()

    def imports(self) -> str:
        collections = "from collections.abc import Collection as _Collection"
        lines = [collections] if "_Collection" in self._needs else []
        if typing := sorted(self._needs & {"_ClassVar", "_Final"}):
            lines.append(
                f"from typing import {', '.join(f'{name[1:]} as {name}' for name in typing)}"
            )
        if "_builtins" in self._needs:
            lines.append("import builtins as _builtins")
        lines += [
            f"import {self._path(package)}.{section} as _{package}_{section}"
            for package, section in sorted(self._others)
        ]
        bases = {"_Message": "Message", "_ServiceType": "ServiceType"}
        for alias in sorted(self._needs & bases.keys()):
            lines.append(f"from {ROOT} import {bases[alias]} as {alias}")
        for alias in sorted(self._needs & {"_Duration", "_Time"}):
            lines.append(f"from actionlib_core.time import {alias[1:]} as {alias}")
        return "\n".join([*lines, ""])

    def body(self, cls: type[Message | ServiceType]) -> str:
        if issubclass(cls, ServiceType):
            return self._service(cls)
        return "\n".join([*self._message(cls._definition), ""])

    def _service(self, cls: type[ServiceType]) -> str:
        self._needs |= {"_ServiceType", "_ClassVar"}
        request, response = cls._request_class.__name__, cls._response_class.__name__
        return (
            f"class {cls.__name__}(_ServiceType):\n"
            f"    _request_class: _ClassVar[type[{request}]]\n"
            f"    _response_class: _ClassVar[type[{response}]]\n"
        )

    def _message(self, definition: Definition) -> Iterator[str]:
        self._needs.add("_Message")
        yield f"class {definition.short_name}(_Message):"
        if definition.comment:
            yield f'    """{_escaped(definition.comment)}"""'
            yield ""
        names = {f.attribute for f in definition.fields} | {
            c.attribute for c in definition.constants
        }
        shadowed = names & _BUILTIN_NAMES
        for constant in definition.constants:
            yield self._constant(constant)
        arguments = []
        for field in definition.fields:
            held, taken = self._types(field.type, shadowed)
            comment = f"  # {field.comment}" if field.comment else ""
            yield f"    {field.attribute}: {held}{comment}"
            arguments.append(f"{field.attribute}: {taken} | None = None")
        inner = "".join(f"        {argument},\n" for argument in arguments)
        if inner:
            yield f"    def __init__(\n        self,\n{inner}    ) -> None: ..."
        else:
            yield "    def __init__(self) -> None: ..."

    def _constant(self, constant: Constant) -> str:
        self._needs.add("_Final")
        value = repr(constant.value)
        if isinstance(constant.value, float) and not value[-1].isdigit():
            value = f"float({value!r})"  # inf and nan have no literal
        comment = f"  # {constant.comment}" if constant.comment else ""
        return f"    {constant.attribute}: _Final = {value}{comment}"

    def _types(self, kind: FieldType, shadowed: set[str]) -> tuple[str, str]:
        """Return the type a field holds and the type the constructor takes."""
        element = self._element(kind.base, shadowed)
        if not kind.is_array:
            return element, f"{element} | float" if kind.base in {"time", "duration"} else element
        self._needs.add("_Collection")
        taken = f"_Collection[{element}]"
        if kind.base in OCTETS:
            return self._builtin("bytes", shadowed), taken
        return f"{self._builtin('list', shadowed)}[{element}]", taken

    def _element(self, base: str, shadowed: set[str]) -> str:
        if base in _SCALARS:
            name = _SCALARS[base]
            if name.startswith("_"):
                self._needs.add(name)
            return self._builtin(name, shadowed)
        package, short = base.split("/")
        section = "srv" if self._registry.message(base).__module__.endswith(".srv") else "msg"
        if (package, section) == (self._package, self._kind):
            return short
        self._others.add((package, section))
        return f"_{package}_{section}.{short}"

    def _builtin(self, name: str, shadowed: set[str]) -> str:
        if name not in shadowed:
            return name
        self._needs.add("_builtins")
        return f"_builtins.{name}"

    @staticmethod
    def _path(package: str) -> str:
        """The module of a package: below this one if bundled, else its plain ROS name."""
        return f"{ROOT}.{package}" if (BUNDLED / package).is_dir() else package


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')


if __name__ == "__main__":
    # For us, after a change to the bundled definitions.
    write(bundled_stubs(), BUNDLED.parent)
