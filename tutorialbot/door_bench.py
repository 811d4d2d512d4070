"""Paper 1 measured: physics, snapshots, and the optimisers against each other on paired seeds that no tuning saw."""

import itertools
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from scipy.stats import binomtest

from tutorialbot import paths
from tutorialbot.bo.objective import DoorTask, execute
from tutorialbot.bo.optimizers import RandomSearch, SkoptSearch, TwistSearch
from tutorialbot.bo.presets import PRESETS, Preset
from tutorialbot.bo.search import DoorRun, search
from tutorialbot.measuring import cpu_seconds, run_all, wilson
from tutorialbot.runs import Journal, progress
from tutorialbot.scene.door import Door
from tutorialbot.seeding import make_rng

FIRST_SEED = 20_000  # presets were tuned on seeds below 200, and an earlier version measured on 9500 to 9599
ROW = ("preset", "trials", "stiffness", "noise", "spindle_radius")  # what tells one row of the study from another
AJAR = np.deg2rad(2.0)  # beyond this hinge angle a section counts as pulling the door


@dataclass(frozen=True)
class Case:
    """One row of the study: a preset, its budget, what is changed, and how many seeds it gets."""

    preset: str
    seeds: int
    trials: int = 15
    stiffness: float = 0.12
    noise: bool = False
    spindle_radius: float = 0.42

    def variant(self) -> Preset:
        """Return the preset with this row's changes."""
        preset = PRESETS[self.preset]
        noise = {"force_noise": 2.0, "torque_noise": 0.3} if self.noise else {}
        return replace(preset, settings=replace(preset.settings, stiffness=self.stiffness, **noise))


def study_cases(seeds: int) -> list[Case]:
    """Return the rows, the most important first; the later ones have fewer seeds, always the same first ones.

    Our variant; the paper read literally; the control without a surrogate; a surrogate that sees the penalties as
    cliffs; the peers; smaller budgets; a stiffer arm, a noisy sensor, a wider door; the literal reading's others.
    """
    many, few, least = (max(1, round(share * seeds)) for share in (0.6, 0.2, 0.1))
    ours, control = "improved", "improved, random"
    return [
        Case(ours, seeds),
        Case("paper", few),
        Case(control, many),
        Case("improved, cliffs", many),
        *(
            Case(preset, few)
            for preset in ("improved, skopt", "improved, cmaes", "improved, optuna", "improved, going on")
        ),
        *(Case(preset, many, trials) for trials in (3, 5, 8) for preset in (ours, control)),
        *(Case(preset, few, stiffness=0.3) for preset in (ours, control)),
        *(Case(preset, few, noise=True) for preset in (ours, control)),
        Case(ours, few, spindle_radius=0.75),
        Case("paper, random", few),
        *(Case(preset, least) for preset in ("paper, EI", "paper, EI per second", "paper, cmaes", "paper, optuna")),
    ]


class Stopwatch:
    """An optimiser whose thinking is timed: `seconds` of CPU."""

    def __init__(self, optimizer):
        self.optimizer, self.seconds = optimizer, 0.0

    def _timed(self, call: Callable, *arguments):
        began = time.process_time()
        try:
            return call(*arguments)
        finally:
            self.seconds += time.process_time() - began

    def ask(self) -> np.ndarray:
        return self._timed(self.optimizer.ask)

    def tell(self, c: np.ndarray, cost: float, seconds: float) -> None:
        self._timed(self.optimizer.tell, c, cost, seconds)

    def best(self) -> np.ndarray:
        return self._timed(self.optimizer.best)


def one_door(case: Case, seed: int) -> dict:
    """Search one door and execute what was found on a fresh one; return what the table needs."""
    preset, watches = case.variant(), []

    def make(rng: np.random.Generator) -> Stopwatch:
        watches.append(Stopwatch(preset.make(rng)))
        return watches[-1]

    door = Door(spindle_radius=case.spindle_radius)
    began = time.process_time()
    steps = search(door, seed=seed, preset=replace(preset, make=make), trials_per_section=case.trials)
    run: DoorRun = _last(steps)
    seconds = time.process_time() - began
    kept = [section for section in run.sections if section.moves]
    return {
        **asdict(case),
        "seed": seed,
        "opened": run.opened,
        "hinge_deg": round(float(np.rad2deg(max([0.0, *(section.hinge_angle for section in run.sections)]))), 1),
        "sections": len(run.sections),
        "lever_sections": sum(1 for section in kept if section.hinge_angle < AJAR),
        "pull_sections": sum(1 for section in kept if section.hinge_angle >= AJAR),
        "evaluations": run.evaluations,
        "cpu_seconds": round(seconds, 3),
        "surrogate_seconds": round(sum(watch.seconds for watch in watches), 3),
        "executed": bool(run.opened and execute(door, run.trajectory)[0] >= np.pi / 2),
    }


def _last(steps: Iterator) -> DoorRun:
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def study(cases: list[Case], path: Path, jobs: int = 2) -> list[dict]:
    """Run all cases on the same seeds, each door on disk in the journal `path` at once: an interrupt loses none."""
    header = {"study": "door", "first_seed": FIRST_SEED, "source": paths.source_digest()}
    with Journal(path, header) as journal:
        done = {_key(entry) for entry in journal.entries}
        wanted = [(case, FIRST_SEED + i) for case in cases for i in range(case.seeds)]
        wanted = [(case, seed) for case, seed in wanted if _key({**asdict(case), "seed": seed}) not in done]
        run_all(one_door, wanted, journal, jobs, "doors")
        asked = {_row(asdict(case)): case.seeds for case in cases}
        return [e for e in journal.entries if e["seed"] < FIRST_SEED + asked.get(_row(e), 0)]


def _row(entry: dict) -> tuple:
    return tuple(entry[name] for name in ROW)


def _key(entry: dict) -> tuple:
    return (*_row(entry), entry["seed"])


def summarise(doors: list[dict]) -> list[dict]:
    """Return a row a case: shares opened within 12 (with Wilson's 95 % interval), 8 and 6 sections, medians, costs."""
    rows = []
    for key, group in itertools.groupby(sorted(doors, key=_row), key=_row):
        found = list(group)
        opened = [door for door in found if door["opened"]]
        within = {n: sum(door["sections"] <= n for door in opened) / len(found) for n in (12, 8, 6)}
        low, high = wilson(len(opened), len(found))
        rows.append({
            **dict(zip(ROW, key, strict=True)),
            "n": len(found),
            **{f"opened_{n}": round(share, 3) for n, share in within.items()},
            "low": round(low, 3), "high": round(high, 3),
            "reached_70_deg": round(sum(door["hinge_deg"] >= 70.0 for door in found) / len(found), 3),
            "executed": round(sum(door["executed"] for door in opened) / max(1, len(opened)), 3),
            "median_sections": _median(opened, "sections"),
            "lever_sections": _median(opened, "lever_sections"),
            "pull_sections": _median(opened, "pull_sections"),
            "evaluations": round(float(np.mean([door["evaluations"] for door in found])), 1),
            "cpu_seconds": round(float(np.mean([door["cpu_seconds"] for door in found])), 2),
            "surrogate_seconds": round(float(np.mean([door["surrogate_seconds"] for door in found])), 2),
        })  # fmt: skip
    return rows


def paired(doors: list[dict], one: str, other: str) -> list[dict]:
    """Set two presets beside each other on the doors that both searched; a row for each budget and condition.

    Of n pairs, `sooner` were opened in fewer sections by `one` (a door that stays shut counts as never), `later` by
    `other`, the rest are level; `p` is that of the two-sided sign test: how often chance alone splits them so unevenly.
    """
    found = {(_key(door)): (door["sections"] if door["opened"] else np.inf) for door in doors}
    conditions = sorted({_row(door)[1:] for door in doors if door["preset"] == one})
    rows = []
    for condition in conditions:
        mine = {key[-1]: need for key, need in found.items() if key[:-1] == (one, *condition)}
        pairs = [(need, found[other, *condition, seed]) for seed, need in mine.items()
                 if (other, *condition, seed) in found]  # fmt: skip
        if pairs:
            sooner, later = sum(a < b for a, b in pairs), sum(a > b for a, b in pairs)
            opened = {name: round(float(np.mean(np.isfinite(needs))), 3)
                      for name, needs in zip((one, other), np.transpose(pairs), strict=True)}  # fmt: skip
            p = float(binomtest(sooner, sooner + later).pvalue) if sooner + later else 1.0
            rows.append({**dict(zip(ROW[1:], condition, strict=True)), "n": len(pairs), **opened,
                         "sooner": sooner, "later": later, "p": round(p, 4)})  # fmt: skip
    return rows


def first_sections(seeds: int, trials: int = 15) -> dict[str, list[float]]:
    """Return the lowest cost of eq. (1) [s] after `trials` trials at the shut door, one a seed, for each searcher."""
    task, found = DoorTask(Door(), space=PRESETS["improved"].space, seen=False), {}
    makers = {"twist surrogate, EI": TwistSearch, "paper: PI on c": SkoptSearch, "random": RandomSearch}
    for name, make in makers.items():
        lowest = []
        for seed in progress(range(FIRST_SEED, FIRST_SEED + seeds), description=name):
            searcher = make(make_rng(seed))
            for _ in range(trials):
                c = searcher.ask()
                trial = task.attempt(c)
                searcher.tell(c, trial.cost, trial.time)
            lowest.append(round(min(searcher.costs), 3))
        found[name] = lowest
    return found


def _median(doors: list[dict], name: str) -> float | None:
    return float(np.median([door[name] for door in doors])) if doors else None


def physics(repeats: int = 10) -> dict:
    """Return seconds of one core, least of `repeats`: a step, a trial of 4 s, restoring against replaying sections."""
    task = DoorTask(Door())
    simulation = task.simulation

    def least(action: Callable[[], object]) -> float:
        return cpu_seconds({"": action}, repeats)[""]

    simulation.restore(task.here)
    steps = 2000
    step = least(lambda: mujoco.mj_step(simulation.model, simulation.data, steps)) / steps
    here = task.start
    full = least(lambda: (simulation.restore(task.here), simulation.begin(),
                          simulation.follow(task.targets(simulation.joints, here, here))))  # fmt: skip
    rows = {"steps_per_second": 1 / step, "trial_of_4_s": full, "times_real_time": 4.0 / full}
    rows["physics_share"] = steps * step / full
    rng = make_rng(FIRST_SEED)
    moves = [rng.uniform(-1, 1, 5) for _ in range(5)]
    trial = least(lambda: task.attempt(moves[0]))
    rows["trial"] = trial
    for sections in (1, 3, 5):
        fresh = DoorTask(Door())
        start = fresh.here

        def replay(fresh=fresh, start=start, sections=sections) -> None:
            fresh.simulation.restore(start)
            for c in moves[:sections]:
                fresh._move(c)

        rows[f"replay_{sections}"] = least(replay)
        rows[f"restore_{sections}"] = least(lambda fresh=fresh, start=start: fresh.simulation.restore(start))
    return rows
