"""Plans on the torus of paper 3's arm: search on what a method takes for free, verify, repair (section 4.2.1).

The paper: a path on a predicted C-space may collide, so it must be checked, and where it collides, an existing planner
mends that part. So here: whatever the search says, a path is returned only when `motions.Solid.free` proves it free of
what it is verified against.

The planners are OMPL's. Two are ours, because they need the whole C-space: see fields.py.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from ompl import base, geometric, util
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from tutorialbot.errors import InvalidValue, finite_array, one_of, whole_number
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import fields, motions
from tutorialbot.vox2c.methods import Prepared, prepare
from tutorialbot.vox2c.motions import GROWN, SEARCH_STEP, STEP, Solid, continuous, wrap
from tutorialbot.vox2c.scenes import BoxScene

OMPL = ("RRT", "RRTConnect", "RRTstar", "PRM")
PLANNERS = (*OMPL, *fields.PLANNERS)
RANGE = 0.35  # longest branch of a tree [rad]
ITERATIONS = 10_000  # after so many a search gives up: no clock, so that the same seed gives the same path
ITERATIONS_STAR = 1_000  # RRT* uses all of its iterations to get shorter
MILESTONES = 64  # PRM's first roadmap; it doubles until it connects start and goal
NEIGHBOURS = 10  # milestones that start and goal try to reach

util.setLogLevel(util.LogLevel.LOG_NONE)


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
    for name, collides, near in zip(
        ("start", "goal"), solid.collides([start, goal]), solid.too_near([start, goal]), strict=True
    ):
        if collides:
            return f"{name} in collision with the {solid.name}"
        if near:
            return f"{name} closer than {1e3 * motions.MARGIN:g} mm to the {solid.name}"
    return ""


def search(prepared: Prepared, start, goal, planner: str, seed: int, iterations: int | None = None) -> np.ndarray:
    """Return a path (k, 2) that the method takes for free, not verified; (0, 2) when none is found."""
    if planner in fields.PLANNERS:
        if prepared.cspace is None:
            raise InvalidValue("planner", planner, f"a method that makes a whole C-space, not {prepared.method!r}")
        return fields.path(prepared.cspace, start, goal, planner)
    if planner == "PRM":
        return _roadmap(prepared, start, goal, seed, iterations or ITERATIONS)
    count = iterations or (ITERATIONS_STAR if planner == "RRTstar" else ITERATIONS)
    return _tree(prepared.state, prepared.motion, start, goal, planner, seed, count)


# -- OMPL ------------------------------------------------------------------------------------------------------------


class _Motions(base.MotionValidator):
    """Asks about a whole motion at once: one call from OMPL into Python, not one for every state on the way."""

    def __init__(self, information, blocked):
        super().__init__(information)
        self._blocked = blocked

    def checkMotion(self, a, b) -> bool:
        """Say whether the motion is free, as OMPL names it."""
        return not self._blocked(a[0].value, a[1].value, b[0].value, b[1].value)


def torus() -> base.CompoundStateSpace:
    """Return OMPL's space of two angles that wrap around, states tested every SEARCH_STEP of the distance."""
    space = base.CompoundStateSpace()
    for _ in range(2):
        space.addSubspace(base.SO2StateSpace(), 1.0)
    space.lock()
    space.setLongestValidSegmentFraction(SEARCH_STEP / math.pi)
    return space


def _information(blocked_state, blocked_motion) -> base.SpaceInformation:
    information = base.SpaceInformation(torus())
    information.setStateValidityChecker(lambda state: not blocked_state(state[0].value, state[1].value))
    if blocked_motion is not None:
        information.setMotionValidator(_Motions(information, blocked_motion))
    information.setup()
    return information


def _problem(information: base.SpaceInformation, start, goal) -> base.ProblemDefinition:
    problem = base.ProblemDefinition(information)
    states = []
    for q in (start, goal):
        state = information.allocState()
        state[0].value, state[1].value = float(q[0]), float(q[1])
        states.append(state)
    problem.setStartAndGoalStates(*states)
    return problem


def _seed(seed: int, *stream: int) -> None:
    """Seed OMPL: its generators are made with the planner, each from one global seed, which must not be 0."""
    util.RNG.setSeed(int(make_rng(seed, *stream).integers(1, 2**31)))


def _at_most(iterations: int) -> base.PlannerTerminationCondition:
    left = iter(range(iterations))
    return base.PlannerTerminationCondition(lambda: next(left, None) is None)


def _tree(blocked_state, blocked_motion, start, goal, planner: str, seed: int, iterations: int) -> np.ndarray:
    """Let one of OMPL's trees search; an approximate solution is none."""
    _seed(seed)
    information = _information(blocked_state, blocked_motion)
    problem = _problem(information, start, goal)
    tree = getattr(geometric, planner)(information)
    tree.setRange(RANGE)
    tree.setProblemDefinition(problem)
    tree.setup()
    tree.solve(_at_most(iterations))
    if not problem.hasExactSolution():
        return NOWHERE
    found = problem.getSolutionPath()
    states = [found.getState(i) for i in range(found.getStateCount())]
    return continuous([(state[0].value, state[1].value) for state in states])


def _roadmap(prepared: Prepared, start, goal, seed: int, iterations: int) -> np.ndarray:
    """Grow OMPL's probabilistic roadmap until it connects start and goal; the shortest way through it.

    OMPL's own query runs in a second thread, whose timing would change the path: so the query is ours.
    """
    if prepared.state(*start) or prepared.state(*goal):
        return NOWHERE
    _seed(seed)
    information = _information(prepared.state, prepared.motion)
    roadmap, data = geometric.PRM(information), None
    roadmap.setProblemDefinition(_problem(information, start, goal))
    roadmap.setup()
    wanted, grown = min(MILESTONES, iterations), 0
    while grown < iterations:
        roadmap.growRoadmapPtc(_at_most(wanted - grown))
        grown, wanted = wanted, min(2 * wanted, iterations)
        data = base.PlannerData(information)
        roadmap.getPlannerData(data)
        path = _shortest(data, start, goal, prepared.motion)
        if len(path):
            return path
    return NOWHERE


def _shortest(data: base.PlannerData, start, goal, blocked_motion) -> np.ndarray:
    """Return the shortest way from start to goal through a roadmap, (0, 2) when there is none."""
    n = data.numVertices()
    states = [data.getVertex(i).getState() for i in range(n)]
    q = np.array([*((state[0].value, state[1].value) for state in states), start, goal])
    edges = [(i, j) for i in range(n) for j in data.getEdges(i)]
    for end in (n, n + 1):
        near = np.argsort(np.linalg.norm(wrap(q - q[end]), axis=1), kind="stable")
        near = [int(i) for i in near if i != end][:NEIGHBOURS]
        edges += [(end, i) for i in near if not blocked_motion(*q[end], *q[i])]
    if not edges:
        return NOWHERE
    i, j = np.array(edges).T
    lengths = np.linalg.norm(wrap(q[j] - q[i]), axis=1)
    graph = csr_matrix((lengths, (i, j)), shape=(n + 2, n + 2))
    distance, before = dijkstra(graph, directed=False, indices=n, return_predecessors=True)
    if not np.isfinite(distance[n + 1]):
        return NOWHERE
    way = [n + 1]
    while way[-1] != n:
        way.append(before[way[-1]])
    return continuous(q[way[::-1]])


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
    return _tree(
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
