"""The arm of paper 3: one geometry in Python, MuJoCo and pinocchio, and no way to meet itself or the ground."""

import coal
import mujoco
import numpy as np
import pinocchio as pin
import pytest

from tutorialbot import robots
from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.vox2c import arm


@pytest.fixture(scope="module")
def robot():
    model = robots.load("rrbot")
    return model, mujoco.MjData(model)


def angles(count: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-7, 7, (count, 2))


def test_the_files_geometry_is_the_codes(robot):
    model, data = robot
    pinocchio = robots.load_pinocchio("rrbot")
    other, tip = pinocchio.createData(), pinocchio.getFrameId("tip")
    for q, points in zip(angles(50), arm.forward_kinematics(angles(50)), strict=True):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        poses = arm.link_poses(q)
        for name, pose, slab in zip(("link2", "link3"), poses, arm.SLABS, strict=True):
            np.testing.assert_allclose(data.body(name).xpos, pose.translation, atol=1e-12)
            np.testing.assert_allclose(data.geom(name).xpos, pose.act(np.array([0, 0, arm.MIDDLE])), atol=1e-12)
            np.testing.assert_allclose(data.geom(name).xmat, pose.rotation.ravel(), atol=1e-12)
            np.testing.assert_allclose(model.geom(name).size, (arm.HALF_WIDTH, arm.HALF_WIDTH, arm.HALF_LENGTH))
            assert data.geom(name).xpos[1] == pytest.approx(np.mean(slab)) and np.diff(slab) == pytest.approx(0.05)
        np.testing.assert_allclose(points[0], arm.JOINT_1, atol=1e-12)
        np.testing.assert_allclose(points[1], data.body("link3").xpos, atol=1e-12)
        np.testing.assert_allclose(points[2], data.site("tip").xpos, atol=1e-12)
        pin.framesForwardKinematics(pinocchio, other, q)
        np.testing.assert_allclose(other.oMf[tip].translation, points[2], atol=1e-12)
    column = model.geom("link1")
    np.testing.assert_allclose([column.pos - column.size, column.pos + column.size], arm.COLUMN)


def test_a_positive_angle_leans_toward_x():
    joint, elbow, tip = arm.forward_kinematics((np.pi / 2, -np.pi / 2))[0]
    np.testing.assert_allclose(elbow - joint, [0.45, 0.05, 0.0], atol=1e-12)
    np.testing.assert_allclose(tip - elbow, [0.0, 0.0, 0.475], atol=1e-12)


def test_the_arm_never_meets_itself():
    """Column, link 2 and link 3 keep to slabs along y that share at most a face, whatever the angles."""
    slabs = [(arm.COLUMN[0][1], arm.COLUMN[1][1]), *arm.SLABS]
    for (_, high), (low, _) in zip(slabs[:-1], slabs[1:], strict=True):
        assert low >= high
    for q in angles(100):  # no turn about y leaves a slab, wherever the joints are
        for pose, (low, high) in zip(arm.link_poses(q), arm.SLABS, strict=True):
            corners = np.array(np.meshgrid([-1, 1], [-1, 1], [0, 1])).reshape(3, -1).T
            corners = corners * arm.HALF_WIDTH * [1, 1, 0] + corners * [0, 0, 0.5] + [0, 0, -0.025]
            y = np.array([pose.act(corner) for corner in corners])[:, 1]
            assert y.min() >= low - 1e-12 and y.max() <= high + 1e-12


def test_coal_finds_the_links_apart():
    bar = coal.Box(0.05, 0.0499, 0.5)  # thinner by a tenth of a millimetre: to coal, faces that touch collide
    middle = np.array([0, 0, arm.MIDDLE])
    for q in angles(300, 2):
        placed = [coal.Transform3s(pose.rotation, pose.act(middle)) for pose in arm.link_poses(q)]
        assert not coal.collide(bar, placed[0], bar, placed[1], coal.CollisionRequest(), coal.CollisionResult())


def test_the_arm_never_meets_the_ground_and_stays_in_the_domain():
    """Straight down the tip is lowest: 0.975 - 0.45 - 0.475 m, less what half a width adds at the best lean."""
    reach = arm.ELBOW + np.hypot(arm.MIDDLE + arm.HALF_LENGTH, arm.HALF_WIDTH)
    assert arm.JOINT_1[2] - reach > 0.049
    low, high = np.array(arm.DOMAIN)
    for axis in (0, 2):
        assert arm.JOINT_1[axis] - reach > low[axis] and arm.JOINT_1[axis] + reach < high[axis]


def test_mujoco_finds_no_contact_in_an_empty_scene(robot):
    model, data = robot
    model.geom_conaffinity[model.geom_contype > 0] = 1  # the bars may meet each other for once
    try:
        for q in angles(300, 3):
            data.qpos[:] = q
            mujoco.mj_forward(model, data)
            assert all(contact.dist > -1e-9 for contact in data.contact)
    finally:
        model.geom_conaffinity[model.geom_contype > 0] = 2


@pytest.mark.parametrize(
    ("q", "error"),
    [((0.0, np.nan), InvalidValue), ((0, 0, 0), InvalidValue), ("up", InvalidType), (None, InvalidValue)],
)
def test_odd_configurations_are_named(q, error):
    for call in (arm.link_poses, arm.forward_kinematics):
        with pytest.raises(error, match="^q = "):
            call(q)
