"""Algorithm 1: it opens doors, knows nothing of them, repeats itself, and goes on after an interrupt."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from tutorialbot import paths
from tutorialbot.bo.objective import DoorTask, execute, paper_cost
from tutorialbot.bo.optimizers import RandomSearch
from tutorialbot.bo.presets import PRESETS, Preset
from tutorialbot.bo.search import open_door, search
from tutorialbot.scene.door import Door
from tutorialbot.scene.simulation import DoorSimulation

SMALL = {"trials_per_section": 6, "max_sections": 2}


@pytest.fixture(autouse=True)
def own_results(tmp_path, monkeypatch):
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path))


def points(run):
    return np.array([trial.c for section in run.sections for trial in section.trials])


def test_the_path_that_was_found_opens_a_fresh_door():
    """The product of the search is the trajectory: executed alone, it opens; its first half alone does not."""
    run = open_door(Door(), seed=9001)
    assert run.opened
    assert run.hinge_angle >= np.pi / 2
    assert run.evaluations == sum(len(section.trials) for section in run.sections)
    assert execute(Door(), run.trajectory)[0] >= np.pi / 2
    half = replace(run.trajectory, times=run.trajectory.times[:2], poses=run.trajectory.poses[:2])
    assert execute(Door(), half)[0] < np.pi / 2


def test_a_trial_that_opens_the_door_is_kept_whatever_it_costs(tmp_path):
    """The last few degrees are too short a way to be a new pose, so the cost alone would reject them."""
    path = tmp_path / "slide.xml"
    path.write_text("""<mujoco><worldbody><body>
        <joint name="rail" type="slide" axis="0 -1 0" range="0 .6" limited="true"/>
        <geom size=".05" pos="0 .3 1" mass="5" contype="0" conaffinity="0"/><site name="knob" pos="-.06 .3 1"/>
        </body></worldbody></mujoco>""")
    preset = PRESETS["improved"]
    strict = replace(preset, cost=lambda *_: 5.0, settings=replace(preset.settings, open_angle=0.02))
    run = open_door(Door.from_mjcf(path, hinge="rail", grip="knob"), seed=1, preset=strict, max_sections=1)
    assert run.opened and run.sections[-1].moves


def test_same_seed_same_run_and_another_seed_another():
    one, two, other = (open_door(Door(), seed=seed, **SMALL) for seed in (3, 3, 4))
    assert np.array_equal(points(one), points(two))
    assert one.hinge_angle == two.hinge_angle
    assert not np.array_equal(points(one), points(other))


@pytest.mark.parametrize("preset", ["paper", "improved"])
def test_the_search_does_not_look_at_the_door(monkeypatch, preset):
    """With the spectator's angles replaced by nonsense the same trials are made; only the record of angles changes."""
    seen = open_door(Door(), seed=5, preset=preset, **SMALL)
    rng = np.random.default_rng(0)
    monkeypatch.setattr(DoorSimulation, "hinge_angle", property(lambda self: rng.uniform(-9, 9)))
    monkeypatch.setattr(DoorSimulation, "lever_angle", property(lambda self: rng.uniform(-9, 9)))
    blind = open_door(Door(), seed=5, preset=preset, **SMALL)
    assert np.array_equal(points(seen), points(blind))
    assert [t.cost for s in seen.sections for t in s.trials] == [t.cost for s in blind.sections for t in s.trials]


def test_an_interrupt_loses_nothing_and_the_same_call_goes_on(monkeypatch):
    whole = open_door(Door(), seed=6, **SMALL)
    made = []
    attempt = DoorTask.attempt

    def interrupted(self, c):
        if len(made) == 8:
            raise KeyboardInterrupt
        made.append(c)
        return attempt(self, c)

    monkeypatch.setattr(DoorTask, "attempt", interrupted)
    with pytest.raises(KeyboardInterrupt):
        open_door(Door(), seed=6, **SMALL)
    journals = list((paths.results() / "door").glob("*.jsonl"))
    assert len(journals) == 1
    assert len(journals[0].read_text().splitlines()) == 1 + 8

    def counted(self, c):
        made.append(c)
        return attempt(self, c)

    monkeypatch.setattr(DoorTask, "attempt", counted)
    resumed = open_door(Door(), seed=6, **SMALL)
    assert len(made) == whole.evaluations  # eight before the interrupt, the rest after, none twice
    assert np.array_equal(points(whole), points(resumed))
    assert whole.hinge_angle == resumed.hinge_angle
    assert not list((paths.results() / "door").glob("*.jsonl"))


def test_another_call_does_not_take_the_journal(monkeypatch):
    monkeypatch.setattr(DoorTask, "commit", lambda self, c: (_ for _ in ()).throw(KeyboardInterrupt))
    paper = PRESETS["paper"]
    patient = replace(paper, patience=1)
    calls = ((6, Door(), paper), (7, Door(), paper), (6, Door(mass=13.0), paper), (6, Door(), patient))
    for seed, door, preset in calls:
        with pytest.raises(KeyboardInterrupt):
            open_door(door, seed=seed, preset=preset, trials_per_section=3)
    assert len(list((paths.results() / "door").glob("*.jsonl"))) == len(calls)


def test_a_preset_of_ones_own_does_not_take_the_journal_of_its_namesake(monkeypatch):
    """What decides a result is in the name of the journal; a cost or optimiser of one's own keeps none."""
    monkeypatch.setattr(DoorTask, "commit", lambda self, c: (_ for _ in ()).throw(KeyboardInterrupt))
    improved = PRESETS["improved"]
    mine = [replace(improved, **c) for c in ({}, {"cost": paper_cost}, {"replay": False}, {"reject_above": 1.0})]
    for kept, preset in enumerate([*mine, replace(improved, cost=lambda *_: -1.0)], start=1):
        with pytest.raises(KeyboardInterrupt):
            open_door(Door(), seed=6, preset=replace(preset, reject_above=9.0), trials_per_section=4)
        assert len(list((paths.results() / "door").glob("*.jsonl"))) == min(kept, 3)
    with pytest.raises(KeyboardInterrupt):
        open_door(Door(), seed=6, preset=replace(improved, reject_above=8.0), trials_per_section=4)
    assert len(list((paths.results() / "door").glob("*.jsonl"))) == 4


def test_a_results_folder_that_is_none_is_said_and_not_taken_for_another_process(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path / "file"))
    with pytest.raises(ValueError, match="^TUTORIALBOT_RESULTS = "):
        open_door(Door(), seed=6, **SMALL)


@pytest.mark.full
def test_killed_at_any_moment_the_search_goes_on(tmp_path):
    """SIGKILL a search in mid-run, twice; the third call's result is that of an undisturbed run."""
    code = (
        "from tutorialbot.bo.search import open_door; from tutorialbot.scene.door import Door;"
        "run = open_door(Door(), seed=8, trials_per_section=8, max_sections=4);"
        "print(run.evaluations, run.hinge_angle)"
    )
    environment = {
        **os.environ,
        "TUTORIALBOT_RESULTS": str(tmp_path),
        "OMP_NUM_THREADS": "1",
        "PYTHONPATH": str(paths.ROOT),
    }
    for _ in range(2):
        process = subprocess.Popen([sys.executable, "-c", code], env=environment, stderr=subprocess.DEVNULL)
        before = sum(len(path.read_bytes()) for path in tmp_path.glob("door/*.jsonl"))
        deadline = time.monotonic() + 60
        while (
            sum(len(path.read_bytes()) for path in tmp_path.glob("door/*.jsonl")) <= before + 2000
            and time.monotonic() < deadline
        ):
            time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert list(tmp_path.glob("door/*.jsonl"))
    resumed = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    run = open_door(Door(), seed=8, trials_per_section=8, max_sections=4)
    assert resumed.stdout.split() == [str(run.evaluations), str(run.hinge_angle)]


@pytest.mark.full
def test_the_improved_preset_opens_most_doors():
    """At least 7 of 10 fresh seeds; one that opens 95 % fails this once in 900 draws; the seeds are fixed."""
    runs = [open_door(Door(), seed=9100 + i) for i in range(10)]
    assert sum(run.opened for run in runs) >= 7
    opened = next(run for run in runs if run.opened)
    assert max(section.hinge_angle for section in opened.sections) == pytest.approx(np.pi / 2, abs=0.02)


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_every_preset_runs(name):
    run = open_door(Door(), seed=1, preset=name, trials_per_section=6, max_sections=1)
    assert run.preset == name
    assert len(run.sections) == 1
    assert np.isfinite(run.sections[0].best_so_far).all()


def test_a_failed_simulation_never_opens_a_door(monkeypatch):
    """Planted fault: the door is flung open by a velocity that MuJoCo warns of, in every move."""
    follow = DoorSimulation.follow

    def flung(self, targets, stop=True):
        self.data.qvel[self.model.joint("door/hinge").dofadr[0]] = 1e12
        return follow(self, targets, stop=stop)

    task = DoorTask.__init__

    def prepared(self, *args, **kwargs):
        task(self, *args, **kwargs)
        monkeypatch.setattr(DoorSimulation, "follow", flung)

    monkeypatch.setattr(DoorTask, "__init__", prepared)
    run = open_door(Door(), seed=2, preset="paper", trials_per_section=3, max_sections=1)
    assert not run.opened
    assert {trial.outcome for trial in run.sections[0].trials} == {"failed"}
    assert {trial.cost for trial in run.sections[0].trials} == {5.0}


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("seed", -1),
        ("seed", 0.5),
        ("preset", "magic"),
        ("preset", 3),
        ("trials_per_section", 0),
        ("max_sections", -2),
        ("door", "front"),
    ],
)
def test_bad_arguments_are_refused_by_name(argument, value):
    arguments = {"door": Door(), "seed": 1, **SMALL, argument: value}
    with pytest.raises((ValueError, TypeError), match=f"^{argument} = "):
        open_door(arguments.pop("door"), **arguments)


def test_search_is_a_generator_that_can_be_watched_and_stopped():
    steps = search(Door(), seed=1, **SMALL)
    assert next(steps).c.shape == (5,)
    steps.close()


def test_a_dead_end_is_taken_back():
    """A preset that rejects everything after its first move returns to the shut door."""
    run = open_door(
        Door(),
        seed=1,
        preset=Preset("stubborn", PRESETS["improved"].make, cost=_first_move_only, reject_above=-0.5),
        trials_per_section=5,
        max_sections=5,
    )
    assert [len(section.moves) for section in run.sections] == [1, 0, 0, 0, 1]
    assert len(run.trajectory.poses) == 2


def _first_move_only(time, start, settled, path):
    return -1.0 if path.sections_done % 2 == 0 else 1.0


@pytest.mark.parametrize("ceiling", [0.0, np.inf])
def test_the_optimiser_is_told_no_cost_above_the_ceiling(ceiling):
    """And the trials themselves keep what they cost."""
    told = []

    class Listener(RandomSearch):
        def tell(self, c, cost, seconds):
            told.append(cost)
            super().tell(c, cost, seconds)

    run = open_door(Door(), seed=1, preset=replace(PRESETS["improved"], make=Listener, ceiling=ceiling), **SMALL)
    costs = [trial.cost for section in run.sections for trial in section.trials]
    assert max(costs) > 1.0
    assert told == [min(cost, ceiling) for cost in costs]
