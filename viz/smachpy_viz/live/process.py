"""`smachpy view` as a child process, which never outlives its parent or delays it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from actionlib_core.interfaces._registry import registry
from actionlib_core.interfaces._sources import BUNDLED, PATH_VARIABLE
from actionlib_core.shutdown.child_process import ChildProcess
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Self

START_S = 60.0
"""Longest wait for the viewer to print its address, on a busy computer; then it is ended [s]."""


class ViewerError(SmachError):
    """The viewer could not be started; the text is its error message.

    Try: read the text; mostly `pip install 'smachpy[web]'` or another `--port`.
    """


class ViewerProcess(ChildProcess):
    """Runs the viewer; a context manager.

    The viewer finds the machine over the network like any other viewer, so its failures cannot
    affect the mission. It gets the interface definitions from the same folders as this process.

    Args:
        arguments: Further arguments of `smachpy view`.
        environment: Variables for its environment, such as a password: `ps` shows arguments.

    Raises:
        ViewerError: on entering the context, if the viewer could not start.
    """

    def __init__(
        self, arguments: Sequence[str] = (), environment: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(
            "smachpy.command",
            ("view", "--child", *arguments),
            environment={PATH_VARIABLE: _interface_path(), **(environment or {})},
        )

    def __enter__(self) -> Self:
        super().__enter__()
        if not self.wait_ready(START_S):
            self.stop()
            raise ViewerError(self.said.removeprefix("smachpy: ") or "the viewer does not start")
        return self

    @property
    def address(self) -> str:
        """The address of the page, with the token for commands if they are enabled."""
        return self.first_line


def _interface_path() -> str:
    """The folders in which this process looks for definitions, as an environment variable."""
    return os.pathsep.join(str(p) for p in registry.sources.search_path() if p != BUNDLED)
