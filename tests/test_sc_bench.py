"""The benchmark of paper 4: its rows, what they must hold, and its record."""

import pytest

from tutorialbot import bench, sc_bench


def test_a_step_is_compared_with_damped_least_squares():
    rows = {row["method"]: row for row in sc_bench.steps(1, 20)}
    assert rows[sc_bench.BASE]["times"] == 1.0 and len(rows) == 7
    for row in rows.values():
        ratio = row["microseconds"] / rows[sc_bench.BASE]["microseconds"]
        assert row["times"] == pytest.approx(ratio, rel=0.05, abs=0.01)


def test_the_direction_is_exact_at_every_angle_of_the_elbow():
    rows = sc_bench.exactness(200)
    assert [row["q4"] for row in rows] == ["any", 1e-3, 1e-9, 0.0]
    assert all(row["residual"] < 1e-9 and row["damped"] < 40 for row in rows)
    assert all(row["elbow_rate_per_twist"] < 30.0 for row in rows)


def test_peaks_are_those_of_the_closed_form():
    rows = sc_bench.peaks()
    assert len(rows) == 10 and all(row["ratio"] == pytest.approx(1.0, abs=0.05) for row in rows)


def test_paths_are_rounded(monkeypatch):
    row = next(sc_bench.stretch.table(dt=1e-2))
    monkeypatch.setattr(sc_bench.stretch, "table", lambda speed: iter([row]))
    (found,) = sc_bench.five_paths()
    assert found["peak_rate"] == round(row["peak_rate"], 3) and found.keys() == row.keys()


def test_moving_base_letting_go_and_workspace_have_their_rows():
    line = {row["method"]: row for row in sc_bench.together()}
    assert line["base inside"]["error"] < 1.0 and line["fixed split"]["error"] > 80.0
    ways = {row["way"]: row for row in sc_bench.release()}
    assert ways["base inside"]["off_at_the_end"] > 99.0 and ways["singularity-consistent"]["flipped"]
    space = sc_bench.workspace()
    assert space[0]["volume"] == 100.0 and space[-1]["volume"] < 80.0
    (swap,) = sc_bench.swaps(50)
    assert swap["bodies_moved"] < 1e-12 and swap["identity"] < 1e-12


def test_the_passage_has_its_rows():
    kinematic, dynamic = sc_bench.passages(1)
    assert kinematic["passed"] and dynamic["passed"]
    assert kinematic["clearance"] >= 40.0 and kinematic["peak_rate"] <= 2.5 and kinematic["tip_error"] <= 0.1
    assert dynamic["door_gap"] <= 3.0
    assert [row["phase"][0] for row in sc_bench.phases()] == list("abcdefghi")


def test_doors_are_counted(monkeypatch):
    seen = []

    def fake(seeds, **options):
        seen.append(options)
        return iter(real([1000, 1001], searched=options["searched"]))

    real = sc_bench.pass_random_doors
    monkeypatch.setattr(sc_bench, "pass_random_doors", fake)
    rows = sc_bench.doors(2)
    assert [row["passed"] for row in rows] == [2] * 5 and all(row["low"] < row["high"] == 1.0 for row in rows)
    assert [options["opening_deg"] for options in seen] == [70, 70, 70, 60, 55]


def test_the_benchmark_writes_a_record(tmp_path, monkeypatch, capsys):
    for name in ("exactness", "peaks", "together"):
        monkeypatch.setattr(sc_bench, name, {
            "exactness": lambda: [{"q4": "any", "residual": 3e-15}], "peaks": lambda: [{"n": 1, "ratio": 1.004}],
            "together": lambda: [{"method": "base inside", "error": 0.07}, {"method": "fixed split", "error": 251.5}],
        }[name])  # fmt: skip
    runs = [{"run": "kinematic", "times_real_time": 151.0}]
    runs += [{"run": "dynamic", "times_real_time": 61.0, "door_gap": 1.9}]
    monkeypatch.setattr(sc_bench, "passages", lambda: runs)
    monkeypatch.setattr(sc_bench, "doors", lambda count: [{"way_points": "searched", "passed": 3, "doors": count}])
    for name in ("five_paths", "release", "workspace", "swaps", "phases"):
        monkeypatch.setattr(sc_bench, name, lambda: [{"what": "something"}])
    monkeypatch.setattr(sc_bench, "steps", lambda: [{"method": "singularity-consistent", "times": 1.08}])
    assert bench.main(["sc", "--out", str(tmp_path / "sc.json")]) == 0
    said = capsys.readouterr().out
    assert "costs 1.08 times" in said and "by 0.07 mm where a fixed split loses 252 mm" in said
    assert "151 times as fast as it runs, 61 times with MuJoCo" in said and "3 of 100 random doors" in said
    record = bench.RunRecord.load(tmp_path / "sc.json")
    assert record.values["summary"] in said and record.seed == sc_bench.FIRST_SEED
