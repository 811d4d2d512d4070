"""Inverse kinematics by a genetic algorithm: paper 2, section 3.

`solve` finds joint angles for one target, `evolve` is the same as a loop to watch, `follow` goes along many targets,
`optimum` knows the true answer to compare with. Eqs (1)-(4) stand in `arm7`, eq. (5) in `fitness`, the operators in
`genetic_array` (arrays, fast) and `genetic_deap` (DEAP, the paper's library).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, one_of, whole_number
from tutorialbot.ik import genetic_array
from tutorialbot.ik.arm7 import ARM, LIMITS, Arm, forward_kinematics, forward_kinematics_scalar
from tutorialbot.ik.fitness import (
    GeneticSolution,
    History,
    as_arm,
    fitness,
    fitness_scalar,
    objective,
    solution,
    target,
)
from tutorialbot.ik.genetic_presets import GOOD, PAPER, PRESETS, SEEDED, Preset, find_preset, from_paper_to_good
from tutorialbot.ik.oracle import optimum
from tutorialbot.seeding import make_rng

__all__ = [
    "ARM", "ENGINES", "GOOD", "LIMITS", "PAPER", "PRESETS", "SEEDED", "Arm", "Generation", "GeneticSolution",
    "History", "Preset", "deviation", "evolve", "find_preset", "fitness", "fitness_scalar", "follow",
    "forward_kinematics", "forward_kinematics_scalar", "from_paper_to_good", "optimum", "solve", "solve_many",
    "tip_path",
]  # fmt: skip

ENGINES = ("array", "deap", "literal")
ROWS = 2400  # members of all problems that go side by side: as much as the processor's cache holds


@dataclass(frozen=True)
class Generation:
    """What `evolve` yields: the population (n, 7) [rad] and its fitness (n,), the best member first; the best
    configuration so far (7,) and its fitness; evaluations of eq. (5) so far. The first has number 0.
    """

    number: int
    population: np.ndarray
    fitness: np.ndarray
    best: np.ndarray
    best_fitness: float
    evaluations: int


def evolve(
    position: np.ndarray, tilt: np.ndarray, *, seed: int, preset: str | Preset = "good",
    initial: np.ndarray | None = None, engine: str = "array", arm: Arm = ARM,
) -> Iterator[Generation]:
    """Run the genetic algorithm of paper 2, Fig. 3, yielding each generation; arguments and errors as in `solve`."""
    preset, arm = find_preset(preset), as_arm(arm)
    _check_engine(engine, preset)
    return _evolve(*target(position, tilt), make_rng(seed), preset, _initial(initial), engine, arm)


def _check_engine(engine: str, preset: Preset) -> None:
    if one_of("engine", engine, ENGINES) == "literal" and (preset.norm, preset.reading) != ("L1", "pitch-first"):
        raise InvalidValue("engine", engine, "'array' or 'deap' for another norm than L1, another reading of tilt")


def _evolve(position, tilt, rng, preset, initial, engine, arm) -> Iterator[Generation]:
    best, lowest = None, np.inf
    start = first_population([rng], preset, initial, arm)
    steps = _generations(position, tilt, start, rng, preset, engine, arm)
    for number, (population, values, evaluations) in enumerate(steps):
        if values[0] < lowest:
            best, lowest = population[0].copy(), float(values[0])
        yield Generation(number, population, values, best, lowest, evaluations)


def _generations(position, tilt, start, rng, preset, engine, arm) -> Iterator[tuple[np.ndarray, np.ndarray, int]]:
    """Yield population (n, 7), fitness (n,) and evaluations of each generation, made by `engine`."""
    value = objective(position, tilt, **_readings(preset), arm=arm)
    if engine == "array":
        for population, values, evaluations in genetic_array.generations(value, start, [rng], preset, arm):
            yield population[0], values[0], evaluations
        return
    from tutorialbot.ik import genetic_deap

    toolbox = genetic_deap.batched(value)
    if engine == "literal":
        goal = position.tolist(), tilt.tolist()
        toolbox = genetic_deap.literal(
            lambda q: fitness_scalar(q, *goal, weight=preset.weight, penalty=preset.penalty, arm=arm)
        )
    yield from genetic_deap.generations(toolbox, start[0], rng, preset, arm)


def first_population(rngs: Sequence, preset: Preset, initial: np.ndarray | None, arm: Arm) -> np.ndarray:
    """Return (problems, n, 7): even within the limits, or `initial` (7,) and members about it by the preset's spread.

    Each problem draws from its own generator.
    """
    shape = (preset.population, 7)
    if initial is None:
        return np.stack([rng.uniform(arm.lower, arm.upper, shape) for rng in rngs])
    start = initial + preset.spread * np.stack([rng.standard_normal(shape) for rng in rngs])
    start[:, 0] = initial
    return np.clip(start, arm.lower, arm.upper)


def solve(
    position: np.ndarray, tilt: np.ndarray, *, seed: int, preset: str | Preset = "good",
    initial: np.ndarray | None = None, engine: str = "array", arm: Arm = ARM,
) -> GeneticSolution:
    """Find joint angles that bring the thumb's root to `position` (3,) [m] with `tilt` (3,) [rad] = (roll, pitch, yaw).

    Frame: the abdomen's. seed: whole number >= 0; the same seed gives the same answer. preset: "good", "paper" or a
    `Preset`. initial (7,) [rad]: where to begin, for a target near the last one. engine: "array", "deap" (one call for
    the whole population), "literal" (DEAP as it comes: one individual at a time). arm: geometry and limits.

    A target out of reach is a result, `converged` False. Ctrl-C ends the search and returns the best so far with
    `interrupted` True (with nothing evaluated yet, KeyboardInterrupt goes on). Raises InvalidType or InvalidValue.
    """
    steps = evolve(position, tilt, seed=seed, preset=preset, initial=initial, engine=engine, arm=arm)
    return _finish(steps, *target(position, tilt), find_preset(preset), arm)


def _finish(steps: Iterator[Generation], position, tilt, preset: Preset, arm: Arm) -> GeneticSolution:
    """Run the generations to their end, or to Ctrl-C, and return the best."""
    seen, interrupted = [], False
    try:
        for step in steps:
            seen.append((step.evaluations, step.best_fitness, float(step.fitness[len(step.fitness) // 2]), step.best))
    except KeyboardInterrupt:
        if not seen:
            raise
        interrupted = True
    history = History(*map(np.array, zip(*seen, strict=True)))
    return solution(
        history.q[-1], position, tilt, arm=arm, reading=preset.reading, evaluations=history.evaluations[-1],
        history=history, interrupted=interrupted,
    )  # fmt: skip


def solve_many(
    positions: np.ndarray, tilts: np.ndarray, *, seeds: Sequence[int], preset: str | Preset = "good", arm: Arm = ARM
) -> list[GeneticSolution]:
    """`solve` for targets (n, 3) and as many seeds, several side by side in the same arrays: the fastest way.

    tilts (n, 3), or one (3,) for all. Each answer is the one that `solve` gives to its target and seed. Ctrl-C ends it:
    the list holds what there is, those in work `interrupted`. Raises InvalidType or InvalidValue.
    """
    preset, arm = find_preset(preset), as_arm(arm)
    positions, tilts = _way_points(positions, tilts)
    if isinstance(seeds, str) or not isinstance(seeds, Sequence | np.ndarray) or np.ndim(seeds) != 1:
        raise InvalidType("seeds", seeds, "whole numbers in a row, one for each target")
    rngs = [make_rng(seed) for seed in seeds]
    if len(rngs) != len(positions):
        raise InvalidValue("seeds", f"{len(rngs)} numbers", f"one for each of the {len(positions)} targets")
    found, together = [], max(1, ROWS // preset.population)
    for i in range(0, len(rngs), together):
        block = slice(i, i + together)
        try:
            found += _solve_block(positions[block], tilts[block], rngs[block], preset, arm)
        except KeyboardInterrupt:
            if not found:
                raise
            break
        if found[-1].interrupted:
            break
    return found


def _way_points(positions: np.ndarray, tilts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (n, 3) and tilts (n, 3), the one tilt for all repeated."""
    positions = finite_array("positions", positions, (-1, 3))
    if np.ndim(tilts) < 2:
        return positions, np.broadcast_to(finite_array("tilts", tilts, (3,)), positions.shape)
    return positions, finite_array("tilts", tilts, positions.shape)


def _solve_block(positions, tilts, rngs, preset: Preset, arm: Arm) -> list[GeneticSolution]:
    value = objective(positions[:, None], tilts[:, None], **_readings(preset), arm=arm)
    start = first_population(rngs, preset, None, arm)
    best, lowest, seen, interrupted = np.empty((len(rngs), 7)), np.full(len(rngs), np.inf), [], False
    try:
        for population, values, evaluations in genetic_array.generations(value, start, rngs, preset, arm):
            better = values[:, 0] < lowest
            best = np.where(better[:, None], population[:, 0], best)
            lowest = np.where(better, values[:, 0], lowest)
            seen.append((np.full(len(rngs), evaluations), lowest, values[:, preset.population // 2], best))
    except KeyboardInterrupt:
        if not seen:
            raise
        interrupted = True
    columns = [np.array(column) for column in zip(*seen, strict=True)]
    histories = [History(*(column[:, i] for column in columns)) for i in range(len(rngs))]
    return [
        solution(h.q[-1], p, t, arm=arm, reading=preset.reading, evaluations=h.evaluations[-1], history=h,
                 interrupted=interrupted)
        for h, p, t in zip(histories, positions, tilts, strict=True)
    ]  # fmt: skip


def follow(
    positions: np.ndarray, tilts: np.ndarray, *, seed: int, preset: str | Preset | None = None,
    initial: np.ndarray | None = None, seeded: bool = True, engine: str = "array", arm: Arm = ARM,
) -> list[GeneticSolution]:
    """Solve way points (n, 3) one after the other, each search begun at the last answer; tilts (n, 3), or one (3,).

    So the arm stays in one of its many postures, and the motion between way points is short. The first search begins
    at `initial` (7,), or anywhere when None; with `seeded` False so do all. preset: by default "good" for searches that
    begin anywhere, "seeded" for those that begin at an answer. Ctrl-C ends it: the list holds what there is, the last
    one `interrupted`. Errors as in `solve`.
    """
    anywhere, beside = (find_preset(preset or name) for name in ("good", "seeded"))
    arm, last = as_arm(arm), _initial(initial)
    _check_engine(engine, anywhere), make_rng(seed)
    positions, tilts = _way_points(positions, tilts)
    found: list[GeneticSolution] = []
    for i, (position, tilt) in enumerate(zip(positions, tilts, strict=True)):
        chosen = anywhere if last is None else beside
        steps = _evolve(position, tilt, make_rng(seed, i), chosen, last, engine, arm)
        found.append(_finish(steps, position, tilt, chosen, arm))
        if found[-1].interrupted:
            break
        last = found[-1].q if seeded else last
    return found


def tip_path(q: np.ndarray, *, between: int = 20, arm: Arm = ARM) -> np.ndarray:
    """Return the way of the thumb's root (m, 3) [m] when all joints move evenly from each of q (n, 7) to the next.

    `between`: steps from one way point to the next; m = (n - 1) between + 1.
    """
    q = finite_array("q", q, (-1, 7))
    if len(q) < 2:
        raise InvalidValue("q", f"{len(q)} configurations", "two or more")
    share = np.arange(whole_number("between", between, 1))[:, None] / between
    steps = q[:-1, None] + share * (q[1:] - q[:-1])[:, None]
    return forward_kinematics(np.concatenate([steps.reshape(-1, 7), q[-1:]]), arm=arm)[0]


def deviation(path: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return how far each point of `path` (m, 3) is from the straight line through `start` and `end` (3,): (m,) [m]."""
    start, end = finite_array("start", start, (3,)), finite_array("end", end, (3,))
    if (start == end).all():
        raise InvalidValue("end", end.tolist(), "another point than the start")
    along = (end - start) / np.linalg.norm(end - start)
    away = finite_array("path", path, (-1, 3)) - start
    return np.linalg.norm(away - (away @ along)[:, None] * along, axis=1)


def _initial(initial: np.ndarray | None) -> np.ndarray | None:
    return None if initial is None else finite_array("initial", initial, (7,))


def _readings(preset: Preset) -> dict:
    return {name: getattr(preset, name) for name in ("norm", "reading", "weight", "penalty")}
