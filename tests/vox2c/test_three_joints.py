"""The arm with a third bar: its whole C-space against single states, and those against coal."""

import coal
import numpy as np
import pinocchio as pin
import pytest

from tutorialbot.errors import InvalidValue
from tutorialbot.vox2c import labels, three_joints
from tutorialbot.vox2c.arm import ELBOW, HALF_LENGTH, HALF_WIDTH, MIDDLE, OFFSET, link_poses
from tutorialbot.vox2c.scenes import BoxScene, random_scene

SEEDS = range(4_400_000, 4_400_020)


def test_states_are_coals():
    """Poses by pinocchio's SE3, boxes in 3-D: 0 of 2,000 states disagree."""
    bar, middle = coal.Box(2 * HALF_WIDTH, 2 * HALF_WIDTH, 2 * HALF_LENGTH), np.array([0, 0, MIDDLE])
    wrong = hits = 0
    for seed in SEEDS:
        scene, q = random_scene(seed), np.random.default_rng(seed).uniform(-np.pi, np.pi, (100, 3))
        low, high = scene.corners
        corners = zip(low, high, strict=True)
        things = [(coal.Box(*(b - a)), coal.Transform3s(np.eye(3), (a + b) / 2)) for a, b in corners]
        for state, ours in zip(q, three_joints.collides_3(scene, q), strict=True):
            first, second = link_poses(state[:2])
            turned = pin.SE3(pin.exp3(np.array([0.0, state[2], 0.0])), np.array([0.0, OFFSET, ELBOW]))
            placed = [coal.Transform3s(p.rotation, p.act(middle)) for p in (first, second, second * turned)]
            answer = any(
                coal.collide(bar, one, shape, where, coal.CollisionRequest(), coal.CollisionResult())
                for one in placed for shape, where in things
            )  # fmt: skip
            wrong, hits = wrong + (answer != ours), hits + answer
    assert wrong == 0 and 100 < hits < 1500


@pytest.mark.parametrize("resolution", [5, 10, 30])
def test_a_cell_is_the_state_at_its_angles(resolution):
    theta = labels.angles(resolution)
    for seed in SEEDS[:3]:
        scene = random_scene(seed)
        found = three_joints.exact_cspace_3(scene, resolution)
        assert found.shape == (len(theta),) * 3 and found.dtype == bool
        index = np.random.default_rng(seed).integers(0, len(theta), (1000, 3))
        np.testing.assert_array_equal(found[tuple(index.T)], three_joints.collides_3(scene, theta[index]))
        plane = labels.exact_cspace(scene, resolution)
        assert found[plane].all()  # where two bars collide, a third one changes nothing


def test_nothing_collides_with_nothing():
    assert not three_joints.exact_cspace_3(BoxScene(np.empty((0, 6))), 10).any()


def test_maps_grow_with_the_power_of_the_joints():
    sizes = {size.joints: size for size in three_joints.map_sizes(5)}
    assert sizes[3].cells == three_joints.exact_cspace_3(random_scene(1), 5).size == 373_248
    assert sizes[6].cells == 72**6 and sizes[6].gigabytes == pytest.approx(139.3, abs=0.1)


@pytest.mark.parametrize("resolution", [7, 120, 360, np.nan])
def test_resolutions_that_do_not_fit_are_named(resolution):
    """Of 120 degrees make three cells: the middle of the turn is no cell then."""
    with pytest.raises(InvalidValue, match="^resolution_deg = "):
        three_joints.exact_cspace_3(random_scene(1), resolution)


@pytest.mark.parametrize("q", [np.zeros((2, 2)), [[0, 0, np.nan]], [0, 0, 0]])
def test_odd_configurations_are_named(q):
    with pytest.raises(InvalidValue, match="^q = "):
        three_joints.collides_3(random_scene(1), q)
