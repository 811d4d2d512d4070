"""Way points of the passage -> legs: where base, hand and door go in each phase, checked before anything moves.

Way points near the door's free edge are given from that edge, in the panel's frame: along the panel beyond the edge,
and across it (the side from which the robot comes is negative). Those in the doorway are in the world.

The base's yaw and the arm's first joint turn about the same line, so the plan takes yaw 0 first; then the base turns as
joint 1 would, and joint 1 stays. In (b) it is eq (4) that moves the base.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from tutorialbot.errors import InvalidValue, finite_array, finite_number
from tutorialbot.ik import passage_clearance as clearance
from tutorialbot.ik import srs
from tutorialbot.ik.base_sharing import Shares, base_centre_velocity
from tutorialbot.ik.passage_connect import Free
from tutorialbot.ik.passage_legs import hand_pose
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT, PAD_BEHIND, PAD_RADIUS

DEG = np.pi / 180.0
SWIVELS = np.arange(-12, 12) * (np.pi / 12.0)
KEEP, KEEP_ITSELF, KEEP_LIMIT = 0.05, 0.03, 0.06  # of a plan: to door and frame, to itself [m], to joint limits [rad]
UPRIGHT = 0.5  # what a swivel of 1 rad costs, in rad of motion
MOST_STRETCHED, LEVEL = 0.97, 0.5  # wrist from shoulder, of the arm's reach; least level share of that line
GRACE = 0.005  # what a free motion may be nearer [m]: it begins and ends at KEEP
BACK, READY = 0.11, 0.20  # how far the hand is off what it takes or leaves; and before the first grasp [m]
REGULAR = 0.12  # |sin q2| and |sin q6|: away from the singularities of shoulder and wrist
SMOOTH = 0.5  # the most that a joint may go between two samples [rad]: more is a singularity passed closely
OFF = 0.12  # the base's first bit of way after it has leaned on the door [m]
SAMPLES = 13  # of a leg
FARTHEST, MOST_TURNED = 1e3, 1e3  # that a way point may be from what it is given from [m]; an angle [rad]
SAME = 1e-6  # nearer points are one and the same [m]


@dataclass(frozen=True)
class WayPoints:
    """All numbers of a passage that are not the door's. Lengths in m, angles in rad; pairs are (along, across) or x, y.

    start: base before the closed door; little: door angle of (b); wide: base at the end of (c); around: base on its way
    round the free edge in (d); lean: where the base's centre is from the corner that it leans on, off: which way it
    leaves it; pivots: turn of the hand about the knob at the start, after (b), at `wide`, at each point of `around`;
    hold: where the hand holds the panel from behind, along beyond the edge (negative), height, turn; aside, inside,
    through: base, in the world, on the way to the doorway, in it at the end of (g), behind it at the end of (h);
    nearly: door angle at the end of (h). Raises InvalidType or InvalidValue for what is no such number or pair, lengths
    beyond a kilometre, and two points in a row of `wide` and `around`, or of `aside` and `inside`, that are the same.
    """

    start: tuple[float, float] = (0.13, -0.62)
    little: float = 25.0 * DEG
    wide: tuple[float, float] = (0.33, -0.52)
    around: tuple[tuple[float, float], ...] = ((0.47, -0.25), (0.45, 0.08), (0.25, 0.28))
    lean: float = 49.0 * DEG
    pivots: tuple[float, ...] = (0.0, 5.0 * DEG, 20.0 * DEG, 45.0 * DEG, 60.0 * DEG, 60.0 * DEG)
    off: float = 80.0 * DEG
    hold: tuple[float, float, float] = (-0.45, 0.90, 0.0)
    aside: tuple[float, float] = (0.58, -0.38)
    inside: tuple[float, float] = (0.55, -0.12)
    through: tuple[float, float] = (0.53, 0.42)
    nearly: float = 30.0 * DEG

    def __post_init__(self):
        for name in ("start", "wide", "aside", "inside", "through"):
            _near(name, getattr(self, name), (2,))
        for name in ("little", "lean", "off", "nearly"):
            finite_number(name, getattr(self, name), -MOST_TURNED, MOST_TURNED)
        _near("hold", self.hold, (3,))
        around = _near("around", self.around, (-1, 2))
        if not len(around):
            raise InvalidValue("around", self.around, "at least one point")
        _near("pivots", self.pivots, (len(around) + 3,), MOST_TURNED)
        _apart("around", self.around, np.vstack([self.wide, around]), "wide")
        _apart("inside", self.inside, np.array([self.aside, self.inside]), "aside")


def _near(name: str, value, shape: tuple[int, ...], most: float = FARTHEST) -> np.ndarray:
    array = finite_array(name, value, shape)
    if np.abs(array).max(initial=0.0) > most:
        raise InvalidValue(name, value, f"numbers from {-most:g} to {most:g}")
    return array


def _apart(name: str, value, points: np.ndarray, before: str) -> None:
    if np.hypot(*np.diff(points, axis=0).T).min() < SAME:
        raise InvalidValue(name, value, f"no point twice in a row, counted from {before} = {tuple(points[0].tolist())}")


@dataclass(frozen=True)
class Option:
    """One way for the arm to do several hand paths: swivel, branch, roll, and joints of each path, (m, 7), yaw 0.

    effort [rad]: what the fastest joint goes in all, and something for an elbow that is not on top.
    """

    swivel: float
    branch: tuple[int, int]
    roll: float
    joints: tuple[np.ndarray, ...]
    effort: float


def opening_paths(door: ClosingDoor, way: WayPoints, opening: float) -> list[np.ndarray]:
    """Return samples (m, 8) of HAND, yaw 0, with the hand at the knob: grasp, b, c, d, e (lean), e (let go)."""
    edge, (_, across, up) = door.width, door.knob_in_panel
    knob = (door.knob_radius, across, up)
    s = np.linspace(0.0, 1.0, SAMPLES)
    start = np.array([edge + way.start[0], way.start[1]])
    little = _shared(door, way, start, s)
    arrived = clearance.in_panel(little[-1:, None, :2], little[-1:, 3])[0, 0]
    wide = np.array([edge + way.wide[0], way.wide[1]])
    theta = way.little + s * (opening - way.little)
    spread = to_world(arrived + s[:, None] * (wide - arrived), theta)
    wider = _path(spread, theta, way.pivots[1] + s * (way.pivots[2] - way.pivots[1]), knob)
    corners = np.array([way.wide, *way.around]) + [edge, 0.0]
    turned = spline_through(np.column_stack([corners, way.pivots[2:]]), 2 * SAMPLES - 1)
    round_ = _path(to_world(turned[:, :2], opening), opening, turned[:, 2], knob)
    contact = contact_point(door, way)
    leaned = _path(to_world(turned[-1, :2] + s[:, None] * (contact - turned[-1, :2]), opening), opening,
                   way.pivots[-1], knob)  # fmt: skip
    let_go = back_off(leaned[-1], "knob", BACK * s[: SAMPLES // 2 + 1] / s[SAMPLES // 2])
    grasp = back_off(little[0], "knob", READY * (1.0 - s))
    return [grasp, little, wider, round_, leaned, let_go]


def through_paths(door: ClosingDoor, way: WayPoints, opening: float) -> list[np.ndarray]:
    """Return samples (m, 8) of HAND, yaw 0, with the hand behind the panel: f (touch), g, h."""
    tilt = way.hold[2]
    across = door.thickness / 2 + PAD_RADIUS - PAD_BEHIND * np.cos(tilt)
    held = (door.width + way.hold[0], across, way.hold[1])
    s = np.linspace(0.0, 1.0, SAMPLES)
    contact = contact_point(door, way)
    off = contact + OFF * np.array([np.cos(way.off), np.sin(way.off)])
    leaves = [*to_world(np.array([contact, off]), opening), way.aside, way.inside]
    moved = _path(spline_through(np.array(leaves), 2 * SAMPLES - 1), opening, tilt, held)
    inside, through = np.array(way.inside), np.array(way.through)
    gone = _path(inside + s[:, None] * (through - inside), opening + s * (way.nearly - opening), tilt, held)
    touch = back_off(moved[0], "panel", BACK * (1.0 - s[::2]))
    return [touch, moved, gone]


def contact_point(door: ClosingDoor, way: WayPoints) -> np.ndarray:
    """Return where the base's centre is, in the panel's frame (2,) [m], while it leans on the free edge's corner."""
    corner = np.array([door.width, door.thickness / 2])
    return corner + clearance.BASE_RADIUS * np.array([np.cos(way.lean), np.sin(way.lean)])


def back_off(sample: np.ndarray, grip: str, away: np.ndarray) -> np.ndarray:
    """Return samples (m, 8) of HAND with the hand `away` (m,) [m] back along its own axis from `sample` (8,)."""
    path = np.tile(sample, (len(away), 1))
    side = 1.0 if grip == "knob" else -1.0
    path[:, 5] += side * away * np.sin(sample[4])
    path[:, 6] -= side * away * np.cos(sample[4])
    return path


def _shared(door: ClosingDoor, way: WayPoints, start: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Samples of phase (b): the base goes as eq (4) says, by K nu_ref of the tip."""
    shares, knob, pivot = Shares(), door.knob_in_panel, way.pivots[0] + s * (way.pivots[1] - way.pivots[0])
    theta = s * way.little
    turning = (way.pivots[1] - way.pivots[0]) - way.little  # of the hand, d/ds

    def rate(at: float, base: np.ndarray) -> np.ndarray:
        tip = to_world(knob[None, :2], at * way.little)[0]
        nu_ref = np.array([way.little * tip[1], -way.little * tip[0], 0.0, 0.0, 0.0, turning])
        return base_centre_velocity(shares.matrix @ nu_ref, tip, base)[:2]  # (4)

    base, step = [start], s[1] - s[0]
    for at in s[:-1]:
        k1 = rate(at, base[-1])
        k2 = rate(at + step / 2, base[-1] + step / 2 * k1)
        k3 = rate(at + step / 2, base[-1] + step / 2 * k2)
        base.append(base[-1] + step / 6 * (k1 + 2 * k2 + 2 * k3 + rate(at + step, base[-1] + step * k3)))
    return _path(np.array(base), theta, pivot, tuple(knob))


def _path(base: np.ndarray, theta, pivot, hand: tuple[float, float, float]) -> np.ndarray:
    path = np.zeros((len(base), 8))
    path[:, :2], path[:, 3], path[:, 4], path[:, 5:] = base, theta, pivot, hand
    return path


def to_world(points: np.ndarray, theta: float | np.ndarray) -> np.ndarray:
    """Return points (n, 2) [m] of the panel's frame in the world, at theta [rad] of shape () or (n,)."""
    return clearance.in_panel(points[:, None], np.broadcast_to(-np.asarray(theta), len(points)))[:, 0]


def spline_through(points: np.ndarray, count: int) -> np.ndarray:
    """Return `count` samples of a cubic spline through `points` (k, ...), as far apart in s as in the plane.

    Raises InvalidValue for two points in a row that are one and the same.
    """
    length = np.r_[0.0, np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))]
    if np.diff(length).min() < SAME:
        raise InvalidValue("points", points.tolist(), "no point twice in a row")
    return CubicSpline(length / length[-1], points)(np.linspace(0.0, 1.0, count))


def footprint(door: ClosingDoor, paths: list[np.ndarray], keep: float = KEEP) -> float:
    """Return by how much the base keeps more than `keep` [m] from door and frame along `paths`, < 0: less.

    Not counted is that it leans on the door: at one end of `paths`, without going back and forth.
    """
    path = np.vstack(paths)
    panel, frame = clearance.base_alone(door, path[:, 3], path[:, :2])
    near = panel < keep
    leans = panel.min() > -1e-6 and one_end(near, panel)
    return float(min(frame.min(), panel[~near].min(initial=np.inf) if leans else panel.min()) - keep)


def one_end(near: np.ndarray, panel: np.ndarray, slack: float = 1e-6) -> bool:
    """Whether `near` (n,) holds in one row at the end or at the start, where the distance (n,) [m] then only falls or
    only grows, but for `slack` [m] from one sample to the next.
    """
    if not near.any():
        return True
    first, last = int(np.argmax(near)), len(near) - 1 - int(np.argmax(near[::-1]))
    steps = np.diff(panel[first : last + 1])
    falls, grows = last == len(near) - 1 and (steps < slack).all(), first == 0 and (steps > -slack).all()
    return bool(near[first : last + 1].all() and (falls or grows))


def options(
    arm: SphericalArm, door: ClosingDoor, paths: list[np.ndarray], grip: str
) -> tuple[list[Option], str, float]:
    """Return all ways for the arm to do `paths` with one swivel and one branch, that of the least effort first.

    They keep KEEP to door and frame (the hand apart), KEEP_ITSELF and KEEP_LIMIT; joint 1 is left to the base's yaw.
    Where there are none, also the guard that stops the best, and its margin [m, rad]: "reach", "level" (the hand is
    straight above the shoulder), "clearance", "limits" (of joints, of their steps, near singularities).
    """
    path = np.vstack(paths)
    rotation, position = hand_pose(path, grip, 0.0)
    local = position - np.column_stack([path[:, :2], np.full(len(path), ANCHOR_HEIGHT)])
    stretched, level = _line(arm, rotation, local)
    for guard, margin in (("reach", (MOST_STRETCHED - stretched.max()) * arm.reach), ("level", level.min() - LEVEL)):
        if margin < 0.0:
            return [], guard, float(margin)
    distance = _distance(arm, door, path, srs.inverse(arm, rotation, local, SWIVELS[:, None])[0])
    safe = np.flatnonzero(distance > 0.0)
    if not len(safe):
        return [], "clearance", float(distance.max())
    found, best, ends = [], -np.inf, np.cumsum([len(p) for p in paths])[:-1]
    for roll in (0.0, np.pi):
        rotation = hand_pose(path, grip, roll)[0]
        for branch in srs.BRANCHES:
            q = np.unwrap(srs.inverse(arm, rotation, local, SWIVELS[safe, None], branch)[0], axis=1)
            margin = (np.array(arm.limits)[1:] - KEEP_LIMIT - np.abs(q[..., 1:])).min(axis=(1, 2))
            margin = np.minimum(margin, np.abs(np.sin(q[..., [1, 5]])).min(axis=(1, 2)) - REGULAR)
            steps = np.abs(np.diff(q, axis=1))
            margin = np.minimum(margin, SMOOTH - steps.max(axis=(1, 2)))
            best = max(best, margin.max())
            for k in np.flatnonzero(margin > 0.0):
                swivel = float(SWIVELS[safe[k]])
                effort = steps[k, :, 1:].max(axis=1).sum() + UPRIGHT * abs(swivel)
                found.append(Option(swivel, branch, roll, tuple(np.split(q[k], ends)), float(effort)))
    return sorted(found, key=lambda option: option.effort), "limits", float(best)


def free_of(arm: SphericalArm, door: ClosingDoor, theta: float, base: np.ndarray) -> Free:
    """Return what tells which postures (k, 7) are free, with the base at rest at base (3,) and the door at `theta`.

    Arm and hand keep nearly KEEP to door and frame, and KEEP_ITSELF; the base may lean on the door.
    """

    def free(q: np.ndarray) -> np.ndarray:
        far = clearance.measure(arm, door, np.full(len(q), theta), np.tile(base, (len(q), 1)), q)
        apart = np.minimum(far.panel[:, 1:], np.minimum(far.knob[:, 1:], far.frame[:, 1:])).min(axis=1)
        return (apart > KEEP - GRACE) & (far.itself > KEEP_ITSELF) & (far.deck > KEEP_ITSELF)

    return free


def _line(arm: SphericalArm, rotation: np.ndarray, local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far the wrist is from the shoulder, as a share of the reach (m,), and how much of that is level (m,)."""
    line = local - arm.tip_offset * rotation[:, :, 2] - np.array([0.0, 0.0, arm.base_offset])
    r = np.sqrt((line * line).sum(axis=1))
    return r / arm.reach, np.hypot(line[:, 0], line[:, 1]) / r


def _distance(arm: SphericalArm, door: ClosingDoor, path: np.ndarray, q: np.ndarray) -> np.ndarray:
    """By how much each swivel keeps its distances along `path` (m, 8), the least (k,) [m]; q (k, m, 7)."""
    k, m, _ = q.shape
    base, theta = np.tile(np.column_stack([path[:, :2], np.zeros(m)]), (k, 1)), np.tile(path[:, 3], k)
    far = clearance.measure(arm, door, theta, base, q.reshape(-1, 7))
    apart = np.minimum(np.minimum(far.panel[:, 1:3], far.knob[:, 1:3]).min(axis=1), far.frame[:, 1:].min(axis=1))
    apart = np.minimum(apart - KEEP, np.minimum(far.itself, far.deck) - KEEP_ITSELF)
    return np.minimum(apart, far.panel[:, 3] - 0.01).reshape(k, m).min(axis=1)
