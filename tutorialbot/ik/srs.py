"""Closed-form inverse kinematics of a spherical arm (Z Y Z - Y - Z Y Z), many poses at once.

Shoulder and wrist are points, so the pose of the tip gives the wrist, the distance shoulder to wrist the elbow's angle
q4 by the law of cosines, and one number remains: the swivel, the angle of the elbow about the line from shoulder to
wrist. Rotations R_W of the frame W (z from shoulder to wrist, y along the elbow's axis) and of the tip then give two
sets of Z-Y-Z angles,

    Rz(q1) Ry(q2) Rz(q3) = R_W Ry(-alpha),    Rz(q5) Ry(q6) Rz(q7) = (R_W Ry(beta))^T R_tip,    alpha + beta = q4,

each with two solutions. The swivel is measured from the vertical: 0 has the elbow's axis level and, with q4 > 0, the
elbow above the line, pi below it; it is undefined where the line is vertical (Shimizu et al., T-RO 2008, use the same
angle). Elbows with q4 < 0 are those of swivel + pi with q4 > 0, so q4 >= 0 here.
"""

import numpy as np

from tutorialbot.errors import InvalidValue, finite_array, finite_number, float_array
from tutorialbot.ik.singularity_consistent import SphericalArm, check_arm

BRANCHES = ((1, 1), (1, -1), (-1, 1), (-1, -1))  # signs of sin q2 and of sin q6
LEVEL = 1e-9  # a line from shoulder to wrist with less than this in the plane is vertical


def inverse(
    arm: SphericalArm, rotation: np.ndarray, position: np.ndarray, swivel: np.ndarray, branch: tuple[int, int] = (1, 1)
) -> tuple[np.ndarray, np.ndarray]:
    """Return q (..., 7) [rad] that bring the tip to a pose, and which of them reach it (...).

    rotation (..., 3, 3) and position (..., 3) [m] of the tip in the anchor's frame, swivel (...) [rad], broadcast
    against each other; branch: one of BRANCHES. Out of reach q4 is 0 or pi and False stands for it. Joint limits are
    not looked at (see `within`). q1, q3, q5, q7 come in (-pi, pi].
    """
    check_arm(arm)
    if not isinstance(branch, tuple) or branch not in BRANCHES:
        raise InvalidValue("branch", branch, f"one of {BRANCHES}")
    rotation, position, swivel = _poses(rotation, position, swivel)
    line = position - arm.tip_offset * rotation[..., :, 2]
    line = line - np.array([0.0, 0.0, arm.base_offset])
    r = np.sqrt((line * line).sum(-1))
    flat = np.hypot(line[..., 0], line[..., 1])
    cosine = arm.elbow_cosine(r)
    reached = (np.abs(cosine) <= 1.0) & (flat > LEVEL)
    q4 = np.arccos(cosine.clip(-1.0, 1.0))
    alpha = np.arctan2(arm.lower * np.sin(q4), arm.upper + arm.lower * np.cos(q4))
    frame = _line_frame(line, r, flat, swivel)
    upper = frame @ _ry(-alpha)
    hand = np.swapaxes(frame @ _ry(q4 - alpha), -1, -2) @ rotation
    q1, q2, q3 = _zyz(upper, branch[0])
    q5, q6, q7 = _zyz(hand, branch[1])
    q = np.stack(np.broadcast_arrays(q1, q2, q3, q4, q5, q6, q7), axis=-1)
    return q, np.broadcast_to(reached, q.shape[:-1])


def within(arm: SphericalArm, q: np.ndarray, margin: float = 0.0) -> np.ndarray:
    """Whether all joints of q (..., 7) [rad] keep `margin` [rad] to their limits (...).

    Raises InvalidType or InvalidValue for another shape or what is no finite number.
    """
    limits = np.asarray(check_arm(arm).limits) - finite_number("margin", margin)
    return (np.abs(_angles(q)) <= limits).all(axis=-1)


def swivel(arm: SphericalArm, q: np.ndarray) -> np.ndarray:
    """Return the swivel (...) [rad] in (-pi, pi] of q (..., 7) [rad], as `inverse` measures it for q4 >= 0.

    Raises InvalidType or InvalidValue for another shape or what is no finite number.
    """
    check_arm(arm)
    q1, q2, q3, q4, *_ = np.moveaxis(_angles(q), -1, 0)
    y, x, r = np.sin(q2) * np.sin(q3), arm.lower * np.sin(q4) * np.cos(q2), arm.upper + arm.lower * np.cos(q4)
    x = (x + r * np.sin(q2) * np.cos(q3)) / np.hypot(arm.lower * np.sin(q4), r)
    side = np.where(q4 < 0.0, -1.0, 1.0)
    return np.arctan2(side * y, side * x)


def chain(arm: SphericalArm, q: np.ndarray) -> np.ndarray:
    """Return the points anchor, shoulder, elbow, wrist, tip (..., 5, 3) [m] in the anchor's frame for q (..., 7).

    Raises InvalidType or InvalidValue for another shape or what is no finite number.
    """
    check_arm(arm)
    q = _angles(q)
    upper = _rz(q[..., 0]) @ _ry(q[..., 1]) @ _rz(q[..., 2])
    fore = upper @ _ry(q[..., 3])
    hand = fore @ _rz(q[..., 4]) @ _ry(q[..., 5])
    points = np.zeros((*q.shape[:-1], 5, 3))
    points[..., 1:, 2] = arm.base_offset
    points[..., 2:, :] += (arm.upper * upper[..., :, 2])[..., None, :]
    points[..., 3:, :] += (arm.lower * fore[..., :, 2])[..., None, :]
    points[..., 4, :] += arm.tip_offset * hand[..., :, 2]
    return points


def _angles(q: np.ndarray) -> np.ndarray:
    """Return q (..., 7) as floats, or raise."""
    q = float_array("q", q)
    return finite_array("q", q, (*(-1,) * (q.ndim - 1), 7))


def _poses(rotation, position, swivel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rotation, position, swivel = (
        float_array(name, value) for name, value in (("rotation", rotation), ("position", position), ("swivel", swivel))
    )
    if rotation.shape[-2:] != (3, 3):
        raise InvalidValue("rotation", f"array of shape {rotation.shape}", "shape (..., 3, 3)")
    if position.shape[-1:] != (3,):
        raise InvalidValue("position", f"array of shape {position.shape}", "shape (..., 3)")
    for name, value in (("rotation", rotation), ("position", position), ("swivel", swivel)):
        if not np.isfinite(value).all():
            raise InvalidValue(name, value, "finite numbers (no NaN, no infinity)")
    off = np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max(initial=0.0)
    if off > 1e-6 or (np.linalg.det(rotation) < 0.0).any():
        raise InvalidValue("rotation", f"array of shape {rotation.shape}", "rotations: orthonormal, right-handed")
    return rotation, position, swivel


def _line_frame(line: np.ndarray, r: np.ndarray, flat: np.ndarray, swivel: np.ndarray) -> np.ndarray:
    """Return R_W (..., 3, 3): z along `line`, turned by `swivel` from where y is level and x points down."""
    z = line / r.clip(LEVEL)[..., None]
    y = np.stack([-line[..., 1], line[..., 0], np.zeros_like(flat)], axis=-1) / flat.clip(LEVEL)[..., None]
    return np.stack([np.cross(y, z), y, z], axis=-1) @ _rz(swivel)


def _zyz(rotation: np.ndarray, sign: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angles a, b, c with Rz(a) Ry(b) Rz(c) = rotation and sin b of the given sign."""
    b = sign * np.arctan2(np.hypot(rotation[..., 0, 2], rotation[..., 1, 2]), rotation[..., 2, 2])
    a = np.arctan2(sign * rotation[..., 1, 2], sign * rotation[..., 0, 2])
    return a, b, np.arctan2(sign * rotation[..., 2, 1], -sign * rotation[..., 2, 0])


def _rz(angle: np.ndarray) -> np.ndarray:
    c, s, o = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    return np.stack([c, -s, o, s, c, o, o, o, o + 1.0], axis=-1).reshape(*np.shape(angle), 3, 3)


def _ry(angle: np.ndarray) -> np.ndarray:
    c, s, o = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    return np.stack([c, o, s, o, o + 1.0, o, -s, o, c], axis=-1).reshape(*np.shape(angle), 3, 3)
