"""The home robot: its arm against forward kinematics written by hand, its symmetry, its measures."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from tutorialbot import robots
from tutorialbot.errors import BrokenFile, InvalidType
from tutorialbot.scene import home_robot
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import ARM, ARM_RADIUS, MOVING

SEEN, SOLID = 2, 3
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # half a turn about x


def shift(z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[2, 3] = z
    return matrix


def about(axis: str, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    turn = {"z": [[c, -s, 0], [s, c, 0], [0, 0, 1]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}[axis]
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    return matrix


def by_hand(q: np.ndarray) -> np.ndarray:
    """Pose of the arm's tip seen from its anchor: ZYZ-Y-ZYZ, 0.15, 0.35, 0.35 and 0.15 m."""
    pose = shift(0.15)
    for i, (axis, after) in enumerate(zip("zyzyzyz", (0.0, 0.0, 0.35, 0.35, 0.0, 0.0, 0.15), strict=True)):
        pose = pose @ about(axis, q[i]) @ shift(after)
    return pose


def postures(count: int, seed: int = 4) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (count, 7))


@pytest.fixture(scope="module")
def robot():
    model = robots.load(home_robot.NAME)
    return model, mujoco.MjData(model)


def test_mujoco_and_pinocchio_have_the_arm_of_the_method(robot):
    mj, data = robot
    model = robots.load_pinocchio(home_robot.NAME, MOVING)
    known, tip = model.createData(), model.getFrameId("tip")
    rng = np.random.default_rng(8)
    address = [mj.joint(name).qposadr[0] for name in MOVING]
    for q in postures(100):
        x, y, yaw = base = rng.uniform(-3.0, 3.0, 3)
        expected = about("z", yaw) @ shift(0.70) @ by_hand(q)
        expected[:2, 3] += x, y
        data.qpos[address] = np.concatenate([base, q])
        mujoco.mj_kinematics(mj, data)
        np.testing.assert_allclose(data.site("tip").xpos, expected[:3, 3], atol=1e-12)
        np.testing.assert_allclose(data.site("tip").xmat, expected[:3, :3].ravel(), atol=1e-12)
        pin.framesForwardKinematics(model, known, np.concatenate([base, q]))
        np.testing.assert_allclose(known.oMf[tip].homogeneous, expected, atol=1e-12)


def test_the_arm_alone_can_be_loaded_for_kinematics():
    model = robots.load_pinocchio(home_robot.NAME, ARM)
    data = model.createData()
    q = postures(1)[0]
    pin.framesForwardKinematics(model, data, q)
    seen = data.oMf[model.getFrameId("anchor")].actInv(data.oMf[model.getFrameId("tip")])
    np.testing.assert_allclose(seen.homogeneous, by_hand(q), atol=1e-12)


def test_limits_and_mass_agree(robot):
    mj, model = robot[0], robots.load_pinocchio(home_robot.NAME, MOVING)
    for i, degrees in enumerate((170, 125, 170, 150, 170, 125, 170), start=1):
        low, high = mj.joint(f"arm_{i}").range
        assert (low, high) == pytest.approx((-np.deg2rad(degrees), np.deg2rad(degrees)))
        assert (model.lowerPositionLimit[2 + i], model.upperPositionLimit[2 + i]) == (low, high)
    assert sum(inertia.mass for inertia in model.inertias) == pytest.approx(mj.body_mass.sum())


def test_links_mirror_each_other(robot):
    mj = robot[0]
    for near, far in (("link_1", "link_6"), ("link_2", "link_5"), ("link_3", "link_4")):
        assert mj.body(near).mass == mj.body(far).mass
        assert mj.body(near).inertia == pytest.approx(mj.body(far).inertia)
    end = sum(float(mj.body(name).mass[0]) for name in ("link_7", "finger_left", "finger_right"))
    assert float(mj.body("link_0").mass[0]) == pytest.approx(end)


def hung(pose: np.ndarray, q: np.ndarray) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The arm alone, held at the frame `pose`."""
    model = home_robot.arm_spec().compile()
    data = mujoco.MjData(model)
    data.mocap_pos[0] = pose[:3, 3]
    mujoco.mju_mat2Quat(data.mocap_quat[0], np.ascontiguousarray(pose[:3, :3]).ravel())
    data.qpos[[model.joint(name).qposadr[0] for name in ARM]] = q
    mujoco.mj_forward(model, data)
    return model, data


def test_an_arm_that_holds_by_its_other_end_looks_the_same():
    """Every thing to be seen is where its mirror image was: nothing moves when base and tip exchange."""
    for q in postures(5):
        model, one = hung(np.eye(4), q)
        _, other = hung(by_hand(q) @ FLIP, q[::-1])
        np.testing.assert_allclose(other.site("tip").xpos, 0.0, atol=1e-12)
        shown = [g for g in range(model.ngeom) if model.geom_group[g] == SEEN]
        kind = np.column_stack([model.geom_type[shown], model.geom_size[shown], 100.0 * model.geom_dataid[shown]])
        gap = np.linalg.norm(one.geom_xpos[shown][:, None] - other.geom_xpos[shown], axis=-1)
        halves = [model.mesh(name).id for name in ("half_left", "half_right")]
        alike = (np.abs(kind[:, None] - kind).max(-1) < 1e-6) & ~np.isin(model.geom_dataid[shown], halves)
        matched = np.where(alike, gap, np.inf).min(1)
        assert np.isinf(matched).sum() <= 2 and (matched[np.isfinite(matched)] < 2e-4).all()


def surface(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    """Outermost points of a geom (n, 3) in the world."""
    size, rotation = model.geom_size[geom], data.geom_xmat[geom].reshape(3, 3)
    ways = np.random.default_rng(1).normal(size=(400, 3))
    ways = np.vstack([ways / np.linalg.norm(ways, axis=1, keepdims=True), np.eye(3), -np.eye(3)])
    kind = mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        first = model.mesh_vertadr[model.geom_dataid[geom]]
        points = model.mesh_vert[first : first + model.mesh_vertnum[model.geom_dataid[geom]]]
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        points = size * np.sign(ways)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        flat = ways[:, :2] / np.linalg.norm(ways[:, :2], axis=1, keepdims=True).clip(1e-9)
        points = np.column_stack([size[0] * flat, size[1] * np.sign(ways[:, 2])])
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        points = size[0] * ways + np.column_stack([0 * ways[:, :2], size[1] * np.sign(ways[:, 2])])
    elif kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        points = ways * size
    else:
        points = size[0] * ways
    return points @ rotation.T + data.geom_xpos[geom]


def test_what_is_seen_keeps_to_the_measures(robot):
    model, data = robot
    data.qpos[:] = 0.0
    mujoco.mj_forward(model, data)
    lowest = np.inf
    for g in range(model.ngeom):
        points, wearer = surface(model, data, g), model.body(model.geom_bodyid[g]).name
        across = np.hypot(points[:, 0], points[:, 1]).max()
        lowest = min(lowest, points[:, 2].min())
        if wearer.startswith(("link", "finger")):
            assert across < ARM_RADIUS + 0.005, (wearer, across)
            assert points[:, 2].max() < 0.70 + 1.0 + 0.0211
        elif wearer == "mast" or points[:, 2].max() > home_robot.BASE_HEIGHT + 1e-3:
            assert across < home_robot.MAST_RADIUS + 1e-9, wearer
        else:
            assert across < home_robot.BASE_RADIUS + 1e-5, wearer
    assert lowest == pytest.approx(0.0, abs=2e-3)  # the rollers are on the floor


def test_what_is_seen_has_neither_mass_nor_contact(robot):
    spec = home_robot.robot_spec()
    of_eye = [geom for geom in spec.geoms if geom.group == SEEN]
    assert of_eye and all(g.mass == 0.0 and g.contype == 0 and g.conaffinity == 0 for g in of_eye)
    assert all(g.contype and g.conaffinity for g in spec.geoms if g.group == SOLID)
    for geom in of_eye:
        spec.delete(geom)
    bare = spec.compile()
    for array in ("body_mass", "body_inertia", "body_ipos"):
        np.testing.assert_array_equal(getattr(bare, array), getattr(robot[0], array))


def test_constants_are_those_of_the_file(robot):
    model, data = robot
    data.qpos[:] = 0.0
    mujoco.mj_forward(model, data)
    assert model.geom("base_rim").size[0] == home_robot.BASE_RADIUS > model.geom("base_body").size[0]
    assert data.geom("base_body").xpos[2] + model.geom("base_body").size[1] == pytest.approx(home_robot.BASE_HEIGHT)
    assert model.geom("mast").size[0] == home_robot.MAST_RADIUS
    assert data.site("anchor").xpos[2] == pytest.approx(home_robot.ANCHOR_HEIGHT)
    assert {model.geom(f"link_{i}").size[0] for i in (0, 3, 4, 7)} == {ARM_RADIUS}
    assert model.geom("hand_pad").size[0] == home_robot.PAD_RADIUS
    behind = data.site("tip").xpos[2] - data.geom("hand_pad").xpos[2]
    assert behind == pytest.approx(home_robot.PAD_BEHIND)
    assert [model.joint(jaw).range[1] for jaw in home_robot.JAWS] == [home_robot.JAW_OPEN] * 2
    for wheel, name in zip(home_robot.WHEELS, home_robot.WHEEL_JOINTS, strict=True):
        place, rotation = data.body(name).xpos, data.body(name).xmat.reshape(3, 3)
        assert place == pytest.approx([wheel.x, wheel.y, wheel.radius], abs=1e-9)
        assert rotation[:, 0] == pytest.approx([np.cos(wheel.angle), np.sin(wheel.angle), 0.0], abs=1e-9)


def test_the_base_without_its_arm_and_fixtures_on_the_wall():
    base = home_robot.base_spec().compile()
    assert [base.joint(i).name for i in range(base.njnt)] == [*robots.BASE, *home_robot.WHEEL_JOINTS]
    door = ClosingDoor()
    frame = home_robot.fixture_frame(door, 1.3, 1.0)
    np.testing.assert_allclose(frame.rotation[:, 2], [0, -1, 0])
    assert np.linalg.det(frame.rotation) == pytest.approx(1.0)
    spec = door.spec()
    home_robot.add_fixture(spec, frame)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.site("fixture").xmat, frame.rotation.ravel(), atol=1e-12)
    mine = [g for g in range(model.ngeom) if model.geom_bodyid[g] == model.body("fixture").id]
    assert max(surface(model, data, g)[:, 1].max() for g in mine) == pytest.approx(door.wall[0])  # it sits on the wall
    with pytest.raises(InvalidType, match="frame"):
        home_robot.add_fixture(door.spec(), np.eye(4))


def test_base_and_arm_apart_look_like_the_robot_and_then_part(robot):
    mj, whole = robot
    model, q = home_robot.apart(ClosingDoor().spec()), postures(1)[0]
    whole.qpos[:] = 0.0
    whole.qpos[[mj.joint(name).qposadr[0] for name in MOVING]] = [0.3, -0.8, 0.5, *q]
    mujoco.mj_forward(mj, whole)
    anchor = pin.SE3(whole.site("anchor").xmat.reshape(3, 3).copy(), whole.site("anchor").xpos.copy())
    tip = anchor * pin.SE3(by_hand(q))
    data = mujoco.MjData(model)
    swapped = tip * pin.SE3(FLIP)  # held by the other end
    for pose, values, end in ((anchor, q, tip), (swapped, q[::-1], anchor * pin.SE3(FLIP))):
        data.qpos[:] = home_robot.apart_qpos(model, np.array([0.3, -0.8, 0.5]), pose, values)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.site("arm/tip").xpos, end.translation, atol=1e-12)
        np.testing.assert_allclose(data.site("arm/tip").xmat, end.rotation.ravel(), atol=1e-12)
        np.testing.assert_allclose(data.site("base/anchor").xpos, anchor.translation, atol=1e-12)
    with pytest.raises(InvalidType, match="anchor"):
        home_robot.apart_qpos(model, np.zeros(3), np.eye(4), q)
    with pytest.raises(ValueError, match="base"):
        home_robot.apart_qpos(model, np.zeros(2), anchor, q)


def test_a_wall_stands_behind_its_fixture():
    frame = pin.SE3(np.column_stack([[0, 0, 1.0], [0, 1.0, 0], [-1.0, 0, 0]]), np.array([0.75, 0.2, 1.1]))
    spec = mujoco.MjSpec()
    home_robot.add_fixture(spec, frame)
    home_robot.add_wall(spec, frame)
    model = home_robot.apart(spec)
    data = mujoco.MjData(model)
    data.qpos[:] = home_robot.apart_qpos(model, np.zeros(3), frame, np.zeros(7), jaws=home_robot.JAW_OPEN)
    mujoco.mj_forward(model, data)
    corners = surface(model, data, model.geom("wall").id)
    assert corners[:, 0].min() == pytest.approx(0.75 + home_robot.FIXTURE_STAND_OFF)
    assert corners[:, 2].min() == pytest.approx(0.0) and corners[:, 1].min() < 0.2 < corners[:, 1].max()
    assert data.joint("arm/jaw_left").qpos[0] == home_robot.JAW_OPEN
    with pytest.raises(ValueError, match="fixture"):
        home_robot.add_wall(spec, pin.SE3.Identity())
    with pytest.raises(ValueError, match="jaws"):
        home_robot.apart_qpos(model, np.zeros(3), frame, np.zeros(7), jaws=1.0)


def test_a_broken_file_is_named(tmp_path, monkeypatch):
    (tmp_path / "home_robot").mkdir()
    (tmp_path / "home_robot" / "robot.xml").write_text("<mujoco><worldbody>")
    monkeypatch.setattr(home_robot.paths, "MODELS", tmp_path)
    with pytest.raises(BrokenFile, match="home_robot/robot.xml"):
        home_robot.robot_spec()
