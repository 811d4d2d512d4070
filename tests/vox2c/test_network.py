"""The paper's network: shapes, the loss with its sign, the orthogonal term against its definition, loading."""

import numpy as np
import pytest
import torch

from tutorialbot.errors import BrokenFile, InvalidValue
from tutorialbot.paths import DATA
from tutorialbot.runs import RunRecord
from tutorialbot.vox2c import dataset, linkframe, network, training, weights

WIDTH = 1 / 32


def model(resolution_deg=10):
    torch.manual_seed(0)
    return network.Vox2CNet(resolution_deg, WIDTH)


@pytest.mark.parametrize("resolution_deg", [1, 5, 10])
def test_the_c_space_has_as_many_cells_as_the_resolution_says(resolution_deg):
    n = 360 // resolution_deg
    assert model(resolution_deg)(torch.zeros(2, 1, 32, 32, 32)).shape == (2, n, n)


def test_encoder_and_bottleneck_have_the_papers_sizes():
    """Fig. 2: 4^3 x 512, then 4^2 x 2048; 32.4, 15.4 and 15.3 million weights follow from our choices."""
    with torch.device("meta"):
        net = network.Vox2CNet(1)
        assert net.encoder(torch.zeros(1, 1, 32, 32, 32)).shape == (1, 512, 4, 4, 4)
        assert net.decoder[0].in_channels == 2048
    assert [round(network.parameters(r) / 1e6, 1) for r in (1, 5, 10)] == [32.4, 15.4, 15.3]


def test_y_is_folded_and_x_and_z_stay():
    net, seen = model(), []
    net.decoder.register_forward_pre_hook(lambda _, inputs: seen.append(inputs[0]))
    voxels = (torch.rand(1, 1, 32, 32, 32) < 0.2).float()
    net(voxels)
    features = net.encoder(voxels)
    c = features.shape[1]
    assert torch.equal(seen[0][0].reshape(c, 4, 4, 4), features[0].permute(0, 2, 1, 3))


def test_the_loss_falls_toward_the_truth():
    """Equation (1) as printed has no minus sign: it would be lowest where every cell is wrong."""
    truth = (torch.rand(2, 6, 6, generator=torch.Generator().manual_seed(1)) < 0.3).float()
    right, wrong = (2 * truth - 1) * 4, (1 - 2 * truth) * 4
    assert 0 < network.cross_entropy(right, truth) < network.cross_entropy(0 * truth, truth)
    assert network.cross_entropy(wrong, truth) > np.log(2)
    p = torch.sigmoid(right)
    printed = (truth * p.log() + (1 - truth) * (1 - p).log()).mean()
    assert torch.allclose(network.cross_entropy(right, truth), -printed)


def test_the_gradient_of_the_loss_is_its_slope():
    net = network.Vox2CNet(10, 1 / 64).double()
    voxels = (torch.rand(1, 1, 32, 32, 32) < 0.2).double()
    truth = (torch.rand(1, 36, 36) < 0.3).double()
    arguments = {"alpha": 1e-3, "beta": 1e-3}
    network.loss(net, net(voxels), truth, **arguments).backward()
    for weight in (net.encoder[0].weight, net.decoder[0].weight, net.decoder[-1].weight):
        flat, slope, step = weight.data.view(-1), weight.grad.view(-1)[3].item(), 1e-6
        values = []
        for sign in (1, -1):
            flat[3] += sign * step
            values.append(network.loss(net, net(voxels), truth, **arguments).item())
            flat[3] -= sign * step
        assert slope == pytest.approx((values[0] - values[1]) / (2 * step), rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("shape", [(3, 7), (7, 3), (4, 4)])
def test_the_orthogonal_term_is_its_definition_on_either_side(shape):
    """Row by row, as equation (3) for a whole layer: the sum over i, j of (w_i . w_j - [i = j])^2."""
    rows = torch.randn(shape, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    naive = sum(float((rows[i] @ rows[j] - float(i == j)) ** 2) for i in range(shape[0]) for j in range(shape[0]))
    assert float(network.orthogonal_term(rows)) == pytest.approx(naive)


def test_the_orthogonal_term_vanishes_for_orthonormal_rows_only():
    rows = torch.linalg.qr(torch.randn(6, 6))[0][:4]
    assert float(network.orthogonal_term(rows)) < 1e-9
    assert float(network.orthogonal_term(2 * rows)) == pytest.approx(4 * 9, rel=1e-4)
    assert float(network.orthogonal_term(torch.ones(2, 2) / 2**0.5)) == pytest.approx(2)


def test_each_row_of_a_weight_matrix_makes_one_output():
    """Of a transposed convolution too, which torch stores the other way round."""
    layer = torch.nn.ConvTranspose2d(3, 5, 2, 2, bias=False)
    matrix = network.weight_matrices(torch.nn.Sequential(layer))[0]
    assert matrix.shape == (5, 12)
    with torch.no_grad():
        layer.weight[:, 4] = 0.0
    matrix = network.weight_matrices(torch.nn.Sequential(layer))[0]
    assert matrix[4].abs().sum() == 0 and matrix[:4].abs().min() > 0


def test_the_regularizer_counts_weights_and_leaves_norms_out():
    net = model()
    total = sum(p.abs().sum() for name, p in net.named_parameters() if p.ndim > 1)
    for found in (network.l1_term(net), network.regularizer(net, 1.0, 0.0)):
        assert found.item() == pytest.approx(total.item(), rel=1e-5)


def stored(folder, **changes):
    settings = {"resolution_deg": 10, "width": WIDTH} | changes
    values = {"network": "paper", "settings": settings}
    tensors = {key: value.numpy() for key, value in model().state_dict().items()}
    weights.save(tensors, RunRecord("tiny", "", 0, "quick", 0.0, values), folder, half=False)


def test_a_loaded_network_says_what_it_said_before(tmp_path):
    stored(tmp_path)
    voxels = np.random.default_rng(0).random((32, 32, 32)) < 0.2
    found = network.load("tiny", tmp_path).predict(voxels, 10)
    with torch.inference_mode():
        expected = torch.sigmoid(model().eval()(torch.from_numpy(voxels).float()[None, None]))[0].numpy()
    assert found.shape == (36, 36) and np.allclose(found, expected, atol=1e-6)
    assert found.min() >= 0 and found.max() <= 1


def test_bad_input_is_refused(tmp_path):
    stored(tmp_path)
    predictor = network.load("tiny", tmp_path)
    good = np.zeros((32, 32, 32))
    for voxels in (np.zeros((64, 64, 64)), np.zeros((32, 32)), good + 2, good + np.nan):
        with pytest.raises(ValueError, match="voxels"):
            predictor.predict(voxels, 10)
    with pytest.raises(InvalidValue, match="resolution_deg = 5"):
        predictor.predict(good, 5)
    for wrong in (2, 0, True, "10"):
        with pytest.raises(InvalidValue, match="resolution_deg"):
            network.Vox2CNet(wrong)
    with pytest.raises(ValueError, match="width"):
        network.Vox2CNet(10, 0.0)


@pytest.mark.parametrize("changes", [{"width": 1 / 16}, {"resolution_deg": 1}, {"resolution_deg": 7}, {"width": "a"}])
def test_weights_that_do_not_fit_their_record_are_refused(tmp_path, changes):
    stored(tmp_path, **changes)
    with pytest.raises(BrokenFile, match="tiny"):
        network.load("tiny", tmp_path)


def test_one_call_loads_either_kind():
    one = network.load("linkframe-raster")
    assert isinstance(one, linkframe.Predictor) and one.predict(np.zeros((32, 32, 32)), 10).shape == (36, 36)
    with pytest.raises(InvalidValue, match="'linkframe-raster'"):
        network.load("nothing")


def test_the_committed_network_is_as_good_as_its_record_says():
    """On 100 test scenes of the small set, with their standard error; and both records tell the same story."""
    one = network.load("paper-5deg-mirror")
    pairs = dataset.read(dataset.Recipe(5, "cameras"), "test", 100, DATA / "vox2c")
    entropy, found = training.judge(one.model, pairs, 50, torch.device("cpu"))
    iou, told = found.iou(0.5), one.record.values["evaluation"][0]
    assert abs(iou.pooled - told["pooled"]) < 3 * iou.pooled_error
    assert entropy == pytest.approx(one.record.values["test"]["cross_entropy"], rel=0.2)
    runs = RunRecord.load(DATA / "reference" / "vox2c_training.json").values["networks"]
    same = next(run for run in runs if run["name"] == one.name)
    assert same["sha256"] == one.record.values["sha256"] and same["curve"] == one.record.values["curve"]
    assert {run["settings"]["resolution_deg"] for run in runs} == set(network.STRIDES)
