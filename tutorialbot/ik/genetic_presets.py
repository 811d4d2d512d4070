"""Named variants of paper 2's genetic algorithm: each operator is a field, so that one at a time can be changed.

The paper fixes 200 generations, crossover 0.6, mutation 0.4 and the penalty; all else is a reading. "paper" is a plain
algorithm as DEAP's own introduction builds it; "good" reaches the optimum from anywhere, "seeded" from the answer for a
target nearby. What makes the difference is the mutation:
the population sits on a ridge of eq. (5), off which steps in random directions fall; the difference of two members
points along it. The changes after it are for targets anywhere in the arm's reach: a step beyond the better parent goes
along the ridge too, mirrors keep those children who would live just beyond a limit, and islands find several valleys
where one population would settle in the first.
"""

from dataclasses import dataclass, replace

from tutorialbot.errors import InvalidType, InvalidValue, finite_number, one_of, positive, whole_number
from tutorialbot.ik.fitness import NORMS, PENALTY
from tutorialbot.ik.tilts import READINGS

CHOICES = {
    "parents": ("random", "tournament"),
    "crossover": ("beyond", "blend", "two-point"),
    "mutation": ("difference", "gauss"),
    "variation": ("and", "or"),
    "survivors": ("best", "offspring", "tournament"),
    "outside": ("mirrored", "penalised"),
    "norm": NORMS,
    "reading": tuple(READINGS),
}


@dataclass(frozen=True)
class Preset:
    """One variant of the algorithm of Fig. 3, and of the fitness that it minimises.

    population, generations: counts. parents: whom children come from, members at "random" or each the best of
    `parents_of` in a "tournament". variation: a child is crossed "or" mutated, or may be both, "and" (DEAP's varOr and
    varAnd), with probabilities `crossover_share` and `mutation_share`. crossover: "blend" of every gene by a random
    factor from -blend to 1 + blend; "beyond" the better parent by a random share, 0 to `beyond`, of the step from the
    worse one to it, the same for all genes; or "two-point". mutation: "gauss" adds a normal deviate to each gene with
    probability `per_gene`, its width going from sigma[0] to sigma[1] [rad] by equal ratios; "difference" adds `factor`
    times the difference of two members. survivors: of parents and children together the "best", or winners of
    tournaments of three; or all "offspring" and nobody else. outside: genes beyond a limit are "mirrored" in it, or
    left, and the child "penalised". islands: the population in so many equal parts that never meet; the best of all
    counts. spread [rad]: width of the first population about an initial configuration. weight, norm, reading, penalty:
    of eq. (5), see `fitness`.

    Raises InvalidType or InvalidValue, by the field's name, for what is out of range.
    """

    name: str
    population: int = 600
    islands: int = 4
    generations: int = 200
    parents: str = "random"
    parents_of: int = 2
    variation: str = "or"
    crossover: str = "beyond"
    crossover_share: float = 0.6
    blend: float = 0.5
    beyond: float = 1.5
    mutation: str = "difference"
    mutation_share: float = 0.4
    factor: float = 0.5
    sigma: tuple[float, float] = (0.1, 0.1)
    per_gene: float = 0.2
    survivors: str = "best"
    outside: str = "mirrored"
    spread: float = 0.05
    weight: float = 1.0
    norm: str = "L1"
    reading: str = "pitch-first"
    penalty: float = PENALTY

    def __post_init__(self):
        if not isinstance(self.name, str):
            raise InvalidType("name", self.name, "text")
        for field, choices in CHOICES.items():
            one_of(field, getattr(self, field), choices)
        whole_number("population", self.population, 4), whole_number("generations", self.generations)
        whole_number("parents_of", self.parents_of, 1), whole_number("islands", self.islands, 1)
        if self.population % self.islands or self.population < 4 * self.islands:
            expected = f"a divisor of the population, {self.population}, that leaves 4 members or more on each"
            raise InvalidValue("islands", self.islands, expected)
        for field in ("crossover_share", "mutation_share", "per_gene"):
            finite_number(field, getattr(self, field), 0.0, 1.0)
        if self.variation == "or" and self.crossover_share + self.mutation_share > 1.0:
            shares = (self.crossover_share, self.mutation_share)
            raise InvalidValue("crossover_share, mutation_share", shares, "a sum of at most 1 where variation is 'or'")
        for field in ("blend", "beyond", "factor", "weight", "penalty"):
            finite_number(field, getattr(self, field), 0.0)
        positive("spread", self.spread)
        if not isinstance(self.sigma, tuple | list) or len(self.sigma) != 2:
            raise InvalidType("sigma", self.sigma, "two numbers: the first generation's and the last one's")
        for value in self.sigma:
            positive("sigma", value)

    def sigma_at(self, generation: int) -> float:
        """Return the width of the Gaussian steps [rad] that make generation 1 to `generations`."""
        first, last = self.sigma
        return first * (last / first) ** ((generation - 1) / max(1, self.generations - 1))


PAPER = Preset(
    "paper", population=100, islands=1, parents="tournament", parents_of=3, variation="and", crossover="blend",
    mutation="gauss", survivors="offspring", outside="penalised",
)  # fmt: skip
GOOD = Preset("good")
SEEDED = Preset(  # beside an answer: one island that stays in its valley, where crossover leaps into no other
    "seeded", population=300, islands=1, parents="tournament", crossover="blend", outside="penalised"
)

CHANGES = (  # from "paper" to "good", one operator after the other; the mutation is the one that matters most
    ("survivors: the best of both", {"survivors": "best"}),
    ("children crossed or mutated", {"variation": "or"}),
    ("parents at random", {"parents": "random", "parents_of": 2}),
    ("population 600", {"population": 600}),
    ("mutation: a difference", {"mutation": "difference"}),
    ("outside: mirrored", {"outside": "mirrored"}),
    ("crossover: beyond the better", {"crossover": "beyond"}),
    ("four islands", {"islands": 4}),
)

PRESETS = {preset.name: preset for preset in (PAPER, GOOD, SEEDED)}


def find_preset(preset: str | Preset) -> Preset:
    """Return the preset of that name, or the one given; raises InvalidValue that lists the names, or InvalidType."""
    if isinstance(preset, Preset):
        return preset
    if not isinstance(preset, str):
        raise InvalidType("preset", preset, "a name or a Preset")
    return PRESETS[one_of("preset", preset, PRESETS)]


def from_paper_to_good() -> list[Preset]:
    """Return "paper", then each of CHANGES on top of the ones before; the last does what "good" does."""
    presets = [PAPER]
    for name, change in CHANGES:
        presets.append(replace(presets[-1], name=name, **change))
    return presets
