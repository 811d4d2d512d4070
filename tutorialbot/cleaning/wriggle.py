"""Out of a narrow place by small moves of base and arm together, found best-first.

Between the legs of a table the nozzle often can neither be drawn close nor driven straight back. A state is a pose of
the base and a place of the nozzle in its frame; from each, small moves lead to others, and those from which the tool
alone is the fewest steps from the open (see `retreat`) go on first.
"""

from collections.abc import Callable

import numpy as np

from tutorialbot.cleaning.body import Body, Distances
from tutorialbot.cleaning.lanes import in_room
from tutorialbot.cleaning.reach import FORWARD, LEFT

STEP, TURN = 0.05, np.pi / 24  # of a move [m], [rad]
BATCH = 50  # states go on at a time
ROUNDS = 40  # so often at most
TRIED = 6  # of the new states are tried whether they are out
LIKE = 0.025  # states are the same when they round to the same multiples of it [m]
ARM = 0.8  # a turn by one radian moves the nozzle about so far [m]
BREADTH = 0.25  # ... and parts of the robot past its middle and the nozzle's at most so far [m]
MISSED = 0.001  # a way between two states comes nearer to something than it may by at most so much [m]


def moves() -> np.ndarray:
    """Return the moves (k, 5): of the base forward, left [m] and turned [rad], of the nozzle in the room the same way
    forward and left [m]; the nozzle stands, goes along with the base, or moves alone.
    """
    found = []
    for x, y in ((STEP, 0.0), (-STEP, 0.0), (0.0, STEP), (0.0, -STEP)):
        found += [(x, y, 0.0, x, y), (x, y, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, x, y)]
    return np.array(found)


def after(states: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Return states (n, 5), base x, y [m], yaw [rad] and nozzle forward, left [m], after a move (5,)."""
    forward, left, _, nozzle_forward, nozzle_left = move
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


def neighbours(states: np.ndarray) -> np.ndarray:
    """Return the states (k, n, 5) after each kind of move."""
    found = [after(states, move) for move in moves()]
    found += [turned(states, angle, nozzle) for angle in (TURN, -TURN) for nozzle in (False, True)]
    return np.stack(found)


def moved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how far (n,) [m] any part of the robot moves from states a to b (n, 5), at most."""
    base, nozzle = np.hypot(*(b - a)[:, :2].T), np.hypot(*(in_room(b[:, :3], b[:, 3:]) - in_room(a[:, :3], a[:, 3:])).T)
    return np.maximum(base, nozzle) + BREADTH * np.abs(b[:, 2] - a[:, 2])


def clear_between(body: Body, distances: Distances, a: np.ndarray, b: np.ndarray, least: float) -> np.ndarray:
    """Return whether the robot keeps `least` [m] all the way, driven evenly, from states a to b (n, 5), which do, (n,).

    Pieces are halved until nothing can be missed between their ends: clearance changes no faster than the robot moves.
    """
    good, number = np.ones(len(a), dtype=bool), np.arange(len(a))
    at_a, at_b = (body.clearance(distances, states[:, :3], states[:, 3:]) for states in (a, b))
    while True:
        unsure = good[number] & ((at_a + at_b - moved(a, b)) / 2 < least - MISSED)
        if not unsure.any():
            return good
        number, a, b, at_a, at_b = (values[unsure] for values in (number, a, b, at_a, at_b))
        middle = (a + b) / 2
        here = body.clearance(distances, middle[:, :3], middle[:, 3:])
        good[number[here <= least]] = False
        number, a, b = np.tile(number, 2), np.concatenate([a, middle]), np.concatenate([middle, b])
        at_a, at_b = np.concatenate([at_a, here]), np.concatenate([here, at_b])


def ways_out(
    body: Body, distances: Distances, base: np.ndarray, nozzle: np.ndarray, least: float, ahead: Callable, out: Callable
) -> np.ndarray | None:
    """Return states (m, 5) from base (3,) and nozzle (2,), lifted, to one that is `out(state (5,)) -> bool`.

    ahead(states (n, 5)) -> (n,): an estimate of the moves that are left; the BATCH states with the least go on. The
    robot keeps at least `least` [m] from everything. None: no way was found, which does not mean there is none.
    """
    states, parents = np.concatenate([base, nozzle])[None], np.array([-1])
    left, seen = ahead(states), set(map(bytes, _rounded(states)))
    for _ in range(ROUNDS):
        now = np.argsort(left, kind="stable")[:BATCH]
        now = now[np.isfinite(left[now])]
        if not len(now):
            return None
        left[now] = np.inf  # they have gone on
        new, origin = _new(neighbours(states[now]), now, seen)
        good = body.clearance(distances, new[:, :3], new[:, 3:]) > least
        good[good] = clear_between(body, distances, states[origin[good]], new[good], least)
        new, origin = new[good], origin[good]
        seen.update(map(bytes, _rounded(new)))
        first, more = len(states), ahead(new)
        states, parents = np.concatenate([states, new]), np.concatenate([parents, origin])
        left = np.concatenate([left, more])
        for i in np.argsort(more, kind="stable")[:TRIED]:
            if out(new[i]):
                return _traced(states, parents, first + int(i))
    return None


def _new(found: np.ndarray, origins: np.ndarray, seen: set) -> tuple[np.ndarray, np.ndarray]:
    """Return those of the states `found` (k, n, 5) that are within reach and like none seen before, and whose number
    of `origins` (n,) they come from.
    """
    origin, found = np.tile(origins, len(found)), found.reshape(-1, 5)
    kept = np.sort(np.unique(_rounded(found), axis=0, return_index=True)[1])
    kept = kept[within_reach(found[kept])]
    kept = kept[np.array([bytes(key) not in seen for key in _rounded(found[kept])], dtype=bool)]
    return found[kept], origin[kept]


def _traced(states: np.ndarray, parents: np.ndarray, last: int) -> np.ndarray:
    way = []
    while last >= 0:
        way.append(states[last])
        last = int(parents[last])
    return np.array(way[::-1])


def _rounded(states: np.ndarray) -> np.ndarray:
    return np.round(states * [1.0, 1.0, ARM, 1.0, 1.0] / LIKE).astype(np.int32)
