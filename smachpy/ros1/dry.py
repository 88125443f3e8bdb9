"""Keep a program that is only built from doing anything: files, processes and questions.

While `nothing_done` is on, files are opened for writing as the null device, processes and shell
commands end at once without having run, questions are answered with an empty line, and what would
change the file system does nothing.
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

_CHANGES: tuple[tuple[Any, str], ...] = (
    *((os, name) for name in ("mkdir", "makedirs", "remove", "unlink", "rename", "replace")),
    *(
        (os, name)
        for name in ("fsync", "rmdir", "removedirs", "symlink", "link", "chmod", "kill", "killpg")
    ),
    *((shutil, name) for name in ("rmtree", "move", "copy", "copy2", "copyfile", "copytree")),
)


class _NoOutput(str):
    """The output of a process that did not run, as text and, for `decode()`, as bytes."""

    __slots__ = ()

    def decode(self, *_how: str) -> str:
        """Return itself."""
        return self


class _NoProcess:
    """A process that has ended before it began."""

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
    """Let nothing be written, started or asked in the `with` block.

    Threads: it holds for the whole process.
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
    bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        for module, name, value in places:
            setattr(module, name, value)
        yield
    finally:
        for module, name, value in before:
            setattr(module, name, value)
        sys.dont_write_bytecode = bytecode
