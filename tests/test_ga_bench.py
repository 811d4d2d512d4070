"""Paper 2's benchmark: its targets, its arithmetic, and that an interrupted study goes on."""

import numpy as np
import pytest

from tutorialbot import bench, ga_bench
from tutorialbot.ga_bench import METHODS, SETS, TILT, Case, one_target, study, study_cases, summarise, targets
from tutorialbot.ik import genetic
from tutorialbot.measuring import cpu_seconds


def entry(method, index, optimal, excess, name="table 1", seeds=4):
    return {
        "method": method, "targets": name, "seeds": seeds, "target": index, "position": [0.3, 0.1, 0.0],
        "tilt": [*TILT], "within_1_mm": seeds, "optimal": optimal, "excess": excess, "z": [0.0] * 4,
        "evaluations": 100.0, "milliseconds": 2.0 + index,
    }  # fmt: skip


def test_the_targets_are_what_they_say():
    assert [len(targets(name)) for name in SETS] == [7, 20, 55]
    assert targets("table 1")[0].position == (0.2, 0.1, 0.0) and targets("table 1")[0].tilt == TILT
    for target in targets("fresh"):
        assert np.abs(target.position_error[:2]).max() < 1e-5 and np.abs(target.tilt_error).max() < 1e-5
        assert target.tilt == TILT
    lifted = [target.position_error[2] > 1e-3 for target in targets("fresh")]
    assert 3 < sum(lifted) < 17  # some in reach, some not
    assert len({target.tilt for target in targets("random")}) == 55
    assert max(np.abs(target.position_error).max() for target in targets("random")) < 1e-6


def test_shares_add_up_over_targets():
    entries = [entry("paper", 1, 0, [5.0] * 4), entry("good", 0, 4, [0.0, 0.1, 0.2, 0.3]),
               entry("good", 1, 3, [0.0, 0.1, 0.2, 9.0])]  # fmt: skip
    good, paper = summarise(entries)
    assert (good["method"], good["n"], good["optimal"], good["within_1_mm"]) == ("good", 8, 0.875, 1.0)
    assert good["excess_median"] == pytest.approx(0.15) and good["excess_worst"] == 9.0
    assert good["low"] < 0.875 < good["high"] < 1.0 and good["milliseconds"] == 2.5
    assert (paper["n"], paper["optimal"], paper["low"]) == (4, 0.0, 0.0)


def test_one_target_counts_what_is_at_the_optimum():
    """Against `solve`, seed by seed; and a plain search is not counted."""
    result = one_target(Case("good", "table 1", 3), 1)
    assert set(result) == set(entry("good", 1, 3, [])) and result["optimal"] == result["within_1_mm"] == 3
    target = targets("table 1")[1]
    alone = [genetic.solve(target.position, target.tilt, seed=ga_bench.FIRST_SEED + i) for i in range(3)]
    np.testing.assert_allclose(result["z"], [1e3 * one.position_error[2] for one in alone], atol=1e-3)
    plain = one_target(Case("paper", "table 1", 3), 1)
    assert plain["optimal"] == 0 and min(plain["excess"]) > 1.0


@pytest.mark.parametrize("method", METHODS)
def test_every_method_gives_a_row(method):
    result = one_target(Case(method, "table 1", 1), 5)
    assert np.isfinite(result["excess"]).all() and min(result["excess"]) > -1e-3
    assert summarise([result])[0]["method"] == method


def test_the_study_begins_with_both_presets_and_names_every_method():
    cases = study_cases(30)
    assert [(case.method, case.targets, case.seeds) for case in cases[:3]] == [
        ("good", "table 1", 30), ("good", "fresh", 30), ("good", "random", 5),
    ]  # fmt: skip
    assert {case.method for case in cases} == set(METHODS)
    assert len({(case.method, case.targets) for case in cases}) == len(cases)
    assert all(case.seeds >= 1 for case in study_cases(1))


def test_an_interrupted_study_goes_on(tmp_path, monkeypatch):
    made = []

    def quick(case, index):
        made.append(index)
        if len(made) == 3:
            raise KeyboardInterrupt
        return entry(case.method, index, 4, [0.0] * 4)

    monkeypatch.setattr(ga_bench, "one_target", quick)
    path, cases = tmp_path / "ga.jsonl", [Case("good", "table 1", 4)]
    with pytest.raises(KeyboardInterrupt):
        study(cases, path, jobs=1)
    assert len(path.read_text().splitlines()) == 1 + 2
    assert sorted(e["target"] for e in study(cases, path, jobs=1)) == list(range(7))
    assert len(made) == 3 + 5  # two kept, one interrupted and made again, four new
    assert study([Case("paper", "table 1", 4)], path, jobs=1)[0]["method"] == "paper"


def test_a_seeded_dense_stroke_is_straighter_than_a_cold_one():
    rows = {(row["stroke"], row["search"], row["points"]): row for row in ga_bench.strokes(1)}
    for name in ga_bench.STROKES:
        assert rows[name, "seeded", 21]["deviation_worst"] < 1.0 < rows[name, "cold", 21]["deviation_worst"]
        assert rows[name, "seeded", 21]["travel"] < rows[name, "cold", 21]["travel"]


def test_speed_rows_are_ratios_of_one_run():
    rows = ga_bench.speed(1)
    for what in ("fitness", "search"):
        group = [row for row in rows if row["what"] == what]
        assert group[0]["times_faster"] == 1.0
        for row in group:
            ratio = group[0]["microseconds"] / row["microseconds"]
            assert row["times_faster"] == pytest.approx(ratio, rel=0.05, abs=0.01)


def test_cpu_seconds_takes_turns():
    calls = []
    least = cpu_seconds({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 2)
    assert calls == ["a", "b", "a", "b"] and set(least) == {"a", "b"} and min(least.values()) >= 0.0


def test_the_benchmark_writes_a_record(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path))
    monkeypatch.setattr(ga_bench, "speed", lambda: [
        {"what": "search", "how": "arrays, side by side", "microseconds": 1.0, "times_faster": 120.0}])  # fmt: skip
    monkeypatch.setattr(ga_bench, "strokes", lambda seeds: [
        {"search": "seeded", "points": 21, "deviation_worst": 0.251}])  # fmt: skip
    monkeypatch.setattr(ga_bench, "one_target", lambda case, index: entry(
        case.method, index, case.seeds if case.method == "good" else 0, [0.0], case.targets, case.seeds))  # fmt: skip
    assert bench.main(["ga", "--seeds", "4", "--rows", "4", "--jobs", "1"]) == 0
    said = capsys.readouterr().out
    assert "at the true optimum in 100.0 % of 108 searches (a plain algorithm: 100.0 % and 0.0 %)" in said
    assert "arrays 120 times as fast" in said and "by 0.25 mm at most" in said
    record = bench.RunRecord.load(tmp_path / "bench" / "ga.json")
    assert record.command == "python3 -m tutorialbot bench ga --seeds 4 --rows 4" and record.values["summary"] in said
    assert len(record.values["rows"]) == 4
