"""Motions: their bounds against corners that are measured, short cuts against every step, verification against coal."""

import coal
import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.vox2c import experiments, grids, kernels, labels, motions
from tutorialbot.vox2c.arm import BAR, HALF_LENGTH, HALF_WIDTH, MIDDLE, link_poses
from tutorialbot.vox2c.scenes import BoxScene, random_scene

SEEDS = range(4_100_000, 4_100_010)


def motion(rng, largest=np.pi) -> tuple[np.ndarray, np.ndarray]:
    start = rng.uniform(-np.pi, np.pi, 2)
    return start, start + rng.uniform(-largest, largest, 2)


def crowded(seed: int) -> BoxScene:
    """Boxes where the bars move: half of all configurations collide."""
    rng = np.random.default_rng(seed)
    around = rng.uniform(-np.pi, np.pi, 8)
    centres = np.column_stack([np.sin(around), np.zeros(8), np.cos(around)]) * rng.uniform(0.3, 0.9, (8, 1))
    return BoxScene(np.column_stack([centres + [0, 0.075, 0.975], rng.uniform(0.05, 0.2, (8, 3))]))


def test_the_shorter_way_round():
    assert np.degrees(motions.turn(np.radians(179), np.radians(-179))) == pytest.approx(2)
    assert np.degrees(motions.turn(np.radians(-179), np.radians(179))) == pytest.approx(-2)
    assert motions.distance(np.radians([179, -179]), np.radians([-179, 179])) == pytest.approx(np.radians(2) * 2**0.5)
    path = motions.continuous(np.radians([[170, 0], [-170, 0], [-150, 10]]))
    np.testing.assert_allclose(np.degrees(path), [[170, 0], [190, 0], [210, 10]])
    assert np.degrees(motions.length(path[:2])) == pytest.approx(20)


def test_no_corner_moves_farther_than_travel_says():
    """Measured along the way; and travel is no wild overestimate."""
    rng, shares = np.random.default_rng(1), []
    for _ in range(300):
        a, b = motion(rng, 0.3)
        way = experiments.corners(a + np.linspace(0, 1, 200)[:, None] * (b - a))
        moved = np.linalg.norm(np.diff(way, axis=0), axis=-1).sum(axis=0).max()
        shares.append(moved / motions.travel(*(b - a), BAR))
    assert 0.99 < max(shares) <= 1.0 and np.median(shares) > 0.7


def test_dense_points_are_near_each_other_and_on_the_path():
    rng = np.random.default_rng(2)
    path = motions.continuous(rng.uniform(-np.pi, np.pi, (6, 2)))
    points, piece = motions.densify(path)
    corners = experiments.corners(points)
    assert np.linalg.norm(np.diff(corners, axis=0), axis=-1).max() <= motions.STEP == 0.002
    np.testing.assert_array_equal(points[[0, -1]], path[[0, -1]])
    for i in range(5):
        assert np.abs(points[piece == i][-1] - path[i + 1]).max() < 1e-12
        along = (points[piece == i] - path[i]) @ (path[i + 1] - path[i])
        assert (np.diff(along) > 0).all()


def test_clearance_is_a_lower_bound_of_coals_distance_and_its_sign_is_collision():
    rng, near = np.random.default_rng(3), 0
    bar, request = coal.Box(2 * HALF_WIDTH, 2 * HALF_WIDTH, 2 * HALF_LENGTH), coal.DistanceRequest()
    for seed in SEEDS[:4]:
        scene = random_scene(seed)
        low, high = scene.corners
        low[:, 1], high[:, 1] = -0.5, 0.5  # all boxes as long along y: what is left is the plane
        solid = motions.Solid("boxes", *(kernels.rectangles(low, high, -1, 1, 0, 0.975) for _ in range(2)))
        corners = zip(low, high, strict=True)
        shapes = [(coal.Box(*(b - a)), coal.Transform3s(np.eye(3), (a + b) / 2)) for a, b in corners]
        for q in rng.uniform(-np.pi, np.pi, (40, 2)):
            bound, least = motions.clearance(solid.second, solid.third, *q, BAR), np.inf
            assert (bound < 0) == solid.collides(q)[0]
            for pose in link_poses(q):
                placed = coal.Transform3s(pose.rotation, pose.act(np.array([0, 0, MIDDLE])))
                for shape, where in shapes:
                    least = min(least, coal.distance(bar, placed, shape, where, request, coal.DistanceResult()))
            if bound > 0:
                assert bound <= least + 1e-6
                near += least < 0.05
    assert near > 10


def test_steps_that_are_passed_over_change_no_answer():
    """Against every step, one by one."""
    rng, hits = np.random.default_rng(4), 0
    for seed in SEEDS:
        solid = motions.boxes(crowded(seed))
        for _ in range(60):
            a, b = motion(rng, 0.5)
            n = max(1, int(np.ceil(np.abs(b - a).max() / motions.SEARCH_STEP)))
            states = a + np.arange(n + 1)[:, None] / n * (b - a)
            expected = kernels.collide(solid.second, solid.third, states, BAR).any()
            assert motions.motion_collides(solid.second, solid.third, *a, *b, motions.SEARCH_STEP, BAR) == expected
            dense, _ = motions.densify(np.array([a, b]))
            touched = solid.too_near(dense).any()
            assert solid.free([a, b]) == (not touched)
            hits += touched
    assert 100 < hits < 500  # of 600


def test_what_is_verified_is_free_between_the_steps_too():
    """Coal looks twenty times as closely, at motions that pass near a box."""
    rng, close = np.random.default_rng(5), 0
    for seed in SEEDS:
        scene = crowded(seed)
        solid = motions.boxes(scene)
        for _ in range(200):
            path = np.array(motion(rng, 0.15))
            middle = path.mean(axis=0)
            if solid.free(path) and motions.clearance(solid.second, solid.third, *middle, BAR) < 0.01:
                close += 1
                assert experiments.coal_hits(scene, path, longest=1e-4) == 0
    assert close > 10


def test_a_graze_between_two_steps_is_found():
    """A thin box that both ends and every second millimetre miss: true bars at the steps would pass, thicker do not."""
    a = np.array([0.0, 0.0])
    b = np.array([0.0, 2e-3 / 0.476])  # the tip moves by just under 2 mm
    tip = experiments.corners((a + b)[None] / 2)[0, 7]
    scene = BoxScene([[tip[0] + 2.5e-4, 0.1, tip[1] + 0.01, 4e-4, 0.02, 0.0201]])
    solid = motions.boxes(scene)
    assert not solid.collides([a, b]).all()
    assert not solid.free([a, b])


@pytest.mark.parametrize("resolution", [1, 5, 10])
def test_a_map_answers_with_its_nearest_cell(resolution):
    cspace, theta = labels.exact_cspace(random_scene(SEEDS[0]), resolution), labels.angles(resolution)
    rng = np.random.default_rng(6)
    for i, j in rng.integers(0, len(theta), (300, 2)):
        turns, within = 2 * np.pi * rng.integers(-2, 3, 2), rng.uniform(-0.49, 0.49, 2) * np.radians(resolution)
        q = np.array([theta[i], theta[j]]) + turns + within
        assert motions.map_blocks(cspace, *q) == cspace[i, j]


def test_a_motion_on_a_map_meets_what_lies_on_its_way():
    cspace = np.zeros((72, 72), dtype=bool)
    cspace[0, 10] = True  # theta1 = +-180 degrees
    a, b = np.array([[170, -130], [-170, -130]]) * np.pi / 180
    blocks = motions.map_blocks_motion
    assert blocks(cspace, *a, *b, motions.SEARCH_STEP) and blocks(cspace, *b, *a, motions.SEARCH_STEP)
    assert not blocks(cspace, *a, *(a - 0.5), motions.SEARCH_STEP)
    assert blocks(cspace, np.pi, b[1], np.pi, b[1], motions.SEARCH_STEP)  # no motion at all
    assert blocks(cspace, -np.pi, b[1], 0.5, 0.0, motions.SEARCH_STEP)  # either end counts
    assert blocks(cspace, 0.5, 0.0, -np.pi, b[1], motions.SEARCH_STEP)


def test_voxels_are_solid_as_the_octree_has_them():
    rng = np.random.default_rng(7)
    for seed in SEEDS[:3]:
        voxels = grids.voxelize(random_scene(seed))
        q = rng.uniform(-np.pi, np.pi, (300, 2))
        np.testing.assert_array_equal(motions.voxels(voxels).collides(q), labels.octree_collides(voxels, q))


def test_a_single_point_is_a_path():
    solid = motions.boxes(random_scene(SEEDS[0]))
    for q in np.random.default_rng(8).uniform(-np.pi, np.pi, (50, 2)):
        assert solid.free([q]) == (not solid.too_near(q)[0])


@pytest.mark.parametrize("path", [[[0.0, np.nan], [0.0, 0.0]], [0.0, 0.0], np.zeros((3, 3)), "path", None])
def test_odd_paths_are_named(path):
    with pytest.raises((InvalidValue, InvalidType), match="^path = "):
        motions.boxes(random_scene(1)).free(path)
    with pytest.raises((InvalidValue, InvalidType), match="^path = "):
        experiments.coal_hits(random_scene(1), path)
