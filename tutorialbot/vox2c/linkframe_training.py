"""Training of the link-frame predictor in torch; what comes out runs without torch (linkframe.py)."""

import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from tutorialbot.vox2c import checkpoints, evaluation, linkframe
from tutorialbot.vox2c.arm import DOMAIN
from tutorialbot.vox2c.linkframe_data import Sample, Scenes, Settings, sample


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
