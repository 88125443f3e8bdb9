"""A tree of coordinate frames over time: add transforms, look up transforms between two frames.

A transform of (parent, child) holds translation [m] and rotation (quaternion x, y, z, w) that take
coordinates in the child frame to the parent frame, as in geometry_msgs/TransformStamped. Between
two known times translations are interpolated linearly and rotations along the shortest arc.

Source:
    https://wiki.ros.org/tf2 for the meaning, the texts of errors and the ten seconds of history.
"""

from __future__ import annotations

import bisect
import math
import threading
from dataclasses import dataclass, field
from typing import Final, NamedTuple

CACHE_S: Final = 10.0
"""A transform is dropped when it is older than the newest one by this time [s]."""


class FrameError(Exception):
    """A transform cannot be added or looked up."""


class UnknownFrameError(FrameError):
    """A frame is not known."""


class UnconnectedFramesError(FrameError):
    """Two frames are not in the same tree."""


class OutOfTimeError(FrameError):
    """The requested time is before the first or after the last known transform."""


class Transform(NamedTuple):
    """Translation [m] and rotation (x, y, z, w)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    qw: float = 1.0

    def then(self, other: Transform) -> Transform:
        """Return the product self * other: it applies `other` first."""
        x, y, z = self.apply(other.x, other.y, other.z)
        ax, ay, az, aw = self[3:]
        bx, by, bz, bw = other[3:]
        return Transform(
            x,
            y,
            z,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )

    def inverse(self) -> Transform:
        """Return the inverse transform."""
        back = Transform(0.0, 0.0, 0.0, -self.qx, -self.qy, -self.qz, self.qw)
        x, y, z = back.apply(-self.x, -self.y, -self.z)
        return Transform(x, y, z, *back[3:])

    def apply(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """Return a point of the child frame in the parent frame [m]."""
        # Rotation of v by the unit quaternion (q, w): v + w * t + q x t with t = 2 * (q x v).
        qx, qy, qz, qw = self[3:]
        tx, ty, tz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
        return (
            self.x + x + qw * tx + qy * tz - qz * ty,
            self.y + y + qw * ty + qz * tx - qx * tz,
            self.z + z + qw * tz + qx * ty - qy * tx,
        )


IDENTITY: Final = Transform()


def interpolate(before: Transform, after: Transform, share: float) -> Transform:
    """Return the transform between two others; `share` is 0 at `before` and 1 at `after`."""
    x, y, z = (a + (b - a) * share for a, b in zip(before[:3], after[:3], strict=True))
    one, two = before[3:], after[3:]
    dot = sum(a * b for a, b in zip(one, two, strict=True))
    # q and -q are the same rotation; of the two, take the one that gives the shorter arc.
    if dot < 0:
        two, dot = (-two[0], -two[1], -two[2], -two[3]), -dot
    angle = math.acos(min(dot, 1.0))
    if angle < 1e-6:  # noqa: PLR2004  the same rotation; the division below would be by 0
        return Transform(x, y, z, *one)
    left, right = math.sin((1 - share) * angle), math.sin(share * angle)
    whole = math.sin(angle)
    turned = ((a * left + b * right) / whole for a, b in zip(one, two, strict=True))
    return Transform(x, y, z, *turned)


@dataclass(slots=True)
class _Edge:
    """The history of a frame relative to its parent: times [ns] in order, and transforms."""

    parent: str
    static: bool = False
    times: list[int] = field(default_factory=list)
    transforms: list[Transform] = field(default_factory=list)


class Frames:
    """The tree of frames.

    Args:
        cache_s: Length of the history [s].

    Threads: every method may be called from any thread.
    """

    def __init__(self, cache_s: float = CACHE_S) -> None:
        self._cache_ns = int(cache_s * 1e9)
        self._edges: dict[str, _Edge] = {}
        self._lock = threading.Lock()

    def add(
        self, parent: str, child: str, stamp_ns: int, transform: Transform, *, static: bool = False
    ) -> None:
        """Add a transform; it replaces one of the same time, or the history of another parent.

        Raises:
            FrameError: a frame is its own parent, or a number is not finite.
        """
        parent, child = _clean(parent), _clean(child)
        if not child or parent == child:
            raise FrameError(f"transform: got frame {child!r} in {parent!r}; expected two frames.")
        if not all(map(math.isfinite, transform)):
            raise FrameError(f"transform of {child!r}: got {transform}; expected finite numbers.")
        length = math.sqrt(sum(part * part for part in transform[3:]))
        if length < 1e-9:  # noqa: PLR2004
            raise FrameError(
                f"transform of {child!r}: got no rotation; expected a unit quaternion."
            )
        transform = Transform(*transform[:3], *(part / length for part in transform[3:]))
        with self._lock:
            edge = self._edges.get(child)
            if edge is None or edge.parent != parent or edge.static or static:
                edge = self._edges[child] = _Edge(parent, static)
            index = bisect.bisect_left(edge.times, stamp_ns)
            if edge.times[index : index + 1] == [stamp_ns]:
                edge.transforms[index] = transform
                return
            edge.times.insert(index, stamp_ns)
            edge.transforms.insert(index, transform)
            old = bisect.bisect_left(edge.times, edge.times[-1] - self._cache_ns)
            del edge.times[:old], edge.transforms[:old]

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._edges.clear()

    def forget_moving(self) -> None:
        """Forget all but static transforms."""
        with self._lock:
            self._edges = {name: edge for name, edge in self._edges.items() if edge.static}

    def names(self) -> list[str]:
        """Return the names of all frames."""
        with self._lock:
            return sorted({*self._edges, *(edge.parent for edge in self._edges.values())})

    def look_up(self, target: str, source: str, stamp_ns: int = 0) -> tuple[Transform, int]:
        """Return the transform of coordinates from `source` to `target`, and its time [ns].

        Args:
            target: Frame of the result.
            source: Frame of the coordinates.
            stamp_ns: The time; 0: the latest time for which all transforms in between are known.

        Raises:
            UnknownFrameError: one of the frames is not known.
            UnconnectedFramesError: they have no common ancestor.
            OutOfTimeError: a transform in between is not known at that time.
        """
        target, source = _clean(target), _clean(source)
        with self._lock:
            up, down = self._way(target, source)
            if stamp_ns == 0:
                edges = [self._edges[name] for name in (*up, *down)]
                times = [edge.times[-1] for edge in edges if not edge.static]
                stamp_ns = min(times, default=0)
            # From source up to the common ancestor, and from target up to it; the second is
            # inverted, as it is needed downwards.
            there, back = IDENTITY, IDENTITY
            for name in up:
                there = self._at(name, stamp_ns).then(there)
            for name in down:
                back = self._at(name, stamp_ns).then(back)
        return back.inverse().then(there), stamp_ns

    def _way(self, target: str, source: str) -> tuple[list[str], list[str]]:
        """Return the frames from source, and from target, up to their common ancestor.

        The ancestor itself is in neither list.
        """
        for argument, name, other in (
            ("target_frame", target, source),
            ("source_frame", source, target),
        ):
            known = name in self._edges or any(e.parent == name for e in self._edges.values())
            if not known and name != other:
                raise UnknownFrameError(
                    f'"{name}" passed to lookupTransform argument {argument} does not exist.'
                )
        above = self._ancestors(target)
        up: list[str] = []
        name = source
        for name in self._ancestors(source):
            if name in above:
                break
            up.append(name)
        else:
            raise UnconnectedFramesError(
                f"Could not find a connection between '{target}' and '{source}' because they are "
                "not part of the same tree."
            )
        return up, above[: above.index(name)]

    def _ancestors(self, name: str) -> list[str]:
        found = [name]
        # The second condition ends it where messages have made a cycle.
        while name in self._edges and self._edges[name].parent not in found:
            name = self._edges[name].parent
            found.append(name)
        return found

    def _at(self, name: str, stamp_ns: int) -> Transform:
        edge = self._edges[name]
        times = edge.times
        if edge.static:
            return edge.transforms[-1]
        index = bisect.bisect_left(times, stamp_ns)
        if index < len(times) and times[index] == stamp_ns:
            return edge.transforms[index]
        if index in {0, len(times)}:
            when = "past" if index == 0 else "future"
            raise OutOfTimeError(
                f"Lookup would require extrapolation into the {when}.  Requested time "
                f"{stamp_ns / 1e9:.9f} but the {'earliest' if index == 0 else 'latest'} data is at "
                f"time {times[0 if index == 0 else -1] / 1e9:.9f}, when looking up transform of "
                f"frame [{name}] in frame [{edge.parent}]"
            )
        share = (stamp_ns - times[index - 1]) / (times[index] - times[index - 1])
        return interpolate(edge.transforms[index - 1], edge.transforms[index], share)


def _clean(name: str) -> str:
    """Return a frame's name as in tf2; in tf, names may have a slash in front."""
    return str(name).lstrip("/")
