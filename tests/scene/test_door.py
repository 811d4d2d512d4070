"""The door: its latch, its springs, its sides, and doors from other files."""

import mujoco
import numpy as np
import pytest

from tutorialbot.errors import BrokenFile
from tutorialbot.scene.door import Door

OTHER = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="leaf"><joint name="pivot" axis="0 0 1" range="0 2.5" limited="true" damping="1"/>
      <geom type="box" size="0.02 0.2 0.2" pos="0.02 0.2 1" mass="8"/>
      <body name="knob" pos="0 0.35 1">
        <joint name="turn" axis="-1 0 0" range="-0.8 0" limited="true" stiffness="1" springref="0.3"/>
        <geom type="capsule" size="0.01" fromto="0 0 0 -0.07 0 0" mass="0.2"/>
        <site name="hold" pos="-0.07 -0.1 0"/>
      </body>
    </body>
  </worldbody>
  <equality><joint name="catch" joint1="pivot"/></equality>
</mujoco>
"""


def push(door, hinge=0.0, lever=0.0, seconds=2.0, turn=0.0):
    """Raise both torques [Nm] slowly to their values and hold them, from the lever at `turn`; return both angles."""
    model = door.model()
    data = mujoco.MjData(model)
    data.joint("lever").qpos[0] = turn
    steps = round(seconds / model.opt.timestep)
    for step in range(steps):
        share = min(1.0, 2.0 * step / steps)
        data.joint("hinge").qfrc_applied[0], data.joint("lever").qfrc_applied[0] = share * hinge, share * lever
        mujoco.mj_step(model, data)
    return float(data.joint("hinge").qpos[0]), float(data.joint("lever").qpos[0])


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(("latch", "gives"), [("equality", 0.01), ("bolt", 0.3)])
def test_latch_holds_the_door_against_a_pull(latch, gives, side):
    angle, _ = push(Door(latch=latch, side=side), hinge=0.42 * 200.0)
    assert 0.0 <= np.rad2deg(angle) < gives


def test_bolt_lets_go_near_the_release_angle_and_not_before():
    assert push(Door(latch="bolt"), hinge=5.0, lever=-0.9)[0] < np.deg2rad(1.0)  # the lever rests near -28 deg
    assert push(Door(latch="bolt"), hinge=5.0, lever=-1.4)[0] > np.deg2rad(10.0)


def test_lever_returns_and_stays_in_its_range():
    assert abs(push(Door(), turn=-0.7)[1]) < np.deg2rad(1.0)
    assert np.rad2deg(push(Door(), lever=-3.0)[1]) == pytest.approx(-45.0, abs=2.0)


@pytest.mark.parametrize("side", ["right", "left"])
def test_door_opens_toward_the_robot_and_a_turned_lever_points_down(side):
    model = Door(side=side).model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    shut = data.site("grip").xpos.copy()
    assert shut == pytest.approx([-0.07, 0.30 if side == "right" else -0.30, 1.0])
    data.joint("lever").qpos[0] = -0.5
    mujoco.mj_kinematics(model, data)
    assert data.site("grip").xpos[2] < shut[2] - 0.05
    data.joint("lever").qpos[0], data.joint("hinge").qpos[0] = 0.0, np.pi / 2
    mujoco.mj_kinematics(model, data)
    assert data.site("grip").xpos[0] == pytest.approx(-0.30)


def test_dimensions_and_stiffnesses_reach_the_model():
    door = Door(
        spindle_radius=0.6, lever_length=0.1, stand_off=0.09, handle_height=1.1, mass=20.0,
        hinge_damping=3.0, hinge_friction=0.7,
        lever_stiffness=2.5, lever_preload=0.6, lever_damping=0.05, lever_friction=0.04,
    )  # fmt: skip
    model = door.model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert data.site("grip").xpos == pytest.approx([-0.09, 0.5, 1.1])
    assert model.body("panel").mass[0] == pytest.approx(20.0)
    assert np.ravel(model.joint("lever").stiffness)[0] == 2.5
    assert np.ravel(model.joint("hinge").damping)[0] == 3.0
    assert np.ravel(model.joint("lever").damping)[0] == 0.05
    assert [model.joint(name).frictionloss[0] for name in ("hinge", "lever")] == [0.7, 0.04]
    assert model.qpos_spring[model.joint("lever").qposadr[0]] == 0.6


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("spindle_radius", 0.0),
        ("spindle_radius", -0.4),
        ("spindle_radius", float("nan")),
        ("lever_length", float("inf")),
        ("lever_length", 0.5),
        ("lever_length", "0.1"),
        ("mass", 0.0),
        ("lever_stiffness", -1.0),
        ("release_angle", 0.1),
        ("release_angle", -1.0),
        ("engage_angle", -0.7),
        ("latch", "magnet"),
        ("side", "top"),
        ("stand_off", True),
        ("spindle_radius", 50.0),
        ("stand_off", 1e-9),
        ("mass", 1e9),
        ("panel_height", 2.5),
        ("file", "door.xml"),
    ],
)
def test_impossible_doors_are_refused_by_name(argument, value):
    with pytest.raises((ValueError, TypeError), match="release_angle" if argument == "engage_angle" else argument):
        Door(**{argument: value})


def test_a_door_from_another_file(tmp_path):
    path = tmp_path / "other.xml"
    path.write_text(OTHER)
    door = Door.from_mjcf(path, hinge="pivot", handle="turn", grip="hold", latch="catch")
    assert door.names.hinge == "pivot"
    assert door.model().nv == 2


@pytest.mark.parametrize("argument", ["hinge", "handle", "grip", "latch"])
def test_a_name_that_the_file_lacks_is_refused(tmp_path, argument):
    path = tmp_path / "other.xml"
    path.write_text(OTHER)
    names = {"hinge": "pivot", "handle": "turn", "grip": "hold", "latch": "catch", argument: "nothing"}
    with pytest.raises(ValueError, match=f"{argument} = 'nothing'"):
        Door.from_mjcf(path, **names)


def test_a_hinge_is_no_handle(tmp_path):
    path = tmp_path / "other.xml"
    path.write_text(OTHER)
    with pytest.raises(ValueError, match="handle = 'pivot'"):
        Door.from_mjcf(path, hinge="pivot", handle="pivot", grip="hold")


@pytest.mark.parametrize("text", ["", OTHER[: len(OTHER) // 2], OTHER.replace('type="box"', 'type="bax"')])
def test_a_damaged_file_is_named(tmp_path, text):
    path = tmp_path / "broken.xml"
    path.write_text(text)
    with pytest.raises(BrokenFile, match=r"broken\.xml"):
        Door.from_mjcf(path, hinge="pivot", grip="hold")
    with pytest.raises(BrokenFile, match=r"missing\.xml"):
        Door.from_mjcf(tmp_path / "missing.xml", hinge="pivot", grip="hold")
