"""What changes with one joint more: the exact C-space of a third bar on the arm, 72^3 cells at 5 degrees.

The third bar is like the others, joined at the second one's end, beside it in the next slab along y, so that the arm
still cannot meet itself. A grid has cells^joints cells, and so have a map, a wavefront and the output of a decoder like
that of paper 3; a test of one state costs just one bar more. That is why maps of the whole C-space end at three or four
joints, and why a predictor that looks at single postures (the link-frame one) does not.
"""

from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidValue, finite_array
from tutorialbot.vox2c import kernels
from tutorialbot.vox2c.arm import BAR, ELBOW, JOINT_1, OFFSET, SLABS
from tutorialbot.vox2c.kernels import compiled
from tutorialbot.vox2c.labels import cells, exact_cspace
from tutorialbot.vox2c.scenes import BoxScene

SLAB = (SLABS[1][0] + OFFSET, SLABS[1][1] + OFFSET)  # where the third bar lies along y [m]
BYTES = 1  # of a cell


@compiled
def _bar_table(rectangles, x, z, sines, cosines, bar):
    """Return for each direction (n,) of a bar from (x, z) whether it meets one of the rectangles."""
    found = np.zeros(len(sines), dtype=np.bool_)
    for r in range(len(rectangles)):
        for i in range(len(sines)):
            if not found[i]:
                found[i] = kernels.meets(rectangles[r, 0] - x, rectangles[r, 1] - z, rectangles[r, 2],
                                          rectangles[r, 3], sines[i], cosines[i], bar)  # fmt: skip
    return found


@compiled
def _third(plane, rectangles, sines, cosines, bar):
    """Add the third bar to the C-space (n, n) of two: bool (n, n, n).

    Its own angle is theta1 + theta2 + theta3. Where the first two collide already, all theta3 do.
    """
    n = len(plane)
    found = np.zeros((n, n, n), dtype=np.bool_)
    for i in range(n):
        x, z = bar[0] * sines[i], bar[0] * cosines[i]
        for j in range(n):
            if plane[i, j]:
                found[i, j] = True
                continue
            k = (i + j - n // 2) % n  # the cell of theta1 + theta2: both start at -180 degrees
            table = _bar_table(rectangles, x + bar[0] * sines[k], z + bar[0] * cosines[k], sines, cosines, bar)
            for m in range(n):
                found[i, j, m] = table[(k + m - n // 2) % n]
    return found


def exact_cspace_3(scene: BoxScene, resolution_deg: float = 5) -> np.ndarray:
    """Return the exact C-space of the arm with three bars, bool (n, n, n): theta1, theta2, theta3, True = collision.

    Cell k of each axis is the angle -180 + k * resolution_deg degrees; theta3 is relative to the second bar. n must be
    even. Raises InvalidValue when the resolution does not divide 180 degrees.
    """
    n = cells(resolution_deg)
    if n % 2:
        raise InvalidValue("resolution_deg", resolution_deg, "a number of degrees that divides 180")
    plane, (sines, cosines) = exact_cspace(scene, resolution_deg), _directions(n)
    return _third(plane, _rectangles(scene), sines, cosines, BAR)


def collides_3(scene: BoxScene, q) -> np.ndarray:
    """Return for each configuration of q (k, 3) [rad] whether the arm with three bars collides, bool (k,)."""
    q = finite_array("q", q, (-1, 3))
    angles, (x, _, z) = np.cumsum(q, axis=1), JOINT_1
    found = np.zeros(len(q), dtype=bool)
    for i, (a, b, c) in enumerate(angles):
        joint = np.zeros(2)
        for slab, angle in zip((*SLABS, SLAB), (a, b, c), strict=True):
            direction = np.array([np.sin(angle)]), np.array([np.cos(angle)])
            rectangles = kernels.rectangles(*scene.corners, *slab, x, z)
            found[i] |= _bar_table(rectangles, *joint, *direction, BAR)[0]
            joint = joint + ELBOW * np.concatenate(direction)
    return found


def _directions(n: int) -> tuple[np.ndarray, np.ndarray]:
    theta = 2 * np.pi * (np.arange(n) / n - 0.5)
    return np.sin(theta), np.cos(theta)


def _rectangles(scene: BoxScene) -> np.ndarray:
    return kernels.rectangles(*scene.corners, *SLAB, JOINT_1[0], JOINT_1[2])


@dataclass(frozen=True)
class Size:
    """How large a dense map of so many joints is: cells, and bytes at one byte a cell."""

    joints: int
    resolution_deg: float
    cells: int

    @property
    def gigabytes(self) -> float:
        """Memory of the map."""
        return self.cells * BYTES / 1e9


def map_sizes(resolution_deg: float = 5, joints=(2, 3, 4, 5, 6, 7)) -> list[Size]:
    """Return how a dense map grows with the joints: cells^joints."""
    return [Size(n, resolution_deg, cells(resolution_deg) ** n) for n in joints]
