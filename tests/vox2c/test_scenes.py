"""Scenes of boxes: as the paper draws them, the same for the same seed, impossible ones refused."""

import mujoco
import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.vox2c import arm, labels
from tutorialbot.vox2c.scenes import CLEARANCE, SIDES, BoxScene, random_scene

SEEDS = range(500, 700)


def test_boxes_are_as_the_paper_says():
    boxes = np.concatenate([random_scene(seed).boxes for seed in SEEDS])
    assert boxes.shape == (15 * len(SEEDS), 6)
    sides, (low, high) = boxes[:, 3:], np.array(arm.DOMAIN)
    assert sides.min() >= SIDES[0] == 0.10 and sides.max() <= SIDES[1] == 0.35
    quartiles = np.array([[0.1625], [0.225], [0.2875]])
    assert np.abs(np.quantile(sides, [0.25, 0.5, 0.75], axis=0) - quartiles).max() < 0.01
    assert (boxes[:, :3] - sides / 2 >= low).all() and (boxes[:, :3] + sides / 2 <= high).all()


def test_random_boxes_keep_clear_of_the_column_and_of_joint_1():
    low, high = np.array(arm.COLUMN)
    for seed in SEEDS:
        scene = random_scene(seed)
        gaps = np.maximum(scene.corners[0] - high, low - scene.corners[1]).max(axis=1)
        assert gaps.min() >= CLEARANCE - 1e-12
        assert not labels.exact_cspace(scene, 10).all()


def test_the_same_seed_gives_the_same_scene():
    np.testing.assert_array_equal(random_scene(7).boxes, random_scene(7).boxes)
    assert (random_scene(7).boxes != random_scene(8).boxes).all()
    assert random_scene(7, boxes=0).boxes.shape == (0, 6)
    np.testing.assert_array_equal(random_scene(7, boxes=3).boxes, random_scene(7).boxes[:3])


def test_a_scene_cannot_be_changed_and_changes_nobody():
    boxes = np.array([[0.5, 0.0, 0.5, 0.1, 0.1, 0.1]])
    scene = BoxScene(boxes)
    boxes[0, 0] = 0.6
    assert scene.boxes[0, 0] == 0.5
    with pytest.raises(ValueError, match="read-only"):
        scene.boxes[0, 0] = 0.6


def test_the_model_shows_what_the_scene_says():
    scene = random_scene(11)
    model, bare = scene.model(), scene.model(seen=False)
    for one in (model, bare):
        for i, box in enumerate(scene.boxes):
            np.testing.assert_allclose(one.geom(f"box{i}").pos, box[:3])
            np.testing.assert_allclose(2 * one.geom(f"box{i}").size, box[3:])
        assert one.nq == 2 and one.joint("joint1").qposadr[0] == 0
    assert bare.ngeom == 3 + 1 + 15 < model.ngeom


def test_mujocos_contacts_are_the_collisions():
    """A third, independent answer beside the kernel's and coal's."""
    scene, q = random_scene(12), np.random.default_rng(4).uniform(-np.pi, np.pi, (200, 2))
    model = scene.model(seen=False)
    data = mujoco.MjData(model)
    found = []
    for state in q:
        data.qpos[:] = state
        mujoco.mj_forward(model, data)
        found.append(data.ncon > 0)
    np.testing.assert_array_equal(found, labels.collides(scene, q))
    assert 0 < np.mean(found) < 1


BOX = [0.5, 0.0, 0.5, 0.2, 0.2, 0.2]


@pytest.mark.parametrize(
    ("boxes", "error", "words"),
    [
        ([[*BOX[:5], 0.0]], InvalidValue, r"^boxes\[0\] = .*sides > 0"),
        ([BOX, [*BOX[:3], 0.2, -0.2, 0.2]], InvalidValue, r"^boxes\[1\] = .*sides > 0"),
        ([[1.1, *BOX[1:]]], InvalidValue, r"^boxes\[0\] = .*wholly between"),
        ([[0.5, 0.0, 0.05, 0.2, 0.2, 0.2]], InvalidValue, r"^boxes\[0\] = .*wholly between"),
        ([[0.5, 0.0, 5.0, 0.2, 0.2, 0.2]], InvalidValue, r"^boxes\[0\] = .*wholly between"),
        ([[np.nan, *BOX[1:]]], InvalidValue, "^boxes = .*finite"),
        ([BOX[:5]], InvalidValue, r"^boxes = .*shape \(-1, 6\)"),
        (BOX, InvalidValue, r"^boxes = .*shape"),
        ("boxes", InvalidType, "^boxes = "),
        (None, InvalidValue, "^boxes = "),
    ],
)
def test_impossible_boxes_are_named(boxes, error, words):
    with pytest.raises(error, match=words):
        BoxScene(boxes)


def test_boxes_may_touch_the_walls_of_the_domain():
    BoxScene([[1.05, -1.05, 0.1, 0.2, 0.2, 0.2]])


@pytest.mark.parametrize(("argument", "value"), [("seed", -1), ("seed", 1.5), ("boxes", -1), ("boxes", "15")])
def test_odd_numbers_are_named(argument, value):
    with pytest.raises((InvalidValue, InvalidType), match=f"^{argument} = "):
        random_scene(**{"seed": 1, argument: value})
