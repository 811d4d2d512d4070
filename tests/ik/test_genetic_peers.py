"""The other methods on paper 2's targets: each reaches what it should, and fails where it must."""

import numpy as np
import pinocchio as pin
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.ik import genetic_peers as peers
from tutorialbot.ik.arm7 import ARM, Arm, forward_kinematics
from tutorialbot.ik.oracle import optimum

TILT = np.array([0.0, -1.57, 0.0])
NEAR, FAR = np.array([0.3, 0.2, 0.1]), np.array([0.3, 0.1, 0.0])
METHODS = {
    "clik": peers.clik,
    "pink": peers.pink_ik,
    "slsqp": peers.slsqp,
    "cma_es": lambda *target, **options: peers.cma_es(*target, seed=3401, **options),
    "closed_form": peers.closed_form,
}


@pytest.mark.parametrize("name", METHODS)
def test_what_is_in_reach_is_reached(name):
    found = METHODS[name](NEAR, TILT)
    assert found.converged and found.residual < 1e-5 and found.within_limits


@pytest.mark.parametrize("name", METHODS)
def test_out_of_reach_all_find_the_optimum_but_those_of_squares(name):
    """CLIK and pink minimise squares in metres and radians together, and spread the error."""
    found, best = METHODS[name](FAR, TILT), optimum(FAR, TILT)
    assert not found.converged and found.within_limits
    if name == "pink":
        assert found.residual > best.residual + 5e-3 and found.evaluations < 100  # it came to rest
    elif name == "clik":
        assert np.abs(found.tilt_error).max() > 0.1 and found.residual > 2 * best.residual
    else:
        assert found.residual == pytest.approx(best.residual, abs=2e-5)
        assert found.binding == ("radial deviation",)


def test_pinocchios_model_is_the_arm():
    turned = Arm(axes=np.roll(ARM.axes, 2, axis=0))
    for arm in (ARM, turned):
        model = peers.pinocchio_model(arm)
        data = model.createData()
        for q in np.random.default_rng(3402).uniform(-3, 3, (20, 7)):
            pin.framesForwardKinematics(model, data, q)
            tip = data.oMf[model.getFrameId("thumb root")].translation
            np.testing.assert_allclose(tip, forward_kinematics(q, arm=arm)[0], atol=1e-12)


def test_pink_stays_within_the_limits_and_stops():
    """From anywhere within them, and from outside; near the answer it needs a step or two."""
    model = peers.pinocchio_model()
    for q in np.random.default_rng(3405).uniform(ARM.lower - 0.5, ARM.upper + 0.5, (20, 7)):
        found = peers.pink_ik(NEAR, TILT, initial=q, model=model)
        assert found.within_limits and 1 <= found.evaluations <= 300
    there = peers.pink_ik(NEAR, TILT)
    again = peers.pink_ik(NEAR, TILT, initial=there.q)
    assert again.converged and again.evaluations <= 2
    assert peers.pink_ik(NEAR, TILT, iterations=1).evaluations == 1
    wider = ARM.with_limit("radial deviation", np.deg2rad(-30))
    assert peers.pink_ik(FAR, TILT, arm=wider).converged and not peers.pink_ik(FAR, TILT).converged


def test_seeds_and_starts():
    one, other = (peers.cma_es(NEAR, TILT, seed=3403) for _ in range(2))
    np.testing.assert_array_equal(one.q, other.q)
    assert one.evaluations == one.history.evaluations[-1] <= 20_000 and one.evaluations % 20 == 0
    found = peers.slsqp(FAR, TILT, initial=None, seed=3404, starts=4)
    assert found.residual == pytest.approx(optimum(FAR, TILT).residual, abs=1e-6)
    assert found.evaluations > peers.slsqp(FAR, TILT, initial=None, seed=3404, starts=1).evaluations > 0


def test_misuse():
    for method in METHODS.values():
        with pytest.raises(InvalidValue, match="^position = "):
            method([0.3, 0.1], TILT)
        with pytest.raises(InvalidType, match="^arm = "):
            method(NEAR, TILT, arm="left")
    with pytest.raises(InvalidValue, match="initial"):
        peers.clik(NEAR, TILT, initial=np.zeros(6))
    with pytest.raises(InvalidValue, match="damping"):
        peers.clik(NEAR, TILT, damping=0.0)
    for name in ("damping", "near", "stall"):
        with pytest.raises(InvalidValue, match=f"^{name} = "):
            peers.pink_ik(NEAR, TILT, **{name: 0.0})
    with pytest.raises(InvalidValue, match="initial"):
        peers.pink_ik(NEAR, TILT, initial=np.zeros(6))
    with pytest.raises(InvalidValue, match="iterations"):
        peers.pink_ik(NEAR, TILT, iterations=0)
    with pytest.raises(InvalidValue, match="evaluations"):
        peers.cma_es(NEAR, TILT, seed=1, evaluations=5)
    with pytest.raises(InvalidValue, match="starts"):
        peers.slsqp(NEAR, TILT, starts=0)
