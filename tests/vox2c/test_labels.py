"""Both kinds of labels, each against coal, which knows nothing of the short cuts; grids against single states."""

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.vox2c import grids, kernels, labels
from tutorialbot.vox2c.scenes import BoxScene, random_scene

RESOLUTIONS = (1, 5, 10)


def states(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, 2))


def test_no_disagreement_with_coals_boxes():
    """Issue: 0 of at least 5,000 random states."""
    wrong = hits = 0
    for seed in range(2000, 2100):
        scene, q = random_scene(seed), states(60, seed)
        coal, ours = labels.coal_test(scene), labels.collides(scene, q)
        wrong += sum(coal(*state) != answer for state, answer in zip(q, ours, strict=True))
        hits += ours.sum()
    assert wrong == 0
    assert 300 < hits < 3000  # of 6,000


@pytest.mark.parametrize("size", [32, 64])
def test_no_disagreement_with_coals_octree(size):
    wrong = hits = 0
    for seed in range(2100, 2150):
        voxels, q = grids.voxelize(random_scene(seed), "raster", size), states(60, seed)
        coal, ours = labels.coal_octree_test(voxels), labels.octree_collides(voxels, q)
        wrong += sum(coal(*state) != answer for state, answer in zip(q, ours, strict=True))
        hits += ours.sum()
    assert wrong == 0
    assert 200 < hits < 2000  # of 3,000


@pytest.mark.parametrize("resolution", [*RESOLUTIONS, 0.5, 2.5, 8, 24, 45, 120, 360])
def test_a_cell_is_the_state_at_its_angles(resolution):
    theta = labels.angles(resolution)
    rng = np.random.default_rng(int(10 * resolution))
    for seed in range(2200, 2210):
        scene = random_scene(seed)
        found = labels.exact_cspace(scene, resolution)
        assert found.shape == (len(theta), len(theta)) and found.dtype == bool
        i, j = rng.integers(0, len(theta), (2, 500))
        np.testing.assert_array_equal(found[i, j], labels.collides(scene, np.column_stack([theta[i], theta[j]])))


@pytest.mark.parametrize("resolution", [360, 180, 120, 90])
def test_grids_of_a_few_cells_equal_single_states(resolution):
    theta = labels.angles(resolution)
    q = np.stack(np.meshgrid(theta, theta, indexing="ij"), axis=-1).reshape(-1, 2)
    hits = 0
    for seed in range(4_100_000, 4_100_060):
        scene = random_scene(seed)
        found = labels.exact_cspace(scene, resolution)
        np.testing.assert_array_equal(found.ravel(), labels.collides(scene, q))
        hits += found.sum()
    assert hits > 0


def test_whole_grids_equal_single_states():
    """Every cell, and boxes everywhere: near the elbow, at the tip's reach, around the axis."""
    theta = labels.angles(5)
    q = np.stack(np.meshgrid(theta, theta, indexing="ij"), axis=-1).reshape(-1, 2)
    rng, cells = np.random.default_rng(9), 0
    for _ in range(60):
        sides = rng.uniform(0.002, 0.5, (4, 3))
        centres = np.array([0.0, 0.075, 0.975]) + rng.uniform(-1, 1, (4, 3)) * [0.6, 0.05, 0.6]
        scene = BoxScene(np.column_stack([centres, sides]))
        found = labels.exact_cspace(scene, 5)
        np.testing.assert_array_equal(found.ravel(), labels.collides(scene, q))
        cells += found.sum()
    assert cells > 10_000


@pytest.mark.parametrize("resolution", RESOLUTIONS)
def test_a_cell_of_the_octrees_grid_is_coals_answer(resolution):
    theta, rng = labels.angles(resolution), np.random.default_rng(resolution)
    for seed in range(2300, 2310):
        voxels = grids.voxelize(random_scene(seed), "raster", 32)
        found, coal = labels.octree_cspace(voxels, resolution), labels.coal_octree_test(voxels)
        for i, j in rng.integers(0, len(theta), (50, 2)):
            assert found[i, j] == coal(theta[i], theta[j])


def test_axes_and_cells_are_as_written():
    """A box where link 2 lies at theta1 = 90 degrees blocks that row; one at link 3's tip blocks a single region."""
    row = labels.exact_cspace(BoxScene([[0.4, 0.05, 0.975, 0.02, 0.04, 0.02]]), 10)
    assert row[27].all() and row.all(axis=1).sum() == row.any(axis=1).sum() < 4  # cell 27 is 90 degrees
    tip = labels.exact_cspace(BoxScene([[0.45, 0.11, 1.44, 0.03, 0.02, 0.03]]), 10)
    assert tip[27, 9] and not tip[9, 27]  # theta1 = 90, theta2 = -90: the elbow out, link 3 up
    assert not tip.all(axis=1).any()


def test_the_kinds_differ_and_voxels_block_more():
    """What a box cuts is full: every true collision is one of its raster's octree too."""
    both = np.zeros(2)
    for seed in range(2400, 2420):
        scene = random_scene(seed)
        exact = labels.exact_cspace(scene, 5)
        octree = labels.octree_cspace(grids.voxelize(scene, "raster", 32), 5)
        assert not (exact & ~octree).any()
        both += exact.sum(), octree.sum()
    assert both[1] > 1.2 * both[0]


def test_faces_that_touch_do_not_collide():
    beside = BoxScene([[0.3, 0.15, 0.975, 0.5, 0.05, 0.5]])  # begins at y = 0.125, where link 3 ends
    assert not labels.exact_cspace(beside, 10).any()


def test_nothing_is_hit_in_an_empty_scene():
    assert not labels.exact_cspace(random_scene(1, boxes=0), 5).any()
    empty = np.zeros((32, 32, 32), bool)
    assert not labels.octree_cspace(empty, 5).any()
    assert not labels.coal_octree_test(empty)(0.3, 0.4)


def test_single_tests_for_planners_agree():
    scene, q = random_scene(2500), states(300, 5)
    voxels = grids.voxelize(scene, "raster", 32)
    for test, many in (
        (labels.state_test(scene), labels.collides(scene, q)),
        (labels.octree_state_test(voxels), labels.octree_collides(voxels, q)),
    ):
        np.testing.assert_array_equal([test(*state) for state in q], many)


def test_turns_do_not_matter():
    scene, q = random_scene(2501), states(500, 6)
    turned = q + 2 * np.pi * np.random.default_rng(7).integers(-3, 4, q.shape)
    np.testing.assert_array_equal(labels.collides(scene, q), labels.collides(scene, turned))


def test_merged_cells_tile_what_is_filled():
    rng = np.random.default_rng(8)
    for share in (0.0, 0.1, 0.5, 0.9, 1.0):
        filled = rng.random((13, 13)) < share
        counted = np.zeros(filled.shape, int)
        found = kernels.merged(filled)
        for x, z, end_x, end_z in found:
            counted[x:end_x, z:end_z] += 1
        np.testing.assert_array_equal(counted, filled)
        assert len(found) <= filled.sum()
    assert len(found) == 1


@pytest.mark.parametrize("resolution", [7, 0, -5, np.nan, 0.01, 400, "5", None, True])
def test_a_resolution_must_divide_the_turn(resolution):
    scene, voxels = random_scene(1), np.zeros((32, 32, 32), bool)
    for call in (
        labels.cells,
        labels.angles,
        lambda r: labels.exact_cspace(scene, r),
        lambda r: labels.octree_cspace(voxels, r),
    ):
        with pytest.raises((InvalidValue, InvalidType), match="^resolution_deg = "):
            call(resolution)


@pytest.mark.parametrize(
    ("voxels", "error"),
    [
        (np.zeros((32, 32)), InvalidValue),
        (np.zeros((32, 32, 31)), InvalidValue),
        (np.zeros((0, 0, 0)), InvalidValue),
        (np.full((8, 8, 8), 0.5), InvalidValue),
        (np.full((8, 8, 8), 2), InvalidValue),
        (np.full((8, 8, 8), np.nan), InvalidValue),
        (np.full((8, 8, 8), "1"), InvalidType),
        (np.full((8, 8, 8), None), InvalidType),
        ([[1, 2], [3]], InvalidType),
        (None, InvalidValue),
    ],
)
def test_grids_that_are_no_binary_cube_are_named(voxels, error):
    for call in (lambda v: labels.octree_cspace(v, 10), lambda v: labels.octree_collides(v, (0, 0)),
                 labels.octree_state_test, labels.coal_octree_test):  # fmt: skip
        with pytest.raises(error, match="^voxels = "):
            call(voxels)


def test_zeros_and_ones_are_binary_whatever_their_type():
    voxels = grids.voxelize(random_scene(3), "raster", 32)
    for kind in (np.uint8, np.int64, np.float32):
        np.testing.assert_array_equal(labels.octree_cspace(voxels.astype(kind), 10), labels.octree_cspace(voxels, 10))


@pytest.mark.parametrize("q", [[[0.0, np.nan]], [[0.0, np.inf]], np.zeros((3, 3)), "up", None])
def test_odd_configurations_are_named(q):
    for call in (lambda q: labels.collides(random_scene(1), q),
                 lambda q: labels.octree_collides(np.zeros((8, 8, 8), bool), q)):  # fmt: skip
        with pytest.raises((InvalidValue, InvalidType), match="^q = "):
            call(q)


@pytest.mark.parametrize("scene", [None, np.zeros((15, 6)), "scene"])
def test_a_scene_is_a_scene(scene):
    for call in (lambda s: labels.exact_cspace(s, 10), lambda s: labels.collides(s, (0, 0)), labels.state_test,
                 labels.coal_test):  # fmt: skip
        with pytest.raises(InvalidType, match="^scene = "):
            call(scene)
