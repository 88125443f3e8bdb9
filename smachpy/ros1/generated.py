"""What ROS 1's build generated: interfaces (`pkg/msg/_Name.py`), configurations (of `.cfg`).

Some repositories hold the generated modules and lack the definitions; each has its definition as a
text, with those of the types that it uses. Modules of `cfg/Name.cfg` are made when imported.
"""

from __future__ import annotations

import ast
import contextlib
import re
from typing import TYPE_CHECKING, Any, Final, Literal

from actionlib_core.interfaces import add_definition
from smachpy.ros1.python2 import to_code, to_tree

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

_NEXT: Final = re.compile(r"^={80}\nMSG: (\w+/\w+)\n", re.MULTILINE)
_PARTS: Final = (
    "Action",
    *(f"{a}{b}" for a in ("", "Action") for b in ("Goal", "Result", "Feedback")),
)
_GROUPS: Final[tuple[tuple[Literal["srv", "action"], str, tuple[str, ...]], ...]] = (
    ("action", "Action", ("Goal", "Result", "Feedback")),
    ("srv", "Request", ("Request", "Response")),
)
"""Kind of interface, end of the name of its first message, and of those that its text is of."""
_GENERATE: Final = re.compile(r"\.generate\([^)]*[\"'](\w+)[\"']\s*\)")


def define_generated(folder: Path, package: str, defined: Iterable[Path]) -> None:
    """Make known what generated modules of a package say and none of its definitions does.

    Args:
        folder: The package's.
        package: Its name.
        defined: The files of its definitions.
    """
    texts: dict[str, str] = {}
    for section in ("msg", "srv"):
        for place in (folder / "src" / package / section, folder / section):
            for file in sorted(place.glob("_[A-Za-z]*.py")):
                texts |= _texts(file)
    actions = {file.stem for file in defined if file.suffix == ".action"}
    known = {f"{package}/{action}{part}" for action in actions for part in _PARTS}
    origin = str(folder / "src" / package)
    for name in sorted(texts.keys() - known):
        for kind, end, parts in _GROUPS:
            base = name.removesuffix(end)
            said = [texts.get(f"{base}{part}") for part in parts]
            if base != name and None not in said:
                add_definition(kind, base, "\n---\n".join(map(str, said)), origin)
                known |= {f"{base}{part}" for part in (*_PARTS, *parts)}
        if name not in known:
            add_definition("msg", name, texts[name], origin)


def _texts(file: Path) -> dict[str, str]:
    """Return type -> definition of the classes in a generated module, and of the types they use."""
    found: dict[str, str] = {}
    for node in to_tree(file.read_bytes(), str(file)).body:
        if not isinstance(node, ast.ClassDef):
            continue
        values = {
            target.id: each.value.value
            for each in node.body
            if isinstance(each, ast.Assign) and isinstance(each.value, ast.Constant)
            for target in each.targets
            if isinstance(target, ast.Name)
        }
        name, text = values.get("_type"), values.get("_full_text")
        if isinstance(name, str) and isinstance(text, str):
            first, *others = _NEXT.split(text)
            found |= {name: first, **dict(zip(others[::2], others[1::2], strict=True))}
    return found


def config_file(folder: Path, name: str) -> Path | None:
    """Return the file of a package that makes the module `pkg.cfg.name`; None for none.

    Args:
        folder: The package's.
        name: `NameConfig`, or "" for any.
    """
    files = sorted((folder / "cfg").glob("*.cfg"))
    if not name:
        return files[0] if files else None
    for file in files:
        text = file.read_text(encoding="utf-8", errors="replace")
        if name in {f"{made}Config" for made in (file.stem, *_GENERATE.findall(text))}:
            return file
    return None


def config_module(file: Path) -> dict[str, Any]:
    """Run a `.cfg` file, and return name -> value of the module that it makes."""
    from smachpy.ros1.names.dynamic_reconfigure.parameter_generator import ParameterGenerator

    scope: dict[str, Any] = {"__name__": "__main__", "__file__": str(file)}
    with contextlib.suppress(SystemExit):  # its last line is `exit(gen.generate(...))`
        exec(to_code(file.read_bytes(), str(file)), scope)  # noqa: S102  the build ran it, too
    made = [each.module for each in scope.values() if isinstance(each, ParameterGenerator)]
    return made[0] if made else {}
