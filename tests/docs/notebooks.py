"""Runs the notebooks of the docs: `python tests/docs/notebooks.py` writes what their cells show into them."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb"))


def outputs_of(notebook: dict[str, Any]) -> list[list[dict[str, Any]]]:
    """Run the cells of code in one namespace; return the outputs of each, as Jupyter keeps them."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    return [
        run_cell("".join(cell["source"]), namespace, count)
        for count, cell in enumerate(code_cells(notebook), 1)
    ]


def code_cells(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def run_cell(source: str, namespace: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """Run a cell; what its last line is worth is its output."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), namespace)
    if last is None:
        return []
    value = eval(compile(ast.Expression(last.value), "cell", "eval"), namespace)
    data = {"text/plain": repr(value)}
    if hasattr(value, "_repr_svg_"):
        data = {"image/svg+xml": value._repr_svg_(), "text/plain": type(value).__name__}
    return [
        {"data": data, "execution_count": count, "metadata": {}, "output_type": "execute_result"}
    ]


if __name__ == "__main__":
    for path in NOTEBOOKS:
        book = json.loads(path.read_text(encoding="utf-8"))
        shown = outputs_of(book)
        for number, (cell, outputs) in enumerate(zip(code_cells(book), shown, strict=True), 1):
            cell.update(outputs=outputs, execution_count=number)
        path.write_text(json.dumps(book, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
