"""The identity of the program that made a recording: its files, its commit, the versions."""

from __future__ import annotations

import hashlib
import platform
import subprocess
import sys
import sysconfig
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from smachpy.userdata.secret import holds_secret, is_secret_name

if TYPE_CHECKING:
    from collections.abc import Mapping

_LIBRARY: Final = frozenset({"smachpy", "actionlib_core", "smachpy_viz", "smachpy_programs"})
_PACKAGES: Final = ("smachpy", "eclipse-zenoh", "rosbags")
MAX_FILES: Final = 500
"""Number of files and of constants of a program that are looked at."""

MAX_CONSTANT_LENGTH: Final = 100
"""Longest text of a constant that is kept [characters]."""

GIT_S: Final = 5.0
"""Longest time for each of two calls of git, which may wait for a disk of the network [s]."""


def code_facts() -> dict[str, Any]:
    """Return what identifies the program.

    Returns:
        `files`: name of each of the program's own modules -> hash of its file; their common
        `folder`; `hash` of all; `constants`: "module.NAME" -> value as text, without secrets;
        `commit` and `dirty` of the git repository there ("" and False without one); `versions`.
        Modules of Python, of installed packages and of this library are not its own.

    Blocks: it reads the files, and calls git once in each process, for 2 * `GIT_S` at most.
    """
    files = own_files()
    folder = _common_folder(list(files.values()))
    hashes = {name: file_hash(file) for name, file in files.items()}
    commit, dirty = _git(folder) if files else ("", False)
    whole = hashlib.sha256("".join(f"{k} {v}\n" for k, v in hashes.items()).encode()).hexdigest()
    return {
        "files": hashes,
        "hash": whole[:16],
        "folder": str(folder),
        "commit": commit,
        "dirty": dirty,
        "constants": own_constants(files),
        "versions": {"python": platform.python_version(), **_versions()},
    }


def own_files() -> dict[str, Path]:
    """Return the program's own modules that are loaded: name -> file, sorted."""
    found = {}
    for name, module in sys.modules.copy().items():
        path = None if name.partition(".")[0] in _LIBRARY else _file_of(module)
        if path is not None and path.is_file():
            # A file that is loaded again has a number behind its name.
            first, _, number = name.rpartition("_")
            again = first == path.stem and number.isascii() and number.isdigit()
            found[path.stem if again else name] = path
    return dict(sorted(found.items())[:MAX_FILES])


def _file_of(module: Any) -> Path | None:
    file = getattr(module, "__file__", None)
    if not isinstance(file, str):
        return None
    return _own_file(file, None if file.startswith("/") else Path.cwd())


@cache  # each recording asks it of all modules
def _own_file(file: str, folder: Path | None) -> Path | None:
    """Return a module's file, resolved; None for one of Python or of an installed package."""
    path = (folder or Path()).joinpath(file).resolve()
    is_own = file.endswith(".py") and _folders_of_installed().isdisjoint(path.parents)
    return path if is_own else None


@cache
def _folders_of_installed() -> frozenset[Path]:
    return frozenset(map(Path, {*sysconfig.get_paths().values(), sys.base_prefix, sys.prefix}))


def own_constants(files: Mapping[str, Path]) -> dict[str, str]:
    """Return the constants of these modules: names in capitals with plain values."""
    names = {file: name for name, file in files.items()}
    found = {}
    for module in sys.modules.copy().values():
        file = _file_of(module)
        name = None if file is None else names.get(file)
        for word, value in list(vars(module).items()) if name else ():
            if not (word.isupper() and _is_plain(value)):
                continue
            if not (is_secret_name(word) or is_secret_name(word.removesuffix("S"))):
                text = repr(value)
                if len(text) <= MAX_CONSTANT_LENGTH and not holds_secret(text):
                    found[f"{name}.{word}"] = text
    return dict(sorted(found.items())[:MAX_FILES])


def _is_plain(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_plain, value))
    return type(value) in {bool, int, float, str}


def file_hash(file: Path) -> str:
    """Return the beginning of the SHA-256 sum of a file; "" if it cannot be read."""
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()[:16]
    except OSError:
        return ""


def _common_folder(files: list[Path]) -> Path:
    if not files:
        return Path.cwd()
    folder = files[0].parent
    while not all(file.is_relative_to(folder) for file in files):
        folder = folder.parent
    return folder


@cache
def _versions() -> dict[str, str]:
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:  # a program that is run from its source
            continue
    return found


@cache
def _git(folder: Path) -> tuple[str, bool]:
    """Return the commit of a folder, and whether files in it differ from that."""
    commit = (_output(folder, "rev-parse", "HEAD") or "").strip()
    # If git cannot say it, the commit alone proves nothing.
    return commit, bool(commit) and _output(
        folder, "status", "--porcelain", "-uno", "--", "."
    ) != ""


def _output(folder: Path, *words: str) -> str | None:
    """Return what git says; None if it cannot, or not in time."""
    # The repository may be another user's: its configuration must not run programs of its choice.
    safe = ("-c", "core.fsmonitor=false", "-c", "core.hooksPath=/dev/null")
    command = ["git", "--no-optional-locks", *safe, "-C", str(folder), *words]
    try:
        done = subprocess.run(  # noqa: S603
            command, capture_output=True, check=False, timeout=GIT_S
        )
    except (OSError, subprocess.TimeoutExpired):  # there is no git, or it hangs
        return None
    return done.stdout.decode("utf-8", "replace") if done.returncode == 0 else None
