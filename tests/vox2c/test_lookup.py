"""The lookup table: literally the voxels' own C-space, bit for bit; with an inset nearer to the truth."""

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.vox2c import grids, labels, lookup
from tutorialbot.vox2c.scenes import BoxScene, random_scene


@pytest.mark.parametrize(("size", "resolution", "scenes"), [(32, 1, 10), (32, 5, 100), (32, 10, 100), (64, 5, 30),
                                                            (32, 24, 30), (9, 10, 30)])  # fmt: skip
def test_without_inset_it_is_the_octree_bit_for_bit(size, resolution, scenes):
    found = 0
    for seed in range(4000, 4000 + scenes):
        voxels = grids.voxelize(random_scene(seed), "raster" if seed % 2 else "cameras", size)
        blocked = labels.octree_cspace(voxels, resolution)
        np.testing.assert_array_equal(lookup.lookup_cspace(voxels, resolution), blocked)
        found += blocked.sum()
    assert found > 0


def test_it_equals_brute_force_over_voxel_boxes():
    """Each occupied voxel as a box of its own: no slabs, no merging, no masks."""
    side = 2.3 / 32
    some = np.zeros((32,) * 3, bool)
    some[12:20, 17, 8:20:5] = True  # this layer enters link 2's slab by 3 mm only: with an inset it does not
    for seed in range(4099, 4110):
        voxels = some if seed == 4099 else grids.voxelize(random_scene(seed), "cameras")
        centres = np.array([-1.15, -1.15, 0.0]) + side * (np.argwhere(voxels) + 0.5)
        for inset in (0.0, 0.01, 0.025):
            sides = np.full_like(centres, side - 2 * inset)
            blocked = labels.exact_cspace(BoxScene(np.hstack([centres, sides])), 5)
            np.testing.assert_array_equal(lookup.lookup_cspace(voxels, 5, inset=inset), blocked)


@pytest.mark.parametrize("source", ["raster", "cameras"])
def test_the_inset_brings_it_nearer_to_the_truth(source):
    scores = {0.0: [], lookup.INSETS[source, 32]: []}
    scenes = [random_scene(seed) for seed in range(4200, 4400)]
    for inset, found in scores.items():
        for scene in scenes:
            guess = lookup.lookup_cspace(grids.voxelize(scene, source), 10, inset=inset)
            truth = labels.exact_cspace(scene, 10)
            found.append(((guess & truth).sum(), (guess | truth).sum()))
    plain, inset = (np.divide(*np.sum(found, axis=0)) for found in scores.values())
    assert 0.5 < plain < 0.7 < inset < 0.9


def test_a_larger_inset_blocks_less():
    voxels = grids.voxelize(random_scene(4500), "raster")
    before = lookup.lookup_cspace(voxels, 10)
    for inset in (0.01, 0.02, 0.03):
        after = lookup.lookup_cspace(voxels, 10, inset=inset)
        assert not (after & ~before).any() and after.sum() < before.sum()
        before = after


def test_empty_and_full_grids():
    assert not lookup.lookup_cspace(np.zeros((32,) * 3, bool), 10).any()
    assert lookup.lookup_cspace(np.ones((32,) * 3, bool), 10).all()


def test_tables_are_kept_and_cannot_be_confused():
    assert lookup.table(10, 32, 0.01) is lookup.table(10, 32, 0.01)
    assert lookup.table(10, 32, 0.01) is not lookup.table(10, 32, 0.02)
    with pytest.raises(InvalidValue, match=r"^voxels = .*\(32, 32, 32\)"):
        lookup.table(10, 32, 0.01).cspace(np.zeros((16,) * 3, bool))


@pytest.mark.parametrize(
    ("argument", "value"),
    [("inset", -0.01), ("inset", 0.04), ("inset", np.nan), ("inset", "wide"), ("inset", []), ("inset", 10**30),
     ("resolution_deg", 7), ("resolution_deg", {}), ("resolution_deg", 10**30),
     ("resolution_deg", np.nan), ("voxels", np.zeros((32, 32, 31))), ("voxels", np.full((32,) * 3, 0.5))],
)  # fmt: skip
def test_odd_arguments_are_named(argument, value):
    with pytest.raises((InvalidValue, InvalidType), match=f"^{argument} = "):
        lookup.lookup_cspace(**{"voxels": np.zeros((32,) * 3, bool), "resolution_deg": 10, argument: value})


@pytest.mark.parametrize("size", [0, -1, 257, True, 2.5, "32", None, [32]])
def test_an_odd_size_is_named(size):
    with pytest.raises((InvalidValue, InvalidType), match="^size = "):
        lookup.table(10, size)
