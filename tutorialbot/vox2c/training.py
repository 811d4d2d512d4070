"""Training of the paper's network: a generator that goes round by round, writes as it goes and resumes after a kill."""

import json
import math
import time
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from tutorialbot.errors import InvalidValue, one_of, positive, whole_number
from tutorialbot.runs import RunRecord, progress
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import checkpoints, evaluation, network, weights
from tutorialbot.vox2c.checkpoints import use_threads  # noqa: F401 - for whoever trains
from tutorialbot.vox2c.labels import KINDS, cells

REGULAR = 10  # the regularizer is reckoned at every tenth step, tenfold: it changes slowly and costs a tenth
VALIDATION = 0.05  # share of the scenes, the last ones, kept for validation; at most 1,000
LARGEST_VALIDATION = 1000


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

    def __post_init__(self):
        network.check_resolution(self.resolution_deg)
        for name in ("scenes", "epochs", "batch", "patience", "round_scenes"):
            whole_number(name, getattr(self, name), 1)
        for name in ("width", "rate"):
            positive(name, getattr(self, name))
        one_of("source", self.source, ("cameras", "raster"))
        one_of("kind", self.kind, KINDS)
        if self.scenes < 4:
            raise InvalidValue("scenes", self.scenes, "at least 4: some are kept for validation")

    @property
    def name(self) -> str:
        """Name of the weights that come out."""
        width = "" if self.width == 1.0 else f"-width{self.width:g}"
        kind = "" if self.kind == "exact" else f"-{self.kind}"
        source = "" if self.source == "cameras" else f"-{self.source}"
        return f"paper-{self.resolution_deg}deg{width}{source}{kind}"


@dataclass(frozen=True)
class Pairs:
    """Voxels and C-spaces, packed to bits by np.packbits: (scenes, 32^3 / 8) and (scenes, ceil(n n / 8)) uint8."""

    voxels: np.ndarray
    labels: np.ndarray
    resolution_deg: int

    def __post_init__(self):
        n = cells(self.resolution_deg)
        for name, bits in (("voxels", network.SIZE**3), ("labels", n * n)):
            array = getattr(self, name)
            if array.dtype != np.uint8 or array.shape != (len(self.voxels), -(-bits // 8)):
                found = f"{array.dtype} array of shape {array.shape}"
                raise InvalidValue(name, found, f"uint8 of shape ({len(self.voxels)}, {-(-bits // 8)})")

    def __len__(self) -> int:
        return len(self.voxels)

    def tensors(self, rows: np.ndarray, device: torch.device) -> tuple[Tensor, Tensor]:
        """Return voxels (batch, 1, 32, 32, 32) and labels (batch, n, n) of these rows as float32."""
        n, size = cells(self.resolution_deg), network.SIZE
        voxels = np.unpackbits(self.voxels[rows], axis=1, count=size**3).reshape(-1, 1, size, size, size)
        truth = np.unpackbits(self.labels[rows], axis=1, count=n * n).reshape(-1, n, n)
        return tuple(torch.from_numpy(array).to(device).float() for array in (voxels, truth))


def made_pairs(settings: Settings, first: int) -> Pairs:
    """Return pairs of `settings.scenes` random scenes, seeds from `first` on, made here and now."""
    seeds = range(first, first + settings.scenes)
    scenes = evaluation.labelled(seeds, settings.source, network.SIZE, settings.kind, settings.resolution_deg)
    rows = [[np.packbits(voxels), np.packbits(truth)] for voxels, truth in scenes]
    return Pairs(np.array([row[0] for row in rows]), np.array([row[1] for row in rows]), settings.resolution_deg)


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

    pairs: Pairs
    settings: Settings
    folder: Path
    device: torch.device
    model: network.Vox2CNet = field(init=False)
    optimizer: torch.optim.Optimizer = field(init=False)
    rounds: list[Round] = field(default_factory=list)

    def __post_init__(self):
        settings = self.settings
        if len(self.pairs) != settings.scenes or self.pairs.resolution_deg != settings.resolution_deg:
            found = f"{len(self.pairs)} at {self.pairs.resolution_deg} degrees"
            raise InvalidValue("pairs", found, f"{settings.scenes} at {settings.resolution_deg} degrees")
        with torch.random.fork_rng():
            torch.manual_seed(settings.seed)
            self.model = network.Vox2CNet(settings.resolution_deg, settings.width).to(self.device)
        self.optimizer = torch.optim.Adam(self.model.parameters(), lr=settings.rate)
        held = min(LARGEST_VALIDATION, max(1, round(VALIDATION * len(self.pairs))))
        self.trained, self.held = np.arange(len(self.pairs) - held), np.arange(len(self.pairs) - held, len(self.pairs))
        self.steps_an_epoch = math.ceil(len(self.trained) / settings.batch)
        self.steps = settings.epochs * self.steps_an_epoch

    @property
    def step(self) -> int:
        """How many steps are done and on disk."""
        return self.rounds[-1].step if self.rounds else 0

    def autocast(self):
        """Mixed precision where there is CUDA, else nothing."""
        return torch.autocast("cuda", torch.bfloat16) if self.device.type == "cuda" else nullcontext()

    def rows(self, step: int) -> np.ndarray:
        """Return which scenes step number `step` learns from: each epoch goes through all in an order of its own."""
        epoch, place = divmod(step, self.steps_an_epoch)
        order = make_rng(self.settings.seed, 7, epoch).permutation(self.trained)
        return order[place * self.settings.batch : (place + 1) * self.settings.batch]

    def learn(self, step: int) -> float:
        """Do one step; returns its cross entropy."""
        settings, progressed = self.settings, step / self.steps
        for group in self.optimizer.param_groups:
            group["lr"] = settings.rate * 0.5 * (1.0 + math.cos(math.pi * progressed))
        voxels, truth = self.pairs.tensors(self.rows(step), self.device)
        self.model.train()
        with self.autocast():
            logits = self.model(voxels)
        entropy = network.cross_entropy(logits.float(), truth)
        loss = entropy
        if step % REGULAR == 0:
            loss = loss + REGULAR * network.regularizer(self.model, settings.alpha, settings.beta)
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()
        return entropy.item()

    @torch.inference_mode()
    def validate(self) -> tuple[float, evaluation.Iou]:
        """Return cross entropy and IoU at 0.5 on the scenes kept for validation."""
        self.model.eval()
        entropy, pairs = 0.0, []
        for rows in np.array_split(self.held, math.ceil(len(self.held) / self.settings.batch)):
            voxels, truth = self.pairs.tensors(rows, self.device)
            with self.autocast():
                logits = self.model(voxels).float()
            entropy += network.cross_entropy(logits, truth).item() * len(rows)
            pairs += zip(torch.sigmoid(logits).cpu().numpy(), truth.cpu().numpy() > 0.5, strict=True)
        return entropy / len(self.held), evaluation.tally(pairs).iou(0.5)

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

    def resume(self, name: str = "last") -> None:
        """Go on from the checkpoint called `name`; raises BrokenFile when it is damaged or another run's."""
        path = self.folder / f"{name}.safetensors"
        state = checkpoints.restore(path, self.model, self.optimizer, asdict(self.settings))
        self.rounds = [Round(**one) for one in state["rounds"]]


def default_device() -> torch.device:
    """Return CUDA where there is one, else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def train(
    pairs: Pairs, settings: Settings, folder: Path, *, fresh: bool = False, minutes: float = math.inf
) -> Iterator[Round]:
    """Train the paper's network round by round, with a checkpoint in `folder` after each; yields what each came to.

    Goes on where the folder's last checkpoint stands (those rounds are yielded first), unless `fresh`; on the CPU the
    result is the same, bit for bit, as of a run without interruption. Stops after `minutes` of this call, to be
    resumed, and at the end of `Settings.epochs` or of `Settings.patience`. Raises BrokenFile for a checkpoint that is
    damaged or belongs to other settings, InvalidValue for pairs that are not what the settings say.
    """
    run = Run(pairs, settings, folder, default_device())
    if not fresh and (folder / "last.safetensors").exists():
        run.resume()
        yield from run.rounds
    start, before = time.monotonic(), run.rounds[-1].seconds if run.rounds else 0.0
    length = max(1, min(settings.round_scenes // settings.batch, run.steps_an_epoch))
    while not run.finished() and time.monotonic() - start < 60.0 * minutes:
        end = min(run.step + length, run.steps)
        losses = [run.learn(step) for step in progress(range(run.step, end), description=settings.name)]
        (entropy, iou), extra = run.validate(), run.regularizer()
        epoch, seconds = end / run.steps_an_epoch, before + time.monotonic() - start
        loss = float(np.mean(losses)) + extra
        run.rounds.append(Round(end, epoch, loss, entropy + extra, entropy, iou.pooled, iou.scene_mean, seconds))
        run.save()
        yield run.rounds[-1]


def finish(pairs: Pairs, settings: Settings, folder: Path, command: str, to: Path = weights.FOLDER) -> Path:
    """Store the best weights of a run as float16 with their record; returns the weights' path.

    Raises BrokenFile when the folder holds no whole run of these settings.
    """
    run = Run(pairs, settings, folder, torch.device("cpu"))
    run.resume("last")
    rounds = run.rounds
    run.resume("best")
    best = run.best()
    values = {"network": "paper", "settings": json.loads(json.dumps(asdict(settings))), "best": asdict(best)}
    values |= {"parameters": network.parameters(settings.resolution_deg, settings.width)}
    values |= {"curve": [asdict(one) for one in rounds]}
    record = RunRecord(
        settings.name, command, settings.seed, "paper", rounds[-1].seconds, values, weights.training_versions()
    )
    tensors = {key: tensor.cpu().numpy() for key, tensor in run.model.state_dict().items()}
    return weights.save(tensors, record, to)
