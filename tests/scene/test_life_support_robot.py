"""Paper 2's robot and its vacuum cleaner: kinematics, looks, hand, sensors, and how the arm holds the tool."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from tests.scene.postures import HAND_FORWARD, arm, posture
from tests.scene.test_models import SEEN, SOLID, reach, seen, wearer
from tutorialbot import robots
from tutorialbot.paths import MODELS
from tutorialbot.scene import omni
from tutorialbot.scene import room as rooms
from tutorialbot.scene.room import ABDOMEN_HEIGHT, ARM, FINGERS, GRASP, NOZZLE_FROM_TIP, WORKING_HEIGHT

NAME = "life_support_robot"
AXES = "yxzyzxy"  # the reconstruction: axes from base to tip, limits, links
LIMITS_DEG = [(-180, 60), (-20, 120), (-90, 90), (-145, 0), (-90, 90), (-60, 60), (-15, 30)]
SHOULDER, UPPER, FOREARM, HAND = (0, 0.16, 0.38), (0, 0, -0.31), (0, 0, -0.23), (0.03, 0, -0.08)
MASS, TOOL_MASS, GRAVITY = 48.0, 1.6, 9.81
BASE = np.array([0.8, 1.0, 0.0])


@pytest.fixture(scope="module")
def robot():
    model = robots.load(NAME)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def world(tip=(0.3, 0.2, WORKING_HEIGHT), **options):
    """The nearly empty room, the robot at rest with the thumb's root at `tip` from the abdomen."""
    model, _ = rooms.assemble(rooms.ROOMS["spare room"], seen=False, **options)
    data = mujoco.MjData(model)
    rooms.place(model, data, BASE, posture(*tip))
    return model, data


def by_hand(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and rotation of the thumb's root in the abdomen's frame: a product of plain rotations."""
    position, turn = np.array(SHOULDER, float), np.eye(3)
    links = {2: UPPER, 3: FOREARM, 6: HAND}  # after joint number
    for i, (axis, angle) in enumerate(zip(AXES, q, strict=True)):
        c, s = np.cos(angle), np.sin(angle)
        turn = (
            turn
            @ {
                "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
                "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
                "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
            }[axis]
        )
        position = position + turn @ links.get(i, (0, 0, 0))
    return position, turn


def test_mujoco_pinocchio_and_a_product_of_rotations_agree(robot):
    model = robot[0]
    data, pinocchio, rng = mujoco.MjData(model), arm(), np.random.default_rng(7)
    pin_data = pinocchio.createData()
    assert list(pinocchio.names)[1:] == list(ARM)
    for _ in range(200):
        q = rng.uniform(-3, 3, 7)
        for name, angle in zip(ARM, q, strict=True):
            data.joint(name).qpos[:] = angle
        mujoco.mj_kinematics(model, data)
        pin.framesForwardKinematics(pinocchio, pin_data, q)
        origin, tip = (pin_data.oMf[pinocchio.getFrameId(name)] for name in ("abdomen", "tip"))
        relative, (position, turn) = origin.actInv(tip), by_hand(q)
        np.testing.assert_allclose(data.site("tip").xpos - data.site("abdomen").xpos, position, atol=1e-12)
        np.testing.assert_allclose(data.site("tip").xmat.reshape(3, 3), turn, atol=1e-12)
        np.testing.assert_allclose(relative.translation, position, atol=1e-12)
        np.testing.assert_allclose(relative.rotation, turn, atol=1e-12)


def test_base_and_arm_together_agree(robot):
    model, data = robot[0], mujoco.MjData(robot[0])
    whole = robots.load_pinocchio(NAME, robots.BASE + ARM)
    pin_data, rng = whole.createData(), np.random.default_rng(8)
    for _ in range(20):
        q = rng.uniform(-3, 3, whole.nq)
        for name, value in zip(robots.BASE + ARM, q, strict=True):
            data.joint(name).qpos[:] = value
        mujoco.mj_kinematics(model, data)
        pin.framesForwardKinematics(whole, pin_data, q)
        for site in ("tip", "wrist", "abdomen"):
            np.testing.assert_allclose(
                pin_data.oMf[whole.getFrameId(site)].translation, data.site(site).xpos, atol=1e-12
            )


def test_axes_limits_and_mass(robot):
    model, _ = robot
    everything = robots.load_pinocchio(NAME)
    for i, (name, axis, limits) in enumerate(zip(ARM, AXES, LIMITS_DEG, strict=True)):
        joint = model.joint(name)
        np.testing.assert_array_equal(joint.axis, np.eye(3)["xyz".index(axis)])
        np.testing.assert_allclose(joint.range, np.deg2rad(limits), atol=1e-15)
        assert (arm().lowerPositionLimit[i], arm().upperPositionLimit[i]) == tuple(joint.range)
    assert model.body_mass.sum() == pytest.approx(MASS, abs=1e-9)
    assert sum(inertia.mass for inertia in everything.inertias) == pytest.approx(MASS, abs=1e-9)
    right = [b for b in range(model.nbody) if model.body(b).name.startswith("right_arm")]
    assert len(right) == 3 and all(model.body_weldid[b] == model.body("base").id for b in right)  # fixed


def test_at_zero_the_arm_hangs_and_tip_and_abdomen_have_the_same_axes(robot):
    _, data = robot
    np.testing.assert_allclose(data.site("abdomen").xpos, [0, 0, ABDOMEN_HEIGHT], atol=1e-15)
    np.testing.assert_allclose(data.site("tip").xpos - data.site("abdomen").xpos, [0.03, 0.16, -0.24], atol=1e-15)
    for site in ("tip", "abdomen"):
        np.testing.assert_allclose(data.site(site).xmat.reshape(3, 3), np.eye(3), atol=1e-15)
    assert data.body("arm_elbow").xpos[2] > data.body("arm_wrist").xpos[2] > data.site("tip").xpos[2]


def test_it_stands_on_its_four_wheels_and_is_as_tall_as_a_child(robot):
    model, data = robot
    up, lowest = np.array([0, 0, 1.0]), {}
    for g in seen(model):
        lowest[wearer(model, g)] = min(-reach(model, data, g, -up), lowest.get(wearer(model, g), np.inf))
    wheels = [f"wheel_{i}" for i in range(1, 5)]
    assert [lowest.pop(name) for name in wheels] == pytest.approx([0.0] * 4, abs=1e-9)
    assert min(lowest.values()) > 0.02
    assert 1.3 < max(reach(model, data, g, up) for g in seen(model)) < 1.45
    outermost = max(reach(model, data, g, np.array([np.cos(a), np.sin(a), 0]))
                    for a in np.linspace(0, 2 * np.pi, 24) for g in seen(model)
                    if wearer(model, g) == "base" or wearer(model, g) in wheels)  # fmt: skip
    assert outermost <= rooms.BASE_RADIUS + 1e-9
    deck = max(reach(model, data, g, up) for g in seen(model) if wearer(model, g) == "base")
    assert deck <= rooms.BASE_TOP + 0.005


def test_the_rollers_keep_the_wheels_round(robot):
    """Two rows of rollers: whatever the angle, the wheel rests within 3 mm of the floor, and it shows that it turns."""
    model, data = robot[0], mujoco.MjData(robot[0])
    down, wheel = np.array([0, 0, -1.0]), [g for g in seen(model) if wearer(model, g) == "wheel_1"]
    ellipsoids = [g for g in wheel if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_ELLIPSOID]
    assert len(ellipsoids) == 12
    depths = []
    for angle in np.linspace(0, np.pi / 3, 13):
        data.joint("wheel_1").qpos[:] = angle
        mujoco.mj_kinematics(model, data)
        depths.append([reach(model, data, g, down) for g in ellipsoids])
    depths = np.array(depths)
    assert (depths.max(axis=1) < 1e-9).all() and (depths.max(axis=1) > -0.003).all()
    assert np.ptp(depths, axis=0).max() > 0.02


def test_what_is_seen_has_neither_mass_nor_contact(robot):
    for file in (MODELS / NAME / "robot.xml", MODELS / "vacuum" / "vacuum.xml"):
        spec = mujoco.MjSpec.from_file(str(file))
        whole = spec.copy().compile()
        of_eye = [g for g in spec.geoms if g.group == SEEN]
        assert of_eye and all(g.mass == 0.0 and g.contype == 0 and g.conaffinity == 0 for g in of_eye)
        assert all(g.contype and g.conaffinity for g in spec.geoms if g.group == SOLID)
        assert {g.group for g in spec.geoms} == {SEEN, SOLID}
        for geom in of_eye:
            spec.delete(geom)
        bare = spec.compile()
        for array in ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_subtreemass"):
            np.testing.assert_array_equal(getattr(bare, array), getattr(whole, array))


def test_cameras_look_through_lenses(robot):
    model, data = robot
    lens = model.material("lens").id
    lenses = [g for g in range(model.ngeom) if model.geom_matid[g] == lens]
    for name, steepest in (("head_left", 0.0), ("head_right", 0.0), ("chest", 0.6)):
        camera = data.cam(name)
        assert min(np.linalg.norm(data.geom_xpos[g] - camera.xpos) for g in lenses) < 0.01
        forward = -camera.xmat.reshape(3, 3)[:, 2]
        assert forward[0] > 0.8 and -steepest <= forward[2] <= 1e-9
        hit = np.zeros(1, np.int32)
        mujoco.mj_ray(model, data, camera.xpos, forward, np.arange(6) == SEEN, 1, -1, hit)
        assert hit[0] < 0  # nothing of the robot is in the way


def test_the_range_finder_measures_the_distance_to_the_wall():
    model, data = world()
    ahead = rooms.ROOMS["spare room"].floor[:, 0].max() - BASE[0] - 0.185 - 0.04
    assert data.sensor("range05").data[0] == pytest.approx(ahead, abs=1e-6)
    rooms.place(model, data, BASE + [0.3, 0, 0], posture(0.3, 0.2, WORKING_HEIGHT))
    assert data.sensor("range05").data[0] == pytest.approx(ahead - 0.3, abs=1e-6)
    assert (
        model.sensor("wrist_force").dim[0] == 3
        and sum("range" in model.sensor(i).name for i in range(model.nsensor)) == 11
    )


# --- the hand --------------------------------------------------------------------------------------------------------
def hand(data):
    return data.joint("thumb").qpos[0], np.array([data.joint(name).qpos[0] for name in FINGERS])


def test_a_free_thumb_moves_almost_alone():
    model, data = world(tool=False)
    for name in ("thumb", *FINGERS):
        data.joint(name).qpos[:] = 0.0
    data.actuator("thumb").ctrl[:] = 0.5
    mujoco.mj_step(model, data, 1_500)
    thumb, fingers = hand(data)
    assert thumb > 0.45 and fingers.max() < 0.05


def test_fingers_follow_the_load_on_the_thumb():
    model, data = world()
    angles = []
    for pull in (GRASP, GRASP + 0.15, 0.0):
        data.actuator("thumb").ctrl[:] = pull
        mujoco.mj_step(model, data, 1_500)
        thumb, fingers = hand(data)
        tension = data.actuator("thumb").force[0]
        np.testing.assert_allclose(fingers, tension * 0.25 / 0.25, atol=2e-3)  # lever arm over spring
        angles.append((thumb, fingers.mean()))
    (thumb, fingers), (pressed_thumb, pressed_fingers), (open_thumb, open_fingers) = angles
    assert abs(pressed_thumb - thumb) < 0.02 and pressed_fingers > fingers + 0.05  # the handle holds the thumb
    assert open_thumb < 0.05 and open_fingers < 0.05
    assert (thumb, fingers) == pytest.approx((rooms.CLOSED["thumb"], rooms.CLOSED["finger_1"]), abs=0.02)


# --- the tool --------------------------------------------------------------------------------------------------------
def test_the_wrist_reads_the_tools_weight():
    """Without a floor, in four poses of the hand: the weight, upwards, whatever way the sensor's axes point."""
    readings = {}
    for tool in (False, True):
        for tip in ((0.3, 0.2, 0.22), (0.4, 0.3, 0.22)):
            model, data = world(tip, tool=tool)
            floor = model.geom("room/floor")
            floor.contype[:] = floor.conaffinity[:] = 0
            for twist in (0.0, 0.4):
                data.actuator("arm_5").ctrl[:] += twist
                mujoco.mj_step(model, data, 3_000)
                force = data.site("wrist").xmat.reshape(3, 3) @ data.sensor("wrist_force").data
                readings[tool, tip, twist] = force
    for tool, tip, twist in readings:
        np.testing.assert_allclose(readings[tool, tip, twist][:2], 0, atol=0.05)
        if tool:
            assert readings[True, tip, twist][2] - readings[False, tip, twist][2] == pytest.approx(
                TOOL_MASS * GRAVITY, abs=0.05
            )


def floor_force(model, data) -> float:
    total, wrench = 0.0, np.zeros(6)
    for i, contact in enumerate(data.contact):
        if "room/floor" in [model.geom(g).name for g in contact.geom]:
            mujoco.mj_contactForce(model, data, i, wrench)
            total += wrench[0]
    return total


@pytest.mark.parametrize("x", [0.1, 0.25, 0.4])
@pytest.mark.parametrize("y", [-0.05, 0.2, 0.4])
def test_the_nozzle_lies_flat_on_the_floor_before_the_base(x, y):
    model, data = world((x, y, WORKING_HEIGHT))
    np.testing.assert_allclose(data.site("vacuum/nozzle").xpos - data.site("tip").xpos, NOZZLE_FROM_TIP, atol=1e-6)
    np.testing.assert_allclose(data.site("tip").xmat.reshape(3, 3), HAND_FORWARD, atol=1e-6)
    mujoco.mj_step(model, data, 1_000)
    nozzle = data.site("vacuum/nozzle")
    corners = (
        nozzle.xpos
        + np.array([[sx * 0.05, sy * 0.13, 0] for sx in (-1, 1) for sy in (-1, 1)]) @ nozzle.xmat.reshape(3, 3).T
    )
    assert np.abs(corners[:, 2]).max() < 5e-4
    assert 0.4 * GRAVITY < floor_force(model, data) < 20.0  # at least about what the nozzle weighs
    gap = mujoco.mj_geomDistance(model, data, model.geom("vacuum/nozzle").id, base_geom(model), 2.0, None)
    assert gap > 0.3
    assert {model.geom(g).name for c in data.contact for g in c.geom} == {
        "room/floor", "vacuum/nozzle", "thumb_pad", "vacuum/grip"
    }  # fmt: skip


def base_geom(model) -> int:
    base = model.body("base")
    return next(g for g in range(model.ngeom) if model.geom_bodyid[g] == base.id and model.geom_contype[g])


def test_the_nozzle_stays_flat_when_the_hand_does_not():
    """Both hinges: the hand rolled and pitched by 0.1 rad, a little higher so that the nozzle still rests."""
    model, data = world((0.3, 0.2, WORKING_HEIGHT + 0.01))
    for name, turn in (("arm_5", 0.1), ("arm_7", 0.05)):
        data.actuator(name).ctrl[:] += turn
    mujoco.mj_step(model, data, 1_500)
    pipe = data.body("vacuum/vacuum").xmat.reshape(3, 3)
    assert np.arccos(np.clip(pipe[2, 2], -1, 1)) > 0.04
    assert floor_force(model, data) > 1.0
    assert data.site("vacuum/nozzle").xmat.reshape(3, 3)[2, 2] > np.cos(0.01)


def test_the_arm_holds_a_posture_and_how_far_the_tool_pulls_it_down(record_property):
    """Gravity compensation knows the arm, not the tool: the tool sags at first, and the integral brings it back."""
    for tool in (False, True):
        model, data = world((0.4, 0.2, 0.22), tool=tool)
        start, down = data.site("tip").xpos.copy(), []
        for _ in range(300):
            mujoco.mj_step(model, data, 10)
            down.append(start[2] - data.site("tip").xpos[2])
        record_property(f"droop_tool_{tool}_m", f"{max(down):.4f} at most, {down[-1]:.4f} at the end")
        if tool:
            assert 0.005 < max(down) < 0.03 and abs(down[-1]) < 1e-3
        else:
            assert np.abs(down).max() < 2e-4


def test_the_arm_reaches_the_working_box_with_room_to_spare():
    for x in (0.1, 0.25, 0.4):
        for y in (-0.1, 0.05, 0.2, 0.4):
            assert posture(x, y, WORKING_HEIGHT, margin=np.deg2rad(5)) is not None, (x, y)
    assert posture(0.3, 0.1, 0.0) is None  # the paper's own z = 0


def test_the_base_turns_on_the_way_while_its_wheels_roll_as_they_should():
    model, data = world()
    twist, period = np.array([0.1, 0.15, 0.3]), 0.01
    for _ in range(100):
        yaw = data.joint("base_yaw").qpos[0]
        c, s = np.cos(yaw), np.sin(yaw)
        velocity = c * twist[0] - s * twist[1], s * twist[0] + c * twist[1], twist[2]
        for name, rate in zip(robots.BASE, velocity, strict=True):
            data.actuator(name).ctrl[:] += period * rate
        for i, rate in enumerate(omni.to_wheels(rooms.WHEELS, twist), 1):
            data.actuator(f"wheel_{i}").ctrl[:] = rate
        mujoco.mj_step(model, data, 5)
    again, slip = omni.to_twist(rooms.WHEELS, [data.joint(f"wheel_{i}").qvel[0] for i in range(1, 5)])
    np.testing.assert_allclose(again, twist, atol=1e-3)
    assert slip < 1e-3 and data.joint("base_yaw").qvel[0] == pytest.approx(twist[2], abs=0.01)
