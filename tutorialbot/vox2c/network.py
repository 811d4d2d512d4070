"""The network of the paper (Fig. 2): binary voxels in, the whole C-space out; its loss, equations (1) to (3).

The paper states 32^3 x 1 -> 4^3 x 512 -> 4^2 x 2048 -> C-space and the kinds of layers. Not stated, and chosen here:

- channels 64-128-256-512, 3^3 kernels, max pooling after the first three of them;
- the y axis is folded into the channels (the arm moves in planes of x and z);
- transposed convolutions without overlap, strides 5-3-3-2, 3-3-2 or 3-3 for 1, 5 or 10 degrees;
- a last 3^2 convolution to one channel, padded around the torus, in front of the sigmoid;
- alpha, beta, and how equation (3) is meant (see `orthogonal_term`).
"""

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from tutorialbot.errors import BrokenFile, InvalidValue, finite_number
from tutorialbot.runs import RunRecord
from tutorialbot.vox2c import linkframe, weights
from tutorialbot.vox2c.labels import check_voxels

SIZE = 32
ENCODER = (64, 128, 256, 512)
DECODER = (512, 256, 128, 64)
STRIDES = {1: (5, 3, 3, 2), 5: (3, 3, 2), 10: (3, 3)}
ALPHA, BETA = 1e-7, 1e-5
WIDEST = 8.0  # times the paper's channels: beyond, no memory holds it


def channels(width: float) -> tuple[list[int], list[int]]:
    """Return the channels of encoder and decoder, `width` times the paper's (at least 1 each)."""
    width = finite_number("width", width, 0.0, WIDEST, above=True)
    return tuple([max(1, round(width * count)) for count in counts] for counts in (ENCODER, DECODER))


def check_resolution(resolution_deg: int) -> int:
    """Return `resolution_deg` when the paper has a network for it (1, 5 or 10), or raise InvalidValue."""
    if isinstance(resolution_deg, bool) or resolution_deg not in STRIDES:
        raise InvalidValue("resolution_deg", resolution_deg, "1, 5 or 10, as in the paper")
    return int(resolution_deg)


class Vox2CNet(nn.Module):
    """Fig. 2: voxels (batch, 1, 32, 32, 32) to logits (batch, n, n), n = 360 / resolution_deg; sigmoid is left out."""

    def __init__(self, resolution_deg: int, width: float = 1.0):
        super().__init__()
        strides = STRIDES[check_resolution(resolution_deg)]
        down, up = channels(width)
        layers, before = [], 1
        for i, count in enumerate(down):
            layers += [nn.Conv3d(before, count, 3, padding=1), nn.InstanceNorm3d(count, affine=True), nn.ReLU()]
            layers += [nn.MaxPool3d(2)] if i < 3 else []
            before = count
        self.encoder = nn.Sequential(*layers)
        layers, before = [], 4 * before
        for count, stride in zip(up, strides, strict=False):
            layers += [nn.ConvTranspose2d(before, count, stride, stride)]
            layers += [nn.InstanceNorm2d(count, affine=True), nn.ReLU()]
            before = count
        self.decoder = nn.Sequential(*layers, nn.Conv2d(before, 1, 3, padding=1, padding_mode="circular"))

    def forward(self, voxels: Tensor) -> Tensor:
        """Return logits (batch, n, n), axis 1 theta1 and axis 2 theta2, of voxels (batch, 1, 32, 32, 32)."""
        features = self.encoder(voxels)  # (batch, c, x, y, z)
        flat = features.permute(0, 1, 3, 2, 4).flatten(1, 2)  # (batch, 4 c, x, z)
        return self.decoder(flat)[:, 0]


def weight_matrices(model: nn.Module) -> list[Tensor]:
    """Return each layer's weights as (neurons, inputs of one neuron); norms and biases are left out."""
    matrices = []
    for layer in model.modules():
        if isinstance(layer, nn.ConvTranspose2d):
            matrices.append(layer.weight.transpose(0, 1).flatten(1))  # stored as (in, out, k, k)
        elif isinstance(layer, nn.Conv2d | nn.Conv3d | nn.Linear):
            matrices.append(layer.weight.flatten(1))
    return matrices


def l1_term(model: nn.Module) -> Tensor:
    """Return equation (2): the sum of |w| over all weights."""
    return sum(matrix.abs().sum() for matrix in weight_matrices(model))


def orthogonal_term(matrix: Tensor) -> Tensor:
    """Return |W W^T - I|^2 (squared Frobenius norm) for one layer's W (neurons, inputs).

    Equation (3) taken word for word has one neuron's row w_i, so that w_i w_i^T - I is a number and says nothing of
    angles; read here: all rows of a layer at once. The squared norm is the same for W^T W but for a constant, so the
    smaller of the two products is formed: |W W^T - I|^2 = |W^T W - I|^2 + neurons - inputs.
    """
    neurons, inputs = matrix.shape
    gram = matrix @ matrix.T if neurons <= inputs else matrix.T @ matrix
    eye = torch.eye(len(gram), dtype=gram.dtype, device=gram.device)
    return (gram - eye).square().sum() + max(0, neurons - inputs)


def cross_entropy(logits: Tensor, truth: Tensor) -> Tensor:
    """Return the mean cross entropy of equation (1), with the minus sign that the paper's lacks, from logits."""
    return functional.binary_cross_entropy_with_logits(logits, truth)


def regularizer(model: nn.Module, alpha: float = ALPHA, beta: float = BETA) -> Tensor:
    """Return alpha L_1 + beta L_ortho, the last two terms of equation (1)."""
    return alpha * l1_term(model) + beta * sum(orthogonal_term(matrix) for matrix in weight_matrices(model))


def loss(model: nn.Module, logits: Tensor, truth: Tensor, alpha: float = ALPHA, beta: float = BETA) -> Tensor:
    """Return equation (1) with its sign put right: cross entropy + alpha L_1 + beta L_ortho."""
    return cross_entropy(logits, truth) + regularizer(model, alpha, beta)


@dataclass
class Predictor:
    """A trained network of the paper, for one resolution."""

    name: str
    model: Vox2CNet
    resolution_deg: int
    record: RunRecord

    def predict(self, voxels: np.ndarray, resolution_deg: int) -> np.ndarray:
        """Return the probability of collision, float32 (n, n), axes and cells as in `labels.exact_cspace`.

        voxels: (32, 32, 32), binary. Raises InvalidValue for others, and for a resolution that it was not trained for.
        """
        voxels = check_voxels(voxels, SIZE)
        if resolution_deg != self.resolution_deg:
            raise InvalidValue("resolution_deg", resolution_deg, f"{self.resolution_deg}, as {self.name} was trained")
        with torch.inference_mode():
            logits = self.model(torch.from_numpy(voxels.astype(np.float32))[None, None])
            return torch.sigmoid(logits)[0].numpy()


def load(name: str, folder=weights.FOLDER) -> "Predictor | linkframe.Predictor":
    """Return the predictor called `name`: one of the paper's networks, or a link-frame predictor.

    Raises InvalidValue for an unknown name, BrokenFile for weights that are damaged, cut short or of another shape.
    """
    stored = weights.load(name, folder)
    if stored.record.values.get("network") == linkframe.NETWORK:
        return linkframe.load(name, folder)
    try:
        settings = stored.record.values["settings"]
        resolution_deg, width = settings["resolution_deg"], settings["width"]
        model = Vox2CNet(resolution_deg, width)
    except (KeyError, TypeError, ValueError) as error:
        raise BrokenFile(f"weights {name!r}: its record names no network of the paper: {error}") from None
    expected = {key: tuple(tensor.shape) for key, tensor in model.state_dict().items()}
    weights.check_shapes(name, stored.tensors, expected)
    model.load_state_dict({key: torch.from_numpy(tensor) for key, tensor in stored.tensors.items()})
    return Predictor(name, model.eval(), resolution_deg, stored.record)


def parameters(resolution_deg: int, width: float = 1.0) -> int:
    """Return how many weights the network has at this resolution and width."""
    with torch.device("meta"):
        return sum(math.prod(p.shape) for p in Vox2CNet(resolution_deg, width).parameters())
