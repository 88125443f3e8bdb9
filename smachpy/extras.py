"""Packages that come with an extra of the installation, and what to type when one is missing."""

from __future__ import annotations

from typing import Final

EXTRAS: Final = {
    "numpy": "sim",
    "scipy": "sim",
    "PIL": "sim",
    "starlette": "web",
    "uvicorn": "web",
    "textual": "tui",
    "mcap": "mcap",
}


def advice(error: ModuleNotFoundError) -> str | None:
    """Say which package is missing and how to get it.

    Returns:
        None when the module belongs to no extra: then it is not the installation that is wrong.
    """
    package = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(package)
    if extra is None:
        return None
    return f"package {package!r} is missing. Try: pip install 'smachpy[{extra}]'"
