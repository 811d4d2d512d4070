"""The floor as cells: which of them a nozzle can reach at all, and which it has passed over.

What is reachable is computed here from the outlines alone, on a raster. It knows nothing of lanes, of joints or of any
plan, so it can judge them.
"""

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np
import shapely
from scipy.signal import fftconvolve

from tutorialbot import paths
from tutorialbot.cleaning.reach import FORWARD, LEFT
from tutorialbot.scene import room as rooms
from tutorialbot.scene.room import Room

CELL = 0.02  # side of a cell [m]
FINE = 0.01  # step of the places at which the nozzle is tried [m]; every second one is the centre of a cell
HEADINGS = 24  # of the robot within one turn
LENGTH, WIDTH = rooms.NOZZLE_LENGTH, rooms.NOZZLE_WIDTH
TOUCH = 1e-6
BASE_HIGH = 0.29  # of the robot's base [m]


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of a floor. centres: (n, 2) [m], those inside the area; reachable: (n,) whether a nozzle that is clear of
    furniture can cover it; within_reach: (n,) whether one can that has its pipe on it and the robot behind; places:
    (n, 2) column and row in a grid of `shape` (columns, rows) whose first cell has the centre `first` (2,) [m].
    """

    centres: np.ndarray
    reachable: np.ndarray
    within_reach: np.ndarray
    places: np.ndarray
    shape: tuple[int, int]
    first: np.ndarray

    def picture(self, values: np.ndarray, empty: float = np.nan) -> np.ndarray:
        """Return values (n,) of the cells as an image (rows, columns), row 0 the lowest y; `empty` off the area."""
        image = np.full(self.shape[::-1], empty, dtype=float)
        image[self.places[:, 1], self.places[:, 0]] = values
        return image


def floor_to_clean(area: np.ndarray, room: Room) -> shapely.Geometry:
    """Return the part of the area (k, 2) [m] that is in the room and clear of furniture as high as the nozzle.

    Clear is what does not touch: the very line where a wall or a piece begins is not among it.
    """
    furniture = [shapely.Polygon(corners) for corners in room.obstacles(0.0, rooms.NOZZLE_HEIGHT)]
    clear = room.polygon.difference(shapely.union_all(furniture)).buffer(-TOUCH, join_style="mitre")
    return shapely.Polygon(area).buffer(TOUCH, join_style="mitre").intersection(clear)


def reachable_cells(area: np.ndarray, room: Room, headings: int = HEADINGS) -> Cells:
    """Return the cells of `area` (k, 2) [m].

    A cell is within reach when, for some of `headings` in a turn, there is a place for the nozzle such that

    - its footprint, a rectangle, lies within the floor to be cleaned, touches neither furniture nor walls, and covers
      the cell's centre,
    - pipe and cleaner, which the hand holds at a fixed tilt over the nozzle, stand in nobody's way,
    - somewhere within the arm's reach behind it there is room for the robot's base.

    The first alone makes a cell `reachable`. For each heading that is a morphological opening on a raster: where may
    the middle of the nozzle be (erosion), and what does the nozzle cover from there (dilation).
    """
    low, high = np.min(area, axis=0), np.max(area, axis=0)
    cells = np.ceil((high - low) / CELL - TOUCH).astype(int)
    raster = _Raster(low, 2 * cells + 1)  # odd numbers are centres of cells
    inside = raster.within(floor_to_clean(area, room))
    solid, tool = tool_solids(room, raster), tool_points()
    standing = room.polygon.buffer(-rooms.BASE_RADIUS).difference(
        shapely.union_all([shapely.Polygon(part) for part in room.obstacles(0.0, BASE_HIGH)]).buffer(rooms.BASE_RADIUS)
    )
    reach = int(np.hypot(FORWARD[-1], LEFT[-1]) / FINE) + 1
    base = _Raster(low - reach * FINE, 2 * cells + 1 + 2 * reach).within(standing.buffer(TOUCH))
    within_reach, reachable = np.zeros_like(inside), np.zeros_like(inside)
    for heading in 2 * np.pi * np.arange(headings) / headings:
        kernel = nozzle_kernel(heading)
        fits = eroded(inside, kernel)
        reachable |= dilated(fits, kernel)
        cosine, sine = np.cos(heading), np.sin(heading)
        for (x, y, _, _), hit in zip(tool, solid, strict=True):
            fits = fits & ~_shifted(hit, round((cosine * x - sine * y) / FINE), round((sine * x + cosine * y) / FINE))
        stand = fftconvolve(base.astype(float), _behind(heading, reach), mode="same")[reach:-reach, reach:-reach] > 0.5
        within_reach |= dilated(fits & stand, kernel)
    column, row = np.meshgrid(*(np.arange(n) for n in cells), indexing="ij")
    centres = np.stack([raster.x[1::2][column], raster.y[1::2][row]], axis=-1).reshape(-1, 2)
    wanted = shapely.contains_xy(shapely.Polygon(area).buffer(TOUCH), *centres.T)
    places = np.stack([column.ravel(), row.ravel()], axis=-1)[wanted]
    found = (mask[1::2, 1::2].ravel()[wanted] for mask in (reachable, within_reach))
    return Cells(centres[wanted], *found, places, tuple(cells.tolist()), centres[0])


class _Raster:
    """Points every FINE from `low` (2,) on, `shape` (2,) of them."""

    def __init__(self, low: np.ndarray, shape: np.ndarray):
        self.x, self.y = (low[i] + FINE * np.arange(shape[i]) for i in (0, 1))

    def within(self, geometry: shapely.Geometry) -> np.ndarray:
        """Return which points lie in `geometry`, (columns, rows)."""
        shapely.prepare(geometry)
        return shapely.contains_xy(geometry, *np.meshgrid(self.x, self.y, indexing="ij"))


@cache
def tool_points() -> np.ndarray:
    """Return points (m, 4) along pipe and cleaner: x, y, z before, left of and above the nozzle, radius [m]."""
    spec = mujoco.MjSpec.from_file(str(paths.MODELS / "vacuum" / "vacuum.xml"))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    middle = data.site("nozzle").xpos
    found = []
    for name in ("pipe", "housing", "grip"):
        radius, half, _ = model.geom(name).size
        axis = data.geom(name).xmat.reshape(3, 3)[:, 2]
        for along in np.linspace(-half, half, int(half / FINE) + 2):
            found.append((*(data.geom(name).xpos + along * axis - middle), radius))
    return np.array(found)


def tool_solids(room: Room, raster: _Raster) -> list[np.ndarray]:
    """Return for each of `tool_points` where it would be inside furniture or a wall, (columns, rows); the part of the
    raster that is off the room counts as wall.
    """
    known, found = {}, []
    for *_, z, radius in tool_points():
        parts = [shapely.Polygon(part) for part in room.obstacles(max(0.0, z - radius), z + radius)]
        grown = shapely.union_all(parts).buffer(radius)
        key = shapely.to_wkb(grown), radius
        if key not in known:
            known[key] = ~raster.within(room.polygon.buffer(-radius).difference(grown))
        found.append(known[key])
    return found


def _shifted(mask: np.ndarray, columns: int, rows: int) -> np.ndarray:
    """Return mask[i + columns, j + rows] for every i, j; True off the mask."""
    moved = np.ones_like(mask)
    i, j = (slice(max(0, -n), max(0, mask.shape[k] - max(0, n))) for k, n in enumerate((columns, rows)))
    k, m = (slice(max(0, n), max(0, mask.shape[k] - max(0, -n))) for k, n in enumerate((columns, rows)))
    moved[i, j] = mask[k, m]
    return moved


def _behind(heading: float, reach: int) -> np.ndarray:
    """Return the raster (2 reach + 1, ...) of where the nozzle can be, seen from the base, which is in the middle."""
    x, y = np.meshgrid(*2 * (FINE * np.arange(-reach, reach + 1),), indexing="ij")
    along, across = np.cos(heading) * x + np.sin(heading) * y, np.cos(heading) * y - np.sin(heading) * x
    inside = (along > FORWARD[0] - FINE) & (along < FORWARD[-1] + FINE)
    return inside & (across > LEFT[0] - FINE) & (across < LEFT[-1] + FINE)


def nozzle_kernel(angle: float) -> np.ndarray:
    """Return the raster (m, m) of step FINE that the nozzle covers, centred, the robot's heading `angle` [rad]."""
    n = int(np.hypot(LENGTH, WIDTH) / 2 / FINE) + 1
    x, y = np.meshgrid(*2 * (FINE * np.arange(-n, n + 1),), indexing="ij")
    along, across = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
    return (np.abs(along) <= LENGTH / 2 + TOUCH) & (np.abs(across) <= WIDTH / 2 + TOUCH)


def eroded(inside: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return where `kernel` (m, m), symmetric about its middle, lies wholly within `inside`."""
    pad = kernel.shape[0] // 2
    outside = np.pad(~inside, pad, constant_values=True).astype(float)
    return fftconvolve(outside, kernel, mode="same")[pad:-pad, pad:-pad] < 0.5


def dilated(mask: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return what `kernel` (m, m), symmetric about its middle, covers from all places in `mask`."""
    return fftconvolve(mask.astype(float), kernel, mode="same") > 0.5


def passed_over(cells: Cells, poses: np.ndarray) -> np.ndarray:
    """Return which cells (n,) have their centre under the nozzle at one or more of poses (m, 3), x, y [m] and yaw."""
    index = np.full(cells.shape, -1)
    index[cells.places[:, 0], cells.places[:, 1]] = np.arange(len(cells.centres))
    reach = int(np.hypot(LENGTH, WIDTH) / 2 / CELL) + 1
    window = np.stack(np.meshgrid(*2 * (np.arange(-reach, reach + 1),), indexing="ij"), axis=-1).reshape(-1, 2)
    covered = np.zeros(len(cells.centres), dtype=bool)
    for block in np.array_split(poses, max(1, len(poses) // 2000)):
        near = np.round((block[:, :2] - cells.first) / CELL).astype(int)[:, None] + window
        away = cells.first + CELL * near - block[:, None, :2]
        cosine, sine = np.cos(block[:, 2, None]), np.sin(block[:, 2, None])
        under = np.abs(cosine * away[..., 0] + sine * away[..., 1]) <= LENGTH / 2
        under &= np.abs(cosine * away[..., 1] - sine * away[..., 0]) <= WIDTH / 2
        under &= ((near >= 0) & (near < cells.shape)).all(axis=-1)
        which = index[tuple(near[under].T)]
        covered[which[which >= 0]] = True
    return covered
