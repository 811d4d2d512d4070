"""How a planner gets to know what is free: the methods that paper 3's Table 2 compares, and honest peers.

"octree"      asks coal's octree of the voxels at every state: the conventional way.
"predicted"   asks a C-space that a network predicted from the voxels: the paper's way.
"lookup"      the same with a C-space looked up from the voxels, without any learning.
"voxel_test"  asks a compiled test of the voxels at every state: the conventional way done well.
"exact_map"   asks the exact C-space of the boxes, computed first.
"exact"       asks a compiled test of the boxes at every state.

The first four know voxels only. Whatever a method says, planning.py verifies the path that comes of it.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_number, one_of
from tutorialbot.vox2c import fields, grids, kernels, labels, lookup, motions
from tutorialbot.vox2c.arm import BAR
from tutorialbot.vox2c.motions import SEARCH_STEP, Solid
from tutorialbot.vox2c.scenes import BoxScene

METHODS = ("octree", "predicted", "lookup", "voxel_test", "exact_map", "exact")
MAPS = ("predicted", "lookup", "exact_map")  # methods that make a whole C-space
BLIND = ("exact_map", "exact")  # methods that need no voxels
AGAINST = ("boxes", "voxels")
RESOLUTION = {"predicted": 5, "lookup": 5, "exact_map": 1}  # of the map, when none is asked for [deg]
PREDICTORS = {"cameras": "linkframe-shell", "raster": "linkframe-raster"}  # the weights used when none are named


@dataclass(frozen=True, eq=False)
class Prepared:
    """All that is done once a scene, whatever the start and the goal.

    `state(theta1, theta2)` and `motion(a1, a2, b1, b2)` say what the method takes for blocked [rad]; `motion` is None
    where a planner must ask state by state. cspace: bool (n, n) of a method that makes a map, else None. `solid` is
    what paths are verified against. seconds: CPU time of "sense" (voxels) and "map" (map, prediction or octree).
    """

    scene: BoxScene
    method: str
    solid: Solid
    state: Callable[[float, float], bool]
    motion: Callable[[float, float, float, float], bool] | None
    cspace: np.ndarray | None
    seconds: dict[str, float] = field(default_factory=dict)

    @cached_property
    def wide(self) -> np.ndarray:
        """The map with everything blocked one cell wider, computed once: where the wavefront looks first."""
        return fields.widened(self.cspace)


def prepare(
    scene: BoxScene, *, method: str = "exact_map", verify_against: str = "boxes", resolution_deg: float | None = None,
    source: str = "cameras", size: int = 32, voxels=None, predictor=None, threshold: float | None = None,
) -> Prepared:  # fmt: skip
    """Do all that a scene needs before a planner may ask; `planning.query` then answers many questions.

    voxels: a grid (n, n, n), else `source` and `size` say how the scene is seen (grids.voxelize). predictor: the name
    of weights or anything with `.predict(voxels, resolution_deg)`; cells of at least `threshold` are blocked (by
    default the predictor's own). Raises InvalidType or InvalidValue that names the argument.
    """
    if not isinstance(scene, BoxScene):
        raise InvalidType("scene", scene, "a scenes.BoxScene")
    one_of("method", method, METHODS), one_of("verify_against", verify_against, AGAINST)
    one_of("source", source, grids.SOURCES), grids.check_size(size)  # also where the method has no use for them
    if threshold is not None:
        finite_number("threshold", threshold, 0.0, 1.0)
    if resolution_deg is not None:
        labels.cells(resolution_deg)
    resolution = RESOLUTION.get(method) if resolution_deg is None else resolution_deg
    model = _predictor(predictor, source) if method == "predicted" else None
    began = time.process_time()
    if voxels is not None:
        voxels = labels.check_voxels(voxels)
    elif method not in BLIND or verify_against == "voxels":
        voxels = grids.voxelize(scene, source, size)
    sensed = time.process_time()
    if method == "octree":
        tests = labels.coal_octree_test(voxels), None, None
    elif method == "voxel_test":
        tests = _by_test(motions.voxels(voxels))
    elif method == "exact":
        tests = _by_test(motions.boxes(scene))
    elif method == "exact_map":
        tests = by_map(labels.exact_cspace(scene, resolution))
    elif method == "lookup":
        inset = lookup.INSETS.get((source, len(voxels)), 0.0)  # none known: voxels as they are
        tests = by_map(lookup.lookup_cspace(voxels, resolution, inset=inset))
    else:
        tests = by_map(predicted_cspace(model, voxels, resolution, threshold))
    mapped = time.process_time()
    solid = motions.boxes(scene) if verify_against == "boxes" else motions.voxels(voxels)
    return Prepared(scene, method, solid, *tests, {"sense": sensed - began, "map": mapped - sensed})


def with_map(prepared: Prepared, cspace: np.ndarray) -> Prepared:
    """Return the same with another map: bool (n, n), True = blocked."""
    cspace = np.ascontiguousarray(cspace, dtype=bool)
    if cspace.ndim != 2 or cspace.shape[0] != cspace.shape[1]:
        raise InvalidValue("cspace", f"array of shape {cspace.shape}", "shape (n, n)")
    return replace(prepared, **dict(zip(("state", "motion", "cspace"), by_map(cspace), strict=True)))


def by_map(cspace: np.ndarray) -> tuple[Callable, Callable, np.ndarray]:
    """Return the tests of a state and of a motion that look into a map, and the map."""
    state, motion = motions.map_blocks, motions.map_blocks_motion
    return (
        lambda theta1, theta2: state(cspace, theta1, theta2),
        lambda a1, a2, b1, b2: motion(cspace, a1, a2, b1, b2, SEARCH_STEP),
        cspace,
    )


def _by_test(solid: Solid) -> tuple[Callable, Callable, None]:
    second, third, state, motion = solid.second, solid.third, kernels.collides, motions.motion_collides
    return (
        lambda theta1, theta2: state(second, third, theta1, theta2, BAR),
        lambda a1, a2, b1, b2: motion(second, third, a1, a2, b1, b2, SEARCH_STEP, BAR),
        None,
    )


def predicted_cspace(model, voxels: np.ndarray, resolution_deg: float, threshold: float | None = None) -> np.ndarray:
    """Return what a predictor takes for blocked, bool (n, n): probabilities of at least the threshold."""
    threshold = getattr(model, "threshold", 0.5) if threshold is None else finite_number("threshold", threshold, 0, 1)
    found = np.asarray(model.predict(voxels, resolution_deg))
    n = labels.cells(resolution_deg)
    if found.shape != (n, n):
        raise InvalidValue("predictor", f"a prediction of shape {found.shape}", f"shape ({n}, {n})")
    return found >= threshold


def _predictor(predictor, source: str):
    if isinstance(predictor, str):
        from tutorialbot.vox2c import network  # brings torch, which is slow to import and rarely needed here

        return network.load(predictor)
    if predictor is None:
        from tutorialbot.vox2c import linkframe

        return linkframe.load(PREDICTORS[one_of("source", source, PREDICTORS)])
    if not callable(getattr(predictor, "predict", None)):
        raise InvalidType("predictor", predictor, "the name of weights, or an object with .predict()")
    return predictor
