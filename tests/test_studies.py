"""Studies: the rows say what the method note found, and targets are what their names promise."""

import numpy as np
import pinocchio as pin
import pytest

from tutorialbot import studies
from tutorialbot.errors import InvalidValue


def test_comparison_of_inverse_kinematics():
    rows = {(row.method, row.targets): row for row in studies.compare(seed=301, targets=15)}
    assert len(rows) == 9
    for method in ("virtual springs", "damped least squares", "strict null space"):
        assert rows[method, "reachable"].converged == 1.0
        assert rows[method, "reachable"].position_error < 1e-4
        assert rows[method, "too high"].converged == 0.0
    for kind in ("base locked", "too high"):
        ours, damped = rows["virtual springs", kind], rows["damped least squares", kind]
        assert ours.settled == 1.0 and ours.motion_after < 1e-3
        assert ours.position_error < damped.position_error
    assert rows["damped least squares", "base locked"].settled < 0.5


@pytest.mark.parametrize("kind", studies.TARGETS)
def test_targets_keep_their_promise(kind):
    for case in studies.ik_targets(kind, 20, 302):
        data = case.model.createData()
        pin.framesForwardKinematics(case.model, data, case.q0)
        apart = data.oMf[case.model.getFrameId("tool")].actInv(case.target)
        distance, turn = np.linalg.norm(apart.translation), np.linalg.norm(pin.log3(apart.rotation))
        assert turn <= np.pi / 3 + 1e-9
        if kind == "reachable":
            assert distance <= 0.3
        if kind == "base locked":
            assert 0.8 <= distance <= 1.2 and case.model.nv == 6
        if kind == "too high":
            assert distance > 0.9 and case.model.nv == 9


def test_the_same_seed_draws_the_same_targets():
    a, b = (studies.ik_targets("reachable", 3, 303) for _ in range(2))
    assert all(x.target == y.target and (x.q0 == y.q0).all() for x, y in zip(a, b, strict=True))
    with pytest.raises(InvalidValue, match="kind"):
        studies.ik_targets("near", 1, 0)
