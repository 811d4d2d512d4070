"""Paper 2's genetic algorithm on arrays: whole populations, and several problems side by side.

Populations are (problems, n, 7) and sorted, the best member first: the winner of a tournament is then simply the
smallest of the numbers drawn. Each problem draws from its own generator, so it goes the same way alone and in company.
Islands are problems side by side that happen to have the same target.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tutorialbot.ik.arm7 import Arm
from tutorialbot.ik.fitness import Objective
from tutorialbot.ik.genetic_presets import Preset

Generators = Sequence[np.random.Generator]
SURVIVORS_OF = 3  # tournaments among parents and children


def generations(
    value: Objective, population: np.ndarray, rngs: Generators, preset: Preset, arm: Arm
) -> Iterator[tuple[np.ndarray, np.ndarray, int]]:
    """Yield the sorted population (s, n, 7), its fitness (s, n) and evaluations so far of each problem, the first too.

    value: eq. (5) for (s, n, 7). Nothing is checked.
    """
    problems, total, _ = population.shape
    size = total // preset.islands
    rngs = rngs if preset.islands == 1 else [child for rng in rngs for child in rng.spawn(preset.islands)]

    def measured(members: np.ndarray) -> np.ndarray:
        return value(members.reshape(problems, total, 7)).reshape(-1, size)

    population = population.reshape(-1, size, 7)
    population, values = best_of(population, measured(population), size)
    yield *_together(population, values, problems), total
    for number in range(1, preset.generations + 1):
        parents = PARENTS[preset.parents](rngs, size, preset)
        children = VARIATIONS[preset.variation](population, parents, rngs, preset, preset.sigma_at(number))
        if preset.outside == "mirrored":
            children = mirrored(children, arm)
        population, values = SURVIVORS[preset.survivors](population, values, children, measured(children), rngs)
        yield *_together(population, values, problems), (number + 1) * total


def _together(population: np.ndarray, values: np.ndarray, problems: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the islands of each problem as one sorted population and its fitness."""
    if len(population) == problems:
        return population, values
    values = values.reshape(problems, -1)
    return best_of(population.reshape(*values.shape, 7), values, values.shape[1])


def mirrored(q: np.ndarray, arm: Arm) -> np.ndarray:
    """Return q (..., 7) with what is beyond a limit mirrored in it; inside the limits in any case."""
    q = arm.upper - np.abs(arm.upper - arm.lower - np.abs(q - arm.lower))
    return np.maximum(q, arm.lower)


def draw(rngs: Generators, *shape: int) -> np.ndarray:
    """Return uniform numbers in [0, 1), (problems, *shape), each problem's from its own generator."""
    numbers = np.empty((len(rngs), *shape))
    for rng, its in zip(rngs, numbers, strict=True):
        rng.random(out=its)
    return numbers


def draw_index(rngs: Generators, below: int, *shape: int) -> np.ndarray:
    """Return whole numbers in [0, below), (problems, *shape)."""
    return (below * draw(rngs, *shape)).astype(np.intp)


def draw_pair(rngs: Generators, below: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return n pairs of different whole numbers in [0, below), each (problems, n)."""
    u = draw(rngs, 2, n)
    first = (below * u[:, 0]).astype(np.intp)
    return first, (first + 1 + ((below - 1) * u[:, 1]).astype(np.intp)) % below


def members(population: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Return the rows `index` (s, m) of each problem's population (s, n, 7): (s, m, 7)."""
    s, n, genes = population.shape
    return population.reshape(-1, genes).take(index + n * np.arange(s)[:, None], axis=0)


def best_of(population: np.ndarray, values: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the `count` best members of each problem and their fitness, sorted."""
    order = values.argsort(axis=1)[:, :count]
    return members(population, order), np.take_along_axis(values, order, axis=1)


# -- selection of parents: their numbers (s, n) in the sorted population -------------------------------------------


def everybody(rngs: Generators, n: int, preset: Preset) -> np.ndarray:
    """Each member once."""
    return np.broadcast_to(np.arange(n), (len(rngs), n))


def tournament(rngs: Generators, n: int, preset: Preset) -> np.ndarray:
    """n winners: the best of `parents_of` members drawn at random."""
    return draw_index(rngs, n, preset.parents_of, n).min(axis=1)


# -- crossover: two children (s, m, 7) of x and y (s, m, 7); ahead (s, m, 1): whether x is the better one ----------


def blend(x, y, ahead, rngs: Generators, preset: Preset) -> tuple[np.ndarray, np.ndarray]:
    """Every gene anywhere on the line through both parents, a little beyond them too."""
    gamma = (1.0 + 2.0 * preset.blend) * draw(rngs, *x.shape[1:]) - preset.blend
    step = gamma * (y - x)
    return x + step, y - step


def beyond(x, y, ahead, rngs: Generators, preset: Preset) -> tuple[np.ndarray, np.ndarray]:
    """From each parent by the same share of the step from the worse to the better one; the better one's child first.

    Wright's heuristic crossover (1991).
    """
    better, worse = np.where(ahead, x, y), np.where(ahead, y, x)
    step = preset.beyond * draw(rngs, x.shape[1], 1) * (better - worse)
    return better + step, worse + step


def two_point(x, y, ahead, rngs: Generators, preset: Preset) -> tuple[np.ndarray, np.ndarray]:
    """The genes between two random cuts change places."""
    genes = x.shape[-1]
    a, b = draw_pair(rngs, genes, x.shape[1])
    gene = np.arange(genes)
    swap = (gene > np.minimum(a, b)[..., None]) & (gene <= np.maximum(a, b)[..., None])
    return np.where(swap, y, x), np.where(swap, x, y)


# -- mutation: (s, m, 7) -> (s, m, 7) ------------------------------------------------------------------------------


def gauss(x: np.ndarray, population: np.ndarray, rngs: Generators, preset: Preset, sigma: float) -> np.ndarray:
    """Some genes move by a normal deviate, blind to where the population lies."""
    deviates = np.stack([rng.standard_normal(x.shape[1:]) for rng in rngs])
    return x + np.where(draw(rngs, *x.shape[1:]) < preset.per_gene, sigma * deviates, 0.0)


def difference(x: np.ndarray, population: np.ndarray, rngs: Generators, preset: Preset, sigma: float) -> np.ndarray:
    """All genes move by a share of what two random members differ by: along the ridge on which all of them sit."""
    b, c = draw_pair(rngs, population.shape[1], x.shape[1])
    return x + preset.factor * (members(population, b) - members(population, c))


# -- variation: children (s, n, 7) of the sorted population --------------------------------------------------------


def crossed_or_mutated(
    population: np.ndarray, parents: np.ndarray, rngs: Generators, preset: Preset, sigma: float
) -> np.ndarray:
    """Each child has two parents, or is one parent mutated, or (the rest of the shares) one parent unchanged."""
    n = parents.shape[1]
    pool = members(population, parents)
    first, second = draw_pair(rngs, n, n)
    x, chance = members(pool, first), draw(rngs, n, 1)
    ranks = np.take_along_axis(parents, first, axis=1), np.take_along_axis(parents, second, axis=1)
    ahead = (ranks[0] < ranks[1])[..., None]
    children = CROSSOVERS[preset.crossover](x, members(pool, second), ahead, rngs, preset)[0]
    mutants = MUTATIONS[preset.mutation](x, population, rngs, preset, sigma)
    children = np.where(chance < preset.crossover_share, children, mutants)
    share = preset.crossover_share + preset.mutation_share
    return children if share >= 1.0 else np.where(chance < share, children, x)


def crossed_and_mutated(
    population: np.ndarray, parents: np.ndarray, rngs: Generators, preset: Preset, sigma: float
) -> np.ndarray:
    """Neighbours among the parents are crossed in pairs, or not; then each is mutated, or not."""
    children = members(population, parents)
    pairs = children.shape[1] // 2
    x, y = children[:, : 2 * pairs : 2], children[:, 1::2]
    crossing = draw(rngs, pairs, 1) < preset.crossover_share
    ahead = (parents[:, : 2 * pairs : 2] < parents[:, 1::2])[..., None]
    crossed = CROSSOVERS[preset.crossover](x, y, ahead, rngs, preset)
    x[...], y[...] = (np.where(crossing, new, old) for new, old in zip(crossed, (x, y), strict=True))
    mutants = MUTATIONS[preset.mutation](children, population, rngs, preset, sigma)
    return np.where(draw(rngs, children.shape[1], 1) < preset.mutation_share, mutants, children)


# -- survivors: the next sorted population (s, n, 7) and its fitness -----------------------------------------------


def the_best(population, values, children, their_values, rngs) -> tuple[np.ndarray, np.ndarray]:
    """The n best of parents and children: whoever is good stays."""
    everyone = np.concatenate([population, children], axis=1)
    return best_of(everyone, np.concatenate([values, their_values], axis=1), values.shape[1])


def the_offspring(population, values, children, their_values, rngs) -> tuple[np.ndarray, np.ndarray]:
    """All children and no parent."""
    return best_of(children, their_values, values.shape[1])


def the_winners(population, values, children, their_values, rngs) -> tuple[np.ndarray, np.ndarray]:
    """n winners of tournaments among parents and children; the same one may win twice."""
    n = values.shape[1]
    everyone = np.concatenate([population, children], axis=1)
    everyone, ranked = best_of(everyone, np.concatenate([values, their_values], axis=1), 2 * n)
    winners = np.sort(draw_index(rngs, 2 * n, SURVIVORS_OF, n).min(axis=1), axis=1)
    return members(everyone, winners), np.take_along_axis(ranked, winners, axis=1)


PARENTS: dict[str, Callable] = {"random": everybody, "tournament": tournament}
CROSSOVERS: dict[str, Callable] = {"beyond": beyond, "blend": blend, "two-point": two_point}
MUTATIONS: dict[str, Callable] = {"gauss": gauss, "difference": difference}
VARIATIONS: dict[str, Callable] = {"or": crossed_or_mutated, "and": crossed_and_mutated}
SURVIVORS: dict[str, Callable] = {"best": the_best, "offspring": the_offspring, "tournament": the_winners}
