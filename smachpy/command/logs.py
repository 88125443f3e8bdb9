"""`smachpy run --log-level, --log-file`: shows and keeps what a mission logs.

Without them Python's own rule holds: warnings and errors go to standard error.
"""

from __future__ import annotations

import contextlib
import logging
import sys
from pathlib import Path
from typing import IO, TYPE_CHECKING, Final

from actionlib_core.process.output import PrintableFormatter, tell
from actionlib_core.process.private_files import open_private
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

LEVELS: Final = ("debug", "info", "warning", "error")
_ROSPY: Final = "rosout"  # its messages go no further than to its own handler
_SHORT: Final = "%(levelname)s %(name)s: %(message)s"
_LONG: Final = "%(asctime)s.%(msecs)03d %(levelname)s %(name)s: %(message)s"


def add_log_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `logging_as`."""
    group = parser.add_argument_group("log messages")
    group.add_argument(
        "--log-level",
        choices=LEVELS,
        help="show what the mission and the libraries log from this level on, on standard error "
        "(default: warning)",
    )
    group.add_argument(
        "--log-file",
        type=Path,
        metavar="FILE",
        help="add it to a file, with the time (from level info on, unless --log-level says more)",
    )


@contextlib.contextmanager
def logging_as(args: argparse.Namespace) -> Iterator[None]:
    """Handle log messages as the options say until the end of the `with` block.

    Raises:
        MissionError: the file cannot be written.
    """
    handlers: list[tuple[logging.Logger, logging.Handler]] = []
    root = logging.getLogger()
    before = root.level
    try:
        if args.log_level is not None or args.log_file is not None:
            level = (args.log_level or "warning").upper()
            root.setLevel(level)
            handlers.append((root, _Terminal(level)))
        if args.log_file is not None:
            level = (args.log_level or "info").upper()
            root.setLevel(level)
            kept = _File(args.log_file, level)
            handlers += [(root, kept), (logging.getLogger(_ROSPY), kept)]
        for logger, handler in handlers:
            logger.addHandler(handler)
        yield
    finally:
        for logger, handler in handlers:
            logger.removeHandler(handler)
            handler.close()
        root.setLevel(before)


class _Terminal(logging.Handler):
    """Writes to the standard error of the moment: the panel of a run replaces it for a time."""

    def __init__(self, level: str) -> None:
        super().__init__(level)
        self.setFormatter(PrintableFormatter(_SHORT))

    def emit(self, record: logging.LogRecord) -> None:
        try:
            sys.stderr.write(f"{self.format(record)}\n")
            sys.stderr.flush()
        except Exception:  # noqa: BLE001  the rule for handlers of `logging`
            self.handleError(record)


class _File(logging.StreamHandler[IO[str]]):
    """Adds to a file that only its user may read; says once if that fails."""

    def __init__(self, file: Path, level: str) -> None:
        self._file = file
        self._failed = False
        try:
            super().__init__(open_private(file, "a"))
        except OSError as error:
            raise MissionError(
                f"--log-file {file}: got no file to write to ({error.strerror or error}); expected "
                "one."
            ) from error
        self.setLevel(level)
        self.setFormatter(PrintableFormatter(_LONG, "%Y-%m-%d %H:%M:%S"))

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802  its name in `logging`
        """Tell the first failed write."""
        del record
        if not self._failed:
            self._failed = True
            tell("smachpy", f"--log-file {self._file}: got a failed write ({sys.exc_info()[1]}).")

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(OSError):  # was told at the write
            self.stream.close()
        super().close()
