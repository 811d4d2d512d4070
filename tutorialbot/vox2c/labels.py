"""Labels: the true C-space of a scene, from its boxes ("exact") or from its voxels, as the paper has it ("octree").

The paper records OctoMap's answer at every posture (section 4.1.2); OctoMap sees voxels, and a voxel that a box merely
cuts is full. So there are two kinds of labels, and they differ: at 32 voxels a side about 40 % of the obstacle that the
octree finds is free in truth. Every function here says in its name which kind it makes; KINDS names them for tables and
files.
"""

import math
from collections.abc import Callable
from functools import lru_cache

import coal
import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, binary_array, finite_number
from tutorialbot.vox2c import kernels
from tutorialbot.vox2c.arm import (
    BAR,
    DOMAIN,
    ELBOW,
    HALF_LENGTH,
    HALF_WIDTH,
    JOINT_1,
    MIDDLE,
    OFFSET,
    SLABS,
    configurations,
)
from tutorialbot.vox2c.scenes import BoxScene

KINDS = ("exact", "octree")
FINEST = 0.1  # finer grids than this fill the memory [deg]
SIZES = (1, 256)  # of a voxel grid
TOUCH = 1e-9  # layers that enter a slab by less than this do not count [m]: rounding


# -- grids of angles -----------------------------------------------------------------------------------------------


def cells(resolution_deg: float) -> int:
    """Return how many cells of `resolution_deg` make a turn; raise InvalidValue when it does not divide 360 degrees."""
    resolution = finite_number("resolution_deg", resolution_deg, FINEST, 360.0)
    n = round(360.0 / resolution)
    if abs(n * resolution - 360.0) > 1e-9:
        raise InvalidValue("resolution_deg", resolution_deg, "a number of degrees that divides 360")
    return n


def angles(resolution_deg: float) -> np.ndarray:
    """Return the angles (n,) [rad] of the cells along either axis: cell k at -180 + k * resolution degrees."""
    n = cells(resolution_deg)
    return np.radians(-180.0 + 360.0 / n * np.arange(n))


@lru_cache(maxsize=8)
def tables(n: int) -> np.ndarray:
    """Sine and cosine (4, n) of theta1 and of phi, as kernels.cspace takes them."""
    theta1, phi = 2 * np.pi * (np.arange(n) / n - 0.5), 2 * np.pi * np.arange(n) / n
    return np.array([np.sin(theta1), np.cos(theta1), np.sin(phi), np.cos(phi)])


# -- from boxes ----------------------------------------------------------------------------------------------------


def _rectangles(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, _, z = JOINT_1
    return tuple(kernels.rectangles(low, high, *slab, x, z) for slab in SLABS)


def _scene(value: BoxScene) -> BoxScene:
    if not isinstance(value, BoxScene):
        raise InvalidType("scene", value, "a scenes.BoxScene")
    return value


def exact_cspace(scene: BoxScene, resolution_deg: float) -> np.ndarray:
    """Return the C-space of a scene, bool (n, n): True where the arm collides with a box.

    Axis 0 is theta1, axis 1 theta2; cell k is the angle -180 + k * resolution_deg degrees itself, not an interval.
    Exact at these angles. Raises InvalidValue when the resolution does not divide 360 degrees.
    """
    return kernels.cspace(*_rectangles(*_scene(scene).corners), tables(cells(resolution_deg)), BAR)


def collides(scene: BoxScene, q) -> np.ndarray:
    """Return for each configuration of q (k, 2) [rad] whether the arm collides with a box: bool (k,), exact.

    Raises InvalidType or InvalidValue for another shape, NaN or infinity.
    """
    return kernels.collide(*_rectangles(*_scene(scene).corners), configurations(q), BAR)


def state_test(scene: BoxScene) -> Callable[[float, float], bool]:
    """Return a function (theta1, theta2) [rad] -> bool that says whether the arm collides; for planners, unchecked."""
    return _state_test(*_rectangles(*_scene(scene).corners))


def _state_test(second: np.ndarray, third: np.ndarray) -> Callable[[float, float], bool]:
    test = kernels.collides
    return lambda theta1, theta2: test(second, third, theta1, theta2, BAR)


# -- from voxels ---------------------------------------------------------------------------------------------------


def check_voxels(voxels, size: int | None = None) -> np.ndarray:
    """Return `voxels` as a bool array (n, n, n); raise InvalidType or InvalidValue when it is no binary cube.

    Numbers are fine when all are 0 or 1. `size` is the n that it must have; None takes any.
    """
    try:
        array = np.asarray(voxels)
    except ValueError:
        raise InvalidType("voxels", voxels, "an array of 0 and 1") from None
    expected = "a cube (n, n, n)" if size is None else f"shape ({size}, {size}, {size})"
    if array.ndim != 3 or len(set(array.shape)) != 1 or not SIZES[0] <= len(array) <= SIZES[1]:
        raise InvalidValue("voxels", f"array of shape {array.shape}", f"{expected}, n from {SIZES[0]} to {SIZES[1]}")
    if size is not None and len(array) != size:
        raise InvalidValue("voxels", f"array of shape {array.shape}", expected)
    return binary_array("voxels", array)


def slab_layers(size: int, slab: tuple[float, float], inset: float = 0.0) -> tuple[int, int]:
    """Return the first layer along y, and one beyond the last, whose voxels enter a slab.

    The voxels are smaller by `inset` [m] on every face. Merely touching does not count.
    """
    side = (DOMAIN[1][0] - DOMAIN[0][0]) / size
    low = DOMAIN[0][1] + side * np.arange(size) + inset
    enter = np.flatnonzero((low < slab[1] - TOUCH) & (low + side - 2 * inset > slab[0] + TOUCH))
    return (int(enter[0]), int(enter[-1]) + 1) if len(enter) else (0, 0)


def voxel_rectangles(voxels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the bars of either slab can meet, in few pieces: within a slab only x and z matter."""
    x, _, z = JOINT_1
    side, found = (DOMAIN[1][0] - DOMAIN[0][0]) / len(voxels), []
    for slab in SLABS:
        first, last = slab_layers(len(voxels), slab)
        cells = side * kernels.merged(voxels[:, first:last].any(axis=1))
        centres = (cells[:, :2] + cells[:, 2:]) / 2 + [DOMAIN[0][0] - x, DOMAIN[0][2] - z]
        found.append(np.hstack([centres, (cells[:, 2:] - cells[:, :2]) / 2]))
    return tuple(found)


def octree_cspace(voxels, resolution_deg: float) -> np.ndarray:
    """Return the C-space of a voxel grid, bool (n, n): True where the arm collides with an occupied voxel.

    The paper's labels: what an octree of these voxels answers at every posture, computed as boxes (a test holds it to
    coal's octree). Conventions and errors as of `exact_cspace`; a grid that is no binary cube is refused.
    """
    n = cells(resolution_deg)
    return kernels.cspace(*voxel_rectangles(check_voxels(voxels)), tables(n), BAR)


def octree_collides(voxels, q) -> np.ndarray:
    """Return for each configuration of q (k, 2) [rad] whether the arm collides with an occupied voxel: bool (k,)."""
    return kernels.collide(*voxel_rectangles(check_voxels(voxels)), configurations(q), BAR)


def octree_state_test(voxels) -> Callable[[float, float], bool]:
    """Return a function (theta1, theta2) [rad] -> bool, True on an occupied voxel; for planners, unchecked."""
    return _state_test(*voxel_rectangles(check_voxels(voxels)))


# -- references in coal --------------------------------------------------------------------------------------------


def coal_test(scene: BoxScene) -> Callable[[float, float], bool]:
    """Return coal's own answer as a function (theta1, theta2) -> bool: 3-D boxes one by one. The slow reference."""
    low, high = _scene(scene).corners
    return _coal(
        [(coal.Box(*(b - a)), coal.Transform3s(np.eye(3), (a + b) / 2)) for a, b in zip(low, high, strict=True)]
    )


def coal_octree_test(voxels) -> Callable[[float, float], bool]:
    """Return coal's octree of the occupied voxels as a function (theta1, theta2) -> bool: the paper's OctoMap."""
    voxels = check_voxels(voxels)
    side = (DOMAIN[1][0] - DOMAIN[0][0]) / len(voxels)
    if not voxels.any():
        return lambda theta1, theta2: False
    centres = np.array(DOMAIN[0]) + side * (np.argwhere(voxels) + 0.5)
    return _coal([(coal.makeOctree(centres, side), coal.Transform3s.Identity())])


def _coal(things: list) -> Callable[[float, float], bool]:
    """As quick as coal goes from Python: everything is made once, and a state only moves the bar."""
    bar, placed = coal.Box(2 * HALF_WIDTH, 2 * HALF_WIDTH, 2 * HALF_LENGTH), coal.Transform3s.Identity()
    request, result, turn, place = coal.CollisionRequest(), coal.CollisionResult(), np.eye(3), np.zeros(3)
    x, y, z = JOINT_1

    def meets(x: float, y: float, z: float, s: float, c: float) -> bool:
        turn[0, 0] = turn[2, 2] = c
        turn[0, 2], turn[2, 0] = s, -s
        place[:] = x + MIDDLE * s, y, z + MIDDLE * c
        placed.setTransform(turn, place)
        for shape, where in things:
            result.clear()
            if coal.collide(bar, placed, shape, where, request, result):
                return True
        return False

    def test(theta1: float, theta2: float) -> bool:
        s, c = math.sin(theta1), math.cos(theta1)
        phi = theta1 + theta2
        return meets(x, y, z, s, c) or meets(x + ELBOW * s, y + OFFSET, z + ELBOW * c, math.sin(phi), math.cos(phi))

    return test
