"""The planning experiments of paper 3 (section 4.2.2, Table 2): problems, one row a method and run, and coal's verdict.

A problem is a scene with a start and a goal that are free of the boxes and of the voxels (or the conventional planner
could not even start), far apart, joined by some path, and not by the straight one.
"""

from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidValue, finite_array, positive
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import fields, grids, labels, motions, planning
from tutorialbot.vox2c.arm import HALF_LENGTH, HALF_WIDTH, MIDDLE, forward_kinematics
from tutorialbot.vox2c.methods import prepare
from tutorialbot.vox2c.scenes import BoxScene, random_scene

FIRST_SEED = 4_700_000  # of scenes that no training, validation or tuning saw (the planners: first ones from 4,000,000)
SEQUENCES, RUNS = 3, 5  # of Table 2
APART = np.pi / 2  # start and goal are at least so far from each other on the torus [rad]
DRAWS = 20  # pairs tried in a scene before the next scene is taken

VARIANTS = {  # name in tables -> options of planning.plan; the letters are those of the issue that asked for them
    "octree": {"method": "octree"},
    "predicted 5 deg": {"method": "predicted", "resolution_deg": 5},
    "predicted 1 deg": {"method": "predicted", "resolution_deg": 1},
    "lookup 5 deg": {"method": "lookup", "resolution_deg": 5},
    "lookup 5 deg, voxels": {"method": "lookup", "resolution_deg": 5, "verify_against": "voxels"},
    "lookup 1 deg": {"method": "lookup", "resolution_deg": 1},
    "exact map 1 deg": {"method": "exact_map", "resolution_deg": 1},
    "exact map 5 deg": {"method": "exact_map", "resolution_deg": 5},
    "exact": {"method": "exact"},
    "voxel test": {"method": "voxel_test"},
}


@dataclass(frozen=True)
class Problem:
    """A scene by its seed, and a start and a goal (2,) [rad] in it."""

    seed: int
    start: tuple[float, float]
    goal: tuple[float, float]

    @property
    def scene(self) -> BoxScene:
        """The scene."""
        return random_scene(self.seed)


def problems(count: int, first_seed: int = FIRST_SEED) -> list[Problem]:
    """Return so many problems, one a scene, scenes from `first_seed` on; scenes without a hard pair are left out."""
    found, seed = [], first_seed
    while len(found) < count:
        found += pairs(seed, 1)
        seed += 1
    return found


def pairs(seed: int, count: int) -> list[Problem]:
    """Return up to `count` problems in one scene: fewer when DRAWS * count random pairs hold no more."""
    scene, rng = random_scene(seed), make_rng(seed, 4)
    boxes, voxels = motions.boxes(scene), motions.voxels(grids.voxelize(scene))
    cspace, found = labels.exact_cspace(scene, 1), []
    for _ in range(DRAWS * count):
        ends = rng.uniform(-np.pi, np.pi, (2, 2))
        free = not (boxes.too_near(ends).any() or voxels.too_near(ends).any())
        if free and motions.distance(*ends) >= APART and not boxes.free(ends):
            if len(fields.path(cspace, *ends)):
                found.append(Problem(seed, tuple(ends[0].tolist()), tuple(ends[1].tolist())))
            if len(found) == count:
                break
    return found


# -- coal's verdict --------------------------------------------------------------------------------------------------


def corners(q: np.ndarray) -> np.ndarray:
    """Return the corners of both bars in the x-z plane, (k, 8, 2) [m], at configurations q (k, 2) [rad]."""
    points = forward_kinematics(q)[:, :, [0, 2]]
    found = []
    for joint, angle in ((0, q[:, 0]), (1, q.sum(axis=1))):
        ahead = np.stack([np.sin(angle), np.cos(angle)], axis=-1)
        aside = np.stack([np.cos(angle), -np.sin(angle)], axis=-1)
        for along in (MIDDLE - HALF_LENGTH, MIDDLE + HALF_LENGTH):
            found += [points[:, joint] + along * ahead + side * aside for side in (-HALF_WIDTH, HALF_WIDTH)]
    return np.stack(found, axis=1)


def fine_states(path: np.ndarray, longest: float = motions.STEP) -> np.ndarray:
    """Return states (m, 2) along a path (k, 2) [rad] such that no corner of a bar, and so no point of one, moves more
    than `longest` [m] from one to the next: measured on the corners, apart from what motions.py computes.
    """
    path, found = finite_array("path", path, (-1, 2)), []
    positive("longest", longest)
    for a, b in zip(path[:-1], path[1:], strict=True):
        n, way = 1, motions.wrap(b - a)
        while True:
            states = a + np.arange(n + 1)[:, None] / n * way
            moved = np.linalg.norm(np.diff(corners(states), axis=0), axis=-1).max()
            if moved <= longest:
                break
            n = int(np.ceil(1.01 * n * moved / longest))
        found.append(states)
    return np.concatenate(found) if found else path


def coal_hits(scene: BoxScene, path: np.ndarray, longest: float = motions.STEP) -> int:
    """Return how many of the fine states along a path collide with a box of the scene, asked of coal one by one.

    Independent of the planner: another geometry, another way to divide the path. An empty path has none.
    """
    collides = labels.coal_test(scene)
    return sum(bool(collides(*state)) for state in fine_states(path, longest))


# -- runs ------------------------------------------------------------------------------------------------------------


def run(problem: Problem, variant: str, seed: int, planner: str = "RRT", *, coal: bool = True, **options) -> dict:
    """Plan once and return a row: CPU time of every stage [s], what the search found, and whether it was free.

    "found": the search had a path; "collided": that path collides with the boxes; "repaired": it was planned anew in
    part (or whole); "solved"; "coal": states of the final path that collide with the boxes by coal, whatever it was
    verified against, -1 when not asked or no path.
    """
    settings = VARIANTS[_known(variant)] | options
    plan = planning.plan(problem.scene, problem.start, problem.goal, seed=seed, planner=planner, **settings)
    found = len(plan.searched) > 0
    collided = found and bool(labels.collides(problem.scene, motions.densify(plan.searched)[0]).any())
    return {
        "variant": variant, "planner": planner, "scene": problem.seed, "seed": seed, **plan.seconds,
        "total": plan.total, "length": motions.length(plan.path) if plan.solved else 0.0, "found": found,
        "collided": collided, "repaired": plan.repairs != 0, "solved": plan.solved,
        "verified_against": plan.verify_against,
        "coal": coal_hits(problem.scene, plan.path) if coal and plan.solved else -1,
    }  # fmt: skip


def _known(variant: str) -> str:
    if variant not in VARIANTS:
        raise InvalidValue("variant", variant, f"one of {', '.join(VARIANTS)}")
    return variant


def shared(asked: list[Problem], variant: str, planner: str = "wavefront", **options) -> dict:
    """Answer many problems of one scene with one map; return mean CPU time a query [s], map included, and counts."""
    queries, seed = len(asked), asked[0].seed
    prepared = prepare(random_scene(seed), **VARIANTS[_known(variant)] | options)
    plans = [planning.query(prepared, one.start, one.goal, seed=i, planner=planner) for i, one in enumerate(asked)]
    stages = {name: sum(plan.seconds[name] for plan in plans) for name in ("search", "verify", "repair")}
    total = prepared.seconds["map"] + sum(stages.values())
    return {
        "scene": seed, "variant": variant, "planner": planner, "queries": queries, "each": total / queries,
        "map": prepared.seconds["map"], **stages, "solved": sum(plan.solved for plan in plans),
        "repaired": sum(plan.repairs != 0 for plan in plans),
    }  # fmt: skip
