"""Which samples of an action can be read, at either end."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.goal.recent import Recent
from actionlib_core.wire.encoding import check_encoding, encoding_of

if TYPE_CHECKING:
    import logging

    from actionlib_core.exceptions import ActionlibError
    from actionlib_core.transport import Sample
    from actionlib_core.wire.encoding import Typed

TOLD = 1000  # what was reported is remembered so far back; senders can be made up


class Readable:
    """Checks the types of samples; reports what is dropped once of each kind, to `log`.

    Threads: any.
    """

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._lock = threading.Lock()
        self._told = Recent(TOLD)
        self._encodings: dict[type[Typed], str] = {}

    def check(self, sample: Sample, message_class: type[Typed]) -> bool:
        """Tell whether `message_class` reads a sample; if not, report its sender and type."""
        encoding = self._encodings.get(message_class)
        if encoding is None:
            encoding = self._encodings.setdefault(message_class, encoding_of(message_class))
        if sample.encoding == encoding:
            return True
        try:
            check_encoding(
                sample.encoding,
                message_class,
                name=sample.key,
                sender=f"session {sample.source or 'unknown'}",
            )
        except TypeMismatchError as error:
            self.report(f"{sample.source} {sample.encoding}", error)
            return False
        return True

    def report(self, about: str, error: ActionlibError) -> None:
        """Log an error, unless one about the same was: a sender may go on like this."""
        with self._lock:
            known = about in self._told
            self._told.add(about)
        if not known:
            self._log.error("%s", error)
