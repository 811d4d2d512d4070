"""Both libraries must read the same robot: kinematics, limits and mass against each other."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from tutorialbot import robots
from tutorialbot.errors import BrokenFile, InvalidValue


@pytest.fixture(scope="module")
def both():
    return robots.load("mobile_manipulator"), robots.load_pinocchio("mobile_manipulator", robots.BASE + robots.ARM)


def test_forward_kinematics_agree(both):
    mj, model = both
    mj_data, data, rng = mujoco.MjData(mj), model.createData(), np.random.default_rng(5)
    address = [mj.joint(joint).qposadr[0] for joint in robots.BASE + robots.ARM]
    for _ in range(100):
        q = rng.uniform(-3, 3, model.nq)
        mj_data.qpos[address] = q
        mujoco.mj_kinematics(mj, mj_data)
        pin.framesForwardKinematics(model, data, q)
        for site in ("tool", "wrist"):
            pose = data.oMf[model.getFrameId(site)]
            np.testing.assert_allclose(pose.translation, mj_data.site(site).xpos, atol=1e-12)
            np.testing.assert_allclose(pose.rotation.ravel(), mj_data.site(site).xmat, atol=1e-12)


def test_limits_and_mass_agree(both):
    mj, model = both
    for i, joint in enumerate(robots.BASE + robots.ARM):
        if mj.joint(joint).limited:
            low, high = mj.joint(joint).range
            assert (model.lowerPositionLimit[i], model.upperPositionLimit[i]) == (low, high)
        else:
            assert np.isinf(model.upperPositionLimit[i])
    assert sum(inertia.mass for inertia in model.inertias) == pytest.approx(mj.body_mass.sum()) == 140


def test_the_choice_of_joints_keeps_the_files_order():
    arm = robots.load_pinocchio("mobile_manipulator", robots.ARM[::-1])
    assert list(arm.names)[1:] == list(robots.ARM) and arm.nq == 6
    assert robots.load_pinocchio("mobile_manipulator").nq == 13


def test_unknown_names_list_the_known_ones():
    with pytest.raises(InvalidValue, match="'mobile_manipulator'"):
        robots.load("no_robot")
    with pytest.raises(InvalidValue, match="'arm_6'"):
        robots.load_pinocchio("mobile_manipulator", ["arm_7"])
    with pytest.raises(InvalidValue, match="all or none of base_x, base_y, base_yaw"):
        robots.load_pinocchio("mobile_manipulator", ["base_x"])


CUT, BAD = "<mujoco><worldbody><body>", "<mujoco><worldbody><body pos='x'/></worldbody></mujoco>"


@pytest.mark.parametrize("text", ["", CUT, BAD])
@pytest.mark.parametrize("loader", [robots.load, robots.load_pinocchio])
def test_broken_files_are_named(tmp_path, monkeypatch, text, loader):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "robot.xml").write_text(text)
    monkeypatch.setattr(robots, "MODELS", tmp_path)
    with pytest.raises(BrokenFile, match="mine/robot.xml"):
        loader("mine")
