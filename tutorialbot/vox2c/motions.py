"""Straight motions of both joints, tested: on a map of the C-space, and against solids so finely that it is a proof.

How far can a point of the arm move while the joints turn by (d1, d2)? Its path is at most `travel` long. So a motion is
cut into steps of at most STEP, and each step is tested with bars that are MARGIN = STEP / 2 thicker all round. Wherever
the arm is between two steps, each of its points is within MARGIN of where it is at the nearer one, so it lies inside
the thicker bar there: when the steps are free, the whole motion is. (Testing the true bars at the steps alone would
miss what is grazed in between.)

Steps that cannot collide are passed over: no point gets farther than `travel`, so as long as that is less than the
clearance that was found at an earlier step, there is nothing to test. The answer is the same as testing every step.
"""

import math
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import finite_array
from tutorialbot.vox2c import kernels, labels
from tutorialbot.vox2c.arm import BAR, JOINT_1, SLABS, configurations
from tutorialbot.vox2c.kernels import compiled
from tutorialbot.vox2c.scenes import BoxScene

STEP = 0.002  # no point of the arm moves more than this between two tests of a verification [m]
MARGIN = STEP / 2  # what verification keeps clear around the bars [m]
GROWN = (BAR[0], BAR[1], BAR[2] + MARGIN, BAR[3] + MARGIN)
SEARCH_STEP = math.radians(1.0)  # either joint turns by at most this between two tests while planners search


# -- on the torus ----------------------------------------------------------------------------------------------------


@compiled
def turn(start, end):
    """Return the shorter way from one angle to another, in [-pi, pi): from 179 to -179 degrees it is 2 degrees."""
    return (end - start + math.pi) % (2.0 * math.pi) - math.pi


def wrap(q: np.ndarray) -> np.ndarray:
    """Return angles in [-pi, pi)."""
    return (np.asarray(q, dtype=float) + np.pi) % (2 * np.pi) - np.pi


def distance(a, b) -> float:
    """Return how far apart two configurations (2,) are on the torus [rad]: Euclidean, each joint the shorter way."""
    return float(np.linalg.norm(wrap(np.subtract(b, a))))


def continuous(path: np.ndarray) -> np.ndarray:
    """Return a path (k, 2) whose angles go on beyond +-pi instead of jumping, each step the shorter way."""
    path = np.asarray(path, dtype=float).reshape(-1, 2)
    return np.concatenate([path[:1], path[:1] + np.cumsum(wrap(np.diff(path, axis=0)), axis=0)])


def length(path: np.ndarray) -> float:
    """Return the length of a continuous path (k, 2) [rad]."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


@compiled
def travel(delta1, delta2, bar):
    """Return how far [m] any point of the arm moves at most while its joints turn evenly by so much [rad].

    Link 2 turns by delta1 about joint 1. Link 3 is carried by the elbow and turns by delta1 + delta2 about it.
    """
    reach = math.hypot(bar[1] + bar[2], bar[3])
    return max(reach * abs(delta1), bar[0] * abs(delta1) + reach * abs(delta1 + delta2))


def densify(path: np.ndarray, longest: float = STEP) -> tuple[np.ndarray, np.ndarray]:
    """Return points (m, 2) along a continuous path, no point of the arm moving more than `longest` [m] between them,
    and the number (m,) of the piece that each lies on.
    """
    points, pieces = [path[:1]], [np.zeros(1, dtype=int)]
    for i, (a, b) in enumerate(zip(path[:-1], path[1:], strict=True)):
        n = max(1, math.ceil(travel(*(b - a), GROWN) / longest))
        points.append(a + np.arange(1, n + 1)[:, None] / n * (b - a))
        pieces.append(np.full(n, i))
    return np.concatenate(points), np.concatenate(pieces)


# -- on a map --------------------------------------------------------------------------------------------------------


@compiled
def cell(angle, n):
    """Return the number of the cell whose angle is nearest."""
    return int(math.floor((angle + math.pi) * n / (2.0 * math.pi) + 0.5)) % n


@compiled
def map_blocks(cspace, theta1, theta2):
    """Say whether the nearest cell of a C-space (n, n) is blocked."""
    n = len(cspace)
    return cspace[cell(theta1, n), cell(theta2, n)]


@compiled
def map_blocks_motion(cspace, a1, a2, b1, b2, step):
    """Say whether a straight motion from (a1, a2) to (b1, b2) meets a blocked cell, looked at every `step` [rad]."""
    delta1, delta2 = turn(a1, b1), turn(a2, b2)
    n = max(1, math.ceil(max(abs(delta1), abs(delta2)) / step))
    for i in range(n, -1, -1):  # noqa: SIM110 - compiled as it stands
        if map_blocks(cspace, a1 + delta1 * i / n, a2 + delta2 * i / n):
            return True
    return False


# -- against solids --------------------------------------------------------------------------------------------------


@compiled
def _gap(x, z, half_x, half_z, s, c, bar):
    """Return a lower bound of the distance [m] between a bar of direction (s, c) from the origin and a rectangle.

    The widest gap along the four separating axes; negative exactly when they collide.
    """
    x -= bar[1] * s
    z -= bar[1] * c
    a, b = abs(s), abs(c)
    return max(
        abs(x * c - z * s) - (bar[3] + half_x * b + half_z * a),
        abs(x * s + z * c) - (bar[2] + half_x * a + half_z * b),
        abs(x) - (half_x + bar[2] * a + bar[3] * b),
        abs(z) - (half_z + bar[2] * b + bar[3] * a),
    )


@compiled
def clearance(second, third, theta1, theta2, bar):
    """Return a lower bound of the distance [m] from the arm to the rectangles; negative exactly when they collide."""
    least = np.inf
    s, c = math.sin(theta1), math.cos(theta1)
    for r in range(len(second)):
        least = min(least, _gap(second[r, 0], second[r, 1], second[r, 2], second[r, 3], s, c, bar))
    x, z = bar[0] * s, bar[0] * c
    s, c = math.sin(theta1 + theta2), math.cos(theta1 + theta2)
    for r in range(len(third)):
        least = min(least, _gap(third[r, 0] - x, third[r, 1] - z, third[r, 2], third[r, 3], s, c, bar))
    return least


@compiled
def _steps_collide(second, third, a1, a2, delta1, delta2, n, bar):
    """Say whether the arm collides at one of the n + 1 steps of a motion; passes over what is within the clearance."""
    step = travel(delta1, delta2, bar) / n
    i = 0
    while i <= n:
        gap = clearance(second, third, a1 + delta1 * i / n, a2 + delta2 * i / n, bar)
        if gap < 0.0:
            return True
        if gap > (n - i) * step:
            return False
        i += max(1, int(gap / step))
    return False


@compiled
def motion_collides(second, third, a1, a2, b1, b2, step, bar):
    """Say whether a motion collides, tested every `step` [rad] of the joint that turns more; for searches."""
    delta1, delta2 = turn(a1, b1), turn(a2, b2)
    n = max(1, math.ceil(max(abs(delta1), abs(delta2)) / step))
    return _steps_collide(second, third, a1, a2, delta1, delta2, n, bar)


@compiled
def motion_touches(second, third, a1, a2, b1, b2, longest, bar):
    """Say whether a motion collides, tested so finely that no point moves more than `longest` [m]; to verify."""
    delta1, delta2 = turn(a1, b1), turn(a2, b2)
    n = max(1, math.ceil(travel(delta1, delta2, bar) / longest))
    return _steps_collide(second, third, a1, a2, delta1, delta2, n, bar)


@compiled
def path_touches(second, third, path, longest, bar):
    """Say whether one of the motions along a path (k, 2) collides, as `motion_touches` does."""
    for i in range(len(path) - 1):
        if motion_touches(second, third, path[i, 0], path[i, 1], path[i + 1, 0], path[i + 1, 1], longest, bar):
            return True
    return False


@dataclass(frozen=True, eq=False)
class Solid:
    """What the arm must not touch, "boxes" or "voxels": rectangles (k, 4) in the slabs of link 2 and of link 3."""

    name: str
    second: np.ndarray
    third: np.ndarray

    def collides(self, q) -> np.ndarray:
        """Return for each configuration (k, 2) [rad] whether the arm collides, bool (k,)."""
        return kernels.collide(self.second, self.third, configurations(q), BAR)

    def too_near(self, q) -> np.ndarray:
        """Return for each configuration (k, 2) [rad] whether the arm is within MARGIN of a collision, bool (k,)."""
        return kernels.collide(self.second, self.third, configurations(q), GROWN)

    def free(self, path) -> bool:
        """Say whether the arm moves along a path (k, 2) [rad] without touching anything, each step the shorter way.

        A proof: MARGIN stays clear at steps so fine that no point moves more than STEP. Raises InvalidType or
        InvalidValue for what is no path, NaN and infinity.
        """
        path = finite_array("path", path, (-1, 2))
        if len(path) == 1:
            return not self.too_near(path)[0]
        return not path_touches(self.second, self.third, path, STEP, GROWN)


def boxes(scene: BoxScene) -> Solid:
    """Return the boxes of a scene as what paths are verified against."""
    x, _, z = JOINT_1
    return Solid("boxes", *(kernels.rectangles(*scene.corners, *slab, x, z) for slab in SLABS))


def voxels(grid: np.ndarray) -> Solid:
    """Return the occupied voxels of a grid (n, n, n) as what paths are verified against."""
    return Solid("voxels", *labels.voxel_rectangles(labels.check_voxels(grid)))
