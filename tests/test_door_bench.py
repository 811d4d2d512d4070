"""The benchmark's own arithmetic, and that an interrupted study goes on."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import psutil
import pytest

from tutorialbot import bench, door_bench, paths
from tutorialbot.bo.presets import PRESETS
from tutorialbot.bo.search import DoorRun, Section
from tutorialbot.door_bench import Case, first_sections, paired, study, summarise, wilson
from tutorialbot.runs import RunRecord


def test_wilsons_interval_is_that_of_the_tables():
    """Worked by hand from Wilson's formula for 1 of 10; and it is no single point at 0 and at 100 %."""
    assert wilson(1, 10) == pytest.approx((0.018, 0.404), abs=1e-3)
    assert wilson(0, 20)[0] == 0.0 and wilson(0, 20)[1] == pytest.approx(0.161, abs=1e-3)


def door(seed, opened, sections, preset="improved"):
    return {
        "preset": preset, "seeds": 1, "trials": 15, "stiffness": 0.12, "noise": False, "spindle_radius": 0.42,
        "seed": seed, "opened": opened, "hinge_deg": 90.0 if opened else 75.0, "sections": sections,
        "lever_sections": 2, "pull_sections": sections - 2, "evaluations": 15 * sections,
        "cpu_seconds": 2.0, "surrogate_seconds": 0.5,
        "executed": opened,
    }  # fmt: skip


def test_shares_count_unopened_doors_and_medians_do_not():
    doors = [door(0, True, 6), door(1, True, 8), door(2, True, 11), door(3, False, 12)]
    doors.append(door(0, True, 5, "improved, random"))
    row, control = summarise(doors)
    assert (row["n"], row["opened_12"], row["opened_8"], row["opened_6"]) == (4, 0.75, 0.5, 0.25)
    assert (row["median_sections"], row["reached_70_deg"]) == (8.0, 1.0)
    assert control["n"] == 1


def test_pairs_are_those_of_one_seed_and_one_condition():
    ours = [door(0, True, 6), door(1, True, 8), door(2, False, 12), door(3, True, 5), door(9, True, 3)]
    theirs = [door(seed, *rest, "random") for seed, *rest in
              [(0, True, 7), (1, True, 8), (2, True, 12), (3, False, 12), (8, True, 3)]]  # fmt: skip
    theirs.append({**door(9, True, 6, "random"), "noise": True})
    (row,) = paired([*ours, *theirs], "improved", "random")
    assert (row["n"], row["improved"], row["random"]) == (4, 0.75, 0.75)
    assert (row["sooner"], row["later"], row["p"]) == (2, 1, 1.0)
    many = [door(seed, True, 5) for seed in range(8)] + [door(seed, True, 6, "random") for seed in range(8)]
    assert paired(many, "improved", "random")[0]["p"] == pytest.approx(2 * 0.5**8, abs=1e-4)


def test_first_sections_are_the_same_for_the_same_seeds():
    found = first_sections(2, trials=3)
    assert found == first_sections(2, trials=3)
    assert len(found) == 3 and all(-4.0 <= cost < 0.0 for costs in found.values() for cost in costs)


def test_an_interrupted_study_goes_on(tmp_path, monkeypatch):
    made = []

    def quick(case, seed):
        made.append(seed)
        if len(made) == 3:
            raise KeyboardInterrupt
        return door(seed, True, 6)

    monkeypatch.setattr(door_bench, "one_door", quick)
    path = tmp_path / "door.jsonl"
    with pytest.raises(KeyboardInterrupt):
        study([Case("improved", 5)], path, jobs=1)
    assert len(path.read_text().splitlines()) == 1 + 2
    doors = study([Case("improved", 5)], path, jobs=1)
    assert sorted(entry["seed"] - door_bench.FIRST_SEED for entry in doors) == [0, 1, 2, 3, 4]
    assert len(made) == 3 + 3  # two kept, one interrupted and made again, two new
    assert len(study([Case("improved", 2)], path, jobs=1)) == 2


def test_one_small_door_has_a_full_row():
    result = door_bench.one_door(Case("improved", 1, trials=2), 1)
    assert set(result) == set(door(0, True, 6))
    assert 0.0 < result["surrogate_seconds"] < result["cpu_seconds"]


@pytest.mark.parametrize(
    ("case", "changed"),
    [
        (Case("improved", 1), {}),
        (Case("improved", 1, stiffness=0.3), {"stiffness": 0.3}),
        (Case("paper", 1, noise=True), {"force_noise": 2.0, "torque_noise": 0.3}),
    ],
)
def test_a_case_changes_what_it_says_and_nothing_else(case, changed):
    preset = PRESETS[case.preset]
    assert case.variant() == replace(preset, settings=replace(preset.settings, **changed))


def test_a_row_comes_from_the_search_that_its_case_asks_for(monkeypatch):
    """Planted: the door fell back in the last section, and the path that was found opens no fresh door."""
    asked = []

    def fake(door, **options):
        asked.append((door, options))
        sections = [Section(moves=["kept"], hinge_angle=angle) for angle in (0.01, 1.2, 0.3)]
        return DoorRun(True, 1.6, sections, 12, "path", "improved", 1)
        yield

    monkeypatch.setattr(door_bench, "search", fake)
    for reached, executed in ((1.0, False), (1.6, True)):
        monkeypatch.setattr(door_bench, "execute", lambda door, path, reached=reached: (reached, None))
        row = door_bench.one_door(Case("improved", 1, trials=4, stiffness=0.3, spindle_radius=0.75), 11)
        assert row["executed"] is executed
    door, options = asked[0]
    assert (door.spindle_radius, options["trials_per_section"], options["seed"]) == (0.75, 4, 11)
    assert options["preset"].settings.stiffness == 0.3
    assert row["hinge_deg"] == round(np.rad2deg(1.2), 1)
    assert (row["sections"], row["lever_sections"], row["pull_sections"], row["evaluations"]) == (3, 1, 2, 12)


def test_no_seed_of_the_benchmark_was_tuned_on():
    assert door_bench.FIRST_SEED >= 200


def test_where_nothing_can_be_written_is_said_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setitem(bench.BENCHMARKS, "door", lambda options: pytest.fail("the work began"))
    (tmp_path / "file").touch()
    for out in (tmp_path / "file" / "door.json", tmp_path):
        with pytest.raises(ValueError, match="^--out = .*a file that can be written"):
            bench.main(["door", "--out", str(out)])


def test_all_runs_each_benchmark_with_the_same_options(tmp_path, monkeypatch):
    ran = []
    for name in bench.BENCHMARKS:
        def note(options):
            ran.append((options.name, options.seeds, options.jobs))
            return RunRecord(options.name, "", 0, "quick", 0.0, {}, {})

        monkeypatch.setitem(bench.BENCHMARKS, name, note)
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path))
    monkeypatch.setattr(bench.signal, "signal", lambda *_: None)
    assert bench.main(["all", "--seeds", "3", "--jobs", "1"]) == 0
    assert ran == [(name, 3, 1) for name in bench.BENCHMARKS]
    with pytest.raises(ValueError, match="^--out = .*each benchmark has a file of its own"):
        bench.main(["all", "--out", str(tmp_path / "one.json")])


def test_physics_rows_are_ratios_of_one_run():
    rows = door_bench.physics(repeats=1)
    assert all(np.isfinite(value) and value > 0 for value in rows.values())
    assert rows["replay_5"] > rows["restore_5"]


def test_an_unknown_benchmark_is_refused():
    with pytest.raises(ValueError, match=r"name = 'window': expected one of 'all', 'door'"):
        bench.main(["window"])


@pytest.mark.parametrize(("option", "value"), [("--seeds", "0"), ("--rows", "1"), ("--jobs", "-1")])
def test_numbers_out_of_range_are_refused(option, value):
    with pytest.raises(ValueError, match=f"^{option} = {value}: expected"):
        bench.main(["door", option, value])


@pytest.mark.full
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_an_ended_benchmark_leaves_what_is_finished_and_no_process(tmp_path, ending):
    environment = {**os.environ, "TUTORIALBOT_RESULTS": str(tmp_path), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "tutorialbot", "bench", "door", "--seeds", "20", "--rows", "2"]
    with subprocess.Popen(command, cwd=paths.ROOT, env=environment, stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE, text=True) as process:  # fmt: skip
        deadline = time.monotonic() + 180
        while time.monotonic() < deadline and not any(b"\n{" in p.read_bytes() for p in tmp_path.glob("bench/*.jsonl")):
            time.sleep(0.2)
        family = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(ending)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130 and "the same command goes on from there" in said
    assert len(family) >= 2 and psutil.wait_procs(family, timeout=20)[1] == []
    (journal,) = tmp_path.glob("bench/*.jsonl")
    assert [json.loads(line) for line in journal.read_text().splitlines()][1]["preset"] == "improved"
