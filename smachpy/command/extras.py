"""Explains failed imports: an extra is missing."""

from __future__ import annotations

from typing import Any, Final

from smachpy.events import pictures
from smachpy.exceptions import SmachError

EXTRAS: Final = {
    "numpy": "sim",
    "scipy": "sim",
    "PIL": "sim",
    "starlette": "web",
    "uvicorn": "web",
    "segno": "web",
    "textual": "tui",
    "mcap": "mcap",
    "cronsim": "cron",
    "distributed": "dask",
    "psycopg": "postgres",
    "anywidget": "notebook",
}


def load_view(name: str) -> Any:
    """Return a view of an installed package by its entry point's name (`smachpy.events.pictures`).

    Raises:
        SmachError: there is none.
        ImportError: it cannot be imported; `advice` says why.
    """
    found = pictures.load(name)
    if found is None:
        raise SmachError(
            f"entry points {pictures.GROUP!r}: got no {name!r}; expected one of smachpy_viz. "
            "Try: pip install smachpy, or in a source tree again: pip install -e ."
        )
    return found


def advice(error: ImportError) -> str | None:
    """Return which extra a failed import needs; None if its module belongs to no extra."""
    package = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(package)
    if extra is None:
        return None
    return f"package {package!r} is missing. Try: pip install 'smachpy[{extra}]'"
