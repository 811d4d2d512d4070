"""Training of the paper's network: it learns, resumes bit for bit, stops early, and refuses what is not its own."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch

from tutorialbot.errors import BrokenFile, InvalidValue
from tutorialbot.paths import DATA
from tutorialbot.vox2c import dataset, labels, network, training
from tutorialbot.vox2c.grids import voxelize
from tutorialbot.vox2c.scenes import BoxScene, random_scene

TINY = training.Settings(5, 24, 1 / 64, epochs=3, batch=4, round_scenes=8, rate=3e-3)


@pytest.fixture(scope="module")
def pairs():
    """Of the small set: to train with, and for validation."""
    training.use_threads(1)
    return [
        dataset.read(TINY.recipe, split, count, DATA / "vox2c") for split, count in (("train", 24), ("validation", 6))
    ]


def tensors(folder, name="last"):
    from safetensors.torch import load_file

    return load_file(folder / f"{name}.safetensors")


def test_it_learns(pairs, tmp_path):
    rounds = list(training.train(*pairs, replace(TINY, epochs=6), tmp_path))
    assert rounds[-1].loss < 0.9 * rounds[0].loss
    assert [one.step for one in rounds] == sorted({one.step for one in rounds})
    assert rounds[-1].epoch == 6.0


def test_a_run_that_was_interrupted_ends_as_one_that_was_not(pairs, tmp_path):
    whole = list(training.train(*pairs, TINY, tmp_path / "a"))
    first = list(itertools.islice(training.train(*pairs, TINY, tmp_path / "b"), 3))  # ... killed
    second = list(training.train(*pairs, TINY, tmp_path / "b"))
    assert len(first) < len(whole) == len(second)
    assert [replace(one, seconds=0.0) for one in whole] == [replace(one, seconds=0.0) for one in second]
    for name in ("last", "best"):
        one, other = tensors(tmp_path / "a", name), tensors(tmp_path / "b", name)
        assert one.keys() == other.keys() and all(torch.equal(one[key], other[key]) for key in one)


def test_no_minutes_no_steps_and_the_seed_decides(pairs, tmp_path):
    assert list(training.train(*pairs, TINY, tmp_path / "a", minutes=0.0)) == []
    runs = [next(training.train(*pairs, replace(TINY, seed=seed), tmp_path / str(seed))) for seed in (1, 2)]
    assert runs[0].loss != runs[1].loss


def test_it_stops_when_validation_does_not_get_better(pairs, tmp_path):
    """Of empty labels no IoU ever rises."""
    nothing = [replace(one, cspaces=np.zeros_like(one.cspaces)) for one in pairs]
    rounds = list(training.train(*nothing, replace(TINY, epochs=50, patience=2), tmp_path))
    assert 2.0 <= rounds[-1].epoch < 5.0


@pytest.mark.parametrize("damage", ["cut", "garbage", "other"])
def test_a_checkpoint_that_is_damaged_or_anothers_is_refused(pairs, tmp_path, damage):
    next(training.train(*pairs, TINY, tmp_path))
    path = tmp_path / "last.safetensors"
    content = path.read_bytes()
    path.write_bytes({"cut": content[: len(content) // 2], "garbage": b"no", "other": content}[damage])
    settings = replace(TINY, rate=1e-4) if damage == "other" else TINY
    with pytest.raises(BrokenFile, match="another run" if damage == "other" else "damaged or cut short"):
        next(training.train(*pairs, settings, tmp_path))
    assert next(training.train(*pairs, settings, tmp_path, fresh=True)).step > 0


def test_what_is_stored_is_the_best_round(pairs, tmp_path):
    rounds = list(training.train(*pairs, TINY, tmp_path))
    path = training.finish(TINY, tmp_path, "the command", pairs[1], tmp_path / "out")
    predictor = network.load(path.stem, tmp_path / "out")
    best = max(rounds, key=lambda one: one.iou)
    assert predictor.record.values["best"]["step"] == best.step
    assert len(predictor.record.values["curve"]) == len(rounds) and predictor.record.command == "the command"
    stored = tensors(tmp_path, "best")["model.decoder.0.weight"].half().float()
    assert torch.equal(predictor.model.state_dict()["decoder.0.weight"], stored)


@pytest.mark.parametrize(
    "changes", [{"scenes": 0}, {"epochs": 0}, {"width": -1.0}, {"source": "lidar"}, {"kind": "x"}, {"batch": 0}]
)
def test_settings_out_of_range_are_refused(changes):
    with pytest.raises(ValueError, match=next(iter(changes))):
        replace(TINY, **changes)


def test_pairs_that_are_not_what_the_settings_say_are_refused(pairs, tmp_path):
    with pytest.raises(InvalidValue, match="pairs"):
        next(training.train(*pairs, replace(TINY, scenes=25), tmp_path))
    with pytest.raises(InvalidValue, match="pairs"):
        next(training.train(*pairs, replace(TINY, kind="octree"), tmp_path))


def test_a_mirrored_scene_has_the_mirrored_c_space():
    for seed in range(4):
        scene = random_scene(seed)
        other = BoxScene(scene.boxes * [-1, 1, 1, 1, 1, 1])
        grids_and_maps = [(voxelize(one, "raster"), labels.exact_cspace(one, 5)) for one in (scene, other)]
        (voxels, truth), (expected_voxels, expected) = [map(torch.from_numpy, pair) for pair in grids_and_maps]
        found = training.mirror(voxels[None, None], truth[None])
        assert torch.equal(found[0][0, 0], expected_voxels) and torch.equal(found[1][0], expected)


def test_mirrored_scenes_are_drawn_and_the_seed_decides(pairs, tmp_path):
    settings = [replace(TINY, mirror=flag, seed=seed) for flag, seed in ((True, 1), (True, 1), (False, 1))]
    found = [next(training.train(*pairs, one, tmp_path / str(i))).loss for i, one in enumerate(settings)]
    assert found[0] == found[1] != found[2]


def test_a_step_in_parts_is_the_same_step(pairs, tmp_path, monkeypatch):
    found = []
    for parts in (1, 3, 16):
        monkeypatch.setitem(training.AT_ONCE, 5, parts)
        run = training.Run(*pairs, TINY, tmp_path, torch.device("cpu"))
        losses = [float(run.learn(step)) for step in range(3)]
        found.append((losses, run.model.decoder[0].weight.detach().clone()))
    for losses, weight in found[1:]:
        assert losses == pytest.approx(found[0][0], rel=1e-4)
        assert torch.allclose(weight, found[0][1], atol=2e-4)


def test_a_checkpoint_that_cannot_be_written_is_named(pairs, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BrokenFile, match="cannot be written"):
        next(training.train(*pairs, TINY, tmp_path / "file"))
