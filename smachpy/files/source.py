"""What the source of a module says of its names: it is parsed, never executed."""

from __future__ import annotations

import ast
import warnings
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from actionlib_core.inputs.checked_file import read_limited

if TYPE_CHECKING:
    from pathlib import Path


def names_in(file: Path) -> dict[str, Any] | None:
    """Return the names that a module gives to something; sometimes more, never fewer.

    Returns:
        Name -> the module that it is imported from, as text; or the names of the arguments that a
        function or class takes; or None if neither is known. None for all of them if the module may
        have names that its source does not show.

    Raises:
        OSError, SyntaxError, ValueError, RecursionError, MemoryError: it cannot be read or parsed.
    """
    return _names_in(file, file.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _names_in(file: Path, _changed: int) -> dict[str, Any] | None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the import gives them
        tree = ast.parse(read_limited(file))
    if any(map(_hides_names, ast.walk(tree))):
        return None
    found: dict[str, Any] = {}
    top = {id(node) for node in tree.body}
    for node in ast.walk(tree):  # level by level: what is at the top comes first
        match node:
            case ast.ImportFrom(module=module, names=names, level=level):
                for each in names:
                    found.setdefault(each.asname or each.name, None if level else module)
            case ast.Import(names=names):
                for each in names:
                    module = each.name if each.asname else each.name.partition(".")[0]
                    found.setdefault(each.asname or module, module)
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) if id(node) in top:
                found[name] = _arguments_of(node)
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                found.setdefault(name, None)
            case ast.Name(id=name, ctx=ast.Store()) | ast.AsyncFunctionDef(name=name):
                found[name] = None
    return found


def _hides_names(node: ast.AST) -> bool:
    match node:
        case ast.ImportFrom(names=[ast.alias(name="*")]):
            return True
        case ast.Name(id="globals" | "vars" | "locals" | "exec" | "setattr"):
            return True
        case ast.FunctionDef(name="__getattr__") | ast.Global():
            return True
    return False


def _arguments_of(node: ast.FunctionDef | ast.ClassDef) -> tuple[str, ...] | None:
    """Return the names of the arguments that a function or class takes; None if not known."""
    if isinstance(node, ast.FunctionDef):
        made, skip = node, 0
    else:
        own = [each for each in node.body if getattr(each, "name", "") == "__init__"]
        if len(own) != 1 or not isinstance(own[0], ast.FunctionDef) or node.keywords:
            return None
        made, skip = own[0], 1
    if node.decorator_list or made.decorator_list or made.args.kwarg:
        return None
    names = (*made.args.posonlyargs, *made.args.args)[skip:]
    return tuple(one.arg for one in (*names, *made.args.kwonlyargs))
