"""Predictors side by side on the same scenes: IoU with standard errors, paired differences, and the voxels' ceiling."""

from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np

from tutorialbot.runs import progress
from tutorialbot.vox2c import evaluation, lookup
from tutorialbot.vox2c.scenes import random_scene

CEILING = "ceiling of the voxels"
Predict = Callable[[np.ndarray, float], np.ndarray]


def lookup_table(source: str, size: int, kind: str = "exact") -> tuple[Predict, float]:
    """Return the lookup table as a predictor, with its threshold; without inset for octree labels, which it then is."""
    inset = lookup.INSETS[source, size] if kind == "exact" else 0.0
    return lambda voxels, resolution_deg: lookup.lookup_cspace(voxels, resolution_deg, inset=inset), 0.5


def table(
    methods: dict[str, tuple[Predict, float]],
    seeds: Sequence[int],
    source: str,
    size: int,
    kind: str,
    resolution_deg: float,
    samples: int = 64,
) -> list[dict]:
    """Return one row for each method (predict, threshold): IoU over the scenes of `seeds`, and the first method's lead.

    For rasterised voxels and exact labels the last row is `evaluation.ceiling` at its best threshold. `lead` is the
    pooled IoU of the first method minus this one's, paired, with its standard error.
    """
    with_ceiling = source == "raster" and kind == "exact" and samples > 0
    counted: dict[str, list] = {name: [] for name in (*methods, *([CEILING] if with_ceiling else []))}
    scenes = evaluation.labelled(seeds, source, size, kind, resolution_deg)
    bar = progress(seeds, description=f"{source}, {size}^3, {kind} labels")
    for seed, (voxels, truth) in zip(bar, scenes, strict=True):
        for name, (predict, _) in methods.items():
            counted[name].append(evaluation.tally([(predict(voxels, resolution_deg), truth)]))
        if with_ceiling:
            best = evaluation.ceiling(random_scene(seed), size, resolution_deg, samples, seed)
            counted[CEILING].append(evaluation.tally([(best, truth)]))
    found = {name: evaluation.joined(tallies) for name, tallies in counted.items()}
    tallies = {name: (found[name], threshold) for name, (_, threshold) in methods.items()}
    if with_ceiling:
        tallies[CEILING] = (found[CEILING], found[CEILING].best_threshold())
    return rows(tallies, source, size, kind, resolution_deg)


def rows(
    found: dict[str, tuple[evaluation.Tally, float]], source: str, size: int, kind: str, resolution_deg: float
) -> list[dict]:
    """Return one row for each method (tally, threshold), as `table` does."""
    first = next(iter(found.values()))
    table = []
    for name, (one, threshold) in found.items():
        lead = evaluation.paired_difference(first[0], one, (first[1], threshold))
        about = {"method": name, "source": source, "size": size, "labels": kind, "resolution_deg": resolution_deg}
        table.append(about | asdict(one.iou(threshold)) | {"lead": lead[0], "lead_error": lead[1]})
    return table
