"""Paper 4, eqs (1)-(3): inverse kinematics of velocities that stays finite where the arm is stretched out.

The arm is S-R-S: three axes meet in the shoulder, one bends the elbow, three meet in the wrist (Z Y Z - Y - Z Y Z).
Between shoulder and wrist the paper thinks a prismatic joint, as long as they are apart, along z of the frame W:

    r = |shoulder wrist|,  R_W = Rz(q1) Ry(q2) Rz(q3) Ry(alpha),  W: z from shoulder to wrist, y the elbow's axis

That joint alone needs 1 / sin q4, and eq (2) gives the time scale b a factor sin q4 there. So J qdot = b twist: the
direction is exact, only the pace changes, and b < 0 once q4 has changed its sign. `joint_velocity` is written in plain
numbers, which is fast; `joint_velocity_in_matrices` is the same, as the paper prints it.

What the print leaves out, or has garbled, and how it is read here: eq (2) means |q4| < epsilon with
epsilon = pi / 2^(n + 1), where sin(2^n q4) reaches 1; eq (3) needs b omega less the turning of the forearm, omega_F;
the wrist's modified matrix holds the self motion as a fourth column (reading "B"; without it, "A", a joint rate grows
without bound where q6 = 0 although the arm has six degrees of freedom there).
"""

import math
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, one_of, positive, whole_number
from tutorialbot.ik.spherical_rates import hand, joint_rates, triangle, wrist_axes, wrist_twist

LIMITS = tuple(np.deg2rad((170.0, 125.0, 170.0, 150.0, 170.0, 125.0, 170.0)).tolist())  # to both sides [rad]
AXES = "zyzyzyz"
MOST = 40  # n beyond which eq (2) is a step
SCALINGS = ("sine", "quintic")
WRISTS = ("B", "A")


@dataclass(frozen=True)
class Velocity:
    """Joint rates for a twist: J qdot = scale * twist, up to damping.

    qdot (7,) [rad/s]; scale: b of eq (2), in [-1, 1]; branch: the sign of sin q4, that is of the elbow, 0 when
    stretched; self_motion: rate [rad/s] along the unit vector of n_sm; damped: near a singularity of the shoulder or of
    the wrist, where the twist is followed only in part.
    """

    qdot: np.ndarray
    scale: float
    branch: int
    self_motion: float
    damped: bool


def time_scale(q4: float, n: int = 2, scaling: str = "sine") -> tuple[float, float]:
    """Return b of eq (2) at the elbow's angle q4 [rad], |q4| < pi, and b / sin q4, which is finite at q4 = 0.

    "sine", as printed: sin(2^n q4) within epsilon = pi / 2^(n + 1), where its slope but not its curvature is
    continuous; "quintic": (15 x - 10 x^3 + 3 x^5) / 8 with x = q4 / epsilon, whose curvature is continuous as well.
    Raises InvalidType or InvalidValue for n < 1 or not whole, q4 not in (-pi, pi), another scaling.
    """
    plain = type(n) is int and type(q4) is float and type(scaling) is str
    if not plain or not 1 <= n <= MOST or not -math.pi < q4 < math.pi or scaling not in SCALINGS:
        n, _ = whole_number("n", n, 1, MOST), one_of("scaling", scaling, SCALINGS)
        q4 = _within("q4", q4, math.nextafter(math.pi, 0.0))
    epsilon = math.pi / 2.0 ** (n + 1)
    if abs(q4) >= epsilon:
        b = math.copysign(1.0, q4)
        return b, b / math.sin(q4)
    if scaling == "sine":
        b, slope = math.sin(2.0**n * q4), 2.0**n
    else:
        x, slope = q4 / epsilon, 15.0 / (8.0 * epsilon)
        b = x * (15.0 + x * x * (3.0 * x * x - 10.0)) / 8.0
    return b, (b / math.sin(q4) if q4 else slope)


@dataclass(frozen=True)
class SphericalArm:
    """An S-R-S arm that stands upright at q = 0, in its anchor's frame: z along the stretched arm.

    upper, lower: shoulder to elbow, elbow to wrist; base_offset, tip_offset: anchor to shoulder, wrist to tip [m];
    limits (7,): how far each joint turns to both sides [rad]. At |q4| < pi alone r > 0, so limits[3] < pi is needed.
    """

    upper: float = 0.35
    lower: float = 0.35
    base_offset: float = 0.15
    tip_offset: float = 0.15
    limits: tuple[float, ...] = LIMITS
    model: pin.Model = field(init=False, repr=False, compare=False)
    data: pin.Data = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        for name in ("upper", "lower"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        for name in ("base_offset", "tip_offset"):
            object.__setattr__(self, name, finite_number(name, getattr(self, name), 0.0))
        limits = tuple(finite_array("limits", self.limits, (7,)).tolist())
        if min(limits) <= 0.0 or limits[3] >= math.pi:
            raise InvalidValue("limits", limits, "seven angles > 0, the fourth < pi")
        object.__setattr__(self, "limits", limits)
        object.__setattr__(self, "model", _model(self))
        object.__setattr__(self, "data", self.model.createData())

    @property
    def reach(self) -> float:
        """Greatest distance of the wrist from the shoulder [m], where q4 = 0."""
        return self.upper + self.lower

    def distance_at(self, q4: float) -> float:
        """Return how far the wrist is from the shoulder [m] at q4 [rad]: r of the virtual prismatic joint."""
        return math.sqrt(self.upper**2 + self.lower**2 + 2.0 * self.upper * self.lower * math.cos(q4))

    def elbow_cosine(self, distance: float | np.ndarray) -> float | np.ndarray:
        """Return cos q4 with the wrist at a `distance` [m] from the shoulder; beyond -1 to 1 it is out of reach."""
        return (distance * distance - self.upper**2 - self.lower**2) / (2.0 * self.upper * self.lower)

    def checked(self, q) -> list[float]:
        """Return q (7,) [rad] as plain numbers; raise InvalidValue for other shapes, NaN, and beyond the limits."""
        fits = isinstance(q, np.ndarray) and q.dtype == float and q.shape == (7,)
        angles = q.tolist() if fits else finite_array("q", q, (7,)).tolist()
        for number, (angle, limit) in enumerate(zip(angles, self.limits, strict=True), start=1):
            if not -limit - 1e-9 <= angle <= limit + 1e-9:  # also NaN
                _within(f"q{number}", angle, limit)
        return angles

    def forward(self, q: np.ndarray) -> pin.SE3:
        """Return the tip's pose in the anchor's frame for q (7,) [rad]."""
        q = finite_array("q", q, (7,))
        pin.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.model.nframes - 1].copy()

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """Return the Jacobian (6, 7) of the tip: linear [m/s] first, in the axes of the anchor."""
        q = finite_array("q", q, (7,))
        return pin.computeFrameJacobian(self.model, self.data, q, self.model.nframes - 1, pin.LOCAL_WORLD_ALIGNED)

    def joint_velocity(
        self, q: np.ndarray, twist: np.ndarray, n: int = 2, swivel_rate: float = 0.0, *,
        scaling: str = "sine", wrist: str = "B",
    ) -> Velocity:  # fmt: skip
        """Return the joint rates with J qdot = b twist, for any q, the stretched arm included (eqs (1)-(3)).

        q (7,) [rad]; twist (6,) of the tip in the anchor's axes [m/s, rad/s], linear first; n, scaling: see
        `time_scale`; swivel_rate [rad/s]: how fast the elbow turns about the line from shoulder to wrist, on top of
        the least joint rates, not scaled by b, less where the wrist cannot follow. Of all rates with J qdot = b twist
        "B" takes the least, "A" those without self motion (and without swivel_rate's limit at the wrist).

        Raises InvalidType or InvalidValue for numbers that are not finite, q out of its limits, n < 1 or not whole.
        """
        angles, twist = self.checked(q), _checked_twist(twist, swivel_rate)
        if type(wrist) is not str or wrist not in WRISTS:
            one_of("wrist", wrist, WRISTS)
        s, c = [*map(math.sin, angles)], [*map(math.cos, angles)]
        sides = triangle(s[3], c[3], self.upper, self.lower)
        p, omega = wrist_twist(wrist_axes(s, c, sides), hand(s, c, sides, self.tip_offset), twist)
        b, b_over_sine = time_scale(angles[3], n, scaling)  # (2)
        wanted = (b * p[0], b * p[1], b_over_sine * p[2], b * omega[0], b * omega[1], b * omega[2])
        qdot, b_sm, near = joint_rates(s, c, sides, self.upper, self.lower, wanted, swivel_rate, wrist)  # (1), (3)
        return Velocity(np.array(qdot), b, (s[3] > 0.0) - (s[3] < 0.0), b_sm, near)


def joint_velocity_in_matrices(arm: SphericalArm, q: np.ndarray, twist: np.ndarray, n: int = 2) -> np.ndarray:
    """Return qdot (7,) [rad/s] of eqs (1)-(3) as they are printed, for an arm that is near no singularity but q4 = 0.

    Arguments as in `SphericalArm.joint_velocity`, which gives the same.
    """
    check_arm(arm)
    q, twist, pinv = arm.checked(q), finite_array("twist", twist, (6,)), np.linalg.pinv
    q4 = q[3]
    L1, L2, (_, e_y, e_z) = arm.upper, arm.lower, np.eye(3)
    r = np.sqrt(L1**2 + L2**2 + 2 * L1 * L2 * np.cos(q4))
    alpha = np.arctan2(L2 * np.sin(q4), L1 + L2 * np.cos(q4))
    beta = q4 - alpha
    turns = [pin.utils.rotate(axis, angle) for axis, angle in zip(AXES, q, strict=True)]
    R_W = turns[0] @ turns[1] @ turns[2] @ pin.utils.rotate("y", alpha)

    # A_W: rates of the shoulder -> angular velocity, A_w: the same of the wrist; both in W
    A_W = R_W.T @ np.column_stack([e_z, turns[0] @ e_y, turns[0] @ turns[1] @ e_z])
    A_w = pin.utils.rotate("y", beta) @ np.column_stack([e_z, turns[4] @ e_y, turns[4] @ turns[5] @ e_z])
    hand = pin.utils.rotate("y", beta) @ turns[4] @ turns[5] @ e_z * arm.tip_offset
    omega = R_W.T @ twist[3:]
    p = R_W.T @ twist[:3] - np.cross(omega, hand)  # of the wrist
    J_mod = r * np.array([A_W[1], -A_W[0]])  # without the virtual prismatic joint
    n_sm = np.cross(A_W[0], A_W[1])
    n_sm = n_sm / np.linalg.norm(n_sm)

    b, b_over_sine = time_scale(q4, n)  # (2)
    s4_n_z = -r / (L1 * L2) * np.append(-L2 * np.cos(beta) * pinv(J_mod)[:, 0], 1.0)  # sin(q4) n_z
    qdot_p = b * np.append(pinv(J_mod) @ p[:2], 0.0) + b_over_sine * s4_n_z * p[2]  # (1), b_sm comes with (3)
    omega_F = A_W @ qdot_p[:3] + e_y * qdot_p[3]
    b_sm, *qdot_w = pinv(np.column_stack([A_W @ n_sm, A_w])) @ (b * omega - omega_F)  # (3)
    return np.concatenate([qdot_p[:3] + b_sm * n_sm, qdot_p[3:], qdot_w])


def elbow_peak_rate(arm: SphericalArm, speed: float, n: int = 2, scaling: str = "sine") -> float:
    """Return the greatest |qdot4| [rad/s] that the wrist's `speed` [m/s] along the stretched arm asks for.

    It is reached at q4 = 0, where b / sin q4 is greatest: 2^n (L1 + L2) / (L1 L2) speed, that is 2^(n + 1) speed / L
    for equal links; 19 % more with the quintic.
    """
    check_arm(arm)
    _, most = time_scale(0.0, n, scaling)
    return most * arm.reach / (arm.upper * arm.lower) * finite_number("speed", speed, 0.0)


def order_for_rate(arm: SphericalArm, speed: float, rate_limit: float) -> int:
    """Return the greatest n whose `elbow_peak_rate` at `speed` [m/s] is within `rate_limit` [rad/s]:

        n = floor(log2(rate_limit L / (2 speed)))    for equal links

    Raises InvalidValue when not even n = 1 keeps the limit.
    """
    slowest = elbow_peak_rate(arm, positive("speed", speed), 1)
    if positive("rate_limit", rate_limit) < slowest:
        raise InvalidValue("speed", speed, f"at most {speed * rate_limit / slowest:.4g} m/s for {rate_limit:g} rad/s")
    return min(MOST, 1 + math.floor(math.log2(rate_limit / slowest)))


def check_arm(arm: SphericalArm) -> SphericalArm:
    """Return the arm, or raise InvalidType."""
    if not isinstance(arm, SphericalArm):
        raise InvalidType("arm", arm, "a SphericalArm")
    return arm


def _model(arm: SphericalArm) -> pin.Model:
    """Return pinocchio's model of the arm; its last frame is the tip."""
    model, joint = pin.Model(), 0
    rises = (arm.base_offset, 0.0, 0.0, arm.upper, arm.lower, 0.0, 0.0)
    for number, (axis, rise) in enumerate(zip(AXES, rises, strict=True), start=1):
        kind = pin.JointModelRZ() if axis == "z" else pin.JointModelRY()
        place = pin.SE3(np.eye(3), np.array([0.0, 0.0, rise]))
        joint = model.addJoint(joint, kind, place, f"arm_{number}")
    model.lowerPositionLimit, model.upperPositionLimit = -np.array(arm.limits), np.array(arm.limits)
    tip = pin.SE3(np.eye(3), np.array([0.0, 0.0, arm.tip_offset]))
    model.addFrame(pin.Frame("tip", joint, tip, pin.FrameType.OP_FRAME))
    return model


def _checked_twist(twist: np.ndarray, swivel_rate: float) -> list[float]:
    fits = isinstance(twist, np.ndarray) and twist.dtype == float and twist.shape == (6,)
    numbers = twist.tolist() if fits else finite_array("twist", twist, (6,)).tolist()
    if not math.isfinite(sum(numbers)):
        finite_array("twist", numbers, (6,))
    if type(swivel_rate) is not float or not math.isfinite(swivel_rate):
        finite_number("swivel_rate", swivel_rate)
    return numbers


def _within(name: str, angle: float, limit: float) -> float:
    if not math.isfinite(finite_number(name, angle)) or abs(angle) > limit:
        raise InvalidValue(name, angle, f"an angle from {-limit:.4f} to {limit:.4f} rad")
    return float(angle)
