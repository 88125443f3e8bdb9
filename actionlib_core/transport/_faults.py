"""What may happen to a message on a bad network, and who decides it."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.transport._keys import key_matches

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import TypeAlias

    Fate: TypeAlias = tuple[float, ...]
    Plan: TypeAlias = Callable[[str, int], Fate]

DELIVERED: Fate = (0.0,)
DROPPED: Fate = ()


def deliver_all(key: str, number: int) -> Fate:  # noqa: ARG001  a plan's signature
    """Return the fate of a message on a good network: one copy, at once."""
    return DELIVERED


@dataclass(frozen=True)
class RandomFaults:
    """Chooses fates at random; the seed, the key and the number of the message decide.

    Attributes:
        seed: Another one, other faults.
        pattern: Which keys are concerned.
        drop: Share of the messages that are lost, 0 to 1.
        repeat: Share of those that arrive twice.
        delay: Share of those that come late, and so out of order.
        longest: Longest delay [s].
    """

    seed: int
    pattern: str = "**"
    drop: float = 0.0
    repeat: float = 0.0
    delay: float = 0.0
    longest: float = 1.0

    def __call__(self, key: str, number: int) -> Fate:
        if not key_matches(self.pattern, key):
            return DELIVERED
        dice = random.Random(f"{self.seed} {key} {number}")  # noqa: S311  no secret
        if dice.random() < self.drop:
            return DROPPED
        copies = 2 if dice.random() < self.repeat else 1
        late = dice.random() < self.delay
        return tuple(dice.uniform(0, self.longest) if late or n else 0.0 for n in range(copies))


@dataclass(frozen=True)
class ScriptedFaults:
    """Gives the messages of a key the fates of a list, in turn; those after it are delivered.

    Attributes:
        fates: Key pattern -> fates; the first pattern that matches counts. A fate is the delays [s]
            of the copies: `()` loses the message, `(0.0,)` delivers it, `(0.0, 0.5)` repeats it.
    """

    fates: Mapping[str, Sequence[Fate]] = field(default_factory=dict)

    def __call__(self, key: str, number: int) -> Fate:
        for pattern, fates in self.fates.items():
            if key_matches(pattern, key):
                return fates[number] if number < len(fates) else DELIVERED
        return DELIVERED


class Sent(NamedTuple):
    """What became of a message, for the report of a failed test.

    Attributes:
        t: When it was sent [s].
        key: On which key.
        number: Which of that key, from 0.
        fate: The delays of its copies; empty when it was lost.
    """

    t: float
    key: str
    number: int
    fate: Fate
