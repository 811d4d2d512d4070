"""Base and tip of the symmetric arm change their roles (paper 4, section 2): it steps from one fixture to another.

Each end has a frame whose z axis points into the arm; the end that is fixed is the anchor, and its frame the anchor's.
With F = Rx(pi) between the tip's frame (z out of the arm) and that one, and q counted from the anchored end,

    T(q)^-1 = F T(rev q) F,    rev q = (q7, ..., q1)

without a change of sign: seen from its tip the arm is the same arm, elbow at q4, shoulder and wrist exchanged. So the
same inverse kinematics serves both, and at the swap nothing moves.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, one_of, positive, step_count
from tutorialbot.ik import srs
from tutorialbot.ik.singularity_consistent import SphericalArm, Velocity, check_arm
from tutorialbot.pose import check_pose, interpolate, turned, twist_between

F = pin.SE3(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
ENDS = ("base", "tip")
FASTEST, MOST_PATIENCE = 100.0, 1000.0  # of a motion [m/s]; of its own duration


@dataclass(frozen=True)
class Stance:
    """A symmetric arm that hangs on one of its ends.

    fixture: pose in the world of the anchored end's frame, z into the arm; q (7,) [rad], counted from that end; anchor:
    which end it is, "base" or "tip", as the arm was built. Raises InvalidValue for an arm that is not symmetric.
    """

    arm: SphericalArm
    fixture: pin.SE3
    q: np.ndarray
    anchor: str = "base"

    def __post_init__(self):
        check_symmetric(self.arm), check_pose("fixture", self.fixture), one_of("anchor", self.anchor, ENDS)
        object.__setattr__(self, "q", np.array(self.arm.checked(self.q)))

    @property
    def built_q(self) -> np.ndarray:
        """(7,) [rad], joints in the order in which they are numbered on the arm."""
        return self.q if self.anchor == "base" else self.q[::-1].copy()

    @property
    def free_end(self) -> pin.SE3:
        """Pose of the free end in the world, z out of the arm: what it grips with."""
        return self.fixture * self.arm.forward(self.q)


def check_symmetric(arm: SphericalArm) -> SphericalArm:
    """Return the arm if its two halves are equal, else raise InvalidValue."""
    check_arm(arm)
    for first, last in (("upper", "lower"), ("base_offset", "tip_offset")):
        if abs(getattr(arm, first) - getattr(arm, last)) > 1e-9:
            raise InvalidValue(last, getattr(arm, last), f"{first} = {getattr(arm, first)}: base and tip change roles")
    if max(abs(a - b) for a, b in zip(arm.limits, arm.limits[::-1], strict=True)) > 1e-9:
        raise InvalidValue("limits", arm.limits, "the same from both ends: base and tip change roles")
    return arm


def check_stance(stance: Stance) -> Stance:
    """Return the stance, or raise InvalidType."""
    if not isinstance(stance, Stance):
        raise InvalidType("stance", stance, "a Stance")
    return stance


def swap(stance: Stance) -> Stance:
    """Return the same posture, anchored at the end that was free; no body moves."""
    other = ENDS[1 - ENDS.index(check_stance(stance).anchor)]
    return Stance(stance.arm, stance.free_end * F, stance.q[::-1].copy(), other)


def body_poses(stance: Stance) -> list[pin.SE3]:
    """Return the poses in the world of the 8 bodies from the built base to the built tip, z towards the tip.

    The first is the base's end, body i the one that joint i moves, at joint i; the last is thus the tip's end.
    """
    arm, rises = check_stance(stance).arm, _rises(stance.arm)
    pin.forwardKinematics(arm.model, arm.data, stance.q)
    placed = [stance.fixture] + [stance.fixture * arm.data.oMi[i] for i in range(1, 8)]
    if stance.anchor == "base":
        return placed
    placed.reverse()  # body i is the one before joint 8 - i, seen from the other end, where it has its frame
    down = [pin.SE3(np.eye(3), np.array([0.0, 0.0, -rise])) for rise in rises]
    return [body * F * back for body, back in zip(placed, down, strict=True)]


def _rises(arm: SphericalArm) -> tuple[float, ...]:
    """Return how far it is along z [m] from the base to joint 1, then from each joint to the next, and to the tip."""
    return arm.base_offset, 0.0, 0.0, arm.upper, arm.lower, 0.0, 0.0, arm.tip_offset


def free_end_velocity(stance: Stance, twist: np.ndarray, n: int = 2, swivel_rate: float = 0.0) -> Velocity:
    """Return the joint rates, counted from the anchored end, for a twist (6,) of the free end in the world's axes."""
    there = turned(check_stance(stance).fixture.rotation.T, finite_array("twist", twist, (6,)))
    return stance.arm.joint_velocity(stance.q, there, n, swivel_rate)


def move(
    stance: Stance, target: pin.SE3, *, speed: float = 0.15, n: int = 2, gain: float = 5.0, dt: float = 0.01,
    near: float = 1e-4, patience: float = 4.0,
) -> Iterator[Stance]:  # fmt: skip
    """Yield the stances on the way of the free end to `target` [pose in the world], straight, by eqs (1)-(3).

    speed [m/s, and rad/s times 0.3 m]; it ends within `near` [m, rad]. It also ends, short of the target, before a
    joint's limit, and after `patience` times the way's duration, when the target is out of reach: see `is_at`.
    Raises InvalidType or InvalidValue that names the argument, also for more than a million steps.
    """
    begin, there = check_stance(stance).free_end, check_pose("target", target)
    turn = float(np.linalg.norm(pin.log3(begin.rotation.T @ there.rotation)))
    way = max(float(np.linalg.norm(there.translation - begin.translation)), 0.3 * turn, 1e-9)
    finite_number("speed", speed, 0.0, FASTEST, above=True), finite_number("dt", dt, 0.0, 1.0, above=True)
    positive("near", near), finite_number("patience", patience, 0.0, MOST_PATIENCE, above=True)
    finite_number("gain", gain, 0.0)
    duration, s = way / speed, 0.0
    for _ in range(math.ceil(step_count(patience * duration, speed, dt, least=0.0))):
        wanted, ahead = interpolate(begin, there, min(s, 1.0)), interpolate(begin, there, min(s + 1e-3, 1.0))
        here = stance.free_end
        feed = twist_between(wanted, ahead) / (1e-3 * duration) if s < 1.0 else np.zeros(6)
        back = twist_between(here, wanted)
        if s >= 1.0 and is_at(stance, there, near):
            return
        sign = np.sign(stance.q[3])  # that of b, so that the feedback keeps its own once the elbow has flipped
        found = free_end_velocity(stance, feed + gain * sign * back, n)
        q = stance.q + dt * found.qdot
        if (np.abs(q) > stance.arm.limits).any():
            return
        stance = replace(stance, q=q)
        s = max(0.0, s + found.scale * dt / duration)
        yield stance


def is_at(stance: Stance, target: pin.SE3, near: float = 1e-4) -> bool:
    """Whether the free end is within `near` [m, rad] of a pose in the world.

    Raises InvalidType or InvalidValue for what is no Stance, no pose or no number > 0.
    """
    check_stance(stance), check_pose("target", target), positive("near", near)
    return bool(np.abs(twist_between(stance.free_end, target)).max() < near)


def step_over(stance: Stance, fixture: pin.SE3, rest: pin.SE3, **options: float) -> Iterator[Stance]:
    """Yield the stances of a step from one fixture to another: the free end goes to `fixture`, base and tip change
    their roles, and the end that is free now goes to `rest`. It ends without that where the fixture is not reached.

    fixture: as `Stance.fixture`, z into the arm, so away from the wall; rest: where the other end goes, z out of the
    arm; both in the world. options: as in `move`. Raises InvalidType or InvalidValue that names the argument.
    """
    check_stance(stance), check_pose("fixture", fixture), check_pose("rest", rest)
    for stance in move(stance, fixture * F, **options):  # noqa: B020 - the last one is swapped
        yield stance
    if not is_at(stance, fixture * F, options.get("near", 1e-4)):
        return
    stance = swap(stance)
    yield stance
    yield from move(stance, rest, **options)


def step_to_wall(arm: SphericalArm | None = None, **options: float) -> Iterator[Stance]:
    """Yield the stances of the demonstration: the arm steps from the mobile base, at the origin, to a wall fixture.

    The wall is at x = 0.75 m, the fixture 1.1 m above the floor; the freed end is let down beside the base.
    """
    arm = SphericalArm() if arm is None else arm
    base = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.7]))
    wall = _facing((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.75, 0.2, 1.1))
    before = base.actInv(_facing((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.35, -0.2, 1.05)))
    q, _ = srs.inverse(arm, before.rotation, before.translation, np.array(-0.6), (1, -1))
    yield (stance := Stance(arm, base, q))
    yield from step_over(stance, wall, _facing((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.3, 0.35, 0.9)), **options)


def _facing(z: tuple, x: tuple, position: tuple) -> pin.SE3:
    return pin.SE3(np.column_stack([x, np.cross(z, x), z]), np.array(position))
