"""Explains failed imports: an extra is missing, or two packages have the same name."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from smachpy import pictures
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterable

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
    "psycopg": "postgres",
    "anywidget": "notebook",
}
OWN_PACKAGES: Final = ("actionlib_core", "viz", "missions")
"""Top-level packages that are installed together with `smachpy`."""
_OURS: Final = Path(__file__).resolve().parents[2]


def load_view(name: str) -> Any:
    """Return a view of an installed package by its entry point's name (`smachpy.pictures`).

    Raises:
        SmachError: there is none.
        ImportError: it cannot be imported; `advice` says why.
    """
    found = pictures.load(name)
    if found is None:
        raise SmachError(
            f"entry points {pictures.GROUP!r}: got no {name!r}; expected one of the package viz. "
            "Try: pip install smachpy, or in a source tree again: pip install -e ."
        )
    return found


def advice(error: ImportError) -> str | None:
    """Return why a module cannot be imported, and what to do.

    Returns:
        None if the module belongs to no extra and hides none of our packages: then the cause is
        not the installation.
    """
    return clash(error) or _missing_extra(error)


def clash(error: ImportError, folders: Iterable[Path] = ()) -> str | None:
    """Return which of two packages of one name hides the other; None if that is not the cause.

    Args:
        error: The exception of the import.
        folders: Where the user's own modules are.
    """
    name = (error.name or "").partition(".")[0]
    if name not in OWN_PACKAGES:
        return None
    ours = _OURS / name
    used = hidden_by(name)
    if used is not None:
        return (
            f"module {error.name!r} cannot be imported: got {str(used)!r} as {name!r}, which hides "
            f"smachpy's own package of that name, {str(ours)!r}; expected one of the two only. Try "
            "renaming yours, or taking its folder off the Python path (PYTHONPATH)."
        )
    for folder in folders:
        for yours in (folder / name, folder / f"{name}.py"):
            if yours.exists() and yours.resolve() != ours:
                return (
                    f"module {error.name!r} cannot be imported: {name!r} is smachpy's own package "
                    f"here, {str(ours)!r}, which hides yours, {str(yours.absolute())!r}; expected "
                    "another name. Try renaming yours."
                )
    return None


def hidden_by(module: str) -> Path | None:
    """Return the user's package that is imported instead of ours; None if ours is.

    Args:
        module: The name of one of our modules or packages.
    """
    name = module.partition(".")[0]
    used = _place_of(name) if name in OWN_PACKAGES else None
    return None if used == _OURS / name else used


def _place_of(name: str) -> Path | None:
    """Return the folder or file from which a top-level module is imported here."""
    module = sys.modules.get(name)
    try:
        spec = module.__spec__ if module is not None else importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return None
    if spec is None:
        return None
    if spec.submodule_search_locations:
        return Path(next(iter(spec.submodule_search_locations))).resolve()
    return Path(spec.origin).resolve() if spec.origin else None


def _missing_extra(error: ImportError) -> str | None:
    package = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(package)
    if extra is None:
        return None
    return f"package {package!r} is missing. Try: pip install 'smachpy[{extra}]'"
