"""`smachpy view` as a child process that never outlives its parent, nor holds it up."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING

from actionlib_core.clock import current_clock
from actionlib_core.interfaces._registry import registry
from actionlib_core.interfaces._sources import BUNDLED, PATH_VARIABLE
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType
    from typing import Self

_START_S = 20.0  # a viewer that says nothing for so long is ended
_GRACE_S = 1.5
_LAST_GRACE_S = 0.5


class ViewerError(SmachError):
    """The viewer could not be started; the text is what it said."""


class ViewerProcess:
    """Runs the viewer; a context manager.

    It finds the machine over the network as any other viewer does, so that nothing it does, or
    fails to do, reaches the mission. It knows the interface definitions of this process's folders.

    Args:
        arguments: Further arguments of `smachpy view`.

    Attributes:
        address: Of the page, with the token of its commands if it takes any.

    Raises:
        ViewerError: it could not start; when entered.
    """

    def __init__(self, arguments: Sequence[str] = ()) -> None:
        self._command = [sys.executable, "-m", "smachpy.cli", "view", "--child", *arguments]
        self._process: subprocess.Popen[str] | None = None
        self.address = ""

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(  # noqa: S603  our own interpreter and module
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
            env={**os.environ, PATH_VARIABLE: _interface_path()},
        )
        assert self._process.stdout is not None
        stuck = current_clock().call_later(_START_S, self._process.kill)  # then there is no line
        self.address = self._process.stdout.readline().strip()
        stuck.cancel()
        if not self.address:
            assert self._process.stderr is not None
            said = self._process.stderr.read().strip()
            self.stop()
            raise ViewerError(said.removeprefix("smachpy: ") or "the viewer ended at once")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.stop()

    @property
    def pid(self) -> int:
        """The process id."""
        assert self._process is not None
        return self._process.pid

    def stop(self) -> None:
        """End the process; a second call does nothing.

        Blocks: until it has ended, 2 s at most.
        """
        process, self._process = self._process, None
        if process is None:
            return
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()
        try:
            process.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            process.terminate()
            try:
                process.wait(_LAST_GRACE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _interface_path() -> str:
    """The folders in which this process looks for definitions, for the environment."""
    return os.pathsep.join(str(p) for p in registry.sources.search_path() if p != BUNDLED)
