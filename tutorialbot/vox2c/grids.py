"""Occupancy grids of paper 3: what four depth cameras see of a scene as voxels, and other ways to the same grid."""

import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, one_of, whole_number
from tutorialbot.vox2c import cameras
from tutorialbot.vox2c.arm import DOMAIN
from tutorialbot.vox2c.scenes import BoxScene

SOURCES = ("cameras", "raster", "rendered")
LARGEST = 256  # voxels along a side
TOUCH = 1e-9  # a box that enters a voxel by less than this does not fill it [m]: rounding
UPRIGHT = (0.0, 0.0)


def voxelize(scene: BoxScene, source: str = "cameras", size: int = 32, *, q=UPRIGHT) -> np.ndarray:
    """Return the occupied voxels of a scene, bool (size, size, size), axes x, y, z over arm.DOMAIN.

    "cameras": the voxels that hold a point which one of four depth cameras sees (paper 3, section 4.1), the arm at q
    (2,) [rad] hiding some; only the boxes' upper shells. "rendered": the same from depth pictures; needs OpenGL.
    "raster": every voxel that a box enters, hidden ones too; q changes nothing. Raises InvalidType or InvalidValue.
    """
    one_of("source", source, SOURCES)
    check_size(size)
    q = finite_array("q", q, (2,))
    if not isinstance(scene, BoxScene):
        raise InvalidType("scene", scene, "a scenes.BoxScene")
    if source == "raster":
        return _raster(scene, size)
    return _of_points(_SEE[source](scene, q), size)


def check_size(size: int) -> int:
    """Return `size`, the voxels along a side, or raise InvalidType or InvalidValue."""
    if whole_number("size", size, 1) > LARGEST:
        raise InvalidValue("size", size, f"at most {LARGEST} voxels along a side")
    return size


def point_cloud(scene: BoxScene, *, q=UPRIGHT, source: str = "cameras") -> np.ndarray:
    """Return the points (k, 3) [m] that the cameras see on boxes, robot and floor taken out; source not "raster"."""
    one_of("source", source, _SEE)
    if not isinstance(scene, BoxScene):
        raise InvalidType("scene", scene, "a scenes.BoxScene")
    return _SEE[source](scene, finite_array("q", q, (2,)))


_SEE = {"cameras": cameras.cast, "rendered": cameras.render}


def _of_points(points: np.ndarray, size: int) -> np.ndarray:
    grid = np.zeros((size, size, size), dtype=bool)
    index = np.floor((points - DOMAIN[0]) * (size / (DOMAIN[1][0] - DOMAIN[0][0]))).astype(int)
    inside = ((index >= 0) & (index < size)).all(axis=1)
    grid[tuple(index[inside].T)] = True
    return grid


def _raster(scene: BoxScene, size: int) -> np.ndarray:
    grid = np.zeros((size, size, size), dtype=bool)
    origin, side = np.array(DOMAIN[0]), (DOMAIN[1][0] - DOMAIN[0][0]) / size
    low, high = scene.corners
    first = np.maximum(np.floor((low - origin + TOUCH) / side), 0).astype(int)
    last = np.minimum(np.ceil((high - origin - TOUCH) / side), size).astype(int)
    for a, b in zip(first, last, strict=True):
        grid[a[0] : b[0], a[1] : b[1], a[2] : b[2]] = True
    return grid
