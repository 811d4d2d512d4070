"""The door trial: what is felt, when it ends, and that a snapshot is as good as doing everything again."""

from dataclasses import fields, replace

import numpy as np
import pytest

from tutorialbot.bo.objective import DoorTask
from tutorialbot.scene import control
from tutorialbot.scene.door import Door
from tutorialbot.scene.simulation import CASTERS, DRIVE_RATE, STEER_RATE, DoorSimulation, Settings, Trace

TURN_LEVER = np.array([0.5, -0.88, 0.0, 0.0, -0.1])  # points of the cube that do something
PULL = np.array([1.0, 0.0, 0.5, 1.0, -0.7])


@pytest.fixture(scope="module")
def task():
    return DoorTask(Door(), seed=3)


def still(simulation, seconds):
    goal = simulation.joints
    return (goal for _ in range(round(seconds / simulation.settings.control_period)))


def moves(count):
    rng = np.random.default_rng(11)
    return [rng.uniform(-1, 1, 5) for _ in range(count)]


def run(task, c):
    """One move from where the simulation stands; all that it leaves behind."""
    simulation = task.simulation
    simulation.begin()
    trace = simulation.follow(
        task.targets(simulation.joints, simulation.tool_pose, task.space.goal(simulation.tool_pose, c))
    )
    return np.concatenate([trace.wrench.ravel(), simulation.data.qpos, simulation.data.qvel, simulation.data.act])


@pytest.mark.parametrize("before", [0, 1, 3, 5])
def test_snapshot_is_bit_exact_against_replay(before):
    """Restoring, after the state was wrecked, gives the very numbers that doing all moves again gives; sensor noise
    included.
    """
    settings = Settings(force_noise=0.5, torque_noise=0.1)
    restored, replayed = (DoorTask(Door(), settings=settings, seed=5) for _ in range(2))
    for c in moves(before):
        run(restored, c)
    snapshot = restored.simulation.snapshot()
    run(restored, TURN_LEVER), run(restored, PULL)
    restored.simulation.data.qvel[:] += 1.0
    restored.simulation.restore(snapshot)
    for c in moves(before):
        run(replayed, c)
    assert np.array_equal(run(restored, PULL), run(replayed, PULL))


@pytest.mark.parametrize("part", ["reference", "velocity", "noise", "state"])
def test_a_snapshot_without_one_part_is_caught(part):
    """The planted fault: leave one part of the snapshot out, in the middle of a move, and the numbers differ."""
    task = DoorTask(Door(), settings=Settings(force_noise=0.5), seed=5)
    simulation = task.simulation
    goal = simulation.joints + 0.1
    simulation.follow(goal for _ in range(5))
    whole = simulation.snapshot()
    after = simulation.follow((goal for _ in range(5)), stop=False).wrench
    faulty = replace(whole, **{part: getattr(simulation.snapshot(), part)})
    simulation.restore(whole)
    assert np.array_equal(simulation.follow((goal for _ in range(5)), stop=False).wrench, after)
    simulation.restore(faulty)
    assert not np.array_equal(simulation.follow((goal for _ in range(5)), stop=False).wrench, after)


def test_tare_removes_the_weight_of_the_hand():
    door, posture = Door(), DoorTask(Door()).simulation.joints
    weight = 0.6 * 9.81
    for tare, expected in ((True, 0.0), (False, weight)):
        simulation = DoorSimulation(door, posture, Settings(tare=tare))
        assert simulation.follow(still(simulation, 1.0)).force[-1] == pytest.approx(expected, abs=1.0)


@pytest.mark.parametrize("wrist", [(0.0, 0.79, 0.0), (0.7, 0.79, 0.0), (0.0, 0.1, 0.9), (-0.8, 1.3, -1.2)])
def test_tare_follows_the_hand_as_it_tilts(task, wrist):
    """A free hand that rests in any attitude feels nothing once tared, and its weight at its centre of mass if not."""
    wrenches = {}
    for tare in (True, False):
        simulation = DoorSimulation(Door(), task.simulation.joints, Settings(tare=tare, stiffness=1.0))
        simulation.data.eq_active[simulation._grasp] = 0
        simulation.data.qpos[simulation._qpos[6:]] = wrist
        simulation.data.qpos[simulation._qpos[0]] -= 0.5  # away from the door
        simulation.begin()
        wrenches[tare] = simulation.follow(still(simulation, 2.0), stop=False).wrench[-1]
    assert wrenches[True] == pytest.approx(np.zeros(6), abs=0.02)
    up = simulation.data.site("wrist").xmat.reshape(3, 3).T @ [0.0, 0.0, 1.0]
    hand = simulation.model.site("wrist").bodyid[0]
    arm = simulation.data.site("wrist").xmat.reshape(3, 3).T @ (
        simulation.data.xipos[hand] - simulation.data.site("wrist").xpos
    )
    weight = 9.81 * simulation.model.body_mass[hand] * up
    assert wrenches[False] == pytest.approx(np.concatenate([weight, np.cross(arm, weight)]), abs=0.02)
    assert np.linalg.norm(wrenches[False][3:]) > 0.1  # there is a torque to be taken off


@pytest.mark.parametrize(("limits", "part"), [((40.0, 1e6), "force"), ((1e6, 8.0), "torque")])
def test_either_threshold_alone_ends_a_move(limits, part):
    task = DoorTask(Door(), settings=Settings(force_limit=limits[0], torque_limit=limits[1]))
    assert task.attempt(PULL).outcome == "collision"
    assert task.trace.times == pytest.approx(0.01 * np.arange(1, len(task.trace.times) + 1))  # it looks every 10 ms
    felt, limit = getattr(task.trace, part), max(min(limits), 8.0)
    assert felt[-1] > limit and (felt[:-1] <= limit).all()


@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.005])
def test_a_move_takes_the_time_it_is_given_whatever_the_step(timestep):
    simulation = DoorTask(Door(), settings=Settings(timestep=timestep)).simulation
    before = simulation.data.time
    trace = simulation.follow(still(simulation, 0.4))
    assert (simulation.model.opt.timestep, trace.outcome) == (timestep, "finished")
    assert trace.time == pytest.approx(0.4) == simulation.data.time - before


def test_noise_is_that_of_its_own_part():
    """Standard deviations of 2 N and 0 Nm, then of 0 N and 0.3 Nm, on a hand that is held still."""
    clean = DoorTask(Door()).simulation
    quiet = clean.follow(still(clean, 2.0), stop=False).wrench
    for force, torque in ((2.0, 0.0), (0.0, 0.3)):
        noisy = DoorTask(Door(), settings=Settings(force_noise=force, torque_noise=torque)).simulation
        added = noisy.follow(still(noisy, 2.0), stop=False).wrench - quiet
        assert added[:, :3].std() == pytest.approx(force, rel=0.1, abs=1e-12)
        assert added[:, 3:].std() == pytest.approx(torque, rel=0.1, abs=1e-12)


def test_a_move_begins_at_rest_with_empty_integrals():
    simulation = DoorTask(Door()).simulation
    goal = simulation.joints + 0.1
    simulation.follow((goal for _ in range(8)), stop=False)
    assert np.abs(simulation.data.act).max() > 1e-3 and np.abs(simulation._velocity).max() > 0.0
    simulation.begin()
    assert not simulation.data.act.any() and not simulation._velocity.any()
    assert np.array_equal(simulation._reference, simulation.joints)


def test_casters_take_the_twist_in_the_bases_own_frame_and_limit_it():
    """The base stands turned by 40 degrees and is told to go along the world's x, faster than its wheels can steer."""
    simulation = DoorTask(Door()).simulation
    yaw = np.deg2rad(40.0)
    simulation.data.qpos[simulation._qpos[2]] = yaw
    simulation.begin()
    simulation._steer = [1.2, 1.2]
    simulation._velocity[0] = 0.5
    before, steer = simulation._reference.copy(), np.array(simulation._steer)
    simulation._command(before + np.array([5.0, 0, 0, 0, 0, 0, 0, 0, 0]), 0.04)
    wish = np.array([0.5 * np.cos(yaw), -0.5 * np.sin(yaw), 0.0])
    twist = control.limit(CASTERS, wish, steer, STEER_RATE, DRIVE_RATE)
    assert np.linalg.norm(twist) < 0.9 * np.linalg.norm(wish)  # the limit is felt
    steer_rates, drive_rates = control.to_casters(CASTERS, twist, steer)
    assert simulation._steer == pytest.approx(steer + 0.04 * steer_rates, abs=1e-12)
    moved = simulation._reference - before
    assert moved[:2] == pytest.approx([0.04 * np.linalg.norm(twist), 0.0], abs=1e-12)
    assert simulation._velocity[0] == pytest.approx(np.linalg.norm(twist), abs=1e-12)


def test_a_blocked_move_ends_as_collision_at_the_threshold(task):
    trial = task.attempt(PULL)  # the latch holds
    assert trial.outcome == "collision"
    force, torque = task.trace.force, task.trace.torque
    assert force[-1] > 40.0 or torque[-1] > 8.0
    assert (force[:-1] <= 40.0).all()
    assert (torque[:-1] <= 8.0).all()
    assert trial.time == pytest.approx(task.trace.times[-1])


def test_a_softer_arm_collides_later():
    times = [DoorTask(Door(), settings=Settings(stiffness=k)).attempt(PULL).time for k in (0.05, 0.12, 1.0)]
    assert times[0] > times[1] > times[2]


@pytest.mark.parametrize(("stiffness", "expected"), [(1.0, (8.0, 1.7, 1.3)), (0.12, (1.3, 0.21, 0.14))])
def test_stiffness_of_the_hand_is_what_settings_say(stiffness, expected):
    """Push the free hand by 5 N along each axis for a second; expected in kN/m."""
    task = DoorTask(Door(), settings=Settings(stiffness=stiffness))
    simulation = task.simulation
    for axis in range(3):
        simulation.restore(task.here)
        simulation.begin()
        simulation.data.eq_active[simulation._grasp] = 0
        force = simulation.data.xfrc_applied[simulation.model.site("tool").bodyid[0]]
        force[axis] = 5.0
        before = simulation.tool_pose.translation[axis]
        simulation.follow(still(simulation, 1.0), stop=False)
        force[axis] = 0.0
        assert 0.005 / (simulation.tool_pose.translation[axis] - before) == pytest.approx(expected[axis], rel=0.1)


def test_the_robot_knows_nothing_of_the_door():
    assert {field.name for field in fields(Trace)} == {"times", "wrench", "joints", "outcome", "time"}


def test_latch_has_hysteresis():
    simulation = DoorTask(Door()).simulation
    active = []
    for degrees in (-30.0, -36.0, -30.0, -27.0):
        simulation.data.qpos[simulation._handle] = np.deg2rad(degrees)
        simulation._switch_latch()
        active.append(int(simulation.data.eq_active[simulation._latch]))
    assert active == [1, 0, 0, 1]


def test_latch_does_not_catch_an_open_door():
    simulation = DoorTask(Door()).simulation
    simulation.data.eq_active[simulation._latch] = 0
    simulation.data.qpos[simulation._hinge] = np.deg2rad(10.0)
    simulation._switch_latch()
    assert not simulation.data.eq_active[simulation._latch]


@pytest.mark.parametrize("value", [np.nan, 1e12])
def test_a_broken_simulation_is_never_a_success(task, value):
    """A door thrown wide open by a number that MuJoCo warns of must count as failed."""
    simulation = task.simulation
    simulation.restore(task.here)

    def targets():
        yield simulation.joints
        simulation.data.qvel[simulation.model.joint("door/hinge").dofadr[0]] = value
        yield from still(simulation, 0.2)

    assert simulation.follow(targets()).outcome == "failed"
    simulation.restore(task.here)
    assert simulation.follow(still(simulation, 0.2)).outcome == "finished"


def test_a_stiff_spring_that_blows_up_is_failed_not_opened():
    task = DoorTask(Door(lever_preload=0.0), settings=Settings(timestep=0.01, stiffness=1.0))
    lever = task.simulation.model.joint("door/lever")
    lever.stiffness = 3000.0 * np.eye(1, np.size(lever.stiffness)).ravel()  # no `Door` of ours may have that
    task.simulation.model.dof_armature[:] = 0.0
    task.simulation.model.opt.disableflags |= 1 << 8  # whatever happens now
    outcomes = {task.attempt(c).outcome for c in moves(5)}
    assert "failed" in outcomes and "opened" not in outcomes


def test_casters_roll_as_their_equations_say(task):
    """The loop written out for plain floats agrees with control.to_casters and control.limit."""
    simulation = DoorSimulation(Door(), task.simulation.joints)
    rng = np.random.default_rng(2)
    for _ in range(50):
        twist, steer = rng.uniform(-1.5, 1.5, 3), rng.uniform(-np.pi, np.pi, 2)
        simulation._steer, simulation._drive = steer.tolist(), [0.0, 0.0]
        share = simulation._roll(*twist, 0.04)
        limited = control.limit(CASTERS, twist, steer, STEER_RATE, DRIVE_RATE)
        assert share * twist == pytest.approx(limited, abs=1e-12)
        steer_rates, drive_rates = control.to_casters(CASTERS, limited, steer)
        assert simulation._steer == pytest.approx(steer + 0.04 * steer_rates, abs=1e-12)
        assert simulation._drive == pytest.approx(0.04 * drive_rates, abs=1e-12)


def test_wheels_turn_when_the_base_moves():
    simulation = DoorTask(Door()).simulation
    simulation.data.eq_active[simulation._grasp] = 0
    goal = simulation.joints + np.array([-0.2, 0.1, 0, 0, 0, 0, 0, 0, 0])
    simulation.follow((goal for _ in range(75)), stop=False)
    assert simulation.joints[:2] == pytest.approx(goal[:2], abs=0.01)
    for name in ("caster_left_drive", "caster_right_drive", "caster_left_steer"):
        assert abs(float(simulation.data.joint(name).qpos[0])) > 0.3


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("force_limit", 0.0),
        ("torque_limit", -8.0),
        ("stiffness", float("nan")),
        ("open_angle", 4.0),
        ("timestep", 0.0),
        ("control_period", 0.001),
        ("control_period", 0.045),
        ("control_period", 40.0),
        ("sensor_period", 0.003),
        ("timestep", 1e-9),
        ("timestep", 0.5),
        ("force_noise", -1.0),
        ("force_limit", "40"),
        ("tare", "no"),
    ],
)
def test_impossible_settings_are_refused_by_name(argument, value):
    with pytest.raises((ValueError, TypeError), match=argument):
        Settings(**{argument: value})
