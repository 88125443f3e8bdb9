"""Rotations and 4x4 matrices, with the names, arguments and quaternions (x, y, z, w) of tf.

tf has an old copy of the package `transformations`, which does all the work here. The quaternions
of its newer versions are (w, x, y, z), so they are turned on the way in and out.
"""

from __future__ import annotations

from typing import Any, TypeAlias

from smachpy.ros1.extra import import_extra

np: Any = import_extra("numpy", "tf.transformations")
_new: Any = import_extra("transformations.transformations", "tf.transformations")

Array: TypeAlias = Any

angle_between_vectors = _new.angle_between_vectors
clip_matrix = _new.clip_matrix
compose_matrix = _new.compose_matrix
concatenate_matrices = _new.concatenate_matrices
decompose_matrix = _new.decompose_matrix
euler_from_matrix = _new.euler_from_matrix
euler_matrix = _new.euler_matrix
identity_matrix = _new.identity_matrix
inverse_matrix = _new.inverse_matrix
is_same_transform = _new.is_same_transform
orthogonalization_matrix = _new.orthogonalization_matrix
projection_from_matrix = _new.projection_from_matrix
projection_matrix = _new.projection_matrix
random_rotation_matrix = _new.random_rotation_matrix
random_vector = _new.random_vector
reflection_from_matrix = _new.reflection_from_matrix
reflection_matrix = _new.reflection_matrix
rotation_from_matrix = _new.rotation_from_matrix
rotation_matrix = _new.rotation_matrix
scale_from_matrix = _new.scale_from_matrix
shear_from_matrix = _new.shear_from_matrix
shear_matrix = _new.shear_matrix
superimposition_matrix = _new.superimposition_matrix
translation_from_matrix = _new.translation_from_matrix
translation_matrix = _new.translation_matrix
unit_vector = _new.unit_vector
vector_norm = _new.vector_norm
vector_product = _new.vector_product


def _wxyz(quaternion: Any) -> Array:
    return np.roll(np.asarray(quaternion, dtype=float), 1)


def _xyzw(quaternion: Any) -> Array:
    return np.roll(quaternion, -1)


def euler_from_quaternion(quaternion: Any, axes: str = "sxyz") -> tuple[float, float, float]:
    """Return the Euler angles [rad] of a quaternion about `axes`."""
    return _new.euler_from_quaternion(_wxyz(quaternion), axes)  # type: ignore[no-any-return]


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: str = "sxyz") -> Array:
    """Return the quaternion of Euler angles [rad] about `axes`."""
    return _xyzw(_new.quaternion_from_euler(ai, aj, ak, axes))


def quaternion_about_axis(angle: float, axis: Any) -> Array:
    """Return the quaternion of a rotation by `angle` [rad] about `axis`."""
    return _xyzw(_new.quaternion_about_axis(angle, axis))


def quaternion_matrix(quaternion: Any) -> Array:
    """Return the 4x4 matrix of a quaternion, which need not have length 1."""
    return _new.quaternion_matrix(_wxyz(quaternion))


def quaternion_from_matrix(matrix: Any) -> Array:
    """Return the quaternion of a matrix."""
    return _xyzw(_new.quaternion_from_matrix(matrix))


def quaternion_multiply(quaternion1: Any, quaternion0: Any) -> Array:
    """Return the product: the rotation by `quaternion0`, then by `quaternion1`."""
    return _xyzw(_new.quaternion_multiply(_wxyz(quaternion1), _wxyz(quaternion0)))


def quaternion_conjugate(quaternion: Any) -> Array:
    """Return the conjugate; for a quaternion of length 1 it is the inverse."""
    return _xyzw(_new.quaternion_conjugate(_wxyz(quaternion)))


def quaternion_inverse(quaternion: Any) -> Array:
    """Return the inverse."""
    return _xyzw(_new.quaternion_inverse(_wxyz(quaternion)))


def quaternion_slerp(
    quat0: Any, quat1: Any, fraction: float, spin: int = 0, shortestpath: bool = True
) -> Array:
    """Return a rotation between two others; `fraction` is 0 at `quat0` and 1 at `quat1`."""
    made = _new.quaternion_slerp(_wxyz(quat0), _wxyz(quat1), fraction, spin, shortestpath)
    return _xyzw(made)


def scale_matrix(factor: float, origin: Any = None, direction: Any = None) -> Array:
    """Return the matrix that scales about `origin`, only along `direction` if it is given."""
    # The compiled function takes the direction for one of length 1.
    return _new.scale_matrix(factor, origin, None if direction is None else unit_vector(direction))


def random_quaternion(rand: Any = None) -> Array:
    """Return a uniformly distributed random rotation; `rand`: three numbers from 0 to 1."""
    return _xyzw(_new.random_quaternion(rand))
