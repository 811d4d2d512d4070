"""Plans on the torus of paper 3's arm: search on what a method takes for free, verify, repair (section 4.2.1).

The paper: a path on a predicted C-space may collide, so it must be checked, and where it collides, an existing planner
mends that part. So here: whatever the search says, a path is returned only when `motions.Solid.free` proves it free of
what it is verified against.

The planners are OMPL's (planning_ompl.py). Two are ours, for they need the whole C-space: see fields.py.
"""

import time
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidValue, finite_array, one_of, whole_number
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import fields, motions, planning_ompl
from tutorialbot.vox2c.arm import BAR
from tutorialbot.vox2c.methods import Prepared, prepare
from tutorialbot.vox2c.motions import GROWN, STEP, Solid, continuous, wrap
from tutorialbot.vox2c.scenes import BoxScene

PLANNERS = (*planning_ompl.PLANNERS, *fields.PLANNERS)
ITERATIONS = 10_000  # after so many a search gives up: no clock, so that the same seed gives the same path
ITERATIONS_STAR = 1_000  # RRT* uses all of its iterations to get shorter


@dataclass(frozen=True, eq=False)
class Plan:
    """What planning gave.

    path (k, 2) [rad]: from the start to the goal, angles continuous (they go on beyond +-pi instead of jumping, so the
    goal may be whole turns away); empty unless `solved`. collision_free: verified against what verify_against names.
    searched (k, 2): the path before verification; empty when the search found none. repairs: pieces that were planned
    again, -1 when the whole path was. reason: why it is not solved. seconds: CPU time of each stage, "sense" (voxels),
    "map" (prediction, map or octree), "search", "verify", "repair".
    """

    solved: bool
    path: np.ndarray
    collision_free: bool
    seconds: dict[str, float]
    searched: np.ndarray
    repairs: int
    reason: str
    method: str
    planner: str
    verify_against: str
    seed: int

    @property
    def total(self) -> float:
        """CPU time of all stages but "sense" [s]: what is seen is needed by every method."""
        return sum(seconds for stage, seconds in self.seconds.items() if stage != "sense")


NOWHERE = np.empty((0, 2))


def plan(
    scene: BoxScene, start, goal, *, method: str = "exact_map", seed: int, verify_against: str = "boxes",
    planner: str = "RRT", iterations: int | None = None, **options,
) -> Plan:  # fmt: skip
    """Plan a motion from `start` to `goal` (2,) [rad] in a scene; the same seed gives the same path.

    method: see methods.py; planner: one of PLANNERS; verify_against "boxes" (the truth) or "voxels" (what is known of
    it): a returned path never collides with that. Further options, as of `methods.prepare`: resolution_deg, source,
    size, voxels, predictor, threshold. A start or goal in collision, or no path found, is a result with a `reason`.

    Raises InvalidType or InvalidValue that names a wrong argument. Paper 3, section 4.2.
    """
    start, goal = _ends(start, goal)
    _check(planner, method, seed, iterations)
    prepared = prepare(scene, method=method, verify_against=verify_against, **options)
    return query(prepared, start, goal, seed=seed, planner=planner, iterations=iterations)


def query(
    prepared: Prepared, start, goal, *, seed: int, planner: str = "RRT", iterations: int | None = None
) -> Plan:  # fmt: skip
    """Plan in a scene that `methods.prepare` has prepared, as `plan` does: many queries share one map."""
    start, goal = _ends(start, goal)
    _check(planner, prepared.method, seed, iterations)
    solid, clock = prepared.solid, _Clock(prepared.seconds)
    reason = blocked_ends(solid, start, goal)
    if reason:
        return _plan(prepared, NOWHERE, clock, NOWHERE, 0, reason, planner, seed)
    searched = search(prepared, start, goal, planner, seed, iterations)
    clock.lap("search")
    free = len(searched) > 0 and solid.free(searched)
    clock.lap("verify")
    path, repairs = (searched, 0) if free else repair(solid, searched, start, goal, seed)
    clock.lap("repair")
    reason = "" if len(path) else f"no path found in {ITERATIONS} iterations"
    return _plan(prepared, path, clock, searched, repairs, reason, planner, seed)


def _plan(prepared, path, clock, searched, repairs, reason, planner, seed) -> Plan:
    solved = len(path) > 0
    return Plan(solved, path, solved, clock.seconds, searched, repairs, reason, prepared.method, planner,
                prepared.solid.name, seed)  # fmt: skip


class _Clock:
    """CPU time by stages."""

    def __init__(self, before: dict[str, float]):
        self.seconds = {"sense": 0.0, "map": 0.0, **before, "search": 0.0, "verify": 0.0, "repair": 0.0}
        self._began = time.process_time()

    def lap(self, stage: str) -> None:
        """Add what has passed since the last lap to a stage."""
        now = time.process_time()
        self.seconds[stage] += now - self._began
        self._began = now


def _ends(start, goal) -> tuple[np.ndarray, np.ndarray]:
    return wrap(finite_array("start", start, (2,))), wrap(finite_array("goal", goal, (2,)))


def _check(planner: str, method: str, seed: int, iterations: int | None) -> None:
    one_of("planner", planner, PLANNERS), whole_number("seed", seed)
    if iterations is not None:
        whole_number("iterations", iterations, 1)
    if planner == "PRM" and method == "octree":
        raise InvalidValue("planner", planner, "another planner or method: PRM asks for motions, an octree for states")


def blocked_ends(solid: Solid, start: np.ndarray, goal: np.ndarray) -> str:
    """Return which end is in collision, or nearer to one than verification allows; "" when neither is."""
    for name, q in (("start", start), ("goal", goal)):
        if motions.clearance(solid.second, solid.third, *q, BAR) < 0.0:
            return f"{name} in collision with the {solid.name}"
        if motions.clearance(solid.second, solid.third, *q, GROWN) < 0.0:
            return f"{name} closer than {1e3 * motions.MARGIN:g} mm to the {solid.name}"
    return ""


def search(prepared: Prepared, start, goal, planner: str, seed: int, iterations: int | None = None) -> np.ndarray:
    """Return a path (k, 2) that the method takes for free, not verified; (0, 2) when none is found."""
    cspace = prepared.cspace
    if planner in fields.PLANNERS and cspace is None:
        raise InvalidValue("planner", planner, f"a method that makes a whole C-space, not {prepared.method!r}")
    if planner == "potential":
        return fields.path(cspace, start, goal, planner)
    if planner == "wavefront":
        wide = fields.path(prepared.wide, start, goal, planner)
        return wide if len(wide) else fields.path(cspace, start, goal, planner)
    if motions.distance(start, goal) <= planning_ompl.RANGE and _straight(prepared, start, goal):
        return continuous([start, goal])
    if planner == "PRM":
        return planning_ompl.roadmap(prepared.state, prepared.motion, start, goal, seed, iterations or ITERATIONS)
    count = iterations or (ITERATIONS_STAR if planner == "RRTstar" else ITERATIONS)
    hopeless = None if cspace is None else lambda: not len(fields.path(cspace, start, goal))
    return planning_ompl.tree(prepared.state, prepared.motion, start, goal, planner, seed, count, hopeless)


def _straight(prepared: Prepared, start, goal) -> bool:
    """Say whether the method takes the straight way for free: within reach of one branch, a planner need not wander."""
    if prepared.motion is not None:
        return not prepared.motion(*start, *goal)
    points, _ = motions.densify(continuous([start, goal]))
    return not any(prepared.state(*q) for q in points)


# -- repair ----------------------------------------------------------------------------------------------------------


def repair(solid: Solid, path: np.ndarray, start, goal, seed: int) -> tuple[np.ndarray, int]:
    """Return a path that is free of `solid`, and how many pieces of `path` were planned anew (-1: all of it).

    Pieces first; when that fails, or the search found no path at all, from start to goal. (0, 2) when that fails too.
    """
    if len(path):
        mended, pieces = _mend(solid, path, seed)
        if len(mended) and solid.free(mended):
            return mended, pieces
    whole = connect(solid, start, goal, seed, 0)
    return (whole, -1) if len(whole) and solid.free(whole) else (NOWHERE, 0)


def connect(solid: Solid, start, goal, seed: int, piece: int) -> np.ndarray:
    """Plan with RRTConnect on the test that verification makes; (0, 2) when it finds nothing."""
    second, third, touches = solid.second, solid.third, motions.motion_touches
    return planning_ompl.tree(
        lambda a, b: touches(second, third, a, b, a, b, STEP, GROWN),
        lambda a1, a2, b1, b2: touches(second, third, a1, a2, b1, b2, STEP, GROWN),
        start, goal, "RRTConnect", make_rng(seed, 1, piece).integers(2**31), ITERATIONS,
    )  # fmt: skip


def _mend(solid: Solid, path: np.ndarray, seed: int) -> tuple[np.ndarray, int]:
    """Plan each piece of a path that is not free anew, between the last free point before it and the first after."""
    points, piece = motions.densify(path)
    bad = solid.too_near(points).astype(int)
    if bad[0] or bad[-1]:
        return NOWHERE, 0
    last, first = np.flatnonzero(np.diff(bad) == 1), np.flatnonzero(np.diff(bad) == -1) + 1
    rows, kept = [], 0
    for number, (a, b) in enumerate(zip(last, first, strict=True)):
        new = connect(solid, points[a], points[b], seed, number + 1)
        if not len(new):
            return NOWHERE, 0
        rows += [path[kept : piece[a] + 1], new]
        kept = piece[b] + 1
    mended = continuous(np.concatenate([*rows, path[kept:]]))
    moves = np.r_[True, np.diff(mended, axis=0).any(axis=1)]
    return mended[moves], len(last)
