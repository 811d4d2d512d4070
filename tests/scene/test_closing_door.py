"""The door with a closer: its torque, its geometry against the model, and what is no door."""

import mujoco
import numpy as np
import pytest

from tutorialbot.errors import BrokenFile
from tutorialbot.scene import closing_door, door
from tutorialbot.scene.closing_door import FRAME_NAMES, RANGES, ClosingDoor

ANGLES = np.deg2rad([0.0, 20.0, 70.0, 97.0])
OTHER = ClosingDoor(width=0.97, thickness=0.05, knob_from_edge=0.09, knob_stand_off=0.07, knob_height=1.1, gap=0.06)


def opened(ours: ClosingDoor, angle: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = ours.spec().compile()
    data = mujoco.MjData(model)
    data.joint("hinge").qpos[0] = angle
    data.joint("closer_arm").qpos[0] = ours.closer_arm(angle)
    mujoco.mj_forward(model, data)
    return model, data


def corners(data: mujoco.MjData, model: mujoco.MjModel, name: str) -> np.ndarray:
    """The eight corners of a box geom in the world."""
    size, geom = model.geom(name).size, data.geom(name)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return geom.xpos + (signs * size) @ geom.xmat.reshape(3, 3).T


def test_the_issue_finds_it_beside_the_other_door():
    assert door.ClosingDoor is ClosingDoor


def test_closer_is_the_written_line_below_the_hold_angle_and_nothing_beyond():
    ours = ClosingDoor(closer_torque=5.0, closer_stiffness=2.0, hold_angle=1.3)
    assert ours.closer(0.5) == pytest.approx(6.0)
    np.testing.assert_allclose(ours.closer(np.array([0.0, 1.2999, 1.3, 1.6])), [5.0, 7.5998, 0.0, 0.0])
    assert isinstance(ours.closer(0.5), float)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("ours", [ClosingDoor(), OTHER])
def test_the_model_is_where_the_geometry_says(ours, angle):
    model, data = opened(ours, angle)
    frame = ours.knob_frame(angle)
    np.testing.assert_allclose(data.site("grip").xpos, frame.translation, atol=1e-12)
    np.testing.assert_allclose(data.site("grip").xmat, frame.rotation.ravel(), atol=1e-12)
    np.testing.assert_allclose(ours.knob(angle), frame.translation, atol=1e-12)
    plan = np.unique(corners(data, model, "panel")[:, :2].round(9), axis=0)
    np.testing.assert_allclose(plan, np.unique(ours.panel_corners(angle).round(9), axis=0), atol=1e-8)
    for name, (low, high) in zip(FRAME_NAMES, ours.frame_boxes, strict=True):
        box = corners(data, model, name)
        np.testing.assert_allclose([box.min(0), box.max(0)], [low, high], atol=1e-12)


def test_a_positive_angle_pulls_the_knob_toward_the_robot_and_the_pivot_turns_the_grip_about_the_bar():
    ours = ClosingDoor()
    assert ours.knob(0.0) == pytest.approx([0.78, -0.08, 1.0])
    assert ours.knob(np.pi / 2) == pytest.approx([-0.08, -0.78, 1.0])
    frame, turned = ours.knob_frame(0.4), ours.knob_frame(0.4, 0.3)
    np.testing.assert_allclose(turned.translation, frame.translation)
    np.testing.assert_allclose(turned.rotation[:, 0], [0, 0, 1])
    assert np.cross(frame.rotation[:, 2], turned.rotation[:, 2])[2] == pytest.approx(np.sin(0.3))
    assert frame.rotation[:, 2] @ (ours.knob(0.4) - ours.to_world(0.4, [0.78, 0.0, 1.0])) < 0.0  # z into the panel


def test_frames_of_many_angles_are_those_of_each():
    ours, points = OTHER, np.random.default_rng(3).normal(size=(5, 3))
    world = ours.to_world(ANGLES, points)
    assert (
        world.shape == (4, 5, 3) and ours.knob(ANGLES).shape == (4, 3) and ours.panel_corners(ANGLES).shape == (4, 4, 2)
    )
    for angle, row in zip(ANGLES, world, strict=True):
        np.testing.assert_allclose(row, points @ ours.panel_frame(angle).rotation.T, atol=1e-14)
        np.testing.assert_allclose(ours.to_panel(angle, row), points, atol=1e-14)
    corner = ours.panel_corners(0.7)
    sides = np.roll(corner, -1, axis=0) - corner
    after = np.roll(sides, -1, axis=0)
    assert (sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0] > 0.0).all()  # counterclockwise


@pytest.mark.parametrize("ours", [ClosingDoor(), OTHER, ClosingDoor(width=0.80), ClosingDoor(width=1.0)])
def test_the_panel_swings_free_of_its_frame_up_to_the_limit(ours):
    (left, right), front = ours.opening, ours.wall[0]
    sides = ours.panel_corners(np.linspace(0.0, ours.open_limit, 400))
    along = np.linspace(0.0, 1.0, 60)[:, None, None, None]
    outline = ((1 - along) * sides + along * np.roll(sides, -1, axis=1)).reshape(-1, 2)
    x, y = outline[outline[:, 1] > front - closing_door.CASING[1]].T
    assert x.min() > left and x.max() < right and y.max() < ours.wall[1]
    assert right - left == pytest.approx(ours.width + ours.gap)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_closers_arm_ends_over_the_panel(angle):
    model, data = opened(OTHER, angle)
    arm, pose = model.geom("closer_arm"), data.geom("closer_arm")
    end = pose.xpos + arm.size[1] * pose.xmat.reshape(3, 3)[:, 2]
    other = pose.xpos - arm.size[1] * pose.xmat.reshape(3, 3)[:, 2]
    x, y, _ = min((OTHER.to_panel(angle, p) for p in (end, other)), key=lambda p: abs(p[1]))
    assert abs(y) < 1e-9 and 0.15 < x < 0.42  # in the track


@pytest.mark.parametrize("angle", ANGLES)
def test_the_actuator_is_the_closer(angle):
    ours = ClosingDoor(closer_torque=5.0, closer_stiffness=2.0)
    model, data = opened(ours, angle)
    for share in (0.0, 1.0):
        data.ctrl[0] = share
        mujoco.mj_forward(model, data)
        assert data.joint("hinge").qfrc_actuator[0] == pytest.approx(-share * (5.0 + 2.0 * angle))


def test_dimensions_and_masses_reach_the_model():
    ours = ClosingDoor(mass=30.0, hinge_damping=1.5, hinge_friction=0.7, open_limit=1.6, hold_angle=1.2)
    model = ours.spec().compile()
    hinge = model.joint("hinge")
    assert model.body("panel").mass[0] == pytest.approx(30.0)
    assert (np.ravel(hinge.damping)[0], hinge.frictionloss[0], hinge.range[1]) == (1.5, 0.7, 1.6)
    data, push = mujoco.MjData(model), np.zeros((1, model.nv))
    mujoco.mj_forward(model, data)
    push[0, hinge.dofadr[0]], column = 1.0, np.zeros(model.nv)
    mujoco.mj_mulM(model, data, column, push[0])
    assert column[hinge.dofadr[0]] == pytest.approx(ours.inertia, rel=1e-3)
    assert ours.inertia > 30.0 * ours.width**2 / 3  # a plate turning about its edge, and the knob


def test_random_doors_fill_their_ranges_and_repeat():
    doors = [ClosingDoor.random(seed) for seed in range(1000, 1100)]
    for name, (low, high) in RANGES.items():
        values = np.array([getattr(one, name) for one in doors])
        assert low <= values.min() < low + 0.1 * (high - low) and high - 0.1 * (high - low) < values.max() <= high
        assert abs(values.mean() - (low + high) / 2) < 0.1 * (high - low)
    assert ClosingDoor.random(1000) == doors[0] != doors[1]
    with pytest.raises(ValueError, match="seed"):
        ClosingDoor.random(-1)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("width", 0.0),
        ("width", float("nan")),
        ("width", "0.9"),
        ("thickness", -0.04),
        ("knob_from_edge", 0.0),
        ("knob_height", 5.0),
        ("gap", 0.03),
        ("wall_thickness", float("inf")),
        ("mass", True),
        ("closer_torque", -1.0),
        ("hold_angle", 0.0),
        ("hold_angle", 1.8),
        ("open_limit", 9.0),
    ],
)
def test_impossible_doors_are_refused_by_name(argument, value):
    with pytest.raises((ValueError, TypeError), match=argument):
        ClosingDoor(**{argument: value})


def test_a_knob_beyond_the_middle_or_over_the_top_is_refused():
    with pytest.raises(ValueError, match="knob_from_edge"):
        ClosingDoor(width=0.5, knob_from_edge=0.3)
    with pytest.raises(ValueError, match="knob_height"):
        ClosingDoor(height=1.2, knob_height=1.18)


def test_bad_angles_are_refused():
    with pytest.raises((ValueError, TypeError), match="theta"):
        ClosingDoor().knob("open")
    with pytest.raises(ValueError, match="theta"):
        ClosingDoor().knob_frame(np.nan)


def test_a_broken_file_is_named(tmp_path, monkeypatch):
    (tmp_path / "closing_door").mkdir()
    (tmp_path / "closing_door" / "door.xml").write_text("<mujoco><worldbody>")
    monkeypatch.setattr(closing_door.paths, "MODELS", tmp_path)
    with pytest.raises(BrokenFile, match="closing_door/door.xml"):
        ClosingDoor().spec()
