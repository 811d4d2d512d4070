"""Ways between lanes: Dijkstra on a grid of base poses, the vacuum cleaner lifted and drawn close.

A node is a place and a heading at which the whole robot fits, an edge a short straight drive or a turn on the spot on
which it fits too. Ways are then pulled straight wherever the robot fits on the straight way.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

from tutorialbot.cleaning.body import Body, Distances
from tutorialbot.cleaning.lanes import Lane, in_room
from tutorialbot.cleaning.reach import FORWARD, LEFT
from tutorialbot.cleaning.retreat import FAR, Retreat
from tutorialbot.cleaning.wriggle import clear_between, moved, ways_out

GRID = 0.1  # between nodes [m]
TURNS = 16  # headings
DRAWN = np.array([FORWARD[0], LEFT[4]])  # where the nozzle is on the way, in the base's frame [m]
MARGIN = 0.02  # the robot keeps on its ways [m]
TIGHT, SLACK = 0.005, 0.0005  # what it keeps at least, and how much less than at the ends [m]
FINE = 0.03  # between checks along a way [m]
BACK, BACK_MOST = 0.1, 8  # steps back from a lane's end [m], and how many
BACKWARDS = np.pi + np.array([0.0, 0.8, -0.8, 1.57, -1.57])  # ... and in which directions of the base [rad]
ALIKE = np.array([0.06, 0.06, 0.08, 0.05, 0.05])  # base [m, m, rad] and nozzle [m, m], next to one that is stuck
ARC = 0.3  # length [m] that costs as much as a turn by one radian


def length(way: np.ndarray) -> float:
    """Return how long a way over poses (m, 3) is [m], turns included."""
    steps = np.diff(way, axis=0)
    return float((np.hypot(steps[:, 0], steps[:, 1]) + ARC * np.abs(steps[:, 2])).sum())


@dataclass(frozen=True, eq=False)
class Exit:
    """Bases (m, 3) and nozzles (m, 2) from a lane's end to a place with the nozzle drawn close, and the node there."""

    base: np.ndarray
    nozzle: np.ndarray
    node: int


class Router:
    """Finds ways for the base among what stands in the room; what is reachable is what is connected with `start`."""

    def __init__(self, body: Body, distances: Distances, start: np.ndarray):
        self.body, self.distances, self.start = body, distances, start
        low = distances.low
        self.grid = [np.arange(low[i], axis[-1], GRID) for i, axis in enumerate((distances.x, distances.y))]
        self.headings = 2 * np.pi / TURNS * np.arange(TURNS)
        self.poses = np.stack(np.meshgrid(*self.grid, self.headings, indexing="ij"), axis=-1)
        free = self.clear(self.poses.reshape(-1, 3), DRAWN).reshape(self.poses.shape[:3])
        self.number = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
        self.nodes = self.poses[free]
        self.graph = self._edges()
        self.component = connected_components(self.graph, directed=False)[1]
        self._exits: dict[tuple, Exit | None] = {}
        self._stuck: list[np.ndarray] = []
        self._from: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        home = self.entry(start)
        self.home = None if home is None else self.component[home]

    def clear(self, poses: np.ndarray, nozzles: np.ndarray) -> np.ndarray:
        """Return whether the robot fits at poses (n, 3) with the lifted nozzle at nozzles (n, 2) or (2,), (n,)."""
        return self.body.clearance(self.distances, poses, nozzles) > MARGIN

    def straight(self, poses: np.ndarray, nozzles: np.ndarray) -> bool:
        """Return whether the robot fits all along the polyline of poses (m, 3) with nozzles (m, 2).

        It keeps MARGIN, or where it is nearer to something at one of the ends, nearly as much as there.
        """
        states, fine = np.column_stack([poses, nozzles]), [np.append(poses[0], nozzles[0])[None]]
        for a, b, way in zip(states[:-1], states[1:], moved(states[:-1], states[1:]), strict=True):
            fine.append(a + np.linspace(0, 1, int(np.ceil(way / FINE)) + 1)[1:, None] * (b - a))
        fine = np.concatenate(fine)
        clearance = self.body.clearance(self.distances, fine[:, :3], fine[:, 3:])
        least = min(MARGIN, max(TIGHT, clearance[[0, -1]].min() - SLACK))
        enough = bool(clearance.min() > least)
        return enough and bool(clear_between(self.body, self.distances, fine[:-1], fine[1:], least).all())

    def _edges(self) -> coo_array:
        """The graph: eight neighbours in the plane, and the next heading; edges are checked in between."""
        number, rows, columns, costs = self.number, [], [], []
        for dx, dy, turn in ((1, 0, 0), (0, 1, 0), (1, 1, 0), (1, -1, 0), (0, 0, 1)):
            there = np.roll(number, (-dx, -dy, -turn), axis=(0, 1, 2))
            if dx:
                there[-dx:] = -1
            if dy:
                there[:, -1 if dy > 0 else 0] = -1
            i, j = number[(number >= 0) & (there >= 0)], there[(number >= 0) & (there >= 0)]
            a = self.nodes[i]
            step = np.array([GRID * dx, GRID * dy, 2 * np.pi / TURNS * turn])
            ends = (np.column_stack([poses, np.tile(DRAWN, (len(a), 1))]) for poses in (a, a + step))
            good = clear_between(self.body, self.distances, *ends, MARGIN)
            cost = np.hypot(step[0], step[1]) + ARC * step[2]
            rows.append(i[good]), columns.append(j[good]), costs.append(np.full(int(good.sum()), cost))
        n = len(self.nodes)
        rows, columns, costs = map(np.concatenate, (rows, columns, costs))
        return coo_array((costs, (rows, columns)), shape=(n, n)).tocsr()

    def entry(self, pose: np.ndarray) -> int | None:
        """Return the number of a node that a straight drive from `pose` (3,) reaches; None when there is none."""
        if not len(self.nodes):
            return None
        away = self.nodes - pose
        away[:, 2] = np.abs((away[:, 2] + np.pi) % (2 * np.pi) - np.pi)
        distance = np.hypot(away[:, 0], away[:, 1]) + ARC * away[:, 2]
        for node in np.argsort(distance)[:8]:
            turned = self._turned(pose, self.nodes[node])
            if distance[node] < 3 * GRID and self.straight(turned, np.tile(DRAWN, (2, 1))):
                return int(node)
        return None

    @staticmethod
    def _turned(pose: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Both poses (2, 3), the second's heading the same but within half a turn of the first's."""
        other = np.array(other, dtype=float)
        other[2] = pose[2] + (other[2] - pose[2] + np.pi) % (2 * np.pi) - np.pi
        return np.stack([pose, other])

    def exit(self, base: np.ndarray, nozzle: np.ndarray, *, wriggle: bool = False) -> "Exit | None":
        """Return a way from a lane's end to a node that is connected with the start, None when there is none.

        The robot draws the nozzle close where it stands, or first drives straight back, or aslant, until it can; with
        `wriggle` it also tries small moves of base and arm (see `wriggle.ways_out`), which takes long to find.
        """
        key = (*base.tolist(), *nozzle.tolist())
        if key not in self._exits:
            self._exits[key] = self._exit(base, nozzle)
        if wriggle and self._exits[key] is None:
            self._exits[key] = self._wriggled(base, nozzle)
        return self._exits[key]

    def _exit(self, base: np.ndarray, nozzle: np.ndarray) -> "Exit | None":
        for aslant in BACKWARDS:
            way = np.stack([np.cos(base[2] + aslant), np.sin(base[2] + aslant), 0.0])
            for back in BACK * np.arange(0 if aslant == BACKWARDS[0] else 1, BACK_MOST + 1):
                there = base + back * way
                if back and not self.straight(np.stack([base, there]), np.tile(nozzle, (2, 1))):
                    break
                drawing = self.drawing(there, nozzle)
                node = None if drawing is None else self.entry(there)
                if node is not None and self.component[node] == self.home:
                    bases = np.concatenate([base[None], np.tile(there, (len(drawing), 1))])
                    return Exit(bases, np.concatenate([nozzle[None], drawing]), node)
        return None

    def _wriggled(self, base: np.ndarray, nozzle: np.ndarray) -> "Exit | None":
        """Return a way out by small moves; None when none is found."""
        state = np.concatenate([base, nozzle])
        if any((np.abs(state - other) < ALIKE).all() for other in self._stuck):
            return None
        ends: list[tuple[np.ndarray, int]] = []

        def out(state: np.ndarray) -> bool:
            drawing = self.drawing(state[:3], state[3:]) if self.clear(state[None, :3], DRAWN)[0] else None
            node = None if drawing is None else self.entry(state[:3])
            if node is not None and self.component[node] == self.home:
                ends.append((drawing, node))
            return bool(ends)

        here = self.body.clearance(self.distances, base[None], nozzle[None])[0]
        way = ways_out(self.body, self.distances, base, nozzle, TIGHT, self._ahead, out) if here > TIGHT else None
        if way is None:
            self._stuck.append(state)
            return None
        drawing, node = ends[0]
        bases = np.concatenate([way[:, :3], np.tile(way[-1, :3], (len(drawing), 1))])
        return Exit(bases, np.concatenate([way[:, 3:], drawing]), node)

    @cached_property
    def _retreat(self) -> Retreat:
        nodes = self.nodes[self.component == self.home]
        drawn = in_room(nodes, np.tile(DRAWN, (len(nodes), 1)))
        return Retreat(self.body, self.distances, np.column_stack([drawn, nodes[:, 2]]), TIGHT)

    def _ahead(self, states: np.ndarray) -> np.ndarray:
        """Return about how many small moves (n,) it takes from states (n, 5) until the nozzle can be drawn close."""
        steps = self._retreat.steps(np.column_stack([in_room(states[:, :3], states[:, 3:]), states[:, 2]]))
        return np.where(steps < FAR, steps + np.abs(states[:, 3:] - DRAWN).sum(axis=1), np.inf)

    def drawing(self, base: np.ndarray, nozzle: np.ndarray) -> np.ndarray | None:
        """Return nozzles (m, 2) that draw the lifted nozzle close with the base at rest; None if something is near."""
        first = np.array([DRAWN[0], nozzle[1]])
        for way in ([nozzle, first, DRAWN], [nozzle, np.array([nozzle[0], DRAWN[1]]), DRAWN]):
            if self.straight(np.tile(base, (3, 1)), np.array(way)):
                return np.array(way)
        return None

    def accessible(self, lane: Lane, wriggle: bool) -> bool:
        """Whether the robot can get to one of the lane's ends, or both; see `exit`."""
        return any(self.exit(lane.base[k], lane.nozzle[k], wriggle=wriggle) is not None for k in (0, -1))

    def reach(self, node: int) -> tuple[np.ndarray, np.ndarray]:
        """Return distances (n,) [m] from a node to all, and each node's predecessor on the way."""
        if node not in self._from:
            self._from[node] = dijkstra(self.graph, directed=False, indices=node, return_predecessors=True)
        return self._from[node]

    def way(self, start: np.ndarray, goal: np.ndarray) -> np.ndarray:
        """Return poses (m, 3) from start to goal, both with doors; headings go on without jumps."""
        direct = self._turned(start, goal)
        if self.straight(direct, np.tile(DRAWN, (2, 1))):
            return direct
        a, b = self.entry(start), self.entry(goal)
        previous, chain = self.reach(a)[1], [b]
        while chain[-1] != a:
            chain.append(int(previous[chain[-1]]))
        poses = [start, *self.nodes[chain[::-1]], goal]
        for i in range(1, len(poses)):
            poses[i] = self._turned(poses[i - 1], poses[i])[1]
        return self._pulled_straight(np.array(poses))

    def _pulled_straight(self, way: np.ndarray) -> np.ndarray:
        kept, i = [0], 0
        while i < len(way) - 1:
            j = len(way) - 1
            while j > i + 1 and not self.straight(way[[i, j]], np.tile(DRAWN, (2, 1))):
                j = i + max(1, (j - i) // 2) if j - i > 2 else i + 1
            kept.append(j)
            i = j
        return way[kept]
