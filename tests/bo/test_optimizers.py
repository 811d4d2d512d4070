"""Every optimiser speaks the same three words, repeats itself with the same seed, and the models learn something."""

import numpy as np
import pytest
from scipy.stats import norm

from tutorialbot.bo.optimizers import OPTIMIZERS, SkoptSearch, TwistSearch
from tutorialbot.bo.space import to_sphere, twist_features
from tutorialbot.seeding import make_rng

GOOD = np.array([0.8, -0.1, 0.3, 0.4, -0.7])


def cost(c):
    """A valley in the motion, not in the coordinates: 0 at GOOD, up to about 2."""
    return float(np.linalg.norm(twist_features(c) - twist_features(GOOD)))


def race(make, seed, trials):
    optimizer = make(make_rng(seed))
    for _ in range(trials):
        c = optimizer.ask()
        assert c.shape == (5,)
        assert (np.abs(c) <= 1.0).all()
        optimizer.tell(c, cost(c), 1.0)
    return optimizer


@pytest.mark.parametrize("name", sorted(OPTIMIZERS))
def test_same_seed_same_points(name):
    one, two, other = (race(OPTIMIZERS[name], seed, 8) for seed in (1, 1, 2))
    assert np.array_equal(one.points, two.points)
    assert not np.array_equal(one.points, other.points)
    assert any(np.array_equal(one.best(), point) for point in one.points)


def test_a_surrogate_on_twists_beats_random_where_the_cost_is_smooth():
    found = {
        name: np.mean([min(race(OPTIMIZERS[name], seed, 25).costs) for seed in range(4)])
        for name in ("twist", "random")
    }
    assert found["twist"] < 0.6 * found["random"]


def bowl(c):
    return float(np.sum((c - 0.3) ** 2))


@pytest.mark.parametrize(("name", "trials"), [("cmaes", 60), ("skopt", 20), ("optuna", 20), ("twist", 20)])
def test_every_optimiser_goes_down_a_bowl_and_knows_its_best_point(name, trials):
    """Its later points are lower than its first ones (uphill they would be higher), and `best` is among the lowest."""
    optimizer = OPTIMIZERS[name](make_rng(4))
    for _ in range(trials):
        c = optimizer.ask()
        optimizer.tell(c, bowl(c), 1.0)
    assert np.mean(optimizer.costs[-5:]) < 0.7 * np.mean(optimizer.costs[:5])
    assert bowl(optimizer.best()) <= np.sort(optimizer.costs)[2]


def test_expected_improvement_is_over_the_lowest_cost():
    """By hand, with scikit-optimize's margin of 0.01 below the lowest."""
    optimizer = race(TwistSearch, 5, 9)
    model, c = optimizer.model(), make_rng(6).uniform(-1, 1, (50, 5))
    mean, doubt = model.predict(twist_features(c), return_std=True)
    z = (min(optimizer.costs) - 0.01 - mean) / doubt
    expected = doubt * (z * norm.cdf(z) + norm.pdf(z))
    assert optimizer.acquisition(model, c) == pytest.approx(expected, abs=1e-9)


def test_only_the_acquisition_per_second_hears_of_seconds():
    for name, heard in (("EIps", (0.5, np.log(2.5))), ("EI", 0.5), ("PI", 0.5)):  # it keeps their logarithm
        optimizer = SkoptSearch(make_rng(0), name)
        assert optimizer._optimizer.acq_func == name
        optimizer.tell(optimizer.ask(), 0.5, 2.5)
        assert optimizer._optimizer.yi[-1] == pytest.approx(heard)


@pytest.mark.parametrize("acquisition", ["PI", "EI", "EIps"])
def test_acquisitions_of_scikit_optimize(acquisition):
    optimizer = race(lambda rng: SkoptSearch(rng, acquisition), 3, 7)
    assert optimizer.best() in np.array(optimizer.points)


def test_an_unknown_acquisition_is_refused():
    with pytest.raises(ValueError, match="acquisition = 'UCB'"):
        SkoptSearch(make_rng(0), "UCB")


def test_best_is_estimated_not_observed():
    """One lucky reading among many poor ones at the same place does not win over a place that is good each time."""
    optimizer = TwistSearch(make_rng(0))
    lucky, steady = np.array([0.5, 0.5, 0.0, 0.0, -1.0]), np.array([-0.5, -0.5, 0.0, 0.0, -1.0])
    rng = np.random.default_rng(1)
    for i in range(12):
        for place, value in ((lucky, -3.0 if i == 6 else 0.0), (steady, -2.0)):
            optimizer.tell(np.clip(place + 0.02 * rng.standard_normal(5), -1, 1), value, 1.0)
    assert np.min(optimizer.costs) == -3.0
    assert to_sphere(*optimizer.best()[:2]) == pytest.approx(to_sphere(*steady[:2]), abs=0.2)


def test_numpys_global_generator_is_left_alone():
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    race(OPTIMIZERS["cmaes"], 1, 6)
    assert np.array_equal(before, np.random.get_state()[1])  # noqa: NPY002
