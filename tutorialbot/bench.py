"""Benchmarks: `python3 -m tutorialbot bench NAME` prints ratios, all measured in one run, and writes them as JSON."""

import argparse
import errno
import os
import signal
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil

from tutorialbot import launch, paths
from tutorialbot.errors import InvalidValue, one_of, whole_number
from tutorialbot.runs import RunRecord


def door(options: argparse.Namespace) -> RunRecord:
    """Paper 1: steps, trials and snapshots; then the presets, controls and peers on paired seeds."""
    from tutorialbot import door_bench

    began = time.monotonic()
    physics = door_bench.physics()
    cases = door_bench.study_cases(options.seeds)[: options.rows]
    journal = paths.results() / "bench" / f"door-{paths.source_digest()}.jsonl"
    doors = door_bench.study(cases, journal, options.jobs)
    rows = door_bench.summarise(doors)
    summary = _door_summary({row["preset"]: row for row in rows if _plain(row)})
    pairs = door_bench.paired(doors, "improved", "improved, random")
    first = door_bench.first_sections(max(1, round(0.2 * options.seeds)))
    values = {"summary": summary, "physics": physics, "rows": rows, "pairs": pairs, "first_sections": first}
    values["doors"] = doors
    record = _record(options, door_bench.FIRST_SEED, began, values)
    _print_door(physics, rows)
    if pairs:
        print("\nimproved against improved, random, on the same doors")
        _print_table(pairs)
    for name, lowest in first.items():
        print(f"first section, {name}: median {np.median(lowest):.2f} s of {len(lowest)} seeds")
    print("\n" + summary)
    return record


def ga(options: argparse.Namespace) -> RunRecord:
    """Paper 2: speed ratios; then presets, single operators and peers against the true optimum; then strokes."""
    from tutorialbot import ga_bench

    began = time.monotonic()
    speed = ga_bench.speed()
    _print_table(speed)
    journal = paths.results() / "bench" / f"ga-{paths.source_digest()}.jsonl"
    entries = ga_bench.study(ga_bench.study_cases(options.seeds)[: options.rows], journal, options.jobs)
    rows = ga_bench.summarise(entries)
    print()
    _print_table(rows)
    strokes = ga_bench.strokes(max(1, options.seeds // 3))
    print()
    _print_table(strokes)
    summary = _ga_summary(speed, rows, strokes)
    print("\n" + summary)
    kept = [entry for entry in entries if entry["method"] in ("good", "paper")]  # the others: in the rows
    values = {"summary": summary, "speed": speed, "rows": rows, "strokes": strokes, "entries": kept}
    return _record(options, ga_bench.FIRST_SEED, began, values)


def vox2c(options: argparse.Namespace) -> RunRecord:
    """Paper 3: maps and predictors; Table 2 and further problems; planners; many queries a scene; data and joints."""
    from tutorialbot import vox2c_bench

    began = time.monotonic()
    values = {"maps": vox2c_bench.maps(), "forward": vox2c_bench.forward()}
    journal = paths.results() / "bench" / f"vox2c-{vox2c_bench.fingerprint()}.jsonl"
    names = vox2c_bench.variants()[: options.rows]
    entries = vox2c_bench.study(options.seeds, names, journal, options.jobs)
    values |= {"table_2": vox2c_bench.table_2(entries), "rows": vox2c_bench.summarise(entries)}
    values["planners"] = vox2c_bench.planners(max(2, options.seeds // 10))
    values["many_queries"] = vox2c_bench.many_queries(queries=min(100, max(2, options.seeds)))
    values |= {"generation": vox2c_bench.generation(), "joints": vox2c_bench.joints(), "iou": vox2c_bench.iou()}
    _print_tables(values)
    values["summary"] = _vox2c_summary(values)
    print(values["summary"])
    return _record(options, vox2c_bench.FIRST_SEED, began, values)


def sc(options: argparse.Namespace) -> RunRecord:
    """Paper 4: cost and exactness of a step, five paths, moving base, letting go, workspace, role swap, passage."""
    from tutorialbot import sc_bench

    began = time.monotonic()
    parts = ("steps", "exactness", "peaks", "five_paths", "together", "release", "workspace", "swaps")
    parts += ("passages", "phases")
    values = {name: getattr(sc_bench, name)() for name in parts}
    values["doors"] = sc_bench.doors(min(100, max(2, options.seeds)))
    _print_tables(values)
    values["summary"] = _sc_summary(values)
    print(values["summary"])
    return _record(options, sc_bench.FIRST_SEED, began, values)


def _sc_summary(values: dict) -> str:
    step = next(row for row in values["steps"] if row["method"] == "singularity-consistent")
    worst = max(row["residual"] for row in values["exactness"])
    off = max(abs(row["ratio"] - 1.0) for row in values["peaks"])
    line = {row["method"]: row["error"] for row in values["together"]}
    speed = {row["run"]: row for row in values["passages"]}
    doors = next(row for row in values["doors"] if row["way_points"] == "searched")
    return (
        f"{doors['passed']} of {doors['doors']} random doors are passed without touching them but to hold them; "
        f"the usual passage is computed {speed['kinematic']['times_real_time']:.0f} times as fast as it runs, "
        f"{speed['dynamic']['times_real_time']:.0f} times with MuJoCo, "
        f"whose door is within {speed['dynamic']['door_gap']:.1f} degrees of the plan; "
        f"a singularity-consistent step costs {step['times']:.2f} times a damped-least-squares one, "
        f"its direction is exact to {worst:.0e} and its peak rate within {100 * off:.1f} % of the closed form; "
        f"with the base inside the inverse kinematics the hand errs by {line['base inside']:.2f} mm "
        f"where a fixed split loses {line['fixed split']:.0f} mm"
    )


def _vox2c_summary(values: dict) -> str:
    rows, base = values["rows"], "against asking an octree at every state"
    true = [row for row in rows if row["verified"] == "boxes"]
    blind = [row for row in true if row["method"].startswith(("lookup", "predicted"))]
    best = max(blind, key=lambda row: row["all_in_times"], default=rows[-1])
    learned = [f"{row['all_in_times']:.1f} times with {row['method']}" for row in blind if "predicted" in row["method"]]
    many = max(values["many_queries"], key=lambda row: row["times_faster"])
    collisions, solved = (sum(row[name] for row in true) for name in ("coal", "solved"))
    seen = next((row for row in values["iou"] if row["source"] == "cameras"), None)
    iou = f"IoU {seen['pooled']:.3f} from the cameras' voxels ({seen['scenes']} scenes); " if seen else ""
    return (
        f"{iou}{collisions} collisions by coal on {solved} paths verified against the boxes; {base} the search is "
        f"{best['search_times']:.1f} times and all in {best['all_in_times']:.1f} times as fast with {best['method']} "
        f"({', '.join(learned) or 'no learned weights here'}); {many['times_faster']:.0f} times a query when "
        f"{many['queries']} share a map ({many['method']}, {many['planner']})"
    )


def _ga_summary(speed: list[dict], rows: list[dict], strokes: list[dict]) -> str:
    def share(method: str, name: str, anywhere: bool = False) -> str:
        found = [row for row in rows if row["method"] == method and (row["targets"] == "random") == anywhere]
        n = sum(row["n"] for row in found)
        return f"{100 * sum(row[name] * row['n'] for row in found) / n:.1f} %" if n else "(not run) %"

    n = sum(row["n"] for row in rows if row["method"] == "good" and row["targets"] != "random")
    faster = {row["how"]: row["times_faster"] for row in speed if row["what"] == "search"}
    dense = max(row["deviation_worst"] for row in strokes if (row["search"], row["points"]) == ("seeded", 21))
    return (
        f"x and y within 1 mm in {share('good', 'within_1_mm')} and at the true optimum in {share('good', 'optimal')} "
        f"of {n} searches (a plain algorithm: {share('paper', 'within_1_mm')} and {share('paper', 'optimal')}), for "
        f"targets anywhere in the arm's reach in {share('good', 'optimal', anywhere=True)}; arrays "
        f"{faster['arrays, side by side']:.0f} times as fast as DEAP taken literally; a dense seeded stroke leaves its "
        f"line by {dense:.2f} mm at most"
    )


def _record(options: argparse.Namespace, seed: int, began: float, values: dict) -> RunRecord:
    command = f"python3 -m tutorialbot bench {options.name} --seeds {options.seeds}"
    command += f" --rows {options.rows}" if options.rows else ""
    return RunRecord(options.name, command, seed, "paper", round(time.monotonic() - began, 1), values)


def _door_summary(rows: dict[str, dict]) -> str:
    best, literal = rows["improved"], rows["paper"]
    within = {n: f"{100 * best[f'opened_{n}']:.0f} %" for n in (12, 8)}
    return (
        f"{within[12]} of {best['n']} doors opened within 12 sections (95 % interval {100 * best['low']:.0f}-"
        f"{100 * best['high']:.0f} %), {within[8]} within 8; the paper read literally opened "
        f"{100 * literal['opened_12']:.0f} % of {literal['n']} (the paper says more than half)"
    )


def _plain(row: dict) -> bool:
    return (row["trials"], row["stiffness"], row["noise"], row["spindle_radius"]) == (15, 0.12, False, 0.42)


def _print_door(physics: dict, rows: list[dict]) -> None:
    print(f"steps a second   {physics['steps_per_second']:9.0f}")
    print(
        f"a trial of 4 s   {physics['trial_of_4_s']:9.4f} s of one core, {physics['times_real_time']:.0f} x real time"
    )
    print(f"MuJoCo's share   {physics['physics_share']:9.2f}")
    for sections in (1, 3, 5):
        replay, restore = physics[f"replay_{sections}"], physics[f"restore_{sections}"]
        ratio = (replay + physics["trial"]) / (restore + physics["trial"])
        print(f"after {sections} sections a trial with replay costs {ratio:.1f} x one with a snapshot", end=" ")
        print(f"({1e3 * replay:.1f} ms against {1e3 * restore:.3f} ms)")
    shown = ("preset", "trials", "stiffness", "noise", "spindle_radius", "n", "opened_12", "low", "high", "opened_8",
             "opened_6", "median_sections", "evaluations", "cpu_seconds", "surrogate_seconds", "executed")  # fmt: skip
    print()
    _print_table([{name: row[name] for name in shown} for row in rows])


def _print_tables(values: dict[str, list[dict]]) -> None:
    for name, rows in values.items():
        if rows:
            print(name.replace("_", " "))
            _print_table(rows)
            print()


def _print_table(rows: list[dict]) -> None:
    widths = {name: 2 + max(len(name), *(len(str(row[name])) for row in rows)) for name in rows[0]}
    for line in ({name: name for name in widths}, *rows):
        print("".join(f"{line[name]!s:>{width}}" for name, width in widths.items()))


def _must_be_writable(path: Path) -> None:
    """Raise InvalidValue when no file can be written at `path`."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise InvalidValue("--out", str(path), f"a file that can be written ({error.strerror})") from None


def _end_now(kept: bool) -> None:
    """End at once, with the workers: a KeyboardInterrupt may be lost in a library, and what is `kept` is on disk.

    joblib's resource tracker stays a moment longer, tidies up and ends by itself.
    """
    told = "what is finished is kept, the same command goes on from there" if kept else "nothing is kept"
    print(f"\ninterrupted: {told}", file=sys.stderr, flush=True)
    for child in psutil.Process().children():
        with suppress(psutil.Error):
            if "resource_tracker" not in " ".join(child.cmdline()):
                child.kill()
    os._exit(130)


BENCHMARKS = {name: globals()[name] for name in launch.BENCHMARKS}
SEEDS = {"door": 100, "ga": 30, "vox2c": 200, "sc": 100}


def main(argv: list[str]) -> int:
    """Run the benchmark that argv names; returns the exit status. Raises InvalidValue that lists the benchmarks for any
    other name, and for numbers out of range.

    Ended by Ctrl-C or a polite kill, it keeps what is finished, and the same command goes on from there; "sc", which
    has no journal, begins anew.
    """
    parser = argparse.ArgumentParser(prog="python3 -m tutorialbot bench", description=__doc__)
    parser.add_argument("name", help="one of: " + ", ".join([*sorted(BENCHMARKS), "all"]))
    parser.add_argument("--seeds", type=int, help=f"of the main rows, the others get less (default: {SEEDS})")
    parser.add_argument("--rows", type=int, help="only the first rows of the study, at least 2 (default: all)")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, help="JSON file to write (default: results/bench/NAME.json)")
    options = parser.parse_args(argv)
    if one_of("name", options.name, [*BENCHMARKS, "all"]) == "all":
        if options.out is not None:
            raise InvalidValue("--out", str(options.out), "nothing beside 'all': each benchmark has a file of its own")
        return max(main([name, *(part for part in argv if part != "all")]) for name in BENCHMARKS)
    run = BENCHMARKS[options.name]
    options.seeds = SEEDS[options.name] if options.seeds is None else options.seeds
    whole_number("--seeds", options.seeds, 1), whole_number("--jobs", options.jobs, 1)
    if options.rows is not None:
        whole_number("--rows", options.rows, 2)
    out = options.out or paths.results() / "bench" / f"{options.name}.json"
    _must_be_writable(out)  # now, not after an hour
    for ending in (signal.SIGINT, signal.SIGTERM):
        signal.signal(ending, lambda *_: _end_now(kept=options.name != "sc"))
    path = run(options).save(out)
    print(f"written: {path}", file=sys.stderr)
    return 0
