"""Occupancy grids of paper 3: what four depth cameras see of a scene as voxels, and other ways to the same grid."""

import numpy as np

from tutorialbot.vox2c.arm import DOMAIN
from tutorialbot.vox2c.scenes import BoxScene

TOUCH = 1e-9  # a box that enters a voxel by less than this does not fill it [m]: rounding


def raster(scene: BoxScene, size: int) -> np.ndarray:
    """Return the voxels that a box enters, bool (size, size, size): full boxes, hidden parts too."""
    grid = np.zeros((size, size, size), dtype=bool)
    origin, side = np.array(DOMAIN[0]), (DOMAIN[1][0] - DOMAIN[0][0]) / size
    low, high = scene.corners
    first = np.maximum(np.floor((low - origin + TOUCH) / side), 0).astype(int)
    last = np.minimum(np.ceil((high - origin - TOUCH) / side), size).astype(int)
    for a, b in zip(first, last, strict=True):
        grid[a[0] : b[0], a[1] : b[1], a[2] : b[2]] = True
    return grid
