"""The arm's postures for vacuuming, all of them found by the genetic algorithm, each from the answer beside it.

The nozzle is told by where its middle is in the base's frame, (forward, left) [m]. With the hand held as in Table 1
that is a shift away from the thumb's root, the target of the inverse kinematics.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tutorialbot.errors import InvalidValue
from tutorialbot.ik import genetic
from tutorialbot.scene import room as rooms

TILT = np.array([0.0, -np.pi / 2, 0.0])  # paper 2, Table 1
FORWARD = rooms.NOZZLE_FROM_TIP[0] + 0.10 + 0.05 * np.arange(7)  # of the nozzle before the base's middle [m]
LEFT = rooms.NOZZLE_FROM_TIP[1] - 0.10 + 0.0625 * np.arange(9)  # [m]
LIFT = 0.03  # of the nozzle above the floor between lanes [m]
PRESS = 0.002  # how far below the floor the arm is told to hold the nozzle, so that it stays in touch [m]
REST_TILT, REST_TIP = np.deg2rad([0.0, -80.0, 0.0]), np.array([0.03, 0.30, 0.29])  # beside the body, off the floor
SEEDED = replace(genetic.SEEDED, population=100, generations=80)  # beside a solution this is enough
COLD = 6  # searches from nowhere; the elbow hangs lowest in the one that is kept
TOLERANCE, TRIES = 0.001, 5  # [m] and [rad]; a search that misses it goes on from where it ended


@dataclass(frozen=True, eq=False)
class Postures:
    """down, lifted: (f, l, 7) [rad], the arm with the nozzle at FORWARD[i], LEFT[j], on the floor and above it.

    raising (m, 7): from the rest posture, the vacuum held close, to lifted[0, -1]. error: the largest error of all
    targets [m or rad]; evaluations of eq. (5).
    """

    down: np.ndarray
    lifted: np.ndarray
    raising: np.ndarray
    error: float
    evaluations: int

    def arm(self, nozzle: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Return joint angles (n, 7) for nozzles (n, 2) [m] in the base's frame, and shares lifted (n,) from 0 to 1.

        Between the solved postures, linear in each joint.
        """
        places = []
        for grid, value in ((FORWARD, nozzle[:, 0]), (LEFT, nozzle[:, 1])):
            at = np.clip(np.interp(value, grid, np.arange(len(grid))), 0, len(grid) - 1 - 1e-9)
            places.append((at.astype(int), at - at.astype(int)))
        (i, a), (j, b) = places
        found = 0.0
        for di, dj, share in ((0, 0, (1 - a) * (1 - b)), (1, 0, a * (1 - b)), (0, 1, (1 - a) * b), (1, 1, a * b)):
            both = (1 - height)[:, None] * self.down[i + di, j + dj] + height[:, None] * self.lifted[i + di, j + dj]
            found = found + share[:, None] * both
        return found


def tip(forward: float, left: float, height: float) -> np.ndarray:
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
    down, lifted = (np.empty((len(FORWARD), len(LEFT), 7)) for _ in range(2))
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

    middle = tip(FORWARD[middle_i], LEFT[middle_j], -PRESS)
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
                    last = down[i, j] = solve(tip(FORWARD[i], LEFT[j], -PRESS), last)
                    lifted[i, j] = solve(tip(FORWARD[i], LEFT[j], LIFT), last)
                    yield len(answers)
            beside = down[middle_i, j]
    raising, steps = [lifted[0, -1]], 8
    for share in np.arange(1, steps + 1) / steps:
        target = (1 - share) * tip(FORWARD[0], LEFT[-1], LIFT) + share * REST_TIP
        raising.append(solve(target, raising[-1], (1 - share) * TILT + share * REST_TILT))
    error = max(map(largest, kept))
    if error > TOLERANCE:
        raise InvalidValue("seed", seed, f"one with which every search converges (an error of {error:.3g} is left)")
    yield Postures(down, lifted, np.array(raising[::-1]), error, sum(answer.evaluations for answer in answers))
