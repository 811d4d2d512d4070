"""What the link-frame predictor learns from: fresh random scenes at every step, postures that the cull leaves, labels.

A fixed set of scenes would be learned by heart, so scenes are drawn anew all the time. Their seeds begin at
TRAINING, those of validation at VALIDATION, those of the evaluation at EVALUATION: no test or benchmark uses them.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from tutorialbot.errors import InvalidValue, one_of, positive, whole_number
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import kernels as exact_kernels
from tutorialbot.vox2c import linkframe
from tutorialbot.vox2c import linkframe_kernels as kernels
from tutorialbot.vox2c.arm import BAR, DOMAIN, ELBOW, JOINT_1, SLABS
from tutorialbot.vox2c.grids import SOURCES, voxelize
from tutorialbot.vox2c.labels import KINDS
from tutorialbot.vox2c.scenes import BoxScene, random_scene

TRAINING, VALIDATION, EVALUATION = 1_000_000_000, 2_000_000_000, 3_000_000_000
SPAN = 10_000_000  # seeds of one training run
KEPT = 10_000  # scenes in memory: those beyond the fresh ones come from the latest so many
GROUP = 16  # postures of one scene that are looked at together
DRAWN = (96, 384)  # postures of link 2 and of link 3 drawn in a scene, before the cull


@dataclass(frozen=True)
class Settings:
    """One training run of a link-frame predictor."""

    design: linkframe.Design
    source: str = "raster"  # of the voxels
    kind: str = "exact"  # of the labels
    seed: int = 0
    steps: int = 2000
    scenes: int = 128  # in a step
    fresh: int = 64  # of these, how many are new; the others were seen before
    rate: float = 3e-3
    decay: float = 1e-4
    start: str = ""  # weights to begin with

    def __post_init__(self):
        one_of("source", self.source, SOURCES)
        one_of("kind", self.kind, KINDS)
        for name in ("steps", "scenes", "fresh"):
            whole_number(name, getattr(self, name), 1)
        positive("rate", self.rate)
        if whole_number("seed", self.seed) >= (VALIDATION - TRAINING) // SPAN:
            raise InvalidValue("seed", self.seed, f"less than {(VALIDATION - TRAINING) // SPAN}")
        if self.fresh > self.scenes or self.fresh * self.steps > SPAN:
            raise InvalidValue("fresh", self.fresh, f"at most scenes = {self.scenes}, and {SPAN} in all steps")


@dataclass(frozen=True)
class Sample:
    """What one step learns from: read layers, and for each link groups of postures (scene, poses, labels, weights)."""

    slabs: Tensor
    links: tuple[tuple[Tensor, Tensor, Tensor, Tensor], ...]


def mirrored(scene: BoxScene, voxels: np.ndarray) -> tuple[BoxScene, np.ndarray]:
    """Return scene and voxels as a mirror at x = 0 shows them; arm, cameras and the drawing of scenes are symmetric."""
    boxes = scene.boxes * np.array([-1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    return BoxScene(boxes), voxels[::-1]


def drawn_poses(rng: np.random.Generator, link: int) -> np.ndarray:
    """Return random postures (q, 3) of a link: joint x, z [m, from the corner], angle [rad]."""
    count = DRAWN[link]
    theta1, angle = rng.uniform(-np.pi, np.pi, (2, count))
    joint = np.broadcast_to([JOINT_1[0], JOINT_1[2]], (count, 2))
    if link == 1:
        joint = joint + ELBOW * np.column_stack([np.sin(theta1), np.cos(theta1)])
    return np.column_stack([linkframe.corner(joint), angle])


def voxel_corners(voxels: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest corner of every occupied voxel, each (k, 3) [m]."""
    low = np.array(DOMAIN[0]) + cell * np.argwhere(voxels)
    return low, low + cell


def judged_poses(settings: Settings, scene: BoxScene, voxels: np.ndarray, rng: np.random.Generator) -> list:
    """Return for both links the drawn postures that the cull leaves (q, 3), and whether the link collides (q,)."""
    design, found = settings.design, []
    corners = scene.corners if settings.kind == "exact" else voxel_corners(voxels, design.cell)
    for link, slab in enumerate(SLABS):
        poses = drawn_poses(rng, link)
        occupied = kernels.occupied_words(voxels, *design.cull_layers(link))
        poses = poses[kernels.touching_poses(poses, occupied, design.bar, design.cell, design.size)]
        rectangles = exact_kernels.rectangles(*corners, *slab, DOMAIN[0][0], DOMAIN[0][2])
        found.append((poses, kernels.bars_meet(rectangles, poses, BAR)))
    return found


def _grouped(found: list) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Put each scene's postures into groups of GROUP, the last one filled up with weight 0."""
    scene, poses, truth, weight = [], [], [], []
    for i, (chosen, hits) in enumerate(found):
        groups = -(-len(chosen) // GROUP)
        full = np.zeros((groups * GROUP, 5), dtype=np.float32)
        full[: len(chosen)] = np.column_stack([chosen, hits, np.ones(len(chosen))])
        full = full.reshape(groups, GROUP, 5)
        scene += [i] * groups
        poses.append(full[..., :3])
        truth.append(full[..., 3])
        weight.append(full[..., 4])
    arrays = (np.array(scene, dtype=np.int64), *(np.concatenate(part) for part in (poses, truth, weight)))
    return tuple(torch.from_numpy(array) for array in arrays)


class Scenes:
    """The scenes of a run with their voxels by number, drawn when asked for; the latest KEPT stay in memory."""

    def __init__(self, settings: Settings):
        self.settings = settings
        self.base = TRAINING + settings.seed * SPAN
        self._kept: dict[int, tuple[BoxScene, np.ndarray]] = {}

    def __getitem__(self, i: int) -> tuple[BoxScene, np.ndarray]:
        size = self.settings.design.size
        if i not in self._kept:
            scene = random_scene(self.base + i)
            voxels = voxelize(scene, self.settings.source, size)
            self._kept[i] = scene, np.packbits(voxels)
            self._kept.pop(i - KEPT, None)
        scene, bits = self._kept[i]
        return scene, np.unpackbits(bits, count=size**3).reshape(size, size, size).astype(bool)


def sample(settings: Settings, scenes: Scenes, step: int) -> Sample:
    """Return what step number `step` (from 0) learns from; the same for the same settings, whatever came before."""
    rng = make_rng(settings.seed, 5, step)
    seen = step * settings.fresh
    chosen = [*range(seen, seen + settings.fresh)]
    oldest = max(0, seen + settings.fresh - KEPT)
    chosen += [int(i) for i in rng.integers(oldest, seen + settings.fresh, settings.scenes - settings.fresh)]
    slabs, links = [], ([], [])
    first, end = settings.design.layers
    for i in chosen:
        scene, voxels = scenes[i]
        if rng.random() < 0.5:
            scene, voxels = mirrored(scene, voxels)
        voxels = np.ascontiguousarray(voxels)
        slabs.append(voxels[:, first:end].transpose(1, 0, 2))
        for found, judged in zip(links, judged_poses(settings, scene, voxels, rng), strict=True):
            found.append(judged)
    return Sample(torch.from_numpy(np.array(slabs, dtype=np.float32)), tuple(_grouped(found) for found in links))
