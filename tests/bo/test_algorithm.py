"""Algorithm 1's two loops alone, line by line, in a world of arithmetic: no physics, no surrogate, no chance."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from tutorialbot.bo import search as module
from tutorialbot.bo.objective import Trial, new_pose_cost, paper_cost
from tutorialbot.bo.optimizers import RandomSearch
from tutorialbot.bo.presets import PRESETS, Preset
from tutorialbot.bo.search import GO_ON_LIMIT, open_door, search
from tutorialbot.errors import BrokenFile
from tutorialbot.scene.door import Door
from tutorialbot.scene.simulation import Settings

HALF = 0.5  # of a direction is what the hand of this world really goes


class World:
    """A hand in free space that goes half as far as it is told; `made` holds every world, the last one last."""

    made: list = []

    def __init__(self, door, **options):
        self.options, self.space, self.start = options, options["space"], pin.SE3.Identity()
        self.simulation = SimpleNamespace(hinge_angle=0.0, lever_angle=0.0)
        self.kept, self.before, self.count = [], [], 0
        self.poses, self.sections_done = [self.start], 0  # what a cost of the package looks at
        World.made.append(self)

    def attempt(self, c):
        self.count += 1
        translation, rotation = self.space.motion(c)
        settled = self.start * pin.SE3(pin.exp3(HALF * rotation), HALF * translation)
        time = 0.1 * self.count
        cost = self.options["cost"](time, self.start, settled, self)
        return Trial(c, time, "finished", self.start, settled, settled, cost)

    def commit(self, c):
        trial = self.attempt(c)
        self.before.append(self.start)
        self.start = trial.settled
        self.kept.append(c)
        return trial

    def undo(self):
        self.start = self.before.pop()
        self.kept.pop()


class Listener(RandomSearch):
    """Remembers what it was told, and holds the second point of it to be the best."""

    made: list = []

    def __init__(self, rng):
        super().__init__(rng)
        self.asked = []
        Listener.made.append(self)

    def ask(self):
        self.asked.append(super().ask())
        return self.asked[-1]

    def best(self):
        return self.points[1]


@pytest.fixture(autouse=True)
def arithmetic(monkeypatch):
    monkeypatch.setattr(module, "DoorTask", World)
    World.made.clear(), Listener.made.clear()


def finish(**options):
    steps = search(Door(), seed=7, **options)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def by_height(time, start, settled, world):
    """A cost that is below the limit of rejection everywhere, and differs from trial to trial."""
    return -2.0 - settled.translation[2]


IMPROVED = replace(PRESETS["improved"], make=Listener, cost=by_height)


def test_the_task_gets_what_the_preset_and_the_seed_say():
    settings = Settings(force_noise=1.0)
    finish(preset=replace(IMPROVED, settings=settings), trials_per_section=2, max_sections=1)
    options = World.made[-1].options
    assert (options["settings"], options["space"], options["cost"]) == (settings, IMPROVED.space, by_height)
    assert options["seed"] == 7


def test_a_section_ends_at_the_estimated_best_not_at_the_lowest_cost():
    (section,) = finish(preset=Preset("mine", Listener, by_height), trials_per_section=8, max_sections=1).sections
    assert np.array_equal(section.moves[0].c, section.trials[1].c)
    assert section.trials[1].cost > section.best_so_far[-1]


def test_the_optimiser_hears_of_every_trial_and_each_section_has_its_own():
    run = finish(preset=IMPROVED, trials_per_section=9, max_sections=3)
    assert len(Listener.made) == 3
    for section, listener in zip(run.sections, Listener.made, strict=True):
        assert np.array_equal(listener.points, [trial.c for trial in section.trials])
        assert listener.costs == [trial.cost for trial in section.trials]


def test_every_third_trial_repeats_what_really_happened_in_the_furthest_one(monkeypatch):
    """The hand of this world drifts: so what happened is another direction than what was asked for."""

    class Drifting(World):
        def attempt(self, c):
            trial = super().attempt(c)
            drift = pin.SE3(pin.exp3(np.array([0.0, 0.0, 0.3])), np.array([0.0, 0.03, 0.0]))
            return replace(trial, settled=trial.settled * drift)

    monkeypatch.setattr(module, "DoorTask", Drifting)
    run = finish(preset=replace(IMPROVED, warm_start=False), trials_per_section=8, max_sections=1)
    trials, space, asked = run.sections[0].trials, IMPROVED.space, Listener.made[0].asked
    own = [any(np.array_equal(trial.c, c) for c in asked) for trial in trials]
    assert [i for i, mine in enumerate(own) if not mine] == [3, 6]
    for i in (3, 6):
        furthest = max(trials[:i], key=lambda t: module.so4_distance(t.start, t.settled))
        assert trials[i].c == pytest.approx(space.point(*space.moved(furthest.start, furthest.settled)))


def test_what_has_been_tried_or_did_not_pay_is_not_repeated():
    """Without drift the furthest trial was asked for; with a cost above zero nothing has moved."""
    for cost in (by_height, lambda *_: 0.5):
        finish(preset=replace(IMPROVED, warm_start=False, cost=cost), trials_per_section=6, max_sections=1)
        assert len(Listener.made[-1].asked) == 6


def test_a_section_begins_with_what_ended_the_last_one_and_a_neighbour_of_it():
    run = finish(preset=replace(IMPROVED, replay=False), trials_per_section=5, max_sections=3)
    for last, section in zip(run.sections, run.sections[1:], strict=False):
        first, second, third = (trial.c for trial in section.trials[:3])
        assert np.array_equal(first, last.moves[-1].c)
        assert 0.0 < np.abs(second - first).max() < 0.8 and np.abs(second).max() <= 1.0
        assert any(np.array_equal(third, c) for listener in Listener.made for c in listener.asked)


def test_the_trajectory_holds_the_end_of_each_move_and_the_time_it_took():
    run = finish(preset=IMPROVED, trials_per_section=4, max_sections=3)
    moves = [move for section in run.sections for move in section.moves]
    assert run.trajectory.times == pytest.approx(np.cumsum([0.0, *(move.time for move in moves)]))
    for pose, move in zip(run.trajectory.poses[1:], moves, strict=True):
        assert pose == move.settled
    assert run.evaluations == 12


def test_going_on_repeats_the_motion_while_it_pays_and_no_longer():
    preset = replace(IMPROVED, go_on=True)
    run = finish(preset=preset, trials_per_section=3, max_sections=1)
    assert len(run.sections[0].moves) == 1 + GO_ON_LIMIT
    tiring = replace(preset, cost=lambda time, start, settled, world: -2.0 if len(world.kept) < 3 else -0.9)
    assert len(finish(preset=tiring, trials_per_section=3, max_sections=1).sections[0].moves) == 3


def test_a_move_taken_back_leaves_the_trajectory_too():
    """After the first move everything costs 1: three sections are rejected, and the hand is back at its start."""
    once = replace(IMPROVED, cost=lambda time, start, settled, world: 1.0 if world.kept else -2.0)
    run = finish(preset=once, trials_per_section=3, max_sections=4)
    assert [len(section.moves) for section in run.sections] == [1, 0, 0, 0]
    assert len(run.trajectory.poses) == 1 and World.made[-1].start == pin.SE3.Identity()
    assert len(Listener.made) == 2  # the rejected sections share one: it goes on learning


def test_presets_are_what_the_paper_and_the_notebook_say():
    paper, improved = PRESETS["paper"], PRESETS["improved"]
    assert (paper.space.reach, paper.space.rotation_max, paper.space.frame) == (0.15, np.pi, "world")
    assert (paper.cost, paper.warm_start, paper.replay, paper.reject_above) == (paper_cost, False, False, np.inf)
    searcher = paper.make(np.random.default_rng(0))
    assert searcher._optimizer.acq_func == "PI" and searcher._optimizer._initial_samples is None
    assert searcher._optimizer._n_initial_points == 4
    assert (improved.space.rotation_max, improved.space.frame) == (np.pi / 2, "tool")
    assert (improved.cost, improved.warm_start, improved.replay, improved.reject_above) == (
        new_pose_cost, True, True, -0.5,
    )  # fmt: skip
    for name in ("random", "skopt", "cmaes", "optuna"):  # controls and peers differ in the optimiser alone
        assert replace(PRESETS[f"improved, {name}"], make=improved.make, name="improved") == improved
        if name != "skopt":
            assert replace(PRESETS[f"paper, {name}"], make=paper.make, name="paper") == paper


# --- the journal ------------------------------------------------------------------------------------------------------
GATE = """<mujoco><worldbody><body>
<joint name="h"/><geom size=".1"/><site name="g" pos="0 0 {height}"/></body></worldbody></mujoco>"""
ARGUMENTS = {"seed": 7, "trials_per_section": 3, "max_sections": 1}


@pytest.fixture
def results(tmp_path, monkeypatch):
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path))
    return tmp_path


def journal_name(door, preset, **changes):
    journal = module._journal(door, preset, {**ARGUMENTS, **changes})
    journal.close()
    return journal.path.name


def test_whatever_decides_a_result_decides_the_journals_name(results, monkeypatch):
    improved, gate = PRESETS["improved"], results / "gate.xml"
    gate.write_text(GATE.format(height=1.0))
    other = Door.from_mjcf(gate, hinge="h", grip="g")
    names = [
        journal_name(Door(), improved),
        journal_name(Door(mass=13.0), improved),
        journal_name(Door(), improved, seed=8),
        journal_name(Door(), improved, trials_per_section=4),
        journal_name(Door(), replace(improved, settings=Settings(stiffness=0.3))),
        journal_name(Door(), replace(improved, space=replace(improved.space, reach=0.2))),
        journal_name(Door(), PRESETS["improved, random"]),
        journal_name(other, improved),
    ]
    gate.write_text(GATE.format(height=1.1))
    names.append(journal_name(other, improved))
    monkeypatch.setattr(module.paths, "source_digest", lambda: "other code")
    names.append(journal_name(Door(), improved))
    assert len(set(names)) == len(names)


def test_a_trial_made_at_another_point_is_not_taken(results):
    journal = module._journal(Door(), PRESETS["improved"], ARGUMENTS)
    pose = pin.SE3.Identity()
    journal.append(Trial(np.zeros(5), 1.0, "finished", pose, pose, pose, -1.0).to_json())
    assert module._recall(journal, 0, np.zeros(5)).time == 1.0
    assert module._recall(journal, 1, np.zeros(5)) is None
    with pytest.raises(BrokenFile, match="trial 1 was made at another point: delete"):
        module._recall(journal, 0, np.full(5, 0.1))


def test_the_same_search_twice_at_a_time_runs_twice_and_says_so(results):
    random = replace(PRESETS["improved, random"], cost=paper_cost)
    with module._journal(Door(), random, ARGUMENTS) as first:
        before = first.path.read_bytes()
        with pytest.warns(UserWarning, match="another process: this one keeps no journal"):
            run = open_door(Door(), preset=random, **ARGUMENTS)
        assert run.evaluations == 3 and first.path.read_bytes() == before
