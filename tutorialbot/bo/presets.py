"""Named variants of Algorithm 1: what the paper says, what works better, and the controls that stand beside them."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from tutorialbot.bo.objective import Cost, new_pose_cost, paper_cost
from tutorialbot.bo.optimizers import OPTIMIZERS, Optimizer, SkoptSearch, TwistSearch
from tutorialbot.bo.space import SearchSpace
from tutorialbot.errors import InvalidType, InvalidValue, one_of, whole_number
from tutorialbot.scene.simulation import Settings


@dataclass(frozen=True)
class Preset:
    """One variant of Algorithm 1.

    `warm_start`: a section tries the direction that ended the last one first, then a neighbour of it. `replay`: every
    third trial is the motion that really happened in the best-moving trial so far. `reject_above`: a section whose best
    cost is above this is not committed, and its trials stay with the optimiser; after more than `patience` rejected
    sections in a row the last move is taken back. `go_on`: a committed direction is tried again, with no search, while
    it works. `ceiling`: the optimiser is told no cost above this [s], so that a penalty is no cliff: a smooth surrogate
    that must climb one loses sight of the valleys.
    """

    name: str
    make: Callable[[np.random.Generator], Optimizer]
    cost: Cost = paper_cost
    space: SearchSpace = field(default_factory=SearchSpace)
    settings: Settings = field(default_factory=Settings)
    warm_start: bool = False
    replay: bool = False
    reject_above: float = np.inf
    patience: int = 2
    go_on: bool = False
    ceiling: float = np.inf

    def __post_init__(self):
        for name in ("reject_above", "ceiling"):
            limit = getattr(self, name)
            if isinstance(limit, bool) or not isinstance(limit, int | float):
                raise InvalidType(name, limit, "a number, infinity included")
            if limit != limit:
                raise InvalidValue(name, limit, "a number, infinity included")
        whole_number("patience", self.patience)
        for name, kind in (("name", str), ("space", SearchSpace), ("settings", Settings)):
            if not isinstance(getattr(self, name), kind):
                raise InvalidType(name, getattr(self, name), f"a {kind.__name__}")
        for name in ("make", "cost"):
            if not callable(getattr(self, name)):
                raise InvalidType(name, getattr(self, name), "a function")


_IMPROVED = Preset(
    "improved",
    lambda rng: TwistSearch(rng, initial=2),
    new_pose_cost,
    SearchSpace(rotation_max=np.pi / 2, frame="tool"),
    warm_start=True,
    replay=True,
    reject_above=-0.5,
    ceiling=0.0,
)

PRESETS = {
    preset.name: preset
    for preset in (
        Preset("paper", SkoptSearch),
        Preset("paper, EI", lambda rng: SkoptSearch(rng, "EI")),
        Preset("paper, EI per second", lambda rng: SkoptSearch(rng, "EIps")),
        _IMPROVED,
        replace(_IMPROVED, name="improved, going on", go_on=True),
        replace(_IMPROVED, name="improved, cliffs", ceiling=np.inf),
        *(
            replace(_IMPROVED, name=f"improved, {name}", make=OPTIMIZERS[name])
            for name in ("random", "skopt", "cmaes", "optuna")
        ),
        *(Preset(f"paper, {name}", OPTIMIZERS[name]) for name in ("random", "cmaes", "optuna")),
    )
}


def find_preset(preset: str | Preset) -> Preset:
    """Return the preset of that name, or the one given; raises InvalidValue that lists the names, or InvalidType."""
    if isinstance(preset, Preset):
        return preset
    if not isinstance(preset, str):
        raise InvalidType("preset", preset, "a name or a Preset")
    return PRESETS[one_of("preset", preset, PRESETS)]
