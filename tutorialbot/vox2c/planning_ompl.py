"""OMPL's planners on the torus of the two angles: trees and a roadmap. The only file that imports OMPL.

A planner asks `blocked_state(theta1, theta2)` and, where the method has one, `blocked_motion(a1, a2, b1, b2)` [rad].
Searches end after so many iterations, not after so much time, and every generator of random numbers is seeded: the same
seed gives the same path. Notes on OMPL 2: PRM.solve starts a second thread, which a stop condition in Python would wait
for without end; the status of a search calls an approximate solution a solution, too; TorusStateSpace has no binding.
"""

import itertools
import math

import numpy as np
from ompl import base, geometric, util
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from tutorialbot.seeding import make_rng
from tutorialbot.vox2c.motions import SEARCH_STEP, continuous, wrap

PLANNERS = ("RRT", "RRTConnect", "RRTstar", "PRM")
RANGE = 0.35  # longest branch of a tree [rad]
MILESTONES = 64  # PRM's first roadmap; it doubles until it connects start and goal
NEIGHBOURS = 10  # milestones that start and goal try to reach
DOUBT = 300  # iterations after which a tree asks whether there can be a path at all
NOWHERE = np.empty((0, 2))

util.setLogLevel(util.LogLevel.LOG_NONE)


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
    for q in wrap([start, goal]):  # an angle beyond +-pi is out of bounds for OMPL, and searches may never end
        state = information.allocState()
        state[0].value, state[1].value = float(q[0]), float(q[1])
        states.append(state)
    problem.setStartAndGoalStates(*states)
    return problem


def _seed(seed: int, *stream: int) -> None:
    """Seed OMPL: its generators are made with the planner, each from one global seed, which must not be 0."""
    util.RNG.setSeed(int(make_rng(seed, *stream).integers(1, 2**31)))


def _at_most(iterations: int, hopeless=None) -> base.PlannerTerminationCondition:
    """Return OMPL's question whether to stop: after so many iterations, or once in doubt and `hopeless()`."""
    count = itertools.count(1)

    def stop() -> bool:
        i = next(count)
        return i > iterations or (i == DOUBT and hopeless is not None and hopeless())

    return base.PlannerTerminationCondition(stop)


def tree(
    blocked_state, blocked_motion, start, goal, planner: str, seed: int, iterations: int, hopeless=None
) -> np.ndarray:  # fmt: skip
    """Let one of OMPL's trees search, a path (k, 2) [rad]; an approximate solution is none, (0, 2).

    hopeless(): whoever knows the whole C-space can tell whether there is a path at all; asked once, after DOUBT
    iterations, for a tree without a path in its space would go on to the last iteration. (So would one whose goal is
    blocked: OMPL looks at the start only.)
    """
    if blocked_state(*start) or blocked_state(*goal):
        return NOWHERE
    _seed(seed)
    information = _information(blocked_state, blocked_motion)
    problem = _problem(information, start, goal)
    found = getattr(geometric, planner)(information)
    found.setRange(RANGE)
    found.setProblemDefinition(problem)
    found.setup()
    found.solve(_at_most(iterations, hopeless))
    if not problem.hasExactSolution():
        return NOWHERE
    way = problem.getSolutionPath()
    states = [way.getState(i) for i in range(way.getStateCount())]
    return continuous([(state[0].value, state[1].value) for state in states])


def roadmap(blocked_state, blocked_motion, start, goal, seed: int, iterations: int) -> np.ndarray:
    """Grow OMPL's probabilistic roadmap until it connects start and goal; the shortest way through it.

    OMPL's own query runs in a second thread, whose timing would change the path: so the query is ours.
    """
    if blocked_state(*start) or blocked_state(*goal):
        return NOWHERE
    _seed(seed)
    information = _information(blocked_state, blocked_motion)
    found = geometric.PRM(information)
    found.setProblemDefinition(_problem(information, start, goal))
    found.setup()
    wanted, grown = min(MILESTONES, iterations), 0
    while grown < iterations:
        found.growRoadmapPtc(_at_most(wanted - grown))
        grown, wanted = wanted, min(2 * wanted, iterations)
        data = base.PlannerData(information)
        found.getPlannerData(data)
        path = _shortest(data, start, goal, blocked_motion)
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
