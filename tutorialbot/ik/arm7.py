"""The seven-axis arm of paper 2: geometry, limits, and eqs (1)-(4), forward kinematics by quaternions.

Frame of the abdomen: x forward, y left, z up. At q = 0 the left arm hangs, its thumb forward. The paper gives no
lengths and no limits: these are reconstructed so that the errors of its section 4.2 come out, and many other arms
would do as well.

Twice the same mathematics: one configuration at a time, as the equations are written (`forward_kinematics_scalar`),
and thousands at once (`forward_kinematics`); in the batched half components come first.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, float_array, one_of
from tutorialbot.ik.quaternions import conjugate, product, quaternion, rotate
from tutorialbot.ik.tilts import READINGS

LIMITS = (  # what stops each joint at its lower and at its upper limit
    ("shoulder flexion", "shoulder extension"),
    ("shoulder adduction", "shoulder abduction"),
    ("inward rotation", "outward rotation"),
    ("elbow flexion", "elbow extension"),
    ("pronation", "supination"),
    ("wrist flexion", "wrist extension"),
    ("radial deviation", "ulnar deviation"),
)
SHOULDER, UPPER_ARM, FOREARM, HAND = (0.0, 0.16, 0.38), (0.0, 0.0, -0.31), (0.0, 0.0, -0.23), (0.03, 0.0, -0.08)
X, Y, Z, NONE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
LOWER_DEG, UPPER_DEG = (-180, -20, -90, -145, -90, -60, -15), (60, 120, 90, 0, 90, 60, 30)


@dataclass(frozen=True, eq=False)
class Arm:
    """Seven rotary joints in a row.

    offsets (8, 3) [m]: from the abdomen to joint 1, from each joint to the next, from joint 7 to the root of the thumb,
    each in the frame that turns with the joint before it; axes (7, 3): unit vectors in the same frames; lower, upper
    (7,) [rad]. Raises InvalidType or InvalidValue for other shapes, NaN, axes that are no unit vectors, and limits with
    lower > upper.
    """

    offsets: np.ndarray = (SHOULDER, NONE, NONE, UPPER_ARM, FOREARM, NONE, NONE, HAND)
    axes: np.ndarray = (Y, X, Z, Y, Z, X, Y)
    lower: np.ndarray = tuple(np.deg2rad(LOWER_DEG))
    upper: np.ndarray = tuple(np.deg2rad(UPPER_DEG))
    turns: np.ndarray = field(init=False, repr=False)  # (7, 4, 4): turns[i] @ Q is the product of Q and axis i
    forms: dict = field(init=False, repr=False)  # {i: (3, 4, 4)}: Q L_i Q* = Q^T forms[i] Q, for every L_i not zero

    def __post_init__(self):
        for name, shape in (("offsets", (8, 3)), ("axes", (7, 3)), ("lower", (7,)), ("upper", (7,))):
            array = finite_array(name, getattr(self, name), shape).copy()
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if np.abs(np.linalg.norm(self.axes, axis=1) - 1.0).max() > 1e-9:
            raise InvalidValue("axes", self.axes.tolist(), "unit vectors")
        if (self.lower > self.upper).any():
            joint = int(np.argmax(self.lower > self.upper))
            limits = (float(self.lower[joint]), float(self.upper[joint]))
            raise InvalidValue("lower", limits, f"lower <= upper at joint {joint + 1}, {' / '.join(LIMITS[joint])}")
        units = np.eye(4).tolist()
        object.__setattr__(self, "turns", np.array([[product(e, (0.0, *v)) for e in units] for v in self.axes.tolist()])
                           .swapaxes(1, 2))  # fmt: skip
        object.__setattr__(self, "forms", {
            i: np.array([[product(product(e, (0.0, *v)), conjugate(f))[1:] for f in units] for e in units])
            .transpose(2, 0, 1) for i, v in enumerate(self.offsets[1:].tolist()) if any(v)
        })  # fmt: skip

    def with_limit(self, name: str, angle: float) -> "Arm":
        """Return the same arm with one limit moved; `name` is one of LIMITS, `angle` [rad] the joint's angle there.

        The signs are those of the joint: radial deviation, 15 degrees by default, is joint 7 at -15 degrees.
        """
        one_of("name", name, [name for pair in LIMITS for name in pair])
        joint = next(i for i, pair in enumerate(LIMITS) if name in pair)
        which = ("lower", "upper")[LIMITS[joint].index(name)]
        limits = getattr(self, which).copy()
        limits[joint] = finite_number("angle", angle)
        return replace(self, **{which: limits})

    def within(self, q: np.ndarray) -> np.ndarray:
        """Whether all joints of q (..., 7) are inside the limits (...). Raises InvalidType or InvalidValue as below."""
        return self.holds(components_first(configurations("q", q)))

    def holds(self, joints: np.ndarray) -> np.ndarray:
        """The same for joints (7, ...)."""
        low, high = (limit.reshape(7, *(1,) * (joints.ndim - 1)) for limit in (self.lower, self.upper))
        return ((joints >= low) & (joints <= high)).all(axis=0)


# -- one configuration at a time, as the paper writes it ----------------------------------------------------------


def forward_kinematics_scalar(q: Sequence[float], *, arm: "Arm | None" = None) -> tuple[list[float], list[float]]:
    """Return position (3,) [m] and (roll, pitch, yaw) [rad] of the thumb's root, one configuration q (7,) [rad].

    Paper 2, eqs (1)-(4), word for word. It checks nothing.
    """
    arm = ARM if arm is None else arm
    turned, (tip, *links) = (1.0, 0.0, 0.0, 0.0), arm.offsets.tolist()
    for angle, axis, link in zip(q, arm.axes.tolist(), links, strict=True):
        turned = product(turned, quaternion(angle, axis))  # Q_i = q_0 q_1 ... q_i, eqs (1) and (2)
        tip = [x + dx for x, dx in zip(tip, rotate(turned, link), strict=True)]  # eq. (3)
    (_, yx, _), (_, yy, _), (zx, zy, zz) = (rotate(turned, unit) for unit in (X, Y, Z))  # eq. (4)
    return tip, [-math.asin(max(-1.0, min(1.0, zy))), math.atan2(zx, zz), math.atan2(yx, yy)]


# -- many at once -------------------------------------------------------------------------------------------------


def forward_kinematics(
    q: np.ndarray, *, arm: "Arm | None" = None, reading: str = "pitch-first"
) -> tuple[np.ndarray, np.ndarray]:
    """Return position (..., 3) [m] and tilt (..., 3) [rad] of the thumb's root in the abdomen's frame, for q (..., 7).

    The tilt is (roll, pitch, yaw) with R = Ry(pitch) Rx(roll) Rz(yaw); other `reading`s of the paper's "inclination"
    stand in `tutorialbot.ik.tilts.READINGS`, some with another number of components. Paper 2, eqs (1)-(4). Raises
    InvalidType or InvalidValue for a q of another shape or with NaN, a reading that does not exist, what is no Arm.
    """
    arm = ARM if arm is None else as_arm(arm)
    reading = READINGS[one_of("reading", reading, READINGS)]
    q = configurations("q", q)
    tip, turned = reach(components_first(q), arm)
    return np.moveaxis(tip, 0, -1), np.moveaxis(reading.tilt(turned), 0, -1)


def reach(joints: np.ndarray, arm: Arm) -> tuple[np.ndarray, np.ndarray]:
    """Return position (3, ...) and quaternion (4, ...) of the tip for joints (7, ...) [rad]; nothing is checked.

    As a quaternion q_i is cos + sin v_i with half the angle, so Q_{i-1} q_i = cos Q_{i-1} + sin (Q_{i-1} v_i), and each
    coordinate of Q L Q* is a quadratic form in Q. Both cos and sin come from the tangent t of a quarter of the angle:
    numpy has it faster, and cos = (1 - t^2) / (1 + t^2), sin = 2 t / (1 + t^2).
    """
    t = np.tan(0.25 * joints.reshape(7, -1))
    sin = 2.0 / (1.0 + t * t)
    cos = sin - 1.0
    sin *= t
    turned = np.zeros((4, t.shape[1]))
    turned[0] = 1.0
    tip = np.repeat(arm.offsets[0][:, None], t.shape[1], axis=1)
    for i in range(7):
        turned = cos[i] * turned + sin[i] * (arm.turns[i] @ turned)  # eqs (1) and (2)
        if i in arm.forms:
            tip += (arm.forms[i] @ turned * turned).sum(axis=1)  # eq. (3)
    return tip.reshape(3, *joints.shape[1:]), turned.reshape(4, *joints.shape[1:])


def components_first(array: np.ndarray) -> np.ndarray:
    """Return (..., k) as (k, ...), each component in one piece of memory: numpy is fastest on that."""
    return np.ascontiguousarray(np.moveaxis(array, -1, 0))


def configurations(name: str, q: np.ndarray) -> np.ndarray:
    """Return q as a finite float array (..., 7), or raise InvalidType or InvalidValue."""
    q = float_array(name, q)
    return finite_array(name, q, (*(-1,) * (q.ndim - 1), 7))


def as_arm(arm: Arm) -> Arm:
    """Return `arm`, or raise InvalidType."""
    if not isinstance(arm, Arm):
        raise InvalidType("arm", arm, "an Arm")
    return arm


ARM = Arm()
"""The reconstructed left arm."""
