"""The passage in MuJoCo: the hand on the knob, the pads, the closer, and what happens when one of them is missing."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from tests.scene.door_motions import PERIOD, START, Motion, chain, pull, reach, then_stay
from tutorialbot.errors import InvalidType, TutorialbotError
from tutorialbot.scene import home_robot, omni
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.passage_world import Replay, configuration, replay, world

DOOR = ClosingDoor()
PUSHED = 0.45  # where the hand holds the push face, from the hinge [m]
AWAY = np.array([0.8, -1.6, np.pi / 2, *START[3:]])  # where the robot touches nothing


def still(moving: np.ndarray, seconds: float, grasped: bool = False) -> tuple:
    """The robot stays at `moving` (10,): times, base, q, grasped."""
    times = PERIOD * np.arange(round(seconds / PERIOD) + 1)
    rows = np.tile(moving, (len(times), 1))
    return times, rows[:, :3], rows[:, 3:], np.full(len(times), grasped)


def degrees(replayed: Replay) -> np.ndarray:
    return np.rad2deg(replayed.door_angle)


@pytest.fixture(scope="module")
def pulled() -> tuple[Motion, Replay]:
    motion = pull(DOOR, np.deg2rad(30.0))
    return motion, replay(DOOR, *motion.arguments)


def beside(angle: float, along: float = 0.165) -> np.ndarray:
    """The robot whose rim just touches the free edge of the door at `angle` [rad] from behind."""
    edge = np.array([DOOR.width, DOOR.thickness / 2, 0.0])
    away = np.array([along, np.sqrt(home_robot.BASE_RADIUS**2 - along**2), 0.0])
    x, y, _ = DOOR.to_world(angle, edge + away)
    return np.array([x, y, 0.0, *START[3:]])


def behind(angle: float) -> np.ndarray:
    """The robot in the doorway whose hand just touches the push face of the door at `angle` [rad]."""
    model = chain()
    face = DOOR.thickness / 2 + home_robot.PAD_RADIUS - home_robot.PAD_BEHIND
    back = np.column_stack([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    goal = DOOR.panel_frame(angle) * pin.SE3(back, np.array([PUSHED, face, 1.0]))
    moving = np.array([0.45, 0.33, -np.pi / 2 - angle, *START[3:]])
    return reach(model, model.createData(), moving, goal, np.concatenate([np.full(3, 0.1), np.ones(7)]))


# --- the hand on the knob --------------------------------------------------------------------------------------------
def test_the_door_follows_the_hand(pulled):
    motion, replayed = pulled
    assert replayed.outcome == "finished" and replayed.held.all() and replayed.touches == ()
    assert np.rad2deg(np.abs(replayed.door_angle - motion.angle)).max() < 1.0
    assert replayed.grasp_gap < 1e-6 and replayed.base_lag.max() < 0.02
    np.testing.assert_allclose(replayed.q, motion.q, atol=0.05)
    assert np.abs(replayed.torques).max() < 80.0


def test_the_arm_carries_what_the_closer_asks(pulled):
    """What a stronger closer adds to the servos' torques is a force on the knob with its moment about the hinge."""
    motion, light = pulled
    strong = ClosingDoor(closer_torque=DOOR.closer_torque + 10.0)
    more = replay(strong, *motion.arguments).torques[-1] - light.torques[-1]
    model = world(DOOR, seen=False)
    data = mujoco.MjData(model)
    data.qpos[:] = light.qpos[-1]
    mujoco.mj_forward(model, data)
    jacobian, tip = np.zeros((6, model.nv)), data.site("tip").xpos
    mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], model.site("tip").id)
    arm = [model.joint(name).dofadr[0] for name in home_robot.ARM]
    wrench = np.linalg.lstsq(jacobian[:, arm].T, more, rcond=None)[0]
    assert np.cross(tip, wrench[:3])[2] + wrench[5] == pytest.approx(-10.0, abs=0.3)
    assert abs(wrench[5]) < 0.1  # the knob turns freely about its bar


def test_a_knob_let_go_takes_the_door_home(pulled):
    replayed = replay(DOOR, *then_stay(pulled[0], 3.0).arguments)
    released = ~replayed.held
    assert released.any() and released[-1] and not released[0]
    assert degrees(replayed)[~released][-1] == pytest.approx(30.0, abs=1.0)
    assert degrees(replayed)[-1] == pytest.approx(0.0, abs=0.1)


def test_the_jaws_open_around_a_grasp_alone(pulled):
    motion = then_stay(pulled[0], 3.0)
    replayed = replay(DOOR, *motion.arguments)
    model = world(DOOR, seen=False)
    jaw = replayed.qpos[:, model.joint("jaw_left").qposadr[0]]
    let_go = np.flatnonzero(~motion.grasped)[0]
    assert jaw[let_go - 1] < 1e-3 and jaw[let_go + 40] > 0.9 * home_robot.JAW_OPEN and jaw[-1] < 1e-3


def test_a_hand_out_of_reach_takes_nothing():
    replayed = replay(DOOR, *still(AWAY, 0.5, grasped=True))
    assert replayed.outcome == "missed" and not replayed.held.any() and replayed.grasp_gap > 0.3
    assert degrees(replayed).max() < 0.1


def test_a_grasp_keeps_the_hand_as_it_came():
    """A hand 5 mm off takes the knob there: nothing jumps."""
    motion = pull(DOOR, np.deg2rad(10.0), seconds=1.0)
    motion.base[:, 0] += 0.005
    replayed = replay(DOOR, *motion.arguments)
    assert replayed.grasp_gap == pytest.approx(0.005, abs=1e-3)
    assert degrees(replayed)[:20].max() < 0.2 and degrees(replayed)[-1] == pytest.approx(10.0, abs=1.0)


# --- the closer and the pads -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("hold", [75.0, 90.0])
def test_the_door_stays_beyond_the_hold_angle_and_shuts_from_below_it(hold):
    door = ClosingDoor(hold_angle=np.deg2rad(hold))
    for start, end in ((hold + 3.0, hold + 3.0), (hold - 3.0, 0.0)):
        replayed = replay(door, *still(AWAY, 4.0), start_angle=np.deg2rad(start))
        assert degrees(replayed)[0] == pytest.approx(start)
        assert degrees(replayed)[-1] == pytest.approx(end, abs=0.1)
        shut = np.flatnonzero(degrees(replayed) < 0.1)
        assert replayed.touches == () and (not len(shut) or degrees(replayed)[shut[0] :].max() < 2.0)  # no wild rebound


def alone(times: np.ndarray, theta: float) -> np.ndarray:
    """Angles of the door that nobody touches, from rest: inertia, closer, damping and friction in small steps."""
    angles, rate, step = [theta], 0.0, 1e-3
    for _ in np.arange(times[0], times[-1], step):
        drive = -DOOR.closer(angles[-1])
        resting = rate == 0.0 and abs(drive) <= DOOR.hinge_friction
        drag = DOOR.hinge_damping * rate + DOOR.hinge_friction * np.sign(rate or drive)
        rate += 0.0 if resting else step * (drive - drag) / DOOR.inertia
        angles.append(max(angles[-1] + step * rate, 0.0))
    return np.interp(times, times[0] + step * np.arange(len(angles)), angles)


@pytest.mark.parametrize("start", [20.0, 60.0, 84.0, 90.0])
def test_the_door_let_go_swings_as_its_equation_says(start):
    replayed = replay(DOOR, *still(AWAY, 3.0), start_angle=np.deg2rad(start))
    expected = np.rad2deg(alone(replayed.times, np.deg2rad(start)))
    swinging = expected > 0.0
    np.testing.assert_allclose(degrees(replayed)[swinging], expected[swinging], atol=0.7)
    assert degrees(replayed)[~swinging].max(initial=0.0) < 3.0


def test_a_stronger_closer_shuts_faster():
    shut = []
    for torque in (4.0, 12.0):
        replayed = replay(ClosingDoor(closer_torque=torque), *still(AWAY, 5.0), start_angle=1.0)
        shut.append(replayed.times[np.flatnonzero(degrees(replayed) < 1.0)[0]])
    assert shut[1] < 0.8 * shut[0]


@pytest.mark.parametrize(
    ("place", "pad", "option"), [(beside, "base_rim", "hold_by_base"), (behind, "hand_pad", "hold_by_hand")]
)
def test_a_pad_holds_the_door_and_without_it_the_door_shuts(place, pad, option):
    angle = np.deg2rad(60.0)
    motion = still(place(angle), 3.0)
    held = replay(DOOR, *motion, start_angle=angle)
    assert np.abs(degrees(held) - 60.0).max() < 1.5
    assert [(touch.robot, touch.door) for touch in held.touches] == [(pad, "panel")] and held.bumps == ()
    arm = DOOR.width if pad == "base_rim" else PUSHED
    assert 0.7 * DOOR.closer(angle) / arm < held.touches[0].force < 10.0 * DOOR.closer(angle) / arm
    gone = replay(DOOR, *motion, start_angle=angle, **{option: False})
    assert degrees(gone)[-1] == pytest.approx(0.0, abs=0.1)
    rests = ClosingDoor(hold_angle=np.deg2rad(50.0))  # beyond the hold angle nothing needs to hold it
    assert degrees(replay(rests, *motion, start_angle=angle, **{option: False}))[-1] == pytest.approx(60.0, abs=0.1)


def test_a_bump_is_told_from_a_pad():
    times = np.array([0.0, 1.0])
    base = np.array([[1.0, -0.6, 0.0], [1.0, -0.2, 0.0]])  # into the jamb
    replayed = replay(DOOR, times, base, np.tile(START[3:], (2, 1)), np.zeros(2, bool))
    assert {touch.robot for touch in replayed.bumps} == {"base_rim"}
    assert {touch.door for touch in replayed.bumps} <= {"jamb_lock", "wall_lock", "panel"}
    assert all(0.3 < touch.first <= touch.last <= 1.0 and touch.force > 1.0 for touch in replayed.bumps)
    assert replayed.base[-1, 1] < base[-1, 1] - 0.01  # the wall stands


# --- the world and the record ----------------------------------------------------------------------------------------
def test_base_and_wheels_go_where_they_are_told():
    times = np.linspace(0.0, 2.0, 101)
    base = np.column_stack([0.5 + 0.3 * times, -1.5 - 0.1 * times, 0.4 * times])
    replayed = replay(DOOR, times, base, np.tile(START[3:], (101, 1)), np.zeros(101, bool))
    np.testing.assert_allclose(replayed.base[20:], base[20:], atol=0.01)
    assert replayed.base_lag[20:].max() < 0.01
    model = world(DOOR, seen=False)
    wheels = replayed.qpos[:, [model.joint(name).qposadr[0] for name in home_robot.WHEEL_JOINTS]]
    yaw = base[50, 2]
    twist = [0.3 * np.cos(yaw) - 0.1 * np.sin(yaw), -0.1 * np.cos(yaw) - 0.3 * np.sin(yaw), 0.4]
    rates = (wheels[52] - wheels[48]) / (times[52] - times[48])
    np.testing.assert_allclose(rates, omni.to_wheels(home_robot.WHEELS, twist), atol=0.05)


def test_what_is_there_for_the_eye_changes_nothing(pulled):
    full, bare = world(DOOR), world(DOOR, seen=False, wall_opacity=0.3)
    assert full.nq == bare.nq == pulled[1].qpos.shape[1] and bare.ngeom < full.ngeom / 3
    assert [full.joint(i).name for i in range(full.njnt)] == [bare.joint(i).name for i in range(bare.njnt)]
    np.testing.assert_array_equal(full.body_mass, bare.body_mass)
    np.testing.assert_array_equal(full.body_inertia, bare.body_inertia)
    wall = full.mat("door/wall").id
    assert full.mat_rgba[wall, 3] == 1.0 and bare.mat_rgba[bare.mat("door/wall").id, 3] == pytest.approx(0.3)


def test_fixtures_are_in_the_world():
    frame = home_robot.fixture_frame(DOOR, 1.4, 1.0)
    model = world(DOOR, fixtures=[frame, home_robot.fixture_frame(DOOR, 1.8, 1.0)])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.site("fixture_0").xpos, frame.translation)
    assert model.body("fixture_1").id > 0


def test_the_same_motion_gives_the_same_numbers(pulled):
    again = replay(DOOR, *pulled[0].arguments)
    for name in ("door_angle", "torques", "qpos"):
        np.testing.assert_array_equal(getattr(again, name), getattr(pulled[1], name))


def test_sparse_samples_are_joined_by_lines(pulled):
    motion = pulled[0]
    some = np.r_[0 : len(motion.times) : 5, len(motion.times) - 1]
    replayed = replay(DOOR, *(column[some] for column in motion.arguments))
    assert np.rad2deg(np.abs(replayed.door_angle - motion.angle[some])).max() < 1.0


BAD = {
    "times": [
        np.zeros(3),
        np.array([0.0, 2.0, 1.0]),
        np.array([0.0, np.nan, 1.0]),
        np.array([0.0]),
        np.array([0.0, 1.0, 1e12]),
    ],
    "base": [np.zeros((2, 3)), np.full((3, 3), np.inf), "base"],
    "q": [np.zeros((3, 6)), None],
    "grasped": [np.zeros(3), np.zeros(2, bool), [[True]]],
    "start_angle": [-0.1, 3.0, "shut"],
    "door": [None, "door"],
}


@pytest.mark.parametrize(("argument", "value"), [(name, value) for name, values in BAD.items() for value in values])
def test_bad_arguments_are_named(argument, value):
    good = {"times": np.arange(3.0), "base": np.zeros((3, 3)), "q": np.zeros((3, 7)), "grasped": np.zeros(3, bool)}
    with pytest.raises((ValueError, TypeError), match=argument):
        replay(**{"door": DOOR, **good, argument: value})


def test_other_bad_arguments_are_named():
    with pytest.raises(InvalidType, match="hold_by_base"):
        replay(DOOR, *still(AWAY, 0.1), hold_by_base=1)
    with pytest.raises(ValueError, match="wall_opacity"):
        world(DOOR, wall_opacity=2.0)
    with pytest.raises(InvalidType, match="fixtures"):
        world(DOOR, fixtures=[np.eye(4)])
    with pytest.raises(InvalidType, match="^seen = 'x'"):
        world(DOOR, seen="x")


BAD_CONFIGURATIONS = {
    "model": [None, "world"], "door": [None, 3],
    "base": [np.zeros(2), np.zeros((2, 3)), [0.0, np.nan, 0.0], "here", None],
    "q": [np.zeros(6), np.zeros((2, 7)), np.full(7, np.inf), None], "angle": [np.zeros(2), np.nan, "open", None],
}  # fmt: skip


@pytest.mark.parametrize("argument", BAD_CONFIGURATIONS)
def test_what_is_no_configuration_is_named(argument):
    good = {"model": world(DOOR, seen=False), "door": DOOR, "base": np.zeros(3), "q": np.zeros(7), "angle": 0.1}
    assert configuration(**good).ndim == 1
    for value in BAD_CONFIGURATIONS[argument]:
        named = "base" if np.shape(value) == (2,) else argument  # two angles: then it is the base that does not fit
        with pytest.raises(TutorialbotError, match=f"^{named} = "):
            configuration(**good | {argument: value})
    with pytest.raises(TutorialbotError, match="^model = "):
        configuration(**good | {"model": home_robot.robot_spec().compile()})


def test_a_configuration_puts_every_joint_in_its_place(pulled):
    motion, played = pulled
    model = world(DOOR)
    qpos = configuration(model, DOOR, played.base, played.q, played.door_angle)
    assert qpos.shape == played.qpos.shape
    for name in (*home_robot.MOVING, "door/hinge", "door/closer_arm"):
        place = model.joint(name).qposadr[0]
        np.testing.assert_allclose(qpos[:, place], played.qpos[:, place], atol=1e-12)
    one = configuration(model, DOOR, played.base[5], played.q[5], played.door_angle[5])
    np.testing.assert_array_equal(one, qpos[5])
