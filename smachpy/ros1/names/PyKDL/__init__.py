"""PyKDL: the parts of it that mission scripts use: vectors, rotations, frames, twists, wrenches.

Angles are in rad.

Source:
    http://docs.ros.org/en/melodic/api/kdl_python/html/ for names and meaning.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from smachpy.states.frames import Transform

if TYPE_CHECKING:
    from collections.abc import Iterator


class Vector:
    """Three numbers: `v[0]`, `v.x()`, `v.x(1.0)`."""

    def __init__(self, x: Any = 0.0, y: float = 0.0, z: float = 0.0) -> None:
        given = tuple(x) if isinstance(x, Vector) else (x, y, z)
        self._values = [float(value) for value in given]

    @staticmethod
    def Zero() -> Vector:
        """Return the zero vector."""
        return Vector()

    def x(self, value: float | None = None) -> float:
        """Return x, or set it."""
        return self._part(0, value)

    def y(self, value: float | None = None) -> float:
        """Return y, or set it."""
        return self._part(1, value)

    def z(self, value: float | None = None) -> float:
        """Return z, or set it."""
        return self._part(2, value)

    def _part(self, index: int, value: float | None) -> float:
        if value is not None:
            self._values[index] = float(value)
        return self._values[index]

    def Norm(self) -> float:
        """Return its length."""
        return math.sqrt(dot(self, self))

    def Normalize(self) -> float:
        """Scale it to length 1; return its former length."""
        length = self.Norm()
        # KDL makes a vector of length 0 the unit vector x.
        self._values = [value / length for value in self._values] if length else [1.0, 0.0, 0.0]
        return length

    def __getitem__(self, index: int) -> float:
        return self._values[index]

    def __setitem__(self, index: int, value: float) -> None:
        self._values[index] = float(value)

    def __iter__(self) -> Iterator[float]:
        return iter(tuple(self._values))

    def __len__(self) -> int:
        return 3

    def __add__(self, other: Vector) -> Vector:
        return Vector(*(a + b for a, b in zip(self, other, strict=True)))

    def __sub__(self, other: Vector) -> Vector:
        return Vector(*(a - b for a, b in zip(self, other, strict=True)))

    def __neg__(self) -> Vector:
        return Vector(*(-a for a in self))

    def __mul__(self, other: Any) -> Vector:
        """Multiply by a number; for two vectors return the vector product."""
        if isinstance(other, Vector):
            a, b, c = self
            x, y, z = other
            return Vector(b * z - c * y, c * x - a * z, a * y - b * x)
        return Vector(*(a * other for a in self))

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> Vector:
        return self * (1.0 / other)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Vector) and self._values == other._values

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "[{:12.6g},{:12.6g},{:12.6g}]".format(*self._values)


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return sum(x * y for x, y in zip(a, b, strict=True))


class Rotation:
    """A rotation: from nine numbers row by row, three columns, or one of the static methods."""

    def __init__(self, *rows: Any) -> None:
        if not rows:
            rows = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        if len(rows) == 1 and isinstance(rows[0], Rotation):
            rows = tuple(value for row in rows[0]._rows for value in row)
        elif len(rows) == 3:  # noqa: PLR2004  three columns
            rows = tuple(column[index] for index in range(3) for column in rows)
        values = [float(value) for value in rows]
        self._rows: tuple[list[float], list[float], list[float]] = (
            values[0:3],
            values[3:6],
            values[6:9],
        )

    @staticmethod
    def Identity() -> Rotation:
        """Return the identity."""
        return Rotation()

    @staticmethod
    def Quaternion(x: float, y: float, z: float, w: float) -> Rotation:
        """Return the rotation of a quaternion, which need not have length 1."""
        length = math.sqrt(x * x + y * y + z * z + w * w) or 1.0
        turn = Transform(0.0, 0.0, 0.0, x / length, y / length, z / length, w / length)
        return Rotation(*(Vector(*turn.apply(*axis)) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))))

    @staticmethod
    def Rot(axis: Vector, angle: float) -> Rotation:
        """Return a rotation by `angle` about `axis`."""
        length = axis.Norm() or 1.0
        half = math.sin(angle / 2) / length
        x, y, z = axis * half
        return Rotation.Quaternion(x, y, z, math.cos(angle / 2))

    Rot2 = Rot

    @staticmethod
    def RotX(angle: float) -> Rotation:
        """Return a rotation about x."""
        return Rotation.Rot(Vector(1, 0, 0), angle)

    @staticmethod
    def RotY(angle: float) -> Rotation:
        """Return a rotation about y."""
        return Rotation.Rot(Vector(0, 1, 0), angle)

    @staticmethod
    def RotZ(angle: float) -> Rotation:
        """Return a rotation about z."""
        return Rotation.Rot(Vector(0, 0, 1), angle)

    @staticmethod
    def RPY(roll: float, pitch: float, yaw: float) -> Rotation:
        """Return rotations about the fixed axes x, then y, then z."""
        made: Rotation = Rotation.RotZ(yaw) * Rotation.RotY(pitch) * Rotation.RotX(roll)
        return made

    @staticmethod
    def EulerZYX(alpha: float, beta: float, gamma: float) -> Rotation:
        """Return rotations about z, then the new y, then the new x."""
        return Rotation.RPY(gamma, beta, alpha)

    @staticmethod
    def EulerZYZ(alpha: float, beta: float, gamma: float) -> Rotation:
        """Return rotations about z, then the new y, then the new z."""
        made: Rotation = Rotation.RotZ(alpha) * Rotation.RotY(beta) * Rotation.RotZ(gamma)
        return made

    def DoRotX(self, angle: float) -> None:
        """Rotate it about its own x."""
        self._rows = (self * Rotation.RotX(angle))._rows

    def DoRotY(self, angle: float) -> None:
        """Rotate it about its own y."""
        self._rows = (self * Rotation.RotY(angle))._rows

    def DoRotZ(self, angle: float) -> None:
        """Rotate it about its own z."""
        self._rows = (self * Rotation.RotZ(angle))._rows

    def GetRPY(self) -> tuple[float, float, float]:
        """Return the angles about the fixed x, y, z."""
        rows = self._rows
        pitch = math.atan2(-rows[2][0], math.hypot(rows[0][0], rows[1][0]))
        # At a pitch of 90 degrees roll and yaw rotate about the same axis: all of it is yaw here.
        if abs(abs(pitch) - math.pi / 2) < 1e-9:  # noqa: PLR2004
            return 0.0, pitch, math.atan2(-rows[0][1], rows[1][1])
        return math.atan2(rows[2][1], rows[2][2]), pitch, math.atan2(rows[1][0], rows[0][0])

    def GetEulerZYX(self) -> tuple[float, float, float]:
        """Return the angles about z, the new y, the new x."""
        roll, pitch, yaw = self.GetRPY()
        return yaw, pitch, roll

    def GetQuaternion(self) -> tuple[float, float, float, float]:
        """Return the quaternion x, y, z, w."""
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        w = math.sqrt(max(0.0, 1 + a + e + i)) / 2
        x = math.copysign(math.sqrt(max(0.0, 1 + a - e - i)) / 2, h - f)
        y = math.copysign(math.sqrt(max(0.0, 1 - a + e - i)) / 2, c - g)
        z = math.copysign(math.sqrt(max(0.0, 1 - a - e + i)) / 2, d - b)
        # For a rotation by 180 degrees the differences above are 0 and give no signs; the sums of
        # the elements do, relative to the largest part.
        if w < 1e-9:  # noqa: PLR2004
            biggest = max((x, 0), (y, 1), (z, 2), key=lambda pair: abs(pair[0]))[1]
            signs = ((1.0, b + d, c + g), (b + d, 1.0, f + h), (c + g, f + h, 1.0))[biggest]
            x, y, z = (math.copysign(v, s) for v, s in zip((x, y, z), signs, strict=True))
        return x, y, z, w

    def GetRot(self) -> Vector:
        """Return axis times angle."""
        angle, axis = self.GetRotAngle()
        return axis * angle

    def GetRotAngle(self) -> tuple[float, Vector]:
        """Return angle and axis."""
        x, y, z, w = self.GetQuaternion()
        length = math.sqrt(x * x + y * y + z * z)
        if length < 1e-12:  # noqa: PLR2004  the identity, which has no axis
            return 0.0, Vector(0, 0, 1)
        return 2 * math.atan2(length, w), Vector(x, y, z) / length

    def UnitX(self) -> Vector:
        """Return the rotated unit vector x."""
        return Vector(*(row[0] for row in self._rows))

    def UnitY(self) -> Vector:
        """Return the rotated unit vector y."""
        return Vector(*(row[1] for row in self._rows))

    def UnitZ(self) -> Vector:
        """Return the rotated unit vector z."""
        return Vector(*(row[2] for row in self._rows))

    def Inverse(self, vector: Vector | None = None) -> Any:
        """Return the inverse, or a vector rotated by the inverse."""
        back = Rotation(*(row[index] for index in range(3) for row in self._rows))
        return back if vector is None else back * vector

    def __getitem__(self, place: tuple[int, int]) -> float:
        return self._rows[place[0]][place[1]]

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Vector):
            return Vector(*(dot(Vector(*row), other) for row in self._rows))
        if isinstance(other, Rotation):
            return Rotation(self * other.UnitX(), self * other.UnitY(), self * other.UnitZ())
        return type(other)(self * other[0], self * other[1])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Rotation) and self._rows == other._rows

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "[" + ";\n ".join(repr(Vector(*row))[1:-1] for row in self._rows) + "]"


class Frame:
    """A position `p` and a rotation `M`: `Frame(Rotation, Vector)`."""

    def __init__(self, *parts: Any) -> None:
        self.M, self.p = Rotation(), Vector()
        for part in parts:
            if isinstance(part, Rotation):
                self.M = Rotation(part)
            elif isinstance(part, Vector):
                self.p = Vector(part)
            elif isinstance(part, Frame):
                self.M, self.p = Rotation(part.M), Vector(part.p)

    @staticmethod
    def Identity() -> Frame:
        """Return the identity."""
        return Frame()

    def Inverse(self, vector: Vector | None = None) -> Any:
        """Return the inverse, or a vector transformed by the inverse."""
        back = Frame(self.M.Inverse(), -(self.M.Inverse() * self.p))
        return back if vector is None else back * vector

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Vector):
            return self.M * other + self.p
        if isinstance(other, Frame):
            return Frame(self.M * other.M, self.M * other.p + self.p)
        if isinstance(other, Twist):
            turned = self.M * other.rot
            return Twist(self.M * other.vel + self.p * turned, turned)
        force = self.M * other.force
        return Wrench(force, self.M * other.torque + self.p * force)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Frame) and self.M == other.M and self.p == other.p

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"[{self.M!r}\n{self.p!r}]"


class _Pair:
    """Base of twists and wrenches: two vectors, with their names in `_names`."""

    _names: tuple[str, str]

    def __init__(self, first: Vector | None = None, second: Vector | None = None) -> None:
        setattr(self, self._names[0], Vector(first or Vector()))
        setattr(self, self._names[1], Vector(second or Vector()))

    @classmethod
    def Zero(cls) -> Any:
        """Return one with zero vectors."""
        return cls()

    def _parts(self) -> tuple[Vector, Vector]:
        return getattr(self, self._names[0]), getattr(self, self._names[1])

    def __getitem__(self, index: int) -> float:
        return self._parts()[index // 3][index % 3]

    def __setitem__(self, index: int, value: float) -> None:
        self._parts()[index // 3][index % 3] = value

    def __add__(self, other: Any) -> Any:
        return type(self)(*(a + b for a, b in zip(self._parts(), other._parts(), strict=True)))

    def __sub__(self, other: Any) -> Any:
        return type(self)(*(a - b for a, b in zip(self._parts(), other._parts(), strict=True)))

    def __neg__(self) -> Any:
        return type(self)(*(-a for a in self._parts()))

    def __mul__(self, other: float) -> Any:
        return type(self)(*(a * other for a in self._parts()))

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> Any:
        return self * (1.0 / other)

    def __repr__(self) -> str:
        return f"{self._parts()[0]!r} {self._parts()[1]!r}"


class Twist(_Pair):
    """Velocities: `vel` [m/s], `rot` [rad/s]."""

    _names = ("vel", "rot")
    vel: Vector
    rot: Vector


class Wrench(_Pair):
    """Forces: `force` [N], `torque` [N m]."""

    _names = ("force", "torque")
    force: Vector
    torque: Vector


def diff(a: Any, b: Any, dt: float = 1.0) -> Any:
    """Return the velocity that leads from `a` to `b` in `dt` [s]."""
    if isinstance(a, Vector):
        return (b - a) / dt
    if isinstance(a, Rotation):
        return a * (a.Inverse() * b).GetRot() / dt
    return Twist(diff(a.p, b.p, dt), diff(a.M, b.M, dt))


def addDelta(a: Any, change: Any, dt: float = 1.0) -> Any:
    """Return `a` after moving with the velocity `change` for `dt` [s]."""
    if isinstance(a, Vector):
        return a + change * dt
    if isinstance(a, Rotation):
        turn = a.Inverse() * change * dt
        return a * Rotation.Rot(turn, turn.Norm())
    return Frame(addDelta(a.M, change.rot, dt), addDelta(a.p, change.vel, dt))


def Equal(a: Any, b: Any, eps: float = 1e-6) -> bool:
    """Return whether two objects of one kind differ by `eps` at most."""
    if isinstance(a, Vector):
        return all(abs(x - y) <= eps for x, y in zip(a, b, strict=True))
    if isinstance(a, Rotation):
        return all(
            Equal(Vector(*x), Vector(*y), eps) for x, y in zip(a._rows, b._rows, strict=True)
        )
    if isinstance(a, Frame):
        return Equal(a.M, b.M, eps) and Equal(a.p, b.p, eps)
    return all(Equal(x, y, eps) for x, y in zip(a._parts(), b._parts(), strict=True))
