"""Generator of typed `.pyi` files, from which editors and mypy know the fields of messages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces._definition import FLOATS, INTEGERS, OCTETS, FieldType
from actionlib_core.interfaces._registry import ROOT, Registry, ServiceType
from actionlib_core.interfaces._ros2 import (
    DEFAULT_DISTRO,
    Ros2Action,
    Ros2Registry,
    Ros2Service,
)
from actionlib_core.interfaces._sources import BUNDLED, KINDS, Sources

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from actionlib_core.interfaces._definition import Constant, Definition
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
_BASES: Final = {
    "_Message": "Message",
    "_Ros2Action": "Ros2Action",
    "_Ros2Message": "Ros2Message",
    "_Ros2Service": "Ros2Service",
    "_ServiceType": "ServiceType",
}
_PARTS: Final = {"Goal": "_HasGoal", "Result": "_HasResult", "Feedback": "_HasFeedback"}
"""The parts of a ROS 2 action, and the protocols of `action_goal` and the other two."""
_BUILTIN_NAMES: Final = frozenset({"int", "float", "bool", "str", "bytes", "list", "type"})


def bundled_stubs() -> dict[str, str]:
    """Return the stubs of the bundled packages by their paths below this package."""
    # Only the bundled folder, so that the result does not depend on the environment.
    registry = Registry(Sources(folders=[BUNDLED]))
    files: dict[str, str] = {}
    for package in registry.sources.packages():
        files |= package_stubs(registry, package)
    return files | _ros2_stubs(files)


def _ros2_stubs(ros1: dict[str, str]) -> dict[str, str]:
    """Return the stubs of ROS 2's packages, below `ros2` and at the other import paths.

    They describe `DEFAULT_DISTRO`, as the distribution is known only at run time.

    Args:
        ros1: The stubs of ROS 1's packages, by path.
    """
    registry = Ros2Registry(DEFAULT_DISTRO, ours=True)
    files: dict[str, str] = {}
    for package in registry.sources.packages():
        texts = {kind: _module(registry, package, kind, _Ros2Stub) for kind in KINDS}
        kinds = [kind for kind, text in texts.items() if text]
        imports = [f"from . import {kind} as {kind}\n" for kind in kinds]
        files[f"ros2/{package}/__init__.pyi"] = _HEADER + "".join(imports)
        files |= {f"ros2/{package}/{kind}.pyi": texts[kind] for kind in kinds}
        # A package that ROS 1 has too keeps its own modules, and gets `action` beside them.
        front = ros1.get(f"{package}/__init__.pyi", _HEADER)
        others = kinds if front is _HEADER else [kind for kind in kinds if kind == "action"]
        plain = [f"from . import {kind} as {kind}\n" for kind in others]
        files[f"{package}/__init__.pyi"] = front + "".join(plain)
        for kind in others:
            names = registry.names(kind, package)
            again = "".join(f"    {name} as {name},\n" for name in names)
            path = f"{ROOT}.ros2.{package}.{kind}"
            files[f"{package}/{kind}.pyi"] = f"{_HEADER}from {path} import (\n{again})\n"
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
    """Write files below a folder, which is created if necessary; return their paths."""
    written = []
    for relative, text in files.items():
        path = folder / relative
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        written.append(path)
    return written


def _module(registry: Registry, package: str, kind: Kind, make: type[_Stub] | None = None) -> str:
    """Return the stub of `pkg.msg`, `pkg.srv` or `pkg.action`, "" when it has no classes."""
    names = registry.names(kind, package)
    if not names:
        return ""
    stub = (make or _Stub)(registry, package, kind)
    bodies = [stub.body(registry.attribute(package, kind, name)) for name in names]
    return "\n".join([_HEADER + stub.imports(), *bodies])


class _Stub:
    """One stub module; it collects the imports that its classes need."""

    _base = "_Message"

    def __init__(self, registry: Registry, package: str, kind: Kind) -> None:
        self._registry = registry
        self._package = package
        self._kind = kind
        self._others: set[tuple[str, str]] = set()
        self._needs: set[str] = set()

    def imports(self) -> str:
        collections = "from collections.abc import Collection as _Collection"
        lines = [collections] if "_Collection" in self._needs else []
        if typing := sorted(self._needs & {"_ClassVar", "_Final", "_TypeAlias"}):
            lines.append(
                f"from typing import {', '.join(f'{name[1:]} as {name}' for name in typing)}"
            )
        if "_builtins" in self._needs:
            lines.append("import builtins as _builtins")
        lines += [
            f"import {self._path(package)}.{section} as _{package}_{section}"
            for package, section in sorted(self._others)
        ]
        for alias in sorted(self._needs & _BASES.keys()):
            lines.append(f"from {ROOT} import {_BASES[alias]} as {alias}")
        for alias in sorted(self._needs & {"_Duration", "_Time"}):
            lines.append(f"from actionlib_core.time import {alias[1:]} as {alias}")
        return "\n".join([*lines, ""])

    def body(self, cls: Any) -> str:
        if issubclass(cls, ServiceType):
            return self._service(cls)
        return "\n".join([*self._message(cls._definition), ""])

    def _service(self, cls: type[ServiceType]) -> str:
        self._needs |= {"_ServiceType", "_ClassVar"}
        request, response = cls._request_class.__name__, cls._response_class.__name__
        return f"class {cls.__name__}(_ServiceType):\n{self._call(cls, request, response)}"

    def _call(self, cls: Any, request: str, response: str) -> str:
        """Return the classes of a service, and the call from which checkers know a proxy's."""
        arguments = [argument for _, argument in self._arguments(cls._request_class._definition)]
        inner = "".join(f"        {argument},\n" for argument in arguments)
        inside = f"\n{inner}    " if inner else ""
        return (
            f"    _request_class: _ClassVar[type[{request}]]\n"
            f"    _response_class: _ClassVar[type[{response}]]\n"
            "    @staticmethod\n"
            f"    def _call({inside}) -> tuple[{request}, {response}]: ...\n"
        )

    def _arguments(self, definition: Definition) -> Iterator[tuple[str, str]]:
        """Yield the type of each field, and the argument of the constructor for it."""
        names = {f.attribute for f in definition.fields} | {
            c.attribute for c in definition.constants
        }
        # A field called `int` hides the type of that name in its class.
        shadowed = names & _BUILTIN_NAMES
        for field in definition.fields:
            held, taken = self._types(field.type, shadowed)
            yield held, f"{field.attribute}: {taken} | None = None"

    def _message(self, definition: Definition) -> Iterator[str]:
        self._needs.add(self._base)
        yield f"class {definition.short_name}({self._base}):"
        if definition.comment:
            yield f'    """{_escaped(definition.comment)}"""'
            yield ""
        for constant in definition.constants:
            yield self._constant(constant)
        arguments = []
        for field, (held, argument) in zip(
            definition.fields, self._arguments(definition), strict=True
        ):
            comment = f"  # {field.comment}" if field.comment else ""
            yield f"    {field.attribute}: {held}{comment}"
            arguments.append(argument)
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
        """Return the type of a field and the type of its constructor argument."""
        element = self._element(kind.base, shadowed)
        if not kind.is_array:
            return element, f"{element}{self._also_taken(kind.base)}"
        self._needs.add("_Collection")
        taken = f"_Collection[{element}]"
        if kind.base in OCTETS:
            return self._builtin("bytes", shadowed), taken
        return f"{self._builtin('list', shadowed)}[{element}]", taken

    def _also_taken(self, base: str) -> str:
        """Return further types that the constructor accepts."""
        return " | float" if base in {"time", "duration"} else ""

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
        """Return the module of a package: below ours if bundled, else its plain ROS name."""
        return f"{ROOT}.{package}" if (BUNDLED / package).is_dir() else package


class _Ros2Stub(_Stub):
    """Writes the stub of a module of ROS 2's classes."""

    _base = "_Ros2Message"

    def body(self, cls: Any) -> str:
        if issubclass(cls, Ros2Service):
            self._needs |= {"_Ros2Service", "_ClassVar", "_TypeAlias"}
            name = cls.__name__
            return (
                f"class {name}(_Ros2Service):\n"
                f"    Request: _TypeAlias = {name}_Request\n"
                f"    Response: _TypeAlias = {name}_Response\n"
                f"{self._call(cls, f'{name}_Request', f'{name}_Response')}"
            )
        if issubclass(cls, Ros2Action):
            self._needs |= {"_Ros2Action", "_TypeAlias", *_PARTS.values()}
            name = cls.__name__
            aliases = [f"    {part}: _TypeAlias = {name}_{part}\n" for part in _PARTS]
            fields = [
                f"    action_{part.lower()}: {protocol}[{name}_{part}]\n"
                for part, protocol in _PARTS.items()
            ]
            return "".join([f"class {name}(_Ros2Action):\n", *aliases, *fields])
        return "\n".join([*self._message(cls._definition), ""])

    def imports(self) -> str:
        lines = [super().imports().rstrip("\n")]
        protocols = sorted(self._needs & {*_PARTS.values()})
        lines += [
            f"from actionlib_core.action._action_spec import {alias[1:]} as {alias}"
            for alias in protocols
        ]
        return "\n".join([*lines, ""])

    def _also_taken(self, base: str) -> str:
        plain = {f"builtin_interfaces/msg/{name}": name for name in ("Time", "Duration")}.get(base)
        if plain is None:
            return ""
        self._needs.add(f"_{plain}")
        return f" | _{plain} | float"

    def _element(self, base: str, shadowed: set[str]) -> str:
        if base in _SCALARS:
            return self._builtin(_SCALARS[base], shadowed)
        package, kind, short = base.split("/")
        if (package, kind) == (self._package, self._kind):
            return short
        self._others.add((package, kind))
        return f"_{package}_{kind}.{short}"

    @staticmethod
    def _path(package: str) -> str:
        return f"{ROOT}.ros2.{package}"


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')


if __name__ == "__main__":
    # For developers of this package, after a change of the bundled definitions.
    write(bundled_stubs(), BUNDLED.parent)
