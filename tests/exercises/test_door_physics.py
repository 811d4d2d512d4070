"""The rules of physics at the door: honest moves pass, and whatever no hand can do is named."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from tests.exercises.by_heart import ideal_path
from tutorialbot.bo.objective import DoorTask
from tutorialbot.checks import door_physics
from tutorialbot.checks.door_motion import OPEN_ANGLE
from tutorialbot.checks.guard import Wrong
from tutorialbot.scene.door import Door
from tutorialbot.scene.simulation import Settings
from tutorialbot.trajectory import PoseTrajectory

DOOR = Door()


@pytest.fixture(scope="module")
def task():
    return DoorTask(DOOR, settings=Settings(stiffness=1.0))


@pytest.fixture(scope="module")
def honest(task):
    return door_physics.replay(DOOR, ideal_path(DOOR, task.start))


def move(task, angle=1.7, between=None, latest=np.inf):
    """Follow the ideal path from the shut door; `between(simulation, step)` may meddle before each joint target."""
    simulation = task.simulation
    simulation.restore(task.here)
    simulation.watch = []
    path = ideal_path(DOOR, task.start, angle)
    period = simulation.settings.control_period

    def targets():
        poses = map(path.sample, np.arange(period, min(latest, path.duration + 0.5), period))
        for step, goal in enumerate(task.track(simulation.joints, poses)):
            if between is not None:
                between(simulation, step)
            yield goal

    trace = simulation.follow(targets(), stop=False)
    record = door_physics.Record.of(trace, simulation.watch)
    simulation.data.xfrc_applied[:], simulation.data.qfrc_applied[:] = 0.0, 0.0
    return record


def test_an_honest_opening_passes(honest):
    door_physics.judge(DOOR, honest)
    assert np.rad2deg(honest.hinge.max()) > 85.0


@pytest.mark.parametrize(
    "door", [Door(side="left"), Door(spindle_radius=0.5, lever_length=0.10), Door(hinge_damping=4.0)]
)
def test_honest_openings_of_other_doors_pass(door):
    record = door_physics.replay(door, ideal_path(door, DoorTask(door).start))
    door_physics.judge(door, record)
    assert np.rad2deg(record.hinge.max()) > 80.0


def test_the_path_learnt_by_heart_would_open_the_notebooks_door(honest):
    """So it is the unknown door, not a bad path, that makes `door_of_the_notebook_learnt_by_heart` fail."""
    assert np.rad2deg(honest.hinge.max()) > np.rad2deg(OPEN_ANGLE)


def test_the_work_of_the_hand_and_the_spring_is_the_heat_in_the_hinge(honest):
    work = door_physics.reconstruct(DOOR, honest).work[-1] + door_physics.released(DOOR, honest)
    assert work == pytest.approx(door_physics.losses(DOOR, honest), rel=0.25)


def rejected(record, check, door=DOOR):
    with pytest.raises(Wrong) as caught:
        door_physics.judge(door, record)
    assert caught.value.check == check


def test_a_door_that_is_teleported_in_the_middle_of_a_move_is_named(task):
    def teleport(simulation, step):
        if step == 60:
            simulation.data.qpos[simulation._hinge] = 1.2

    rejected(move(task, between=teleport), "the handle moves with the hand")


def test_a_hand_that_never_held_the_handle_is_named(task):
    def let_go(simulation, step):
        simulation.data.eq_active[simulation._grasp] = 0

    rejected(move(task, between=let_go), "the hand holds the handle")


def test_a_latch_that_is_switched_off_is_named(task):
    simulation = task.simulation
    simulation.restore(task.here)
    start = task.start
    swing = [pin.SE3(pin.exp3(np.array([0, 0, a])), np.zeros(3)) * start for a in np.linspace(0.0, 1.0, 9)]
    path = PoseTrajectory(2.0 * np.arange(9), swing)
    simulation.watch = []

    def targets():
        for goal in task.track(simulation.joints, map(path.sample, np.arange(0.04, 16.0, 0.04))):
            simulation.data.eq_active[simulation._latch] = 0
            yield goal

    trace = simulation.follow(targets(), stop=False)
    record = door_physics.Record.of(trace, simulation.watch)
    assert np.rad2deg(record.hinge.max()) > 30.0
    rejected(record, "the lever opens the latch")


@pytest.mark.parametrize("how", ["qfrc", "xfrc"])
def test_a_force_out_of_nothing_is_named(task, how):
    """The robot goes the right way, but a ghost pushes and the hand only brakes: it takes energy out of the door."""

    def push(simulation, step):
        if step < 200:
            return
        if how == "qfrc":
            simulation.data.qfrc_applied[simulation.model.joint("door/hinge").dofadr[0]] = 6.0
        else:
            simulation.data.xfrc_applied[simulation.model.body("door/panel").id, 5] = 6.0

    rejected(move(task, between=push), "the hand does the work")


def test_brute_force_is_named(honest):
    wrench = honest.wrench.copy()
    wrench[100, 0] = 300.0
    rejected(replace(honest, wrench=wrench), "no brute force")
    wrench[100, :] = 0.0, 0.0, 0.0, 0.0, 80.0, 0.0
    rejected(replace(honest, wrench=wrench), "no brute force")


def test_a_record_without_a_wrench_is_named(honest):
    rejected(replace(honest, wrench=np.zeros_like(honest.wrench)), "the hand does the work")


def test_an_empty_move_proves_nothing_wrong(honest):
    empty = np.zeros(0)
    door_physics.judge(DOOR, door_physics.Record(empty, np.zeros((0, 9)), np.zeros((0, 6)), empty, empty, 0.0))
