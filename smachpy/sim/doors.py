"""Doors that open and close."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from smachpy.places.floor import Bar

if TYPE_CHECKING:
    from smachpy.sim.world import World

_HALF_THICKNESS: Final = 0.05  # [m] of a door's leaf


class Door:
    """A door in a doorway. It blocks the doorway until it is completely open.

    Threads: as for its world; `is_open` may be read from any thread.

    Attributes:
        name: One word.
        bar: Its leaf when closed.
        travel: How long it takes to open or to close [s].
        share: How far it is open, 0 to 1.
    """

    def __init__(
        self,
        world: World,
        name: str,
        ends: tuple[float, float, float, float],
        *,
        travel: float = 3.0,
        is_open: bool = False,
    ) -> None:
        self.name = name
        self.bar = Bar(*ends, radius=_HALF_THICKNESS, name=f"door {name}")
        self.travel = travel
        self.share = 1.0 if is_open else 0.0
        self._world = world
        self._opening = is_open
        if not is_open:
            world.add_thing(self.bar)

    @property
    def is_open(self) -> bool:
        """Whether a robot can drive through."""
        return self.share >= 1.0

    @property
    def is_moving(self) -> bool:
        """Whether it is opening or closing."""
        return self.share != (1.0 if self._opening else 0.0)

    def set(self, *, opening: bool) -> str:
        """Open or close it.

        Returns:
            Why it does not move; "" if it does. It does not close on anybody.
        """
        if not opening and self.is_open:
            someone = self._world.who_is_at(self.bar)
            if someone:
                return f"door {self.name}: {someone} stands in the doorway; try again later"
            self._world.add_thing(self.bar)
        self._opening = opening
        if not self.travel:
            self.step(1.0)
        return ""

    def step(self, dt: float) -> None:
        """Move for `dt` seconds."""
        if not self.is_moving:
            return
        part = dt / self.travel if self.travel else 1.0
        if self._opening:
            self.share = min(1.0, self.share + part)
            if self.is_open:
                self._world.remove_thing(self.bar)
        else:
            self.share = max(0.0, self.share - part)
