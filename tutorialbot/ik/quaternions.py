"""Turns as unit quaternions (w, x, y, z): paper 2, eq. (1), and what eqs (2)-(4) do with them, in plain Python.

`product`, `conjugate` and `rotate` take components that are arrays too.
"""

import math
from collections.abc import Sequence

Quaternion = Sequence[float]


def quaternion(angle: float, axis: Sequence[float]) -> Quaternion:
    """Return the rotation by `angle` [rad] about the unit vector `axis` (3,). Paper 2, eq. (1)."""
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    return c, s * axis[0], s * axis[1], s * axis[2]


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return Hamilton's product a b: the turn b, in axes that a has turned already."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def conjugate(a: Quaternion) -> Quaternion:
    """Return the inverse of a unit quaternion."""
    return a[0], -a[1], -a[2], -a[3]


def rotate(a: Quaternion, v: Sequence[float]) -> Sequence[float]:
    """Return the vector v (3,), turned: a v a*."""
    return product(product(a, (0.0, *v)), conjugate(a))[1:]
