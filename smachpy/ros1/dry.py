"""Disables side effects while a script is run only to build its machine.

Inside `nothing_done`, files opened for writing are the null device, processes and shell commands
end at once without running, `input` returns an empty line, and functions that change the file
system do nothing.
"""

from __future__ import annotations

import builtins
import contextlib
import io
import os
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

# `fsync` is there because it fails on the null device.
_CHANGES: tuple[tuple[Any, str], ...] = (
    *((os, name) for name in ("mkdir", "makedirs", "remove", "unlink", "rename", "replace")),
    *(
        (os, name)
        for name in ("fsync", "rmdir", "removedirs", "symlink", "link", "chmod", "kill", "killpg")
    ),
    *((shutil, name) for name in ("rmtree", "move", "copy", "copy2", "copyfile", "copytree")),
)


class _NoOutput(str):
    """The empty output of a process; it can be used as text and, with `decode()`, as bytes."""

    __slots__ = ()

    def decode(self, *_how: str) -> str:
        """Return itself."""
        return self


class _NoProcess:
    """A process that has already ended, successfully and without output."""

    pid = 0
    returncode = 0

    def __init__(self, args: Any = (), *_rest: Any, **options: Any) -> None:
        self.args = args
        text = options.get("text") or options.get("universal_newlines") or options.get("encoding")
        make: Any = io.StringIO if text else io.BytesIO
        self.stdin = self.stdout = self.stderr = make()

    def communicate(self, *_args: Any, **_kwargs: Any) -> tuple[Any, Any]:
        """Return no output."""
        return _NoOutput(), _NoOutput()

    def wait(self, *_args: Any, **_kwargs: Any) -> int:
        """Return 0."""
        return 0

    def poll(self) -> int:
        """Return 0."""
        return 0

    def terminate(self) -> None:
        """Do nothing."""

    kill = terminate

    def send_signal(self, _signal: int) -> None:
        """Do nothing."""

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        pass


@contextlib.contextmanager
def nothing_done() -> Iterator[None]:
    """Disable writing, starting processes and asking the user in the `with` block.

    Threads: it affects all threads of the process.
    """
    real_open = builtins.open

    def open_to_read(file: Any, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
        if set(mode) & set("wax+"):
            file = os.devnull
            mode = mode.replace("x", "w")
        return real_open(file, mode, *args, **kwargs)

    places: list[tuple[Any, str, Any]] = [
        (builtins, "open", open_to_read),
        (io, "open", open_to_read),
        (builtins, "input", lambda *_args: ""),
        (subprocess, "Popen", _NoProcess),
        (os, "system", lambda _command: 0),
        *((module, name, lambda *_args, **_kwargs: None) for module, name in _CHANGES),
    ]
    before = [(module, name, getattr(module, name)) for module, name, _ in places]
    # Python writes __pycache__ with functions of its own, which the replacements do not reach.
    bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        for module, name, value in places:
            setattr(module, name, value)
        yield
    finally:
        for module, name, value in before:
            setattr(module, name, value)
        sys.dont_write_bytecode = bytecode
