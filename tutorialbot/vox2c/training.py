"""Training of the paper's network: a generator that goes round by round, writes as it goes and resumes after a kill."""

import json
import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from tutorialbot.errors import InvalidValue, one_of, positive, whole_number
from tutorialbot.runs import RunRecord, progress
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import checkpoints, compare, dataset, evaluation, network, weights
from tutorialbot.vox2c.checkpoints import use_threads  # noqa: F401 - for whoever trains
from tutorialbot.vox2c.judging import autocast, default_device, judge, tensors
from tutorialbot.vox2c.labels import KINDS

REGULAR = 10  # the regularizer is reckoned at every tenth step, tenfold: it changes slowly and costs a tenth
AT_ONCE = {1: 4, 5: 16, 10: 32}  # scenes at once on the CPU, for less than 3 GB; the norms are each scene's own
SPLITS = {"validation": 1000, "test": 4000}  # scenes of the splits that are only looked at


@dataclass(frozen=True)
class Settings:
    """One training run. A round ends with validation and a checkpoint; an epoch may be several rounds."""

    resolution_deg: int
    scenes: int
    width: float = 1.0
    epochs: int = 40
    batch: int = 16
    rate: float = 1e-3
    alpha: float = network.ALPHA
    beta: float = network.BETA
    patience: int = 8  # epochs without a better validation IoU before it stops
    round_scenes: int = 5000
    source: str = "cameras"
    kind: str = "exact"
    seed: int = 0
    mirror: bool = False  # half of the scenes, drawn anew in each step, mirrored from left to right

    def __post_init__(self):
        network.check_resolution(self.resolution_deg)
        for name in ("scenes", "epochs", "batch", "patience", "round_scenes"):
            whole_number(name, getattr(self, name), 1)
        network.channels(self.width), positive("rate", self.rate)
        one_of("source", self.source, ("cameras", "raster"))
        one_of("kind", self.kind, KINDS)

    @property
    def recipe(self) -> dataset.Recipe:
        """Which pairs of the data set it learns from."""
        return dataset.Recipe(self.resolution_deg, self.source, network.SIZE, self.kind)

    @property
    def name(self) -> str:
        """Name of the weights that come out."""
        width = "" if self.width == 1.0 else f"-width{self.width:g}"
        kind = "" if self.kind == "exact" else f"-{self.kind}"
        source = "" if self.source == "cameras" else f"-{self.source}"
        mirror = "-mirror" if self.mirror else ""
        return f"paper-{self.resolution_deg}deg{width}{source}{kind}{mirror}"


def pairs(settings: Settings, jobs: int = 2) -> tuple[dataset.Pairs, dataset.Pairs, dataset.Pairs]:
    """Return the pairs to train with, to validate and to test; makes those that are missing, in `jobs` processes."""
    found = []
    for split, count in {"train": settings.scenes, **SPLITS}.items():
        dataset.make(settings.recipe, split, count, jobs=jobs)
        found.append(dataset.read(settings.recipe, split, count))
    return tuple(found)


def mirror(voxels: Tensor, truth: Tensor) -> tuple[Tensor, Tensor]:
    """Return voxels (batch, 1, 32, 32, 32) and labels (batch, n, n) of the scenes' mirror images in the plane x = 0.

    The arm is its own mirror image with both angles negated, so cell k of an axis becomes cell -k, modulo n.
    """
    return voxels.flip(2), truth.flip(1, 2).roll((1, 1), (1, 2))


@dataclass(frozen=True)
class Round:
    """What one round came to; `loss` and `validation_loss` are equation (1), the latter without regularizer too."""

    step: int
    epoch: float
    loss: float
    validation_loss: float
    cross_entropy: float
    iou: float  # pooled, at 0.5
    scene_iou: float
    seconds: float  # of the whole run so far


@dataclass
class Run:
    """A training under way: what it needs from one step to the next."""

    pairs: dataset.Pairs
    validation: dataset.Pairs
    settings: Settings
    folder: Path
    device: torch.device
    model: network.Vox2CNet = field(init=False)
    optimizer: torch.optim.Optimizer = field(init=False)
    rounds: list[Round] = field(default_factory=list)

    def __post_init__(self):
        settings = self.settings
        for name, given in (("pairs", self.pairs), ("validation", self.validation)):
            if given.recipe != settings.recipe:
                raise InvalidValue(name, given.recipe, f"pairs of {settings.recipe}")
        if len(self.pairs) != settings.scenes:
            raise InvalidValue("pairs", f"{len(self.pairs)} of them", f"{settings.scenes}")
        with torch.random.fork_rng():
            torch.manual_seed(settings.seed)
            self.model = network.Vox2CNet(settings.resolution_deg, settings.width).to(self.device)
        self.optimizer = torch.optim.Adam(self.model.parameters(), lr=settings.rate)
        self.steps_an_epoch = math.ceil(len(self.pairs) / settings.batch)
        self.steps = settings.epochs * self.steps_an_epoch

    @property
    def step(self) -> int:
        """How many steps are done and on disk."""
        return self.rounds[-1].step if self.rounds else 0

    @property
    def at_once(self) -> int:
        """How many scenes of a step go through the network together: on the CPU few where the C-space is large."""
        return self.settings.batch if self.device.type == "cuda" else AT_ONCE[self.settings.resolution_deg]

    def rows(self, step: int) -> np.ndarray:
        """Return which scenes step number `step` learns from: each epoch goes through all in an order of its own."""
        epoch, place = divmod(step, self.steps_an_epoch)
        order = make_rng(self.settings.seed, 7, epoch).permutation(len(self.pairs))
        return order[place * self.settings.batch : (place + 1) * self.settings.batch]

    def learn(self, step: int) -> Tensor:
        """Do one step; returns its cross entropy, left on the device: to fetch it would wait for the step to end."""
        settings, progressed = self.settings, step / self.steps
        for group in self.optimizer.param_groups:
            group["lr"] = settings.rate * 0.5 * (1.0 + math.cos(math.pi * progressed))
        rows, total = self.rows(step), torch.zeros((), device=self.device)
        self.model.train()
        self.optimizer.zero_grad()
        for part in np.array_split(rows, math.ceil(len(rows) / self.at_once)):
            voxels, truth = tensors(self.pairs, part, self.device)
            if settings.mirror:
                chosen = torch.from_numpy(make_rng(settings.seed, 8, step, part[0]).random(len(part)) < 0.5)
                voxels[chosen], truth[chosen] = mirror(voxels[chosen], truth[chosen])
            with autocast(self.device):
                logits = self.model(voxels)
            share = network.cross_entropy(logits.float(), truth) * (len(part) / len(rows))
            share.backward()
            total += share.detach()
        if step % REGULAR == 0:
            (REGULAR * network.regularizer(self.model, settings.alpha, settings.beta)).backward()
        self.optimizer.step()
        return total

    def validate(self) -> tuple[float, evaluation.Iou]:
        """Return cross entropy and IoU at 0.5 on the validation scenes."""
        entropy, found = judge(self.model, self.validation, self.at_once, self.device)
        return entropy, found.iou(0.5)

    def regularizer(self) -> float:
        """Return the last two terms of equation (1) as they are now."""
        with torch.inference_mode():
            return float(network.regularizer(self.model, self.settings.alpha, self.settings.beta))

    def best(self) -> Round:
        """Return the round with the best pooled validation IoU."""
        return max(self.rounds, key=lambda one: one.iou)

    def finished(self) -> bool:
        """Say whether all epochs are done, or the validation IoU has not risen for `patience` epochs."""
        if not self.rounds:
            return False
        stale = self.rounds[-1].epoch - self.best().epoch
        return self.step >= self.steps or stale >= self.settings.patience

    def save(self) -> None:
        """Write the checkpoint; and the weights once more when they are the best so far."""
        state = {"rounds": [asdict(one) for one in self.rounds]}
        header = asdict(self.settings)
        if self.best() is self.rounds[-1]:
            checkpoints.save(self.folder / "best.safetensors", self.model, self.optimizer, header, state)
        checkpoints.save(self.folder / "last.safetensors", self.model, self.optimizer, header, state)

    def resume(self) -> None:
        """Go on from the last checkpoint; raises BrokenFile when it is damaged or another run's."""
        found = _restore(self.settings, self.folder / "last.safetensors", self.model, self.optimizer)
        self.rounds = [Round(**one) for one in found]


def _restore(settings: Settings, path: Path, model: torch.nn.Module, optimizer: torch.optim.Optimizer) -> list[dict]:
    """Put both into the state of a checkpoint; return its rounds."""
    return checkpoints.restore(path, model, optimizer, asdict(settings))["rounds"]


def train(
    pairs: dataset.Pairs,
    validation: dataset.Pairs,
    settings: Settings,
    folder: Path,
    *,
    fresh: bool = False,
    minutes: float = math.inf,
) -> Iterator[Round]:
    """Train the paper's network round by round, with a checkpoint in `folder` after each; yields what each came to.

    Goes on where the folder's last checkpoint stands (those rounds are yielded first), unless `fresh`; on the CPU the
    result is the same, bit for bit, as of a run without interruption. Stops after `minutes` of this call, to be
    resumed, and at the end of `Settings.epochs` or of `Settings.patience`. Raises BrokenFile for a checkpoint that is
    damaged or belongs to other settings, InvalidValue for pairs that are not what the settings say.
    """
    run = Run(pairs, validation, settings, folder, default_device())
    if not fresh and (folder / "last.safetensors").exists():
        run.resume()
        yield from run.rounds
    start, before = time.monotonic(), run.rounds[-1].seconds if run.rounds else 0.0
    length = min(math.ceil(settings.round_scenes / settings.batch), run.steps_an_epoch)
    while not run.finished() and time.monotonic() - start < 60.0 * minutes:
        end = min(run.step + length, run.steps)
        losses = [run.learn(step) for step in progress(range(run.step, end), description=settings.name)]
        (entropy, iou), extra = run.validate(), run.regularizer()
        epoch, seconds = end / run.steps_an_epoch, before + time.monotonic() - start
        loss = float(torch.stack(losses).mean()) + extra
        run.rounds.append(Round(end, epoch, loss, entropy + extra, entropy, iou.pooled, iou.scene_mean, seconds))
        run.save()
        yield run.rounds[-1]


def finish(settings: Settings, folder: Path, command: str, test: dataset.Pairs, to: Path = weights.FOLDER) -> Path:
    """Judge the best weights of a run on `test`, store them as float16 with their record; returns the weights' path.

    Raises BrokenFile when the folder holds no whole run of these settings.
    """
    model = network.Vox2CNet(settings.resolution_deg, settings.width)
    optimizer = torch.optim.Adam(model.parameters())
    rounds = [Round(**one) for one in _restore(settings, folder / "last.safetensors", model, optimizer)]
    best = Round(**_restore(settings, folder / "best.safetensors", model, optimizer)[-1])
    model = model.half().float()  # as it is stored
    values = {"network": "paper", "settings": json.loads(json.dumps(asdict(settings))), "best": asdict(best)}
    values |= {"parameters": network.parameters(settings.resolution_deg, settings.width)}
    values |= {"curve": [asdict(one) for one in rounds], **evaluation_of(model, settings, test)}
    record = RunRecord(
        settings.name, command, settings.seed, "paper", rounds[-1].seconds, values, weights.training_versions()
    )
    tensors = {key: tensor.cpu().numpy() for key, tensor in model.state_dict().items()}
    return weights.save(tensors, record, to)


def evaluation_of(model: network.Vox2CNet, settings: Settings, test: dataset.Pairs) -> dict:
    """Return loss, equation (1), and IoU at 0.5 on `test`, beside the lookup table's: rows as of `compare.table`."""
    device = default_device()
    model.to(device)
    entropy, own = judge(model, test, AT_ONCE[settings.resolution_deg], device)
    with torch.inference_mode():
        loss = entropy + float(network.regularizer(model, settings.alpha, settings.beta))
    predict, threshold = compare.lookup_table(settings.source, network.SIZE, settings.kind)
    batches = (test.batch(slice(i, i + 1)) for i in range(len(test)))
    seen = ((voxels[0], truth[0]) for voxels, truth in batches)
    found = {settings.name: (own, 0.5), "lookup table": (evaluation.measure(predict, seen, settings.resolution_deg),
                                                         threshold)}  # fmt: skip
    rows = compare.rows(found, settings.source, network.SIZE, settings.kind, settings.resolution_deg)
    return {"test": {"loss": loss, "cross_entropy": entropy, "scenes": len(test)}, "evaluation": rows}
