"""How far the tool is from the open: nozzle, pipe and cleaner as one rigid piece, lifted, without the robot behind it.

Where the tool can go is a matter of three numbers only, x, y and heading, so a flood over all of them tells it. In
narrow places it is the tool that is in the way of itself; the flood shows the search for the whole robot where to go.
"""

import numpy as np
from scipy.ndimage import minimum_filter

from tutorialbot.cleaning.body import Body, Distances

STEP, TURNS = 0.025, 24  # between places [m], and headings in a turn
FAR = 10**6  # steps: there is no way


class Retreat:
    """Counts steps on the lattice to the nearest of `open_poses` (n, 3), x, y [m] and heading of a nozzle in the open.

    The tool keeps `least` [m] at each place; ways between them are not looked at.
    """

    def __init__(self, body: Body, distances: Distances, open_poses: np.ndarray, least: float):
        self._low = distances.low
        grid = [np.arange(self._low[i], axis[-1], STEP) for i, axis in enumerate((distances.x, distances.y))]
        x, y = np.meshgrid(*grid, indexing="ij")
        turns = [np.stack([x, y, np.full(x.shape, angle)], axis=-1) for angle in 2 * np.pi / TURNS * np.arange(TURNS)]
        clearance = [body.tool_clearance(distances, poses.reshape(-1, 3)).reshape(x.shape) for poses in turns]
        free = np.stack(clearance, axis=-1) > least
        reached = np.zeros_like(free)
        reached[self._places(open_poses)] = True
        steps, front, count = np.where(reached, 0, FAR), reached, 0
        while front.any():
            count += 1
            front = _beside(front) & free & (steps == FAR)
            steps[front] = count
        self._steps = minimum_filter(steps, size=3, mode=("nearest", "nearest", "wrap"))

    def _places(self, poses: np.ndarray) -> tuple[np.ndarray, ...]:
        x, y = np.round((poses[:, :2] - self._low) / STEP).astype(int).T
        return x, y, np.round(poses[:, 2] * TURNS / (2 * np.pi)).astype(int) % TURNS

    def steps(self, poses: np.ndarray) -> np.ndarray:
        """Return the number of steps (n,) from the places next to the nozzle's poses (n, 3); FAR: there is no way."""
        return self._steps[self._places(poses)]


def _beside(front: np.ndarray) -> np.ndarray:
    """Return the places beside those of `front` (columns, rows, headings)."""
    found = np.roll(front, 1, axis=2) | np.roll(front, -1, axis=2)
    found[1:] |= front[:-1]
    found[:-1] |= front[1:]
    found[:, 1:] |= front[:, :-1]
    found[:, :-1] |= front[:, 1:]
    return found
