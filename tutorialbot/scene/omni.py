"""Kinematics of a base on omni wheels: the twist of the base, and the rate of each wheel.

An omni wheel carries free rollers around its rim. On the floor it grips along its rolling direction and glides along
its axle. In the frame of the base (x forward, y left), with the wheel's centre at (x, y), the rolling direction at the
angle a, h = (cos a, sin a), and (vx, vy, w) the base's twist in its own frame, the centre moves with

    u = (vx - w y, vy + w x)

and the wheel of radius r turns at the rate theta' about the axle (-sin a, cos a), so that

    r theta' = u . h = cos(a) vx + sin(a) vy + (x sin(a) - y cos(a)) w

The rest of u, along the axle, is what the rollers turn with: no equation binds it, which is why the base can go
anywhere. n wheels give theta' = J twist with an (n, 3) matrix J that does not change with time. Backwards, three
wheels fix the twist when J has rank 3; four give one equation more than there are unknowns: least squares, and the
residual r theta' - u . h is the speed at which rates that do not belong together would drag the wheels over the floor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, positive


@dataclass(frozen=True)
class OmniWheel:
    """One wheel: centre (x, y) [m] in the base's frame, `angle` [rad] of its rolling direction, `radius` [m]."""

    x: float
    y: float
    angle: float
    radius: float

    def __post_init__(self):
        finite_number("x", self.x), finite_number("y", self.y), finite_number("angle", self.angle)
        positive("radius", self.radius)


def jacobian(wheels: Sequence[OmniWheel]) -> np.ndarray:
    """Return J (n, 3) [1/m, 1/m, 1]: wheel rates = J @ twist. Raises InvalidType for what is no row of wheels."""
    if not isinstance(wheels, Sequence) or not wheels or not all(isinstance(wheel, OmniWheel) for wheel in wheels):
        raise InvalidType("wheels", wheels, "one OmniWheel or more, in a tuple or list")
    x, y, angle, radius = np.array([(wheel.x, wheel.y, wheel.angle, wheel.radius) for wheel in wheels]).T
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine, sine, x * sine - y * cosine], axis=1) / radius[:, None]


def to_wheels(wheels: Sequence[OmniWheel], twist: np.ndarray) -> np.ndarray:
    """Return the rates [rad/s] that roll every wheel without slip under the base's `twist`.

    twist: (3,) or (m, 3), vx, vy [m/s] and w [rad/s] in the base's frame. Returns (n,) or (m, n).
    """
    twist = finite_array("twist", twist, (-1, 3) if np.ndim(twist) == 2 else (3,))
    return twist @ jacobian(wheels).T


def to_twist(wheels: Sequence[OmniWheel], rates: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the twist (3,) [m/s, m/s, rad/s] in the base's frame that fits the rates (n,) best, and the slip [m/s].

    The slip is the length of the residual of the n rolling equations r theta' = u . h: zero when the rates belong
    together. Raises InvalidValue when the wheels cannot tell the twist (fewer than three, or all parallel).
    """
    unit = jacobian(wheels)
    rates = finite_array("rates", rates, (len(wheels),))
    radius = np.array([wheel.radius for wheel in wheels])
    equations = unit * radius[:, None]
    if np.linalg.matrix_rank(equations) < 3:
        raise InvalidValue("wheels", wheels, "three or more whose directions fix the base's motion")
    twist = np.linalg.lstsq(equations, radius * rates, rcond=None)[0]
    return twist, float(np.linalg.norm(equations @ twist - radius * rates))


def limit(wheels: Sequence[OmniWheel], twist: np.ndarray, max_rate: float) -> np.ndarray:
    """Return `twist` (3,), scaled down just so far that no wheel turns faster than `max_rate` [rad/s].

    The rates are linear in the twist, so one factor in [0, 1] serves all, and the direction of motion stays.
    """
    fastest = np.abs(to_wheels(wheels, twist)).max()
    return np.asarray(twist, dtype=float) / max(1.0, fastest / positive("max_rate", max_rate))
