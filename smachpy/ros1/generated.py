"""What ROS 1's build generated: interfaces (`pkg/msg/_Name.py`), configurations (of `.cfg`).

Some repositories hold the generated modules and lack the definitions; each has its definition as a
text, with those of the types that it uses. Modules of `cfg/Name.cfg` are made when imported.
"""

from __future__ import annotations

import ast
import contextlib
import re
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces import (
    InterfaceError,
    define_action,
    define_message,
    define_service,
    get_message,
)
from smachpy.ros1.python2 import to_code, to_tree

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

_NEXT: Final = re.compile(r"^={80}\nMSG: (\w+/\w+)\n", re.MULTILINE)
_PARTS: Final = (
    "Action",
    *(f"{a}{b}" for a in ("", "Action") for b in ("Goal", "Result", "Feedback")),
)
_FIELD: Final = re.compile(r"^\s*([\w/]+)(?:\[\d*\])?[ \t]+\w", re.MULTILINE)
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
    known = {f"{package}/{file.stem}" for file in defined if file.suffix != ".action"}
    actions = [file.stem for file in defined if file.suffix == ".action"]
    known |= {f"{package}/{action}{part}" for action in actions for part in _PARTS}
    for name in sorted(texts):
        _define(name, texts, known)


def _define(name: str, texts: dict[str, str], known: set[str]) -> None:
    """Define what a text says: a message, or the service or action of which it is the first part.

    Args:
        name: Its type.
        texts: Type -> text.
        known: Types that are defined; grows.
    """
    if name in known:
        return
    known.add(name)
    parts: list[str] = [""]
    define: Callable[[str, str], object] = define_message
    for end, ends, make in (
        ("Action", ["Goal", "Result", "Feedback"], define_action),
        ("Request", ["Request", "Response"], define_service),
    ):
        base = name.removesuffix(end)
        if base != name and all(f"{base}{part}" in texts for part in ends):
            known |= {f"{base}{part}" for part in ("", *_PARTS, *ends)}
            name, parts, define = base, ends, make
    said = [texts[f"{name}{part}"] for part in parts]
    for kind in _FIELD.findall("\n".join(said)):
        used = kind if "/" in kind else f"{name.partition('/')[0]}/{kind}"
        if used in texts:
            _define(used, texts, known)
    if define is not define_message or not _is_known(name):
        define(name, "\n---\n".join(said))


def _is_known(name: str) -> bool:
    try:
        get_message(name)
    except InterfaceError:
        return False
    return True


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
