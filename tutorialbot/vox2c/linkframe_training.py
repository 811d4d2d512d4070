"""Training of the link-frame predictor in torch; what comes out runs without torch (linkframe.py)."""

import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from tutorialbot.errors import BrokenFile
from tutorialbot.runs import RunRecord
from tutorialbot.vox2c import checkpoints, compare, evaluation, linkframe, weights
from tutorialbot.vox2c.arm import DOMAIN
from tutorialbot.vox2c.checkpoints import use_threads  # noqa: F401 - for whoever trains
from tutorialbot.vox2c.linkframe_data import EVALUATION, VALIDATION, Sample, Scenes, Settings, sample

WARM = 50  # steps until the learning rate is at its full height
EVERY = 100  # steps between checkpoints
VALIDATED = 1000  # scenes on which the threshold is chosen ...
EVALUATED = 4000  # scenes on which the record's IoU is measured ...
RESOLUTION = 5  # ... at this resolution [deg]


class LinkFrameNet(nn.Module):
    """The network of linkframe.py, in torch."""

    def __init__(self, design: linkframe.Design):
        super().__init__()
        self.design = design
        first, end = design.layers
        self.conv1 = nn.Conv2d(end - first, design.filters, 3, padding=1)
        self.conv2 = nn.Conv2d(design.filters, 2 * design.maps, 3, padding=1)
        widths = (len(design.points) * design.maps + linkframe.PHASES, *design.hidden, 1)
        self.links = nn.ModuleList()
        for _ in range(2):
            layers = [nn.Linear(before, after) for before, after in zip(widths, widths[1:], strict=False)]
            self.links.append(nn.Sequential(*[part for layer in layers for part in (layer, nn.ReLU())][:-1]))
        self.register_buffer("points", torch.tensor(design.points, dtype=torch.float32), persistent=False)

    def maps(self, slabs: Tensor) -> Tensor:
        """Return the maps (scenes, 2 maps, size, size) of the read layers, slabs (scenes, layers, size, size)."""
        return self.conv2(functional.relu(self.conv1(slabs)))

    def judge(self, link: int, maps: Tensor, scene: Tensor, poses: Tensor) -> Tensor:
        """Return the logits (g, GROUP) that a link collides, for groups of poses (g, GROUP, 3) in scenes (g,)."""
        x, z, angle = (poses[..., i, None] for i in range(3))
        s, c = torch.sin(angle), torch.cos(angle)
        along, across = self.points[:, 0], self.points[:, 1]
        spots = torch.stack([z + along * c - across * s, x + along * s + across * c], dim=-1)
        grid = 2.0 * spots / (DOMAIN[1][0] - DOMAIN[0][0]) - 1.0
        count = self.design.maps
        own = maps[:, link * count : (link + 1) * count][scene]
        samples = functional.grid_sample(own, grid, align_corners=False, padding_mode="zeros")  # (g, c, GROUP, p)
        samples = samples.permute(0, 2, 3, 1).flatten(2)
        px, pz = (2.0 * math.pi / self.design.cell * value for value in (x, z))
        terms = [s, c, torch.sin(2 * angle), torch.cos(2 * angle), torch.sin(4 * angle), torch.cos(4 * angle)]
        terms += [torch.sin(px), torch.cos(px), torch.sin(pz), torch.cos(pz)]
        return self.links[link](torch.cat([samples, *terms], dim=-1))[..., 0]


def step_loss(model: LinkFrameNet, data: Sample) -> Tensor:
    """Return the mean cross entropy over both links' postures."""
    maps = model.maps(data.slabs)
    total, count = 0.0, 0.0
    for link, (scene, poses, truth, weight) in enumerate(data.links):
        if len(scene) == 0:
            continue
        logits = model.judge(link, maps, scene, poses)
        total = total + functional.binary_cross_entropy_with_logits(logits, truth, weight, reduction="sum")
        count += float(weight.sum())
    return total / max(count, 1.0)


SHELL = linkframe.Design(outset=0.02, spread=1)  # shells lack undersides: what is near is looked at too
FINE = linkframe.Design(size=64, along=(-0.075, 0.525, 13), across=(-0.075, 0.075, 6))
# Octree labels need no network: the cull without outset is the answer (a test shows it). With a wider one there is
# something to learn.
PRESETS = {
    "linkframe-raster": Settings(linkframe.Design()),
    "linkframe-shell": Settings(SHELL, source="cameras", start="linkframe-raster", rate=1.5e-3, steps=700, fresh=32),
    "linkframe-raster64": Settings(FINE, steps=900, scenes=64, fresh=32),
    "linkframe-octree": Settings(SHELL, kind="octree", steps=1500),
}


@dataclass(frozen=True)
class Report:
    """Where a training stands: steps done, the mean cross entropy since the last report, seconds of the whole run."""

    step: int
    loss: float
    seconds: float


def begin(settings: Settings) -> LinkFrameNet:
    """Return the network before the first step: random by the seed, or the weights that `settings.start` names."""
    with torch.random.fork_rng():
        torch.manual_seed(settings.seed)
        model = LinkFrameNet(settings.design)
    if settings.start:
        stored = weights.load(settings.start)
        weights.check_shapes(settings.start, stored.tensors, settings.design.shapes())
        model.load_state_dict({key: torch.from_numpy(tensor) for key, tensor in stored.tensors.items()})
    return model


def rate(settings: Settings, step: int) -> float:
    """Return the learning rate at a step: up over WARM steps, then down a half cosine."""
    fall = 0.5 * (1.0 + math.cos(math.pi * step / settings.steps))
    return settings.rate * min(1.0, (step + 1) / WARM) * fall


def train(settings: Settings, folder: Path, *, fresh: bool = False) -> Iterator[Report]:
    """Train a link-frame predictor, with a checkpoint in `folder` at every report; yields the reports.

    Goes on where the folder's checkpoint stands (its reports come first), unless `fresh`; the result is the same, bit
    for bit, as of a run without interruption. Raises BrokenFile for a damaged checkpoint, or one of other settings.
    """
    model, scenes, path = begin(settings), Scenes(settings), folder / "last.safetensors"
    optimizer = torch.optim.AdamW(model.parameters(), lr=settings.rate, weight_decay=settings.decay)
    reports: list[Report] = []
    if not fresh and path.exists():
        reports = [Report(**one) for one in checkpoints.restore(path, model, optimizer, asdict(settings))["reports"]]
        yield from reports
    done, before = (reports[-1].step, reports[-1].seconds) if reports else (0, 0.0)
    start = time.monotonic()
    while done < settings.steps:
        end, losses = min(done + EVERY, settings.steps), []
        for step in range(done, end):
            for group in optimizer.param_groups:
                group["lr"] = rate(settings, step)
            loss = step_loss(model, sample(settings, scenes, step))
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            losses.append(loss.item())
        done = end
        reports.append(Report(done, sum(losses) / len(losses), before + time.monotonic() - start))
        checkpoints.save(path, model, optimizer, asdict(settings), {"reports": [asdict(one) for one in reports]})
        yield reports[-1]


def trained(settings: Settings, folder: Path) -> tuple[dict[str, np.ndarray], list[Report]]:
    """Return the tensors of a finished run and its reports; raises BrokenFile when the folder holds none."""
    model = LinkFrameNet(settings.design)
    optimizer = torch.optim.AdamW(model.parameters())
    state = checkpoints.restore(folder / "last.safetensors", model, optimizer, asdict(settings))
    reports = [Report(**one) for one in state["reports"]]
    if not reports or reports[-1].step < settings.steps:
        raise BrokenFile(f"{folder}: the training is not finished: {settings.steps} steps expected")
    return {key: tensor.numpy() for key, tensor in model.state_dict().items()}, reports


def finish(name: str, settings: Settings, folder: Path, command: str, to: Path = weights.FOLDER) -> Path:
    """Choose the threshold on VALIDATION scenes, store weights and record as `name`, and return the weights' path."""
    tensors, reports = trained(settings, folder)
    half = {key: tensor.astype(np.float16).astype(np.float32) for key, tensor in tensors.items()}
    predictor = linkframe.Predictor(name, settings.design, half)
    seeds = range(VALIDATION, VALIDATION + VALIDATED)
    scenes = evaluation.labelled(seeds, settings.source, settings.design.size, settings.kind, RESOLUTION)
    found = evaluation.measure(predictor.predict, scenes, RESOLUTION)
    threshold = found.best_threshold()
    training = {key: value for key, value in asdict(settings).items() if key != "design"}
    values = {"network": linkframe.NETWORK, "settings": asdict(settings.design), "training": training}
    values |= {"threshold": threshold, "parameters": predictor.parameters, "curve": [asdict(one) for one in reports]}
    values |= {"validation": asdict(found.iou(threshold)), "validation_half": asdict(found.iou(0.5))}
    values |= {"evaluation": evaluation_of(predictor, threshold, settings)}
    record = RunRecord(name, command, settings.seed, "paper", reports[-1].seconds, values, weights.training_versions())
    return weights.save(tensors, record, to)


def evaluation_of(predictor: linkframe.Predictor, threshold: float, settings: Settings) -> list[dict]:
    """Return `compare.table` of a predictor, the lookup table and the ceiling, on EVALUATION scenes."""
    size, source, kind = settings.design.size, settings.source, settings.kind
    methods = {predictor.name: (predictor.predict, threshold), "lookup table": compare.lookup_table(source, size, kind)}
    return compare.table(methods, range(EVALUATION, EVALUATION + EVALUATED), source, size, kind, RESOLUTION)
