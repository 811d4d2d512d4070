"""A C-space from voxels by looking up: no network and no training.

Every voxel blocks a fixed set of configurations. Kept once as a bit mask each, a scene's C-space is the union of the
masks of its occupied voxels. Taken literally that is the octree's C-space, which blocks too much: a voxel that a box
merely cuts is not full. So each voxel may be smaller all round by an `inset`; the cut ones then weigh less.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tutorialbot.errors import InvalidValue, finite_number, whole_number
from tutorialbot.vox2c import kernels
from tutorialbot.vox2c.arm import BAR, DOMAIN, JOINT_1, SLABS
from tutorialbot.vox2c.labels import SIZES, cells, check_voxels, slab_layers, tables

INSETS = {("raster", 32): 0.030, ("cameras", 32): 0.025, ("raster", 64): 0.0165, ("cameras", 64): 0.0105}
# Source and size -> inset [m] of the best pooled IoU with exact labels, at 5 degrees, on the seeds 700000 to 701499.


@dataclass(frozen=True, eq=False)
class LookupTable:
    """For voxels (size, size, size) and n cells an angle: entries (k, 4), masks (k, words), see kernels.united.

    An entry is a row of voxels along y that lie in the slab of one bar, with the configurations that they block.
    """

    size: int
    n: int
    entries: np.ndarray
    masks: np.ndarray

    def cspace(self, voxels) -> np.ndarray:
        """Return the C-space of `voxels`, bool (n, n), True = collision; raises as labels.check_voxels does."""
        words = kernels.united(check_voxels(voxels, self.size), self.entries, self.masks)
        bits = np.unpackbits(words.view(np.uint8), count=self.n**2, bitorder="little")
        return bits.view(bool).reshape(self.n, self.n)


def table(resolution_deg: float, size: int = 32, inset: float = 0.0) -> LookupTable:
    """Build the table for `size` voxels a side, each smaller by `inset` [m] on every face; kept for the next call.

    Raises InvalidValue for a resolution that does not divide 360 degrees, a size that is not 1 to 256, and an inset
    that leaves nothing; InvalidType for what is no number.
    """
    n = cells(resolution_deg)
    if whole_number("size", size, SIZES[0]) > SIZES[1]:
        raise InvalidValue("size", size, f"at most {SIZES[1]} voxels along a side")
    half = (DOMAIN[1][0] - DOMAIN[0][0]) / size / 2
    if finite_number("inset", inset, 0.0) >= half:
        raise InvalidValue("inset", inset, f"less than half a voxel, {half:g} m")
    return _table(n, int(size), float(inset))


@lru_cache(maxsize=8)
def _table(n: int, size: int, inset: float) -> LookupTable:
    side = (DOMAIN[1][0] - DOMAIN[0][0]) / size
    nothing, angles, entries, masks = np.empty((0, 4)), tables(n), [], []
    words, half = -(-(n**2) // 64), side / 2 - inset
    middles = side * (np.arange(size) + 0.5)
    for bar, slab in enumerate(SLABS):
        layers = slab_layers(size, slab, inset)
        for i, x in enumerate(middles + DOMAIN[0][0] - JOINT_1[0]):
            for j, z in enumerate(middles + DOMAIN[0][2] - JOINT_1[2]):
                one = np.array([[x, z, half, half]])
                blocked = kernels.cspace(*((one, nothing) if bar == 0 else (nothing, one)), angles, BAR)
                if layers[1] > layers[0] and blocked.any():
                    entries.append((i, *layers, j))
                    mask = np.zeros(8 * words, dtype=np.uint8)
                    packed = np.packbits(blocked, bitorder="little")
                    mask[: len(packed)] = packed
                    masks.append(mask.view(np.uint64))
    return LookupTable(size, n, np.array(entries), np.array(masks))


def lookup_cspace(voxels, resolution_deg: float, *, inset: float = 0.0) -> np.ndarray:
    """Return the C-space of a voxel grid, bool (n, n), True = collision, cells as labels.exact_cspace has them.

    Without inset it equals labels.octree_cspace bit for bit. The first call for a resolution builds the table.
    """
    voxels = check_voxels(voxels)
    return table(resolution_deg, len(voxels), inset).cspace(voxels)
