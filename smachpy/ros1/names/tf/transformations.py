"""Rotations and 4x4 matrices, with the names, arguments and quaternions (x, y, z, w) of tf.

Results are NumPy arrays. transforms3d does the Euler angles.

Source:
    tf.transformations of ROS 1 (Christoph Gohlke's transformations.py) for names and meaning; the
    formulas are those of https://en.wikipedia.org/wiki/Quaternions_and_spatial_rotation.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from smachpy.ros1.extra import import_extra

np: Any = import_extra("numpy", "tf.transformations")
_euler: Any = import_extra("transforms3d.euler", "tf.transformations")
_quaternions: Any = import_extra("transforms3d.quaternions", "tf.transformations")
_affines: Any = import_extra("transforms3d.affines", "tf.transformations")

Array: TypeAlias = Any

_EPS = np.finfo(float).eps * 4.0


def _wxyz(quaternion: Any) -> Array:
    x, y, z, w = quaternion
    return np.array([w, x, y, z], dtype=np.float64)


def _xyzw(quaternion: Any) -> Array:
    w, x, y, z = quaternion
    return np.array([x, y, z, w], dtype=np.float64)


def _matrix(rotation: Any) -> Array:
    made = np.identity(4)
    made[:3, :3] = rotation
    return made


def identity_matrix() -> Array:
    """Return the 4x4 identity."""
    return np.identity(4)


def translation_matrix(direction: Any) -> Array:
    """Return the matrix that moves by `direction` [m]."""
    made = np.identity(4)
    made[:3, 3] = direction[:3]
    return made


def translation_from_matrix(matrix: Any) -> Array:
    """Return the translation of a matrix [m]."""
    return np.array(matrix, copy=False if np.__version__ < "2" else None)[:3, 3].copy()


def euler_matrix(ai: float, aj: float, ak: float, axes: str = "sxyz") -> Array:
    """Return the matrix of Euler angles [rad] about `axes`."""
    return _matrix(_euler.euler2mat(ai, aj, ak, axes))


def euler_from_matrix(matrix: Any, axes: str = "sxyz") -> tuple[float, float, float]:
    """Return the Euler angles of a matrix [rad] about `axes`."""
    ai, aj, ak = _euler.mat2euler(np.asarray(matrix, dtype=float)[:3, :3], axes)
    return float(ai), float(aj), float(ak)


def euler_from_quaternion(quaternion: Any, axes: str = "sxyz") -> tuple[float, float, float]:
    """Return the Euler angles of a quaternion (x, y, z, w) [rad] about `axes`."""
    return euler_from_matrix(quaternion_matrix(quaternion), axes)


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: str = "sxyz") -> Array:
    """Return the quaternion (x, y, z, w) of Euler angles [rad] about `axes`."""
    return _xyzw(_euler.euler2quat(ai, aj, ak, axes))


def quaternion_about_axis(angle: float, axis: Any) -> Array:
    """Return the quaternion of a rotation by `angle` [rad] about `axis`."""
    direction = np.asarray(axis, dtype=float)[:3]
    length = float(np.linalg.norm(direction))
    half = direction * (math.sin(angle / 2.0) / length if length > _EPS else 1.0)
    return np.array([*half, math.cos(angle / 2.0)])


def quaternion_matrix(quaternion: Any) -> Array:
    """Return the 4x4 matrix of a quaternion (x, y, z, w), which need not have length 1."""
    if float(np.dot(quaternion, quaternion)) < _EPS:
        return np.identity(4)
    return _matrix(_quaternions.quat2mat(_wxyz(quaternion)))


def quaternion_from_matrix(matrix: Any) -> Array:
    """Return the quaternion (x, y, z, w) of a matrix."""
    return _xyzw(_quaternions.mat2quat(np.asarray(matrix, dtype=float)[:3, :3]))


def quaternion_multiply(quaternion1: Any, quaternion0: Any) -> Array:
    """Return the product: the rotation by `quaternion0`, then by `quaternion1`."""
    return _xyzw(_quaternions.qmult(_wxyz(quaternion1), _wxyz(quaternion0)))


def quaternion_conjugate(quaternion: Any) -> Array:
    """Return the conjugate; for a quaternion of length 1 it is the inverse."""
    x, y, z, w = quaternion
    return np.array([-x, -y, -z, w], dtype=np.float64)


def quaternion_inverse(quaternion: Any) -> Array:
    """Return the inverse."""
    return quaternion_conjugate(quaternion) / np.dot(quaternion, quaternion)


def quaternion_slerp(
    quat0: Any, quat1: Any, fraction: float, spin: int = 0, shortestpath: bool = True
) -> Array:
    """Return a rotation between two others; `fraction` is 0 at `quat0` and 1 at `quat1`."""
    q0, q1 = unit_vector(np.array(quat0[:4])), unit_vector(np.array(quat1[:4]))
    if fraction in {0.0, 1.0}:
        return q1 if fraction else q0
    dot = float(np.dot(q0, q1))
    if abs(abs(dot) - 1.0) < _EPS:
        return q0
    if shortestpath and dot < 0.0:
        dot, q1 = -dot, -q1
    angle = math.acos(dot) + spin * math.pi
    if abs(angle) < _EPS:
        return q0
    left, right = math.sin((1.0 - fraction) * angle), math.sin(fraction * angle)
    return (q0 * left + q1 * right) / math.sin(angle)


def random_quaternion(rand: Any = None) -> Array:
    """Return a uniformly distributed random rotation; `rand`: three numbers from 0 to 1."""
    r0, r1, r2 = np.random.rand(3) if rand is None else rand
    one, two = math.sqrt(1.0 - r0), math.sqrt(r0)
    a, b = 2.0 * math.pi * r1, 2.0 * math.pi * r2
    return np.array([math.sin(a) * one, math.cos(a) * one, math.sin(b) * two, math.cos(b) * two])


def random_rotation_matrix(rand: Any = None) -> Array:
    """Return the matrix of a uniformly distributed random rotation."""
    return quaternion_matrix(random_quaternion(rand))


def rotation_matrix(angle: float, direction: Any, point: Any = None) -> Array:
    """Return the matrix of a rotation by `angle` [rad] about an axis through `point` [m]."""
    made = quaternion_matrix(quaternion_about_axis(angle, direction))
    if point is not None:
        place = np.asarray(point, dtype=float)[:3]
        made[:3, 3] = place - made[:3, :3] @ place
    return made


def rotation_from_matrix(matrix: Any) -> tuple[float, Array, Array]:
    """Return angle [rad], direction and point of the rotation in a matrix."""
    given = np.asarray(matrix, dtype=float)
    # Points on the axis do not move: they are an eigenvector for the eigenvalue 1.
    direction, angle = _quaternions.quat2axangle(_quaternions.mat2quat(given[:3, :3]))
    values, vectors = np.linalg.eig(given)
    index = int(np.argmin(abs(np.real(values) - 1.0) + abs(np.imag(values))))
    candidates = [i for i in range(4) if abs(np.real(values[i]) - 1.0) < 1e-8]  # noqa: PLR2004
    point = np.real(vectors[:, candidates[-1] if candidates else index])
    if abs(point[3]) > _EPS:
        point = point / point[3]
    return float(angle), np.asarray(direction), point


def scale_matrix(factor: float, origin: Any = None, direction: Any = None) -> Array:
    """Return the matrix that scales about `origin` [m], only along `direction` if it is given."""
    made = np.identity(4)
    if direction is None:
        made[:3, :3] *= factor
    else:
        axis = unit_vector(np.asarray(direction, dtype=float)[:3])
        made[:3, :3] -= (1.0 - factor) * np.outer(axis, axis)
    if origin is not None:
        place = np.asarray(origin, dtype=float)[:3]
        made[:3, 3] = place - made[:3, :3] @ place
    return made


def reflection_matrix(point: Any, normal: Any) -> Array:
    """Return the matrix that reflects at the plane through `point` [m]."""
    return scale_matrix(-1.0, point, normal)


def compose_matrix(
    scale: Any = None, shear: Any = None, angles: Any = None, translate: Any = None, _p: Any = None
) -> Array:
    """Return the matrix of these operations in this order; angles about fixed x, y, z [rad]."""
    rotation = _euler.euler2mat(*angles) if angles is not None else np.identity(3)
    return _affines.compose(
        translate if translate is not None else np.zeros(3),
        rotation,
        scale if scale is not None else np.ones(3),
        shear,
    )


def decompose_matrix(matrix: Any) -> tuple[Array, Array, Any, Array, Array]:
    """Return scale, shear, angles [rad], translation [m] and perspective of a matrix."""
    place, rotation, scale, shear = _affines.decompose(np.asarray(matrix, dtype=float))
    return scale, shear, _euler.mat2euler(rotation), place, np.array([0.0, 0.0, 0.0, 1.0])


def inverse_matrix(matrix: Any) -> Array:
    """Return the inverse."""
    return np.linalg.inv(matrix)


def concatenate_matrices(*matrices: Any) -> Array:
    """Return the product."""
    made = np.identity(4)
    for matrix in matrices:
        made = made @ matrix
    return made


def is_same_transform(matrix0: Any, matrix1: Any) -> bool:
    """Return whether two matrices are the same transform."""
    one, two = (np.array(matrix, dtype=float) for matrix in (matrix0, matrix1))
    return bool(np.allclose(one / one[3, 3], two / two[3, 3]))


def unit_vector(data: Any, axis: int | None = None, out: Any = None) -> Array:
    """Return the vector with length 1, along `axis` if one is given."""
    given = np.array(data, dtype=np.float64)
    length = np.sqrt(np.sum(given * given, axis=axis, keepdims=axis is not None))
    if out is not None:
        out[:] = given / length
        return out
    return given / length


def vector_norm(data: Any, axis: int | None = None, out: Any = None) -> Any:
    """Return the length."""
    length = np.sqrt(np.sum(np.square(np.asarray(data, dtype=float)), axis=axis))
    if out is not None:
        out[...] = length
        return None
    return length if axis is not None else float(length)


def random_vector(size: Any) -> Array:
    """Return random numbers from 0 to 1."""
    return np.random.random(size)


def vector_product(v0: Any, v1: Any, axis: int = 0) -> Array:
    """Return the vector product."""
    return np.cross(v0, v1, axis=axis)


def angle_between_vectors(v0: Any, v1: Any, directed: bool = True, axis: int = 0) -> Any:
    """Return the angle between two vectors [rad]."""
    one, two = np.asarray(v0, dtype=float), np.asarray(v1, dtype=float)
    dot = np.sum(one * two, axis=axis) / (
        np.linalg.norm(one, axis=axis) * np.linalg.norm(two, axis=axis)
    )
    return np.arccos(np.clip(dot if directed else np.fabs(dot), -1.0, 1.0))
