"""`smachpy view` as a child process that never outlives its parent, nor holds it up."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from actionlib_core.child_process import ChildProcess
from actionlib_core.interfaces._registry import registry
from actionlib_core.interfaces._sources import BUNDLED, PATH_VARIABLE
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Self

START_S = 20.0  # a viewer that says nothing for so long is ended


class ViewerError(SmachError):
    """The viewer could not be started; the text is what it said."""


class ViewerProcess(ChildProcess):
    """Runs the viewer; a context manager.

    It finds the machine over the network as any other viewer does, so that nothing it does, or
    fails to do, reaches the mission. It knows the interface definitions of this process's folders.

    Args:
        arguments: Further arguments of `smachpy view`.

    Raises:
        ViewerError: it could not start; when entered.
    """

    def __init__(self, arguments: Sequence[str] = ()) -> None:
        super().__init__(
            "smachpy.command",
            ("view", "--child", *arguments),
            environment={PATH_VARIABLE: _interface_path()},
        )

    def __enter__(self) -> Self:
        super().__enter__()
        if not self.wait_ready(START_S):
            self.stop()
            raise ViewerError(self.said.removeprefix("smachpy: ") or "the viewer does not start")
        return self

    @property
    def address(self) -> str:
        """Where the page is, with the token of its commands if it takes any."""
        return self.first_line


def _interface_path() -> str:
    """The folders in which this process looks for definitions, for the environment."""
    return os.pathsep.join(str(p) for p in registry.sources.search_path() if p != BUNDLED)
