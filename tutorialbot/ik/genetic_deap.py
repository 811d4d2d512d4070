"""Paper 2's genetic algorithm in DEAP, the paper's own library, by DEAP's own operators.

`batched`: the whole population is evaluated in one call, through `toolbox.map`, copied and sorted cheaply. `literal`:
one individual at a time, by the scalar equations, copied by DEAP's default, `copy.deepcopy`, and sorted by `selBest`.
"""

import random
from collections.abc import Callable, Iterator, Sequence
from operator import le

import numpy as np
from deap import algorithms, base, tools

from tutorialbot.ik.arm7 import Arm
from tutorialbot.ik.fitness import Objective
from tutorialbot.ik.genetic_array import SURVIVORS_OF
from tutorialbot.ik.genetic_presets import Preset
from tutorialbot.seeding import python_global


class Smallest(base.Fitness):
    """A fitness of which less is better."""

    weights = (-1.0,)


class Individual(list):
    """Seven joint angles [rad] and their fitness."""

    def __init__(self, genes: Sequence[float]):
        super().__init__(genes)
        self.fitness = Smallest()


def clone(individual: Individual) -> Individual:
    """Return a copy; much cheaper than `copy.deepcopy`, which DEAP takes by default, or than to make a new one."""
    copy = Individual.__new__(Individual)
    copy.extend(individual)
    copy.fitness = Smallest.__new__(Smallest)
    copy.fitness.wvalues = individual.fitness.wvalues
    return copy


def best(individuals: list, count: int) -> list:
    """Return what `tools.selBest` returns: it compares fitness objects, this their values, which is much cheaper."""
    return sorted(individuals, key=lambda individual: individual.fitness.wvalues, reverse=True)[:count]


def difference(individual: Individual, population: list, factor: float) -> tuple[Individual]:
    """Add to all genes a share of what two random members of the population differ by."""
    n = len(population)
    i = int(n * random.random())
    b, c = population[i], population[(i + 1 + int((n - 1) * random.random())) % n]
    individual[:] = [x + factor * (p - q) for x, p, q in zip(individual, b, c, strict=True)]
    return (individual,)


def beyond(one: Individual, other: Individual, share: float) -> tuple[Individual, Individual]:
    """Move both by a random part, at most `share`, of the step from the worse to the better; return the better first.

    Wright's heuristic crossover (1991).
    """
    better, worse = (one, other) if one.fitness.wvalues >= other.fitness.wvalues else (other, one)
    gamma = share * random.random()
    pairs = [(p, q, gamma * (p - q)) for p, q in zip(better, worse, strict=True)]
    better[:] = [p + step for p, _, step in pairs]
    worse[:] = [q + step for _, q, step in pairs]
    return better, worse


def mirrored(arm: Arm) -> Callable:
    """Return a decorator of operators: what is beyond a limit is mirrored in it; inside the limits in any case."""
    lower, upper = arm.lower.tolist(), arm.upper.tolist()
    limits = list(zip(lower, upper, strict=True))

    def decorate(operator: Callable) -> Callable:
        def decorated(*individuals, **options) -> tuple:
            made = operator(*individuals, **options)
            for individual in made:
                if not (all(map(le, lower, individual)) and all(map(le, individual, upper))):
                    individual[:] = [
                        x if low <= x <= high else max(low, high - abs(high - low - abs(x - low)))
                        for x, (low, high) in zip(individual, limits, strict=True)
                    ]
            return made

        return decorated

    return decorate


def batched(value: Objective) -> base.Toolbox:
    """Return a toolbox that evaluates all individuals in one vectorised call of eq. (5), `value`."""
    toolbox = base.Toolbox()
    toolbox.register("clone", clone)
    toolbox.register("best", best)
    toolbox.register("evaluate", value)
    toolbox.register("map", lambda evaluate, individuals: [(f,) for f in evaluate(np.array(individuals)).tolist()])
    return toolbox


def literal(value: Callable[[Sequence[float]], float]) -> base.Toolbox:
    """Return a toolbox that evaluates one individual at a time by `value`; map and clone are DEAP's defaults."""
    toolbox = base.Toolbox()
    toolbox.register("best", tools.selBest)
    toolbox.register("evaluate", lambda individual: (value(individual),))
    return toolbox


def register(toolbox: base.Toolbox, preset: Preset, arm: Arm) -> None:
    """Register DEAP's operators that `preset` names; the mutation needs the population and waits for each generation.

    Survivors are chosen among parents and children, or are the children.
    """
    if preset.parents == "tournament":
        toolbox.register("select", tools.selTournament, tournsize=preset.parents_of)
    else:
        toolbox.register("select", lambda population, n: population)
    if preset.crossover == "beyond":
        toolbox.register("mate", beyond, share=preset.beyond)
    elif preset.crossover == "blend":
        toolbox.register("mate", tools.cxBlend, alpha=preset.blend)
    else:
        toolbox.register("mate", tools.cxTwoPoint)
    if preset.survivors == "tournament":
        toolbox.register("survive", tools.selTournament, tournsize=SURVIVORS_OF)
    elif preset.survivors == "best":
        toolbox.register("survive", toolbox.best)
    if preset.outside == "mirrored":
        toolbox.decorate("mate", mirrored(arm))


def register_mutation(toolbox: base.Toolbox, preset: Preset, population: list, sigma: float, arm: Arm) -> None:
    """Register the mutation of one generation."""
    if preset.mutation == "difference":
        toolbox.register("mutate", difference, population=population, factor=preset.factor)
    else:
        toolbox.register("mutate", tools.mutGaussian, mu=0.0, sigma=sigma, indpb=preset.per_gene)
    if preset.outside == "mirrored":
        toolbox.decorate("mutate", mirrored(arm))


def vary(parents: list, toolbox: base.Toolbox, preset: Preset) -> list:
    """Return as many children as parents."""
    shares = preset.crossover_share, preset.mutation_share
    if preset.variation == "or":
        return algorithms.varOr(parents, toolbox, len(parents), *shares)
    return algorithms.varAnd(parents, toolbox, *shares)


def evaluate(individuals: list, toolbox: base.Toolbox) -> int:
    """Give a fitness to those who have none, and return how many these were."""
    new = [individual for individual in individuals if not individual.fitness.valid]
    for individual, values in zip(new, toolbox.map(toolbox.evaluate, new) if new else (), strict=True):
        individual.fitness.values = values
    return len(new)


def generations(
    toolbox: base.Toolbox, start: np.ndarray, rng: np.random.Generator, preset: Preset, arm: Arm
) -> Iterator[tuple[np.ndarray, np.ndarray, int]]:
    """Yield the sorted population (n, 7), its fitness (n,) and evaluations so far for each generation, the first too.

    start (n, 7): the first population. DEAP draws from Python's global generator: while a generation is made, that one
    is ours, seeded from `rng`.
    """
    stream = random.Random(int(rng.integers(2**62)))
    population = [Individual(genes) for genes in start.tolist()]
    size = len(population) // preset.islands
    register(toolbox, preset, arm)
    evaluations = evaluate(population, toolbox)
    yield *_arrays(population), evaluations
    islands = [population[i : i + size] for i in range(0, len(population), size)]
    for number in range(1, preset.generations + 1):
        with python_global(stream):
            broods = []
            for island in islands:
                register_mutation(toolbox, preset, island, preset.sigma_at(number), arm)
                broods.append(vary(toolbox.select(island, size), toolbox, preset))
            evaluations += evaluate([child for brood in broods for child in brood], toolbox)
            if preset.survivors == "offspring":
                islands = broods
            else:
                islands = [toolbox.survive(old + new, size) for old, new in zip(islands, broods, strict=True)]
        yield *_arrays([individual for island in islands for individual in island]), evaluations


def _arrays(population: list) -> tuple[np.ndarray, np.ndarray]:
    population = best(population, len(population))
    return np.array(population), np.array([-individual.fitness.wvalues[0] for individual in population])
