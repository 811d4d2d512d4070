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

from tutorialbot.cleaning.reach import DENSE, FORWARD, LEFT, LIFT, Postures
from tutorialbot.scene import room as rooms
from tutorialbot.scene.room import Room

RASTER = 0.01  # [m]
SPACING = 0.01  # of columns along a capsule [m]
STEEP = 0.7  # cosine of the angle to the vertical up to which a capsule is sliced
MANY = 1000  # poses
HALF = 0.5 * np.array([rooms.NOZZLE_LENGTH, rooms.NOZZLE_WIDTH])
BAND = 0.005  # heights are rounded outwards to multiples of it [m]


class Distances:
    """Distances [m] from places on the floor to walls and furniture, each band of heights on a raster of its own."""

    def __init__(self, room: Room):
        self.room = room
        self.low = room.floor.min(axis=0)
        self.x, self.y = (np.arange(self.low[i], room.floor[:, i].max() + 2 * RASTER, RASTER) for i in (0, 1))
        x, y = np.meshgrid(self.x, self.y, indexing="ij")
        self._walls = np.where(shapely.contains_xy(room.polygon, x, y), 1.0, -1.0) * _from_edges(room.floor, x, y)
        self.rasters = np.empty((0, len(self.x), len(self.y)))
        self._bands: dict[tuple[float, float], int] = {}
        self._same: dict[tuple[bytes, ...], int] = {}
        low = room.obstacles(0.0, rooms.NOZZLE_HEIGHT + LIFT)
        self.corners = np.concatenate([room.floor, *low])  # that a nozzle can meet, on the floor or lifted
        self._parts: dict[bytes, np.ndarray] = {}
        self._layers: dict[Columns, np.ndarray] = {}

    def layers(self, columns: "Columns") -> np.ndarray:
        """Return which of `rasters` holds the distances for the heights of each column (..., m)."""
        if columns not in self._layers:
            bands = np.stack([columns.low, columns.high], axis=-1)
            kinds, which = np.unique(bands.reshape(-1, 2), axis=0, return_inverse=True)
            numbers = np.array([self.layer(low, high) for low, high in kinds.tolist()])
            self._layers[columns] = numbers[which].reshape(columns.low.shape)
        return self._layers[columns]

    def layer(self, low: float, high: float) -> int:
        """Return which of `rasters` holds the distances [m] at (x, y) for heights low..high; negative off the floor."""
        band = (low, high)
        if band not in self._bands:
            outlines = {corners.tobytes(): corners for corners in self.room.obstacles(low, high)}
            key = tuple(sorted(outlines))
            if key not in self._same:
                nearest = np.minimum.reduce([self._walls, *map(self._part, outlines.values())])
                self._same[key] = len(self.rasters)
                self.rasters = np.concatenate([self.rasters, nearest[None]])
            self._bands[band] = self._same[key]
        return self._bands[band]

    def _part(self, corners: np.ndarray) -> np.ndarray:
        """Return the distances to one convex outline (k, 2), 0 inside."""
        key = corners.tobytes()
        if key not in self._parts:
            x, y = np.meshgrid(self.x, self.y, indexing="ij")
            inside = shapely.contains_xy(shapely.Polygon(corners), x, y)
            self._parts[key] = np.where(inside, 0.0, _from_edges(corners, x, y))
        return self._parts[key]

    def at(self, layers: np.ndarray | int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return distances (...) [m] at places x, y (...) in rasters `layers`, linear between their points."""
        return self._linear(self.rasters, layers, x, y)

    def between(self, raster: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return values of a raster (len(x), len(y)) of one's own between its points, linear."""
        return self._linear(raster, 0, x, y)

    def _linear(self, rasters: np.ndarray, layers: np.ndarray | int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        columns, rows = rasters.shape[-2:]
        a = np.clip((x - self.low[0]) / RASTER, 0.0, columns - 1.001)
        b = np.clip((y - self.low[1]) / RASTER, 0.0, rows - 1.001)
        i, j = a.astype(np.intp), b.astype(np.intp)
        a -= i
        b -= j
        flat, first = rasters.ravel(), (layers * columns + i) * rows + j
        near = flat.take(first) * (1.0 - b) + flat.take(first + 1) * b
        far = flat.take(first + rows) * (1.0 - b) + flat.take(first + rows + 1) * b
        return near * (1.0 - a) + far * a


def _from_edges(corners: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the distances [m] from places x, y (...) to the edges of the outline with corners (k, 2)."""
    least = np.full(x.shape, np.inf)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        dx, dy = bx - ax, by - ay
        share = np.clip(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
        np.minimum(least, (x - ax - share * dx) ** 2 + (y - ay - share * dy) ** 2, out=least)
    return np.sqrt(least)


@dataclass(frozen=True, eq=False)
class Columns:
    """Upright discs in the base's frame: middles (..., m, 2), radii, heights low and high (..., m) [m]."""

    middles: np.ndarray
    radii: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def clearance(
        self, distances: Distances, poses: np.ndarray, shifts: np.ndarray | None = None, which: tuple = ()
    ) -> np.ndarray:
        """Return the smallest clearance (n,) [m] of all discs with the base at poses (n, 3).

        shifts (n, 2) [m]: where the columns' own frame is in the base's; None: there. which: numbers (n,) along each of
        the axes before m, for every pose; none when there are no such axes.
        """
        cosine, sine = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
        middles, radii, layers = self.middles[which], self.radii[which], distances.layers(self)[which]
        forward, left = middles[..., 0], middles[..., 1]
        if shifts is not None:
            forward, left = forward + shifts[:, :1], left + shifts[:, 1:]
        x = poses[:, :1] + cosine * forward - sine * left
        y = poses[:, 1:2] + sine * forward + cosine * left
        if len(poses) < MANY or which:
            return (distances.at(layers, x, y) - radii).min(axis=1)
        least = np.full(len(poses), np.inf)  # needs less memory
        for k, layer in enumerate(layers):
            np.minimum(least, distances.at(layer, x[:, k], y[:, k]) - radii[k], out=least)
        return least

    def part(self, *which: int) -> "Columns":
        """Return one set of several, `which` of each axis before m."""
        return Columns(*(values[which] for values in vars(self).values()))

    def moved(self, shift: Sequence[float]) -> "Columns":
        """Return the same columns, their frame's origin at `shift` (2,)."""
        return Columns(self.middles - np.asarray(shift), self.radii, self.low, self.high)

    def __add__(self, other: "Columns") -> "Columns":
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Columns(*(np.concatenate(pair) for pair in pairs))


@dataclass(frozen=True, eq=False)
class Body:
    """The robot's columns, by what they move with. `base`: all that never moves in the base's frame; `arm` and
    `arm_down` (f, l, m): upper arm and forearm in the base's frame, the nozzle lifted or on the floor, at `forward`,
    `left` [m]; `vacuum`: cleaner, hand and pipe about the middle of the nozzle, on the floor; `held`: these and the
    nozzle's rim, on the floor or lifted; `rest`: all, in the rest posture.
    """

    base: Columns
    arm: Columns
    arm_down: Columns
    vacuum: Columns
    held: Columns
    rest: Columns
    forward: np.ndarray
    left: np.ndarray

    def clearance(self, distances: Distances, poses: np.ndarray, nozzles: np.ndarray) -> np.ndarray:
        """Return the clearance (n,) [m] of the whole robot, the base at poses (n, 3), the nozzle at nozzles (n, 2) [m]
        in the base's frame, lifted. The arm is that of the measured posture next to it.
        """
        nozzles = np.broadcast_to(nozzles, (len(poses), 2))
        least = self.base.clearance(distances, poses)
        np.minimum(least, self.tool_clearance(distances, poses, nozzles), out=least)
        return np.minimum(least, self.arm.clearance(distances, poses, which=self.nearest(nozzles)), out=least)

    def tool_clearance(self, distances: Distances, poses: np.ndarray, nozzles: np.ndarray | None = None) -> np.ndarray:
        """Return the clearance (n,) [m] of nozzle, pipe and cleaner, lifted, the base at poses (n, 3), the nozzle at
        nozzles (n, 2) [m] in its frame; None: the poses are the nozzle's own.
        """
        nozzles = np.zeros((len(poses), 2)) if nozzles is None else nozzles
        least = self.held.clearance(distances, poses, nozzles)
        for block in np.array_split(np.arange(len(poses)), len(poses) // MANY + 1):
            found = _from_corners(distances.corners, poses[block], nozzles[block])
            least[block] = np.minimum(least[block], found)
        return least

    def nearest(self, nozzles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return numbers (n,) in `forward` and `left` of the measured postures next to nozzles (n, 2)."""
        grids = self.forward, self.left
        return tuple(np.interp(nozzles[:, k], g, np.arange(len(g))).round().astype(int) for k, g in enumerate(grids))


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

    def columns(part: str, arm: np.ndarray) -> Columns:
        rooms.place(model, data, np.zeros(3), arm)
        return _columns(model, data, parts[part])

    lattice = postures.lattice
    forward, left = (np.interp(np.arange(n) / DENSE, np.arange(len(grid)), grid)
                     for n, grid in zip(lattice.shape[1:3], (FORWARD, LEFT), strict=True))  # fmt: skip
    arms = [_arms(model, data, parts["arm"], level) for level in (lattice[-1], lattice[0])]
    i, j = len(FORWARD) // 2, len(LEFT) // 2
    vacuum = columns("vacuum", postures.down[i, j]).moved((FORWARD[i], LEFT[j]))
    rest = columns("arm", postures.raising[0]) + columns("vacuum", postures.raising[0])
    middle, base = data.site("vacuum/nozzle").xpos[:2].copy(), columns("base", postures.raising[0])
    raised = Columns(vacuum.middles, vacuum.radii, vacuum.low, vacuum.high + LIFT)  # on the floor, above it, between
    return Body(base, *arms, vacuum, raised + _rim(), rest + _rim().moved(-middle) + base, forward, left)


def _arms(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int], q: np.ndarray) -> Columns:
    """Return the columns of capsules `geoms` in all postures q (f, l, 7), the base at zero, each grown by half the way
    to where it is in the postures beside, so that it encloses what lies nearer to this posture than to those.
    """
    rooms.place(model, data, np.zeros(3), q[0, 0])
    joints = [model.joint(name).qposadr[0] for name in rooms.ARM]
    places, axes = (np.empty((*q.shape[:2], len(geoms), 3)) for _ in range(2))
    for at in np.ndindex(q.shape[:2]):
        data.qpos[joints] = q[at]
        mujoco.mj_kinematics(model, data)
        places[at], axes[at] = data.geom_xpos[geoms], data.geom_xmat[geoms][:, 2::3]
    parts = [_capsule(places[..., k, :], axes[..., k, :], model.geom_size[geom]) for k, geom in enumerate(geoms)]
    x, y, radii, low, high = (np.concatenate(columns, axis=-1) for columns in zip(*parts, strict=True))
    grown = 0.5 * sum(_step(x, y, axis) for axis in (0, 1))
    return _rounded(x, y, radii + grown, low - grown, high + grown)


def _step(x: np.ndarray, y: np.ndarray, axis: int) -> np.ndarray:
    """Return the longer one of the ways from each place x, y (f, l, m) to those before and after it along an axis."""
    way = np.hypot(np.diff(x, axis=axis), np.diff(y, axis=axis))
    first, last = np.take(way, [0], axis=axis), np.take(way, [-1], axis=axis)
    return np.maximum(np.concatenate([first, way], axis=axis), np.concatenate([way, last], axis=axis))


def _capsule(place: np.ndarray, axis: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return x, y, radii, low, high (..., m) of discs around capsules with middles and axes (..., 3).

    A steep capsule is sliced: each disc encloses the slanting cylinder between two heights only, and those at the ends
    the caps as well. One that lies rather flat is enclosed ball by ball.
    """
    n = int(np.ceil(2 * size[1] / SPACING)) + 1
    half = size[1] / (n - 1)
    x, y, z = np.moveaxis(place[..., None, :] + np.linspace(-size[1], size[1], n)[:, None] * axis[..., None, :], -1, 0)
    aslant, upright = np.hypot(axis[..., :1], axis[..., 1:2]), np.abs(axis[..., 2:])
    steep = upright > STEEP
    sliced = size[0] / np.maximum(upright, STEEP) + half * aslant
    radii = np.where(steep, sliced, np.hypot(size[0], half * aslant))  # the latter: what bulges between two balls
    grown = np.where(steep & (np.arange(n) % (n - 1) > 0), half * upright, size[0] + half)
    return x, y, np.broadcast_to(radii, x.shape), z - grown, z + grown


def _rounded(x: np.ndarray, y: np.ndarray, radii: np.ndarray, low: np.ndarray, high: np.ndarray) -> Columns:
    low = np.maximum(np.floor(low / BAND + 1e-6) * BAND, 0.0).round(6)
    return Columns(np.stack([x, y], axis=-1), radii, low, (np.ceil(high / BAND - 1e-6) * BAND).round(6))


def _rim() -> Columns:
    """The nozzle's four corners, 3 cm off the floor or on it; see `_from_corners` for the rest of its outline."""
    points = HALF * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    return Columns(points, np.zeros(4), np.zeros(4), np.full(4, rooms.NOZZLE_HEIGHT + LIFT))


def _from_corners(corners: np.ndarray, poses: np.ndarray, nozzles: np.ndarray) -> np.ndarray:
    """Return the least distance (n,) [m] of corners (c, 2) in the room from the nozzle's rectangle, 0 inside.

    Two convex outlines that do not overlap are nearest at a corner of one of them.
    """
    cosine, sine = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    x, y = corners[:, 0] - poses[:, :1], corners[:, 1] - poses[:, 1:2]
    along, across = cosine * x + sine * y - nozzles[:, :1], cosine * y - sine * x - nozzles[:, 1:]
    away = np.maximum(np.abs(along) - HALF[0], 0.0) ** 2 + np.maximum(np.abs(across) - HALF[1], 0.0) ** 2
    return np.sqrt(away.min(axis=1))


def _columns(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> Columns:
    """Enclose geoms where they are now: capsules by discs along them, all else by one disc; the base is at zero."""
    found = []
    for geom in geoms:
        kind, size, place = model.geom_type[geom], model.geom_size[geom], data.geom_xpos[geom]
        axes = data.geom_xmat[geom].reshape(3, 3)
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            found += zip(*_capsule(place, axes[:, 2], size), strict=True)
        elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            found.append((*place[:2], size[0], place[2] - size[0], place[2] + size[0]))
        elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:  # upright: the base
            found.append((*place[:2], size[0], place[2] - size[1], place[2] + size[1]))
        else:  # a box
            corners = axes @ (size * np.array(list(np.ndindex(2, 2, 2))) * 2 - size).T
            found.append((*place[:2], np.hypot(*corners[:2]).max(), *(place[2] + np.array([-1, 1]) * corners[2].max())))
    return _rounded(*np.array(found).T)
