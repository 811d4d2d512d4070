"""Out of a narrow place by small moves of base and arm together, found breadth-first.

Between the legs of a table the nozzle often can neither be drawn close nor driven straight back. A state is a pose of
the base and a place of the nozzle in its frame; from each, small moves lead to others, and of the states reached with
the same number of moves those with the most room around them go on.
"""

from collections.abc import Callable

import numpy as np

from tutorialbot.cleaning.body import Body, Distances
from tutorialbot.cleaning.reach import FORWARD, LEFT

STEP, TURN = 0.05, np.pi / 24  # of a move [m], [rad]
KEPT = 100  # states go on from each level
LEVELS = 16  # moves at most
LIKE = 0.025  # states are the same when they round to the same multiples of it [m]
ARM = 0.8  # a turn by one radian moves the nozzle about so far [m]


def moves() -> np.ndarray:
    """Return the moves (k, 5): of the base forward, left [m] and turned [rad], of the nozzle in the room the same way
    forward and left [m]; the nozzle stands, goes along with the base, or moves alone.
    """
    found = []
    for x, y in ((STEP, 0.0), (-STEP, 0.0), (0.0, STEP), (0.0, -STEP)):
        found += [(x, y, 0.0, x, y), (x, y, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, x, y)]
    return np.array(found)


def after(states: np.ndarray, move: np.ndarray, share: float = 1.0) -> np.ndarray:
    """Return states (n, 5), base x, y [m], yaw [rad] and nozzle forward, left [m], after a share of a move (5,)."""
    forward, left, _, nozzle_forward, nozzle_left = share * move
    cosine, sine = np.cos(states[:, 2]), np.sin(states[:, 2])
    shift = np.stack([cosine * forward - sine * left, sine * forward + cosine * left], axis=1)
    nozzle = states[:, 3:] + [nozzle_forward - forward, nozzle_left - left]
    return np.column_stack([states[:, :2] + shift, states[:, 2], nozzle])


def turned(states: np.ndarray, angle: float, about_nozzle: bool) -> np.ndarray:
    """Return states (n, 5) with the base turned by an angle [rad] about its middle or about the nozzle's."""
    found = states.copy()
    found[:, 2] += angle
    if about_nozzle:
        for sign, yaw in ((1.0, states[:, 2]), (-1.0, found[:, 2])):
            cosine, sine = np.cos(yaw), np.sin(yaw)
            found[:, 0] += sign * (cosine * states[:, 3] - sine * states[:, 4])
            found[:, 1] += sign * (sine * states[:, 3] + cosine * states[:, 4])
    return found


def within_reach(states: np.ndarray) -> np.ndarray:
    """Return whether the nozzle of states (n, 5) is where the arm can hold it, (n,)."""
    low, high = np.array([FORWARD[0], LEFT[0]]) - 1e-9, np.array([FORWARD[-1], LEFT[-1]]) + 1e-9
    return ((states[:, 3:] >= low) & (states[:, 3:] <= high)).all(axis=1)


def neighbours(states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the states (k, n, 5) half way and after each kind of move."""
    pairs = [(after(states, move, 0.5), after(states, move)) for move in moves()]
    for angle in (TURN, -TURN):
        pairs += [(turned(states, angle / 2, nozzle), turned(states, angle, nozzle)) for nozzle in (False, True)]
    return tuple(np.stack(column) for column in zip(*pairs, strict=True))


def ways_out(
    body: Body, distances: Distances, base: np.ndarray, nozzle: np.ndarray, least: float, out: Callable
) -> np.ndarray | None:
    """Return states (m, 5) from base (3,) and nozzle (2,), lifted, to one that is `out(states (n, 5)) -> (n,)`.

    The robot keeps at least `least` [m] from everything. None: no way was found, which does not mean there is none.
    """
    states, chains = np.concatenate([base, nozzle])[None], [np.zeros(1, dtype=int)]
    levels, seen = [states], set(map(bytes, _rounded(states)))
    for _ in range(LEVELS):
        half, whole = neighbours(states)
        parents = np.tile(np.arange(len(states)), len(whole))
        half, whole = half.reshape(-1, 5), whole.reshape(-1, 5)
        kept = np.sort(np.unique(_rounded(whole), axis=0, return_index=True)[1])
        kept = kept[within_reach(whole[kept]) & within_reach(half[kept])]
        kept = kept[np.array([bytes(key) not in seen for key in _rounded(whole[kept])], dtype=bool)]
        room = body.clearance(distances, whole[kept, :3], whole[kept, 3:])
        kept = kept[np.argsort(-room, kind="stable")][: int((room > least).sum())]
        kept = kept[body.clearance(distances, half[kept, :3], half[kept, 3:]) > least][:KEPT]
        if not len(kept):
            return None
        states = whole[kept]
        seen.update(map(bytes, _rounded(states)))
        levels.append(states), chains.append(parents[kept])
        done = np.flatnonzero(out(states))
        if len(done):
            return _traced(levels, chains, int(done[0]))
    return None


def _traced(levels: list[np.ndarray], parents: list[np.ndarray], last: int) -> np.ndarray:
    way = []
    for states, before in zip(levels[::-1], parents[::-1], strict=True):
        way.append(states[last])
        last = before[last]
    return np.array(way[::-1])


def _rounded(states: np.ndarray) -> np.ndarray:
    return np.round(states * [1.0, 1.0, ARM, 1.0, 1.0] / LIKE).astype(np.int32)
