"""Paper 3 measured: maps, predictors, planning (Table 2 and many problems more), many queries a scene, data, joints."""

import hashlib
import itertools
import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np

from tutorialbot import paths
from tutorialbot.measuring import cpu_seconds, run_all
from tutorialbot.runs import Journal, RunRecord, progress
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import dataset, experiments, grids, labels, lookup, methods, planning, three_joints
from tutorialbot.vox2c.experiments import FIRST_SEED, RUNS, SEQUENCES, VARIANTS, Problem
from tutorialbot.vox2c.scenes import random_scene

RESOLUTIONS = (1, 5, 10)
SCENES = 20  # of which maps are timed
CHECKS = 200  # random states a scene that coal is asked about
SHARED = (("lookup 5 deg", "wavefront"), ("exact map 5 deg", "wavefront"), ("predicted 5 deg", "wavefront"),
          ("lookup 5 deg", "RRT"), ("voxel test", "RRT"))  # fmt: skip
CODE = ("vox2c", "seeding.py")  # what decides these numbers
WEIGHTS = paths.DATA / "weights"
BASE = "octree"  # what everything is compared with


def predictors() -> list[str]:
    """Return the names of the weights that are there."""
    return sorted(file.stem for file in WEIGHTS.glob("*.safetensors"))


def variants() -> list[str]:
    """Return what is compared, without what needs weights where there are none."""
    there = set(methods.PREDICTORS.values()) <= set(predictors())
    return [name for name, options in VARIANTS.items() if there or options["method"] != "predicted"]


# -- maps and predictors ---------------------------------------------------------------------------------------------


def maps(repeats: int = 5, scenes: int = SCENES) -> list[dict]:
    """Return CPU time [us] of a whole C-space, mean of some scenes, and how many times faster than coal's octree.

    "exact": from boxes; the others from voxels of cameras. coal is asked about CHECKS states a scene, and its time
    multiplied by the cells of the map.
    """
    drawn = [random_scene(seed) for seed in range(FIRST_SEED, FIRST_SEED + scenes)]
    seen = [grids.voxelize(scene) for scene in drawn]
    states = make_rng(FIRST_SEED).uniform(-np.pi, np.pi, (CHECKS, 2)).tolist()
    tests = {"coal, boxes": [labels.coal_test(scene) for scene in drawn],
             "coal, octree": [labels.coal_octree_test(voxels) for voxels in seen]}  # fmt: skip
    actions: dict[str, Callable] = {name: partial(_ask, some, states) for name, some in tests.items()}
    for degrees in RESOLUTIONS:
        actions |= {
            f"exact {degrees}": partial(_each, labels.exact_cspace, drawn, degrees),
            f"octree's map, compiled {degrees}": partial(_each, labels.octree_cspace, seen, degrees),
            f"lookup {degrees}": partial(_each, lookup.lookup_cspace, seen, degrees),
        }
    for action in actions.values():
        action()  # compiled, and tables built
    least, rows = cpu_seconds(actions, repeats), []
    for degrees in RESOLUTIONS:
        cells = labels.cells(degrees) ** 2
        coal = {name: least[name] / scenes / CHECKS * cells for name in tests}
        ours = {name[: -len(str(degrees)) - 1]: least[name] / scenes for name in actions if name not in tests
                and name.rsplit(" ", 1)[1] == str(degrees)}  # fmt: skip
        for name, seconds in {**coal, **ours}.items():
            rows.append({"map": name, "resolution": degrees, "microseconds": round(1e6 * seconds, 2),
                         "times_faster": round(coal["coal, octree"] / seconds, 1)})  # fmt: skip
    return rows


def _each(function: Callable, things: list, degrees: int) -> None:
    for thing in things:
        function(thing, degrees)


def _ask(tests: list[Callable], states: list) -> None:
    for test in tests:
        for theta1, theta2 in states:
            test(theta1, theta2)


def forward(repeats: int = 3, scenes: int = 10) -> list[dict]:
    """Return CPU time [ms] of one prediction on one core, mean, for all weights and the resolutions they know."""
    if not predictors():
        return []
    from tutorialbot.vox2c import checkpoints, network  # bring torch

    checkpoints.use_threads(1)  # several that wait for each other count as time, too
    rows = []
    for name, degrees in itertools.product(predictors(), RESOLUTIONS):
        model = network.load(name)
        size = getattr(getattr(model, "design", None), "size", 32)
        if getattr(model, "resolution_deg", degrees) != degrees:
            continue
        source = "raster" if "raster" in name else "cameras"
        seen = [grids.voxelize(random_scene(FIRST_SEED + i), source, size) for i in range(scenes)]
        _each(model.predict, seen, degrees)
        least = cpu_seconds({name: partial(_each, model.predict, seen, degrees)}, repeats)[name]
        rows.append({"weights": name, "resolution": degrees, "milliseconds": round(1e3 * least / scenes, 3)})
    return rows


def iou() -> list[dict]:
    """Return what the records of all weights say of their IoU on fresh scenes, a row a method: see compare.table."""
    return [row for name in predictors() for row in RunRecord.load(WEIGHTS / f"{name}.json").values["evaluation"]]


# -- planning --------------------------------------------------------------------------------------------------------


@cache
def _warm(names: tuple[str, ...], planner: str = "RRT") -> None:
    """Compile and build tables before anything is timed."""
    (one,) = experiments.problems(1, FIRST_SEED - 1000)
    for name in names:
        experiments.run(one, name, 0, planner, coal=False)


def one_problem(number: int, problem: Problem, names: tuple[str, ...], runs: int) -> dict:
    """Plan one problem with all methods, in turns; an entry of the journal with a row a method and run."""
    _warm(names)
    rows = [experiments.run(problem, name, seed) for seed in range(runs) for name in names]
    return {"number": number, "runs": runs, "names": list(names), "rows": rows}


def study(count: int, names: list[str], path: Path, jobs: int = 2) -> list[dict]:
    """Run Table 2's sequences (RUNS runs each) and `count` further problems (one run each); return all entries.

    Each problem is on disk in the journal `path` at once: an interrupt loses none that is ready.
    """
    header = {"study": "vox2c", "first_seed": FIRST_SEED, "source": fingerprint()}
    with Journal(path, header) as journal:
        done = {_key(entry) for entry in journal.entries}
        drawn = experiments.problems(SEQUENCES + count)
        asked = [(i, one, tuple(names), RUNS if i < SEQUENCES else 1) for i, one in enumerate(drawn)]
        keys = {(i, runs, tuple(names)) for i, _, _, runs in asked}
        run_all(one_problem, [item for item in asked if (item[0], item[3], item[2]) not in done], journal, jobs,
                "problems")  # fmt: skip
        return sorted((entry for entry in journal.entries if _key(entry) in keys), key=lambda entry: entry["number"])


def _key(entry: dict) -> tuple:
    return entry["number"], entry["runs"], tuple(entry["names"])


def fingerprint() -> str:
    """Return a hash of what decides these numbers: code, models and weights."""
    digest = hashlib.sha256(paths.source_digest(CODE).encode())
    for file in sorted(WEIGHTS.glob("*.safetensors")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def table_2(entries: list[dict]) -> list[dict]:
    """Return the table of the paper: mean CPU time [ms] of planning in each sequence, and the time saved in all."""
    first, rows = [entry for entry in entries if entry["number"] < SEQUENCES], []
    for name in first[0]["names"] if first else []:
        each = [_mean(entry["rows"], name, "total") for entry in first]
        base = [_mean(entry["rows"], BASE, "total") for entry in first]
        rows.append({
            "method": name, "verified": _row(first[0], name)["verified_against"],
            **{f"sequence_{i}": round(1e3 * ms, 2) for i, ms in enumerate(each, start=1)},
            "saved_percent": round(100 * (1 - sum(each) / sum(base)), 1),
            "times_faster": round(sum(base) / sum(each), 1),
        })  # fmt: skip
    return rows


def _mean(rows: list[dict], name: str, value: str) -> float:
    return float(np.mean([row[value] for row in rows if row["variant"] == name]))


def summarise(entries: list[dict]) -> list[dict]:
    """Return a row a method over the further problems: CPU time [ms] of each stage, mean; counts; ratios to the octree.

    Ratios are of means over problems for which both searches had a path. "collided": of the paths before verification,
    with the true boxes; "coal": states of the final paths that collide with the boxes by coal, over all problems. Only
    what was verified against the boxes is bound to have none: cameras do not see all.
    """
    further = [entry for entry in entries if entry["number"] >= SEQUENCES]
    by_name = {name: [_row(entry, name) for entry in further] for name in (further[0]["names"] if further else [])}
    rows = []
    for name, own in by_name.items():
        both = [(a, b) for a, b in zip(by_name[BASE], own, strict=True) if a["found"] and b["found"]]
        ratio = {value: sum(a[value] for a, _ in both) / max(sum(b[value] for _, b in both), 1e-12)
                 for value in ("search", "total")}  # fmt: skip
        rows.append({
            "method": name, "verified": own[0]["verified_against"], "n": len(own),
            **{stage: round(1e3 * float(np.mean([row[stage] for row in own])), 3)
               for stage in ("map", "search", "verify", "repair", "total")},
            "verify_percent": round(100 * sum(row["verify"] for row in own) / sum(row["total"] for row in own), 1),
            "search_times": round(ratio["search"], 1), "all_in_times": round(ratio["total"], 1),
            **{count: sum(bool(row[count]) for row in own) for count in ("found", "collided", "repaired", "solved")},
            "coal": sum(max(row["coal"], 0) for row in own),
        })  # fmt: skip
    return rows


def _row(entry: dict, name: str) -> dict:
    return next(row for row in entry["rows"] if row["variant"] == name)


def planners(count: int = 20, variant: str = "exact map 1 deg") -> list[dict]:
    """Return a row a planner on the same map: CPU time [ms] of its search, how many found a path, mean length [rad]."""
    drawn, rows = experiments.problems(count), []
    for planner in progress(planning.PLANNERS, description="planners"):
        _warm((variant,), planner)
        found = [experiments.run(one, variant, 0, planner) for one in drawn]
        rows.append({
            "planner": planner, "n": count, "search": round(1e3 * float(np.mean([row["search"] for row in found])), 3),
            **{name: sum(row[name] for row in found) for name in ("found", "collided", "repaired", "solved")},
            "length": round(float(np.mean([row["length"] for row in found])), 2),
            "coal": sum(max(row["coal"], 0) for row in found),
        })  # fmt: skip
    return rows


def many_queries(scenes: int = 3, queries: int = 100) -> list[dict]:
    """Return CPU time [ms] a query when many share one scene's map, and ratios to one octree search a query.

    "break_even": queries a scene from which the map pays against the compiled voxel test.
    """
    ways = [way for way in SHARED if way[0] in variants()]
    asked = list(itertools.islice(_full_scenes(queries), scenes))
    for variant, planner in (*ways, (BASE, "RRT")):
        _warm((variant,), planner)
    found: dict[tuple, list] = {way: [] for way in (*ways, (BASE, "RRT"))}
    for one, (variant, planner) in progress(list(itertools.product(asked, found)), description="many queries"):
        found[variant, planner].append(experiments.shared(one, variant, planner))
    return _queries(found)


def _full_scenes(queries: int):
    for seed in itertools.count(FIRST_SEED):
        drawn = experiments.pairs(seed, queries)
        if len(drawn) == queries:
            yield drawn


def _queries(found: dict[tuple, list]) -> list[dict]:
    base, peer, rows = found[BASE, "RRT"], found["voxel test", "RRT"], []
    for (variant, planner), each in found.items():
        queries = each[0]["queries"]
        ratios = [a["each"] / b["each"] for a, b in zip(base, each, strict=True)]
        build, one = (float(np.mean(values)) for values in zip(*((row["map"], row["each"]) for row in each),
                                                               strict=True))  # fmt: skip
        one -= build / queries
        other = float(np.mean([row["each"] for row in peer]))
        rows.append({
            "method": variant, "planner": planner, "scenes": len(each), "queries": queries,
            "map": round(1e3 * build, 3), "query": round(1e3 * one, 3),
            "times_faster": round(float(np.mean(ratios)), 1), "least": round(min(ratios), 1),
            "break_even": int(np.ceil(build / (other - one))) if other > one else None,
            "repaired": sum(row["repaired"] for row in each), "solved": sum(row["solved"] for row in each),
        })  # fmt: skip
    return rows


# -- data and joints -------------------------------------------------------------------------------------------------


def generation(scenes: int = 100) -> list[dict]:
    """Return CPU time [ms] of a pair of voxels and C-space, without the disk, and minutes for 30,000 on two cores."""
    rows = []
    for source, kind in (("cameras", "exact"), ("cameras", "octree"), ("raster", "exact")):
        recipe = dataset.Recipe(resolution_deg=5, source=source, labels=kind)
        recipe.pair(FIRST_SEED)
        began = time.process_time()
        for seed in range(FIRST_SEED, FIRST_SEED + scenes):
            recipe.pair(seed)
        each = (time.process_time() - began) / scenes
        rows.append({"voxels": source, "labels": kind, "resolution": 5, "milliseconds": round(1e3 * each, 3),
                     "minutes_30000": round(30_000 * each / 60 / 2, 2)})  # fmt: skip
    return rows


def joints(repeats: int = 3) -> list[dict]:
    """Return how the whole C-space at 5 degrees grows with the joints; CPU time [ms] where it was computed."""
    scene = random_scene(FIRST_SEED)
    actions = {2: lambda: labels.exact_cspace(scene, 5), 3: lambda: three_joints.exact_cspace_3(scene, 5)}
    for action in actions.values():
        action()
    least = cpu_seconds(actions, repeats)
    return [{"joints": size.joints, "cells": size.cells, "gigabytes": size.gigabytes,
             "milliseconds": round(1e3 * least[size.joints], 3) if size.joints in least else None}
            for size in three_joints.map_sizes(5)]  # fmt: skip
