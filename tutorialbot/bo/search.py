"""Algorithm 1 of paper 1: section by section, find the direction in which the hand moves longest unhindered."""

import hashlib
import json
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from tutorialbot import paths
from tutorialbot.bo.objective import DoorTask, Trial
from tutorialbot.bo.optimizers import Optimizer
from tutorialbot.bo.presets import Preset, find_preset
from tutorialbot.bo.space import twist_features
from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue, whole_number
from tutorialbot.pose import so4_distance
from tutorialbot.runs import Journal, progress
from tutorialbot.scene.door import Door
from tutorialbot.seeding import make_rng
from tutorialbot.trajectory import PoseTrajectory

GO_ON_LIMIT = 6  # repeats of a committed direction in one section
STILL_MOVES = -1.0  # the cost below which a repeated direction is worth keeping


@dataclass
class Section:
    """One section of the path: its trials, and the moves that were kept (none when the section was rejected).

    hinge_angle and lever_angle [rad] are the spectator's view of the door after the section.
    """

    trials: list[Trial] = field(default_factory=list)
    moves: list[Trial] = field(default_factory=list)
    hinge_angle: float = 0.0
    lever_angle: float = 0.0

    @property
    def best_so_far(self) -> np.ndarray:
        """Lowest cost observed after each trial (n,): the paper's Fig. 6."""
        return np.minimum.accumulate([trial.cost for trial in self.trials])


@dataclass
class DoorRun:
    """What Algorithm 1 found. `trajectory` holds the sections' poses of the hand, to be interpolated; angles in rad."""

    opened: bool
    hinge_angle: float
    sections: list[Section]
    evaluations: int
    trajectory: PoseTrajectory
    preset: str
    seed: int


def search(
    door: Door,
    *,
    seed: int,
    preset: str | Preset = "improved",
    trials_per_section: int = 15,
    max_sections: int = 12,
    journal: Journal | None = None,
) -> Iterator[Trial]:
    """Run Algorithm 1, yielding every trial as it is made; the generator's return value is the `DoorRun`.

    Trials that `journal` already holds are taken from it instead of being simulated. Raises InvalidType or InvalidValue
    for bad arguments, InvalidValue when the robot cannot reach the handle.
    """
    preset = find_preset(preset)
    if not isinstance(door, Door):
        raise InvalidType("door", door, "a tutorialbot.scene.door.Door")
    whole_number("trials_per_section", trials_per_section, 1), whole_number("max_sections", max_sections, 1)
    rng = make_rng(seed)
    task = DoorTask(door, settings=preset.settings, space=preset.space, cost=preset.cost, seed=seed, seen=False)
    poses, times = [task.start], [0.0]
    sections: list[Section] = []
    attempts: list[Trial] = []  # from where the hand is now
    previous: np.ndarray | None = None
    optimizer: Optimizer | None = None
    evaluations = rejected = 0
    opened = False
    while not opened and len(sections) < max_sections:
        section = Section()
        sections.append(section)
        optimizer = optimizer or preset.make(rng)
        for _ in range(trials_per_section):
            c = propose(task, preset, attempts, previous, rng)
            c = optimizer.ask() if c is None else c
            trial = _recall(journal, evaluations, c) or task.attempt(c)
            if journal is not None and evaluations == len(journal.entries):
                journal.append(trial.to_json())
            evaluations += 1
            optimizer.tell(c, min(trial.cost, preset.ceiling), trial.time)
            section.trials.append(trial)
            attempts.append(trial)
            yield trial
            if trial.outcome == "opened":
                break
        c = trial.c if trial.outcome == "opened" else optimizer.best()
        chosen = min(attempts, key=lambda trial: np.linalg.norm(trial.c - c))
        if chosen.outcome == "opened" or chosen.cost <= preset.reject_above:
            optimizer, attempts, previous, rejected = None, [], c, 0
            for move in follow_up(task, c, preset.go_on):
                section.moves.append(move)
                poses.append(task.start)
                times.append(times[-1] + move.time)
                opened = move.outcome == "opened"
        else:
            rejected += 1
            if rejected > preset.patience and len(poses) > 1:  # a dead end: take the last move back
                task.undo()
                poses.pop(), times.pop()
                optimizer, attempts, previous, rejected = None, [], None, 0
        section.hinge_angle, section.lever_angle = task.simulation.hinge_angle, task.simulation.lever_angle
    return DoorRun(
        opened,
        task.simulation.hinge_angle,
        sections,
        evaluations,
        PoseTrajectory(np.array(times), poses),
        preset.name,
        seed,
    )


def propose(
    task: DoorTask, preset: Preset, trials: list[Trial], previous: np.ndarray | None, rng: np.random.Generator
) -> np.ndarray | None:
    """Return a direction (5,) to try without asking the optimiser, or None when it is the optimiser's turn.

    `trials` are those made from where the hand is now. A warm start comes first: the direction that worked last, and a
    neighbour of it. Later, every third trial replays what really moved.
    """
    if preset.warm_start and previous is not None and len(trials) < 2:
        return previous if not trials else np.clip(previous + 0.15 * rng.standard_normal(5), -1.0, 1.0)
    if preset.replay and len(trials) >= 3 and len(trials) % 3 == 0:
        moving = [trial for trial in trials if trial.cost < 0.0]
        if moving:
            furthest = max(moving, key=lambda trial: so4_distance(trial.start, trial.settled))
            c = task.space.point(*task.space.moved(furthest.start, furthest.settled))
            tried = twist_features(np.array([trial.c for trial in trials]))
            if np.linalg.norm(tried - twist_features(c), axis=1).min() > 0.05:
                return c
    return None


def follow_up(task: DoorTask, c: np.ndarray, go_on: bool) -> Iterator[Trial]:
    """Commit the direction c (5,) and, with `go_on`, the motion that it turned out to be, again and again while that
    moves the hand.
    """
    move = task.commit(c)
    yield move
    for _ in range(GO_ON_LIMIT if go_on else 0):
        if move.outcome == "opened":
            return
        c = task.space.point(*task.space.moved(move.start, task.start))
        if task.attempt(c).cost > STILL_MOVES:
            return
        move = task.commit(c)
        yield move


def open_door(
    door: Door,
    *,
    seed: int,
    preset: str | Preset = "improved",
    trials_per_section: int = 15,
    max_sections: int = 12,
    resume: bool = True,
) -> DoorRun:
    """Find the motions that open `door`, an unknown one (paper 1, Algorithm 1).

    seed: whole number >= 0; the same seed gives the same run. preset: "paper", "improved" or another of
    `presets.PRESETS`, or a `Preset`. With `resume`, every finished trial is on disk at once, and after an interrupt the
    same call goes on from there (not for a `Preset` with a cost or an optimiser of your own).

    Returns a `DoorRun`; a door that stays shut is a result, `opened=False`. Raises InvalidValue or InvalidType for bad
    arguments and for a handle out of reach, BrokenFile for a damaged MJCF.
    """
    preset = find_preset(preset)
    arguments = {"seed": seed, "trials_per_section": trials_per_section, "max_sections": max_sections}
    journal = _journal(door, preset, arguments) if resume and isinstance(door, Door) else None
    try:
        with progress(description=f"door, seed {seed}") as bar:
            run = _finish(search(door, preset=preset, journal=journal, **arguments), bar)
        if journal is not None:
            journal.path.unlink()
        return run
    finally:
        if journal is not None:
            journal.close()


def _finish(steps: Iterator[Trial], bar) -> DoorRun:
    """Run the generator to its end, a tick of `bar` for every trial, and return its return value."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        bar.update()


def _journal(door: Door, preset: Preset, arguments: dict) -> Journal | None:
    """Return the journal of this very call, named by what decides its result, the code included; None when another
    process has it, and for a preset with a cost or an optimiser from outside the package, whose code is not known.
    """
    functions = {"make": preset.make, "cost": preset.cost}
    if not all(str(getattr(function, "__module__", "")).startswith("tutorialbot.") for function in functions.values()):
        return None  # a function of somebody else's may change between two calls
    named = {name: f"{function.__module__}.{function.__qualname__}" for name, function in functions.items()}
    settings = {"door": asdict(door), "preset": {**asdict(preset), **named}, **arguments}
    header = {"source": paths.source_digest(), **json.loads(json.dumps(settings, default=str))}
    if door.file is not None and Path(door.file.path).is_file():
        header["file"] = hashlib.sha256(Path(door.file.path).read_bytes()).hexdigest()
    digest = hashlib.sha256(json.dumps(header).encode())
    file = paths.results() / "door" / f"{digest.hexdigest()[:24]}.jsonl"
    try:
        return Journal(file, header)
    except InvalidValue:
        warnings.warn("the same search runs in another process: this one keeps no journal", stacklevel=3)
        return None


def _recall(journal: Journal | None, index: int, c: np.ndarray) -> Trial | None:
    """Return trial number `index` from the journal when it is there; raises BrokenFile when it was not made at c."""
    if journal is None or index >= len(journal.entries):
        return None
    trial = Trial.from_json(journal.entries[index])
    if not np.array_equal(trial.c, c):
        raise BrokenFile(f"{journal.path}: trial {index + 1} was made at another point: delete the file to start anew")
    return trial
