"""The progress of a trip through waypoints, and an estimate of the remaining time."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import current_clock
from smachpy.states import Progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from smachpy.states import Pose2D
    from smachpy_missions.tour.tour_file import Stop

# [m, s] The pace before anything was measured. It is added to the measured totals, so that it
# dominates the first leg and is negligible after some metres.
_GUESS: Final = (3.0, 5.0)


@dataclass(frozen=True, slots=True)
class Trip:
    """A list of waypoints that is followed a number of times.

    Attributes:
        waypoints: The list.
        loop: The number of rounds; 0: without end.
        first: Index of the waypoint to begin with.
    """

    waypoints: tuple[Stop, ...]
    loop: int = 1
    first: int = 0

    @property
    def total(self) -> int | None:
        """The number of visits; None: no end."""
        return len(self.waypoints) * self.loop or None

    def waypoint(self, number: int) -> Stop:
        """Return the waypoint of visit `number`, counted from 0."""
        return self.waypoints[(self.first + number) % len(self.waypoints)]

    def begun_at(self, first: int) -> Trip:
        """Return the same trip with another first waypoint."""
        return dataclasses.replace(self, first=first)

    def nearest(self, here: Pose2D) -> int:
        """Return the index of the waypoint that is nearest in a straight line."""
        distances = [here.distance(waypoint.pose) for waypoint in self.waypoints]
        return distances.index(min(distances))


class TripWatch:
    """Estimates the remaining time of a trip from the pace so far.

    Legs are measured as straight lines: detours around walls make the pace slower.

    Threads: all methods are called in the thread that runs the mission.
    """

    def __init__(self) -> None:
        self._clock = current_clock()
        self._started = self._clock.now()
        self._metres, self._seconds = _GUESS
        self._leg: tuple[float, float] | None = None
        self._share = 0.0

    def end_leg(self, *, arrived: bool) -> None:
        """Note the end of a drive; only one that arrived counts for the pace."""
        leg, self._leg = self._leg, None
        if arrived and leg is not None:
            metres, since = leg
            self._metres += metres
            self._seconds += self._clock.now() - since

    def set_out(self, trip: Trip, number: int) -> Progress:
        """Return the progress before the drive to visit `number` (from 0)."""
        total, name = trip.total, trip.waypoint(number).name
        if total is None:
            return Progress(None, None, f"{number + 1} {name}")
        return Progress(self._forwards(number / total), None, f"{number + 1}/{total} {name}")

    def look(self, trip: Trip, number: int, here: Pose2D) -> Progress:
        """Return the progress while the robot, now at `here`, drives there."""
        progress, now = self.set_out(trip, number), self._clock.now()
        metres = here.distance(trip.waypoint(number).pose)
        if self._leg is None:
            self._leg = metres, now
        if trip.total is None:
            return progress
        ahead = [trip.waypoint(i) for i in range(number, trip.total)]
        metres += _length([waypoint.pose for waypoint in ahead])
        left = metres * self._seconds / self._metres + sum(place.dwell for place in ahead)
        spent = now - self._started
        share = spent / (spent + left) if spent + left > 0.0 else 0.0
        return Progress(self._forwards(share), float(round(left)), progress.text)

    def _forwards(self, share: float) -> float:
        """Return the share in hundredths, for a bar that never goes back."""
        self._share = max(self._share, round(share, 2))
        return self._share


def _length(places: Sequence[Pose2D]) -> float:
    return sum(a.distance(b) for a, b in itertools.pairwise(places))
