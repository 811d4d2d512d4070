"""The floor as cells: which of them a nozzle can reach at all, and which it has passed over.

What is reachable is computed here from the outlines alone. It knows nothing of lanes, of the arm or of any plan, so it
can judge them.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.signal import fftconvolve

from tutorialbot.scene import room as rooms
from tutorialbot.scene.room import Room

CELL = 0.02  # side of a cell [m]
FINE = 0.01  # step of the places at which the nozzle is tried [m]; every second one is the centre of a cell
ORIENTATIONS = 24  # of the nozzle within half a turn
LENGTH, WIDTH = rooms.NOZZLE_LENGTH, rooms.NOZZLE_WIDTH
TOUCH = 1e-6


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of a floor. centres: (n, 2) [m], those inside the area; reachable: (n,) whether a nozzle can cover it;
    places: (n, 2) column and row in a grid of `shape` (columns, rows) whose first cell has the centre `first` (2,) [m].
    """

    centres: np.ndarray
    reachable: np.ndarray
    places: np.ndarray
    shape: tuple[int, int]
    first: np.ndarray

    def picture(self, values: np.ndarray, empty: float = np.nan) -> np.ndarray:
        """Return values (n,) of the cells as an image (rows, columns), row 0 the lowest y; `empty` off the area."""
        image = np.full(self.shape[::-1], empty, dtype=float)
        image[self.places[:, 1], self.places[:, 0]] = values
        return image


def floor_to_clean(area: np.ndarray, room: Room) -> shapely.Geometry:
    """Return the area (k, 2) [m] inside the room, minus furniture as high as the nozzle."""
    furniture = [shapely.Polygon(corners) for corners in room.obstacles(0.0, rooms.NOZZLE_HEIGHT)]
    return shapely.Polygon(area).intersection(room.polygon).difference(shapely.union_all(furniture))


def reachable_cells(area: np.ndarray, room: Room, orientations: int = ORIENTATIONS) -> Cells:
    """Return the cells of `area` (k, 2) [m].

    A cell is reachable when the nozzle's footprint, a rectangle, lies within the floor to be cleaned (closed: it may
    touch furniture and walls) at some of `orientations` in half a turn, and covers the cell's centre. For each
    orientation that is a morphological opening on a raster: where may the middle of the nozzle be (erosion), and what
    does the nozzle cover from there (dilation).
    """
    low, high = np.min(area, axis=0), np.max(area, axis=0)
    cells = np.ceil((high - low) / CELL - TOUCH).astype(int)
    x, y = (low[i] + FINE * np.arange(2 * cells[i] + 1) for i in (0, 1))  # odd numbers are centres of cells
    free = floor_to_clean(area, room).buffer(TOUCH)
    shapely.prepare(free)
    inside = shapely.contains_xy(free, *np.meshgrid(x, y, indexing="ij"))
    covered = np.zeros_like(inside)
    for angle in np.pi * np.arange(orientations) / orientations:
        covered |= opened(inside, nozzle_kernel(angle))
    column, row = np.meshgrid(*(np.arange(n) for n in cells), indexing="ij")
    centres = np.stack([x[1::2][column], y[1::2][row]], axis=-1).reshape(-1, 2)
    wanted = shapely.contains_xy(shapely.Polygon(area).buffer(TOUCH), *centres.T)
    places = np.stack([column.ravel(), row.ravel()], axis=-1)[wanted]
    return Cells(centres[wanted], covered[1::2, 1::2].ravel()[wanted], places, tuple(cells.tolist()), centres[0])


def nozzle_kernel(angle: float) -> np.ndarray:
    """Return the raster (m, m) of step FINE that the nozzle covers, centred, its long side turned to `angle` [rad]."""
    n = int(np.hypot(LENGTH, WIDTH) / 2 / FINE) + 1
    x, y = np.meshgrid(*2 * (FINE * np.arange(-n, n + 1),), indexing="ij")
    along, across = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
    return (np.abs(along) <= WIDTH / 2 + TOUCH) & (np.abs(across) <= LENGTH / 2 + TOUCH)


def opened(inside: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return what `kernel` (m, m), symmetric about its middle, covers when it moves about wholly within `inside`."""
    pad = kernel.shape[0] // 2
    blocked = fftconvolve(np.pad(~inside, pad, constant_values=True).astype(float), kernel, mode="same") > 0.5
    fits = ~blocked[pad:-pad, pad:-pad]
    return fftconvolve(fits.astype(float), kernel, mode="same") > 0.5


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
