"""The closed-form inverse kinematics against pinocchio's forward kinematics."""

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue, TutorialbotError
from tutorialbot.ik import srs
from tutorialbot.ik.singularity_consistent import SphericalArm

ARM = SphericalArm()


def postures(count: int, seed: int = 0) -> np.ndarray:
    q = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 7)) * ARM.limits
    q[:, 3] = np.abs(q[:, 3])
    return q


def poses(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = [ARM.forward(row) for row in q]
    return np.array([pose.rotation for pose in found]), np.array([pose.translation for pose in found])


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference of angles, once round or not."""
    return float(np.abs((a - b + np.pi) % (2.0 * np.pi) - np.pi).max())


@pytest.mark.parametrize("branch", srs.BRANCHES)
def test_every_branch_reaches_the_pose_with_the_swivel_asked_for(branch):
    q = postures(200)
    rotation, position = poses(q)
    wanted = srs.swivel(ARM, q)
    found, reached = srs.inverse(ARM, rotation, position, wanted, branch)
    assert reached.all()
    again, there = poses(found)
    assert np.abs(again - rotation).max() < 1e-9
    assert np.abs(there - position).max() < 1e-9
    assert apart(srs.swivel(ARM, found), wanted) < 1e-9
    assert (np.sign(found[:, [1, 5]]) == branch).all()


def test_the_posture_that_a_pose_comes_from_is_among_its_branches():
    q = postures(200, seed=1)
    rotation, position = poses(q)
    found = [srs.inverse(ARM, rotation, position, srs.swivel(ARM, q), branch)[0] for branch in srs.BRANCHES]
    for i, posture in enumerate(q):
        assert min(apart(branch[i], posture) for branch in found) < 1e-6


def test_swivel_is_zero_with_the_elbow_on_top_and_pi_below():
    up, down = np.array([[0.0, 0.9, 0.0, 1.0, 0.0, 0.5, 0.0], [0.0, 2.0, np.pi, 1.0, 0.0, 0.5, 0.0]])
    assert srs.chain(ARM, up)[2, 2] > srs.chain(ARM, up)[[1, 3], 2].mean()
    assert abs(srs.swivel(ARM, up)) < 1e-12
    assert srs.chain(ARM, down)[2, 2] < srs.chain(ARM, down)[[1, 3], 2].mean()
    assert abs(abs(srs.swivel(ARM, down)) - np.pi) < 1e-12


def test_an_elbow_with_negative_angle_is_the_same_arm_turned_by_half():
    q = postures(100, seed=2)
    other = q * [1, 1, 1, -1, 1, 1, 1] + [0, 0, np.pi, 0, np.pi, 0, 0]
    assert np.abs(srs.chain(ARM, other) - srs.chain(ARM, q)).max() < 1e-12
    assert apart(srs.swivel(ARM, other), srs.swivel(ARM, q)) < 1e-9


def test_chain_ends_where_pinocchio_says():
    q = postures(50, seed=3)
    assert np.abs(srs.chain(ARM, q)[:, 4] - poses(q)[1]).max() < 1e-12


def test_out_of_reach_and_straight_above_are_results():
    eye = np.eye(3)
    far = srs.inverse(ARM, eye, np.array([1.5, 0.0, 0.3]), 0.0)
    above = srs.inverse(ARM, eye, np.array([0.0, 0.0, 0.15 + 0.5 + 0.15]), 0.0)
    near = srs.inverse(ARM, eye, np.array([0.3, 0.0, 0.5]), 0.0)
    assert [bool(case[1]) for case in (far, above, near)] == [False, False, True]


def test_swivels_and_poses_broadcast():
    rotation, position = poses(postures(5))
    q, reached = srs.inverse(ARM, rotation, position, np.linspace(-1.0, 1.0, 3)[:, None])
    assert q.shape == (3, 5, 7) and reached.shape == (3, 5)
    one, _ = srs.inverse(ARM, rotation[4], position[4], 1.0)
    assert np.abs(one - q[2, 4]).max() == 0.0


@pytest.mark.parametrize(
    ("change", "error", "named"),
    [
        ({"branch": (1, 0)}, InvalidValue, "branch"),
        ({"rotation": np.eye(2)}, InvalidValue, "rotation"),
        ({"rotation": "here"}, InvalidType, "rotation"),
        ({"position": np.zeros(2)}, InvalidValue, "position"),
        ({"position": [0.0, np.nan, 0.0]}, InvalidValue, "position"),
        ({"swivel": np.inf}, InvalidValue, "swivel"),
    ],
)
def test_bad_input_is_named(change, error, named):
    arguments = {"rotation": np.eye(3), "position": np.array([0.3, 0.0, 0.5]), "swivel": 0.0} | change
    with pytest.raises(error, match=named):
        srs.inverse(ARM, **arguments)


def test_swivel_refuses_what_is_no_posture():
    with pytest.raises(InvalidValue, match="q"):
        srs.swivel(ARM, np.zeros(6))


@pytest.mark.parametrize("call", [srs.within, srs.chain, srs.swivel])
@pytest.mark.parametrize("q", [np.zeros(6), np.zeros((7, 2)), np.full(7, np.nan), "arm", None, 3.0], ids=repr)
def test_what_is_no_posture_is_named(call, q):
    with pytest.raises(TutorialbotError, match="^q = "):
        call(ARM, q)
    with pytest.raises(InvalidType, match="^arm = "):
        call("left", np.zeros(7))


def test_many_postures_at_once_and_lists_of_them():
    q = postures(12).reshape(3, 4, 7)
    assert srs.within(ARM, q).shape == (3, 4) and srs.within(ARM, q).all()
    assert srs.within(ARM, q.tolist(), 3.0).sum() == 0
    assert srs.chain(ARM, q.tolist()).shape == (3, 4, 5, 3)
    with pytest.raises(TutorialbotError, match="^margin = "):
        srs.within(ARM, q, np.nan)
