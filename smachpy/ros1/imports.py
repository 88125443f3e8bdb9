"""Imports of an old program's files that Python 3 would take for another module.

Python 2 looks first in the folder of the importing module, so `import utility` in a package may
mean a module of the package. And a script may have a `queue.py` beside it, while this package needs
Python's: the script's own is then imported under another name.
"""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

OWN: Final = "smachpy_own_"
"""Begins the name of a module beside the script if Python has another one of that name."""


def settle_imports(
    tree: ast.Module, *, is_relative: Callable[[str], bool], is_own: Callable[[str], bool]
) -> None:
    """Change the import statements of a file that mean a module of the program.

    Args:
        tree: The file.
        is_relative: Returns whether a name means a module of the file's own package.
        is_own: Returns whether it means a module of the script's folder, though Python has another.
    """
    named = {name.partition(".")[0] for node in ast.walk(tree) for name in _imported(node)}
    if any(is_relative(name) or is_own(name) for name in named):
        _Settle(is_relative, is_own).visit(tree)
        ast.fix_missing_locations(tree)


def _imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
        return [node.module]
    return [alias.name for alias in node.names] if isinstance(node, ast.Import) else []


class _Settle(ast.NodeTransformer):
    def __init__(self, is_relative: Callable[[str], bool], is_own: Callable[[str], bool]) -> None:
        self._is_relative = is_relative
        self._is_own = is_own

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        """Settle `from a import b`."""
        if node.level == 0 and node.module:
            top = node.module.partition(".")[0]
            if self._is_relative(top):
                node.level = 1
            elif self._is_own(top):
                node.module = OWN + node.module
        return node

    def visit_Import(self, node: ast.Import) -> list[ast.AST]:
        """Settle `import a.b, c as d`: one statement for each name."""
        made: list[ast.AST] = []
        for alias in node.names:
            top, _, below = alias.name.partition(".")
            if self._is_relative(top):
                made += _relative(top, below, alias.asname)
            elif self._is_own(top):
                made += _own(top, below, alias.asname)
            else:
                made.append(ast.Import([alias]))
        return [ast.copy_location(each, node) for each in made]


def _relative(top: str, below: str, asname: str | None) -> list[ast.AST]:
    """Return the statements for `import top.below as asname` from the file's own package."""
    if below and asname:
        above, _, last = f"{top}.{below}".rpartition(".")
        return [ast.ImportFrom(above, [ast.alias(last, asname)], 1)]
    whole = ast.ImportFrom(None, [ast.alias(top, asname)], 1)
    if not below:
        return [whole]
    above, _, last = f"{top}.{below}".rpartition(".")
    return [whole, ast.ImportFrom(above, [ast.alias(last, f"_{OWN}{last}")], 1)]


def _own(top: str, below: str, asname: str | None) -> list[ast.AST]:
    """Return the statements for `import top.below as asname` from the script's folder."""
    if asname or not below:
        return [ast.Import([ast.alias(f"{OWN}{top}.{below}".rstrip("."), asname or top)])]
    return [
        ast.Import([ast.alias(f"{OWN}{top}.{below}")]),
        ast.Import([ast.alias(f"{OWN}{top}", top)]),
    ]


def lies_in(folder: Path, name: str) -> bool:
    """Return whether a folder has a module or package of this name."""
    return (folder / f"{name}.py").is_file() or (folder / name / "__init__.py").is_file()
