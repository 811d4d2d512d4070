"""Paper 4, eqs (4) and (5): base and arm share one motion of the tip; and the base inside the inverse kinematics.

The base moves on the floor, (x, y, yaw) in the world F0; the arm's anchor stands upright on its axis, `ANCHOR_HEIGHT`
above the floor, and turns with it. Twists are the tip's, in the axes of the world, linear first. The velocity nu_mb
that the base gives to the tip is one *at the tip*: with omega about the vertical, the base's centre B moves by

    nu_mb - omega z x (p_tip - B)

Three ways to go through a stretched arm:
- `share`: eqs (4), (5), and one time scale b for base and arm, so that the tip keeps to its path, later;
- `hold`: the same with the tip at rest and the base given, as the robot does while it holds the door;
- `share_in_time`: the paper's open problem. No time scale: what the elbow cannot do in time, the base does.
"""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidType, finite_array, finite_number
from tutorialbot.ik.singularity_consistent import SphericalArm, check_arm, time_scale
from tutorialbot.ik.spherical_rates import hand, joint_rates, triangle, wrist_axes, wrist_twist
from tutorialbot.pose import turned
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT

LEVEL = 0.2  # the base takes over while the horizontal part of the stretched arm's direction is longer than this


@dataclass(frozen=True)
class Shares:
    """The base's shares K of eq (4), each in [0, 1]: of the tip's velocity along x and y, and of its turn about z."""

    x: float = 0.9
    y: float = 0.9
    yaw: float = 0.5

    def __post_init__(self):
        for name in ("x", "y", "yaw"):
            object.__setattr__(self, name, finite_number(name, getattr(self, name), 0.0, 1.0))

    @property
    def matrix(self) -> np.ndarray:
        """K = diag(k_px, k_py, 0, 0, 0, k_rz), (6, 6)."""
        return np.diag([self.x, self.y, 0.0, 0.0, 0.0, self.yaw])


@dataclass(frozen=True)
class SharedVelocity:
    """What base and arm do; the tip moves by scale * twist (by the twist itself after `share_in_time`).

    base (3,): x, y [m/s] and yaw [rad/s] of the base's centre in the world; qdot (7,) [rad/s]; scale: b of eq (2), one
    for both; nu_mb, nu_a (6,): the shares of the twist before b, in the world's axes.
    """

    base: np.ndarray
    qdot: np.ndarray
    scale: float
    nu_mb: np.ndarray
    nu_a: np.ndarray


def anchor(base: np.ndarray, mount: float = ANCHOR_HEIGHT) -> pin.SE3:
    """Return the pose of the arm's anchor in the world for the base at (x, y, yaw) [m, m, rad]."""
    x, y, yaw = finite_array("base", base, (3,)).tolist()
    return pin.SE3(pin.utils.rotate("z", yaw), np.array([x, y, mount]))


def tip_in_world(arm: SphericalArm, base: np.ndarray, q: np.ndarray, mount: float = ANCHOR_HEIGHT) -> pin.SE3:
    """Return the tip's pose in the world."""
    check_arm(arm)
    return anchor(base, mount) * arm.forward(q)


def base_centre_velocity(nu_mb: np.ndarray, tip: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Return the rates (3,) of the base's centre that give the tip, at (3,) [m], the twist nu_mb (6,)."""
    omega = nu_mb[5]
    return np.array([nu_mb[0] + omega * (tip[1] - base[1]), nu_mb[1] - omega * (tip[0] - base[0]), omega])


def tip_velocity_by_base(base_rates: np.ndarray, tip: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Return the twist (6,) that the tip, at (3,) [m], gets from the base's rates (3,): nu_mb."""
    vx, vy, omega = base_rates
    return np.array([vx - omega * (tip[1] - base[1]), vy + omega * (tip[0] - base[0]), 0.0, 0.0, 0.0, omega])


def share(
    arm: SphericalArm, base: np.ndarray, q: np.ndarray, twist: np.ndarray, shares: Shares | None = None, n: int = 2,
    swivel_rate: float = 0.0,
) -> SharedVelocity:  # fmt: skip
    """Return the rates of base and arm for the tip's `twist` nu_ref (6,): eqs (4), (5), then (1)-(3), one b for all.

    base (3,): x, y, yaw in the world; q (7,) [rad]; shares: K; n, swivel_rate as in `SphericalArm.joint_velocity`,
    which also names what it raises. The tip moves by b * twist.
    """
    shares = _checked(arm, Shares() if shares is None else shares)
    base, nu_ref = finite_array("base", base, (3,)), finite_array("twist", twist, (6,))
    nu_mb = shares.matrix @ nu_ref  # (4)
    return _together(arm, base, q, nu_ref, nu_mb, n, swivel_rate)


def hold(
    arm: SphericalArm, base: np.ndarray, q: np.ndarray, base_rates: np.ndarray, n: int = 2, swivel_rate: float = 0.0
) -> SharedVelocity:
    """Return the rates of base and arm that move the base and leave the tip where it is: nu_ref = 0 in eq (5).

    base_rates (3,): x, y [m/s] and yaw [rad/s] wanted of the base's centre; it gets b times that.
    """
    _checked(arm, Shares())
    base, rates = finite_array("base", base, (3,)), finite_array("base_rates", base_rates, (3,))
    nu_mb = tip_velocity_by_base(rates, tip_in_world(arm, base, q).translation, base)
    return _together(arm, base, q, np.zeros(6), nu_mb, n, swivel_rate)


def _together(arm, base, q, nu_ref, nu_mb, n, swivel_rate) -> SharedVelocity:
    to_arm = anchor(base).rotation.T  # from the world's axes to the anchor's; `joint_velocity` goes on to those of W
    nu_a = nu_ref - nu_mb  # (5)
    moved = arm.joint_velocity(q, turned(to_arm, nu_a), n, swivel_rate)  # (1)-(3)
    centre = base_centre_velocity(nu_mb, tip_in_world(arm, base, q).translation, base)
    return SharedVelocity(moved.scale * centre, moved.qdot, moved.scale, nu_mb, nu_a)


def share_in_time(
    arm: SphericalArm, base: np.ndarray, q: np.ndarray, twist: np.ndarray, shares: Shares | None = None, n: int = 2,
    swivel_rate: float = 0.0,
) -> SharedVelocity:  # fmt: skip
    """Return the rates of base and arm for `twist` in real time, also where the arm is stretched out.

    Along z, from shoulder to wrist, the arm takes only beta p_z of the wrist's velocity p_z, and the base (1 - beta)
    p_z / |z_h|^2 along z's horizontal part z_h: the same along z, and what it adds across z the arm takes back. beta =
    b^2 while the arm is stretched further (its rate then goes to zero, so it is never stretched out altogether), |b|
    while it is bent again. Together they lose rank only where z is vertical: below |z_h| = 0.2 the base does
    proportionally less, and the tip falls behind. scale is 1.

    Arguments as in `share`.
    """
    shares = _checked(arm, Shares() if shares is None else shares)
    base, nu_ref = finite_array("base", base, (3,)), finite_array("twist", twist, (6,))
    angles, to_arm = arm.checked(q), anchor(base).rotation.T
    nu_mb = shares.matrix @ nu_ref
    nu_a = nu_ref - nu_mb
    s, c = [*map(math.sin, angles)], [*map(math.cos, angles)]
    sides = triangle(s[3], c[3], arm.upper, arm.lower)
    axes, to_tip = wrist_axes(s, c, sides), hand(s, c, sides, arm.tip_offset)

    def at_wrist(nu: np.ndarray) -> tuple[tuple, tuple]:
        return wrist_twist(axes, to_tip, turned(to_arm, nu).tolist())

    p_z, z = at_wrist(nu_a)[0][2], to_arm.T @ np.array(axes[2])
    beta, beta_over_sine = elbow_share(angles[3], p_z, n)
    level = max(z[0] ** 2 + z[1] ** 2, LEVEL**2)
    extra = np.array([z[0], z[1], 0.0, 0.0, 0.0, 0.0]) * (1.0 - beta) * p_z / level
    nu_mb, nu_a = nu_mb + extra, nu_a - extra
    p, omega = at_wrist(nu_a)
    wanted = (p[0], p[1], beta_over_sine * p_z, *omega)
    qdot, _, _ = joint_rates(s, c, sides, arm.upper, arm.lower, wanted, finite_number("swivel_rate", swivel_rate))
    centre = base_centre_velocity(nu_mb, tip_in_world(arm, base, q).translation, base)
    return SharedVelocity(centre, np.array(qdot), 1.0, nu_mb, nu_a)


def elbow_share(q4: float, p_z: float, n: int = 2) -> tuple[float, float]:
    """Return beta, the arm's share of the wrist's velocity p_z [m/s] along the arm, and beta / sin q4."""
    b, b_over_sine = time_scale(q4, n)
    if p_z > 0.0:
        return b * b, b * b_over_sine
    return abs(b), math.copysign(b_over_sine, q4)


def _checked(arm: SphericalArm, shares: Shares) -> Shares:
    check_arm(arm)
    if not isinstance(shares, Shares):
        raise InvalidType("shares", shares, "Shares, such as Shares(x=0.9, y=0.9, yaw=0.5)")
    return shares
