"""Eq. (1) and its mended form, and what a task may try, keep and take back."""

import numpy as np
import pinocchio as pin
import pytest

from tutorialbot.bo.objective import DoorTask, Trial, execute, new_pose_cost, paper_cost, start_posture
from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.pose import interpolate, so4_distance
from tutorialbot.scene.door import Door
from tutorialbot.scene.simulation import Settings
from tutorialbot.trajectory import PoseTrajectory


class Path:
    """What a cost sees: poses on the x axis, 0.2 m apart."""

    def __init__(self, poses, sections_done):
        self.poses, self.sections_done = poses, sections_done


def at(x):
    return pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("sections_done", "settled", "expected"),
    [
        (1, at(0.5), -2.0),
        (1, at(0.1), 3.0),
        (0, at(0.1), -2.0),
        (3, at(0.3), -2.0),
    ],
)
def test_eq_1_punishes_coming_nearer_but_not_in_the_first_section(sections_done, settled, expected):
    assert paper_cost(2.0, at(0.3), settled, Path([at(0.0)], sections_done)) == pytest.approx(expected)


def test_mended_cost_rewards_new_poses_and_punishes_known_ones():
    path = Path([at(0.0), at(0.2)], 1)
    assert new_pose_cost(2.0, at(0.2), at(0.2), path) == pytest.approx(3.0)
    assert new_pose_cost(2.0, at(0.2), at(0.005), path) == pytest.approx(
        3.0
    )  # far from the start, but an old acquaintance
    assert new_pose_cost(2.0, at(0.2), at(0.4), path) < -2.0
    turned_on = pin.SE3(pin.exp3(np.array([1.5, 0.0, 0.0])), at(0.2).translation)
    middle = Path([at(0.0), at(0.2), turned_on], 2)
    assert new_pose_cost(2.0, turned_on, at(0.2), middle) == pytest.approx(3.0)  # known, though not the last one
    near = so4_distance(at(0.2), at(0.229))
    assert near == pytest.approx(0.2, abs=0.01)  # twice the limit: new
    assert new_pose_cost(2.0, at(0.2), at(0.229), path) == pytest.approx(-2.0 - 10.0 * near)
    longer = Path([at(0.0), at(0.25), at(0.2)], 2)
    turned = pin.SE3(pin.exp3(np.array([1.0, 0.0, 0.0])), np.array([0.18, 0.0, 0.0]))
    assert new_pose_cost(2.0, at(0.2), turned, longer) == pytest.approx(3.0)  # 0.07 m back from the furthest
    d = so4_distance(at(0.2), at(0.5))
    assert new_pose_cost(2.0, at(0.2), at(0.5), path) == pytest.approx(-2.0 - 10.0 * d)
    back = pin.SE3(pin.exp3(np.array([1.0, 0.0, 0.0])), np.array([0.05, 0.0, 0.0]))  # new, but nearer
    assert new_pose_cost(2.0, at(0.2), back, path) == pytest.approx(3.0)


def turn_lever(task, degrees=45.0):
    """The point of the cube that turns the hand about the lever's spindle, by ideal knowledge of the door."""
    start = task.start
    spindle = np.array([start.translation[0], 0.42, 1.0])
    turn = pin.exp3(np.array([np.deg2rad(degrees), 0.0, 0.0]))
    goal = pin.SE3(turn @ start.rotation, spindle + turn @ (start.translation - spindle))
    return task.space.point(*task.space.moved(start, goal))


def test_the_ideal_direction_lasts_and_turns_the_lever():
    task = DoorTask(Door(), cost=new_pose_cost)
    trial = task.attempt(turn_lever(task))
    assert trial.cost < -2.0
    assert task.sections_done == 0
    kept = task.commit(turn_lever(task))
    assert kept.time == trial.time
    assert np.rad2deg(task.simulation.lever_angle) < -30.0
    assert task.sections_done == 1


def test_undo_takes_back_the_move_and_its_way():
    task = DoorTask(Door())
    before, here = len(task.poses), task.simulation.snapshot().state
    c = turn_lever(task)
    first = task.attempt(c)
    task.commit(c)
    assert len(task.poses) > before
    task.undo()
    assert np.array_equal(task.simulation.snapshot().state, here)
    assert len(task.poses) == before
    again = task.attempt(c)
    assert (again.time, again.outcome) == (first.time, first.outcome)


def test_after_a_collision_the_hand_relaxes_and_after_an_attempt_it_is_back():
    """Where the soft arm pressed against the shut latch it springs back; the spectator sees the start again."""
    task = DoorTask(Door())
    here = task.here.state
    trial = task.attempt(np.array([1.0, 0.0, 0.0, 0.0, -1.0]))  # pull
    assert trial.outcome == "collision"
    assert trial.settled != trial.end
    assert np.array_equal(task.simulation.snapshot().state, here)
    rigid = DoorTask(Door(), relax=0.0)
    assert (trial := rigid.attempt(np.array([1.0, 0.0, 0.0, 0.0, -1.0]))).settled == trial.end


def test_the_path_of_a_kept_move_runs_up_to_where_the_hand_is():
    task = DoorTask(Door())
    task.commit(turn_lever(task))
    assert task.poses[-1].isApprox(task.start, 1e-9) and task.poses[0] != task.start
    steps = [so4_distance(a, b) for a, b in zip(task.poses, task.poses[1:], strict=False)]
    assert 0.0 < max(steps) < 0.08
    task.undo()
    assert task.start.isApprox(task.poses[0], 1e-12) and len(task.poses) == 1 and task.sections_done == 0


def test_a_path_draws_the_base_to_where_it_stands():
    task = DoorTask(Door())
    aside = task.simulation.joints + 0.2 * np.eye(9)[1]
    arm = task.kinematics.posture[3:].copy()
    next(task.track(aside, [task.start]))
    assert np.array_equal(task.kinematics.posture, np.concatenate([aside[:3], arm]))


def test_attempt_leaves_no_trace():
    task = DoorTask(Door())
    rng = np.random.default_rng(4)
    c = rng.uniform(-1, 1, 5)
    first = task.attempt(c)
    for _ in range(3):
        task.attempt(rng.uniform(-1, 1, 5))
    again = task.attempt(c)
    assert again.to_json() == first.to_json()
    assert Trial.from_json(first.to_json()).to_json() == first.to_json()


def test_targets_carry_the_hand_along_the_straight_line():
    """The joint targets, put into the model, place the hand within a millimetre of line and SLERP."""
    task = DoorTask(Door())
    start = task.start
    goal = start * pin.SE3(pin.exp3(np.array([0.0, 0.3, 0.6])), np.array([-0.1, 0.05, 0.05]))
    model, data = task.kinematics.model, task.kinematics.model.createData()
    for i, q in enumerate(task.targets(task.simulation.joints, start, goal), start=1):
        pin.framesForwardKinematics(model, data, q)
        error = data.oMf[model.getFrameId("tool")].actInv(interpolate(start, goal, i / 100))
        assert np.linalg.norm(error.translation) < 1e-3
        assert np.linalg.norm(pin.log3(error.rotation)) < 5e-3
    assert i == 100  # 4 s at 25 Hz


@pytest.mark.parametrize("height", [0.2, 2.5])
def test_a_handle_out_of_reach_is_refused(height):
    with pytest.raises(ValueError, match=r"door = 'handle at .*reach"):
        start_posture(Door(handle_height=height, panel_height=0.3))


@pytest.mark.parametrize(
    ("argument", "value"),
    [("door", None), ("settings", 3), ("space", 3), ("cost", 3), ("relax", -1.0), ("relax", float("nan"))],
)
def test_an_impossible_task_is_refused_by_name(argument, value):
    arguments = {"door": Door(), argument: value}
    with pytest.raises((InvalidType, InvalidValue), match=f"^{argument} = "):
        DoorTask(arguments.pop("door"), **arguments)


@pytest.mark.parametrize("c", [np.full(5, 7.0), np.full(5, np.nan), np.zeros(4)])
def test_a_move_that_is_refused_leaves_no_trace(c):
    task = DoorTask(Door(), seen=False)
    for move in (task.attempt, task.commit):
        with pytest.raises(InvalidValue, match="^c = "):
            move(c)
    with pytest.raises(InvalidValue, match="^undo = "):
        task.undo()
    assert (task.sections_done, len(task.poses)) == (0, 1)


@pytest.mark.parametrize("cost", [lambda *_: None, lambda *_: float("nan")])
def test_a_cost_of_ones_own_must_be_a_number(cost):
    with pytest.raises((InvalidType, InvalidValue), match=r"^cost\(...\) = "):
        DoorTask(Door(), cost=cost, seen=False).attempt(np.zeros(5))


def test_a_simulation_that_breaks_down_while_the_hand_relaxes_is_failed():
    """The warning comes after the collision, the robot is thrown to where it never was: that must not be rewarded."""
    task = DoorTask(Door(), cost=new_pose_cost)
    relax = task.simulation.relax

    def broken(seconds):
        task.simulation.data.qvel[task.simulation.model.joint("door/hinge").dofadr[0]] = 1e12
        return relax(seconds)

    task.simulation.relax = broken
    trial = task.attempt(np.array([1.0, 0.0, 0.0, 0.0, -1.0]))
    assert (trial.outcome, trial.cost) == ("failed", 5.0)


def test_executing_does_not_depend_on_when_the_clock_starts():
    task = DoorTask(Door())
    poses = [task.start, task.start * pin.SE3(pin.exp3(np.array([0.5, 0.0, 0.0])), np.array([0.0, 0.02, -0.05]))]
    ends = [execute(Door(), PoseTrajectory(first + np.array([0.0, 2.0]), poses))[1].joints[-1] for first in (0.0, 9.0)]
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
    with pytest.raises(InvalidType, match="^trajectory = None"):
        execute(Door(), None)


def test_start_posture_on_both_sides_puts_the_hand_on_the_handle():
    for side in ("right", "left"):
        task = DoorTask(Door(side=side))
        assert task.start.translation == pytest.approx([-0.07, 0.30 if side == "right" else -0.30, 1.0], abs=2e-3)


def test_the_base_stands_straight_in_front_of_a_handle_that_is_turned(tmp_path):
    path = tmp_path / "turned.xml"
    path.write_text("""<mujoco><worldbody><body><joint name="h"/><geom size=".1" contype="0" conaffinity="0"/>
        <site name="g" pos=".2 .3 1" euler="0 0 35"/></body></worldbody></mujoco>""")
    task = DoorTask(Door.from_mjcf(path, hinge="h", grip="g"), seen=False)
    assert task.start.translation == pytest.approx([0.2, 0.3, 1.0], abs=2e-3)
    x, y, yaw = task.simulation.joints[:3]
    assert np.rad2deg(yaw) == pytest.approx(35.0, abs=0.2)
    toward = np.array([0.2 - x, 0.3 - y])
    assert np.linalg.norm(toward) > 0.3
    level = task.simulation.data.site("tool").xmat.reshape(3, 3)
    assert level[:2, 0] == pytest.approx([np.cos(np.deg2rad(35.0)), np.sin(np.deg2rad(35.0))], abs=0.01)


def test_execute_follows_a_known_way_and_not_a_wrong_one():
    """The ideal way opens the door, the same way without turning the lever does not."""
    task = DoorTask(Door())
    spindle = np.array([-0.07, 0.42, 1.0])
    lever = [pin.exp3(np.array([np.deg2rad(a), 0.0, 0.0])) for a in (0.0, 15.0, 30.0, 44.0)]
    down = [pin.SE3(R @ task.start.rotation, spindle + R @ (task.start.translation - spindle)) for R in lever]
    swing = [pin.SE3(pin.exp3(np.array([0.0, 0.0, np.deg2rad(a)])), np.zeros(3)) for a in range(10, 100, 10)]
    for first, opens in ((down, True), (down[:1], False)):
        poses = first + [turn * first[-1] for turn in swing]
        angle, trace = execute(Door(), PoseTrajectory(2.0 * np.arange(len(poses)), poses), Settings(stiffness=0.3))
        assert (angle >= np.pi / 2) == opens
        assert (trace.outcome == "opened") == opens
