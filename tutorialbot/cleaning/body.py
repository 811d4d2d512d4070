"""Where robot and vacuum cleaner fit: the robot as upright columns, the room as distances to what stands in a height.

A column is a disc of some radius between two heights. The distance from its middle to the nearest outline in those
heights, less its radius, is its clearance; the smallest one of all columns is the robot's. The robot's columns are
taken from the solid geoms of the simulated model and enclose them, so a plan that is clear here is clear there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import shapely
from scipy.ndimage import map_coordinates

from tutorialbot.cleaning.reach import FORWARD, LEFT, LIFT, Postures
from tutorialbot.scene import room as rooms
from tutorialbot.scene.room import Room

RASTER = 0.02  # [m]
SPACING = 0.03  # of columns along a capsule [m]
MANY = 1000  # poses
BAND = 0.02  # heights are rounded outwards to multiples of it [m]


class Distances:
    """Distances [m] from places on the floor to walls and furniture, each band of heights on a raster of its own."""

    def __init__(self, room: Room):
        self.room = room
        self.low = room.floor.min(axis=0)
        self.x, self.y = (np.arange(self.low[i], room.floor[:, i].max() + 2 * RASTER, RASTER) for i in (0, 1))
        self.points = shapely.points(*np.meshgrid(self.x, self.y, indexing="ij"))
        self.inside = shapely.covers(room.polygon, self.points)
        self.rasters = np.empty((0, len(self.x), len(self.y)))
        self._bands: dict[tuple[float, float], int] = {}
        self._same: dict[bytes, int] = {}

    def layer(self, low: float, high: float) -> int:
        """Return which of `rasters` holds the distances [m] at (x, y) for heights low..high; negative off the floor."""
        band = (low, high)
        if band not in self._bands:
            outlines = [shapely.Polygon(corners) for corners in self.room.obstacles(low, high)]
            solid = shapely.union_all([self.room.polygon.exterior, *outlines])
            key = shapely.to_wkb(solid)
            if key not in self._same:
                shapely.prepare(solid)
                away = shapely.distance(solid, self.points)
                self._same[key] = len(self.rasters)
                self.rasters = np.concatenate([self.rasters, np.where(self.inside, away, -away)[None]])
            self._bands[band] = self._same[key]
        return self._bands[band]

    def at(self, layers: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return distances (n, m) [m] at places x, y (n, m) in rasters `layers` (m,), linear between their points."""
        places = np.stack([np.broadcast_to(layers, x.shape), (x - self.low[0]) / RASTER, (y - self.low[1]) / RASTER])
        return map_coordinates(self.rasters, places, order=1, mode="nearest")

    def between(self, raster: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return values of a raster (len(x), len(y)) of one's own between its points, linear."""
        places = np.stack([(x - self.low[0]) / RASTER, (y - self.low[1]) / RASTER])
        return map_coordinates(raster, places, order=1, mode="nearest")


@dataclass(frozen=True, eq=False)
class Columns:
    """Upright discs in the base's frame: middles (m, 2), radii (m,), heights low and high (m,) [m]."""

    middles: np.ndarray
    radii: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def clearance(self, distances: Distances, poses: np.ndarray, shifts: np.ndarray | None = None) -> np.ndarray:
        """Return the smallest clearance (...) [m] of all discs with the base at poses (..., 3).

        shifts (..., 2) [m]: where the columns' own frame is in the base's; None: there.
        """
        flat = poses.reshape(-1, 3)
        cosine, sine = np.cos(flat[:, 2, None]), np.sin(flat[:, 2, None])
        forward, left = (self.middles[:, k] for k in (0, 1))
        if shifts is not None:
            forward, left = (self.middles[:, k] + shifts.reshape(-1, 2)[:, k, None] for k in (0, 1))
        x = flat[:, 0, None] + cosine * forward - sine * left
        y = flat[:, 1, None] + sine * forward + cosine * left
        layers = np.array([distances.layer(*band) for band in zip(self.low.tolist(), self.high.tolist(), strict=True)])
        if len(flat) < MANY:
            return (distances.at(layers, x, y) - self.radii).min(axis=1).reshape(poses.shape[:-1])
        least = np.full(len(flat), np.inf)  # faster, for many poses
        for k, layer in enumerate(layers):
            away = distances.between(distances.rasters[layer], x[:, k], y[:, k])
            np.minimum(least, away - self.radii[k], out=least)
        return least.reshape(poses.shape[:-1])

    def moved(self, shift: Sequence[float]) -> "Columns":
        """Return the same columns, their frame's origin at `shift` (2,)."""
        return Columns(self.middles - np.asarray(shift), self.radii, self.low, self.high)

    def __add__(self, other: "Columns") -> "Columns":
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Columns(*(np.concatenate(pair) for pair in pairs))


@dataclass(frozen=True, eq=False)
class Body:
    """The robot's columns, by what they move with. `base`: all that never moves in the base's frame; `arm[i, j]`: upper
    arm and forearm with the nozzle at FORWARD[i], LEFT[j], in the base's frame; `vacuum`: cleaner, hand and pipe, not
    the nozzle, about the middle of the nozzle; `nozzle`: its rim, the same; `rest`: all, in the rest posture.
    """

    base: Columns
    arm: dict[tuple[int, int], Columns]
    vacuum: Columns
    nozzle: Columns
    rest: Columns

    def clearance(self, distances: Distances, poses: np.ndarray, nozzles: np.ndarray) -> np.ndarray:
        """Return the clearance (n,) [m] of the whole robot, the base at poses (n, 3), the nozzle at nozzles (n, 2) [m]
        in the base's frame, lifted. The arm is that of the solved posture next to it.
        """
        nozzles = np.broadcast_to(nozzles, (len(poses), 2))
        least = self.base.clearance(distances, poses)
        np.minimum(least, (self.vacuum + self.nozzle).clearance(distances, poses, nozzles), out=least)
        nearest = np.stack([np.abs(nozzles[:, k, None] - grid).argmin(axis=1)
                            for k, grid in enumerate((FORWARD, LEFT))], axis=1)  # fmt: skip
        for key in {tuple(row) for row in nearest.tolist()}:
            same = (nearest == key).all(axis=1)
            least[same] = np.minimum(least[same], self.arm[key].clearance(distances, poses[same]))
        return least


def measure(model: mujoco.MjModel, postures: Postures) -> Body:
    """Return the columns of an assembled world's robot (see `scene.room.assemble`) in the solved postures."""
    data = mujoco.MjData(model)
    parts = {"base": [], "arm": [], "vacuum": []}
    for geom in np.flatnonzero((model.geom_contype & 1 > 0) & (model.geom_conaffinity & 2 > 0)):
        if model.geom(geom).name == "vacuum/nozzle":
            continue
        name = model.body(model.geom_bodyid[geom]).name
        held = name.startswith(("vacuum/", "finger")) or name in ("arm_hand", "thumb")
        parts["vacuum" if held else "arm" if name.startswith("arm_") else "base"].append(int(geom))

    def columns(geoms: list[int], shift: Sequence[float] = (0.0, 0.0)) -> Columns:
        return _columns(model, data, geoms).moved(shift)

    arm = {}
    for i, j in np.ndindex(len(FORWARD), len(LEFT)):
        rooms.place(model, data, np.zeros(3), postures.down[i, j])
        arm[i, j] = columns(parts["arm"])
    i, j = len(FORWARD) // 2, len(LEFT) // 2
    rooms.place(model, data, np.zeros(3), postures.down[i, j])
    vacuum, base = columns(parts["vacuum"], (FORWARD[i], LEFT[j])), columns(parts["base"])
    rooms.place(model, data, np.zeros(3), postures.raising[0])
    middle = data.site("vacuum/nozzle").xpos[:2]
    rest = columns([*parts["arm"], *parts["vacuum"]]) + _rim().moved(-middle) + base
    return Body(base, arm, vacuum, _rim(), rest)


def _rim() -> Columns:
    """The nozzle's outline as points every centimetre, 3 cm off the floor or on it."""
    ring = shapely.box(*(-0.5 * np.array([rooms.NOZZLE_LENGTH, rooms.NOZZLE_WIDTH])),
                       *(0.5 * np.array([rooms.NOZZLE_LENGTH, rooms.NOZZLE_WIDTH]))).exterior  # fmt: skip
    points = shapely.get_coordinates(shapely.segmentize(ring, 0.02))[:-1]
    n = len(points)
    return Columns(points, np.zeros(n), np.zeros(n), np.full(n, _up(rooms.NOZZLE_HEIGHT + LIFT)))


def _up(height: float) -> float:
    return round(np.ceil(height / BAND - 1e-6) * BAND, 6)


def _columns(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> Columns:
    """Enclose geoms where they are now: capsules by discs along them, all else by one disc; the base is at zero."""
    found = []
    for geom in geoms:
        kind, size, place = model.geom_type[geom], model.geom_size[geom], data.geom_xpos[geom]
        axes = data.geom_xmat[geom].reshape(3, 3)
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            n = int(np.ceil(2 * size[1] / SPACING)) + 1
            for at in place + np.linspace(-size[1], size[1], n)[:, None] * axes[:, 2]:
                half = size[1] / (n - 1)
                grown = np.hypot(size[0], half * np.hypot(*axes[:2, 2]))  # what bulges between two discs
                found.append((*at[:2], grown, at[2] - size[0] - half, at[2] + size[0] + half))
        elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            found.append((*place[:2], size[0], place[2] - size[0], place[2] + size[0]))
        elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:  # upright: the base
            found.append((*place[:2], size[0], place[2] - size[1], place[2] + size[1]))
        else:  # a box
            corners = axes @ (size * np.array(list(np.ndindex(2, 2, 2))) * 2 - size).T
            found.append((*place[:2], np.hypot(*corners[:2]).max(), *(place[2] + np.array([-1, 1]) * corners[2].max())))
    x, y, radii, low, high = np.array(found).T
    low = np.maximum(np.floor(low / BAND + 1e-6) * BAND, 0.0).round(6)
    return Columns(np.stack([x, y], axis=1), radii, low, np.array([_up(h) for h in high]))
