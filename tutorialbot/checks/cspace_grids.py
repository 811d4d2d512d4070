"""Exercises 2 to 4 of notebook 3: rectangles that meet, a link's own angle, and points sorted into voxels.

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
SLACK = 200  # steps of Python by which many may differ from few


def truths(answer: Any, shape: tuple[int, ...], inputs: tuple) -> np.ndarray:
    """Return the answer as a bool array of `shape`; raises Wrong by "shape of the answer" or "yes or no"."""
    array = numbers(answer, shape, inputs)
    if not ((array == 0.0) | (array == 1.0)).all():
        raise Wrong("yes or no", f"the answer holds {show(array)}: True and False are asked for{case(inputs)}")
    return array == 1.0


def alike(check: str, answer: np.ndarray, expected: np.ndarray, inputs: tuple, reason: str) -> None:
    """Raise Wrong by `check` when two bool arrays differ; it says where first, and in how many places."""
    wrong = np.argwhere(answer != expected)
    if len(wrong):
        place = tuple(wrong[0].tolist())
        told = f"at {list(place)} yours is {answer[place]}, expected {expected[place]}"
        raise Wrong(check, f"{reason}\n{told}; {len(wrong)} of {expected.size} are wrong{case(inputs)}")


def all_at_once(counts: list[tuple[int, int]], what: str, why: str) -> None:
    """Raise Wrong by "all at once" when the steps of Python grew with the size; counts: (size, steps), few and many."""
    (few, before), (many, after) = counts
    if after > before + SLACK:
        raise Wrong(
            "all at once",
            f"{few} {what} took {before} steps of Python, {many} took {after}: somewhere a loop runs over them. {why}",
        )


# --- 2 ----------------------------------------------------------------------------------------------------------------
TOUCH = 1e-9  # rectangles that overlap by less do but touch [m]
NEAR = 1e-5  # drawn pairs that are nearer to touching than this are drawn again [m]


def overlap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how far [m] a must be shifted to touch b only, in the best of four directions, (n,); negative: apart."""

    def corners(rectangle: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Corners (4, n) as complex numbers z + i x, as seen by somebody who is turned by `angle`."""
        x, z, long, wide, own = rectangle.T
        spread = [s * long + 1j * t * wide for s in (-1, 1) for t in (-1, 1)]
        return (z + 1j * x + np.array(spread) * np.exp(1j * own)) * np.exp(-1j * angle)

    found = []
    for angle in (a[:, 4], b[:, 4]):
        p, q = corners(a, angle), corners(b, angle)
        for part in (np.real, np.imag):
            found += [part(p).max(axis=0) - part(q).min(axis=0), part(q).max(axis=0) - part(p).min(axis=0)]
    return np.min(found, axis=0)


def _draw(rng: np.random.Generator, n: int, turns: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return n pairs (n, 5) of which none nearly touches, each turned by up to so much [rad]."""
    found, missing = np.empty((2, n, 5)), np.ones(n, dtype=bool)
    while missing.any():
        low, high = np.array([[-0.3, -0.3, 0.02, 0.02, 0.0], [0.3, 0.3, 0.3, 0.1, 0.0]])
        for rectangle, turn in zip(found, turns, strict=True):
            rectangle[missing] = rng.uniform(low, high, (missing.sum(), 5))
            rectangle[missing, 4] = rng.uniform(-turn, turn, missing.sum())
        missing = np.abs(overlap(*found)) < NEAR
    return found[0], found[1]


def _touching(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return n pairs side by side on a face of the first one, turned as one: they touch, but for rounding."""
    a, _ = _draw(rng, n, (3.0, 0.0))
    b = a.copy()
    b[:, 2:4] = rng.uniform(0.02, 0.1, (n, 2))
    shift = (a[:, 2] + b[:, 2] + 1j * rng.uniform(-0.03, 0.03, n)) * np.exp(1j * a[:, 4])
    b[:, 0] += shift.imag
    b[:, 1] += shift.real
    return a, b


def _judge_rectangles(student: Student) -> None:
    rng, full = make_rng(SEED, 2), np.pi

    def trial(check: str, reason: str, a: np.ndarray, b: np.ndarray) -> int:
        inputs = (a, b)
        n = max(len(a), len(b)) if len(a) and len(b) else 0
        expected = overlap(*(np.broadcast_to(r, (n, 5)) for r in inputs)) > TOUCH
        answer, steps = lines_run(lambda: student(*inputs))
        answer = truths(answer, (n,), inputs)
        for i in np.flatnonzero(answer != expected):
            own = [r[min(int(i), len(r) - 1)] for r in inputs]
            told = f"yours {answer[i]}, expected {expected[i]} for the pair {show(own[0])}, {show(own[1])}"
            raise Wrong(check, f"{reason}\n{told}")
        return steps

    reason = "Not turned, they meet where their intervals in x and in z both overlap; the sizes are HALF the sides."
    trial("not turned", reason, *_draw(rng, 200, (0.0, 0.0)))
    reason = "At angle 0 the first half side points along +z, and a positive angle turns it toward +x, as with the arm."
    trial("one turned", reason, *_draw(rng, 200, (full, 0.0)))
    trial("one turned", reason, *_draw(rng, 200, (0.0, full)))
    cross = np.array([[0.1, 0.2, 0.25, 0.025, 0.3]]), np.array([[0.1, 0.2, 0.025, 0.25, 0.3]])
    trial("a cross", "Two bars that cross have no corner inside each other, and meet.", *cross)
    reason = "Both are turned: the gap may show on the directions of either."
    trial("both turned", reason, *_draw(rng, 2000, (full, full)))
    reason = f"They do but touch when they overlap by less than {TOUCH:g} m: rounding decides nothing."
    for n in (1, 200):
        trial("touching", reason, *_touching(rng, n))
    a, b = _draw(rng, 400, (full, full))
    a[:200, 3] = b[100:300, 3] = b[300:, 2] = b[350:, 3] = 0.0
    near = np.abs(overlap(a, b)) < NEAR
    reason = "Without width it is a line, without both half sides a point: these meet what they pass through inside."
    trial("lines and points", reason, a[~near], b[~near])
    a, b = _draw(rng, 30, (full, full))
    for one, other in ((a[:1], b), (a, b[:1]), (a[:0], b[:0])):
        trial("one for all", "A single rectangle serves all of the other side; none have none.", one, other)
    counts = [(n, trial("both turned", reason, *_draw(rng, n, (full, full)))) for n in (40, 2000)]
    all_at_once(counts, "pairs", "A map at 1 degree has 129,600 postures.")


turned_rectangles_meet = Exercise(
    "turned_rectangles_meet",
    "do two rectangles meet that are both turned? Many pairs at once.",
    (
        "Separating axes: they are apart exactly if their shadows on one of four directions are. Which four are there"
        " when both are turned?",
        "Along = (sin angle, cos angle), across = (cos angle, -sin angle), as arrays (n,). Half the shadow of a"
        " rectangle on an axis: half side times |along . axis| plus half side times |across . axis|.",
        "Only the difference of the two angles matters for these products: |cos| and |sin| of it. Apart if"
        " |centres apart . axis| > both half shadows - 1e-9, on any of the four.",
    ),
    _judge_rectangles,
    limit=30.0,
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
        alike(check, truths(answer, expected.shape, inputs), expected, inputs, reason)
        return steps

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
        alike(check, truths(answer, shape, inputs), expected, inputs, reason)
        return steps

    def within(n: int, low=corner, side=side, shape=shape) -> np.ndarray:
        """Points off the borders, of which some are not in the grid at all."""
        return low + side * (rng.integers(-2, np.array(shape) + 2, (n, 3)) + rng.uniform(0.01, 0.99, (n, 3)))

    reason = "Axes x, y, z, counted from the low corner, in voxels of `side`."
    trial("one point", reason, corner + side * np.array([4.5, 1.5, 2.5]))
    reason = "What lies outside is in no voxel: not in one at the border, nor in one at the other end."
    for axis in range(3):
        for off in (-0.25, -1.5, shape[axis] + 0.25, 1e6, -1e6):
            trial("outside", reason, corner + side * np.where(np.arange(3) == axis, off, 2.5))
    reason = "A point on a border belongs to the voxel above it; one on the grid's upper face is outside."
    for axis in range(3):
        for border in (0, 1, 3, shape[axis]):
            trial("borders", reason, corner + side * np.where(np.arange(3) == axis, border, 2.5))
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
