"""Training of the link-frame predictor: what it learns from, that torch and numba agree, resume, the seeds it uses."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from tutorialbot.errors import BrokenFile
from tutorialbot.vox2c import dataset, grids, labels, linkframe, linkframe_data, scenes
from tutorialbot.vox2c import linkframe_training as training

DESIGN = linkframe.Design(filters=4, maps=2, hidden=(8, 4), along=(-0.1, 0.55, 5), across=(-0.1, 0.1, 3))
TINY = linkframe_data.Settings(DESIGN, steps=6, scenes=6, fresh=4)


@pytest.fixture(autouse=True)
def one_thread(monkeypatch):
    training.use_threads(1)
    monkeypatch.setattr(training, "EVERY", 2)


@pytest.mark.parametrize("size", linkframe.SIZES)
def test_torch_and_numba_see_the_same(size):
    design = replace(DESIGN, size=size)
    model = training.begin(linkframe_data.Settings(design))
    one = linkframe.Predictor("one", design, {key: value.numpy() for key, value in model.state_dict().items()})
    grid = grids.voxelize(scenes.random_scene(6500), "raster", size)
    poses = np.concatenate([linkframe_data.drawn_poses(np.random.default_rng(0), link)[:48] for link in (0, 1)])
    first, end = design.layers
    with torch.inference_mode():
        maps = model.maps(torch.from_numpy(grid[:, first:end].transpose(1, 0, 2)[None].astype(np.float32)))
        for link in (0, 1):
            logits = model.judge(
                link, maps, torch.zeros(6, dtype=torch.int64), torch.from_numpy(poses).float().view(6, 16, 3)
            )
            expected = torch.sigmoid(logits).flatten().numpy()
            assert np.allclose(one.judge(link, one.maps(grid), poses), expected, atol=1e-4)


def test_a_mirrored_scene_has_the_mirrored_c_space():
    """theta to -theta: cell k to -k."""
    for source in ("raster", "cameras"):
        scene = scenes.random_scene(6501)
        other, grid = linkframe_data.mirrored(scene, grids.voxelize(scene, source))
        flip = -np.arange(72) % 72
        assert np.array_equal(labels.exact_cspace(other, 5), labels.exact_cspace(scene, 5)[np.ix_(flip, flip)])
        differing = (grid != grids.voxelize(other, source)).sum()
        assert differing == 0 if source == "raster" else differing < 0.05 * grid.sum()


@pytest.mark.parametrize("kind", labels.KINDS)
def test_labels_are_those_of_single_states(kind):
    """Of link 2, with boxes or voxels that link 3 cannot reach: it collides exactly when the arm does."""
    settings, rng, seen = replace(TINY, kind=kind), np.random.default_rng(0), np.zeros(2, dtype=int)
    for seed in range(6510, 6560):
        boxes = scenes.random_scene(seed, boxes=30).boxes
        scene = scenes.BoxScene(boxes[boxes[:, 1] + boxes[:, 4] / 2 < 0.07])  # below layer 17 along y
        grid = grids.voxelize(scene, "raster")
        poses, hits = linkframe_data.judged_poses(settings, scene, grid, rng)[0]
        q = np.column_stack([poses[:, 2], np.zeros(len(poses))])
        arm = labels.collides(scene, q) if kind == "exact" else labels.octree_collides(grid, q)
        assert np.array_equal(arm, hits)
        seen += [(~hits).sum(), hits.sum()]
    assert seen.min() > 20 if kind == "exact" else seen[1] > 20


def test_a_step_learns_from_the_same_whatever_came_before():
    one = linkframe_data.sample(TINY, linkframe_data.Scenes(TINY), 3)
    scenes_ = linkframe_data.Scenes(TINY)
    for step in range(4):
        other = linkframe_data.sample(TINY, scenes_, step)
    assert torch.equal(one.slabs, other.slabs)
    for first, second in zip(one.links, other.links, strict=True):
        assert all(torch.equal(a, b) for a, b in zip(first, second, strict=True))
    assert not torch.equal(one.slabs, linkframe_data.sample(replace(TINY, seed=1), scenes_, 3).slabs)


def test_groups_hold_every_pose_once():
    found = [
        (np.ones((5, 3)), np.ones(5, bool)),
        (np.ones((0, 3)), np.ones(0, bool)),
        (np.ones((17, 3)), np.zeros(17, bool)),
    ]
    scene, poses, truth, weight = linkframe_data._grouped(found)
    assert scene.tolist() == [0, 2, 2] and poses.shape == (3, 16, 3)
    assert weight.sum(1).tolist() == [5, 16, 1] and truth.sum(1).tolist() == [5, 0, 0]


def test_the_seeds_of_training_meet_no_others():
    """Nor the data set's."""
    last = linkframe_data.TRAINING + 100 * linkframe_data.SPAN
    assert last <= linkframe_data.VALIDATION < linkframe_data.EVALUATION - training.VALIDATED
    assert all(first + dataset.LARGEST < linkframe_data.TRAINING for first in dataset.SPLITS.values())


@pytest.mark.parametrize(
    "changes", [{"seed": 100}, {"fresh": 7}, {"steps": 0}, {"rate": 0.0}, {"source": "x"}, {"kind": "x"}]
)
def test_settings_out_of_range_are_refused(changes):
    with pytest.raises(ValueError, match=next(iter(changes))):
        replace(TINY, **changes)


def test_it_learns(tmp_path):
    settings = replace(TINY, steps=60, scenes=24, fresh=24)
    losses = [one.loss for one in training.train(settings, tmp_path)]
    assert np.mean(losses[-5:]) < 0.9 * np.mean(losses[:3])


def test_a_run_that_was_interrupted_ends_as_one_that_was_not(tmp_path):
    whole = list(training.train(TINY, tmp_path / "a"))
    list(itertools.islice(training.train(TINY, tmp_path / "b"), 2))  # ... killed
    second = list(training.train(TINY, tmp_path / "b"))
    assert [(one.step, one.loss) for one in whole] == [(one.step, one.loss) for one in second]
    one, other = (load_file(tmp_path / name / "last.safetensors") for name in "ab")
    assert one.keys() == other.keys() and all(torch.equal(one[key], other[key]) for key in one)


def test_an_unfinished_or_other_run_is_not_stored(tmp_path):
    next(training.train(TINY, tmp_path))
    with pytest.raises(BrokenFile, match="not finished"):
        training.finish("one", TINY, tmp_path, "", tmp_path)
    with pytest.raises(BrokenFile, match="another run"):
        next(training.train(replace(TINY, seed=1), tmp_path))


def test_a_finished_run_is_stored_with_its_measures(tmp_path, monkeypatch):
    monkeypatch.setattr(training, "VALIDATED", 6)
    monkeypatch.setattr(training, "EVALUATED", 4)
    list(training.train(TINY, tmp_path))
    path = training.finish("one", TINY, tmp_path, "the command", tmp_path / "out")
    values = linkframe.load(path.stem, tmp_path / "out").record.values
    assert values["training"]["seed"] == 0 and len(values["curve"]) == 3
    methods = [row["method"] for row in values["evaluation"]]
    assert methods == ["one", "lookup table", "ceiling of the voxels"]
    assert {row["scenes"] for row in values["evaluation"]} == {4} and values["evaluation"][0]["lead"] == 0.0
