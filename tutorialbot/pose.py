"""Poses are `pinocchio.SE3`: their interpolation, their distance, and the order of their quaternions.

This is the only place that knows that MuJoCo writes a quaternion (w, x, y, z) and pinocchio (x, y, z, w).
"""

import math
from typing import Any

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, one_of, positive

ORDERS = ("wxyz", "xyzw")
ANGLES = ("atan", "ratio")
ROTATION_TOLERANCE = 1e-6  # how far the 3x3 part of a pose may be from a rotation


def check_pose(argument: str, value: Any) -> pin.SE3:
    """Return `value` when it is a `pinocchio.SE3` with finite entries and a rotation, else raise InvalidType or
    InvalidValue.
    """
    if not isinstance(value, pin.SE3):
        raise InvalidType(argument, value, "a pinocchio.SE3")
    (a, b, c, x), (d, e, f, y), (g, h, i, z), _ = value.homogeneous.tolist()  # plain floats: this runs in tight loops
    off = abs(a * a + b * b + c * c - 1.0) + abs(d * d + e * e + f * f - 1.0) + abs(a * d + b * e + c * f)
    off += abs(b * f - c * e - g) + abs(c * d - a * f - h) + abs(a * e - b * d - i)  # the third row is their product
    if not all(map(math.isfinite, (x, y, z, off))):
        raise InvalidValue(argument, value, "a pose with finite entries")
    if off > ROTATION_TOLERANCE:
        raise InvalidValue(argument, value, "a pose with a rotation: orthogonal, determinant +1")
    return value


def to_quaternion(pose: pin.SE3, order: str = "wxyz") -> tuple[np.ndarray, np.ndarray]:
    """Return position (3,) [m] and unit quaternion (4,) of `pose`, with w >= 0.

    `order` is "wxyz" (MuJoCo) or "xyzw" (pinocchio, SciPy). Inverse of `from_quaternion`.
    """
    one_of("order", order, ORDERS)
    xyzw = pin.Quaternion(check_pose("pose", pose).rotation).coeffs()
    xyzw = -xyzw if xyzw[3] < 0 else xyzw
    return pose.translation.copy(), (np.roll(xyzw, 1) if order == "wxyz" else xyzw)


def from_quaternion(position: np.ndarray, quaternion: np.ndarray, order: str = "wxyz") -> pin.SE3:
    """Return the pose at `position` (3,) [m], turned by `quaternion` (4,), which is normalised first.

    `order` is "wxyz" (MuJoCo) or "xyzw" (pinocchio, SciPy). Raises InvalidValue for a quaternion of length zero.
    """
    one_of("order", order, ORDERS)
    q = finite_array("quaternion", quaternion, (4,))
    length = np.linalg.norm(q)
    if length < 1e-9:
        raise InvalidValue("quaternion", quaternion, "a length above zero")
    w, x, y, z = (q if order == "wxyz" else np.roll(q, 1)) / length
    return pin.SE3(pin.Quaternion(w, x, y, z), finite_array("position", position, (3,)))


def interpolate(a: pin.SE3, b: pin.SE3, s: float) -> pin.SE3:
    """Return the pose at the share `s` in [0, 1] of the way from `a` to `b` (paper 1, section 4).

    The position runs on the straight line, p = (1 - s) p_a + s p_b, and the rotation by SLERP at constant angular
    speed, R = R_a exp(s log(R_a^T R_b)), the shorter way round. (`pinocchio.SE3.Interpolate` is another thing: it
    follows a screw, so the position leaves the straight line.)
    """
    check_pose("a", a), check_pose("b", b)
    s = finite_number("s", s, 0.0, 1.0)
    turn = pin.Quaternion(a.rotation).slerp(s, pin.Quaternion(b.rotation))
    return pin.SE3(turn.normalized(), (1.0 - s) * a.translation + s * b.translation)


def twist_between(a: pin.SE3, b: pin.SE3) -> np.ndarray:
    """Return the twist (6,) that takes `a` to `b` in a unit of time, linear first, in the world's axes.

    The position goes straight, as in `interpolate`. Nothing is checked: this runs in tight loops.
    """
    return np.concatenate([b.translation - a.translation, pin.log3(b.rotation @ a.rotation.T)])


def turned(rotation: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Return a twist (6,) of the same point in other axes, both halves turned by `rotation` (3, 3); nothing checked."""
    return np.concatenate([rotation @ twist[:3], rotation @ twist[3:]])


def double_quaternion(pose: pin.SE3, radius: float = 0.1, angle: str = "atan") -> np.ndarray:
    """Return the 8-vector (G, H) of the 4-D rotation that stands for `pose`: two unit quaternions (w, x, y, z).

    Space is bent onto a hypersphere of `radius` R [m] in four dimensions. A rotation of space, the unit quaternion q,
    stays a rotation, and a translation d becomes a rotation by an angle psi in the plane of d and the fourth axis:

        D = cos(psi/2) + sin(psi/2) d/|d|,    G = D q,    H = conj(D) q,    x -> G x conj(H) for x in R^4

    with psi = atan(|d| / R) for angle="atan", |d| / R for "ratio". (G, H) and (-G, -H) are the same 4-D rotation.
    """
    one_of("angle", angle, ANGLES)
    length = float(np.linalg.norm(check_pose("pose", pose).translation))
    ratio = length / positive("radius", radius)
    half = 0.5 * (math.atan(ratio) if angle == "atan" else ratio)
    axis = pose.translation / length if length > 0.0 else np.zeros(3)
    q = pin.Quaternion(pose.rotation)
    forth = pin.Quaternion(math.cos(half), *(math.sin(half) * axis))
    return np.concatenate([np.roll((forth * q).coeffs(), 1), np.roll((forth.conjugate() * q).coeffs(), 1)])


def so4_distance(a: pin.SE3, b: pin.SE3, radius: float = 0.1, angle: str = "atan") -> float:
    """Return the distance of two poses as 4-D rotations, with `a` as the frame of reference; 0 to 2, no unit.

    After Etzel and McCarthy (1996), as paper 1, section 4 uses it for its penalty. With (G, H) the 8-vector of the
    displacement inverse(a) b (see `double_quaternion`) and (1, 1) that of standing still,

        distance = min over both signs of | (G, H) -+ (1, 1) |

    so that with the turn theta and the angle psi of the translation distance = 2 sqrt(1 - |cos(theta/2) cos(psi/2)|).
    It is symmetric and does not depend on the world's origin. With angle="atan" it is zero for equal poses alone, and
    grows with |d| and with theta up to pi. angle="ratio" winds round the hypersphere: it falls again beyond
    |d| = pi R and is zero at |d| = 2 pi R.
    """
    displacement = check_pose("a", a).actInv(check_pose("b", b))
    return _apart(double_quaternion(displacement, radius, angle), double_quaternion(pin.SE3.Identity()))


def so4_distance_seen_from(
    reference: pin.SE3, a: pin.SE3, b: pin.SE3, radius: float = 0.1, angle: str = "atan"
) -> float:
    """Return the literal metric: `a` and `b`, each as a 4-D rotation seen from `reference`, and the difference of both.

    The distance of the 8-vectors of inverse(reference) a and inverse(reference) b, over both signs. It does not change
    when a rotation alone moves the reference, but it does when a translation does: translations of space do not
    commute, and rotations in the planes that hold the fourth axis imitate them only near the reference. `so4_distance`
    is the case reference = a.
    """
    check_pose("reference", reference)
    seen = [reference.actInv(check_pose(name, pose)) for name, pose in (("a", a), ("b", b))]
    return _apart(*(double_quaternion(pose, radius, angle) for pose in seen))


def _apart(u: np.ndarray, v: np.ndarray) -> float:
    """Euclidean distance of two 8-vectors, the nearer of both signs of the double cover."""
    return float(min(np.linalg.norm(u - v), np.linalg.norm(u + v)))
