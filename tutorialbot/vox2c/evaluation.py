"""How good a predicted C-space is: IoU, pooled over scenes and as their mean, and the best that voxels allow.

IoU = cells that both call a collision / cells that either does. *Pooled*: both counts summed over all scenes. *Scene
mean*: the mean of each scene's own IoU, 1 where neither has a collision. The paper does not say which it means.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidValue
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import labels
from tutorialbot.vox2c.arm import DOMAIN
from tutorialbot.vox2c.grids import voxelize
from tutorialbot.vox2c.linkframe_kernels import posterior_boxes
from tutorialbot.vox2c.scenes import SIDES, BoxScene, random_scene

BINS = 200  # of probability: thresholds are multiples of 1 / BINS


@dataclass(frozen=True)
class Iou:
    """IoU over scenes at one threshold, with the standard errors that come from the choice of scenes."""

    threshold: float
    pooled: float
    pooled_error: float
    scene_mean: float
    scene_mean_error: float
    scenes: int


@dataclass
class Tally:
    """Of each scene, how many cells were predicted with which probability: `free` and `hit` (scenes, BINS + 1)."""

    free: np.ndarray
    hit: np.ndarray

    def counts(self, threshold: float) -> tuple[np.ndarray, np.ndarray]:
        """Return intersection and union (scenes,) when cells from `threshold` on count as collisions."""
        first = round(threshold * BINS)
        intersection = self.hit[:, first:].sum(axis=1)
        return intersection, self.hit.sum(axis=1) + self.free[:, first:].sum(axis=1)

    def iou(self, threshold: float = 0.5) -> Iou:
        """Return the IoU at a threshold."""
        intersection, union = self.counts(threshold)
        pooled, error = ratio(intersection, union)
        own = np.where(union > 0, intersection / np.maximum(union, 1), 1.0)
        n = len(own)
        return Iou(threshold, pooled, error, float(own.mean()), _spread((own - own.mean()) / n), n)

    def best_threshold(self) -> float:
        """Return the threshold with the best pooled IoU."""
        hit, free = (counts.sum(axis=0)[::-1].cumsum()[::-1] for counts in (self.hit, self.free))
        return float(np.argmax(hit / np.maximum(self.hit.sum() + free, 1)) / BINS)


def ratio(intersection: np.ndarray, union: np.ndarray) -> tuple[float, float]:
    """Return sum(intersection) / sum(union) and its standard error over scenes (the ratio estimator's, NaN for one)."""
    total = max(union.sum(), 1)
    value = intersection.sum() / total
    return float(value), _spread((intersection - value * union) / total)


def _spread(parts: np.ndarray) -> float:
    """Return the standard error of the sum of `parts` (scenes,), whose expected values are zero."""
    n = len(parts)
    return float(np.sqrt(n / (n - 1) * (parts**2).sum())) if n > 1 else math.nan


def paired_difference(first: Tally, second: Tally, thresholds: tuple[float, float]) -> tuple[float, float]:
    """Return pooled IoU of `first` minus that of `second` on the same scenes, and the standard error of the difference.

    Raises InvalidValue when they are not as many scenes.
    """
    (a, u), (b, v) = first.counts(thresholds[0]), second.counts(thresholds[1])
    n = len(u)
    if n != len(v):
        raise InvalidValue("second", f"{len(v)} scenes", f"the same {n} scenes")
    all_u, all_v = max(u.sum(), 1), max(v.sum(), 1)
    p, q = a.sum() / all_u, b.sum() / all_v
    return float(p - q), _spread((a - p * u) / all_u - (b - q * v) / all_v)


def tally(pairs: Iterable[tuple[np.ndarray, np.ndarray]]) -> Tally:
    """Count over pairs of a prediction (n, n) in [0, 1] and the truth (n, n), one for each scene."""
    free, hit = [], []
    for predicted, truth in pairs:
        # a small amount more: 0.35 * 200 is 69.99...
        bins = np.floor(np.asarray(predicted, dtype=np.float64) * BINS + 1e-6).astype(np.int64)
        free.append(np.bincount(bins[~truth], minlength=BINS + 1))
        hit.append(np.bincount(bins[truth], minlength=BINS + 1))
    return Tally(np.array(free), np.array(hit))


def joined(tallies: Sequence[Tally]) -> Tally:
    """Return several tallies as one."""
    return Tally(np.concatenate([one.free for one in tallies]), np.concatenate([one.hit for one in tallies]))


def ceiling(scene: BoxScene, size: int, resolution_deg: float, samples: int = 64, seed: int = 0) -> np.ndarray:
    """Return what the best possible predictor would say of a scene's rasterised voxels, float (n, n).

    More is given to it than to any network: which voxels belong to which box. Then each box is independent of the
    others, and its faces lie anywhere in their voxels but for the sides that boxes may have. The probability of a
    collision is the share of `samples` scenes drawn so that collide. But for the chance of the draw, and for the rule
    that keeps boxes from the column, which is left out here, no predictor from voxels can expect a better score.
    """
    found, origin = 0, np.array(DOMAIN[0])
    length = DOMAIN[1][0] - DOMAIN[0][0]
    cell = length / size
    low, high = (corner - origin for corner in scene.corners)
    first, last = np.floor(low / cell), np.ceil(high / cell) - 1
    rng = make_rng(seed, 11)
    for _ in range(samples):
        lows, highs = posterior_boxes(first, last, cell, *SIDES, length, rng)
        boxes = np.column_stack([(lows + highs) / 2 + origin, highs - lows])
        found = found + labels.exact_cspace(BoxScene(boxes), resolution_deg)
    return found / samples


def labelled(
    seeds: Iterable[int], source: str, size: int, kind: str, resolution_deg: float
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield voxels and C-space of random scenes, one for each seed; `kind` as in labels.KINDS, `source` as in grids."""
    for seed in seeds:
        scene = random_scene(seed)
        voxels = voxelize(scene, source, size)
        exact = kind == "exact"
        yield (
            voxels,
            labels.exact_cspace(scene, resolution_deg) if exact else labels.octree_cspace(voxels, resolution_deg),
        )


def measure(predict: Callable, scenes: Iterable[tuple[np.ndarray, np.ndarray]], resolution_deg: float) -> Tally:
    """Tally `predict(voxels, resolution_deg)` over scenes given as (voxels, true C-space)."""
    return tally((predict(voxels, resolution_deg), truth) for voxels, truth in scenes)
