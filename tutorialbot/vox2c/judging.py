"""The paper's network judged on pairs of the data set; batches of them as tensors, in mixed precision with CUDA."""

import math
from contextlib import nullcontext

import numpy as np
import torch
from torch import Tensor

from tutorialbot.vox2c import dataset, evaluation, network
from tutorialbot.vox2c.evaluation import Tally


def default_device() -> torch.device:
    """Return CUDA where there is one, else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def tensors(pairs: dataset.Pairs, rows: np.ndarray, device: torch.device) -> tuple[Tensor, Tensor]:
    """Return voxels (batch, 1, 32, 32, 32) and labels (batch, n, n) of these rows as float32."""
    voxels, truth = (torch.from_numpy(array).to(device).float() for array in pairs.batch(rows))
    return voxels[:, None], truth


def autocast(device: torch.device):
    """Mixed precision where there is CUDA, else nothing."""
    return torch.autocast("cuda", torch.bfloat16) if device.type == "cuda" else nullcontext()


@torch.inference_mode()
def judge(model: network.Vox2CNet, pairs: dataset.Pairs, at_once: int, device: torch.device) -> tuple[float, Tally]:
    """Return a network's mean cross entropy over `pairs` and its tally; `at_once` scenes go through it together."""
    model.eval()
    entropy, tallies, count = 0.0, [], len(pairs)
    for rows in np.array_split(np.arange(count), math.ceil(count / at_once)):
        voxels, truth = tensors(pairs, rows, device)
        with autocast(device):
            logits = model(voxels).float()
        entropy += network.cross_entropy(logits, truth).item() * len(rows)
        said = torch.sigmoid(logits).cpu().numpy(), truth.cpu().numpy() > 0.5
        tallies.append(evaluation.tally(zip(*said, strict=True)))
    return entropy / count, evaluation.joined(tallies)
