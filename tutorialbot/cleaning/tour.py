"""The order of the lanes, and every motion on the way: to a lane, down, along it, up, and to the next one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tutorialbot.cleaning.lanes import Lane
from tutorialbot.cleaning.reach import LIFT, Postures
from tutorialbot.cleaning.route import ARC, DRAWN, Exit, Router, length

SPEED_ON_FLOOR = 0.3  # of the nozzle along a lane [m/s]
DRAWING = 0.4  # length [m] that costs as much as drawing the nozzle close, or reaching out
NEAR = 8  # lanes' ends to which the straight way is tried
SAMPLE = 0.01  # between samples of a motion [m]


@dataclass(frozen=True, eq=False)
class Motion:
    """A way from rest to rest: base (m, 3), nozzle (m, 2) in its frame [m], heights (m,) as shares of LIFT.

    `lane` is the number of the lane that it drives, None for a motion in between.
    """

    base: np.ndarray
    nozzle: np.ndarray
    height: np.ndarray
    lane: int | None = None

    def samples(self, postures: Postures) -> list[np.ndarray]:
        """Return the joints (n, 10) of MOVING along each straight piece."""
        pieces = []
        for a in range(len(self.base) - 1):
            reach = length(self.base[a : a + 2]) + np.abs(np.diff(self.nozzle[a : a + 2], axis=0)).sum()
            n = 2 + int((reach + LIFT * abs(self.height[a + 1] - self.height[a])) / SAMPLE)
            share = np.linspace(0.0, 1.0, n)[:, None]
            base, nozzle = (x[a] + share * (x[a + 1] - x[a]) for x in (self.base, self.nozzle))
            height = self.height[a] + share[:, 0] * (self.height[a + 1] - self.height[a])
            pieces.append(np.concatenate([base, postures.arm(nozzle, height)], axis=1))
        return pieces


def tour(lanes: Sequence[Lane], router: Router) -> list[Motion]:
    """Return the motions that drive all lanes, the nearest next one first, from the router's start.

    From a lane's end the robot goes straight to the next lane with the nozzle lifted if it fits there; else it draws
    the nozzle close and drives round what is in the way.
    """
    ends = [(number, lane) for number, one in enumerate(lanes) for lane in (one, one.turned_round)]
    exits = [router.exit(lane.base[0], lane.nozzle[0]) for _, lane in ends]
    base, nozzle, left, motions, driven = router.start, DRAWN, set(range(len(ends))), [], None
    while left:
        way_out = Exit(base[None], nozzle[None], router.entry(base)) if driven is None else driven
        choice, straight = _next(base, nozzle, ends, left, exits, router, way_out)
        if choice is None:
            return motions
        number, lane = ends[choice]
        if straight:
            lane = _turned_to(lane, base[2])
            motions.append(Motion(np.stack([base, lane.base[0]]), np.stack([nozzle, lane.nozzle[0]]), np.ones(2)))
        else:
            motions += _around(base, way_out, exits[choice], router)
            lane = _turned_to(lane, motions[-1].base[-1, 2])
        driven, back = exits[choice ^ 1], lane.turned_round
        ways = [lane] if driven is not None else [lane, back]  # a dead end: back along the lane, on the floor
        driven = exits[choice] if driven is None else driven
        last = ways[-1]
        here, there = (np.tile(one.base[k], (2, 1)) for one, k in ((lane, 0), (last, -1)))
        motions.append(Motion(here, np.tile(lane.nozzle[0], (2, 1)), np.array([1.0, 0.0])))
        motions += [Motion(one.base, one.nozzle, np.zeros(len(one.base)), number) for one in ways]
        motions.append(Motion(there, np.tile(last.nozzle[-1], (2, 1)), np.array([0.0, 1.0])))
        base, nozzle = last.base[-1], last.nozzle[-1]
        left -= {2 * number, 2 * number + 1}
    return motions


def _turned_to(lane: Lane, heading: float) -> Lane:
    """The same lane with its heading written within half a turn of `heading` [rad]."""
    base = lane.base.copy()
    base[:, 2] += 2 * np.pi * np.round((heading - base[0, 2]) / (2 * np.pi))
    return Lane(base, lane.nozzle)


def _next(base, nozzle, ends, left, exits, router: Router, way_out: Exit) -> tuple[int | None, bool]:
    """Return the number of the nearest lane's end in `left`, None when there is none, and whether to go straight."""
    order = np.array(sorted(left))
    starts = np.array([ends[i][1].base[0] for i in order])
    turn = np.abs((starts[:, 2] - base[2] + np.pi) % (2 * np.pi) - np.pi)
    reach = np.abs(np.array([ends[i][1].nozzle[0] for i in order]) - nozzle).sum(axis=1)
    straight = np.hypot(*(starts[:, :2] - base[:2]).T) + ARC * turn + reach
    around = np.full(len(order), np.inf)
    has = np.array([exits[i] is not None for i in order])
    around[has] = router.reach(way_out.node)[0][[exits[i].node for i in order[has]]] + 2 * DRAWING
    alone = np.array([exits[i ^ 1] is None and exits[i] is None for i in order])
    for k in np.argsort(np.where(alone, np.inf, straight), kind="stable")[:NEAR]:
        if straight[k] > around.min() or alone[k]:
            break
        lane = _turned_to(ends[order[k]][1], base[2])
        if router.straight(np.stack([base, lane.base[0]]), np.stack([nozzle, lane.nozzle[0]])):
            return int(order[k]), True
    if not np.isfinite(around).any():
        return None, False
    return int(order[int(around.argmin())]), False


def _around(base: np.ndarray, way_out: Exit, way_in: Exit, router: Router) -> list[Motion]:
    """Draw close, drive, reach out."""
    motions = []
    if len(way_out.base) > 1:
        out = way_out.base + [0.0, 0.0, base[2] - way_out.base[0, 2]]
        motions.append(Motion(out, way_out.nozzle, np.ones(len(out))))
    start = motions[-1].base[-1] if motions else base
    way = router.way(start, way_in.base[-1])
    motions.append(Motion(way, np.tile(DRAWN, (len(way), 1)), np.ones(len(way))))
    into = way_in.base[::-1] + [0.0, 0.0, way[-1, 2] - way_in.base[-1, 2]]
    motions.append(Motion(into, way_in.nozzle[::-1], np.ones(len(into))))
    return motions
