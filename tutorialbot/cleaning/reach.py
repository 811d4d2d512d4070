"""The arm's postures for vacuuming, all of them found by the genetic algorithm, each from the answer beside it.

The nozzle is told by where its middle is in the base's frame, (forward, left) [m]. With the hand held as in Table 1
that is a shift away from the thumb's root, the target of the inverse kinematics.

Between two answers of the algorithm the hand does not go straight: half way it is off by up to 4 cm, for neighbours
differ in how far the elbow is raised, too. So the answers are refined on a dense lattice by Newton's method, whose
steps are the smallest ones that bring the hand where it shall be.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import map_coordinates

from tutorialbot.errors import InvalidValue
from tutorialbot.ik import genetic
from tutorialbot.ik.fitness import task_error
from tutorialbot.scene import room as rooms

TILT = np.array([0.0, -np.pi / 2, 0.0])  # paper 2, Table 1
FORWARD = rooms.NOZZLE_FROM_TIP[0] + 0.10 + 0.05 * np.arange(7)  # of the nozzle before the base's middle [m]
LEFT = rooms.NOZZLE_FROM_TIP[1] - 0.10 + 0.0625 * np.arange(9)  # [m]
LIFT = 0.03  # of the nozzle above the floor between lanes [m]
REST_TILT, REST_TIP = np.deg2rad([0.0, -80.0, 0.0]), np.array([0.03, 0.30, 0.29])  # beside the body, off the floor
SEEDED = replace(genetic.SEEDED, population=100, generations=80)  # beside a solution this is enough
COLD = 6  # searches from nowhere; the elbow hangs lowest in the one that is kept
DENSE = 8  # lattice steps from one solved posture to the next
HEIGHTS = 5  # ... and levels from the floor to LIFT
NEWTON = 3  # steps
TOLERANCE, TRIES = 0.001, 5  # [m] and [rad]; a search that misses it goes on from where it ended


@dataclass(frozen=True, eq=False)
class Postures:
    """down: (f, l, 7) [rad], the arm with the nozzle on the floor at FORWARD[i], LEFT[j].

    raising (m, 7): from the rest posture, the vacuum held close, to lattice[-1, 0, -1], lifted. error: the largest
    error of all targets [m or rad]; evaluations of eq. (5).
    """

    down: np.ndarray
    raising: np.ndarray
    error: float
    evaluations: int

    @cached_property
    def lattice(self) -> np.ndarray:
        """Postures (HEIGHTS, DENSE (f - 1) + 1, DENSE (l - 1) + 1, 7) [rad], evenly from FORWARD[0], LEFT[0] on.

        Level 0 is on the floor; each other one is refined from the one below, so that lifting hardly moves the elbow.
        """
        axes = [np.linspace(0, n - 1, DENSE * (n - 1) + 1) for n in self.down.shape[:2]]
        places = np.meshgrid(*axes, indexing="ij")
        forward, left = (np.interp(at, np.arange(len(grid)), grid)
                         for at, grid in zip(places, (FORWARD, LEFT), strict=True))  # fmt: skip
        found = np.stack([map_coordinates(self.down[..., i], places, order=1) for i in range(7)], axis=-1)
        levels = []
        for height in np.linspace(0.0, LIFT, HEIGHTS):
            found = refined(found, np.moveaxis(tip(forward, left, np.full(forward.shape, height)), 0, -1))
            levels.append(found)
        return np.array(levels)

    def arm(self, nozzle: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Return joint angles (n, 7) for nozzles (n, 2) [m] in the base's frame, and shares lifted (n,) from 0 to 1."""
        places = np.stack([height * (HEIGHTS - 1), *(DENSE * np.interp(nozzle[:, k], grid, np.arange(len(grid)))
                                                     for k, grid in enumerate((FORWARD, LEFT)))])  # fmt: skip
        return np.stack([map_coordinates(self.lattice[..., i], places, order=1, mode="nearest") for i in range(7)], 1)


def refined(q: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Return q (..., 7) after NEWTON steps to `position` (..., 3) [m] at TILT, each the smallest one, inside limits."""
    q, shifts, arm = q.copy(), 1e-6 * np.eye(7), genetic.ARM
    for _ in range(NEWTON):
        error = task_error(q, position, TILT, arm)
        slopes = [(task_error(q + shift, position, TILT, arm) - error) / shifts[0, 0] for shift in shifts]
        q -= (np.linalg.pinv(np.stack(slopes, axis=-1)) @ error[..., None])[..., 0]
        np.clip(q, arm.lower, arm.upper, out=q)
    return q


def tip(forward: ArrayLike, left: ArrayLike, height: ArrayLike) -> np.ndarray:
    """Return the thumb's root (3,) [m] in the abdomen's frame when the nozzle is at (forward, left) and `height`."""
    shift = rooms.NOZZLE_FROM_TIP
    return np.array([forward - shift[0], left - shift[1], rooms.WORKING_HEIGHT + height])


def largest(answer: genetic.GeneticSolution) -> float:
    """Return the largest component of the error [m or rad]."""
    return float(max(np.abs(answer.position_error).max(), np.abs(answer.tilt_error).max()))


def solve_postures(seed: int) -> Iterator[int | Postures]:
    """Solve all postures: yields the number of targets solved so far, at the end the `Postures`.

    The first of them is searched from nowhere, each other one from a neighbour: so all belong to one family, and the
    way from one to the next is short. Raises InvalidValue when the arm of the model cannot take one of them.
    """
    middle_i, middle_j = len(FORWARD) // 2, len(LEFT) // 2
    down = np.empty((len(FORWARD), len(LEFT), 7))
    answers, kept = [], []

    def solve(target: np.ndarray, initial: np.ndarray, tilt: np.ndarray = TILT) -> np.ndarray:
        for _ in range(TRIES):
            seed_now = 1000 * seed + len(answers)
            answers.append(genetic.solve(target, tilt, seed=seed_now, preset=SEEDED, initial=initial))
            initial = answers[-1].q
            if largest(answers[-1]) < TOLERANCE:
                break
        kept.append(answers[-1])
        return initial

    middle = tip(FORWARD[middle_i], LEFT[middle_j], 0.0)
    cold = genetic.solve_many(np.tile(middle, (COLD, 1)), np.tile(TILT, (COLD, 1)),
                              seeds=[1000 * seed + 900 + i for i in range(COLD)])  # fmt: skip
    answers += [answer for answer in cold if answer.converged]
    if not answers:
        raise InvalidValue("seed", seed, "one with which the first search converges")
    first = min(answers, key=lambda answer: abs(answer.q[1])).q  # the upper arm least abducted
    for columns in (range(middle_j, len(LEFT)), range(middle_j - 1, -1, -1)):
        beside = first if columns[0] == middle_j else down[middle_i, middle_j]
        for j in columns:
            for rows in (range(middle_i, len(FORWARD)), range(middle_i - 1, -1, -1)):
                last = beside if rows[0] == middle_i else down[middle_i, j]
                for i in rows:
                    last = down[i, j] = solve(tip(FORWARD[i], LEFT[j], 0.0), last)
                    yield len(answers)
            beside = down[middle_i, j]
    raising, steps = [refined(down[0, -1], tip(FORWARD[0], LEFT[-1], LIFT))], 8
    for share in np.arange(1, steps + 1) / steps:
        target = (1 - share) * tip(FORWARD[0], LEFT[-1], LIFT) + share * REST_TIP
        raising.append(solve(target, raising[-1], (1 - share) * TILT + share * REST_TILT))
    error = max(map(largest, kept))
    if error > TOLERANCE:
        raise InvalidValue("seed", seed, f"one with which every search converges (an error of {error:.3g} is left)")
    yield Postures(down, np.array(raising[::-1]), error, sum(answer.evaluations for answer in answers))
