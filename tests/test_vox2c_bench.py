"""The benchmark of paper 3: its arithmetic, its rows, and that an interrupted study goes on."""

import json
import subprocess
import sys

import pytest

from tutorialbot import bench, paths, vox2c_bench
from tutorialbot.paths import ROOT
from tutorialbot.vox2c.experiments import VARIANTS

NAMES = ["octree", "lookup 5 deg"]


def row(name, total, search=None, **changes):
    return {
        "variant": name, "planner": "RRT", "scene": 1, "seed": 0, "sense": 9.0, "map": 0.0, "verify": 0.0,
        "search": total if search is None else search, "repair": 0.0, "total": total, "length": 3.0, "found": True,
        "collided": False, "repaired": False, "solved": True, "verified_against": "boxes", "coal": 0,
    } | changes  # fmt: skip


def entry(number, *rows, runs=1):
    return {"number": number, "runs": runs, "names": NAMES, "rows": list(rows)}


def test_table_2_saves_of_the_summed_times_as_the_paper_does():
    """The paper's own numbers: 1775.8, 8414.2, 1277.2 against 52.7, 361.1, 23.3 ms are 96.2 %."""
    paper = ((1775.8, 52.7), (8414.2, 361.1), (1277.2, 23.3))
    entries = [entry(i, row("octree", 0.9e-3 * slow), row("octree", 1.1e-3 * slow), row("lookup 5 deg", 1e-3 * fast))
               for i, (slow, fast) in enumerate(paper)]  # fmt: skip
    usual, ours = vox2c_bench.table_2([*entries, entry(3, row("octree", 99.0), row("lookup 5 deg", 99.0))])
    assert (ours["saved_percent"], ours["sequence_2"], usual["sequence_1"]) == (96.2, 361.1, 1775.8)
    assert (usual["saved_percent"], usual["times_faster"]) == (0.0, 1.0)


def test_ratios_are_over_problems_that_both_searches_solved():
    entries = [
        entry(0, row("octree", 1.0), row("lookup 5 deg", 1.0)),  # of Table 2: does not count here
        entry(3, row("octree", 2.0), row("lookup 5 deg", 0.2, 0.1, collided=True, repaired=True)),
        entry(4, row("octree", 4.0), row("lookup 5 deg", 0.3, 0.1, coal=2)),
        entry(5, row("octree", 8.0), row("lookup 5 deg", 5.0, found=False, solved=False, coal=-1)),
    ]
    base, ours = vox2c_bench.summarise(entries)
    assert (base["n"], base["search_times"], base["all_in_times"]) == (3, 1.0, 1.0)
    assert (ours["search_times"], ours["all_in_times"]) == (30.0, 12.0)
    assert (ours["found"], ours["collided"], ours["repaired"], ours["solved"], ours["coal"]) == (2, 1, 1, 2, 2)
    assert ours["total"] == pytest.approx(1e3 * 5.5 / 3, abs=1e-3) and ours["verified"] == "boxes"


def test_the_break_even_is_where_the_map_has_paid():
    def shared(each, build):
        return {"queries": 10, "each": each, "map": build, "repaired": 0, "solved": 10}

    found = {("octree", "RRT"): [shared(20e-3, 0.0)], ("voxel test", "RRT"): [shared(1e-3, 0.0)],
             ("lookup 5 deg", "wavefront"): [shared(0.5e-3, 4e-3)]}  # fmt: skip
    rows = {line["method"]: line for line in vox2c_bench._queries(found)}
    ours = rows["lookup 5 deg"]
    assert (ours["query"], ours["times_faster"]) == (0.1, 40.0)
    assert ours["break_even"] == 5  # 4 ms / (1 - 0.1) ms
    assert rows["octree"]["break_even"] is None


def test_one_problem_has_a_row_a_method_and_run():
    (problem,) = vox2c_bench.experiments.problems(1, 4_600_000)
    found = vox2c_bench.one_problem(3, problem, tuple(NAMES), 2)
    assert [line["variant"] for line in found["rows"]] == 2 * NAMES
    assert [line["seed"] for line in found["rows"]] == [0, 0, 1, 1]
    assert all(set(line) == set(row("octree", 1.0)) and line["coal"] == 0 for line in found["rows"])
    json.dumps(found)


def test_an_interrupted_study_goes_on(tmp_path, monkeypatch):
    made = []

    def quick(number, problem, names, runs):
        made.append(number)
        if len(made) == 3:
            raise KeyboardInterrupt
        return {"number": number, "runs": runs, "names": list(names), "rows": []}

    monkeypatch.setattr(vox2c_bench, "one_problem", quick)
    path = tmp_path / "vox2c.jsonl"
    with pytest.raises(KeyboardInterrupt):
        vox2c_bench.study(3, NAMES, path, jobs=1)
    assert len(path.read_text().splitlines()) == 1 + 2
    found = vox2c_bench.study(3, NAMES, path, jobs=1)
    assert [one["number"] for one in found] == list(range(6)) and len(made) == 3 + 4
    assert [one["runs"] for one in found] == [5, 5, 5, 1, 1, 1]
    assert len(vox2c_bench.study(1, NAMES, path, jobs=1)) == 4
    assert len(made) == 3 + 4


def test_maps_are_compared_with_coals_octree():
    rows = vox2c_bench.maps(1, scenes=1)
    assert {line["resolution"] for line in rows} == {1, 5, 10} and len(rows) == 15
    for line in rows:
        base = next(r for r in rows if (r["map"], r["resolution"]) == ("coal, octree", line["resolution"]))
        ratio = base["microseconds"] / line["microseconds"]
        assert line["times_faster"] == pytest.approx(ratio, rel=0.05, abs=0.1)


def test_small_tables_have_their_rows():
    assert [line["joints"] for line in vox2c_bench.joints(1)] == [2, 3, 4, 5, 6, 7]
    made = vox2c_bench.generation(2)
    assert [(line["voxels"], line["labels"]) for line in made][0] == ("cameras", "exact")
    assert made[0]["minutes_30000"] == pytest.approx(30_000 * made[0]["milliseconds"] / 120_000, abs=0.01)
    planners = vox2c_bench.planners(1, "exact map 5 deg")
    assert [line["planner"] for line in planners] == list(vox2c_bench.planning.PLANNERS)
    assert all(line["solved"] == 1 and line["coal"] == 0 for line in planners)
    assert {weights for line in vox2c_bench.forward(1, 1) for weights in [line["weights"]]} == set(
        vox2c_bench.predictors()
    )


def test_variants_without_weights_are_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(vox2c_bench, "WEIGHTS", tmp_path)
    assert not any("predicted" in name for name in vox2c_bench.variants()) and vox2c_bench.predictors() == []
    assert vox2c_bench.forward() == []
    before = vox2c_bench.fingerprint()
    for name in vox2c_bench.methods.PREDICTORS.values():
        (tmp_path / f"{name}.safetensors").write_bytes(b"x")
    assert vox2c_bench.variants() == list(VARIANTS) and vox2c_bench.fingerprint() != before


def test_the_fingerprint_reads_all_that_a_plan_imports():
    """But for checks of arguments, files and bars, which decide no number."""
    code = (
        "import sys, tutorialbot.vox2c.experiments\n"
        "print(*(m.partition('.')[2] for m in sys.modules if m.startswith('tutorialbot.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    rooms = {name.partition(".")[0] for name in done.stdout.split()} - {"errors", "paths", "runs"}
    assert rooms == {room.removesuffix(".py") for room in vox2c_bench.CODE}
    assert all((paths.ROOT / "tutorialbot" / room).exists() for room in vox2c_bench.CODE)


def test_the_benchmark_writes_a_record(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path))
    for name in ("maps", "forward", "generation", "joints"):
        monkeypatch.setattr(vox2c_bench, name, lambda: [{"what": "something", "milliseconds": 1.0}])
    seen = {"method": "some network", "source": "cameras", "pooled": 0.8139, "scenes": 4000}
    monkeypatch.setattr(vox2c_bench, "iou", lambda: [seen, {**seen, "source": "raster", "pooled": 0.7}])
    monkeypatch.setattr(vox2c_bench, "planners", lambda count: [])
    monkeypatch.setattr(vox2c_bench, "many_queries", lambda queries: [
        {"method": "lookup 5 deg", "planner": "wavefront", "queries": queries, "times_faster": 170.0}])  # fmt: skip
    monkeypatch.setattr(vox2c_bench, "one_problem", lambda number, problem, names, runs: {
        "number": number, "runs": runs, "names": list(names),
        "rows": [row(name, 20e-3 if name == "octree" else 1e-3) for name in names]})  # fmt: skip
    monkeypatch.setattr(vox2c_bench, "variants", lambda: NAMES)
    assert bench.main(["vox2c", "--seeds", "4", "--rows", "2", "--jobs", "1"]) == 0
    said = capsys.readouterr().out
    assert "0 collisions by coal on 8 paths verified against the boxes" in said
    assert "20.0 times" in said and "170 times a query" in said
    record = bench.RunRecord.load(tmp_path / "bench" / "vox2c.json")
    assert record.command == "python3 -m tutorialbot bench vox2c --seeds 4 --rows 2"
    assert record.values["summary"] in said and record.values["summary"].startswith("IoU 0.814 from")
