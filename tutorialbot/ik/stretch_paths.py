"""Paths that stretch an S-R-S arm out: straight lines and arcs of its tip, and what eqs (1)-(3) will make of them.

The tip keeps its orientation, so tip and wrist move alike, and all that counts is how far the wrist is from the
shoulder along the path, r(s). Where it reaches the stretched arm's R = L1 + L2:

- "passes": r(s) < R throughout; the path is followed to its end.
- "reflects": r(s) grows through R at an angle. q4 passes through zero with a finite rate, the time scale b changes its
  sign with it, and the arm runs back along the same path with its elbow flipped. That is all that "passing through the
  singularity" can mean: what lies beyond is out of reach.
- "stalls": r(s) touches R from inside. In the plane (q4, s) that is a saddle, which is reached in infinite time.
"""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, one_of, positive
from tutorialbot.ik.singularity_consistent import SphericalArm, check_arm

KINDS = ("line", "arc")
POLAR = 1.2  # between the vertical and the stretched arm, where the path meets the edge of the workspace [rad]
HAND = (0.5, 0.9, 0.0)  # q5, q6, q7 at the start: the gripper turned away from the arm
FARTHEST = 100.0  # that a length may be [m]


@dataclass(frozen=True)
class StretchPath:
    """A path of the wrist in the vertical plane of joint 1, in coordinates (along, across) of the stretched arm's line.

    kind: "line" or "arc"; start (2,), heading (2,): where it begins, seen from the shoulder [m], and its first
    direction, a unit vector; radius [m]: of an arc, bent towards the shoulder; length [m]; returns: whether the
    reference turns round at the end. Raises InvalidType or InvalidValue for what is none of these.
    """

    name: str
    kind: str
    start: tuple[float, float]
    heading: tuple[float, float]
    length: float
    radius: float = math.inf
    returns: bool = False

    def __post_init__(self):
        if not isinstance(self.name, str):
            raise InvalidType("name", self.name, "text")
        one_of("kind", self.kind, KINDS), _length("length", self.length), finite_array("start", self.start, (2,))
        if abs(float(np.linalg.norm(finite_array("heading", self.heading, (2,)))) - 1.0) > 1e-6:
            raise InvalidValue("heading", self.heading, "a unit vector")
        if self.kind == "arc" or self.radius != math.inf:
            positive("radius", self.radius)
        if not isinstance(self.returns, bool):
            raise InvalidType("returns", self.returns, "True or False")

    def plane(self, s: float) -> tuple[float, float, float, float]:
        """Return place [m] and direction at s [m] in the plane: along, across, and the unit vector there."""
        (x, y), (u, v) = self.start, self.heading
        if self.kind == "line":
            return x + s * u, y + s * v, u, v
        angle = s / self.radius
        sin, cos = math.sin(angle), math.cos(angle)  # the centre is to the left of the heading
        x, y = x + self.radius * (sin * u - (1 - cos) * v), y + self.radius * (sin * v + (1 - cos) * u)
        return x, y, cos * u - sin * v, cos * v + sin * u

    def distance(self, s: np.ndarray) -> np.ndarray:
        """Return r(s) [m], how far the wrist would have to be from the shoulder."""
        return np.array([math.hypot(*self.plane(float(one))[:2]) for one in np.atleast_1d(s)])


def radial(arm: SphericalArm, beyond: float = 0.0, run_up: float = 0.15) -> StretchPath:
    """Straight out, to exactly the stretched arm or `beyond` it [m], and back; begins `run_up` [m] before it.

    Raises InvalidType or InvalidValue for beyond < 0, a run_up that is not > 0, and what is no number.
    """
    check_arm(arm)
    length = finite_number("beyond", beyond, 0.0, FARTHEST / 2) + _length("run_up", run_up, FARTHEST / 2)
    name = f"radial, {1000 * beyond:g} mm beyond" if beyond else "radial, exactly to the edge"
    return StretchPath(name, "line", (arm.reach - run_up, 0.0), (1.0, 0.0), length, returns=True)


def release(arm: SphericalArm, beyond: float = 0.01, run_up: float = 0.15, slant: float = math.pi / 4) -> StretchPath:
    """Straight out at a slant [rad] to the stretched arm, ending `beyond` it [m]: letting go of a knob.

    It meets the edge of the workspace `run_up` [m] from its beginning. Raises InvalidType or InvalidValue for a slant
    of a right angle or more, beyond < 0, a run_up with which it does not begin within the edge.
    """
    check_arm(arm), finite_number("beyond", beyond, 0.0, FARTHEST / 2)
    if abs(finite_number("slant", slant)) >= math.pi / 2:
        raise InvalidValue("slant", slant, "an angle between -pi/2 and pi/2")
    if _length("run_up", run_up) >= 2.0 * arm.reach * math.cos(slant):
        within = f"less than {2.0 * arm.reach * math.cos(slant):g} m: the path begins within the edge"
        raise InvalidValue("run_up", run_up, within)
    u, v = math.cos(slant), math.sin(slant)
    start = arm.reach - run_up * u, -run_up * v
    after = -arm.reach * u + math.sqrt((arm.reach + beyond) ** 2 - (arm.reach * v) ** 2)
    name = f"{math.degrees(slant):.0f} deg release, {1000 * beyond:g} mm beyond"
    return StretchPath(name, "line", start, (u, v), run_up + after)


def arc(arm: SphericalArm, margin: float = 0.0, radius: float = 0.45, run_up: float = 0.25) -> StretchPath:
    """An arc that comes as near to the edge as `margin` [m], negative beyond it; `run_up` [m] before and after.

    Raises InvalidType or InvalidValue for a radius not between 0 and the arm's reach, a run_up beyond half a turn.
    """
    check_arm(arm)
    if not 0.0 < positive("radius", radius) < arm.reach:
        raise InvalidValue("radius", radius, f"less than {arm.reach:g} m: a larger arc crosses the edge")
    angle = -_length("run_up", run_up, math.pi * radius) / radius
    middle = arm.reach - radius - finite_number("margin", margin, -FARTHEST, FARTHEST)
    start = middle + radius * math.cos(angle), radius * math.sin(angle)
    where = f"{1000 * abs(margin):g} mm {'inside' if margin > 0 else 'outside'}" if margin else "touching"
    return StretchPath(f"arc, {where}", "arc", start, (-math.sin(angle), math.cos(angle)), 2.0 * run_up, radius)


def five_paths(arm: SphericalArm) -> list[StretchPath]:
    """Return the five paths on which methods are compared."""
    return [radial(arm), radial(arm, 0.02), release(arm), arc(arm), arc(arm, -0.002)]


def classify(arm: SphericalArm, path: StretchPath, tolerance: float = 1e-6) -> str:
    """Return "passes", "reflects" or "stalls": what eqs (1)-(3) do on `path`, from r(s) alone.

    tolerance [m]: how near to the edge counts as touching it.
    """
    check_arm(arm), check_path(path), finite_number("tolerance", tolerance, 0.0)
    s = np.linspace(0.0, path.length, 2001)
    r = path.distance(s) - arm.reach
    top = int(np.argmax(r))
    if r[top] < -tolerance:
        return "passes"
    inside = 0 < top < len(s) - 1
    return "stalls" if inside and r[top] <= tolerance else "reflects"


def start(arm: SphericalArm, path: StretchPath, branch: int = 1) -> np.ndarray:
    """Return q (7,) [rad] at the path's beginning, joint 3 at zero, with the elbow on the side `branch`, 1 or -1.

    Raises InvalidType or InvalidValue for a path that begins out of reach, and another branch.
    """
    q4 = first_elbow(arm, path)
    if isinstance(branch, bool) or not isinstance(branch, int) or branch not in (1, -1):
        raise InvalidValue("branch", branch, "a branch of 1 or -1")
    (along, across, _, _), q4 = path.plane(0.0), branch * q4
    alpha = math.atan2(arm.lower * math.sin(q4), arm.upper + arm.lower * math.cos(q4))
    return np.array([0.0, POLAR + math.atan2(across, along) - alpha, 0.0, q4, *HAND])


def first_elbow(arm: SphericalArm, path: StretchPath) -> float:
    """Return the elbow's angle |q4| [rad] at the path's beginning, or raise InvalidValue where that is out of reach."""
    check_arm(arm)
    r = math.hypot(*check_path(path).plane(0.0)[:2])
    cosine = arm.elbow_cosine(r)
    if not -1.0 < cosine <= 1.0:
        raise InvalidValue("path", path.name, f"a beginning within reach, {arm.reach:g} m")
    return math.acos(cosine)


def frame(arm: SphericalArm) -> np.ndarray:
    """Return the directions (3, 2) of along and across in the anchor's axes."""
    sin, cos = math.sin(POLAR), math.cos(POLAR)
    return np.array([[sin, cos], [0.0, 0.0], [cos, -sin]])


def references(arm: SphericalArm, path: StretchPath, q: np.ndarray):
    """Return tip: s -> place (3,) [m], direction (3,), for an arm that begins at q; and the tip's rotation (3, 3)."""
    here: pin.SE3 = check_arm(arm).forward(q)
    check_path(path)
    axes, origin = frame(arm), here.translation - frame(arm) @ np.array(path.plane(0.0)[:2])

    def tip(s: float) -> tuple[np.ndarray, np.ndarray]:
        x, y, u, v = path.plane(s)
        return origin + axes @ np.array([x, y]), axes @ np.array([u, v])

    return tip, here.rotation


def check_path(path: StretchPath) -> StretchPath:
    """Return the path, or raise InvalidType."""
    if not isinstance(path, StretchPath):
        raise InvalidType("path", path, "a StretchPath")
    return path


def _length(argument: str, value: float, high: float = FARTHEST) -> float:
    return finite_number(argument, value, 0.0, high, above=True)
