"""What the scripted ends of a test have in common: a node of their own, on a failing network."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from actionlib_core.node import Node
from actionlib_core.transport.faulty import DELIVERED, DROPPED, FaultyTransport

if TYPE_CHECKING:
    from actionlib_core.transport._faults import Fate
    from smachpy.testing.kit import MissionKit

LOST: Fate = DROPPED
TWICE: Fate = (0.0, 0.0)
MOST_ERRORS = 5  # so many are told


class ScriptedEnd:
    """One scripted server or topic: a process of its own, as far as the mission can see.

    Attributes:
        name: Its name on the network.
        errors: What went otherwise than the script says; the run fails with it.
        causes: What the test's own functions raised.
    """

    def __init__(self, kit: MissionKit, name: str) -> None:
        self.name = name
        self.errors: list[str] = []
        self.causes: list[BaseException] = []
        self._kit = kit
        self._clock = kit.clock
        self._fates: dict[str, deque[Fate]] = {}
        self._join()

    def _join(self) -> None:
        """Join the network as a new process."""
        self._session = self._kit.network.session()
        transport = FaultyTransport(self._session, self._fate, clock=self._clock)
        self._link = transport
        word = self.name.strip("/").replace("/", "_")
        self.node = Node(f"{word}_double", transport=transport, clock=self._clock)

    def _fate(self, key: str, _number: int) -> Fate:
        fates = self._fates.get(key.rpartition("/")[2])
        return fates.popleft() if fates else DELIVERED

    def _doom(self, word: str, fate: Fate = LOST, count: int = 1) -> None:
        """Give the next messages on keys that end with `word` this fate."""
        self._fates.setdefault(word, deque()).extend([fate] * count)

    def cut(self, seconds: float | None = None) -> None:
        """Cut its link to the network, for `seconds` or until `restore`."""
        self._link.cut(seconds)

    def restore(self) -> None:
        """Mend the link."""
        self._link.restore()

    def kill(self) -> None:
        """Die as a process does that gets SIGKILL."""
        self._session.kill()

    def note_raised(self, function: object, error: BaseException) -> str:
        """Note what a function of the test raised, and return it as a text."""
        name = getattr(function, "__qualname__", None) or repr(function)
        text = f"{self.name}: {name} of the test raised {type(error).__name__}: {error}"
        self.errors.append(text)
        self.causes.append(error)
        return text

    def take_errors(self) -> list[str]:
        """Return what went otherwise than the script says, and forget it."""
        errors, self.errors = self.errors, []
        more = len(errors) - MOST_ERRORS
        return [*errors[:MOST_ERRORS], *([f"{self.name}: and {more} more"] if more > 0 else [])]

    def take_causes(self) -> list[BaseException]:
        """Return what the test's own functions raised, and forget it."""
        causes, self.causes = self.causes, []
        return causes

    def verify(self) -> None:
        """Fail if something went otherwise than the script says."""
        __tracebackhide__ = True
        raise_errors(self.take_errors(), self.take_causes())

    def close(self) -> None:
        """Leave the network."""
        if not self._session.killed:
            self.node.close()


def raise_errors(errors: list[str], causes: list[BaseException]) -> None:
    """Fail with what went otherwise than the test says, if anything did.

    Raises:
        AssertionError: from the first of `causes`.
    """
    __tracebackhide__ = True
    if errors:
        raise AssertionError("\n".join(errors)) from (causes[0] if causes else None)


def as_message(kind: Any, value: Any, what: str) -> Any:
    """Return a message of class `kind` from one, from a dict of its fields, or from None.

    Raises:
        TypeError: it is something else.
    """
    if value is None:
        return kind()
    if isinstance(value, kind):
        return value
    if isinstance(value, dict):
        return kind(**value)
    raise TypeError(f"{what}: got {value!r}; expected {kind._type}, a dict of its fields, or None.")
