"""Shards of pairs: what the seeds say, whole or noticed, made once; and the small set that is committed."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue
from tutorialbot.paths import DATA, ROOT
from tutorialbot.vox2c import dataset, grids, labels, shards
from tutorialbot.vox2c.dataset import CHUNK, SPLITS, Recipe
from tutorialbot.vox2c.scenes import random_scene

QUICK = Recipe(10, "raster")


def files(folder) -> dict:
    return {path: path.stat().st_mtime_ns for path in sorted(folder.rglob("*.bits"))}


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pairs")
    assert dataset.make(QUICK, "test", CHUNK + 1, folder, jobs=1) == 4
    return folder


@pytest.fixture
def made(fresh, tmp_path):
    return shutil.copytree(fresh, tmp_path / "made")


def test_pairs_are_what_their_seeds_say(made):
    pairs = dataset.read(QUICK, "test", CHUNK + 1, made)
    assert len(pairs) == CHUNK + 1 and pairs.seeds[0] == SPLITS["test"]
    index = np.array([0, 7, CHUNK - 1, CHUNK])
    voxels, cspaces = pairs.batch(index)
    assert voxels.shape == (4, 32, 32, 32) and cspaces.shape == (4, 36, 36) and voxels.dtype == cspaces.dtype == bool
    for seed, cube, cspace in zip(pairs.seeds[index], voxels, cspaces, strict=True):
        scene = random_scene(int(seed))
        np.testing.assert_array_equal(cube, grids.voxelize(scene, "raster"))
        np.testing.assert_array_equal(cspace, labels.exact_cspace(scene, 10))


def test_nothing_is_made_twice(made):
    before = files(made)
    assert dataset.make(QUICK, "test", CHUNK + 1, made, jobs=1) == 0
    assert files(made) == before


def test_voxels_are_shared_and_kinds_of_labels_never_mix(made):
    octree = Recipe(10, "raster", labels="octree")
    assert dataset.make(octree, "test", 10, made, jobs=1) == 1
    names = {folder.name for folder in made.iterdir()}
    assert names == {"voxels-raster-32", "exact-10deg", "octree-raster-32-10deg"}
    voxels, blocked = dataset.read(octree, "test", 10, made).batch(slice(None))
    _, exact = dataset.read(QUICK, "test", 10, made).batch(slice(None))
    for cube, cspace in zip(voxels, blocked, strict=True):
        np.testing.assert_array_equal(cspace, labels.octree_cspace(cube, 10))
    assert (blocked != exact).any()


def cut(path):
    path.write_bytes(path.read_bytes()[:-100])


def flip(path):
    content = bytearray(path.read_bytes())
    content[-50] ^= 1
    path.write_bytes(content)


def empty(path):
    path.write_bytes(b"")


def headless(path):
    path.write_bytes(path.read_bytes().partition(b"\n")[2])


def of_another_seed(path):
    header, _, body = path.read_bytes().partition(b"\n")
    path.write_bytes(json.dumps({**json.loads(header), "first_seed": 1}).encode() + b"\n" + body)


def misshapen(path):
    header, _, body = path.read_bytes().partition(b"\n")
    path.write_bytes(json.dumps({**json.loads(header), "shape": [1, "x"]}).encode() + b"\n" + body)


def deep(path):
    path.write_bytes(b"[" * 900 + b"\n")


def gone(path):
    path.unlink()


@pytest.mark.parametrize("damage", [cut, flip, empty, headless, of_another_seed, misshapen, deep, gone])
@pytest.mark.parametrize("which", [0, 3])  # labels of the first chunk, voxels of the second
def test_a_damaged_file_is_named_and_made_again_and_the_others_stay(made, damage, which):
    before = files(made)
    path = list(before)[which]
    content = path.read_bytes()
    damage(path)
    with pytest.raises(BrokenFile, match=str(path)):
        dataset.read(QUICK, "test", CHUNK + 1, made)
    assert dataset.make(QUICK, "test", CHUNK + 1, made, jobs=1) == 1
    assert path.read_bytes() == content
    after = files(made)
    assert [p for p in before if after[p] != before[p]] == [path]


def test_files_of_other_code_are_made_again(made, monkeypatch):
    """Whole files, but the first scene is another one now."""
    path = next(iter(files(made)))
    other = np.roll(shards.read(path, {}, 162), 1, axis=0)
    about = {"holds": "exact-10deg", "first_seed": SPLITS["test"], "scenes": CHUNK}
    shards.write(path, about, other)
    assert dataset.make(QUICK, "test", CHUNK + 1, made, jobs=1) == 1
    assert (shards.read(path, about, 162) != other).any()


def test_leftovers_of_killed_processes_are_swept(made):
    folder = made / "exact-10deg"
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    (folder / f".1.bits.{dead.pid}.part").write_bytes(b"half")
    (folder / f".2.bits.{os.getpid()}.part").write_bytes(b"at work")
    dataset.make(QUICK, "test", 1, made, jobs=1)
    assert [path.name for path in folder.glob(".*")] == [f".2.bits.{os.getpid()}.part"]


def test_a_disk_that_refuses_is_named(tmp_path):
    (tmp_path / "voxels-raster-32").write_text("a file, not a folder")
    with pytest.raises(BrokenFile, match="cannot be written"):
        dataset.make(QUICK, "test", 1, tmp_path, jobs=1)


RUN = """
import signal
import sys
from pathlib import Path
from tutorialbot.vox2c import dataset
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a test started in the background may ignore it
    print(dataset.make(dataset.Recipe(10), "validation", 5000, Path(sys.argv[1])))
"""


@pytest.mark.full
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGKILL])
def test_interrupted_at_any_point_it_goes_on(tmp_path, ending):
    script = tmp_path / "run.py"
    script.write_text(RUN)
    command, place = [sys.executable, str(script), str(tmp_path)], {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, env=place, start_new_session=True, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 120
    while len(list(tmp_path.rglob("*.bits"))) < 3 and time.monotonic() < until:
        time.sleep(0.02)
    os.killpg(process.pid, ending)
    process.wait(60)
    time.sleep(1.0)  # workers that were in the middle of a file
    before = files(tmp_path)
    assert 3 <= len(before) < 40
    again = subprocess.run(command, env=place, capture_output=True, text=True, check=True)
    assert int(again.stdout) == 40 - len(before)
    after = files(tmp_path)
    assert len(after) == 40 and all(after[path] == before[path] for path in before)
    assert not list(tmp_path.rglob("*.part"))
    assert len(dataset.read(Recipe(10), "validation", 5000, tmp_path)) == 5000


def test_both_cores_make_the_same(made, tmp_path):
    other = tmp_path / "parallel"
    assert dataset.make(QUICK, "test", CHUNK + 1, other, jobs=2) == 4
    for path in files(other):
        assert path.read_bytes() == (made / path.relative_to(other)).read_bytes()


def test_splits_never_meet():
    spans = [dataset.seeds(split, dataset.LARGEST) for split in SPLITS]
    for a in spans:
        assert a.start % CHUNK == 0
        assert all(a is b or a.stop <= b.start or b.stop <= a.start for b in spans)


@pytest.mark.parametrize("source", ["cameras", "raster"])
def test_the_committed_set_is_what_this_code_makes(source):
    """All labels, and the voxels of every tenth scene: at most one in 10,000 may round otherwise on another machine."""
    differ = voxels = 0
    for split, count in dataset.SMALL.items():
        recipe = Recipe(5, source)
        pairs = dataset.read(recipe, split, count, DATA / "vox2c")
        cubes, cspaces = pairs.batch(slice(None))
        for i, seed in enumerate(pairs.seeds):
            scene = random_scene(int(seed))
            np.testing.assert_array_equal(cspaces[i], labels.exact_cspace(scene, 5))
            if i % 10 == 0:
                differ += (cubes[i] ^ grids.voxelize(scene, source)).sum()
                voxels += cubes[i].sum()
    assert voxels > 50_000 and differ <= voxels / 10_000


def test_the_committed_set_is_small_and_stands_in(tmp_path, monkeypatch):
    size = sum(path.stat().st_size for path in (DATA / "vox2c").rglob("*") if path.is_file())
    assert size <= 1_200_000
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path))
    assert len(dataset.read(Recipe(), "test", 250)) == 250
    with pytest.raises(BrokenFile, match="results|vox2c"):
        dataset.read(Recipe(), "test", 251)


@pytest.mark.parametrize(
    ("argument", "value"),
    [("resolution_deg", 7), ("source", "lidar"), ("size", 0), ("size", 999), ("labels", "paper"), ("labels", None)],
)
def test_odd_recipes_are_named(argument, value):
    with pytest.raises((InvalidValue, InvalidType), match=f"^{argument} = "):
        Recipe(**{argument: value})


@pytest.mark.parametrize(
    ("argument", "value"),
    [("split", "training"), ("split", None), ("count", 0), ("count", 2_000_000), ("count", 1.5), ("recipe", None)],
)
def test_odd_wishes_are_named(tmp_path, argument, value):
    for call in (dataset.make, dataset.read):
        with pytest.raises((InvalidValue, InvalidType), match=f"^{argument} = "):
            call(**{"recipe": QUICK, "split": "test", "count": 1, "folder": tmp_path, argument: value})
    with pytest.raises((InvalidValue, InvalidType), match="^jobs = "):
        dataset.make(QUICK, "test", 1, tmp_path, jobs=0)
