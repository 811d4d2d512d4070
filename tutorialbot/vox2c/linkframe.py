"""The link-frame predictor: a small network that looks at the voxels from each bar's own frame, at any resolution.

Where in the grid a bar lies at each posture is known from the arm's geometry; the paper's network has to learn it, this
one has not. For one posture and one bar:

1. *Cull.* The bar's footprint, one word of bits for each row of voxels, is compared with the occupied rows. A bar that
   touches no occupied voxel is free; most are. From full boxes this is exact, for every point of a box lies in an
   occupied voxel. What cameras see is incomplete, so there the footprint is wider, and it is no proof.
2. *Look.* Two small convolutions make from the voxels a few maps in the plane of motion: what the layers along y say
   about the bar's slab. The maps are sampled at points around the bar, in the bar's frame.
3. *Judge.* A small multilayer perceptron makes of the samples the probability that the bar collides.
4. *Join.* The arm is free when both bars are: p = 1 - (1 - p_2)(1 - p_3), a noisy OR.

numpy and numba only: torch is needed to train it (linkframe_training.py).
"""

import math
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from tutorialbot.errors import BrokenFile, InvalidValue, finite_number
from tutorialbot.runs import RunRecord
from tutorialbot.vox2c import linkframe_kernels as kernels
from tutorialbot.vox2c import weights
from tutorialbot.vox2c.arm import DOMAIN, ELBOW, HALF_LENGTH, HALF_WIDTH, JOINT_1, MIDDLE, SLABS
from tutorialbot.vox2c.labels import cells, check_voxels

NETWORK = "linkframe"  # as the records name it
PHASES = 10  # features of a pose beside the samples
PAD = 2  # cells of zeros around the maps: sampled points may lie a little outside the grid
CHUNK = 1024  # poses judged at once
CERTAIN = 0.999  # a row that link 2 blocks so surely is not looked at again for link 3
FINEST = 0.5  # [deg]
SIZES = (32, 64)  # a row of voxels must fit into a word


@dataclass(frozen=True)
class Design:
    """What a link-frame predictor looks like."""

    size: int = 32  # voxels along a side of the grid
    below: float = 0.36  # how far along y the layers reach that are read, below and above the arm's slabs [m]
    filters: int = 16  # of the first convolution
    maps: int = 4  # for each link
    hidden: tuple[int, int] = (64, 32)  # units of the perceptron's layers
    along: tuple[float, float, int] = (-0.10, 0.55, 11)  # sampled points in a bar's frame: from, to, how many [m]
    across: tuple[float, float, int] = (-0.10, 0.10, 6)
    outset: float = 0.0  # the cull's footprint is so much wider on all sides [m]
    spread: int = 0  # so many more layers along y count for the cull, on both sides

    def __post_init__(self):
        if self.size not in SIZES:
            raise InvalidValue("size", self.size, f"one of {SIZES}")

    @property
    def cell(self) -> float:
        """Side of a voxel [m]."""
        return (DOMAIN[1][0] - DOMAIN[0][0]) / self.size

    @property
    def layers(self) -> tuple[int, int]:
        """First and end of the layers along y that the convolutions read."""
        low, high = SLABS[0][0] - self.below - DOMAIN[0][1], SLABS[1][1] + self.below - DOMAIN[0][1]
        return max(int(low / self.cell), 0), min(math.ceil(high / self.cell), self.size)

    def cull_layers(self, link: int) -> tuple[int, int]:
        """First and end of the layers along y that link 0 (the arm's link 2) or 1 (link 3) lies in, with the spread."""
        low, high = (edge - DOMAIN[0][1] for edge in SLABS[link])
        first, end = math.floor(low / self.cell + 1e-9), math.ceil(high / self.cell - 1e-9)
        return max(first - self.spread, 0), min(end + self.spread, self.size)

    @property
    def points(self) -> np.ndarray:
        """The sampled points (p, 2), along and across a bar [m]."""
        along, across = np.linspace(*self.along), np.linspace(*self.across)
        return np.array([(a, b) for a in along for b in across])

    @property
    def bar(self) -> tuple[float, float, float]:
        """A bar as the cull takes it: middle, half length, half width [m]."""
        return MIDDLE, HALF_LENGTH + self.outset, HALF_WIDTH + self.outset

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """The tensors of such a network by name, as torch numbers and stores them."""
        inputs = len(self.points) * self.maps + PHASES
        first, end = self.layers
        found = {"conv1.weight": (self.filters, end - first, 3, 3), "conv1.bias": (self.filters,)}
        found |= {"conv2.weight": (2 * self.maps, self.filters, 3, 3), "conv2.bias": (2 * self.maps,)}
        widths = (inputs, *self.hidden, 1)
        for link in (0, 1):
            for i, (before, after) in enumerate(zip(widths, widths[1:], strict=False)):
                found[f"links.{link}.{2 * i}.weight"] = (after, before)
                found[f"links.{link}.{2 * i}.bias"] = (after,)
        return found


def corner(joints: np.ndarray) -> np.ndarray:
    """Return joints (m, 2), x and z in the world, measured from the lowest corner of the domain, as the kernels do."""
    return joints - np.array([DOMAIN[0][0], DOMAIN[0][2]])


@lru_cache(maxsize=8)
def grid_poses(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return theta1 (n,), phi (n,) [rad] and the elbows (n, 2) [m, from the corner] of a C-space of n x n cells."""
    theta1, phi = 2 * np.pi * (np.arange(n) / n - 0.5), 2 * np.pi * np.arange(n) / n
    elbows = np.array([JOINT_1[0], JOINT_1[2]]) + ELBOW * np.column_stack([np.sin(theta1), np.cos(theta1)])
    return theta1, phi, corner(elbows)


@lru_cache(maxsize=6)
def footprints(n: int, size: int, bar: tuple[float, float, float], link: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the footprint table of link 0 at (1, n) or of link 1 at (n, n) poses: (elbow of theta1, phi)."""
    theta1, phi, elbows = grid_poses(n)
    joints, angles = (corner(np.array([[JOINT_1[0], JOINT_1[2]]])), theta1) if link == 0 else (elbows, phi)
    cell = (DOMAIN[1][0] - DOMAIN[0][0]) / size
    rows = int(2 * math.hypot(bar[1], bar[2]) / cell) + 2
    return kernels.footprint_table(joints, np.sin(angles), np.cos(angles), bar, cell, size, rows)


def culled_cspace(voxels: np.ndarray, resolution_deg: float, design: Design) -> np.ndarray:
    """Return where the cull does *not* call the arm free, bool (n, n); with no outset the octree's own C-space."""
    n, voxels = cells(resolution_deg), check_voxels(voxels, design.size)
    found = np.zeros((n, n), dtype=bool)
    for link in (0, 1):
        occupied = kernels.occupied_words(voxels, *design.cull_layers(link))
        table = footprints(n, design.size, design.bar, link)
        poses = kernels.touching(*table, occupied, np.zeros(len(table[0]), dtype=bool))
        if link == 0:
            found[poses[:, 1]] = True
        else:
            found[poses[:, 0], (poses[:, 1] - poses[:, 0]) % n] = True
    return found


def perceptron(features: np.ndarray, layers: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Return the probabilities (q,) that the perceptron makes of features (q, k): ReLU between, sigmoid at the end."""
    for weight, bias in layers[:-1]:
        features = features @ weight
        features += bias
        np.maximum(features, 0.0, out=features)
    weight, bias = layers[-1]
    logits = (features @ weight)[:, 0] + bias[0]
    return 0.5 * (1.0 + np.tanh(0.5 * logits))  # the sigmoid, without overflow


class Predictor:
    """A trained link-frame predictor; `predict` gives the probability of collision at any resolution.

    `threshold` is the probability that gave the best IoU on validation scenes.
    """

    def __init__(self, name: str, design: Design, tensors: dict[str, np.ndarray], record: RunRecord | None = None):
        weights.check_shapes(name, tensors, design.shapes())
        self.name, self.design, self.record = name, design, record
        self.threshold = 0.5 if record is None else float(record.values["threshold"])
        c, f = design.maps, design.filters
        arrays = {key: np.ascontiguousarray(tensor, np.float32) for key, tensor in tensors.items()}
        self._convolutions = (
            np.ascontiguousarray(arrays["conv1.weight"].transpose(1, 2, 3, 0)),
            arrays["conv1.bias"],
            np.ascontiguousarray(arrays["conv2.weight"].transpose(2, 3, 1, 0)).reshape(3, 3 * f, 2 * c),
            arrays["conv2.bias"],
        )
        self._perceptrons = [
            [
                (np.ascontiguousarray(arrays[f"links.{link}.{2 * i}.weight"].T), arrays[f"links.{link}.{2 * i}.bias"])
                for i in range(len(design.hidden) + 1)
            ]
            for link in (0, 1)
        ]
        self._points = design.points

    @property
    def parameters(self) -> int:
        """How many numbers the network has learned."""
        return sum(math.prod(shape) for shape in self.design.shapes().values())

    def maps(self, voxels: np.ndarray) -> np.ndarray:
        """Return the feature maps (2, size + 2 PAD, size + 2 PAD, maps) of a checked grid."""
        w1, b1, w2, b2 = self._convolutions
        size, c = self.design.size, self.design.maps
        hidden = kernels.first_convolution(voxels, self.design.layers[0], w1, b1)
        windows = np.lib.stride_tricks.sliding_window_view(hidden.reshape(size + 2, -1), w2.shape[1], axis=1)
        windows = windows[:, :: len(b1)]  # (size + 2, size, 3 f): a row's three neighbours along z lie side by side
        total = sum(windows[d : d + size].reshape(size * size, -1) @ w2[d] for d in range(3)) + b2
        found = np.zeros((2, size + 2 * PAD, size + 2 * PAD, c), dtype=np.float32)
        found[:, PAD:-PAD, PAD:-PAD] = total.reshape(size, size, 2, c).transpose(2, 0, 1, 3)
        return found

    def judge(self, link: int, maps: np.ndarray, poses: np.ndarray) -> np.ndarray:
        """Return the probability (q,) that a link collides at poses (q, 3): joint x, z [m, from the corner], angle."""
        found = np.empty(len(poses), dtype=np.float32)
        width = len(self._points) * self.design.maps + PHASES
        features = np.empty((min(CHUNK, len(poses)), width), dtype=np.float32)
        for start in range(0, len(poses), CHUNK):
            part = poses[start : start + CHUNK]
            rows = features[: len(part)]
            kernels.pose_features(maps[link], part, self._points, self.design.cell, PAD, rows)
            found[start : start + CHUNK] = perceptron(rows, self._perceptrons[link])
        return found

    def predict(self, voxels: np.ndarray, resolution_deg: float) -> np.ndarray:
        """Return the probability of collision, float32 (n, n), axes and cells as in `labels.exact_cspace`.

        voxels: (size, size, size), binary. Raises InvalidValue for others, and for a resolution that does not divide
        360 or is below FINEST.
        """
        design, n = self.design, cells(resolution_deg)
        if resolution_deg < FINEST:
            raise InvalidValue("resolution_deg", resolution_deg, f"at least {FINEST}: finer tables are too large")
        voxels = check_voxels(voxels, design.size)
        theta1, phi, elbows = grid_poses(n)
        maps = self.maps(voxels)
        occupied = [kernels.occupied_words(voxels, *design.cull_layers(link)) for link in (0, 1)]

        second = np.zeros(n, dtype=np.float32)
        table = footprints(n, design.size, design.bar, 0)
        cell = kernels.touching(*table, occupied[0], np.zeros(1, dtype=bool))[:, 1]
        joint = np.broadcast_to(corner(np.array([JOINT_1[0], JOINT_1[2]])), (len(cell), 2))
        second[cell] = self.judge(0, maps, np.column_stack([joint, theta1[cell]]))

        free = np.repeat((1.0 - second)[:, None], n, axis=1)
        table = footprints(n, design.size, design.bar, 1)
        k, j = kernels.touching(*table, occupied[1], second > CERTAIN).T
        free[k, (j - k) % n] *= 1.0 - self.judge(1, maps, np.column_stack([elbows[k], phi[j]]))
        return 1.0 - free


def design_of(settings: dict) -> Design:
    """Return the design that a record's `settings` name, as `asdict` and JSON wrote it."""
    return Design(**{key: tuple(value) if isinstance(value, list) else value for key, value in settings.items()})


def settings_of(design: Design) -> dict:
    """Return what `design_of` reads."""
    return asdict(design)


def load(name: str, folder: Path = weights.FOLDER) -> Predictor:
    """Return the link-frame predictor called `name`, as `weights.names()` lists them.

    Raises InvalidValue for an unknown name, BrokenFile for weights that are damaged, cut short or of another shape.
    """
    stored = weights.load(name, folder)
    if stored.record.values.get("network") != NETWORK:
        raise InvalidValue("name", name, "the name of a link-frame predictor")
    try:
        design = design_of(stored.record.values["settings"])
        design.shapes()
        finite_number("threshold", stored.record.values["threshold"], 0.0, 1.0)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BrokenFile(f"weights {name!r}: its record describes no link-frame predictor: {error}") from None
    return Predictor(name, design, stored.tensors, stored.record)
