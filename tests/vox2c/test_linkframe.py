"""The link-frame predictor: its compiled parts against plain ones, the cull against exact tests, its weights' IoU."""

import math

import numpy as np
import pytest
from scipy.signal import correlate

from tutorialbot.errors import BrokenFile, InvalidValue
from tutorialbot.runs import RunRecord
from tutorialbot.vox2c import arm, evaluation, grids, labels, linkframe, linkframe_data, scenes, weights
from tutorialbot.vox2c import kernels as exact
from tutorialbot.vox2c import linkframe_kernels as kernels

DESIGNS = [linkframe.Design(), linkframe.Design(size=64, maps=3, filters=5, hidden=(9, 7), outset=0.02, spread=1)]


def random_tensors(design, seed=0):
    rng = np.random.default_rng(seed)
    return {name: rng.normal(0.0, 0.2, shape).astype(np.float32) for name, shape in design.shapes().items()}


def predictor(design):
    return linkframe.Predictor("random", design, random_tensors(design))


def voxels(seed, size):
    return grids.voxelize(scenes.random_scene(seed), "raster", size)


def random_poses(count, seed):
    """Joint x, z from the domain's corner, and angle, of either link."""
    rng = np.random.default_rng(seed)
    theta1, angle = rng.uniform(-np.pi, np.pi, (2, count))
    reach = arm.ELBOW * rng.integers(0, 2, count)
    joints = np.array([arm.JOINT_1[0], arm.JOINT_1[2]]) + reach[:, None] * np.column_stack(
        [np.sin(theta1), np.cos(theta1)]
    )
    return np.column_stack([linkframe.corner(joints), angle])


@pytest.mark.parametrize("design", DESIGNS)
def test_the_maps_are_two_plain_convolutions(design):
    grid, tensors = voxels(6000, design.size), random_tensors(design)
    first, end = design.layers
    planes = grid[:, first:end].transpose(1, 0, 2).astype(float)
    for name in ("conv1", "conv2"):
        weight, bias = tensors[f"{name}.weight"].astype(float), tensors[f"{name}.bias"]
        planes = [
            bias[i] + sum(correlate(plane, w, "same") for plane, w in zip(planes, weight[i], strict=True))
            for i in range(len(bias))
        ]
        planes = [np.maximum(plane, 0.0) for plane in planes] if name == "conv1" else planes
    found = predictor(design).maps(grid)
    pad = linkframe.PAD
    inner = found[:, pad:-pad, pad:-pad].transpose(0, 3, 1, 2).reshape(len(planes), design.size, design.size)
    assert np.allclose(inner, planes, atol=1e-4)
    assert found.sum() == pytest.approx(inner.sum(), rel=1e-3)  # zero around


def plain_features(maps, pose, design):
    """One pose's features, as slowly and plainly as can be."""
    x, z, angle = pose
    s, c, found = math.sin(angle), math.cos(angle), []
    for along, across in design.points:
        u = (x + along * s + across * c) / design.cell - 0.5
        v = (z + along * c - across * s) / design.cell - 0.5
        i, k = math.floor(u), math.floor(v)
        for channel in range(design.maps):
            total = 0.0
            for di, wi in ((0, 1 - (u - i)), (1, u - i)):
                for dk, wk in ((0, 1 - (v - k)), (1, v - k)):
                    total += wi * wk * maps[i + di + linkframe.PAD, k + dk + linkframe.PAD, channel]
            found.append(total)
    found += [f(m * angle) for m in (1, 2, 4) for f in (math.sin, math.cos)]
    return found + [f(2 * math.pi * place / design.cell) for place in (x, z) for f in (math.sin, math.cos)]


@pytest.mark.parametrize("design", DESIGNS)
def test_the_compiled_features_are_the_plain_ones(design):
    maps = predictor(design).maps(voxels(6001, design.size))
    poses = random_poses(60, 1)
    found = np.empty((len(poses), len(design.points) * design.maps + linkframe.PHASES), dtype=np.float32)
    kernels.pose_features(maps[1], poses, design.points, design.cell, linkframe.PAD, found)
    expected = np.array([plain_features(maps[1], pose, design) for pose in poses])
    assert np.allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize("size", linkframe.SIZES)
def test_the_cull_without_outset_is_the_octree(size):
    """So it never frees a pose that touches a voxel; and it frees all others."""
    design = linkframe.Design(size=size)
    for seed in range(6010, 6030):
        for resolution_deg in (5, 7.2):
            grid = voxels(seed, size)
            found = linkframe.culled_cspace(grid, resolution_deg, design)
            assert np.array_equal(found, labels.octree_cspace(grid, resolution_deg))


@pytest.mark.parametrize("design", DESIGNS)
def test_the_cull_of_single_poses_never_frees_one_that_touches(design):
    poses, touched = random_poses(400, 2), 0
    for seed in range(6030, 6045):
        scene = scenes.random_scene(seed)
        grid = voxels(seed, design.size)
        for link, slab in enumerate(arm.SLABS):
            occupied = kernels.occupied_words(grid, *design.cull_layers(link))
            left = kernels.touching_poses(poses, occupied, design.bar, design.cell, design.size)
            for corners in (linkframe_data.voxel_corners(grid, design.cell), scene.corners):
                rectangles = exact.rectangles(*corners, *slab, arm.DOMAIN[0][0], arm.DOMAIN[0][2])
                hit = kernels.bars_meet(rectangles, poses, arm.BAR)
                assert not (hit & ~left).any()
                touched += hit.sum()
            assert left.sum() < 0.6 * len(poses)
    assert touched > 300


def test_a_prediction_is_each_pose_judged_by_itself():
    """Also: a pose that the cull frees is free for certain."""
    design = DESIGNS[0]
    one, grid = predictor(design), voxels(6002, 32)
    found, maps = one.predict(grid, 10), one.maps(voxels(6002, 32))
    for k, m in np.random.default_rng(3).integers(0, 36, (60, 2)):
        theta1, theta2 = np.radians(-180.0 + 10.0 * np.array([k, m]))
        elbow = arm.forward_kinematics([theta1, theta2])[0, 1]
        joints = ((arm.JOINT_1[0], arm.JOINT_1[2], theta1), (elbow[0], elbow[2], theta1 + theta2))
        free = 1.0
        for link, (x, z, angle) in enumerate(joints):
            pose = np.array([[*linkframe.corner(np.array([x, z])), angle]])
            occupied = kernels.occupied_words(grid, *design.cull_layers(link))
            if kernels.touching_poses(pose, occupied, design.bar, design.cell, design.size)[0]:
                free *= 1.0 - one.judge(link, maps, pose)[0]
        assert found[k, m] == pytest.approx(1.0 - free, abs=2e-3)  # a row that is certain is left alone


def test_a_coarse_prediction_is_part_of_a_fine_one():
    one, grid = predictor(DESIGNS[0]), voxels(6003, 32)
    assert np.allclose(one.predict(grid, 5)[::2, ::2], one.predict(grid, 10), atol=1e-5)
    assert one.predict(grid, 3.6).shape == (100, 100)


def test_nothing_in_sight_means_free():
    assert predictor(DESIGNS[0]).predict(np.zeros((32, 32, 32)), 5).max() == 0.0


def test_bad_input_is_refused():
    one, good = predictor(DESIGNS[0]), np.zeros((32, 32, 32))
    for grid in (np.zeros((64, 64, 64)), np.zeros((32, 32)), good + 2, good + np.nan):
        with pytest.raises(ValueError, match="voxels"):
            one.predict(grid, 5)
    for resolution_deg in (7, 0, -5, np.nan, 0.1):
        with pytest.raises(InvalidValue, match="resolution_deg"):
            one.predict(good, resolution_deg)
    with pytest.raises(InvalidValue, match="size"):
        linkframe.Design(size=48)


def store(folder, design, **values):
    values = {"network": linkframe.NETWORK, "settings": linkframe.settings_of(design), "threshold": 0.45} | values
    weights.save(random_tensors(design), RunRecord("one", "", 0, "quick", 0.0, values), folder)


def test_what_was_stored_predicts_the_same(tmp_path):
    store(tmp_path, DESIGNS[1])
    found, grid = linkframe.load("one", tmp_path), voxels(6004, 64)
    assert found.threshold == 0.45 and found.design == DESIGNS[1]
    assert np.allclose(found.predict(grid, 10), predictor(DESIGNS[1]).predict(grid, 10), atol=0.02)  # float16


@pytest.mark.parametrize(
    "values",
    [
        {"settings": {}},
        {"settings": {"maps": 3}},
        {"settings": None},
        *({"settings": {"size": 64, name: None}} for name in ("below", "maps", "hidden", "along", "across")),
        {"settings": {"below": math.nan}},
        *({"threshold": threshold} for threshold in ("x", None, -1, 2.0, math.nan)),
    ],
)
def test_a_record_that_does_not_fit_is_refused(tmp_path, values):
    store(tmp_path, DESIGNS[1], **values)
    with pytest.raises(BrokenFile, match="one"):
        linkframe.load("one", tmp_path)


def test_another_network_is_refused(tmp_path):
    store(tmp_path, DESIGNS[1], network="paper")
    with pytest.raises(InvalidValue, match="link-frame"):
        linkframe.load("one", tmp_path)


# name, the pooled IoU that 200 fresh scenes must reach: the record's less four of their standard errors
COMMITTED = [
    ("linkframe-raster", 0.73),
    ("linkframe-shell", 0.73),
    ("linkframe-raster64", 0.81),
    ("linkframe-octree", 0.98),
]


@pytest.mark.parametrize(("name", "bound"), COMMITTED)
def test_the_committed_weights_are_as_good_as_their_record_says(name, bound):
    one = linkframe.load(name)
    training = one.record.values["training"]
    scenes_ = evaluation.labelled(range(6100, 6300), training["source"], one.design.size, training["kind"], 5)
    found = evaluation.measure(one.predict, scenes_, 5).iou(one.threshold)
    assert found.pooled > bound
    recorded = one.record.values["evaluation"][0]
    assert abs(found.pooled - recorded["pooled"]) < 4 * math.hypot(found.pooled_error, recorded["pooled_error"])
