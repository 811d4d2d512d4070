"""A free motion of the arm between two postures: straight in the joints if that is free, else by two trees that meet.

RRT-Connect (Kuffner and LaValle, ICRA 2000), then ways round are cut short. What is free is asked for many postures at
once.
"""

from collections.abc import Callable

import numpy as np

GRAIN, REACH = 0.08, 1.0  # between two postures that are looked at; how far a tree grows at once [rad, largest joint]

Free = Callable[[np.ndarray], np.ndarray]  # postures (k, 7) [rad] -> which of them are free (k,)


def connect(
    free: Free, a: np.ndarray, b: np.ndarray, low: np.ndarray, high: np.ndarray, rng: np.random.Generator,
    tries: int = 400,
) -> list[np.ndarray] | None:  # fmt: skip
    """Return postures (7,) [rad] from a to b, straight free motions between them, or None after `tries` tries.

    low, high (7,): within which the trees grow.
    """
    if not free(np.array([a, b])).all():
        return None
    if straight(free, a, b):
        return [a, b]
    trees = (([a], [-1]), ([b], [-1]))
    for turn in range(tries):
        grown, other = trees[turn % 2], trees[1 - turn % 2]
        new = _grow(free, grown, rng.uniform(low, high), REACH)
        if new is None:
            continue
        met = _grow(free, other, new, np.inf)
        if met is not None and np.abs(met - new).max() < 1e-12:
            one, two = _back(grown), _back(other)
            path = one[::-1] + two[1:]
            return shortened(free, path[::-1] if turn % 2 else path, rng)
    return None


def straight(free: Free, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether the straight motion from a to b is free."""
    return bool(free(_between(a, b)).all())


def shortened(free: Free, path: list[np.ndarray], rng: np.random.Generator, tries: int = 40) -> list[np.ndarray]:
    """Return `path` with postures left out where the straight motion past them is free."""
    for _ in range(tries):
        if len(path) < 3:
            break
        i, j = np.sort(rng.choice(len(path), 2, replace=False))
        if j - i > 1 and straight(free, path[i], path[j]):
            path = path[: i + 1] + path[j:]
    return path


def _between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    count = int(np.abs(b - a).max() / GRAIN) + 2
    return a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)


def _grow(free: Free, tree: tuple[list, list], toward: np.ndarray, reach: float) -> np.ndarray | None:
    """Grow `tree` from its nearest posture as far toward `toward` as is free; return the new posture, None if none."""
    postures, parents = tree
    nearest = int(np.argmin(((np.array(postures) - toward) ** 2).sum(axis=1)))
    start = postures[nearest]
    step = toward - start
    steps = _between(start, start + step * min(1.0, reach / max(np.abs(step).max(), 1e-12)))
    open_ = free(steps)
    last = len(steps) if open_.all() else int(np.argmin(open_))
    if last < 2:
        return None
    postures.append(steps[last - 1])
    parents.append(nearest)
    return steps[last - 1]


def _back(tree: tuple[list, list]) -> list[np.ndarray]:
    """Postures from the newest of `tree` back to its root."""
    postures, parents = tree
    at, path = len(postures) - 1, []
    while at >= 0:
        path.append(postures[at])
        at = parents[at]
    return path
