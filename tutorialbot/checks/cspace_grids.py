"""Exercises 3 and 4 of notebook 3: a link's own angle, and points sorted into voxels; and what checks of grids share.

The references are written here once more, by other formulas than the package's own, so that neither vouches for itself.
"""

from typing import Any

import numpy as np

from tutorialbot.checks.counting import lines_run
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, numbers
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import labels
from tutorialbot.vox2c.arm import SLABS
from tutorialbot.vox2c.scenes import BoxScene, random_scene

SEED = 3
HAIR = 1e-9  # of a voxel's side
SLACK = 200  # steps of Python by which many may differ from few


def truths(answer: Any, shape: tuple[int, ...], inputs: tuple) -> np.ndarray:
    """Return the answer as a bool array of `shape`; raises Wrong by "shape of the answer" or "yes or no"."""
    array = numbers(answer, shape, inputs)
    wrong = (array != 0.0) & (array != 1.0)
    if wrong.any():
        raise Wrong(
            "yes or no", f"the answer holds {show(array[wrong][0])}: True and False are asked for{case(inputs)}"
        )
    return array == 1.0


def alike(check: str, answer: np.ndarray, expected: np.ndarray, reason: str, about: str) -> None:
    """Raise Wrong by `check` when two bool arrays differ; it says where first, and what the case is `about`."""
    wrong = np.argwhere(answer != expected)
    if len(wrong):
        place = tuple(wrong[0].tolist())
        told = f"at {list(place)} yours is {answer[place]}, expected {expected[place]}"
        raise Wrong(check, f"{reason}\n{told}; {len(wrong)} of {expected.size} are wrong{about}")


def all_at_once(counts: list[tuple[int, int]], what: str, why: str) -> None:
    """Raise Wrong by "all at once" when the steps of Python grew with the size; counts: (size, steps), few and many."""
    (few, before), (many, after) = counts
    if after > before + SLACK:
        raise Wrong(
            "all at once",
            f"{few} {what} took {before} steps of Python, {many} took {after}: somewhere a loop runs over them. {why}",
        )


# --- 3 ----------------------------------------------------------------------------------------------------------------
def own_angles(second: np.ndarray, third: np.ndarray) -> np.ndarray:
    """Return the C-space (n, n), row by row: as theta1 grows, link 3's hits move to smaller theta2."""
    n, m = third.shape
    shift = m // 2 - np.arange(n) * (m // n)
    rows = [np.roll(row, s)[:: m // n] for row, s in zip(third, shift, strict=True)]
    return np.array([row | hit for row, hit in zip(rows, second, strict=True)])


def _arm_cases() -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return second, third and the C-space of true scenes, of which no box reaches into both slabs."""
    found = []
    for seed, n in ((58, 36), (61, 72), (81, 72)):
        boxes = random_scene(seed, 60).boxes
        low, high = boxes[:, 1] - boxes[:, 4] / 2, boxes[:, 1] + boxes[:, 4] / 2
        only = [BoxScene(boxes[high <= SLABS[0][1]]), BoxScene(boxes[low >= SLABS[1][0]])]
        theta1, phi = np.meshgrid(labels.angles(360 / n), labels.angles(180 / n), indexing="ij")
        second = labels.exact_cspace(only[0], 360 / n)[:, 0]
        third = labels.collides(only[1], np.stack([theta1, phi - theta1], axis=-1).reshape(-1, 2)).reshape(n, 2 * n)
        both = BoxScene(np.vstack([scene.boxes for scene in only]))
        found.append((second, third, labels.exact_cspace(both, 360 / n)))
    return found


def _judge_own_angles(student: Student) -> None:
    rng = make_rng(SEED, 3)

    def trial(check: str, reason: str, second: np.ndarray, third: np.ndarray, expected=None) -> int:
        inputs = (second, third)
        expected = own_angles(*inputs) if expected is None else expected
        answer, steps = lines_run(lambda: student(*inputs))
        about = "\nfor n = {} and m = {}; link 2 hits at {}, link 3 at {}".format(
            *third.shape, first(second), first(third)
        )
        alike(check, truths(answer, expected.shape, inputs), expected, reason, about)
        return steps

    def first(found: np.ndarray) -> str:
        """Up to six cells, the first ones."""
        cells = np.argwhere(found)
        return (
            f"{[cell[0] if len(cell) == 1 else cell for cell in cells[:6].tolist()]}{' ...' if len(cells) > 6 else ''}"
        )

    def hits(n: int, m: int, cells: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
        third = np.zeros((n, m), dtype=bool)
        third[tuple(np.transpose(cells))] = True
        return np.zeros(n, dtype=bool), third

    reason = "Where link 2 hits, it hits whatever theta2 is: a whole row of the map."
    trial("rows", reason, np.arange(12) % 5 == 1, np.zeros((12, 12), dtype=bool))
    reason = "Straight up, theta1, theta2 and phi are all 0: cell 18 of 36 in all three, though 18 + 18 is 36."
    trial("half a turn", reason, *hits(36, 36, [(18, 18)]))
    reason = "phi = theta1 + theta2: at a larger theta1 the same phi is found at a smaller theta2."
    trial("own angle", reason, *hits(36, 36, [(3, 20), (10, 20), (17, 20)]))
    reason = "Both angles go round: beyond 180 degrees the map goes on at -180."
    trial("round the seam", reason, *hits(36, 36, [(0, 0), (35, 35), (35, 0), (20, 1), (2, 34)]))
    reason = "phi may have finer steps than theta1: the map takes every (m / n)-th of them."
    for n, m in ((12, 24), (45, 90), (9, 54)):
        trial("finer phi", reason, *hits(n, m, [(i, j) for i in range(0, n, 4) for j in range(i % 3, m, 7)]))
    reason = "True is a collision of link 2, or of link 3, or of both."
    for n, m in ((1, 2), (2, 2), (24, 24), (15, 60), (360, 720)):
        trial("any map", reason, rng.random(n) < 0.3, rng.random((n, m)) < 0.4)
    for second, third, expected in _arm_cases():
        trial("at the arm", "Boxes that only one of both links can hit, and their C-space.", second, third, expected)
    counts = [(n, trial("any map", reason, rng.random(n) < 0.3, rng.random((n, n)) < 0.4)) for n in (36, 720)]
    all_at_once(counts, "rows", "An index array does for all cells what a loop does for one.")


from_own_angles = Exercise(
    "from_own_angles",
    "from link 3's hits over its own angle phi to the C-space over theta1 and theta2.",
    (
        "Cell i is theta1 = -180 + i s, cell k is theta2 = -180 + k s with s = 360 / n degrees. Which phi is that, and"
        " which cell of phi, when these are 360 / m degrees apart and cell 0 is -180?",
        "phi = -360 + (i + k) s; cell j is -180 + j 360 / m. So j = (i + k) m / n - m / 2, modulo m.",
        "`np.add.outer(i, k)` is a table of sums, and `third[i[:, None], j]` looks up a whole table of cells at once."
        " `second[:, None] |` puts link 2 in.",
    ),
    _judge_own_angles,
    limit=30.0,
)


# --- 4 ----------------------------------------------------------------------------------------------------------------
def voxel_counts(points: np.ndarray, low: np.ndarray, side: float, shape: tuple[int, ...]) -> np.ndarray:
    """Return how many points each voxel holds, by comparing with the voxels' faces."""
    counts, points = np.zeros(shape, dtype=int), points[np.isfinite(points).all(axis=1)]
    faces = [low[a] + side * np.arange(shape[a] + 1) for a in range(3)]
    cells = np.array([np.searchsorted(faces[a], points[:, a], side="right") - 1 for a in range(3)]).T
    for cell in cells[((cells >= 0) & (cells < shape)).all(axis=1)]:
        counts[tuple(cell)] += 1
    return counts


def _judge_voxels(student: Student) -> None:
    rng = make_rng(SEED, 4)
    corner, side, shape = np.array([-1.0, -0.5, 0.25]), 0.125, (6, 4, 5)  # such that borders are exact

    def trial(check: str, reason: str, points, least: int = 1, low=corner, side=side, shape=shape) -> int:
        inputs = (np.asarray(points, dtype=float).reshape(-1, 3), low, side, shape, least)
        expected = voxel_counts(*inputs[:4]) >= least
        answer, steps = lines_run(lambda: student(*inputs))
        alike(check, truths(answer, shape, inputs), expected, reason, case(inputs))
        return steps

    def within(n: int, low=corner, side=side, shape=shape) -> np.ndarray:
        """Points off the borders, of which some are not in the grid at all."""
        return low + side * (rng.integers(-2, np.array(shape) + 2, (n, 3)) + rng.uniform(0.01, 0.99, (n, 3)))

    reason = "Axes x, y, z, counted from the low corner, in voxels of `side`."
    trial("one point", reason, corner + side * np.array([4.5, 1.5, 2.5]))
    reason = "What lies outside is in no voxel: not in one at the border, nor in one at the other end."
    for axis in range(3):
        for off in (-0.25, -1.5, shape[axis] + 0.25, 1e6, -1e6, 2.0**8 + 2.5, 2.0**16 + 2.5, 2.0**32 + 2.5):
            trial("outside", reason, corner + side * np.where(np.arange(3) == axis, off, 2.5))
    reason = (
        "A point on a border belongs to the voxel above it; one on the grid's upper face is outside. A hair below the"
        " border it is the voxel below."
    )
    for axis in range(3):
        for border in (0, 1, 3, shape[axis]):
            for off in (0.0, -HAIR, HAIR):
                trial("borders", reason, corner + side * np.where(np.arange(3) == axis, border + off, 2.5))
    reason = "A pixel that sees nothing has no depth: rows of NaN or infinity are no points."
    for bad in (np.nan, np.inf, -np.inf):
        for place in range(3):
            points = within(6)
            points[3, place] = bad
            trial("no depth", reason, points)
    trial("no depth", reason, np.full((4, 3), np.nan))
    reason = "`least` points must lie in one voxel: noise makes single ones."
    some = np.repeat(corner + side * (np.array([[0, 0, 0], [1, 2, 3], [5, 3, 4]]) + 0.5), (1, 2, 3), axis=0)
    for least in (1, 2, 3, 4):
        trial("least", reason, some, least)
    reason = "A wall in front of the camera puts hundreds of points into one voxel: they must still be counted."
    many = np.repeat(corner + side * (np.array([[0, 0, 0], [1, 2, 3]]) + 0.5), (256, 130), axis=0)
    for least in (1, 130, 256, 257):
        trial("many points", reason, many, least)
    for _ in range(10):
        shape_ = tuple(int(n) for n in rng.integers(1, 9, 3))
        other = {"low": rng.uniform(-2.0, 2.0, 3), "side": float(rng.uniform(0.02, 0.3)), "shape": shape_}
        points = within(int(rng.integers(0, 300)), **other)
        trial("any grid", "Any corner, side and numbers of voxels, any number of points.", points, 2, **other)
    trial("any grid", "No points fill no voxel.", np.empty((0, 3)))
    counts = [(n, trial("any grid", reason, within(n), 2)) for n in (40, 2000)]
    all_at_once(counts, "points", "Four cameras send 76,800 points a picture.")


points_to_voxels = Exercise(
    "points_to_voxels",
    "which voxels hold at least so many points of a cloud that has borders, gaps and strays?",
    (
        "Where does (point - low) / side change from one voxel to the next? Between -1 and 0, `int` and `astype(int)`"
        " round up.",
        "np.floor, then a mask of rows that are finite and in the grid along all three axes; only then `astype(int)`.",
        "`grid[i, j, k] += 1` with arrays counts a voxel once, however often it is named. `np.add.at` does not, nor"
        " `np.bincount` of `np.ravel_multi_index`.",
    ),
    _judge_voxels,
    limit=30.0,
)
