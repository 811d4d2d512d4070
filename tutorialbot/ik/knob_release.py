"""Paper 4, section 4.3 and Figs 5, 6: the door stands open beyond its hold angle, and the hand lets go of the knob.

The base waits beyond the panel's free edge, before the doorway, and the arm reaches round the edge to the knob, nearly
stretched out. The hand has to come straight off the knob, and that stretches the arm still more:

- "singularity-consistent": the arm by itself, eqs (1)-(3). It goes into |q4| < epsilon with bounded rates, is stretched
  out, and comes back to the knob along the same line with its elbow flipped: the hand has not let go. On a straight
  line that is all that the method can do, and sin q4 runs through zero as in the paper's Fig. 6.
- "pseudo-inverse": the arm by itself, in time: the rates grow without bound.
- "base inside": what the elbow cannot do in time, the base does (`base_sharing.share_in_time`): the hand lets go.
"""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidValue, finite_number, one_of, positive, step_count, whole_number
from tutorialbot.ik import srs
from tutorialbot.ik.base_sharing import Shares, anchor, share_in_time, tip_in_world
from tutorialbot.ik.singular_peers import pseudo_inverse
from tutorialbot.ik.singularity_consistent import MOST, SphericalArm, check_arm
from tutorialbot.pose import turned, twist_between
from tutorialbot.scene.closing_door import ClosingDoor, check_closing_door
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT

HOLD_DEG, OPENING_DEG = 75.0, 80.0  # the closer's hold angle, and where the door stands
DISTANCE, SLANT_DEG = 0.693, 70.0  # shoulder to wrist [m] at the knob; between the arm and the way off the knob
OFF = 0.10  # how far the hand goes [m]
WAYS = ("singularity-consistent", "pseudo-inverse", "base inside")


@dataclass(frozen=True)
class Release:
    """times (n,) [s]; sin_q4 (n,); joint_rates (n, 7) [rad/s]; scale (n,): b; q (n, 7) [rad]; base (n, 3): x, y [m],
    yaw [rad]; off (n,) [m]: how far the hand is off the knob, along its way; error (n,) [m]: from the tip to where it
    should be by then. epsilon [rad]: where eq (2) begins; door_angle [rad]; held: whether the door stays there.
    """

    way: str
    times: np.ndarray
    sin_q4: np.ndarray
    joint_rates: np.ndarray
    scale: np.ndarray
    q: np.ndarray
    base: np.ndarray
    off: np.ndarray
    error: np.ndarray
    epsilon: float
    door_angle: float
    held: bool

    @property
    def entered(self) -> bool:
        """Whether the arm came into the region |q4| < epsilon of eq (2)."""
        return bool(np.abs(self.q[:, 3]).min() < self.epsilon)

    @property
    def flipped(self) -> bool:
        """Whether the elbow ended on the other side."""
        return bool(self.q[0, 3] * self.q[-1, 3] < 0.0)

    @property
    def peak_rate(self) -> float:
        """Greatest |qdot_i| [rad/s]."""
        return float(np.abs(self.joint_rates).max())


def stance(
    arm: SphericalArm, door: ClosingDoor, opening: float, distance: float = DISTANCE,
    slant: float = math.radians(SLANT_DEG),
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return base (3,) and q (7,) with the hand at the knob of a door at `opening` [rad].

    The wrist is `distance` [m] from the shoulder, and that line encloses `slant` [rad] with the way off the knob.
    Raises InvalidValue when the base cannot stand so, or no joint angles within the limits reach the knob from there.
    """
    check_arm(arm), check_closing_door(door), finite_number("slant", slant)
    tip = door.knob_frame(finite_number("opening", opening))
    wrist = tip.translation - arm.tip_offset * tip.rotation[:, 2]
    rise = (wrist[2] - ANCHOR_HEIGHT - arm.base_offset) / positive("distance", distance)
    off, along = -tip.rotation[:, 2], tip.rotation[:, 1]
    beside = 1.0 - math.cos(slant) ** 2 - rise**2
    if beside < 0.0 or distance > arm.reach:
        raise InvalidValue("distance", distance, f"a base from which the arm, {arm.reach:g} m long, meets the knob so")
    place = wrist - distance * (math.cos(slant) * off - math.sqrt(beside) * along)
    yaw = math.atan2(wrist[1] - place[1], wrist[0] - place[0])
    base = np.array([place[0], place[1], yaw])
    return base, _posture(arm, anchor(base).actInv(tip))


def _posture(arm: SphericalArm, tip: pin.SE3) -> np.ndarray:
    """Return q (7,) for a pose of the tip, of all swivels and branches the one farthest from the limits."""
    swivels, limits = np.linspace(-math.pi, math.pi, 72, endpoint=False), np.array(arm.limits)
    found = [srs.inverse(arm, tip.rotation, tip.translation, swivels, branch) for branch in srs.BRANCHES]
    q, reached = np.concatenate([some for some, _ in found]), found[0][1].all()  # a matter of the distance alone
    slack = (limits - np.abs(q)).min(axis=1)
    if not reached or slack.max() <= 0.0:
        raise InvalidValue("tip", tip.translation, "a pose that the arm reaches within its limits")
    return q[int(np.argmax(slack))]


def release(
    way: str = WAYS[0], *, arm: SphericalArm | None = None, door: ClosingDoor | None = None,
    opening_deg: float = OPENING_DEG, distance: float = DISTANCE, n: int = 3, speed: float = 0.1, dt: float = 2e-3,
    gain: float = 10.0,
) -> Release:  # fmt: skip
    """Let go of the knob in one of WAYS, the hand at `speed` [m/s], and record every step of dt [s].

    door: by default one that stays open beyond 75 degrees. It ends when the hand is OFF from the knob or at the knob
    again, or after twice the time that the way takes. Raises InvalidType or InvalidValue that names the argument, also
    for more than a million steps.
    """
    arm = SphericalArm() if arm is None else arm
    door = ClosingDoor(hold_angle=math.radians(HOLD_DEG)) if door is None else door
    check_arm(arm), check_closing_door(door), finite_number("gain", gain, 0.0), whole_number("n", n, 1, MOST)
    one_of("way", way, WAYS), positive("speed", speed), positive("dt", dt)
    count = round(step_count(2.0 * OFF / speed, speed, dt))
    opening = math.radians(finite_number("opening_deg", opening_deg, 0.0, 120.0))
    base, q = stance(arm, door, opening, distance)
    knob = tip_in_world(arm, base, q)
    off, rows, s = -knob.rotation[:, 2], [], 0.0
    for step in range(count):
        here = tip_in_world(arm, base, q)
        behind = twist_between(here, pin.SE3(knob.rotation, knob.translation + s * off))
        wanted = np.concatenate([speed * off, np.zeros(3)])
        sign = (np.sign(q[3]) or 1.0) if way == WAYS[0] else 1.0
        base_rates, qdot, b = _rates(way, arm, base, q, wanted + sign * gain * behind, n)
        along = float(off @ (here.translation - knob.translation))
        rows.append((step * dt, math.sin(q[3]), qdot, b, q, base, along, float(np.linalg.norm(behind[:3]))))
        base, q, s = base + dt * base_rates, q + dt * qdot, s + b * speed * dt
        if not 0.0 <= s < OFF:
            break
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    epsilon = math.pi / 2.0 ** (n + 1)
    return Release(way, *columns, epsilon, opening, bool(opening >= door.hold_angle))


def _rates(way: str, arm: SphericalArm, base: np.ndarray, q: np.ndarray, twist: np.ndarray, n: int) -> tuple:
    """Return the base's rates (3,), the joints' (7,) and b for the tip's twist (6,) in the world's axes."""
    if way == "base inside":
        both = share_in_time(arm, base, q, twist, Shares(0.0, 0.0, 0.0), n)
        return both.base, both.qdot, 1.0
    there = turned(anchor(base).rotation.T, twist)
    if way == "pseudo-inverse":
        return np.zeros(3), pseudo_inverse(arm, q, there), 1.0
    found = arm.joint_velocity(q, there, n)
    return np.zeros(3), found.qdot, found.scale
