"""IoU and its standard errors against plain counting; the ceiling against what it must be."""

import numpy as np
import pytest

from tutorialbot.errors import InvalidValue
from tutorialbot.vox2c import compare, evaluation, grids, labels, scenes


def random_pairs(seed, count=40):
    rng = np.random.default_rng(seed)
    truths = [rng.random((12, 12)) < rng.random() / 2 for _ in range(count)]
    return [(np.clip(truth * 0.5 + rng.random((12, 12)) * 0.6, 0, 1), truth) for truth in truths]


@pytest.mark.parametrize("threshold", [0.3, 0.5, 0.85])
def test_pooled_and_scene_mean_are_plain_counts(threshold):
    pairs = [*random_pairs(0), (np.zeros((12, 12)), np.zeros((12, 12), bool))]
    found = evaluation.tally(pairs).iou(threshold)
    both = [((p >= threshold) & t).sum() for p, t in pairs]
    either = [((p >= threshold) | t).sum() for p, t in pairs]
    assert found.pooled == pytest.approx(sum(both) / sum(either))
    assert found.scene_mean == pytest.approx(np.mean([b / e if e else 1.0 for b, e in zip(both, either, strict=True)]))
    assert found.scenes == 41


def test_the_best_threshold_is_the_best():
    one = evaluation.tally(random_pairs(1))
    best = one.iou(one.best_threshold()).pooled
    assert best == max(one.iou(k / 200).pooled for k in range(201)) and best > one.iou(0.9).pooled


def test_standard_errors_are_those_of_drawing_scenes_again():
    one, rng = evaluation.tally(random_pairs(2, 300)), np.random.default_rng(0)
    other = evaluation.tally([(np.clip(p + 0.1, 0, 1), t) for p, t in random_pairs(2, 300)])
    pooled, leads = [], []
    for _ in range(400):
        rows = rng.integers(0, 300, 300)
        both = [evaluation.Tally(x.free[rows], x.hit[rows]).iou().pooled for x in (one, other)]
        pooled.append(both[0]), leads.append(both[0] - both[1])
    assert one.iou().pooled_error == pytest.approx(np.std(pooled), rel=0.15)
    lead, error = evaluation.paired_difference(one, other, (0.5, 0.5))
    assert lead == pytest.approx(one.iou().pooled - other.iou().pooled)
    assert error == pytest.approx(np.std(leads), rel=0.15)
    with pytest.raises(InvalidValue, match="300"):
        evaluation.paired_difference(one, evaluation.tally(random_pairs(3)), (0.5, 0.5))


def test_the_ceilings_boxes_fill_the_same_voxels_and_have_possible_sides(monkeypatch):
    scene, drawn = scenes.random_scene(6600), []
    monkeypatch.setattr(labels, "exact_cspace", lambda one, r: drawn.append(one) or np.zeros((2, 2)))
    evaluation.ceiling(scene, 32, 180, samples=20)
    for one in drawn:
        assert np.array_equal(grids.voxelize(one, "raster"), grids.voxelize(scene, "raster"))
        assert (one.boxes[:, 3:] >= 0.1).all() and (one.boxes[:, 3:] <= 0.35).all()
    assert len({one.boxes[0, 0] for one in drawn}) == 20


def test_the_ceiling_rises_with_finer_voxels_and_beats_the_lookup_table():
    seeds = range(6601, 6661)
    pooled = {}
    for size in (32, 64):
        table = {"lookup table": compare.lookup_table("raster", size)}
        rows = compare.table(table, seeds, "raster", size, "exact", 10, samples=24)
        pooled[size] = [row["pooled"] for row in rows]
        assert [row["method"] for row in rows] == ["lookup table", compare.CEILING]
        assert rows[0]["lead"] == 0.0 and rows[1]["lead"] == pytest.approx(pooled[size][0] - pooled[size][1])
    assert pooled[32][0] < pooled[32][1] < pooled[64][1] < 1.0


def test_octree_labels_are_the_lookup_tables():
    rows = compare.table(
        {"lookup": compare.lookup_table("raster", 32, "octree")}, range(6700, 6710), "raster", 32, "octree", 10
    )
    assert [row["pooled"] for row in rows] == [1.0]
