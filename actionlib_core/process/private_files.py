"""Files that only their user may read: what missions and people say is no business of others.

Journals, recordings and logs have arguments, userdata and answers in them. They are made with mode
0600, in folders of 0700; a file or folder that exists keeps its mode, which is its user's choice.
"""

from __future__ import annotations

import os
from typing import IO, TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from pathlib import Path

FOLDER: Final = 0o700
FILE: Final = 0o600


def make_private_folder(folder: Path) -> None:
    """Make a folder, and those above it that are missing.

    Raises:
        OSError: it cannot be made.
    """
    if folder.is_dir():
        return
    make_private_folder(folder.parent)
    folder.mkdir(mode=FOLDER, exist_ok=True)


def make_private_file(file: Path) -> None:
    """Make an empty file, unless it exists.

    Raises:
        OSError: it cannot be made.
    """
    os.close(os.open(file, os.O_CREAT | os.O_WRONLY, FILE))


def open_private(file: Path, mode: str) -> IO[Any]:
    """Open a file as `Path.open`; texts are UTF-8.

    Raises:
        OSError: it cannot be opened.
    """
    encoding = None if "b" in mode else "utf-8"
    return open(
        file, mode, encoding=encoding, opener=lambda path, flags: os.open(path, flags, FILE)
    )
