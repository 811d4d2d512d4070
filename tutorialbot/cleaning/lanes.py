"""Lanes: straight ways of the nozzle that together cover the floor, and for each the base's poses that go with it.

A lane is driven with one heading of the base. Along it the nozzle moves by s, the arm holds it `forward` in front of
the base, and the base is the rest: base = nozzle - R (forward, left). The arm reaches out while the nozzle advances
(see `reach.FORWARD`), so a lane is a path in the plane (s, forward) on which robot and room never touch.

Which lanes are taken is a set-cover problem; the greedy answer takes again and again the lane that covers most new
cells for the time it costs.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from tutorialbot.cleaning.body import Body, Columns, Distances
from tutorialbot.cleaning.cells import Cells
from tutorialbot.cleaning.reach import FORWARD, LEFT
from tutorialbot.scene import room as rooms
from tutorialbot.scene.room import Room

HEADINGS = np.pi / 12 * np.array([0, 6, 12, 18, *(i for i in range(24) if i % 6)])  # the room's own directions first
EXTENSIONS = np.array([0, 2, 4, 6])  # numbers of FORWARD between which a lane is checked
SIDES = np.array([0, 4, 8])  # numbers of LEFT at which lanes are driven
STEP = 0.02  # between places along and across the lanes that are tried [m]
GAP = 0.006  # the nozzle keeps from furniture and walls [m]
MARGIN = 0.006  # all else keeps [m]
OVERLAP = 0.001  # what is nearer than this [m] to the nozzle's rim is not counted on
TOUCH = 1e-5  # [m]
BIN = 0.01  # for counting cells under a lane [m]
LEAST = 1  # new cells for which a lane is still worth it
WORTH = 4  # ... for which a way to it is looked for hard
OVERHEAD = 0.5  # length [m] that costs as much time as getting to another lane


@dataclass(frozen=True, eq=False)
class Lane:
    """Base poses (m, 3), x, y [m] and yaw [rad], and nozzles (m, 2) [m] in the base's frame, m >= 2; both move evenly
    from one to the next, and so does the nozzle in the room. It may be driven either way.
    """

    base: np.ndarray
    nozzle: np.ndarray

    @property
    def track(self) -> np.ndarray:
        """Middle of the nozzle in the room (m, 2) [m]."""
        return in_room(self.base, self.nozzle)

    @property
    def length(self) -> float:
        """Way of the nozzle [m]."""
        return float(np.linalg.norm(np.diff(self.track, axis=0), axis=1).sum())

    @property
    def turned_round(self) -> "Lane":
        """The same lane from its other end."""
        return Lane(self.base[::-1], self.nozzle[::-1])


def in_room(base: np.ndarray, nozzle: np.ndarray) -> np.ndarray:
    """Return points `nozzle` (..., 2) of the base's frame in the room, the base at poses (..., 3)."""
    cosine, sine = np.cos(base[..., 2]), np.sin(base[..., 2])
    x, y = nozzle[..., 0], nozzle[..., 1]
    return base[..., :2] + np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def free_places(room: Room, heading: float) -> shapely.Geometry:
    """Return where the nozzle's middle may be with that heading [rad], GAP away from everything: exact Minkowski sums.

    Outlines and edges of the floor are convex, and so is the nozzle: each sum is the convex hull of sums of corners.
    """
    half = 0.5 * np.array([rooms.NOZZLE_LENGTH, rooms.NOZZLE_WIDTH]) + GAP
    corners = half * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    cosine, sine = np.cos(heading), np.sin(heading)
    corners = corners @ np.array([[cosine, sine], [-sine, cosine]])
    edges = np.stack([room.floor, np.roll(room.floor, -1, axis=0)], axis=1)
    solids = [*edges, *room.obstacles(0.0, rooms.NOZZLE_HEIGHT)]
    sums = [shapely.MultiPoint((solid[:, None] + corners).reshape(-1, 2)).convex_hull for solid in solids]
    return room.polygon.difference(shapely.union_all(sums)).buffer(1e-6)


class Headed:
    """All that is known about one heading: where the robot fits, and the lanes that could be driven.

    fits (T, S, extensions, lefts): whether the robot fits with the nozzle across[t], along[s]. `runs` (n, 4): t,
    first s, last s, and left of each lane that cannot be made longer.
    """

    def __init__(self, heading: float, room: Room, body: Body, distances: Distances, cells: Cells):
        self.heading = heading
        cosine, sine = np.cos(heading), np.sin(heading)
        self.turn = np.array([[cosine, -sine], [sine, cosine]])  # columns: along, across
        free = free_places(room, heading)
        self.along, self.across = (self._values(free, k, cells) for k in (0, 1))
        self.fits = self._fits(free, body, distances)
        self.runs = self._runs()
        where = (cells.centres @ self.turn)[cells.within_reach]
        self._low = where.min(axis=0) - 1.5 * BIN
        self._bins = np.floor((where - self._low) / BIN).astype(int) + 1
        self._size = self._bins.max(axis=0) + 2
        self._where = where

    def _values(self, free: shapely.Geometry, axis: int, cells: Cells) -> np.ndarray:
        """Coordinates of nozzles along or across the heading: even steps, and those of the corners of what is free, or
        where outlines are curved and corners too many, of the edges square to the axis, with which lanes can be flush.
        """
        corners = shapely.get_coordinates(free) @ self.turn[:, axis]
        if not len(corners):
            return np.zeros(1)
        ends = [corners.min(), corners.max()]
        even = np.arange(*ends, STEP)
        own = _apart(corners)
        if len(own) > len(even) / 2:
            own = _apart(np.concatenate([ends, _flush(free, self.turn, axis)]))
        values = np.sort(np.concatenate([own, even]))
        return values[np.concatenate([[True], np.diff(values) > 1e-4])]

    def _fits(self, free: shapely.Geometry, body: Body, distances: Distances) -> np.ndarray:
        across, along = np.meshgrid(self.across, self.along, indexing="ij")
        x, y = np.moveaxis(np.stack([along, across], axis=-1) @ self.turn.T, -1, 0)
        shapely.prepare(free)
        nozzle = shapely.contains_xy(free, x, y)
        poses = np.stack([x[nozzle], y[nozzle], np.full(int(nozzle.sum()), self.heading)], axis=1)
        nozzle[nozzle] = body.vacuum.clearance(distances, poses) > MARGIN
        base = self._clearance(body.base, distances, 2)
        fits = np.zeros((*nozzle.shape, len(EXTENSIONS), len(SIDES)), dtype=bool)
        for side, j in enumerate(SIDES):
            for k, i in enumerate(EXTENSIONS):
                middle = np.array([[FORWARD[i], LEFT[j]]])
                dx, dy = self.turn @ middle[0]
                bx, by = x[nozzle] - dx, y[nozzle] - dy
                arm = self._clearance(body.arm_down.part(*(int(n[0]) for n in body.nearest(middle))), distances, 3)
                fits[nozzle, k, side] = (base(bx, by) > MARGIN) & (arm(bx, by) > MARGIN)
        return fits

    def _clearance(self, columns: Columns, distances: Distances, stride: int) -> Callable:
        """Return a function of x and y [m]: clearance of the columns with the base there, from a raster made now."""
        x, y = np.meshgrid(distances.x[::stride], distances.y[::stride], indexing="ij")
        poses = np.stack([x, y, np.full(x.shape, self.heading)], axis=-1).reshape(-1, 3)
        raster = columns.clearance(distances, poses).reshape(x.shape)
        low = distances.low

        def at(x: np.ndarray, y: np.ndarray) -> np.ndarray:
            return distances.between(raster, low[0] + (x - low[0]) / stride, low[1] + (y - low[1]) / stride)

        return at

    def _runs(self) -> np.ndarray:
        """Find the longest lanes: sweep along s, keeping the extensions that are reached without drawing back."""
        T, S, K, J = self.fits.shape
        reached, begun = np.zeros((T, K, J), dtype=bool), np.zeros((T, J), dtype=int)
        found = []
        for s in range(S + 1):
            here = self.fits[:, s] if s < S else np.zeros((T, K, J), dtype=bool)
            going = _reaching_out(reached & here, here)
            ended = reached.any(axis=1) & ~going.any(axis=1)
            t, j = np.nonzero(ended)
            found.append(np.stack([t, begun[t, j], np.full(len(t), s - 1), j], axis=1))
            fresh = ~going.any(axis=1)
            begun[fresh] = s
            reached = np.where(fresh[:, None], here, going)
        return np.concatenate(found).astype(int)

    def gains(self, wanted: np.ndarray) -> np.ndarray:
        """Return how many of the cells within reach that are `wanted` lie under each of the runs, (n,)."""
        counts = np.zeros(self._size, dtype=int)
        np.add.at(counts, tuple(self._bins[wanted].T), 1)
        sums = counts.cumsum(axis=0).cumsum(axis=1)
        t, first, last, _ = self.runs.T
        half = 0.5 * np.array([rooms.NOZZLE_LENGTH, rooms.NOZZLE_WIDTH]) - OVERLAP

        def up_to(value: np.ndarray, axis: int) -> np.ndarray:  # bins whose middles are below the value
            bins = np.floor((value - self._low[axis]) / BIN + 0.5).astype(int)
            return np.clip(bins, 0, self._size[axis] - 1)

        a0, a1 = up_to(self.along[first] - half[0], 0), up_to(self.along[last] + half[0], 0)
        c0, c1 = up_to(self.across[t] - half[1], 1), up_to(self.across[t] + half[1], 1)
        return sums[a1, c1] - sums[a0, c1] - sums[a1, c0] + sums[a0, c0]

    def costs(self) -> np.ndarray:
        """Return what each run costs [m]."""
        return self.along[self.runs[:, 2]] - self.along[self.runs[:, 1]] + OVERHEAD

    def covered(self, t: int, first: float, last: float) -> np.ndarray:
        """Return which of the cells within reach lie under the lane at across[t] from `first` to `last` [m]."""
        half = 0.5 * np.array([rooms.NOZZLE_LENGTH, rooms.NOZZLE_WIDTH]) - OVERLAP
        under = np.abs(self._where[:, 1] - self.across[t]) <= half[1]
        return under & (self._where[:, 0] >= first - half[0]) & (self._where[:, 0] <= last + half[0])

    def lane(self, run: int, wanted: np.ndarray, *, whole: bool = False) -> tuple[Lane, np.ndarray] | None:
        """Return the part of a run that the wanted cells need, as a lane, and which cells it covers; None for none.

        whole: all of the run, which may begin or end where there is more room.
        """
        t, first, last, side = self.runs[run]
        left = LEFT[SIDES[side]]
        needed = self._where[self.covered(t, self.along[first], self.along[last]) & wanted, 0]
        if not len(needed):
            return None
        half = 0.5 * rooms.NOZZLE_LENGTH - OVERLAP
        begin = int(np.searchsorted(self.along, needed.min() + half - 1e-9, side="right")) - 1
        end = int(np.searchsorted(self.along, needed.max() - half + 1e-9))
        begin, end = (first, last) if whole else np.clip(sorted((begin, end)), first, last).tolist()
        steps = self._extension(self.fits[t, begin : end + 1, :, side], self.along[end] - self.along[begin])
        along = self.along[begin : end + 1][steps[:, 0]]
        forward = FORWARD[EXTENSIONS][steps[:, 1]]
        base = np.stack([along - forward, np.full(len(along), self.across[t] - left)], axis=1) @ self.turn.T
        poses = np.column_stack([base, np.full(len(along), self.heading)])
        lane = Lane(poses, np.column_stack([forward, np.full(len(along), left)]))
        return lane, self.covered(t, self.along[begin], self.along[end])

    def _extension(self, fits: np.ndarray, length: float) -> np.ndarray:
        """Return the corners (m, 2) of a path in (s, extension) through `fits` (S, K): evenly reaching out if it can,
        as far as the arm reaches or the lane is long; so the base never draws back.
        """
        S, K = fits.shape
        reach = FORWARD[EXTENSIONS] - FORWARD[EXTENSIONS[0]]
        for wide in range(int(np.searchsorted(reach, length + 1e-6, side="right")) - 1, -1, -1):
            for low in range(K - wide):
                even = np.linspace(low, low + wide, S)
                s = np.arange(S)
                if fits[s, np.floor(even + 1e-9).astype(int)].all() and fits[s, np.ceil(even - 1e-9).astype(int)].all():
                    return np.array([[0, low], [S - 1, low + wide]])
        reached = np.zeros((S, K), dtype=bool)
        reached[0] = fits[0]
        for s in range(1, S):
            reached[s] = _reaching_out((reached[s - 1] & fits[s])[None, :, None], fits[s][None, :, None])[0, :, 0]
        k = int(np.argmax(reached[-1]))
        corners = [(S - 1, k)]
        for s in range(S - 1, 0, -1):  # back from the end: reach out as late as can be
            low = k
            while not (reached[s - 1, low] and fits[s, low]):
                low -= 1
            if low != k:
                corners += [(s, low)] if corners[-1] == (s, k) else [(s, k), (s, low)]
                k = low
        corners += [(0, k)] if corners[-1] != (0, k) else []
        return np.array(corners[::-1])


def _flush(free: shapely.Geometry, turn: np.ndarray, axis: int) -> np.ndarray:
    """Return the coordinates along a column of `turn` of those edges of `free` that are square to it."""
    rings = shapely.get_rings(shapely.get_parts(free))
    edges = np.concatenate([np.stack([c[:-1], c[1:]], axis=1) for c in map(shapely.get_coordinates, rings)]) @ turn
    away = np.abs(edges[:, 1] - edges[:, 0])
    return edges[(away[:, axis] < TOUCH) & (away[:, 1 - axis] > STEP), 0, axis]


def _apart(values: np.ndarray) -> np.ndarray:
    """Return the values, sorted, without those that are nearly the same as one before."""
    values = np.unique(values.round(4))
    return values[np.concatenate([[True], np.diff(values) > 0.002])]


def _reaching_out(reached: np.ndarray, fits: np.ndarray) -> np.ndarray:
    """Add to the extensions `reached` (T, K, J) those beyond that `fits`: the nozzle stands, the base draws back."""
    reached = reached.copy()
    for k in range(1, reached.shape[1]):
        reached[:, k] |= reached[:, k - 1] & fits[:, k]
    return reached


def choose_lanes(
    headed: list[Headed], cells: Cells, accessible: Callable[[Lane, bool], bool]
) -> Iterator[tuple[Lane, float]]:
    """Yield lanes, the most useful first, each with the share of the cells within reach planned so far.

    accessible: whether the robot can get to a lane, looking for a way quickly or, True, hard; those to which it cannot
    are left out. When no lane is left, those are tried again, hard, under which there still lie WORTH cells. What a
    lane is worth only falls from lane to lane, so the last values are upper bounds, and few headings have to be counted
    anew each time.
    """
    wanted = np.ones(int(cells.within_reach.sum()), dtype=bool)
    for hard, least in ((False, LEAST), (True, WORTH)):
        worth = [np.full(len(one.runs), np.inf) for one in headed]
        counted = np.zeros(len(headed), dtype=bool)
        while wanted.any():
            number = int(np.argmax([values.max(initial=0.0) for values in worth]))
            if worth[number].max(initial=0.0) <= 0.0:
                break
            if not counted[number]:
                gains = headed[number].gains(wanted)
                gains[(gains < least) | (worth[number] <= 0.0)] = 0
                worth[number], counted[number] = gains / headed[number].costs(), True
                continue
            k = int(worth[number].argmax())
            tried = (headed[number].lane(k, wanted, whole=whole) for whole in (False, True))
            found = next((pair for pair in tried if pair is not None and accessible(pair[0], hard)), None)
            if found is None:
                worth[number][k] = 0.0
                continue
            lane, under = found
            wanted &= ~under
            counted[:] = False
            yield lane, 1.0 - float(wanted.mean())
