"""Plans: none that is returned collides, whatever the search was told; the same seed, the same path; named failures."""

import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.paths import ROOT
from tutorialbot.vox2c import experiments, fields, grids, labels, lookup, methods, motions, planning, planning_ompl
from tutorialbot.vox2c.scenes import BoxScene, random_scene

FIRST = 4_300_000
STAGES = {"sense", "map", "search", "verify", "repair"}
WITHOUT_WEIGHTS = [method for method in methods.METHODS if method != "predicted"]


@cache
def problems(count: int) -> list:
    return experiments.problems(count, FIRST)


class Says:
    """A predictor that says what it is told, whatever it sees."""

    def __init__(self, answer):
        self.answer = answer

    def predict(self, voxels, resolution_deg):
        n = labels.cells(resolution_deg)
        return np.full((n, n), self.answer) if np.isscalar(self.answer) else self.answer


FREE, BLOCKED = Says(0.0), Says(1.0)


def plan(problem, **options):
    return planning.plan(problem.scene, problem.start, problem.goal, **{"seed": 1, **options})


def check(problem, found) -> None:
    """A path from start to goal that coal finds free of what it was verified against."""
    assert found.solved and found.collision_free and found.reason == ""
    assert found.path.ndim == 2 and found.path.shape[1] == 2 and len(found.path) >= 2
    assert motions.distance(found.path[0], problem.start) < 1e-9
    assert motions.distance(found.path[-1], problem.goal) < 1e-9
    assert np.abs(np.diff(found.path, axis=0)).max() <= np.pi and np.diff(found.path, axis=0).any(axis=1).all()
    if found.verify_against == "boxes":
        assert experiments.coal_hits(problem.scene, found.path) == 0
    else:
        collides = labels.coal_octree_test(grids.voxelize(problem.scene))
        assert not any(collides(*state) for state in experiments.fine_states(found.path))


@pytest.mark.parametrize("against", methods.AGAINST)
@pytest.mark.parametrize("method", WITHOUT_WEIGHTS)
def test_no_path_of_any_method_collides(method, against):
    for problem in problems(4):
        found = plan(problem, method=method, verify_against=against)
        check(problem, found)
        assert set(found.seconds) == STAGES and all(seconds >= 0 for seconds in found.seconds.values())
        assert found.total == pytest.approx(sum(found.seconds.values()) - found.seconds["sense"])
        assert (found.method, found.verify_against, found.planner, found.seed) == (method, against, "RRT", 1)


@pytest.mark.parametrize("planner", planning.PLANNERS)
def test_no_path_of_any_planner_collides(planner):
    """Also on a map so coarse and wrong that most searches run into boxes."""
    repaired = 0
    for problem in problems(4):
        for options in ({"method": "exact_map", "resolution_deg": 30}, {"method": "lookup"}, {"predictor": FREE}):
            found = plan(problem, planner=planner, **{"method": "predicted", **options})
            check(problem, found)
            repaired += found.repairs != 0
    assert repaired >= 4


@pytest.mark.full
def test_no_path_of_two_hundred_problems_collides():
    for problem in experiments.problems(200, FIRST):
        for method in ("octree", "lookup", "exact_map", "exact"):
            check(problem, plan(problem, method=method))
        check(problem, plan(problem, method="lookup", planner="wavefront"))


def test_a_straight_guess_through_boxes_is_mended_in_pieces():
    """All free, says the predictor: so the search goes straight, and pieces of it are planned anew."""
    for problem in problems(4):
        found = plan(problem, method="predicted", predictor=FREE, planner="wavefront")
        assert not motions.boxes(problem.scene).free(found.searched)
        check(problem, found)
        assert found.repairs != 0
    assert any(plan(one, method="predicted", predictor=FREE).repairs >= 1 for one in problems(4))


def test_when_all_seems_blocked_the_whole_path_is_planned_anew():
    found = plan(problems(1)[0], method="predicted", predictor=BLOCKED)
    check(problems(1)[0], found)
    assert found.repairs == -1 and len(found.searched) == 0


def test_a_searched_path_whose_ends_collide_is_planned_anew_as_a_whole():
    problem = problems(1)[0]
    solid = motions.boxes(problem.scene)
    states = np.random.default_rng(1).uniform(-np.pi, np.pi, (500, 2))
    bad = states[solid.collides(states)][0]
    for searched in ([bad, problem.goal], [problem.start, bad], [bad, bad]):
        path, pieces = planning.repair(solid, motions.continuous(searched), problem.start, problem.goal, 1)
        assert pieces == -1 and solid.free(path)
        assert motions.distance(path[0], problem.start) < 1e-9 and motions.distance(path[-1], problem.goal) < 1e-9


def test_a_repair_that_collides_is_not_returned(monkeypatch):
    problem = problems(1)[0]
    monkeypatch.setattr(planning, "connect", lambda solid, a, b, seed, piece: motions.continuous([a, b]))
    for predictor in (FREE, BLOCKED):  # pieces of the path, and all of it
        found = plan(problem, method="predicted", predictor=predictor, planner="wavefront")
        assert not found.solved and not found.collision_free and found.path.shape == (0, 2)


def test_a_path_that_needs_no_repair_is_the_one_that_was_searched():
    found = plan(problems(1)[0], method="exact")
    if found.repairs == 0:
        np.testing.assert_array_equal(found.path, found.searched)
    assert plan(problems(1)[0], method="exact").repairs == found.repairs


def test_coal_catches_a_verifier_that_skips(monkeypatch):
    """Planted faults: a verifier that says yes to all, and one that looks at the ends of each motion only."""
    drawn = problems(4)
    for fault in (
        lambda self, path: True,
        lambda self, path: not self.too_near(path).any(),
    ):
        monkeypatch.setattr(motions.Solid, "free", fault)
        hits = [experiments.coal_hits(one.scene, plan(one, method="exact_map", resolution_deg=30).path)
                for one in drawn]  # fmt: skip
        monkeypatch.undo()
        assert sum(hits) > 0


def test_coal_catches_a_path_through_a_box():
    problem = problems(1)[0]
    straight = motions.continuous([problem.start, problem.goal])
    assert experiments.coal_hits(problem.scene, straight) > 0
    assert experiments.coal_hits(BoxScene(np.empty((0, 6))), straight) == 0


def test_fine_states_are_fine():
    for longest in (0.002, 0.05):
        states = experiments.fine_states(problems(1)[0].start + np.array([[0, 0], [0.4, 1.0], [-1.0, 0.7]]), longest)
        moved = np.linalg.norm(np.diff(experiments.corners(states), axis=0), axis=-1).max()
        assert 0.9 * longest < moved <= longest


# -- the torus -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("planner", planning.PLANNERS)
def test_from_179_to_minus_179_degrees_it_is_2_degrees(planner):
    scene = random_scene(1, boxes=0)
    found = planning.plan(scene, np.radians([179, 0]), np.radians([-179, 0]), seed=2, planner=planner)
    assert found.solved
    assert np.degrees(motions.length(found.path)) == pytest.approx(2, abs=1e-6)
    np.testing.assert_allclose(motions.wrap(found.path[-1] - np.radians([-179, 0])), 0, atol=1e-9)


def test_turns_of_start_and_goal_do_not_matter():
    problem = problems(1)[0]
    start, goal = np.add(problem.start, 2 * np.pi), np.add(problem.goal, -4 * np.pi)
    turned = replace(problem, start=tuple(start), goal=tuple(goal))
    np.testing.assert_allclose(plan(turned).path, plan(problem).path, atol=1e-9)


def test_ends_beyond_half_a_turn_are_ends_like_others():
    """Pieces of a continuous path may lie there; OMPL would call them out of bounds, or search without end."""
    problem = problems(1)[0]
    solid = motions.boxes(problem.scene)
    turned = np.add([problem.start, problem.goal], [[2 * np.pi, 0], [0, -2 * np.pi]])
    path = planning.connect(solid, *turned, 1, 0)
    assert len(path) and solid.free(path)
    np.testing.assert_array_equal(path, planning.connect(solid, problem.start, problem.goal, 1, 0))


def test_a_continuous_path_does_not_jump():
    for problem in problems(4):
        assert np.abs(np.diff(plan(problem).path, axis=0)).max() <= planning_ompl.RANGE + 1e-9


# -- seeds -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("planner", planning.PLANNERS)
def test_the_same_seed_gives_the_same_path(planner):
    problem = problems(2)[1]
    first = plan(problem, method="lookup", planner=planner, seed=5)
    plan(problem, method="lookup", planner="RRT", seed=6)  # something else in between
    np.testing.assert_array_equal(plan(problem, method="lookup", planner=planner, seed=5).path, first.path)
    if planner in planning_ompl.PLANNERS:
        assert not np.array_equal(plan(problem, method="lookup", planner=planner, seed=6).path, first.path)


def test_the_same_seed_gives_the_same_repair():
    problem = problems(1)[0]
    options = {"method": "predicted", "predictor": FREE, "planner": "wavefront"}
    first, again = (plan(problem, **options, seed=3) for _ in range(2))
    assert first.repairs != 0
    np.testing.assert_array_equal(first.path, again.path)


OTHER_PROCESS = """
import numpy as np
from tutorialbot.vox2c import experiments, planning
one = experiments.problems(1, {first})[0]
for planner in planning.PLANNERS:
    path = planning.plan(one.scene, one.start, one.goal, method="lookup", seed=7, planner=planner).path
    print(planner, path.tobytes().hex())
"""


def test_the_same_seed_gives_the_same_path_in_another_process():
    done = subprocess.run([sys.executable, "-c", OTHER_PROCESS.format(first=FIRST)], cwd=ROOT, capture_output=True,
                          text=True, check=True)  # fmt: skip
    other = dict(line.split() for line in done.stdout.splitlines())
    for planner in planning.PLANNERS:
        path = plan(problems(1)[0], method="lookup", seed=7, planner=planner).path
        assert path.tobytes().hex() == other[planner]


# -- named results and errors ----------------------------------------------------------------------------------------


def test_a_start_or_goal_in_collision_is_a_named_result():
    problem = problems(1)[0]
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (2000, 2))
    blocked = q[labels.collides(problem.scene, q)][0]
    for name in ("start", "goal"):
        found = plan(replace(problem, **{name: tuple(blocked)}))
        assert not found.solved and not found.collision_free and found.path.shape == (0, 2)
        assert found.reason == f"{name} in collision with the boxes"
    voxels = grids.voxelize(problem.scene)
    cspace = labels.exact_cspace(problem.scene, 1)
    blocked = next(one for one in q[labels.octree_collides(voxels, q) & ~labels.collides(problem.scene, q)]
                   if len(fields.path(cspace, problem.start, one)))  # fmt: skip
    found = plan(replace(problem, goal=tuple(blocked)), verify_against="voxels")
    assert found.reason == "goal in collision with the voxels"
    check(replace(problem, goal=tuple(blocked)), plan(replace(problem, goal=tuple(blocked)), method="octree"))


def test_an_end_that_almost_touches_is_a_named_result():
    scene = BoxScene([[0.0, 0.05, 1.5501, 0.1, 0.1, 0.1]])  # 0.1 mm above link 2, which stands upright: half a box up
    top = 0.975 + 0.475
    assert scene.corners[0][0, 2] - top > 0
    near = BoxScene([[0.0, 0.05, top + 0.0501, 0.1, 0.05, 0.1]])
    found = planning.plan(near, (0.0, np.pi), (np.pi, 0.0), seed=1)
    assert found.reason == "start closer than 1 mm to the boxes" and not found.solved


def test_no_path_is_a_named_result():
    """A ring of boxes that link 2 cannot cross, with the start inside."""
    wall = [[side * 0.3, 0.05, 1.2, 0.05, 0.05, 0.6] for side in (-1, 1)]
    scene = BoxScene(wall)
    found = planning.plan(scene, (0.0, 0.0), (np.pi, 0.0), seed=1, method="exact_map", iterations=500)
    assert not found.solved and "no path found" in found.reason and found.path.shape == (0, 2)


@pytest.mark.parametrize("against", methods.AGAINST)
@pytest.mark.parametrize("method", WITHOUT_WEIGHTS)
def test_with_nothing_in_the_way_the_path_is_straight_and_with_all_blocked_there_is_none(method, against):
    options = {"seed": 1, "method": method, "verify_against": against, "source": "raster"}
    found = planning.plan(BoxScene(np.empty((0, 6))), (0.0, 0.0), (0.2, -0.1), **options)
    assert found.solved and found.repairs == 0
    np.testing.assert_allclose(found.path, [[0.0, 0.0], [0.2, -0.1]], atol=1e-12)
    everything = BoxScene([[0.0, 0.05, 0.975, 0.3, 0.3, 0.3]])  # around joint 1
    found = planning.plan(everything, (0.0, 0.0), (0.2, -0.1), **options)
    assert not found.solved and found.reason == f"start in collision with the {against}" and found.path.shape == (0, 2)
    assert labels.exact_cspace(everything, 5).all()


def test_the_straight_way_is_a_branch_long_and_beyond_that_the_planner_goes():
    empty = BoxScene(np.empty((0, 6)))
    near, far = (
        planning.plan(empty, (0.0, 0.0), (turn, 0.0), seed=1).path for turn in (0.9 * planning_ompl.RANGE, 2.5)
    )
    assert len(near) == 2 < len(far)


def test_a_wavefront_goes_through_gaps_of_one_cell_where_no_wider_way_is():
    cspace = np.zeros((36, 36), dtype=bool)
    cspace[[9, 27]] = True
    cspace[9, 20] = False  # the only way from one half to the other
    prepared = methods.with_map(methods.prepare(random_scene(1)), cspace)
    start, goal = np.radians([-170.0, 0.0]), np.radians([0.0, 0.0])
    assert not len(fields.path(prepared.wide, start, goal))
    path = planning.search(prepared, start, goal, "wavefront", 1)
    assert motions.distance(path[0], start) < 1e-9 and motions.distance(path[-1], goal) < 1e-9


def test_a_tree_in_doubt_asks_whether_there_is_a_path_at_all():
    asked, wall = [], lambda a, b: abs(abs(a) - 1.5) < 0.2
    found = planning_ompl.tree(
        wall, lambda a1, a2, b1, b2: any(wall(x, 0) for x in np.linspace(a1, b1, 50)), (0.0, 0.0), (3.0, 0.0), "RRT", 1,
        100_000, lambda: asked.append(1) or True,
    )  # fmt: skip
    assert found.shape == (0, 2) and asked == [1]


def test_queries_share_what_was_prepared():
    problem = problems(1)[0]
    prepared = methods.prepare(problem.scene, method="lookup")
    assert prepared.cspace.shape == (72, 72) and set(prepared.seconds) == {"sense", "map"}
    for seed in range(3):
        alone = plan(problem, method="lookup", seed=seed)
        shared = planning.query(prepared, problem.start, problem.goal, seed=seed)
        np.testing.assert_array_equal(shared.path, alone.path)


@pytest.mark.parametrize("method", methods.MAPS)
def test_a_map_is_what_its_maker_says(method):
    scene = problems(1)[0].scene
    voxels, truth = grids.voxelize(scene), labels.exact_cspace(scene, 10)
    prepared = methods.prepare(scene, method=method, resolution_deg=10, voxels=voxels, predictor=Says(0.9 * truth))
    inset = lookup.INSETS["cameras", 32]
    expected = truth if method != "lookup" else lookup.lookup_cspace(voxels, 10, inset=inset)
    np.testing.assert_array_equal(prepared.cspace, expected)


def test_the_threshold_decides_what_is_blocked():
    scene, voxels = problems(1)[0].scene, np.zeros((32, 32, 32), bool)
    for threshold, blocked in ((0.3, True), (0.5, False), (None, False)):
        prepared = methods.prepare(scene, method="predicted", resolution_deg=10, voxels=voxels, predictor=Says(0.4),
                                   threshold=threshold)  # fmt: skip
        assert prepared.cspace.all() == blocked and prepared.cspace.any() == blocked
    learned = Says(0.4)
    learned.threshold = 0.35
    prepared = methods.prepare(scene, method="predicted", resolution_deg=10, voxels=voxels, predictor=learned)
    assert prepared.cspace.all()


@pytest.mark.parametrize(
    ("argument", "value"),
    [("scene", None), ("scene", np.zeros((15, 6))), ("start", (0.0, np.nan)), ("goal", (np.inf, 0.0)),
     ("start", (0.0,)), ("goal", "up"),
     ("start", (10**400, 0)), ("start", ("0", "1")), ("goal", (True, False)),
     ("goal", (1j, 0.0)), ("goal", None),
     ("method", "magic"), ("method", None), ("seed", -1), ("seed", 1.5),
     ("verify_against", "hope"), ("planner", "A*"), ("planner", None), ("iterations", 0), ("resolution_deg", 7),
     ("voxels", np.zeros((3, 4, 5))), ("voxels", np.full((32, 32, 32), np.nan)), ("predictor", 7),
     ("threshold", 2.0), ("source", "lidar"), ("size", 0)],
)  # fmt: skip
def test_odd_arguments_are_named(argument, value):
    options = {"scene": random_scene(1), "start": (0.0, 0.0), "goal": (1.0, 1.0), "seed": 1, "method": "lookup"}
    if argument in ("predictor", "threshold"):
        options |= {"method": "predicted", "predictor": FREE}
    with pytest.raises((InvalidValue, InvalidType), match=f"^{argument} = "):
        planning.plan(**{**options, argument: value})


@pytest.mark.parametrize("method", ["exact_map", "exact", "octree"])
@pytest.mark.parametrize(
    ("argument", "value"),
    [("threshold", "high"), ("threshold", np.nan), ("source", "lidar"), ("size", 0), ("size", "big"),
     ("resolution_deg", 7), ("resolution_deg", [])],
)  # fmt: skip
def test_odd_options_are_named_where_they_are_of_no_use_too(method, argument, value):
    with pytest.raises((InvalidValue, InvalidType), match=f"^{argument} = "):
        planning.plan(random_scene(1), (0.0, 0.0), (1.0, 1.0), seed=1, method=method, **{argument: value})


def test_a_prediction_of_the_wrong_shape_is_named():
    with pytest.raises(InvalidValue, match="^predictor = 'a prediction of shape"):
        plan(problems(1)[0], method="predicted", predictor=Says(np.zeros((5, 5))))


@pytest.mark.parametrize(("planner", "method"), [("PRM", "octree"), ("wavefront", "exact"), ("potential", "octree")])
def test_planners_that_need_more_than_a_method_knows(planner, method):
    with pytest.raises(InvalidValue, match="^planner = "):
        plan(problems(1)[0], planner=planner, method=method)


# -- experiments -----------------------------------------------------------------------------------------------------


def test_problems_are_hard_and_solvable():
    for problem in problems(4):
        scene, ends = problem.scene, [problem.start, problem.goal]
        assert not labels.collides(scene, ends).any()
        assert not labels.octree_collides(grids.voxelize(scene), ends).any()
        assert motions.distance(*ends) >= experiments.APART
        assert not motions.boxes(scene).free(ends)
    assert experiments.problems(2, FIRST) == problems(4)[:2]
    assert len({problem.seed for problem in problems(4)}) == 4


def test_a_row_tells_what_the_search_ran_into():
    problem = problems(1)[0]
    row = experiments.run(problem, "exact map 5 deg", 1, resolution_deg=30)
    plain = plan(problem, method="exact_map", resolution_deg=30)
    points, _ = motions.densify(plain.searched)
    assert row["collided"] == labels.collides(problem.scene, points).any()
    assert (row["coal"], row["solved"], row["repaired"]) == (0, True, plain.repairs != 0)
    with pytest.raises(InvalidValue, match="^variant = "):
        experiments.run(problem, "magic", 1)


def test_many_queries_of_one_scene():
    asked = experiments.pairs(problems(1)[0].seed, 5)
    row = experiments.shared(asked, "lookup 5 deg")
    assert len(asked) >= 3 and (row["queries"], row["solved"]) == (len(asked), len(asked))
    total = row["map"] + row["search"] + row["verify"] + row["repair"]
    assert row["each"] == pytest.approx(total / len(asked))
