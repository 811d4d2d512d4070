"""Paper 4's open problem: singularities while base and arm move together.

The tip is to run along a level line in time, and the base's fixed share K of it (eq. (4)) is too small: the arm gets
stretched out. Four methods on the same line:

- "fixed split": eqs (4), (5) with |b|: base and arm slow down together, and the tip, which must not wait, falls behind;
- "base inside": `base_sharing.share_in_time`;
- "whole body, good weights", "whole body, poor weights": damped least squares over base and arm together, a metre
  of the base weighing as much as a radian of the arm, or 30 times as much.
"""

import math
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidValue, finite_number, one_of, positive, step_count, whole_number
from tutorialbot.ik.base_sharing import Shares, anchor, share, share_in_time, tip_in_world, tip_velocity_by_base
from tutorialbot.ik.singularity_consistent import MOST, SphericalArm, check_arm
from tutorialbot.pose import twist_between

METHODS = ("fixed split", "base inside", "whole body, good weights", "whole body, poor weights")
WEIGHTS = {"whole body, good weights": 1.0, "whole body, poor weights": 30.0}  # of the base's rates, against the arm's
DAMPING = 0.02
START = (0.0, 0.9, 0.0, 0.9, 0.0, 0.9, 0.0)  # elbow bent, gripper tilted down
SHARE = 0.3  # of the line that eq (4) leaves to the base
RAMP, REST = 0.5, 0.5  # seconds to and from full speed; at the end, to catch up
LONGEST = 100.0  # a line [m]


@dataclass(frozen=True)
class Line:
    """times (n,) [s]; error (n,) [m]: from the tip to where it must be; q (n, 7) [rad]; joint_rates (n, 7) [rad/s];
    base (n, 3): x, y [m], yaw [rad]; base_rates (n, 3) [m/s, rad/s].
    """

    method: str
    times: np.ndarray
    error: np.ndarray
    q: np.ndarray
    joint_rates: np.ndarray
    base: np.ndarray
    base_rates: np.ndarray

    @property
    def nearest(self) -> float:
        """Least |q4| [rad]."""
        return float(np.abs(self.q[:, 3]).min())

    @property
    def base_acceleration(self) -> float:
        """Greatest acceleration of the base's centre [m/s^2], over 20 ms."""
        step = max(1, round(0.02 / (self.times[1] - self.times[0])))
        change = self.base_rates[step:, :2] - self.base_rates[:-step, :2]
        return float(np.linalg.norm(change, axis=1).max() / (step * (self.times[1] - self.times[0])))


def place(t: float, length: float, speed: float, ramp: float = RAMP) -> tuple[float, float]:
    """Return way [m] and speed [m/s] at t [s]: there and back, `speed` between smooth ramps of so many seconds."""
    half = length / speed + ramp
    if t > half:
        way, rate = place(max(0.0, 2.0 * half - t), length, speed, ramp)
        return way, -rate
    edge = min(t, half - t, ramp)
    share, inside = edge / ramp, edge - ramp / math.pi * math.sin(math.pi * edge / ramp)
    rate = 0.5 * speed * (1.0 - math.cos(math.pi * share))
    if t <= ramp:
        return 0.5 * speed * inside, rate
    if t >= half - ramp:
        return length - 0.5 * speed * inside, rate
    return 0.5 * speed * ramp + speed * (t - ramp), rate


def line(
    method: str = "base inside", *, arm: SphericalArm | None = None, n: int = 2, speed: float = 0.2,
    length: float = 0.5, share_of_base: float = SHARE, gain: float = 10.0, dt: float = 2e-3,
) -> Line:  # fmt: skip
    """Run the tip `length` [m] forward and back at `speed` [m/s] by one of METHODS; its orientation stays.

    Raises InvalidType or InvalidValue that names the argument, also for a speed that is not reached within the ramps,
    and for more than a million steps.
    """
    one_of("method", method, METHODS), positive("speed", speed), positive("dt", dt), finite_number("gain", gain, 0.0)
    if finite_number("length", length, 0.0, LONGEST, above=True) < (1.0 - 1e-9) * speed * RAMP:
        raise InvalidValue("speed", speed, f"at most {length / RAMP:g} m/s: ramps of {RAMP} s on {length:g} m")
    steps = round(step_count(2.0 * (length / speed + RAMP) + REST, speed, dt))
    arm, shares = SphericalArm() if arm is None else arm, Shares(share_of_base, share_of_base, 0.0)
    check_arm(arm), whole_number("n", n, 1, MOST)
    base, q, rows = np.zeros(3), np.array(START), []
    begin = tip_in_world(arm, base, q)
    for step in range(steps):
        way, rate = place(step * dt, length, speed)
        here = tip_in_world(arm, base, q)
        behind = twist_between(here, begin)
        behind[0] += way
        twist = gain * behind
        twist[0] += rate
        base_rates, qdot = _rates(method, arm, base, q, twist, shares, n)
        rows.append((step * dt, float(np.linalg.norm(behind[:3])), q, qdot, base, base_rates))
        base, q = base + dt * base_rates, q + dt * qdot
    return Line(method, *(np.array(column) for column in zip(*rows, strict=True)))


def _rates(method, arm, base, q, twist, shares, n) -> tuple[np.ndarray, np.ndarray]:
    if method == "base inside":
        found = share_in_time(arm, base, q, twist, shares, n)
        return found.base, found.qdot
    if method == "fixed split":
        found = share(arm, base, q, twist, shares, n)
        sign = math.copysign(1.0, found.scale)  # |b|: the path does not turn round
        return sign * found.base, sign * found.qdot
    return whole_body(arm, base, q, twist, WEIGHTS[method])


def whole_body(
    arm: SphericalArm, base: np.ndarray, q: np.ndarray, twist: np.ndarray, weight: float = 1.0, damping: float = DAMPING
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rates of base (3,) and joints (7,) that the twist (6,) of the tip takes, (weight base, qdot) least."""
    there = anchor(base).rotation
    jacobian = np.empty((6, 10))
    tip = tip_in_world(arm, base, q).translation
    jacobian[:, :3] = np.column_stack([tip_velocity_by_base(unit, tip, base) for unit in np.eye(3)]) / weight
    of_arm = arm.jacobian(q)
    jacobian[:3, 3:], jacobian[3:, 3:] = there @ of_arm[:3], there @ of_arm[3:]
    both = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping**2 * np.eye(6), twist)
    return both[:3] / weight, both[3:]
