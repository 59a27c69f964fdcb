"""Rotations as unit quaternions (x, y, z, w) and their other forms.

All functions take and give arrays with any leading shape and never change their input.
Source: Zhou et al. 2019, On the Continuity of Rotation Representations (the 6D form); the rest is
textbook quaternion algebra in the xyzw order of Unity and glTF.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])


def normalised(q: ArrayLike) -> Array:
    """Unit quaternions (..., 4); zero or non-finite ones become the identity."""
    q = np.asarray(q, dtype=np.float64)
    finite = np.isfinite(q)
    return _unit(q if finite.all() else np.where(finite.all(axis=-1, keepdims=True), q, 0.0), IDENTITY)


def towards(a: Array, b: Array, share: float) -> Array:
    """Unit quaternions (..., 4) a share (0 to 1) of the way, along the chord, to others that are close."""
    # q and -q are one rotation: the nearer of the two, or the mean would turn the long way round.
    nearer = np.where((a * b).sum(axis=-1, keepdims=True) < 0, -b, b)
    return normalised(a + (nearer - a) * share)


def multiply(a: ArrayLike, b: ArrayLike) -> Array:
    """The rotation b followed by a, as quaternions (..., 4)."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    # By index and into one array: a live pose is worked out from many small products.
    ax, ay, az, aw = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bx, by, bz, bw = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    x = aw * bx + ax * bw + ay * bz - az * by
    out = np.empty((*x.shape, 4))
    out[..., 0] = x
    out[..., 1] = aw * by - ax * bz + ay * bw + az * bx
    out[..., 2] = aw * bz + ax * by - ay * bx + az * bw
    out[..., 3] = aw * bw - ax * bx - ay * by - az * bz
    return out


def inverse(q: ArrayLike) -> Array:
    """The opposite rotation of unit quaternions (..., 4)."""
    return np.asarray(q, dtype=np.float64) * np.array([-1.0, -1.0, -1.0, 1.0])


def rotate(q: ArrayLike, v: ArrayLike) -> Array:
    """Vectors (..., 3) turned by unit quaternions (..., 4)."""
    q, v = np.asarray(q, dtype=np.float64), np.asarray(v, dtype=np.float64)
    xyz, w = q[..., :3], q[..., 3:]
    twice = 2.0 * cross(xyz, v)
    return v + w * twice + cross(xyz, twice)


def cross(a: ArrayLike, b: ArrayLike) -> Array:
    """Cross products of vectors (..., 3); NumPy's own takes ten times as long for a few of them."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out = np.empty((*x.shape, 3))
    out[..., 0] = x
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def to_matrix(q: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    x, y, z, w = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(m: ArrayLike) -> Array:
    """Unit quaternions (..., 4) of rotation matrices (..., 3, 3), w >= 0.

    Source: Bar-Itzhack's choice of the largest of four candidates, which never divides by a small number.
    """
    m = np.asarray(m, dtype=np.float64)
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    c = np.empty((*xx.shape, 4, 4))
    c[..., 0, 0], c[..., 1, 1] = 1 + xx - yy - zz, 1 - xx + yy - zz
    c[..., 2, 2], c[..., 3, 3] = 1 - xx - yy + zz, 1 + xx + yy + zz
    c[..., 0, 1] = c[..., 1, 0] = m[..., 1, 0] + m[..., 0, 1]
    c[..., 0, 2] = c[..., 2, 0] = m[..., 0, 2] + m[..., 2, 0]
    c[..., 1, 2] = c[..., 2, 1] = m[..., 2, 1] + m[..., 1, 2]
    c[..., 0, 3] = c[..., 3, 0] = m[..., 2, 1] - m[..., 1, 2]
    c[..., 1, 3] = c[..., 3, 1] = m[..., 0, 2] - m[..., 2, 0]
    c[..., 2, 3] = c[..., 3, 2] = m[..., 1, 0] - m[..., 0, 1]
    best = np.argmax(np.einsum("...ii->...i", c), axis=-1)
    q = normalised(c.reshape(-1, 4, 4)[np.arange(best.size), best.reshape(-1)].reshape(*best.shape, 4))
    return np.where(q[..., 3:] < 0, -q, q)


def to_6d(q: ArrayLike) -> Array:
    """The first two columns of the rotation matrix, (..., 6)."""
    m = to_matrix(q)
    return np.concatenate([m[..., :, 0], m[..., :, 1]], axis=-1)


def from_6d(d: ArrayLike) -> Array:
    """Unit quaternions (..., 4) from any six numbers (..., 6), made orthonormal by Gram-Schmidt.

    Numbers that are not finite count as zero.
    """
    d = np.asarray(d, dtype=np.float64)
    d = np.where(np.isfinite(d), d, 0.0)
    x = _unit(d[..., :3], np.array([1.0, 0.0, 0.0]))
    # Columns that are parallel leave y undefined; any axis across x completes the frame.
    across = np.where(np.abs(x[..., 1:2]) < 0.9, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    y = _unit(d[..., 3:], across)
    y = y - (x * y).sum(axis=-1, keepdims=True) * x
    across = across - (x * across).sum(axis=-1, keepdims=True) * x
    y = _unit(y, across)
    return from_matrix(np.stack([x, y, cross(x, y)], axis=-1))


def _unit(v: Array, otherwise: Array) -> Array:
    """Finite vectors (..., n) at length 1; those of no length become `otherwise`."""
    largest = np.abs(v).max(axis=-1, keepdims=True, initial=0.0)
    if largest.max(initial=0.0) > 1.0:
        # By the largest part first, or the squares of huge numbers overflow.
        v = v / np.maximum(largest, 1.0)
    length = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    good = length > 1e-8
    if (
        good.all()
    ):  # nearly always: a live pose is worked out from many small steps, each as dear as its calls
        return v / length
    fallback = otherwise / np.linalg.norm(otherwise, axis=-1, keepdims=True)
    return np.where(good, v / np.where(good, length, 1.0), fallback)


def from_euler_yxz(y: ArrayLike, x: ArrayLike, z: ArrayLike) -> Array:
    """R = Ry Rx Rz, angles in radians, as quaternions (..., 4)."""
    return multiply(_about(1, y), multiply(_about(0, x), _about(2, z)))


def to_euler_yxz(q: ArrayLike) -> tuple[Array, Array, Array]:
    """Angles (y, x, z) in radians with R = Ry Rx Rz; at x = +-90 degrees z is 0."""
    x, y, z, w = np.moveaxis(normalised(q), -1, 0)
    # The five entries of the matrix that are needed, not all nine: long exports spend their time here.
    sin_x = np.clip(2 * (w * x - y * z), -1.0, 1.0)
    turn_y = np.arctan2(2 * (x * z + w * y), 1 - 2 * (x * x + y * y))
    turn_z = np.arctan2(2 * (x * y + w * z), 1 - 2 * (x * x + z * z))
    locked = np.abs(sin_x) > 1 - 1e-9
    if locked.any():
        held = np.arctan2(-2 * (x * z - w * y), 1 - 2 * (y * y + z * z))
        turn_y, turn_z = np.where(locked, held, turn_y), np.where(locked, 0.0, turn_z)
    return turn_y, np.arcsin(sin_x), turn_z


def _about(axis: int, angle: ArrayLike) -> Array:
    half = np.asarray(angle, dtype=np.float64) / 2
    q = np.zeros((*half.shape, 4))
    q[..., axis], q[..., 3] = np.sin(half), np.cos(half)
    return q


def from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Quaternions (..., 4) that turn by angle (radians) about unit axes (..., 3)."""
    half = np.asarray(angle, dtype=np.float64)[..., None] / 2
    xyz = np.asarray(axis, dtype=np.float64) * np.sin(half)
    return np.concatenate([xyz, np.broadcast_to(np.cos(half), (*xyz.shape[:-1], 1))], axis=-1)


def angle_between(a: ArrayLike, b: ArrayLike) -> Array:
    """Geodesic distance in radians, 0 to pi, between unit quaternions (..., 4)."""
    relative = multiply(inverse(a), b)
    return 2.0 * np.arctan2(np.linalg.norm(relative[..., :3], axis=-1), np.abs(relative[..., 3]))


def slerp(a: ArrayLike, b: ArrayLike, amount: ArrayLike) -> Array:
    """The rotation a fraction of the shorter way from a to b.

    Args:
        a, b: unit quaternions (..., 4).
        amount: 0 gives a, 1 gives b; broadcast against the leading shape.
    """
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    amount = np.asarray(amount, dtype=np.float64)[..., None]
    dot = (a * b).sum(axis=-1, keepdims=True)
    b, dot = np.where(dot < 0, -b, b), np.abs(dot)
    theta = np.arccos(np.minimum(dot, 1.0))
    # sin(theta) vanishes; the straight line is exact enough here.
    near = theta < 1e-4
    sine = np.where(near, 1.0, np.sin(theta))
    wa = np.where(near, 1 - amount, np.sin((1 - amount) * theta) / sine)
    wb = np.where(near, amount, np.sin(amount * theta) / sine)
    return normalised(wa * a + wb * b)


def sign_continuous(q: ArrayLike) -> Array:
    """Rotations (T, ..., 4) unchanged but with signs chosen so that neighbours in time never flip."""
    q = np.asarray(q, dtype=np.float64)
    if len(q) < 2:
        return q.copy()
    flips = np.where((q[1:] * q[:-1]).sum(axis=-1) < 0, -1.0, 1.0)
    signs = np.concatenate([np.ones((1, *flips.shape[1:])), np.cumprod(flips, axis=0)])
    return q * signs[..., None]
