"""The robot's and the door's models: what paper 1 says of the robot, and that what is only seen does nothing."""

import mujoco
import numpy as np
import pytest

from tutorialbot import robots
from tutorialbot.bo.objective import start_posture
from tutorialbot.paths import MODELS
from tutorialbot.scene.door import Door
from tutorialbot.scene.world import MOVING, Settings, assemble

SEEN, SOLID = 2, 3  # geom groups
FILE = MODELS / "mobile_manipulator" / "robot.xml"
HEIGHT, MASS = 1.17, 140.0  # paper 1, section 2


@pytest.fixture(scope="module")
def robot():
    model = robots.load("mobile_manipulator")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture(scope="module")
def scene():
    """The robot with its hand on the handle."""
    door = Door()
    model, _ = assemble(door, Settings())
    data = mujoco.MjData(model)
    data.qpos[[model.joint(name).qposadr[0] for name in MOVING]] = start_posture(door)
    mujoco.mj_forward(model, data)
    return model, data


def seen(model):
    return [g for g in range(model.ngeom) if model.geom_group[g] == SEEN]


def wearer(model, geom):
    return model.body(model.geom_bodyid[geom]).name


def reach(model, data, geom, direction):
    """How far a geom reaches along a unit vector from the world's origin: its support function [m]."""
    size, rotation = model.geom_size[geom], data.geom_xmat[geom].reshape(3, 3)
    x, y, z = local = rotation.T @ direction
    match mujoco.mjtGeom(model.geom_type[geom]):
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            far = size[0]
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            far = size[0] + size[1] * abs(z)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            far = size[0] * np.hypot(x, y) + size[1] * abs(z)
        case mujoco.mjtGeom.mjGEOM_BOX:
            far = size @ abs(local)
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            far = np.linalg.norm(size * local)
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first = model.mesh_vertadr[mesh]
            far = (model.mesh_vert[first : first + model.mesh_vertnum[mesh]] @ local).max()
    return data.geom_xpos[geom] @ direction + far


def test_mass_is_the_papers(robot):
    assert robot[0].body_mass.sum() == pytest.approx(MASS, abs=1e-9)


def test_height_without_arms_is_the_papers_and_it_stands_on_the_floor(robot):
    model, data = robot
    trunk = [g for g in seen(model) if not wearer(model, g).startswith(("arm_", "left_arm_"))]
    assert max(reach(model, data, g, np.array([0, 0, 1.0])) for g in trunk) == pytest.approx(HEIGHT, abs=1e-6)
    lowest = {}
    for g in seen(model):
        low = -reach(model, data, g, np.array([0, 0, -1.0]))
        lowest[wearer(model, g)] = min(low, lowest.get(wearer(model, g), np.inf))
    feet = ["caster_left_wheel", "caster_right_wheel", *(f"passive_{corner}" for corner in ("fl", "fr", "rl", "rr"))]
    assert [lowest.pop(name) for name in feet] == pytest.approx([0.0] * 6, abs=1e-9)
    assert min(lowest.values()) > 0.02


def test_six_joints_work_in_the_right_arm_and_none_in_the_left(robot):
    model, _ = robot
    axes = {"arm_1": "z", "arm_2": "y", "arm_3": "y", "arm_4": "x", "arm_5": "y", "arm_6": "x"}
    for name, axis in axes.items():
        joint = model.joint(name)
        assert joint.type[0] == mujoco.mjtJoint.mjJNT_HINGE
        np.testing.assert_array_equal(joint.axis, np.eye(3)["xyz".index(axis)])
    right = [model.body(b).name for b in range(model.nbody) if model.body(b).name.startswith("arm_")]
    left = [model.body(b).name for b in range(model.nbody) if model.body(b).name.startswith("left_arm_")]
    assert left == [f"left_{name}" for name in right]
    assert [model.body(name).jntnum[0] for name in left] == [0] * len(left)
    assert sum(model.body(name).jntnum[0] for name in right) == 6
    assert {model.body(name).weldid[0] for name in left} == {model.body("base").id}  # fixed to the base


def test_two_active_casters_steer_and_drive_and_show_that_they_turn(robot):
    model, data = robot
    names = [model.joint(j).name for j in range(model.njnt)]
    assert sorted(n for n in names if n.startswith("caster")) == [
        f"caster_{side}_{what}" for side in ("left", "right") for what in ("drive", "steer")
    ]
    turned = mujoco.MjData(model)
    for side in ("left", "right"):
        np.testing.assert_array_equal(model.joint(f"caster_{side}_steer").axis, [0, 0, 1])
        np.testing.assert_array_equal(model.joint(f"caster_{side}_drive").axis, [0, 1, 0])
        turned.joint(f"caster_{side}_drive").qpos[:] = 0.3
    mujoco.mj_forward(model, turned)
    directions = [np.array([np.cos(a), 0.0, np.sin(a)]) for a in np.linspace(0, np.pi, 12)]
    for side in ("left", "right"):
        wheel = [g for g in seen(model) if wearer(model, g) == f"caster_{side}_wheel"]
        changed = [
            any(abs(reach(model, data, g, d) - reach(model, turned, g, d)) > 1e-3 for d in directions) for g in wheel
        ]
        assert any(changed)  # the spokes
        assert not all(changed)  # the tyre stays round


def test_what_is_seen_has_neither_mass_nor_contact(robot):
    spec = mujoco.MjSpec.from_file(str(FILE))
    of_eye = [g for g in spec.geoms if g.group == SEEN]
    assert of_eye and all(g.mass == 0.0 and g.contype == 0 and g.conaffinity == 0 for g in of_eye)
    assert all(g.contype and g.conaffinity for g in spec.geoms if g.group == SOLID)
    assert {g.group for g in spec.geoms} == {SEEN, SOLID}
    for geom in of_eye:
        spec.delete(geom)
    bare, model = spec.compile(), robot[0]
    for array in ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_subtreemass"):
        np.testing.assert_array_equal(getattr(bare, array), getattr(model, array))


def test_fingers_close_around_the_lever(scene):
    model, data = scene
    hand = [g for g in seen(model) if wearer(model, g) == "arm_hand"]
    bars, tool, ends = [model.geom(f"door/{name}").id for name in ("bar", "bar_end")], data.site("tool"), np.zeros(6)
    around = set()
    for bar in bars:
        for geom in hand:
            gap = mujoco.mj_geomDistance(model, data, bar, geom, 1.0, ends)
            assert gap > -1e-4  # no finger runs into the lever
            if gap < 0.005:
                x, _, z = tool.xmat.reshape(3, 3).T @ (ends[3:] - tool.xpos)
                around.add("above" if z > 0.009 else "below" if z < -0.009 else "before" if x > 0 else "behind")
    assert {"above", "below", "before"} <= around


def test_doors_of_both_sides_mirror_each_other():
    right, left = Door().model(), Door(side="left").model()
    for g in range(right.ngeom):
        other = left.geom(right.geom(g).name)
        np.testing.assert_allclose(right.geom_pos[g] * [1, -1, 1], other.pos, atol=1e-12)
        np.testing.assert_allclose(right.geom_size[g], other.size, atol=1e-12)
    bottom = min(right.geom(name).pos[2] - right.geom(name).size[2] for name in ("post_hinge", "post_lock", "sill"))
    assert bottom == pytest.approx(0.0, abs=1e-12)  # the frame stands on the floor
