"""Trainings: `python3 -m tutorialbot train NAME` trains a network of paper 3, goes on after a kill, stores weights."""

import argparse
import math
import shlex
import time
from dataclasses import replace
from pathlib import Path

from tutorialbot import paths
from tutorialbot.errors import one_of, positive, whole_number


def vox2c(options: argparse.Namespace, command: str) -> Path:
    """Train the paper's network on the data set, and store its best weights; returns their path."""
    from tutorialbot.vox2c import training

    minutes = math.inf if options.minutes is None else positive("--minutes", options.minutes)
    settings = training.Settings(
        options.resolution,
        options.scenes,
        options.width,
        options.epochs,
        source=options.source,
        kind=options.labels,
        seed=options.seed,
        batch=options.batch,
        round_scenes=options.round,
        mirror=options.mirror,
    )
    training.use_threads(options.threads)
    folder = options.folder / settings.name
    pairs, validation, test = training.pairs(settings, jobs=options.threads)
    for done in training.train(pairs, validation, settings, folder, fresh=options.fresh, minutes=minutes):
        print(
            f"epoch {done.epoch:6.2f}  loss {done.loss:.4f}  validation: loss {done.validation_loss:.4f}, of it "
            f"cross entropy {done.cross_entropy:.4f}, IoU {done.iou:.4f} (scene mean {done.scene_iou:.4f})  "
            f"{done.seconds:.0f} s",
            flush=True,
        )
    return training.finish(settings, folder, command, test, options.out)


def linkframe(options: argparse.Namespace, command: str) -> Path:
    """Train the link-frame predictor that `--preset` names, choose its threshold, store it; returns the path."""
    from tutorialbot.vox2c import linkframe_training as training

    name = one_of("--preset", options.preset, training.PRESETS)
    settings = replace(training.PRESETS[name], seed=options.seed)
    if options.steps is not None:
        settings = replace(settings, steps=whole_number("--steps", options.steps, 1))
    training.use_threads(options.threads)
    folder = options.folder / name
    for done in training.train(settings, folder, fresh=options.fresh):
        print(f"step {done.step:5d}  cross entropy {done.loss:.4f}  {done.seconds:.0f} s", flush=True)
    return training.finish(name, settings, folder, command, options.out)


TRAININGS = {"vox2c": vox2c, "linkframe": linkframe}


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the trainings' options."""
    parser = argparse.ArgumentParser(prog="python3 -m tutorialbot train", description=__doc__)
    parser.add_argument("name", help="one of: " + ", ".join(sorted(TRAININGS)))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2, help="cores to use")
    parser.add_argument("--fresh", action="store_true", help="begin anew instead of going on from the checkpoint")
    parser.add_argument("--out", type=Path, help="folder for the weights (default: results/weights)")
    parser.add_argument("--folder", type=Path, help="folder for the checkpoints (default: results/training)")
    paper = parser.add_argument_group("vox2c, the paper's network")
    paper.add_argument("--resolution", type=int, default=10, help="of the C-space: 1, 5 or 10 degrees")
    paper.add_argument("--scenes", type=int, default=30000, help="size of the data set; it is made when missing")
    paper.add_argument("--width", type=float, default=1.0, help="channels, as a multiple of the paper's")
    paper.add_argument("--epochs", type=int, default=40)
    paper.add_argument("--batch", type=int, default=16)
    paper.add_argument("--round", type=int, default=5000, help="scenes from one checkpoint to the next")
    paper.add_argument("--mirror", action="store_true", help="show half of the scenes mirrored from left to right")
    paper.add_argument("--minutes", type=float, help="stop after so long; the same command goes on from there")
    paper.add_argument("--source", default="cameras", help="of the voxels: cameras or raster")
    paper.add_argument("--labels", default="exact", help="exact or octree")
    frame = parser.add_argument_group("linkframe, the link-frame predictor")
    frame.add_argument("--preset", default="linkframe-raster", help="which one, as its weights are called")
    frame.add_argument("--steps", type=int, help="fewer or more than the preset has")
    return parser


def main(argv: "list[str]") -> int:
    """Run the training that argv names; returns the exit status. Raises InvalidValue for a bad name or option."""
    options = make_parser().parse_args(argv)
    run = TRAININGS[one_of("name", options.name, TRAININGS)]
    whole_number("--threads", options.threads, 1), whole_number("--seed", options.seed)
    options.folder = options.folder or paths.results() / "training"
    options.out = options.out or paths.results() / "weights"
    start = time.monotonic()
    path = run(options, shlex.join(["python3", "-m", "tutorialbot", "train", *argv]))
    print(f"written: {path} after {time.monotonic() - start:.0f} s")
    return 0
